//! The linear forms of a face along a segment.
//!
//! In: two points and a light; a face's corners. Out: the heights of the points over the face's plane and their sides of the
//! planes through an edge and the light, with bounds or exactly. Invariant: signs that are told are exact.

use fearless_simd::{Level, dispatch};
use glam::DVec3;

use super::double::{self, Double, Doubles};
use crate::number::{Exact, Number, Point4, Sign, UNIT_ROUNDOFF, Unrounded, Vector, decide};

/// 2^-700: products above it have tails in the range of normal numbers.
const SMALLEST: f64 = 1.90109156629516e-211;

/// Largest error of values of twice the bits, as a share of the product of the largest components of the three vectors that
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

/// Values at both ends by numbers of twice the bits, with one bound for both.
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

/// Returns the sign of a value where its error leaves no doubt.
#[inline]
pub(super) fn certain((value, error): (f64, f64)) -> Option<Sign> {
    if value > error {
        Some(Sign::Positive)
    } else if -value > error {
        Some(Sign::Negative)
    } else {
        None
    }
}

impl Values {
    /// Returns the signs at both ends where there is no doubt.
    #[inline]
    pub(super) fn signs(&self) -> [Option<Sign>; 2] {
        let ([first, last], [first_error, last_error]) = (self.values, self.errors);
        [certain((first, first_error)), certain((last, last_error))]
    }
}

impl Ends {
    /// Returns the exact sign of the light's height over a face's plane.
    #[cold]
    #[inline(never)]
    pub(super) fn exact_light_side(&self, corners: [DVec3; 3]) -> Sign {
        let (light, weight) = self.light;
        let from = if weight == 0.0 {
            light
        } else {
            light - corners[0]
        };
        if let Some(sign) = flat_sign(corners, from) {
            return sign;
        }
        let exact = || height_in::<Exact>(corners, &Point4::from_f64(self.light)).sign();
        decide(
            height_in::<Unrounded>(corners, &Point4::from_f64(self.light)).sign(),
            exact,
        )
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
    pub(super) fn rounded_share(
        &self,
        level: Level,
        corners: [DVec3; 3],
        form: FaceForm,
    ) -> Option<f64> {
        // For products and sums that are rounded together; elsewhere each is a call.
        dispatch!(level, _simd => self.rounded_share_inline(corners, form))
    }

    #[inline(always)]
    fn rounded_share_inline(&self, corners: [DVec3; 3], form: FaceForm) -> Option<f64> {
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
    #[inline(always)]
    fn doubled(&self, corners: [DVec3; 3], form: FaceForm) -> Option<Doubled> {
        let (light, weight) = self.light;
        let (from, first, next) = match form {
            FaceForm::Height => (
                corners[0],
                double::difference(corners[1], corners[0]),
                corners[2],
            ),
            FaceForm::Edge(corner) => {
                let corner = usize::from(corner);
                let from = corners[corner];
                let base = if weight == 0.0 { DVec3::ZERO } else { from };
                (
                    from,
                    double::difference(light, base),
                    corners[(corner + 1) % 3],
                )
            }
        };
        let second = double::difference(next, from);
        let normal = double::cross(&first, &second);
        let seen = [
            double::difference(self.points[0], from),
            double::difference(self.points[1], from),
        ];
        let values = [
            double::dot(&normal, &seen[0]),
            double::dot(&normal, &seen[1]),
        ];
        let size = largest(&first) * largest(&second);
        let reach = size * (largest(&seen[0]) + largest(&seen[1]));
        // What products lose to underflow is less than that error then.
        (size.min(reach) >= SMALLEST).then_some(Doubled {
            values,
            error: DOUBLED_ERROR * reach,
        })
    }

    /// Returns a form's values at both ends in the numbers of the caller's choice, up to one factor above zero.
    #[inline]
    pub(super) fn values_in<N: Number>(&self, corners: [DVec3; 3], form: FaceForm) -> [N; 2] {
        let [first, last] = self.points;
        let points = [
            Point4::from_f64((first, 1.0)),
            Point4::from_f64((last, 1.0)),
        ];
        match form {
            FaceForm::Height => [
                height_in(corners, &points[0]),
                height_in(corners, &points[1]),
            ],
            FaceForm::Edge(corner) => {
                let corner = usize::from(corner);
                let from = Vector::from_f64(corners[corner]);
                let along = Vector::from_f64(corners[(corner + 1) % 3]).minus(&from);
                let towards = Point4::from_f64(self.light).seen_from(&from);
                let normal = towards.cross(&along);
                [
                    normal.dot(&points[0].seen_from(&from)),
                    normal.dot(&points[1].seen_from(&from)),
                ]
            }
        }
    }
}

/// Returns the largest magnitude of a component.
#[inline(always)]
fn largest([x, y, z]: &Doubles) -> f64 {
    x.high.abs().max(y.high.abs()).max(z.high.abs())
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

#[inline]
fn height_in<N: Number>([a, b, c]: [DVec3; 3], point: &Point4<N>) -> N {
    let from = Vector::from_f64(a);
    let first = Vector::from_f64(b).minus(&from);
    let normal = first.cross(&Vector::from_f64(c).minus(&from));
    normal.dot(&point.seen_from(&from))
}
