//! How far the exact starts of sixteen queries lie from their points as given.
//!
//! In: starts. Out: a bound for each, what `Occluders::start_offset` says up to rounding; infinity where that
//! would look further. Invariant: no exact start lies farther off.
//!
//! For a point that surely lies over its triangle, along the axis of the normal's largest component, the exact
//! start is the point of the plane over it. With `u` the unit roundoff of `f64`:
//!
//! * Seen along the axis, the turn of two corners around the point is a difference of two products of rounded
//!   differences: `6 u` times the sum of their magnitudes bounds its error and the rounding of the
//!   comparison. Three sure turns of one sign put the point over the triangle.
//! * A component of the normal is a difference of two products of rounded differences, at most `s` in sum, so
//!   `5 u s` bounds its error. The height `n . w` adds `4 u` for each product and the sums: `10 u s` times the
//!   sum of `|w|` bounds it, and `s` is at most twice the product of the largest edge components.
//! * The start lies at the height over the slope along the axis, and no other coordinate moves.

use antumbra_geometry::{Occluders, ReceiverPoint, ReceiverTriangle};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8};

use super::rays::RAYS;

const HALF: usize = RAYS / 2;

/// The unit roundoff of `f64`.
const U: f64 = 0.5 * f64::EPSILON;

/// Points and corners, axis by axis, the two across the triangle's axis first.
struct OnTriangles {
    point: [[f64; RAYS]; 3],
    corners: [[[f64; RAYS]; 3]; 3],
}

/// Returns for each start a bound on its offset.
#[inline(always)]
pub(super) fn offsets<S: Simd>(
    simd: S,
    occluders: &Occluders,
    starts: &[ReceiverPoint],
) -> [f64; RAYS] {
    let mut given = [0.0; RAYS];
    let mut on = OnTriangles {
        point: [[0.0; RAYS]; 3],
        corners: [[[0.0; RAYS]; 3]; 3],
    };
    let mut triangles = [ReceiverTriangle::default(); RAYS];
    let mut is_on_triangle = 0_u32;
    for (place, start) in starts.iter().enumerate().take(RAYS) {
        let Some(surface) = start.surface else {
            continue;
        };
        match occluders.start_triangle(surface) {
            Some(triangle) => {
                triangles[place] = triangle;
                is_on_triangle |= 1 << place;
            }
            None => given[place] = occluders.start_offset(start),
        }
    }
    for (place, start) in starts.iter().enumerate().take(RAYS) {
        if is_on_triangle >> place & 1 == 0 {
            continue;
        }
        let axis = triangles[place].axis();
        let [a, b, c] = occluders.start_corners(&triangles[place]);
        let (u, v, w) = [(1, 2, 0), (2, 0, 1), (0, 1, 2)][axis % 3];
        let point = start.point.to_array();
        let (a, b, c) = (a.to_array(), b.to_array(), c.to_array());
        on.point[0][place] = point[u];
        on.point[1][place] = point[v];
        on.point[2][place] = point[w];
        on.corners[0][0][place] = a[u];
        on.corners[0][1][place] = a[v];
        on.corners[0][2][place] = a[w];
        on.corners[1][0][place] = b[u];
        on.corners[1][1][place] = b[v];
        on.corners[1][2][place] = b[w];
        on.corners[2][0][place] = c[u];
        on.corners[2][1][place] = c[v];
        on.corners[2][2][place] = c[w];
    }
    if is_on_triangle == 0 {
        return given;
    }
    for half in 0..2 {
        let bounds: [f64; HALF] = on.bounds(simd, half * HALF).into();
        for (i, bound) in bounds.into_iter().enumerate() {
            let place = half * HALF + i;
            if is_on_triangle >> place & 1 != 0 {
                given[place] = bound;
            }
        }
    }
    given
}

type Lanes<S> = f64x8<S>;

impl OnTriangles {
    #[inline(always)]
    fn load<S: Simd>(simd: S, rows: &[[f64; RAYS]; 3], first: usize) -> [Lanes<S>; 3] {
        [
            Lanes::from_slice(simd, &rows[0][first..first + HALF]),
            Lanes::from_slice(simd, &rows[1][first..first + HALF]),
            Lanes::from_slice(simd, &rows[2][first..first + HALF]),
        ]
    }

    #[inline(always)]
    fn bounds<S: Simd>(&self, simd: S, first: usize) -> Lanes<S> {
        let splat = |x: f64| Lanes::splat(simd, x);
        let tiny = splat(f64::MIN_POSITIVE);
        let zero = splat(0.0);
        let point = Self::load(simd, &self.point, first);
        let a = Self::load(simd, &self.corners[0], first);
        let b = Self::load(simd, &self.corners[1], first);
        let c = Self::load(simd, &self.corners[2], first);

        // Whether it surely lies over the triangle.
        let (to_a, to_b, to_c) = (minus(a, point), minus(b, point), minus(c, point));
        let (ab_least, ab_most) = turn(simd, to_a, to_b);
        let (bc_least, bc_most) = turn(simd, to_b, to_c);
        let (ca_least, ca_most) = turn(simd, to_c, to_a);
        let is_over = ab_least.min(bc_least).min(ca_least).simd_gt(zero)
            | ab_most.max(bc_most).max(ca_most).simd_lt(zero);

        // How far from its plane.
        let (ab, ac, seen) = (minus(b, a), minus(c, a), minus(point, a));
        let normal = [
            ab[1] * ac[2] - ab[2] * ac[1],
            ab[2] * ac[0] - ab[0] * ac[2],
            ab[0] * ac[1] - ab[1] * ac[0],
        ];
        let sum = seen[0].abs() + seen[1].abs() + seen[2].abs();
        let error = largest(ab) * largest(ac) * splat(20.0 * U);
        let height = (normal[0] * seen[0] + normal[1] * seen[1] + normal[2] * seen[2]).abs()
            + error * sum
            + tiny * (splat(1.0) + sum);
        let slope = normal[2].abs() - error - tiny;
        let bound = height / slope * splat(1.0 + 8.0 * f64::EPSILON);
        // Not for NaN.
        let is_bound = is_over & slope.simd_gt(zero) & bound.simd_ge(zero);
        is_bound.select(bound, splat(f64::INFINITY))
    }
}

#[inline(always)]
fn minus<S: Simd>(p: [Lanes<S>; 3], q: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

/// The least and the most that a turn may be.
#[inline(always)]
fn turn<S: Simd>(simd: S, p: [Lanes<S>; 3], q: [Lanes<S>; 3]) -> (Lanes<S>, Lanes<S>) {
    let (first, second) = (p[0] * q[1], p[1] * q[0]);
    let error = (first.abs() + second.abs()) * Lanes::splat(simd, 6.0 * U)
        + Lanes::splat(simd, f64::MIN_POSITIVE);
    let turn = first - second;
    (turn - error, turn + error)
}

#[inline(always)]
fn largest<S: Simd>(v: [Lanes<S>; 3]) -> Lanes<S> {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}
