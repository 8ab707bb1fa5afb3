//! Segment and triangle (EXACTNESS.md, "Triangle").
//!
//! The hot predicate: all signs come from plain `f64` with one error bound per determinant, and
//! only doubtful ones from the generic exact evaluation.

use glam::DVec3;

use crate::number::{Approximate, Exact, Number, Point4, Sign, UNIT_ROUNDOFF, Vector, decide};
use crate::segment::{Ends, Plane, Segment};

/// `det(S, L, a, b)` up to a common factor: the volume of `L`, `a`, `b` seen from `S`.
fn edge_side<N: Number>(ends: &Ends<N>, a: DVec3, b: DVec3) -> N {
    // With everything seen from the start (times w_S) the determinant is a triple product.
    let seen = |x: DVec3| {
        Vector::from_f64(x)
            .scaled(&ends.start.w)
            .minus(&ends.start.x)
    };
    let light = ends
        .light
        .x
        .scaled(&ends.start.w)
        .minus(&ends.start.x.scaled(&ends.light.w));
    light.dot(&seen(a).cross(&seen(b)))
}

/// Returns the sign of a form at the start, and where that is zero at the middle of the start's own
/// triangle: the form's sign at starts a little further inside.
fn sign_at_start(
    segment: &Segment,
    approximate: impl Fn(&Ends<Approximate>) -> Approximate,
    exact: impl Fn(&Ends<Exact>) -> Exact,
) -> Sign {
    let ends = segment.approximate();
    let sign = decide(approximate(&ends).sign(), || exact(segment.exact()).sign());
    if sign != Sign::Zero {
        return sign;
    }
    let Some(start) = segment.inner() else {
        return Sign::Zero;
    };
    let light = ends.light;
    decide(approximate(&Ends { start, light }).sign(), || {
        let start = segment.inner()?;
        let light = Point4::from_f64(segment.light);
        exact(&Ends { start, light }).sign()
    })
}

fn exact_edge_side(segment: &Segment, a: DVec3, b: DVec3) -> Sign {
    sign_at_start(
        segment,
        |ends| edge_side(ends, a, b),
        |ends| edge_side(ends, a, b),
    )
}

/// Returns on which side of a plane the light is.
pub(crate) fn plane_side(plane: &Plane, light: (DVec3, f64)) -> Sign {
    fn side<N: Number>(plane: &Plane, light: (DVec3, f64)) -> Option<Sign> {
        plane.height::<N>(&Point4::from_f64(light)).sign()
    }
    decide(side::<Approximate>(plane, light), || {
        side::<Exact>(plane, light)
    })
}

/// Returns on which side of a plane the start is.
fn start_side(plane: &Plane, segment: &Segment) -> Sign {
    sign_at_start(
        segment,
        |ends| plane.height(&ends.start),
        |ends| plane.height(&ends.start),
    )
}

fn certain(value: f64, bound: f64) -> Option<Sign> {
    if value > bound {
        Some(Sign::Positive)
    } else if -value > bound {
        Some(Sign::Negative)
    } else {
        None
    }
}

/// Returns whether the segment crosses the triangle, by rules 2 and 3.
///
/// Error bounds, with `u` the unit roundoff, `e` the error of the origin and `|.|` the largest
/// magnitude of a component: each difference has relative error `u` besides `e`, and the triple
/// product `d . (A x B)` of three rounded differences has at most 3 + 6 roundings on products of
/// sum at most `6 |d| |A| |B|`, so `9 u * 6 = 54 u` bounds it to first order and `64 u` outright.
/// Moving the origin by `e` in each coordinate moves it by at most
/// `3 e * 2 (|A||B| + |B||d| + |d||A|)` to first order (second-order terms cancel because the same
/// vector is subtracted from all three); `8 e` covers that with the rounding.
///
/// Seen from the light instead, the triple product is the same number, since the two ends differ by `d`; then
/// only `d` moves with the origin, by `e` in each coordinate, and the product by `6 e |A||B|`.
pub(crate) fn triangle_blocks([a, b, c]: [DVec3; 3], segment: &Segment) -> bool {
    let origin = segment.origin;
    let origin_error = segment.origin_error;
    let direction = segment.direction();
    let largest = |v: DVec3| v.abs().max_element();
    let a_from_start = a - origin;
    let (light, light_weight) = segment.light;
    let from_plane = if light_weight == 0.0 {
        light
    } else {
        light - a
    };
    // The closer end of the two sees more clearly: starts can be very far from everything.
    let end = if light_weight != 0.0 && largest(from_plane) < largest(a_from_start) {
        light
    } else {
        origin
    };
    let (a_seen, b_seen, c_seen) = (a - end, b - end, c - end);
    let (m_d, m_a, m_b, m_c) = (
        largest(direction),
        largest(a_seen),
        largest(b_seen),
        largest(c_seen),
    );
    let bound = |m1: f64, m2: f64| {
        64.0 * UNIT_ROUNDOFF * m_d * m1 * m2
            + 8.0 * origin_error * (m1 * m2 + m2 * m_d + m_d * m1)
            + f64::MIN_POSITIVE
    };

    // Rule 3, as far as the filter goes: both signs among the edges rule the triangle out.
    let ab = direction.dot(a_seen.cross(b_seen));
    let bc = direction.dot(b_seen.cross(c_seen));
    let ca = direction.dot(c_seen.cross(a_seen));
    let sides = [
        certain(ab, bound(m_a, m_b)),
        certain(bc, bound(m_b, m_c)),
        certain(ca, bound(m_c, m_a)),
    ];
    let is_seen = |sign: Sign| sides.contains(&Some(sign));
    if is_seen(Sign::Positive) && is_seen(Sign::Negative) {
        return false;
    }

    // Rule 2: start and light strictly on opposite sides of the plane. The same bound with the two
    // edge vectors in place of two seen corners.
    let (edge_ab, edge_ac) = (b - a, c - a);
    let normal = edge_ab.cross(edge_ac);
    let m_normal = largest(edge_ab) * largest(edge_ac);
    let plane = Plane::Points([a, b, c]);
    let start_height = -normal.dot(a_from_start);
    let start_bound = m_normal
        * (64.0 * UNIT_ROUNDOFF * largest(a_from_start) + 8.0 * origin_error)
        + f64::MIN_POSITIVE;
    let light_height = normal.dot(from_plane);
    let light_bound = 64.0 * UNIT_ROUNDOFF * m_normal * largest(from_plane) + f64::MIN_POSITIVE;
    let light_sign =
        certain(light_height, light_bound).unwrap_or_else(|| plane_side(&plane, segment.light));
    if light_sign == Sign::Zero {
        return false;
    }
    // Doubtful edges before a doubtful start: most triangles near the start are coplanar
    // neighbours, which the edges rule out more cheaply.
    let mut signs = [Sign::Zero; 3];
    let corners = [a, b, c];
    for i in 0..3 {
        signs[i] =
            sides[i].unwrap_or_else(|| exact_edge_side(segment, corners[i], corners[(i + 1) % 3]));
    }
    if signs.contains(&Sign::Positive) && signs.contains(&Sign::Negative) {
        return false;
    }
    let start_sign =
        certain(start_height, start_bound).unwrap_or_else(|| start_side(&plane, segment));
    start_sign.is_opposite(light_sign)
}

/// Returns whether the segment crosses the triangle, and where it goes through an edge that two triangles of a sheet share,
/// whether it is this one that counts: as if the start were moved by `(e, e^2, e^3)` for an `e` as small as you like.
pub(crate) fn triangle_is_pierced(corners: [DVec3; 3], segment: &Segment) -> bool {
    if !triangle_blocks(corners, segment) {
        return false;
    }
    let side = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        match exact_edge_side(segment, a, b) {
            Sign::Zero => side_of_moved_start(segment.light, a, b),
            sign => sign,
        }
    };
    let first = side(0);
    first != Sign::Zero && side(1) == first && side(2) == first
}

/// Returns the sign of `det(S, L, a, b)` that is zero, at a start moved by `(e, e^2, e^3)`: that of the first component that
/// is not zero of its gradient, which is a normal of the plane through light and edge. Zero if the light is on the edge's
/// line.
fn side_of_moved_start(light: (DVec3, f64), a: DVec3, b: DVec3) -> Sign {
    let Point4 {
        x: light,
        w: weight,
    } = Point4::<Exact>::from_f64(light);
    let [a, b] = [a, b].map(Vector::from_f64);
    let from_start = a.cross(&b).scaled(&weight);
    let normal = light.cross(&a.minus(&b)).plus(&from_start);
    let signs = normal.0.iter().map(|component| {
        component
            .sign()
            .expect("exact arithmetic always knows the sign")
    });
    let first = signs.into_iter().find(|&sign| sign != Sign::Zero);
    first.map_or(Sign::Zero, Sign::flipped)
}

/// Largest error of a plane's distance, in shares of the lengths it is made of: as much as the grids
/// allow for ([`crate::Occluders::hit`]).
const DISTANCE_ERROR: f64 = 1.0 / (1u64 << 40) as f64;

/// Returns the distance of the crossing with a plane in lengths of the segment's direction, or `None`
/// where the plane is seen so much from the edge that `f64` cannot tell it well; `normal_size`
/// bounds the products that the normal is made of.
pub(crate) fn clear_plane_distance(
    normal: DVec3,
    normal_size: f64,
    point: DVec3,
    segment: &Segment,
) -> Option<f64> {
    let largest = |v: DVec3| v.abs().max_element();
    let direction = segment.direction();
    let seen = point - segment.origin();
    let rate = normal.dot(direction);
    let distance = (normal.dot(seen) / rate).max(0.0);
    // As in `triangle_blocks`.
    let roundoff = 64.0 * UNIT_ROUNDOFF * normal_size;
    let height_error =
        roundoff * largest(seen) + 8.0 * normal_size * segment.origin_error + f64::MIN_POSITIVE;
    let rate_error = roundoff * largest(direction) + f64::MIN_POSITIVE;
    let error = (height_error + distance * rate_error) / (rate.abs() - rate_error);
    let room = DISTANCE_ERROR * largest(seen) / largest(direction);
    (0.0..=room).contains(&error).then_some(distance)
}

/// The same, exactly, rounded.
pub(crate) fn exact_plane_distance(plane: &Plane, segment: &Segment) -> f64 {
    let Ends { start, light } = segment.exact();
    let (at_start, at_light) = (plane.height(start), plane.height(light));
    let distance = if segment.is_finite() {
        let reach = at_start.times(&light.w);
        reach.over(&reach.minus(&at_light.times(&start.w)))
    } else {
        at_start.negated().over(&at_light.times(&start.w))
    };
    distance.max(0.0)
}

/// Returns the distance of the crossing in lengths of the segment's direction, and the weights of
/// `b` and `c` there.
pub(crate) fn triangle_distance([a, b, c]: [DVec3; 3], segment: &Segment) -> (f64, [f64; 2]) {
    let (origin, direction) = (segment.origin(), segment.direction());
    let (edge_ab, edge_ac) = (b - a, c - a);
    let normal_size = edge_ab.abs().max_element() * edge_ac.abs().max_element();
    let Some(distance) = clear_plane_distance(edge_ab.cross(edge_ac), normal_size, a, segment)
    else {
        // Seen almost from the edge: a rounded crossing could be anywhere along it.
        let ends = segment.exact();
        let weights = [
            edge_side(ends, b, c),
            edge_side(ends, c, a),
            edge_side(ends, a, b),
        ];
        let total = weights[0].plus(&weights[1]).plus(&weights[2]);
        let distance = exact_plane_distance(&Plane::Points([a, b, c]), segment);
        return (distance, [weights[1].over(&total), weights[2].over(&total)]);
    };
    let (a_seen, b_seen, c_seen) = (a - origin, b - origin, c - origin);
    // The three edge determinants are the weights of the opposite corners, up to a factor.
    let weight_a = direction.dot(b_seen.cross(c_seen));
    let weight_b = direction.dot(c_seen.cross(a_seen));
    let weight_c = direction.dot(a_seen.cross(b_seen));
    let total = weight_a + weight_b + weight_c;
    let share = |weight: f64| {
        let share = weight / total;
        if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            1.0 / 3.0
        }
    };
    (distance, [share(weight_b), share(weight_c)])
}
