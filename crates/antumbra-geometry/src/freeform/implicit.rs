//! Implicit surfaces: whether a segment changes sides of one, by samples that are never all taken.

use std::sync::OnceLock;

use glam::DVec3;

use super::field::{Field, Frame, MAX_DEGREE, MAX_TERMS};
use super::value::{Range, Slope, Value};
use crate::Bounds;
use crate::number::Sign;
use crate::segment::Segment;

/// The zeros of a field within a box, both sides alike: an implicit surface.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Implicit {
    /// The field.
    pub field: Field,
    /// Smallest coordinates of the box, world space.
    pub low: DVec3,
    /// Largest coordinates of the box, world space.
    pub high: DVec3,
}

/// Reason why an implicit surface is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplicitError {
    /// A number is NaN, infinite or beyond 2^100.
    #[error("a number is not finite or its magnitude exceeds 2^100")]
    BadNumber,
    /// The box holds nothing.
    #[error("the box of an implicit surface must have a size along each axis")]
    EmptyBox,
    /// A number that must be positive is not.
    #[error("{0} must be positive")]
    NotPositive(&'static str),
    /// The axis of a torus has no length.
    #[error("the axis of a torus must not be zero")]
    NoAxis,
    /// Too few or too many terms or balls.
    #[error("{found} {what}: there may be 1 to {MAX_TERMS}")]
    Count {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
    },
    /// The exponents of a term are too large.
    #[error("the exponents of a term add up to {found}: they may to {MAX_DEGREE}")]
    Degree {
        /// Their sum.
        found: u64,
    },
}

const LARGEST: f64 = 1.2676506002282294e30; // 2^100

impl Implicit {
    /// Returns the box.
    pub fn bounds(&self) -> Bounds {
        Bounds {
            min: self.low,
            max: self.high,
        }
    }

    /// Returns the torus in the box that it just fits into.
    pub fn torus(center: DVec3, axis: DVec3, major: f64, minor: f64) -> Self {
        let along = axis / axis.length();
        // A circle across the axis reaches this far along each axis of the world.
        let reach = (DVec3::ONE - along * along).max(DVec3::ZERO).map(f64::sqrt) * major;
        // Room for what is well outside.
        let reach = reach + DVec3::splat(minor * 1.125);
        let field = Field::Torus {
            center,
            axis,
            major,
            minor,
        };
        Self {
            field,
            low: center - reach,
            high: center + reach,
        }
    }

    /// Returns the field's values at points of space: negative inside. The surface must be [fine](Implicit::check).
    pub fn values_at(&self, points: impl IntoIterator<Item = DVec3>) -> Vec<f64> {
        let level = Level::new(self.clone());
        let points = points.into_iter();
        points.map(|point| level.value_at(point)).collect()
    }

    /// Returns the unit normals at points near the surface, outwards; zero where there is none.
    pub fn normals_at(&self, points: impl IntoIterator<Item = DVec3>) -> Vec<DVec3> {
        let level = Level::new(self.clone());
        let normal = |point| {
            let normal = level.normal(point);
            (normal / normal.abs().max_element()).normalize_or_zero()
        };
        points.into_iter().map(normal).collect()
    }

    /// Tells what is wrong with it.
    ///
    /// # Errors
    /// A number is not finite, too large or not positive where it must be; the box has no size.
    pub fn check(&self) -> Result<(), ImplicitError> {
        let is_fine = |value: f64| value.is_finite() && value.abs() <= LARGEST;
        let is_vector_fine = |vector: DVec3| vector.to_array().into_iter().all(is_fine);
        let positive = |what: &'static str, value: f64| match value {
            value if !is_fine(value) => Err(ImplicitError::BadNumber),
            value if value <= 0.0 || 1.0 / value > LARGEST => Err(ImplicitError::NotPositive(what)),
            _ => Ok(()),
        };
        let count = |what: &'static str, found: usize| match found {
            1..=MAX_TERMS => Ok(()),
            _ => Err(ImplicitError::Count { what, found }),
        };
        if !is_vector_fine(self.low) || !is_vector_fine(self.high) {
            return Err(ImplicitError::BadNumber);
        }
        let center = match &self.field {
            Field::Torus {
                center,
                axis,
                major,
                minor,
            } => {
                positive("the radius of a torus", *major)?;
                positive("the radius of the tube of a torus", *minor)?;
                if !is_vector_fine(*axis) {
                    return Err(ImplicitError::BadNumber);
                }
                if *axis == DVec3::ZERO {
                    return Err(ImplicitError::NoAxis);
                }
                *center
            }
            Field::Metaballs { balls, threshold } => {
                count("balls", balls.len())?;
                positive("the threshold of metaballs", *threshold)?;
                for ball in balls {
                    positive("the radius of a ball", ball.radius)?;
                    if !is_vector_fine(ball.center) || !is_fine(ball.strength / threshold) {
                        return Err(ImplicitError::BadNumber);
                    }
                }
                DVec3::ZERO
            }
            Field::Gyroid {
                center,
                period,
                level,
            } => {
                positive("the period of a gyroid", *period)?;
                if !is_fine(*level) {
                    return Err(ImplicitError::BadNumber);
                }
                *center
            }
            Field::Polynomial {
                center,
                unit,
                terms,
            } => {
                count("terms", terms.len())?;
                positive("the unit of a polynomial", *unit)?;
                for term in terms {
                    let found = term
                        .exponents
                        .iter()
                        .map(|&exponent| u64::from(exponent))
                        .sum();
                    if found > u64::from(MAX_DEGREE) {
                        return Err(ImplicitError::Degree { found });
                    }
                    if !is_fine(term.factor) {
                        return Err(ImplicitError::BadNumber);
                    }
                }
                *center
            }
        };
        if !is_vector_fine(center) {
            Err(ImplicitError::BadNumber)
        } else if !self.low.cmplt(self.high).all() {
            Err(ImplicitError::EmptyBox)
        } else {
            Ok(())
        }
    }
}

/// Steps that a segment is cut into within the box: where both ends of a shorter stretch are on one side, so is all of it.
const STEPS: u32 = 1 << 14;

/// Values within this share of the field's scale are zero: the segment touches there.
const TOUCH: f64 = 1.0 / (1_u64 << 40) as f64;

/// How deep inside, as a share of the scale, all of a box must be to be surely inside.
const DEEP: f64 = 1.0 / 64.0;

/// An implicit surface, ready for queries.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    surface: Implicit,
    frame: Frame,
    scale: f64,
    boxes: OnceLock<Boxes>,
}

/// Known regions of a surface's box (Paper 9.1).
#[derive(Clone, Debug, Default)]
pub(crate) struct Boxes {
    /// The surface is in these.
    pub(crate) outer: Vec<Bounds>,
    /// All of these are deep inside. None where the surface is cut by its box.
    pub(crate) inner: Vec<Bounds>,
}

/// A segment within the box of a surface, in the field's own coordinates.
struct Path {
    start: DVec3,
    direction: DVec3,
    shares: [f64; 2],
    /// The last sample.
    last: u32,
    /// The field's value that counts as zero.
    zero: f64,
}

impl Path {
    fn share(&self, sample: u32) -> f64 {
        let [from, to] = self.shares;
        from + (to - from) * (f64::from(sample) / f64::from(STEPS))
    }

    fn at(&self, share: f64) -> [f64; 3] {
        (self.start + self.direction * share).to_array()
    }
}

impl Level {
    pub(crate) fn new(surface: Implicit) -> Self {
        let frame = surface.field.frame();
        let corners = surface.bounds().corners();
        let extent = corners.iter().fold(0.0_f64, |most, &corner| {
            most.max(frame.point(corner).abs().max_element())
        });
        let scale = surface.field.scale(extent);
        Self {
            surface,
            frame,
            scale,
            boxes: OnceLock::new(),
        }
    }

    pub(crate) fn surface(&self) -> &Implicit {
        &self.surface
    }

    pub(crate) fn bounds(&self) -> Bounds {
        self.surface.bounds()
    }

    pub(crate) fn memory_bytes(&self) -> u64 {
        let held = match &self.surface.field {
            Field::Metaballs { balls, .. } => size_of_val(balls.as_slice()),
            Field::Polynomial { terms, .. } => size_of_val(terms.as_slice()),
            Field::Torus { .. } | Field::Gyroid { .. } => 0,
        };
        (size_of::<Self>() + held) as u64
    }

    fn value<V: Value>(&self, point: [V; 3]) -> V {
        self.surface.field.at(point, &self.frame)
    }

    fn value_at(&self, point: DVec3) -> f64 {
        self.value(self.frame.point(point).to_array())
    }

    fn slope(&self, point: DVec3, direction: DVec3) -> f64 {
        let (point, direction) = (point.to_array(), direction.to_array());
        let coordinate = |i: usize| Slope {
            value: point[i],
            slope: direction[i],
        };
        self.value([0, 1, 2].map(coordinate)).slope
    }

    fn gradient(&self, point: DVec3) -> DVec3 {
        let local = self.frame.point(point);
        let [x, y, z] = DVec3::AXES.map(|axis| self.slope(local, axis));
        self.frame.outwards([x, y, z])
    }

    /// Returns the normal at a point, outwards, any length; zero where there is none.
    pub(crate) fn normal(&self, point: DVec3) -> DVec3 {
        self.gradient(point)
    }

    /// Returns the way from a point to the surface, to first order (EXACTNESS.md, "Implicit surfaces"); `None` where the field has
    /// no slope, so that nothing is known of it.
    pub(crate) fn way_from(&self, point: DVec3) -> Option<DVec3> {
        let inside = point.clamp(self.surface.low, self.surface.high);
        let gradient = self.gradient(inside);
        let square = gradient.length_squared();
        let way = gradient * (-self.value_at(inside) * self.frame.unit() / square);
        way.is_finite().then(|| way + (inside - point))
    }

    /// Returns on which side of the surface through the start the light is; positive is outside.
    pub(crate) fn side(&self, segment: &Segment) -> Sign {
        let start = self.frame.point(segment.origin());
        let slope = self.slope(start, self.frame.vector(segment.direction()));
        if slope > 0.0 {
            Sign::Positive
        } else if slope < 0.0 {
            Sign::Negative
        } else {
            Sign::Zero
        }
    }

    /// Returns whether the segment changes sides of the surface.
    pub(crate) fn is_crossed(&self, segment: &Segment) -> bool {
        self.path(segment, 0.0)
            .is_some_and(|path| self.change(&path, Sign::Zero, 0).is_some())
    }

    /// Returns the same for a start on the surface: of the level of the field that goes through the start.
    pub(crate) fn own_is_crossed(&self, segment: &Segment) -> bool {
        self.own_change(segment).is_some()
    }

    fn own_change(&self, segment: &Segment) -> Option<(Path, u32)> {
        let path = self.path(segment, self.value_at(segment.origin()))?;
        let sample = self.change(&path, self.side(segment), 1)?;
        Some((path, sample))
    }

    /// Returns how far the first change of sides is, in lengths of the segment's direction.
    pub(crate) fn crossing(&self, segment: &Segment, is_own: bool) -> Option<f64> {
        let (path, sample) = if is_own {
            self.own_change(segment)?
        } else {
            let path = self.path(segment, 0.0)?;
            let sample = self.change(&path, Sign::Zero, 0)?;
            (path, sample)
        };
        let is_above = |share: f64| self.value(path.at(share)) > path.zero;
        let (mut from, mut to) = (path.share(sample.saturating_sub(1)), path.share(sample));
        let beyond = is_above(to);
        for _ in 0..48 {
            let middle = 0.5 * (from + to);
            if is_above(middle) == beyond {
                to = middle;
            } else {
                from = middle;
            }
        }
        Some(to)
    }

    /// Cuts a segment at the box; `None` where it passes by.
    fn path(&self, segment: &Segment, zero: f64) -> Option<Path> {
        let (origin, direction) = (segment.origin(), segment.direction());
        let end = if segment.is_finite() {
            1.0
        } else {
            f64::INFINITY
        };
        let mut shares = [0.0_f64, end];
        for axis in 0..3 {
            let (low, high) = (self.surface.low[axis], self.surface.high[axis]);
            let (from, along) = (origin[axis], direction[axis]);
            if along == 0.0 {
                if from < low || from > high {
                    return None;
                }
                continue;
            }
            let (one, other) = ((low - from) / along, (high - from) / along);
            shares = [shares[0].max(one.min(other)), shares[1].min(one.max(other))];
        }
        let is_met = shares[0] <= shares[1] && shares[1].is_finite();
        if !is_met {
            return None;
        }
        // The light's own end is open.
        let last = STEPS - u32::from(shares[1] == end);
        Some(Path {
            start: self.frame.point(origin),
            direction: self.frame.vector(direction),
            shares,
            last,
            zero,
        })
    }

    /// Returns the first sample, from one on, that is on another side than those before it.
    fn change(&self, path: &Path, mut side: Sign, first: u32) -> Option<u32> {
        let width = TOUCH * self.scale;
        let side_of = |low: f64, high: f64| {
            if low > width {
                Some(Sign::Positive)
            } else if high < -width {
                Some(Sign::Negative)
            } else if low >= -width && high <= width {
                Some(Sign::Zero)
            } else {
                None
            }
        };
        let mut waiting = Vec::with_capacity(32);
        waiting.push((first, path.last));
        while let Some((from, to)) = waiting.pop() {
            let (one, other) = (path.at(path.share(from)), path.at(path.share(to)));
            let range = self.value([0, 1, 2].map(|i: usize| Range::between(one[i], other[i])))
                - Range::constant(path.zero);
            let found = if from == to {
                let value = self.value(one) - path.zero;
                side_of(value, value).unwrap_or(Sign::Zero)
            } else {
                let may_change = match side {
                    Sign::Positive => range.low < -width,
                    Sign::Negative => range.high > width,
                    Sign::Zero => true,
                };
                if !may_change {
                    continue;
                }
                match side_of(range.low, range.high) {
                    Some(found) => found,
                    None => {
                        let middle = from + (to - from) / 2;
                        waiting.push((middle + 1, to));
                        waiting.push((from, middle));
                        continue;
                    }
                }
            };
            match (side, found) {
                (_, Sign::Zero) => {}
                (Sign::Zero, _) => side = found,
                _ if side != found => return Some(from),
                _ => {}
            }
        }
        None
    }

    /// Returns whether a start is so near to the surface that the levels through both have the same inner boxes.
    pub(crate) fn is_near(&self, point: DVec3) -> bool {
        self.value_at(point).abs() <= 0.5 * DEEP * self.scale
    }

    /// Returns where the surface is and where is deep inside.
    pub(crate) fn boxes(&self) -> &Boxes {
        self.boxes.get_or_init(|| self.make_boxes())
    }

    fn range_in(&self, bounds: &Bounds) -> Range {
        let local = Bounds::of_points(bounds.corners().map(|corner| self.frame.point(corner)));
        // Corners round; points within do, too.
        let room = TOUCH * (local.largest_coordinate() + 1.0);
        let local = local.inflated(DVec3::splat(room));
        let (low, high) = (local.min.to_array(), local.max.to_array());
        self.value([0, 1, 2].map(|i: usize| Range::between(low[i], high[i])))
    }

    fn make_boxes(&self) -> Boxes {
        // Whether a shaft misses all outer boxes is asked often, so they are coarse.
        const HALVINGS: u32 = 5;
        const FINER_THAN_OUTER: u32 = 2;
        const MOST_INNER: usize = 16;
        let mut boxes = Boxes::default();
        let mut waiting = vec![(self.bounds(), HALVINGS)];
        while let Some((bounds, halvings)) = waiting.pop() {
            let range = self.range_in(&bounds);
            if range.low > 2.0 * TOUCH * self.scale {
                continue;
            }
            if range.high < -DEEP * self.scale {
                boxes.inner.push(bounds);
                continue;
            }
            if halvings == FINER_THAN_OUTER {
                boxes.outer.push(bounds);
            }
            if halvings > 0 {
                let middle = bounds.center();
                let eighth = |corner: DVec3| Bounds {
                    min: corner.min(middle),
                    max: corner.max(middle),
                };
                let eighths = bounds.corners().map(eighth);
                waiting.extend(eighths.map(|eighth| (eighth, halvings - 1)));
            }
        }
        if !self.is_outside_at_its_box() {
            boxes.inner.clear();
        }
        // Few and large ones: they are asked one by one.
        let volume = |bounds: &Bounds| bounds.size().element_product();
        boxes
            .inner
            .sort_by(|one, other| volume(other).total_cmp(&volume(one)));
        boxes.inner.truncate(MOST_INNER);
        for bounds in &mut boxes.inner {
            self.grow(bounds);
        }
        boxes
    }

    /// Grows a box that is deep inside, side by side, as long as all of it is.
    fn grow(&self, bounds: &mut Bounds) {
        const MOST_STEPS: usize = 8;
        let whole = self.bounds();
        let step = bounds.size();
        for _ in 0..MOST_STEPS {
            let before = *bounds;
            for axis in 0..3 {
                for is_up in [false, true] {
                    let mut grown = *bounds;
                    if is_up {
                        grown.max[axis] = (grown.max[axis] + step[axis]).min(whole.max[axis]);
                    } else {
                        grown.min[axis] = (grown.min[axis] - step[axis]).max(whole.min[axis]);
                    }
                    if self.range_in(&grown).high < -DEEP * self.scale {
                        *bounds = grown;
                    }
                }
            }
            if *bounds == before {
                return;
            }
        }
    }

    /// Returns whether all faces of the box are surely well outside, so that what is inside comes to an end before it is cut off.
    fn is_outside_at_its_box(&self) -> bool {
        const HALVINGS: u32 = 6;
        let whole = self.bounds();
        let faces = (0..6).map(|face| {
            let (axis, mut bounds) = (face / 2, whole);
            if face % 2 == 0 {
                bounds.max[axis] = whole.min[axis];
            } else {
                bounds.min[axis] = whole.max[axis];
            }
            (bounds, HALVINGS)
        });
        let mut waiting: Vec<(Bounds, u32)> = faces.collect();
        while let Some((bounds, halvings)) = waiting.pop() {
            if self.range_in(&bounds).low > DEEP * self.scale {
                continue;
            }
            if halvings == 0 {
                return false;
            }
            let middle = bounds.center();
            // A face has four different ones of the eight.
            let mut quarters: Vec<Bounds> = Vec::with_capacity(4);
            for corner in bounds.corners() {
                let (min, max) = (corner.min(middle), corner.max(middle));
                let quarter = Bounds { min, max };
                if !quarters.contains(&quarter) {
                    quarters.push(quarter);
                }
            }
            waiting.extend(quarters.into_iter().map(|quarter| (quarter, halvings - 1)));
        }
        true
    }
}
