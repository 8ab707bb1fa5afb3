//! The linear forms of a face along a segment.
//!
//! In: two points and a light; a face's corners. Out: the heights of the points over the face's plane and their sides of the
//! planes through an edge and the light, with bounds or exactly. Invariant: signs that are told are exact.

use glam::DVec3;

use super::double::{self, Double, Doubles};
use crate::number::{Exact, Number, Point4, Sign, UNIT_ROUNDOFF, Vector};

/// 2^-700: products above it have tails in the range of normal numbers.
const SMALLEST: f64 = 1.90109156629516e-211;

/// What values of twice the bits err at most, as a share of the product of the largest components of the three vectors that
/// they are made of.
const DOUBLED_ERROR: f64 = 1.0 / (1_u128 << 96) as f64;

/// A linear form of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FaceForm {
    /// The height over the face's plane.
    Height,
    /// The side of the plane through the light and the edge that begins at this corner.
    Edge(u8),
}

/// A form's values at both ends, up to one factor above zero, with bounds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub(super) values: [f64; 2],
    pub(super) errors: [f64; 2],
}

/// The same by numbers of twice the bits, with one bound for both.
struct Doubled {
    values: [Double; 2],
    error: f64,
}

/// The segment and the light, which forms are about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub(super) points: [DVec3; 2],
    pub(super) light: (DVec3, f64),
}

/// Linear function of points: a normal, a point with the value zero, and what products its normal is made of.
struct Linear {
    normal: DVec3,
    zero: DVec3,
    size: f64,
}

impl Linear {
    /// Makes the function of the plane through a point along two vectors, each rounded at most once.
    fn new(first: DVec3, second: DVec3, zero: DVec3) -> Self {
        Self {
            normal: first.cross(second),
            zero,
            size: first.abs().max_element() * second.abs().max_element(),
        }
    }

    /// Returns the value at a vector from the zero, rounded at most once, and a bound on its error.
    ///
    /// With `u` the unit roundoff and `s` the size: a component of the normal is a difference of two products of rounded
    /// factors, so at most `2 s` and off by `8 u s`. Three products with a vector of largest component `w` add at most
    /// `24 u s w` for that, `12 u s w` for their own and the vector's rounding and `12 u s w` for sums.
    #[inline]
    fn at(&self, from: DVec3) -> (f64, f64) {
        let reach = from.abs().max_element();
        let error = 64.0 * UNIT_ROUNDOFF * self.size * reach;
        (
            self.normal.dot(from),
            error + f64::MIN_POSITIVE * (8.0 + 8.0 * reach),
        )
    }
}

/// Returns the sign of a value where its error leaves no doubt.
#[inline]
fn certain((value, error): (f64, f64)) -> Option<Sign> {
    if value > error {
        Some(Sign::Positive)
    } else if -value > error {
        Some(Sign::Negative)
    } else {
        None
    }
}

impl Values {
    #[inline]
    fn of(function: &Linear, [first, last]: [DVec3; 2]) -> Self {
        let ((a, a_error), (b, b_error)) = (
            function.at(first - function.zero),
            function.at(last - function.zero),
        );
        Self {
            values: [a, b],
            errors: [a_error, b_error],
        }
    }

    /// Returns the signs at both ends where there is no doubt.
    #[inline]
    pub(super) fn signs(&self) -> [Option<Sign>; 2] {
        [0, 1].map(|end| certain((self.values[end], self.errors[end])))
    }
}

impl Ends {
    /// Returns the height of the segment over a face's plane.
    #[inline]
    pub(super) fn heights(&self, [a, b, c]: [DVec3; 3]) -> Values {
        Values::of(&Linear::new(b - a, c - a, a), self.points)
    }

    /// Returns the exact sign of the light's height over a face's plane.
    #[inline]
    pub(super) fn light_side(&self, corners: [DVec3; 3]) -> Sign {
        let [a, b, c] = corners;
        let (light, weight) = self.light;
        let from = if weight == 0.0 { light } else { light - a };
        certain(Linear::new(b - a, c - a, a).at(from)).unwrap_or_else(|| {
            flat_sign(corners, from).unwrap_or_else(|| self.exact_light_side(corners))
        })
    }

    #[cold]
    #[inline(never)]
    fn exact_light_side(&self, corners: [DVec3; 3]) -> Sign {
        let light = Point4::from_f64(self.light);
        exact_height(corners, &light).sign().unwrap_or(Sign::Zero)
    }

    /// Returns the sides of the segment as an edge and the light have them. The same edge gives the same numbers, up to
    /// their sign, whichever way round its face goes.
    #[inline]
    pub(super) fn sides(&self, from: DVec3, to: DVec3) -> Values {
        let [low, high] = ordered(from, to);
        let (light, weight) = self.light;
        let towards = if weight == 0.0 { light } else { light - low };
        let mut values = Values::of(&Linear::new(towards, high - low, low), self.points);
        if low != from {
            values.values = values.values.map(|value| -value);
        }
        values
    }

    /// Returns the exact signs of a form at both ends by numbers of twice the bits; `None` where these leave a doubt.
    pub(super) fn doubled_signs(&self, corners: [DVec3; 3], form: FaceForm) -> Option<[Sign; 2]> {
        if form == FaceForm::Height {
            let signs = self
                .points
                .map(|point| flat_sign(corners, point - corners[0]));
            if let [Some(first), Some(last)] = signs {
                return Some([first, last]);
            }
        }
        let found = self.doubled(corners, form)?;
        let [first, last] = found.values.map(|value| certain((value.high, found.error)));
        Some([first?, last?])
    }

    /// Returns the share of the length at which a form is zero, rounded by numbers of twice the bits; `None` where they leave a
    /// doubt.
    pub(super) fn rounded_share(&self, corners: [DVec3; 3], form: FaceForm) -> Option<f64> {
        let Doubled { values, error } = self.doubled(corners, form)?;
        let length = values[0].minus(values[1]);
        let place = values[0].over(length);
        // Both values err by so much, and the quotient by less than 2^-98 of itself besides.
        let error = 2.0 * error / (length.high.abs() - 2.0 * error);
        let error = 1.01 * (error + DOUBLED_ERROR * place.high.abs());
        // Not for NaN.
        let is_fine = error > 0.0
            && place.high + (place.low + error) == place.high
            && place.high + (place.low - error) == place.high;
        is_fine.then_some(place.high)
    }

    /// Returns a form's values at both ends by numbers of twice the bits; `None` where these are too small.
    fn doubled(&self, corners: [DVec3; 3], form: FaceForm) -> Option<Doubled> {
        let corner = match form {
            FaceForm::Height => None,
            FaceForm::Edge(corner) => Some(usize::from(corner)),
        };
        let from = corners[corner.unwrap_or(0)];
        let along = |corner: usize| double::difference(corners[corner % 3], from);
        let (light, weight) = self.light;
        let (first, second) = match corner {
            None => (along(1), along(2)),
            Some(corner) if weight == 0.0 => {
                (double::difference(light, DVec3::ZERO), along(corner + 1))
            }
            Some(corner) => (double::difference(light, from), along(corner + 1)),
        };
        let normal = double::cross(&first, &second);
        let seen = self.points.map(|point| double::difference(point, from));
        let values = seen.each_ref().map(|seen| double::dot(&normal, seen));
        let largest = |v: &Doubles| v.iter().map(|x| x.high.abs()).fold(0.0, f64::max);
        let size = largest(&first) * largest(&second);
        let reach = size * (largest(&seen[0]) + largest(&seen[1]));
        // What products lose to underflow is less than that error then.
        (size.min(reach) >= SMALLEST).then_some(Doubled {
            values,
            error: DOUBLED_ERROR * reach,
        })
    }

    /// Returns a form's exact values at both ends, up to one factor above zero.
    pub(super) fn exact_values(&self, corners: [DVec3; 3], form: FaceForm) -> [Exact; 2] {
        let points = self.points.map(|point| Point4::from_f64((point, 1.0)));
        match form {
            FaceForm::Height => points.each_ref().map(|point| exact_height(corners, point)),
            FaceForm::Edge(corner) => {
                let corner = usize::from(corner);
                let from = Vector::from_f64(corners[corner]);
                let along = Vector::from_f64(corners[(corner + 1) % 3]).minus(&from);
                let towards = Point4::from_f64(self.light).seen_from(&from);
                let normal = towards.cross(&along);
                points.map(|point| normal.dot(&point.seen_from(&from)))
            }
        }
    }
}

/// Returns two points in an order of their own.
#[inline]
pub(super) fn ordered(one: DVec3, other: DVec3) -> [DVec3; 2] {
    if (one.x, one.y, one.z) <= (other.x, other.y, other.z) {
        [one, other]
    } else {
        [other, one]
    }
}

/// Returns the sign of the height over a face whose plane is square to an axis, if it is: of something whose difference from
/// the first corner, or direction, has these signs. Houses have many faces that are in one plane with what is asked.
fn flat_sign([a, b, c]: [DVec3; 3], from: DVec3) -> Option<Sign> {
    let axis = (0..3).find(|&axis| a[axis] == b[axis] && a[axis] == c[axis])?;
    if from[axis] == 0.0 {
        return Some(Sign::Zero);
    }
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let (first, second) = (b - a, c - a);
    let size = first.abs().max_element() * second.abs().max_element();
    let normal = first[next] * second[last] - first[last] * second[next];
    let side = certain((
        normal,
        16.0 * UNIT_ROUNDOFF * size + 8.0 * f64::MIN_POSITIVE,
    ))?;
    Some(if from[axis] > 0.0 {
        side
    } else {
        side.flipped()
    })
}

fn exact_height([a, b, c]: [DVec3; 3], point: &Point4<Exact>) -> Exact {
    let from = Vector::from_f64(a);
    let first = Vector::from_f64(b).minus(&from);
    let normal = first.cross(&Vector::from_f64(c).minus(&from));
    normal.dot(&point.seen_from(&from))
}
