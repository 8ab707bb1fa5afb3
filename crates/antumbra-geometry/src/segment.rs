//! A shadow query's segment, from its start to its light, in both arithmetics.
//!
//! In: a [`ReceiverPoint`] and a light. Out: [`Segment`], which every predicate takes. Invariant: the exact
//! start is the one EXACTNESS.md defines ("The start"); the approximate one lies within its error.

use std::cell::OnceCell;

use glam::DVec3;

use crate::number::{Approximate, Exact, Number, Point4, Sign, UNIT_ROUNDOFF, Vector};
use crate::{LightShape, ReceiverPoint, flat};

/// The open segment of a shadow query, or a ray towards a direction.
#[derive(Clone, Debug)]
pub struct Segment {
    pub(crate) start: ReceiverPoint,
    pub(crate) light: (DVec3, f64),
    surface: Option<ReceiverSurface>,
    /// The start in `f64`.
    pub(crate) origin: DVec3,
    /// Largest error of a coordinate of `origin`.
    pub(crate) origin_error: f64,
    /// Made when the first predicate is in doubt; often many are, of one segment.
    exact: OnceCell<Box<Ends<Exact>>>,
}

/// Of an approximate start, as a share of the coordinates that it is made of: some hundred roundings.
/// Starts that are moved along their triangle's plane to its border, and those on needles, are worse.
const USUAL_ORIGIN_ERROR: f64 = 1.0 / (1u64 << 45) as f64;

/// The flat surface that a start is moved onto, along the axis of the largest normal component.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ReceiverSurface {
    /// The nearest point of the closed triangle.
    Triangle { corners: [DVec3; 3], axis: u8 },
    /// The point of the plane; a disk's rim does not hold the start.
    Plane { plane: Plane, axis: u8 },
}

/// A plane as given: its exact normal may need more digits than `f64` has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Plane {
    /// Through three points; normal `(b - a) x (c - a)`.
    Points([DVec3; 3]),
    /// Through the first point; normal `tip - tail`.
    Normal {
        point: DVec3,
        tip: DVec3,
        tail: DVec3,
    },
}

impl Plane {
    pub(crate) fn point(&self) -> DVec3 {
        match *self {
            Self::Points([a, _, _]) => a,
            Self::Normal { point, .. } => point,
        }
    }

    pub(crate) fn normal<N: Number>(&self) -> Vector<N> {
        match *self {
            Self::Points([a, b, c]) => {
                let origin = Vector::from_f64(a);
                let ab = Vector::from_f64(b).minus(&origin);
                ab.cross(&Vector::from_f64(c).minus(&origin))
            }
            Self::Normal { tip, tail, .. } => Vector::from_f64(tip).minus(&Vector::from_f64(tail)),
        }
    }

    /// Returns the height of `point` over the plane, times the normal's length and `point.w`.
    pub(crate) fn height<N: Number>(&self, point: &Point4<N>) -> N {
        self.normal()
            .dot(&point.seen_from(&Vector::from_f64(self.point())))
    }

    /// Returns the axis of the normal's largest component, the lowest on ties, or `None` if the
    /// normal is zero.
    pub(crate) fn dominant_axis(&self) -> Option<u8> {
        if let Self::Points(corners) = self
            && let Some(axis) = plainly_dominant_axis(*corners)
        {
            return Some(axis);
        }
        crate::number::decide(axis_of(&self.normal::<Approximate>()), || {
            axis_of(&self.normal::<Exact>())
        })
    }
}

/// Returns the axis of the largest component of a triangle's normal where plain `f64` leaves no doubt: nearly always.
///
/// A component is a difference of two products of edges, each of which is at most `M`, the product of the largest
/// magnitudes of the edges. With 2^-53 for a rounding, products are off by three roundings of `M` and the component by
/// at most 9 of them, so the difference of two magnitudes by 20. 2^-48 are 32. What products lose to underflow is less
/// than a rounding of `M` where that is above 2^-900, and where something overflows no comparison holds.
fn plainly_dominant_axis([a, b, c]: [DVec3; 3]) -> Option<u8> {
    const DOUBT: f64 = 1.0 / (1u64 << 48) as f64;
    const SMALLEST: f64 = 1.1830521861667747e-271; // 2^-900
    let (ab, ac) = (b - a, c - a);
    let most = ab.abs().max_element() * ac.abs().max_element();
    if most.is_nan() || most < SMALLEST {
        return None;
    }
    let [x, y, z] = ab.cross(ac).abs().to_array();
    let doubt = DOUBT * most;
    let is_largest = |one: f64, second: f64, third: f64| one - second.max(third) > doubt;
    if is_largest(z, x, y) {
        Some(2)
    } else if is_largest(y, x, z) {
        Some(1)
    } else if is_largest(x, y, z) {
        Some(0)
    } else {
        None
    }
}

/// The outer `None` means undecided, the inner a zero normal.
fn axis_of<N: Number>(normal: &Vector<N>) -> Option<Option<u8>> {
    let magnitude = |i: usize| -> Option<N> {
        Some(match normal.0[i].sign()? {
            Sign::Negative => normal.0[i].negated(),
            _ => normal.0[i].clone(),
        })
    };
    let mut best = 0;
    let mut largest = magnitude(0)?;
    for axis in 1..3 {
        let candidate = magnitude(axis)?;
        if candidate.minus(&largest).sign()?.is_positive() {
            best = axis as u8;
            largest = candidate;
        }
    }
    Some(if largest.sign()? == Sign::Zero {
        None
    } else {
        Some(best)
    })
}

impl Segment {
    /// Prepares a segment; `surface` is that of a flat start surface.
    #[inline]
    pub(crate) fn new(
        start: ReceiverPoint,
        light: &LightShape,
        surface: Option<ReceiverSurface>,
    ) -> Self {
        let (origin, origin_error) = match &surface {
            None => (start.point, 0.0),
            Some(surface) => surface.approximate_start(start.point),
        };
        let mut segment = Self {
            start,
            light: light.homogeneous(),
            surface,
            origin,
            origin_error,
            exact: OnceCell::new(),
        };
        let size = segment.surface.as_ref().map_or(0.0, ReceiverSurface::size);
        let size = size + start.point.abs().max_element();
        if origin_error > USUAL_ORIGIN_ERROR * size {
            segment.round_exact_start();
        }
        segment
    }

    /// Takes the exact start for the approximate one, so that few signs are in doubt: that costs as much
    /// as one of them.
    #[cold]
    #[inline(never)]
    fn round_exact_start(&mut self) {
        let start = &self.exact().start;
        let [x, y, z] = [0, 1, 2].map(|axis: usize| start.x.0[axis].over(&start.w));
        let rounded = DVec3::new(x, y, z);
        // Each is right to one rounding; 4 units are generous. A quotient below the normal numbers may
        // be rounded twice.
        let error = 4.0 * UNIT_ROUNDOFF * rounded.abs().max_element() + f64::MIN_POSITIVE;
        if rounded.is_finite() && error < self.origin_error {
            (self.origin, self.origin_error) = (rounded, error);
        }
    }

    /// Returns the start rounded to `f64`, moved onto its surface's plane if it has one.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the plane that the start is moved onto, if it is.
    pub(crate) fn own_plane(&self) -> Option<Plane> {
        self.surface.as_ref().map(ReceiverSurface::plane)
    }

    /// Returns a bound on the error of [`Segment::origin`], per coordinate.
    pub fn origin_error(&self) -> f64 {
        self.origin_error
    }

    /// Returns the vector from the start to the light, or towards a light at infinity.
    pub fn direction(&self) -> DVec3 {
        if self.light.1 == 0.0 {
            self.light.0
        } else {
            self.light.0 - self.origin
        }
    }

    /// Returns what rounding took from [`Segment::direction`]: the two together are exact.
    pub fn direction_tail(&self) -> DVec3 {
        if self.light.1 == 0.0 {
            return DVec3::ZERO;
        }
        // Knuth's two-difference.
        let (a, b) = (self.light.0, self.origin);
        let difference = a - b;
        let b_part = a - difference;
        let a_part = difference + b_part;
        (b_part - b) + (a - a_part)
    }

    /// Returns whether the light is a point, so that the segment ends at parameter 1 of
    /// [`Segment::direction`].
    pub fn is_finite(&self) -> bool {
        self.light.1 != 0.0
    }

    /// Returns what the query starts from.
    pub fn start(&self) -> &ReceiverPoint {
        &self.start
    }

    pub(crate) fn approximate(&self) -> Ends<Approximate> {
        let coordinate = |x: f64| Approximate::new(x, self.origin_error);
        let x = Vector([self.origin.x, self.origin.y, self.origin.z].map(coordinate));
        Ends {
            start: Point4 {
                x,
                w: Approximate::from_f64(1.0),
            },
            light: Point4::from_f64(self.light),
        }
    }

    /// Returns three times the middle of the start's own triangle, as a point of weight 3: what
    /// decides where the start itself lies on a border.
    pub(crate) fn inner<N: Number>(&self) -> Option<Point4<N>> {
        let ReceiverSurface::Triangle { corners, .. } = self.surface? else {
            return None;
        };
        let [a, b, c] = corners.map(Vector::from_f64);
        Some(Point4 {
            x: a.plus(&b).plus(&c),
            w: N::from_f64(3.0),
        })
    }

    pub(crate) fn exact(&self) -> &Ends<Exact> {
        self.exact.get_or_init(|| {
            let start = match &self.surface {
                None => Point4::from_f64((self.start.point, 1.0)),
                Some(surface) => surface.exact_start(self.start.point),
            };
            Box::new(Ends {
                start,
                light: Point4::from_f64(self.light),
            })
        })
    }
}

/// The two ends of a segment in one arithmetic.
#[derive(Clone, Debug)]
pub(crate) struct Ends<N> {
    pub(crate) start: Point4<N>,
    pub(crate) light: Point4<N>,
}

impl ReceiverSurface {
    fn plane(&self) -> Plane {
        match *self {
            Self::Triangle { corners, .. } => Plane::Points(corners),
            Self::Plane { plane, .. } => plane,
        }
    }

    /// Returns the largest magnitude of a coordinate.
    fn size(&self) -> f64 {
        let largest = |v: DVec3| v.abs().max_element();
        match *self {
            Self::Triangle { corners, .. } => corners.map(largest).into_iter().fold(0.0, f64::max),
            Self::Plane { plane, .. } => largest(plane.point()),
        }
    }

    fn axis(&self) -> usize {
        match *self {
            Self::Triangle { axis, .. } | Self::Plane { axis, .. } => usize::from(axis),
        }
    }

    fn exact_start(&self, point: DVec3) -> Point4<Exact> {
        if let Self::Triangle { corners, axis } = *self
            && !flat::is_over(point, corners, usize::from(axis))
        {
            return flat::nearest_on_boundary(point, corners, usize::from(axis));
        }
        // Along the axis onto the plane, times the normal's component there.
        let axis = self.axis();
        let plane = self.plane();
        let normal = plane.normal::<Exact>();
        let point = Point4::from_f64((point, 1.0));
        let height = normal.dot(&point.seen_from(&Vector::from_f64(plane.point())));
        let mut moved = Point4 {
            x: point.x.scaled(&normal.0[axis]),
            w: normal.0[axis].clone(),
        };
        moved.x.0[axis] = moved.x.0[axis].minus(&height);
        if moved.w.sign().is_some_and(Sign::is_negative) {
            moved = Point4 {
                x: moved.x.negated(),
                w: moved.w.negated(),
            };
        }
        moved
    }

    /// The same, divided out and rounded, with a bound on the error.
    #[inline]
    fn approximate_start(&self, point: DVec3) -> (DVec3, f64) {
        let (moved, error) = self.approximate_on_plane(point);
        let Self::Triangle { corners, axis } = *self else {
            return (moved, error);
        };
        (
            moved,
            error + flat::largest_move(point, corners, usize::from(axis)),
        )
    }

    #[inline]
    fn approximate_on_plane(&self, point: DVec3) -> (DVec3, f64) {
        let (axis, Estimate { height, slope }) = match *self {
            Self::Triangle { corners, axis } => {
                let axis = usize::from(axis);
                (axis, estimate_on_triangle(point, corners, axis))
            }
            Self::Plane { plane, axis } => {
                let axis = usize::from(axis);
                let normal = plane.normal::<Approximate>();
                let from_plane = Vector::from_f64(point).minus(&Vector::from_f64(plane.point()));
                let height = normal.dot(&from_plane);
                let slope = normal.0[axis];
                (axis, Estimate { height, slope })
            }
        };
        if height.value() == 0.0 && height.error() == 0.0 {
            return (point, 0.0);
        }
        let slope_at_least = slope.value().abs() - slope.error();
        if slope_at_least.is_nan() || slope_at_least <= 0.0 {
            return (point, f64::INFINITY);
        }
        // height / slope, with the errors of both carried through the quotient; a quotient that
        // underflows is off by less than the smallest normal number.
        let shift = height.value() / slope.value();
        let shift_error = (height.error() + shift.abs() * slope.error()) / slope_at_least
            + shift.abs() * f64::EPSILON;
        let mut moved = point;
        moved[axis] -= shift;
        let rounding = moved[axis].abs() * UNIT_ROUNDOFF;
        let error = shift_error + rounding + f64::MIN_POSITIVE;
        (moved, error * (1.0 + 8.0 * f64::EPSILON))
    }
}

/// A point's height over a plane and the component of the plane's normal along an axis.
struct Estimate {
    height: Approximate,
    slope: Approximate,
}

/// Returns a bound on how far, in any coordinate, the start on a triangle lies from its point as given,
/// for points that lie over the triangle; infinity where that is in doubt. As [`estimate_on_triangle`],
/// cheaper: bounds for all three components of the normal at once.
#[inline]
pub(crate) fn largest_move_onto(point: DVec3, corners: [DVec3; 3], axis: usize) -> f64 {
    if flat::largest_move(point, corners, axis) != 0.0 {
        return f64::INFINITY;
    }
    let [a, b, c] = corners;
    let (ab, ac, seen) = (b - a, c - a, point - a);
    let normal = ab.cross(ac);
    let largest = |v: DVec3| v.abs().max_element();
    let size = 2.0 * largest(ab) * largest(ac);
    let error = 10.0 * UNIT_ROUNDOFF * size;
    let height = normal.dot(seen).abs()
        + error * seen.abs().element_sum()
        + f64::MIN_POSITIVE * (1.0 + seen.abs().element_sum());
    let slope = normal.to_array()[axis].abs() - error - f64::MIN_POSITIVE;
    let bound = height / slope * (1.0 + 8.0 * f64::EPSILON);
    // Not for NaN.
    if slope > 0.0 { bound } else { f64::INFINITY }
}

/// The hot part of preparing a segment, so in plain `f64` with one bound for each sum.
///
/// With `u` the unit roundoff: a component `n` of the normal is a difference of two products, of
/// magnitudes summing up to `s`, of rounded differences, so its error is at most `3 u s + u |n|` to
/// first order and `5 u s` outright. The height `n . w` adds `2 u` for each product with its rounded
/// difference and `2 u` for the sums, so `10 u` times the sum of `|w| s` bounds it. Products that
/// underflow are off by less than the smallest normal number.
#[inline]
fn estimate_on_triangle(point: DVec3, [a, b, c]: [DVec3; 3], axis: usize) -> Estimate {
    let (ab, ac, seen) = (b - a, c - a, point - a);
    let first = DVec3::new(ab.y * ac.z, ab.z * ac.x, ab.x * ac.y);
    let second = DVec3::new(ab.z * ac.y, ab.x * ac.z, ab.y * ac.x);
    let normal = first - second;
    let size = first.abs() + second.abs();
    let sum = seen.abs().dot(size);
    // Planes along an axis are common, and their points have no height at all: every product is one
    // with zero. (A sum that is zero by underflow of the others is in doubt.)
    let is_zero = |seen: f64, (b1, c1): (f64, f64), (b2, c2): (f64, f64)| {
        seen == 0.0 || ((b1 == 0.0 || c1 == 0.0) && (b2 == 0.0 || c2 == 0.0))
    };
    let is_exact = sum == 0.0
        && is_zero(seen.x, (ab.y, ac.z), (ab.z, ac.y))
        && is_zero(seen.y, (ab.z, ac.x), (ab.x, ac.z))
        && is_zero(seen.z, (ab.x, ac.y), (ab.y, ac.x));
    let height_error = if is_exact {
        0.0
    } else {
        10.0 * UNIT_ROUNDOFF * sum + f64::MIN_POSITIVE * (1.0 + seen.abs().element_sum())
    };
    let slope_error = 5.0 * UNIT_ROUNDOFF * size.to_array()[axis] + f64::MIN_POSITIVE;
    Estimate {
        height: Approximate::new(normal.dot(seen), height_error),
        slope: Approximate::new(normal.to_array()[axis], slope_error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles whose normals have equal or nearly equal components, tiny, huge, flat and ordinary ones.
    #[test]
    fn a_plainly_largest_axis_is_the_exact_one() {
        let mut state = 1_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            state >> 33
        };
        let (mut decided, mut doubted) = (0, 0);
        for _ in 0..20_000 {
            let scale = [1.0, 1e-150, 1e-90, 1e28, 1e-300][draw() as usize % 5];
            let mut number = || {
                let whole = (draw() % 7) as f64 - 3.0;
                let off = [0.0, f64::EPSILON, 1e-15, 0.3][draw() as usize % 4];
                (whole + off * whole) * scale
            };
            let corners = [(); 3].map(|()| DVec3::new(number(), number(), number()));
            let normal = Plane::Points(corners).normal::<Exact>();
            let exact = axis_of(&normal).expect("exact numbers are never in doubt");
            match plainly_dominant_axis(corners) {
                Some(axis) => {
                    assert_eq!(Some(axis), exact, "{corners:?}");
                    decided += 1;
                }
                None => doubted += 1,
            }
        }
        assert!(decided > 5_000 && doubted > 5_000, "{decided} {doubted}");
    }
}
