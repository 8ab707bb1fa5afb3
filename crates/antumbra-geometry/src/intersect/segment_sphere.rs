//! Segment and sphere (EXACTNESS.md, "Sphere").

use super::signs_in_quadrant;
use crate::Sphere;
use crate::number::{Number, Point4, Sign, Vector, decide};
use crate::segment::{Ends, Segment};

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
    decide(rule(sphere, &segment.approximate()), || {
        rule(sphere, &segment.exact())
    })
}

/// Returns on which side of the tangent plane at the start the light is; positive is outside.
pub(crate) fn sphere_side(sphere: &Sphere, segment: &Segment) -> Sign {
    fn rule<N: Number>(sphere: &Sphere, ends: &Ends<N>) -> Option<Sign> {
        polar(sphere, &ends.start, &ends.light).sign()
    }
    decide(rule(sphere, &segment.approximate()), || {
        rule(sphere, &segment.exact())
    })
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
            is_outside(sphere, &segment.exact())
        })
}

/// Returns the distance of the crossing that [`sphere_blocks`] or, for the own surface,
/// [`own_sphere_blocks`] found, in lengths of the segment's direction.
pub(crate) fn sphere_distance(sphere: &Sphere, segment: &Segment, is_own: bool) -> f64 {
    let from_center = segment.origin() - sphere.center;
    let direction = segment.direction();
    let a = direction.length_squared();
    let half_b = from_center.dot(direction);
    let c = from_center.length_squared() - sphere.radius * sphere.radius;
    if is_own {
        // One root is the start itself.
        return (-2.0 * half_b / a).max(0.0);
    }
    // Distance of the centre from the line, without the cancellation of b^2 - ac.
    let closest = from_center - direction * (half_b / a);
    let half_chord_squared = sphere.radius * sphere.radius - closest.length_squared();
    let root = (half_chord_squared.max(0.0) * a).sqrt();
    let q = -(half_b + root.copysign(half_b));
    let (near, far) = if half_b > 0.0 {
        (q / a, c / q)
    } else {
        (c / q, q / a)
    };
    (if c >= 0.0 { near } else { far }).max(0.0)
}
