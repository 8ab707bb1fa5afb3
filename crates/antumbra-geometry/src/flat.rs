//! Points over triangles, seen along an axis: the nearest point of a closed triangle; and the nearest one of all, rounded.
//!
//! In: a point, a triangle whose normal has its largest component along the axis. Out: whether the
//! point lies over the triangle, the point of its boundary nearest in the two other coordinates, and
//! a bound on how far that is. The two other coordinates are `f64`s as given, so nothing here needs
//! the plane.

use glam::DVec3;

use crate::number::{Approximate, Exact, Number, Point4, Sign, UNIT_ROUNDOFF, Vector, decide};

/// The coordinates across an axis, in cyclic order.
fn across(axis: usize) -> (usize, usize) {
    [(1, 2), (2, 0), (0, 1)][axis]
}

/// Twice the area of `a`, `b`, `c` seen along the axis.
fn turn<N: Number>(a: DVec3, b: DVec3, c: DVec3, axis: usize) -> N {
    let (u, v) = across(axis);
    let difference = |p: DVec3, q: DVec3, i: usize| N::from_f64(p[i]).minus(&N::from_f64(q[i]));
    let first = difference(b, a, u).times(&difference(c, a, v));
    first.minus(&difference(b, a, v).times(&difference(c, a, u)))
}

fn turn_sign(a: DVec3, b: DVec3, c: DVec3, axis: usize) -> Sign {
    decide(turn::<Approximate>(a, b, c, axis).sign(), || {
        turn::<Exact>(a, b, c, axis).sign()
    })
}

/// Returns whether the point lies over the closed triangle.
pub(crate) fn is_over(point: DVec3, [a, b, c]: [DVec3; 3], axis: usize) -> bool {
    let outward = turn_sign(a, b, c, axis).flipped();
    [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(from, to)| turn_sign(from, to, point, axis) != outward)
}

/// Returns the point of the boundary nearest to `point`, the first of the edges `ab`, `bc`, `ca` on
/// ties.
pub(crate) fn nearest_on_boundary(point: DVec3, corners: [DVec3; 3], axis: usize) -> Point4<Exact> {
    let mut best: Option<(Point4<Exact>, Distance)> = None;
    for i in 0..3 {
        let candidate = nearest_on_edge(point, corners[i], corners[(i + 1) % 3], axis);
        if best
            .as_ref()
            .is_none_or(|(_, distance)| candidate.1.is_less_than(distance))
        {
            best = Some(candidate);
        }
    }
    best.map_or_else(|| Point4::from_f64((point, 1.0)), |(nearest, _)| nearest)
}

/// Returns a power of two that brings the largest magnitude near 1, so that squares neither vanish nor
/// overflow; 1 for zero.
pub(crate) fn to_unit(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    // Subnormal numbers stay subnormal by less than 2^52, which squares bear.
    let exponent = (largest.to_bits() >> 52).clamp(1, 2045);
    f64::from_bits((2046 - exponent) << 52)
}

/// Returns the length of a vector of any size.
pub(crate) fn length(v: DVec3) -> f64 {
    let scale = to_unit(v.abs().max_element());
    (v * scale).length() / scale
}

/// Returns the way from a point to the nearest point of a triangle, rounded (EXACTNESS.md, "Distances").
pub(crate) fn way_to_triangle(corners: [DVec3; 3], point: DVec3) -> DVec3 {
    let corners = corners.map(|x| x - point);
    let largest = corners
        .iter()
        .fold(DVec3::ZERO, |most, x| most.max(x.abs()));
    let scale = to_unit(largest.max_element());
    let [a, b, c] = corners.map(|x| x * scale);
    nearest_of_triangle(a, b, c) / scale
}

/// By the region that the origin is in (Ericson 2005, 5.1.5).
fn nearest_of_triangle(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    // Over the inside: the plane's normal points at it.
    let normal = ab.cross(ac);
    normal * (normal.dot(a) / normal.length_squared())
}

/// A squared distance as a fraction with a positive denominator.
struct Distance {
    numerator: Exact,
    denominator: Exact,
}

impl Distance {
    fn is_less_than(&self, other: &Self) -> bool {
        let ours = self.numerator.times(&other.denominator);
        let theirs = other.numerator.times(&self.denominator);
        ours.minus(&theirs).sign() == Some(Sign::Negative)
    }
}

/// Returns the point of a closed edge nearest to `point`.
fn nearest_on_edge(point: DVec3, from: DVec3, to: DVec3, axis: usize) -> (Point4<Exact>, Distance) {
    let (u, v) = across(axis);
    let difference =
        |p: DVec3, q: DVec3, i: usize| Exact::from_f64(p[i]).minus(&Exact::from_f64(q[i]));
    let dot = |p: DVec3, q: DVec3, r: DVec3| {
        // (p - r) . (q - r)
        difference(p, r, u)
            .times(&difference(q, r, u))
            .plus(&difference(p, r, v).times(&difference(q, r, v)))
    };
    let length_squared = dot(to, to, from);
    let along = dot(point, to, from);
    let at_vertex = |vertex: DVec3| {
        let numerator = dot(point, point, vertex);
        let distance = Distance {
            numerator,
            denominator: Exact::from_f64(1.0),
        };
        (Point4::from_f64((vertex, 1.0)), distance)
    };
    if along.sign() != Some(Sign::Positive) {
        return at_vertex(from);
    }
    if length_squared.minus(&along).sign() != Some(Sign::Positive) {
        return at_vertex(to);
    }
    // from + (to - from) along / length^2, all times length^2.
    let origin: Vector<Exact> = Vector::from_f64(from);
    let edge = Vector::from_f64(to).minus(&origin);
    let nearest = Point4 {
        x: origin.scaled(&length_squared).plus(&edge.scaled(&along)),
        w: length_squared.clone(),
    };
    let height: Exact = turn(from, to, point, axis);
    let distance = Distance {
        numerator: height.times(&height),
        denominator: length_squared,
    };
    (nearest, distance)
}

/// Returns a bound on how far, in any coordinate, the nearest point of the closed triangle lies from
/// the point of its plane over or under `point`.
///
/// The plane's slope over the two other coordinates is at most 1 in each, so the third coordinate
/// moves by at most the sum of the other two moves.
#[inline]
pub(crate) fn largest_move(point: DVec3, corners: [DVec3; 3], axis: usize) -> f64 {
    let (u, v) = across(axis);
    let point = point.to_array();
    let seen = |corner: DVec3| {
        let corner = corner.to_array();
        (corner[u] - point[u], corner[v] - point[v])
    };
    let [a, b, c] = corners;
    let (a, b, c) = (seen(a), seen(b), seen(c));
    // Surely over the triangle: all three turns have one sign, beyond their rounding. Each is a
    // difference of two products of rounded differences, so 6 units bound it with the
    // rounding of the comparison.
    let turn = |p: (f64, f64), q: (f64, f64)| {
        let (first, second) = (p.0 * q.1, p.1 * q.0);
        (
            first - second,
            6.0 * UNIT_ROUNDOFF * (first.abs() + second.abs()) + f64::MIN_POSITIVE,
        )
    };
    let (ab, bc, ca) = (turn(a, b), turn(b, c), turn(c, a));
    let least = (ab.0 - ab.1).min(bc.0 - bc.1).min(ca.0 - ca.1);
    let most = (ab.0 + ab.1).max(bc.0 + bc.1).max(ca.0 + ca.1);
    if least > 0.0 || most < 0.0 {
        return 0.0;
    }
    // Else at most as far as some point that is surely in the triangle up to rounding: the rounded
    // nearest points of its edges are.
    let on_edge = |p: (f64, f64), q: (f64, f64)| {
        let edge = (q.0 - p.0, q.1 - p.1);
        let length_squared = edge.0 * edge.0 + edge.1 * edge.1;
        let along = -(p.0 * edge.0 + p.1 * edge.1) / length_squared;
        let along = if along.is_nan() {
            0.0
        } else {
            along.clamp(0.0, 1.0)
        };
        let nearest = (p.0 + along * edge.0, p.1 + along * edge.1);
        nearest.0.abs() + nearest.1.abs()
    };
    let distance = on_edge(a, b).min(on_edge(b, c)).min(on_edge(c, a));
    let size = [a, b, c]
        .iter()
        .fold(0.0_f64, |size, p| size.max(p.0.abs()).max(p.1.abs()));
    // The sum of the moves across bounds the Euclidean one, which is at least each of ours; the
    // third coordinate's is at most sqrt(2) times it.
    1.5 * distance + 32.0 * UNIT_ROUNDOFF * size + f64::MIN_POSITIVE
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [
        DVec3::new(0.0, 0.0, 1.0),
        DVec3::new(4.0, 0.0, 1.0),
        DVec3::new(0.0, 4.0, 3.0),
    ];

    fn position(point: &Point4<Exact>, expected: DVec3) -> bool {
        let seen = point.seen_from(&Vector::from_f64(expected));
        seen.0
            .iter()
            .all(|coordinate| coordinate.sign() == Some(Sign::Zero))
    }

    #[test]
    fn boundary_counts_as_over() {
        assert!(is_over(DVec3::new(1.0, 1.0, 9.0), CORNERS, 2));
        assert!(is_over(DVec3::new(2.0, 0.0, 9.0), CORNERS, 2));
        assert!(is_over(DVec3::new(4.0, 0.0, 9.0), CORNERS, 2));
        assert!(!is_over(DVec3::new(2.0, -5e-324, 9.0), CORNERS, 2));
        let flipped = [CORNERS[0], CORNERS[2], CORNERS[1]];
        assert!(is_over(DVec3::new(1.0, 1.0, 9.0), flipped, 2));
    }

    #[test]
    fn nearest_is_on_the_edge_or_a_vertex() {
        let nearest = |x: f64, y: f64| nearest_on_boundary(DVec3::new(x, y, 7.0), CORNERS, 2);
        assert!(position(&nearest(1.0, -3.0), DVec3::new(1.0, 0.0, 1.0)));
        assert!(position(&nearest(-1.0, 2.0), DVec3::new(0.0, 2.0, 2.0)));
        assert!(position(&nearest(3.0, 3.0), DVec3::new(2.0, 2.0, 2.0)));
        assert!(position(&nearest(9.0, -1.0), DVec3::new(4.0, 0.0, 1.0)));
    }

    #[test]
    fn move_is_bounded() {
        assert_eq!(largest_move(DVec3::new(1.0, 1.0, 0.0), CORNERS, 2), 0.0);
        let off = largest_move(DVec3::new(1.0, -0.5, 0.0), CORNERS, 2);
        assert!((0.5..1.0).contains(&off), "{off}");
        assert!(largest_move(DVec3::new(1.0, -1e-16, 0.0), CORNERS, 2) < 1e-13);
    }
}
