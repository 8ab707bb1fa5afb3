//! Segment and sphere (EXACTNESS.md, "Sphere").

use glam::DVec3;

use super::{near_one, signs_in_quadrant};
use crate::number::{Number, Point4, Sign, UNIT_ROUNDOFF, Vector, decide};
use crate::segment::{Ends, Segment};
use crate::{LightShape, Sphere};

/// `Q(X, Y)`: the sphere's quadratic form in its polar form.
fn polar<N: Number>(sphere: &Sphere, x: &Point4<N>, y: &Point4<N>) -> N {
    let center = Vector::from_f64(sphere.center);
    let radius = N::from_f64(sphere.radius);
    let power = radius.times(&radius).times(&x.w).times(&y.w);
    x.seen_from(&center)
        .dot(&y.seen_from(&center))
        .minus(&power)
}

/// Returns whether the open segment has points strictly inside and points strictly outside.
pub(crate) fn sphere_blocks(sphere: &Sphere, segment: &Segment) -> bool {
    fn rule<N: Number>(sphere: &Sphere, ends: &Ends<N>) -> Option<bool> {
        let a = polar(sphere, &ends.start, &ends.start);
        let b = polar(sphere, &ends.start, &ends.light);
        let c = polar(sphere, &ends.light, &ends.light);
        // Outside is no convex set, but its points on a segment reach an end.
        let is_end_outside = a.sign()?.is_positive() || c.sign()?.is_positive();
        Some(is_end_outside && signs_in_quadrant(&a, &b, &c)?.negative)
    }
    decide(filter(sphere, segment), || {
        rule(sphere, &segment.approximate()).or_else(|| rule(sphere, segment.exact()))
    })
}

/// The rule in plain `f64` with one error bound per form, for the many clear cases.
///
/// With `u` the unit roundoff: the components seen from the centre have relative error `u`, each
/// product of two of them `3 u`, and the three-term sums add at most `3 u` more, so `8 u` times the
/// sum of magnitudes bounds each form to first order and `16 u` outright. An origin off by `e` in
/// each coordinate moves `A` by at most `2 e |q|_1 + 3 e^2` and `B` by `e |l|_1`.
fn filter(sphere: &Sphere, segment: &Segment) -> Option<bool> {
    const BOUND: f64 = 16.0 * UNIT_ROUNDOFF;
    let from_center = segment.origin - sphere.center;
    let (light, weight) = segment.light;
    let power = sphere.radius * sphere.radius;
    let (to_light, light_power) = if weight == 0.0 {
        (light, 0.0)
    } else {
        (light - sphere.center, power)
    };
    let e = segment.origin_error;
    let from_sum = from_center.abs().element_sum();
    let light_sum = to_light.abs().element_sum();

    let a_square = from_center.length_squared();
    let a = a_square - power;
    let a_error = BOUND * (a_square + power) + e * (2.0 * from_sum + 3.0 * e) * 1.01;
    let b = from_center.dot(to_light) - light_power;
    let b_error = BOUND * (from_sum * light_sum + light_power) + e * light_sum * 1.01;
    let c_square = to_light.length_squared();
    let c = c_square - light_power;
    let c_error = BOUND * (c_square + light_power);

    let tiny = f64::MIN_POSITIVE;
    let sure = |value: f64, error: f64| {
        if value > error + tiny {
            Some(Sign::Positive)
        } else if -value > error + tiny {
            Some(Sign::Negative)
        } else {
            None
        }
    };
    let (sign_a, sign_c) = (sure(a, a_error)?, sure(c, c_error)?);
    if sign_a.is_opposite(sign_c) {
        return Some(true);
    }
    if sign_a.is_negative() {
        return Some(false);
    }
    // Both ends outside: the middle dips in if B is negative and B^2 > A C.
    if sure(b, b_error)?.is_positive() {
        return Some(false);
    }
    let discriminant = b * b - a * c;
    let error = (2.0 * b.abs() * b_error + b_error * b_error)
        + (a * c_error + c * a_error + a_error * c_error)
        + BOUND * (b * b + a * c);
    Some(sure(discriminant, error * 1.01)?.is_positive())
}

/// Returns whether the segment's line surely misses a ball; `false` says nothing.
pub(crate) fn line_surely_misses_ball(center: DVec3, radius: f64, segment: &Segment) -> bool {
    let from_center = segment.origin - center;
    let direction = segment.direction();
    let along = from_center.dot(direction);
    let length_squared = direction.length_squared();
    // |q|^2 |d|^2 - (q.d)^2 > r^2 |d|^2, with room for every rounding and the origin's error.
    let square = from_center.length_squared();
    let room = radius + 4.0 * segment.origin_error;
    let slack = 64.0 * UNIT_ROUNDOFF * (square + room * room) * length_squared;
    (square - room * room) * length_squared - along * along > slack + f64::MIN_POSITIVE
}

/// Returns on which side of the tangent plane at the start the light is; positive is outside.
pub(crate) fn sphere_side(sphere: &Sphere, segment: &Segment) -> Sign {
    fn rule<N: Number>(sphere: &Sphere, ends: &Ends<N>) -> Option<Sign> {
        polar(sphere, &ends.start, &ends.light).sign()
    }
    let origin = (segment.origin, segment.origin_error);
    decide(side_filter(sphere, origin, segment.light, 0.0), || {
        rule(sphere, &segment.approximate()).or_else(|| rule(sphere, segment.exact()))
    })
}

/// The sign of `B` in plain `f64`, from an origin and its error, for all lights up to `slack` from one; bounds as at [`filter`].
/// A light off by `slack` in each coordinate moves `B` by that much times the origin's coordinates, seen from the centre.
#[inline(always)]
fn side_filter(
    sphere: &Sphere,
    (origin, origin_error): (DVec3, f64),
    (light, weight): (DVec3, f64),
    slack: f64,
) -> Option<Sign> {
    let from_center = origin - sphere.center;
    let (to_light, power) = if weight == 0.0 {
        (light, 0.0)
    } else {
        (light - sphere.center, sphere.radius * sphere.radius)
    };
    let light_sum = to_light.abs().element_sum();
    let b = from_center.dot(to_light) - power;
    let from_sum = from_center.abs().element_sum();
    let error = 16.0 * UNIT_ROUNDOFF * (from_sum * light_sum + power)
        + (origin_error * light_sum + slack * from_sum) * 1.01
        + f64::MIN_POSITIVE;
    if b > error {
        Some(Sign::Positive)
    } else if -b > error {
        Some(Sign::Negative)
    } else {
        None
    }
}

/// The own rule: the light is behind the tangent plane and outside the sphere.
pub(crate) fn own_sphere_blocks(sphere: &Sphere, segment: &Segment) -> bool {
    fn is_outside<N: Number>(sphere: &Sphere, ends: &Ends<N>) -> Option<bool> {
        Some(
            polar(sphere, &ends.light, &ends.light)
                .sign()?
                .is_positive(),
        )
    }
    sphere_side(sphere, segment).is_negative()
        && decide(is_outside(sphere, &segment.approximate()), || {
            is_outside(sphere, segment.exact())
        })
}

/// The own rule in plain `f64`, for a start as given and before a segment is made; `None` where it is in doubt.
#[inline(always)]
pub(crate) fn own_sphere_filter(
    sphere: &Sphere,
    start: DVec3,
    light: (DVec3, f64),
) -> Option<bool> {
    if side_filter(sphere, (start, 0.0), light, 0.0)?.is_positive() {
        return Some(false);
    }
    let (at, weight) = light;
    // The sign of `C`; bounds as at [`filter`].
    let power = weight * sphere.radius * sphere.radius;
    let square = (at - weight * sphere.center).length_squared();
    let error = 16.0 * UNIT_ROUNDOFF * (square + power) + f64::MIN_POSITIVE;
    (square - power > error).then_some(true)
}

/// Returns whether a light, and all within some distance of it, is surely in front of the tangent plane at a start as given.
pub(crate) fn own_sphere_surely_shows(
    sphere: &Sphere,
    start: DVec3,
    light: &LightShape,
    slack: f64,
) -> bool {
    side_filter(sphere, (start, 0.0), light.homogeneous(), slack)
        .is_some_and(|side| side.is_positive())
}

/// Returns the distance of the crossing that [`sphere_blocks`] or, for the own surface,
/// [`own_sphere_blocks`] found, in lengths of the segment's direction.
pub(crate) fn sphere_distance(sphere: &Sphere, segment: &Segment, is_own: bool) -> f64 {
    let from_center = segment.origin() - sphere.center;
    let direction = segment.direction();
    let length_scale = near_one(from_center.abs().max_element().max(sphere.radius));
    let direction_scale = near_one(direction.abs().max_element());
    let (from_center, radius) = (from_center * length_scale, sphere.radius * length_scale);
    let direction = direction * direction_scale;
    let unscaled = |distance: f64| distance.max(0.0) * direction_scale / length_scale;
    let a = direction.length_squared();
    let half_b = from_center.dot(direction);
    let c = from_center.length_squared() - radius * radius;
    if is_own {
        // One root is the start itself.
        return unscaled(-2.0 * half_b / a);
    }
    // Distance of the centre from the line, without the cancellation of b^2 - ac.
    let closest = from_center - direction * (half_b / a);
    let half_chord_squared = radius * radius - closest.length_squared();
    let root = (half_chord_squared.max(0.0) * a).sqrt();
    let q = -(half_b + root.copysign(half_b));
    let (near, far) = if half_b > 0.0 {
        (q / a, c / q)
    } else {
        (c / q, q / a)
    };
    unscaled(if c >= 0.0 { near } else { far })
}
