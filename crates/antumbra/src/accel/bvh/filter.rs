//! Four shapes at a time in `f32`: surely missed, surely hit, or for the exact rule to say.
//!
//! # Triangles
//!
//! Seen from the start `o` along the direction `d`, with `C = a - o`, edges `B = b - a`, `D = c - a`
//! and `N = B x D`, rule 3 asks for the signs of
//!
//! `w_ab = (d x C) . B`, `w_ca = -(d x C) . D`, `w_bc = d . N - w_ab - w_ca`,
//!
//! and rule 2 for those of the heights `h_S = N . C` of the start (negated) and `h_S - t d . N` of the
//! point at `t`, where the light is or the ray is outside the frame. A crossing lies in the frame, so
//! that such a point, and a start that was moved to the frame, are as good as the ends themselves.
//!
//! Bounds, with `u = 2^-24`; `|d| < 2`, `|C| <= 2`, `M` the reach (all largest components); `p` the
//! error of a component of `C` (rounding of corner, start and difference, and the margin), `e` that of
//! one of `d`; edges have relative error `u`. First-order terms, with 2 percent added for the others:
//!
//! * `R = d x C`: `|R| <= 8`, error `4 e + 4 p + 16 u`.
//! * `R . B`: `3 M (4 e + 4 p + 16 u) + 24 M u` from its inputs, `(24 + 16 + 24) M u` of its own:
//!   `(12 e + 12 p + 136 u) M`.
//! * `N`: `|N| <= 2 M^2`, error `8 M^2 u`.
//! * `N . C`: `(48 + 12 + 20) M^2 u + 6 M^2 p`; `d . N` the same with `e`; `M <= 2`.
//! * `w_bc`: twice the bound of `w_ab`, that of `d . N` as `(160 u + 12 e) M`, and `144 M u` for two
//!   sums: `(36 e + 24 p + 576 u) M`.
//! * the light's height, `t <= 9/4`: those of `N . C` and of `t` times `d . N`, `120 M^2 u` for
//!   the rounding of `t`, product and sum, and `4 M^2 u` for a `t` that is counted from a far start, which errs
//!   by `2^-26` of the frame: `(6 p + 15.5 e + 404 u) M^2`.
//!
//! # Spheres
//!
//! With `C = c - o`, `|d x C|` is the distance of the line from the centre, times `|d|`: its length
//! errs by `sqrt(3) (4 e + 4 p + 16 u)` and, from its square, `2.5 u` of itself, at most `14`; `r |d|`
//! by `20 u`, and squaring it costs `6 u`: `7 e + 7 p + 100 u` bounds all. The line surely misses the ball
//! if the distance exceeds `r |d|` by more, and surely meets its inside if `r |d|` exceeds it by more.
//! The nearest point of the line is strictly between the ends if `d . C` and `d . (c - l)` have
//! opposite sure signs, errors at most `6 e + 6 p + 32 u` and, with `t |d|^2` at most 27,
//! `33 e + 6 p + 320 u`: five times the bound. Then the segment has a point inside; it blocks if also
//! the start is surely outside, which an excess of the bound over `r` says for `|C|`.

use std::ops::{Add, Mul};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16};

use super::data::{LANES, SphereGroup, TriangleGroup};
use super::ray::{FilterBounds, FrameRay};
use super::rays::{RAYS, Rays};

/// What a filter found, a bit for each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdicts {
    /// Not surely missed.
    pub(super) possible: u32,
    /// Surely hit.
    pub(super) sure: u32,
}

type Lanes<S> = f32x4<S>;

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, rows: &[[f32; LANES]; 3]) -> [Lanes<S>; 3] {
    [
        Lanes::from_slice(simd, &rows[0]),
        Lanes::from_slice(simd, &rows[1]),
        Lanes::from_slice(simd, &rows[2]),
    ]
}

#[inline(always)]
pub(super) fn cross<S: Simd>(a: [Lanes<S>; 3], b: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(super) fn dot<V: Copy + Add<Output = V> + Mul<Output = V>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn splat<S: Simd>(simd: S, v: [f32; 4]) -> [Lanes<S>; 3] {
    [
        Lanes::splat(simd, v[0]),
        Lanes::splat(simd, v[1]),
        Lanes::splat(simd, v[2]),
    ]
}

#[inline(always)]
pub(super) fn triangles<S: Simd>(simd: S, group: &TriangleGroup, ray: &FrameRay) -> Verdicts {
    let bounds = &ray.bounds;
    let direction = splat(simd, ray.direction);
    let origin = splat(simd, ray.origin);
    let corner = load(simd, &group.corner);
    let ab = load(simd, &group.edge_ab);
    let ac = load(simd, &group.edge_ac);
    let reach = Lanes::from_slice(simd, &group.reach);

    // Rule 3.
    let seen = [
        corner[0] - origin[0],
        corner[1] - origin[1],
        corner[2] - origin[2],
    ];
    let turned = cross(direction, seen);
    let normal = cross(ab, ac);
    let slope = dot(normal, direction);
    let side_ab = dot(turned, ab);
    let minus_side_ca = dot(turned, ac);
    let side_bc = (slope - side_ab + minus_side_ca) * bounds.third_edge_scale;
    let side_ca = -minus_side_ca;
    let bound = reach * bounds.edge;
    let highest = side_ab.max(side_ca).max(side_bc);
    let lowest = side_ab.min(side_ca).min(side_bc);
    let is_left = highest.simd_gt(bound);
    let is_right = lowest.simd_lt(-bound);
    let misses_edges = is_left & is_right;
    let is_inside = lowest.simd_gt(bound) | highest.simd_lt(-bound);

    // Rule 2.
    let start = dot(normal, seen);
    let light = (start - slope * ray.light) * bounds.light_height_scale;
    let bound = reach * reach * bounds.height;
    let (higher, lower) = (start.max(light), start.min(light));
    let misses_plane = lower.simd_gt(bound) | higher.simd_lt(-bound);
    let crosses_plane = higher.simd_gt(bound) & lower.simd_lt(-bound);

    Verdicts {
        possible: !(misses_edges | misses_plane).to_bitmask() as u32,
        sure: (is_inside & crosses_plane).to_bitmask() as u32,
    }
}

/// Normals of a group's triangles, `N` above.
#[inline(always)]
pub(super) fn normals<S: Simd>(simd: S, group: &TriangleGroup) -> [[f32; LANES]; 3] {
    let normal = cross(load(simd, &group.edge_ab), load(simd, &group.edge_ac));
    [normal[0].into(), normal[1].into(), normal[2].into()]
}

/// One triangle of a group against sixteen segments, by the same signs and bounds; `normals` are the
/// group's.
#[inline(always)]
pub(super) fn triangle_by_rays<S: Simd>(
    simd: S,
    group: &TriangleGroup,
    normals: &[[f32; LANES]; 3],
    lane: usize,
    rays: &Rays,
    bounds: &FilterBounds,
) -> Verdicts {
    type Wide<S> = f32x16<S>;
    let of_lane = |rows: &[[f32; LANES]; 3]| {
        [
            Wide::splat(simd, rows[0][lane % LANES]),
            Wide::splat(simd, rows[1][lane % LANES]),
            Wide::splat(simd, rows[2][lane % LANES]),
        ]
    };
    let of_rays = |rows: &[[f32; RAYS]; 3]| {
        [
            Wide::from_slice(simd, &rows[0]),
            Wide::from_slice(simd, &rows[1]),
            Wide::from_slice(simd, &rows[2]),
        ]
    };
    let (direction, origin) = (of_rays(&rays.direction), of_rays(&rays.origin));
    let (corner, normal) = (of_lane(&group.corner), of_lane(normals));
    let (ab, ac) = (of_lane(&group.edge_ab), of_lane(&group.edge_ac));
    let reach = group.reach[lane % LANES];

    // Rule 3.
    let seen = [
        corner[0] - origin[0],
        corner[1] - origin[1],
        corner[2] - origin[2],
    ];
    let turned = [
        direction[1] * seen[2] - direction[2] * seen[1],
        direction[2] * seen[0] - direction[0] * seen[2],
        direction[0] * seen[1] - direction[1] * seen[0],
    ];
    let slope = dot(normal, direction);
    let side_ab = dot(turned, ab);
    let minus_side_ca = dot(turned, ac);
    let side_bc = (slope - side_ab + minus_side_ca) * bounds.third_edge_scale;
    let side_ca = -minus_side_ca;
    let bound = reach * bounds.edge;
    let (above, below) = (Wide::splat(simd, bound), Wide::splat(simd, -bound));
    let highest = side_ab.max(side_ca).max(side_bc);
    let lowest = side_ab.min(side_ca).min(side_bc);
    let misses_edges = highest.simd_gt(above) & lowest.simd_lt(below);
    let is_inside = lowest.simd_gt(above) | highest.simd_lt(below);

    // Rule 2.
    let start = dot(normal, seen);
    let light = (start - slope * Wide::from_slice(simd, &rays.light)) * bounds.light_height_scale;
    let bound = reach * reach * bounds.height;
    let (above, below) = (Wide::splat(simd, bound), Wide::splat(simd, -bound));
    let (higher, lower) = (start.max(light), start.min(light));
    let misses_plane = lower.simd_gt(above) | higher.simd_lt(below);
    let crosses_plane = higher.simd_gt(above) & lower.simd_lt(below);

    Verdicts {
        possible: !(misses_edges | misses_plane).to_bitmask() as u32,
        sure: (is_inside & crosses_plane).to_bitmask() as u32,
    }
}

#[inline(always)]
pub(super) fn spheres<S: Simd>(simd: S, group: &SphereGroup, ray: &FrameRay) -> Verdicts {
    let bounds = &ray.bounds;
    let direction = splat(simd, ray.direction);
    let origin = splat(simd, ray.origin);
    let center = load(simd, &group.center);
    let radius = Lanes::from_slice(simd, &group.radius);

    let seen = [
        center[0] - origin[0],
        center[1] - origin[1],
        center[2] - origin[2],
    ];
    let turned = cross(direction, seen);
    let distance_squared = dot(turned, turned);
    let reach = radius * ray.length;
    let (wide, narrow) = (reach + bounds.line, reach - bounds.line);
    let is_missed = distance_squared.simd_gt(wide * wide);
    let zero = Lanes::splat(simd, 0.0);
    let is_met = narrow.simd_gt(zero) & distance_squared.simd_lt(narrow * narrow);

    // Where along: d . C from the start, less t |d|^2 from the light.
    let along = dot(direction, seen);
    let beyond = along - Lanes::splat(simd, ray.light * ray.length * ray.length);
    let room = Lanes::splat(simd, 5.0 * bounds.line);
    let is_between = along.simd_gt(room) & beyond.simd_lt(-room);
    let start = dot(seen, seen);
    let outside = (radius + bounds.line) * (radius + bounds.line) + bounds.line;
    let is_started_outside = start.simd_gt(outside);

    Verdicts {
        possible: !is_missed.to_bitmask() as u32,
        sure: (is_met & is_between & is_started_outside).to_bitmask() as u32,
    }
}
