//! Spheres and tubes.

use std::cmp::Ordering;

use super::Segment;
use crate::exact::{Exact, Vec3};

/// The number `numerator / denominator`, `denominator > 0`.
#[derive(Debug)]
struct Fraction {
    numerator: Exact,
    denominator: Exact,
}

impl Fraction {
    /// `numerator / denominator` for a denominator of either sign, not zero.
    fn new(numerator: Exact, denominator: Exact) -> Self {
        if denominator.sign() < 0 {
            Self {
                numerator: -&numerator,
                denominator: -&denominator,
            }
        } else {
            Self {
                numerator,
                denominator,
            }
        }
    }

    fn integer(value: Exact) -> Self {
        Self {
            numerator: value,
            denominator: Exact::ONE,
        }
    }

    fn compare(&self, other: &Self) -> Ordering {
        (&self.numerator * &other.denominator).compare(&(&other.numerator * &self.denominator))
    }
}

/// The values of `v` from `low` to `high`, without bound if that is `None`.
#[derive(Debug)]
struct Interval {
    low: Fraction,
    high: Option<Fraction>,
}

impl Interval {
    /// All of the segment, ends included.
    fn of(segment: &Segment) -> Self {
        Self {
            low: Fraction::integer(Exact::ZERO),
            high: (!segment.light.is_direction()).then(|| Fraction::integer(Exact::ONE)),
        }
    }

    fn holds_inside(&self, v: &Fraction) -> bool {
        v.compare(&self.low).is_gt()
            && self
                .high
                .as_ref()
                .is_none_or(|high| v.compare(high).is_lt())
    }

    fn raise_low(&mut self, low: Fraction) {
        if low.compare(&self.low).is_gt() {
            self.low = low;
        }
    }

    fn lower_high(&mut self, high: Fraction) {
        if self
            .high
            .as_ref()
            .is_none_or(|old| high.compare(old).is_lt())
        {
            self.high = Some(high);
        }
    }

    /// Keeps the `v` with `c0 + c1 v >= 0`; `None` when none are left.
    fn keep_where_not_negative(mut self, c0: &Exact, c1: &Exact) -> Option<Self> {
        match c1.sign() {
            0 if c0.sign() < 0 => return None,
            0 => {}
            1 => self.raise_low(Fraction::new(-c0, c1.clone())),
            _ => self.lower_high(Fraction::new(-c0, c1.clone())),
        }
        let is_empty = self
            .high
            .as_ref()
            .is_some_and(|high| self.low.compare(high).is_gt());
        (!is_empty).then_some(self)
    }
}

/// The function `c0 + c1 v + c2 v^2`.
#[derive(Debug)]
struct Quadratic {
    c0: Exact,
    c1: Exact,
    c2: Exact,
}

impl Quadratic {
    fn sign_at(&self, v: &Fraction) -> i8 {
        let Fraction {
            numerator,
            denominator,
        } = v;
        let linear = &self.c0 * denominator + &self.c1 * numerator;
        (linear * denominator + &self.c2 * &numerator.square()).sign()
    }

    /// Sign of the derivative.
    fn slope_at(&self, v: &Fraction) -> i8 {
        (&self.c1 * &v.denominator + self.c2.double() * &v.numerator).sign()
    }

    fn sign_at_infinity(&self) -> i8 {
        [&self.c2, &self.c1, &self.c0]
            .into_iter()
            .map(Exact::sign)
            .find(|&s| s != 0)
            .unwrap_or(0)
    }

    /// The numbers that say which signs it takes between 0 and 1, or from 0 on: values at the ends, slopes there, and the
    /// discriminant.
    fn decisive(&self) -> Vec<Exact> {
        let Self { c0, c1, c2 } = self;
        vec![
            c0.clone(),
            c1.clone(),
            c2.clone(),
            &(c0 + c1) + c2,
            c1 + &c2.double(),
            &c1.square() - &(&Exact::new(4.0) * &(c0 * c2)),
        ]
    }

    /// The same where `v` is `-room / rate`: its value there, times `rate^2`, and its slope, times `rate`.
    fn decisive_at(&self, room: &Exact, rate: &Exact) -> [Exact; 2] {
        let Self { c0, c1, c2 } = self;
        let linear = &(c0 * rate) - &(c1 * room);
        [
            &(&linear * rate) + &(c2 * &room.square()),
            &(c1 * rate) - &(&c2.double() * room),
        ]
    }

    /// Whether it is strictly negative somewhere and strictly positive somewhere in the interval.
    /// A quadratic takes its extreme values at the ends and at its vertex.
    fn takes_both_signs(&self, interval: &Interval) -> bool {
        let Interval { low, high } = interval;
        let high_sign = high
            .as_ref()
            .map_or_else(|| self.sign_at_infinity(), |v| self.sign_at(v));
        let mut signs = vec![self.sign_at(low), high_sign];
        if signs[0] * signs[1] < 0 {
            return true;
        }
        if !self.c2.is_zero() {
            let vertex = Fraction::new(-&self.c1, self.c2.double());
            if vertex.compare(low).is_gt()
                && high
                    .as_ref()
                    .is_none_or(|high| vertex.compare(high).is_lt())
            {
                signs.push(self.sign_at(&vertex));
            }
        }
        signs.contains(&-1) && signs.contains(&1)
    }
}

/// A sphere of a radius that is not zero.
#[derive(Debug)]
pub(super) struct Sphere {
    center: Vec3,
    radius_squared: Exact,
}

impl Sphere {
    pub(super) fn new(center: [f64; 3], radius: f64) -> Option<Self> {
        assert!(
            radius >= 0.0,
            "the radius of a sphere must not be negative, but is {radius}"
        );
        (radius > 0.0).then(|| Self {
            center: Vec3::new(center),
            radius_squared: Exact::new(radius).square(),
        })
    }

    /// Whether the open segment has points strictly inside and points strictly outside.
    pub(super) fn is_crossed(&self, segment: &Segment) -> bool {
        self.excess(segment)
            .takes_both_signs(&Interval::of(segment))
    }

    /// `scale^2 (distance from the centre squared - radius squared)` along the segment.
    fn excess(&self, segment: &Segment) -> Quadratic {
        let Segment { start, delta, .. } = segment;
        let from_center = &start.scaled - &self.center.scale(&start.scale);
        Quadratic {
            c0: from_center.norm_squared() - &self.radius_squared * &start.scale.square(),
            c1: from_center.dot(delta).double(),
            c2: delta.norm_squared(),
        }
    }

    pub(super) fn decisive(&self, segment: &Segment) -> Vec<Exact> {
        self.excess(segment).decisive()
    }

    /// On which side of the tangent plane at the start the light is.
    pub(super) fn side(&self, segment: &Segment) -> i8 {
        let Segment { start, light, .. } = segment;
        let from_center = &start.scaled - &self.center.scale(&start.scale);
        if light.is_direction() {
            from_center.dot(&light.position).sign()
        } else {
            let light_from_center = &light.position - &self.center;
            let plane = &self.radius_squared * &start.scale;
            from_center.dot(&light_from_center).compare(&plane) as i8
        }
    }

    pub(super) fn excludes_light(&self, segment: &Segment) -> bool {
        let light = &segment.light;
        light.is_direction()
            || (&light.position - &self.center)
                .norm_squared()
                .compare(&self.radius_squared)
                .is_gt()
    }
}

/// The wall of a truncated cone or cylinder.
#[derive(Debug)]
pub(super) struct Tube {
    base: Vec3,
    /// From base to apex.
    axis: Vec3,
    axis_squared: Exact,
    base_radius: Exact,
    apex_radius: Exact,
    /// Apex radius less base radius.
    growth: Exact,
}

/// A point, times its scale, as the tube sees it; or a direction, with scale zero.
///
/// `along / |axis|^2` is 0 at the base and 1 at the apex; `across` is the vector from the axis to
/// the point and `reach` the radius of the infinite cone there (negative on the other nappe),
/// both times `|axis|^2`. All are linear in the point, and the point is inside the infinite
/// double cone iff `|across| < |reach|`.
struct InTube {
    along: Exact,
    across: Vec3,
    reach: Exact,
    scale: Exact,
}

/// `across . across - reach reach` for two points: the polar form of the double cone.
fn polar(p: &InTube, q: &InTube) -> Exact {
    p.across.dot(&q.across) - &p.reach * &q.reach
}

/// By how much the points of a segment are outside of the double cone.
fn excess(start: &InTube, change: &InTube) -> Quadratic {
    Quadratic {
        c0: polar(start, start),
        c1: polar(start, change).double(),
        c2: polar(change, change),
    }
}

impl Tube {
    pub(super) fn new(
        base: [f64; 3],
        base_radius: f64,
        apex: [f64; 3],
        apex_radius: f64,
    ) -> Option<Self> {
        for radius in [base_radius, apex_radius] {
            assert!(
                radius >= 0.0,
                "the radius of a tube must not be negative, but is {radius}"
            );
        }
        let (base, apex) = (Vec3::new(base), Vec3::new(apex));
        let (base_radius, apex_radius) = (Exact::new(base_radius), Exact::new(apex_radius));
        let axis = &apex - &base;
        if axis.is_zero() || (base_radius.is_zero() && apex_radius.is_zero()) {
            return None;
        }
        let axis_squared = axis.norm_squared();
        let growth = &apex_radius - &base_radius;
        Some(Self {
            base,
            axis,
            axis_squared,
            base_radius,
            apex_radius,
            growth,
        })
    }

    fn locate(&self, scaled: &Vec3, scale: &Exact) -> InTube {
        let from_base = scaled - &self.base.scale(scale);
        let along = from_base.dot(&self.axis);
        let across = &from_base.scale(&self.axis_squared) - &self.axis.scale(&along);
        let reach = &self.base_radius * &(&self.axis_squared * scale) + &self.growth * &along;
        InTube {
            along,
            across,
            reach,
            scale: scale.clone(),
        }
    }

    fn start(&self, segment: &Segment) -> InTube {
        self.locate(&segment.start.scaled, &segment.start.scale)
    }

    fn light(&self, segment: &Segment) -> InTube {
        self.locate(&segment.light.position, &segment.light.weight)
    }

    pub(super) fn side(&self, segment: &Segment) -> i8 {
        polar(&self.start(segment), &self.light(segment)).sign()
    }

    /// Whether the part of the segment between the end planes, if it does not lie in one, has
    /// points strictly inside and points strictly outside.
    pub(super) fn is_crossed(&self, segment: &Segment) -> bool {
        let start = self.start(segment);
        let change = self.locate(&segment.delta, &Exact::ZERO);
        // The height over the base is `start.along + v change.along`, over 0 and under `top`.
        let top = &self.axis_squared * &segment.start.scale;
        let under_top = &top - &start.along;
        let Some(between) = Interval::of(segment)
            .keep_where_not_negative(&start.along, &change.along)
            .and_then(|part| part.keep_where_not_negative(&under_top, &-&change.along))
        else {
            return false;
        };
        let excess = excess(&start, &change);
        if excess.takes_both_signs(&between) {
            return true;
        }
        // A crossing exactly in a rim: the other sign is beyond the end plane. And one exactly in
        // an apex: inside before it, outside behind it, where only the other nappe is.
        let whole = Interval::of(segment);
        let ends = [
            (&start.along, &self.base_radius),
            (&under_top, &self.apex_radius),
        ];
        !change.along.is_zero()
            && ends.into_iter().any(|(room, radius)| {
                let rate = if std::ptr::eq(room, &under_top) {
                    -&change.along
                } else {
                    change.along.clone()
                };
                let v = Fraction::new(-room, rate);
                whole.holds_inside(&v)
                    && excess.sign_at(&v) == 0
                    && if radius.is_zero() {
                        excess.c2.sign() < 0
                    } else {
                        excess.slope_at(&v) != 0
                    }
            })
    }

    /// Heights over the end planes and the rate at which they change; what decides along the whole segment, and at its
    /// crossings with the planes.
    pub(super) fn decisive(&self, segment: &Segment) -> Vec<Exact> {
        let start = self.start(segment);
        let change = self.locate(&segment.delta, &Exact::ZERO);
        let top = &self.axis_squared * &segment.start.scale;
        let under_top = &top - &start.along;
        let excess = excess(&start, &change);
        let mut numbers = excess.decisive();
        numbers.extend(excess.decisive_at(&start.along, &change.along));
        numbers.extend(excess.decisive_at(&under_top, &-&change.along));
        numbers.extend([start.along, under_top, change.along]);
        numbers
    }

    /// Whether a segment that starts on this open tube goes in and out again through its wall.
    ///
    /// The start counts as exactly on the wall. So of `u S + v L` the form is
    /// `v (2 B u + C v)`, and its other root is at `v / u = -2 B / C`.
    pub(super) fn is_crossed_again(&self, segment: &Segment) -> bool {
        let (start, light) = (self.start(segment), self.light(segment));
        let slope = polar(&start, &light).double();
        let curvature = polar(&light, &light);
        if slope.sign() >= 0 || curvature.sign() <= 0 {
            return false;
        }
        // The crossing is (start + ratio light) over (1 + ratio light.scale).
        let at_crossing =
            |of_start: &Exact, of_light: &Exact| &curvature * of_start - &slope * of_light;
        let along = at_crossing(&start.along, &light.along);
        let scale = at_crossing(&start.scale, &light.scale);
        along.sign() >= 0 && along.compare(&(&self.axis_squared * &scale)).is_le()
    }

    /// Whether the light is behind the wall at the start, for a wall that is part of a solid. At an
    /// apex, and beyond it, that is: inside the infinite nappe.
    pub(super) fn is_behind_wall(&self, segment: &Segment) -> bool {
        let (start, light) = (self.start(segment), self.light(segment));
        if start.reach.sign() > 0 {
            polar(&start, &light).sign() < 0
        } else {
            polar(&light, &light).sign() < 0 && light.reach.sign() > 0
        }
    }

    /// Whether the light is strictly outside the closed solid of this tube.
    pub(super) fn solid_excludes_light(&self, segment: &Segment) -> bool {
        let light = self.light(segment);
        let top = &self.axis_squared * &light.scale;
        light.along.sign() < 0
            || light.along.compare(&top).is_gt()
            || polar(&light, &light).sign() > 0
    }
}
