//! Shapes of the tree against up to 64 segments from one start: surely missed, surely hit, or in doubt.
//!
//! The forms and bounds are those of [`super::super::filter`], with the products arranged so that what does
//! not depend on the target is computed once. `README.md` of `crate::beam` proves the bounds.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16};

use super::super::data::{LANES, SphereGroup, TriangleGroup};
use super::super::filter::{self, cross, load};
use super::super::ray::FilterBounds;
use super::pyramid::Pyramid;
use super::targets::{CHUNK, Segments, TARGETS, bits_of, lanes};

/// Verdicts on a shape, a bit for each target.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verdicts {
    /// Not surely missed.
    pub(super) possible: u64,
    /// Surely hit.
    pub(super) sure: u64,
}

type Four<S> = f32x4<S>;
type Wide<S> = f32x16<S>;

/// Edge functions and planes of four triangles, for all segments from one start.
///
/// Seen from the start, with `C = a - o`, `B = b - a`, `D = c - a`: a direction `d` passes the edges at
/// `d . ab`, `d . ca`, `d . bc`, and climbs over the plane at `d . normal`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    /// `C x B`.
    ab: [[f32; LANES]; 3],
    /// `D x C`.
    ca: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    /// The start's height under the plane, times the normal's length.
    height: [f32; LANES],
    /// Bounds of the first two forms, and of the height.
    edge_bound: [f32; LANES],
    height_bound: [f32; LANES],
    /// A bit for each triangle that the segments of a pyramid do not all miss.
    pub(super) possible: u32,
}

/// Forms of a whole pyramid have slopes for directions: bounds are at most four times those of a segment.
const PYRAMID: f32 = 4.0;

/// Returns the least and the most that a form is along a pyramid's directions.
#[inline(always)]
fn range<S: Simd>(simd: S, form: [Four<S>; 3], pyramid: &Pyramid) -> [Four<S>; 2] {
    let [u, v] = pyramid.face.across();
    let along = if pyramid.face.is_down {
        -form[pyramid.face.axis % 3]
    } else {
        form[pyramid.face.axis % 3]
    };
    let at = |axis: usize, slope: f32| form[axis % 3] * Four::splat(simd, slope);
    let [[low_u, high_u], [low_v, high_v]] = pyramid.slopes;
    let (a, b) = (at(u, low_u), at(u, high_u));
    let (c, d) = (at(v, low_v), at(v, high_v));
    [a.min(b) + c.min(d) + along, a.max(b) + c.max(d) + along]
}

impl Edges {
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        group: &TriangleGroup,
        origin: [f32; 3],
        pyramid: &Pyramid,
        bounds: &FilterBounds,
    ) -> Self {
        let corner = load(simd, &group.corner);
        let b = load(simd, &group.edge_ab);
        let d = load(simd, &group.edge_ac);
        let reach = Four::from_slice(simd, &group.reach);
        let seen = [
            corner[0] - Four::splat(simd, origin[0]),
            corner[1] - Four::splat(simd, origin[1]),
            corner[2] - Four::splat(simd, origin[2]),
        ];
        let ab = cross(seen, b);
        let ca = cross(d, seen);
        let normal = cross(b, d);
        let bc = [
            normal[0] - ab[0] - ca[0],
            normal[1] - ab[1] - ca[1],
            normal[2] - ab[2] - ca[2],
        ];
        let height = normal[0] * seen[0] + normal[1] * seen[1] + normal[2] * seen[2];
        let edge_bound = reach * bounds.edge;
        let height_bound = reach * reach * bounds.height;

        // The whole pyramid.
        let zero = Four::splat(simd, 0.0);
        let third = Four::splat(simd, bounds.third_edge_scale);
        let [low_ab, high_ab] = range(simd, ab, pyramid);
        let [low_ca, high_ca] = range(simd, ca, pyramid);
        let [low_bc, high_bc] = range(simd, bc, pyramid);
        let [low_climb, high_climb] = range(simd, normal, pyramid);
        let (low_bc, high_bc) = (low_bc * third, high_bc * third);
        let bound = edge_bound * PYRAMID;
        let least_high = high_ab.min(high_ca).min(high_bc);
        let greatest_low = low_ab.max(low_ca).max(low_bc);
        // An edge that all pass on the left, one that all pass on the right.
        let is_right = least_high.simd_lt(-bound);
        let is_left = greatest_low.simd_gt(bound);
        // Where the start is surely under or over the plane, one is enough.
        let is_under = height.simd_gt(height_bound);
        let is_over = height.simd_lt(-height_bound);
        let end = Four::splat(simd, pyramid.end);
        let scale = Four::splat(simd, bounds.light_height_scale);
        let far_bound = height_bound * PYRAMID;
        let lowest = (height - end * high_climb.max(zero)) * scale;
        let highest = (height - end * low_climb.min(zero)) * scale;
        let is_missed = (is_right & is_left)
            | (is_under & (is_right | lowest.simd_gt(far_bound)))
            | (is_over & (is_left | highest.simd_lt(-far_bound)));
        let rows = |form: [Four<S>; 3]| [form[0].into(), form[1].into(), form[2].into()];
        Self {
            ab: rows(ab),
            ca: rows(ca),
            normal: rows(normal),
            height: height.into(),
            edge_bound: edge_bound.into(),
            height_bound: height_bound.into(),
            possible: !is_missed.to_bitmask() as u32 & ((1 << LANES) - 1),
        }
    }

    /// Returns whether the start may lie in a triangle's plane.
    #[inline(always)]
    pub(super) fn may_hold_start(&self, lane: usize) -> bool {
        let is_off_plane = self.height[lane % LANES].abs() > self.height_bound[lane % LANES];
        !is_off_plane
    }

    /// One of the triangles against some targets.
    #[inline(always)]
    pub(super) fn verdicts<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        segments: &Segments,
        targets: u64,
        bounds: &FilterBounds,
    ) -> Verdicts {
        let lane = lane % LANES;
        if self.may_hold_start(lane) {
            self.by_edges_alone(simd, lane, segments, targets, bounds)
        } else {
            self.of_sure_side(simd, lane, segments, targets, bounds)
        }
    }

    /// Where it is sure on which side of the plane the start is. What blocks is passed on one side of all edges,
    /// and which side that is is known.
    #[inline(always)]
    fn of_sure_side<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        segments: &Segments,
        targets: u64,
        bounds: &FilterBounds,
    ) -> Verdicts {
        let sign = 1.0_f32.copysign(self.height[lane]);
        let turned = |rows: &[[f32; LANES]; 3]| {
            [
                Wide::splat(simd, rows[0][lane] * sign),
                Wide::splat(simd, rows[1][lane] * sign),
                Wide::splat(simd, rows[2][lane] * sign),
            ]
        };
        let (ab, ca, normal) = (turned(&self.ab), turned(&self.ca), turned(&self.normal));
        let height = Wide::splat(simd, self.height[lane].abs());
        let third = Wide::splat(simd, bounds.third_edge_scale);
        let light_scale = Wide::splat(simd, bounds.light_height_scale);
        let edge_bound = Wide::splat(simd, self.edge_bound[lane]);
        let height_bound = Wide::splat(simd, self.height_bound[lane]);
        let mut verdicts = Verdicts::default();
        for chunk in 0..TARGETS / CHUNK {
            if bits_of(targets, chunk) == 0 {
                continue;
            }
            let direction = segments.directions(simd, chunk);
            let climb = dot(normal, direction);
            let side_ab = dot(ab, direction);
            let side_ca = dot(ca, direction);
            let side_bc = (climb - side_ab - side_ca) * third;
            let lowest = side_ab.min(side_ca).min(side_bc);
            let beyond = (climb * lanes(simd, &segments.light, chunk) - height) * light_scale;
            let is_missed = lowest.simd_lt(-edge_bound) | beyond.simd_lt(-height_bound);
            let is_hit = lowest.simd_gt(edge_bound) & beyond.simd_gt(height_bound);
            let first = chunk * CHUNK;
            verdicts.possible |= (!is_missed.to_bitmask() & 0xffff) << first;
            verdicts.sure |= is_hit.to_bitmask() << first;
        }
        verdicts.possible &= targets;
        verdicts.sure &= targets;
        verdicts
    }

    /// Where the start is in the plane, or may be.
    #[inline(always)]
    fn by_edges_alone<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        segments: &Segments,
        targets: u64,
        bounds: &FilterBounds,
    ) -> Verdicts {
        let of_lane = |rows: &[[f32; LANES]; 3]| {
            [
                Wide::splat(simd, rows[0][lane]),
                Wide::splat(simd, rows[1][lane]),
                Wide::splat(simd, rows[2][lane]),
            ]
        };
        let (ab, ca, normal) = (of_lane(&self.ab), of_lane(&self.ca), of_lane(&self.normal));
        let third = Wide::splat(simd, bounds.third_edge_scale);
        let bound = Wide::splat(simd, self.edge_bound[lane]);
        let mut possible = 0;
        for chunk in 0..TARGETS / CHUNK {
            if bits_of(targets, chunk) == 0 {
                continue;
            }
            let direction = segments.directions(simd, chunk);
            let climb = dot(normal, direction);
            let side_ab = dot(ab, direction);
            let side_ca = dot(ca, direction);
            let side_bc = (climb - side_ab - side_ca) * third;
            let highest = side_ab.max(side_ca).max(side_bc);
            let lowest = side_ab.min(side_ca).min(side_bc);
            let is_missed = highest.simd_gt(bound) & lowest.simd_lt(-bound);
            possible |= (!is_missed.to_bitmask() & 0xffff) << (chunk * CHUNK);
        }
        Verdicts {
            possible: possible & targets,
            sure: 0,
        }
    }
}

#[inline(always)]
fn dot<S: Simd>(a: [Wide<S>; 3], b: [Wide<S>; 3]) -> Wide<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// One sphere of a group against some targets, by the signs and bounds of `filter::spheres`.
#[inline(always)]
pub(super) fn sphere<S: Simd>(
    simd: S,
    group: &SphereGroup,
    lane: usize,
    segments: &Segments,
    targets: u64,
    bounds: &FilterBounds,
) -> Verdicts {
    let lane = lane % LANES;
    let seen = [0, 1, 2].map(|axis: usize| group.center[axis][lane] - segments.origin[axis]);
    let radius = group.radius[lane];
    let start = seen[0] * seen[0] + seen[1] * seen[1] + seen[2] * seen[2];
    let outside = (radius + bounds.line) * (radius + bounds.line) + bounds.line;
    let is_started_outside = start > outside;
    // Closures are not always inlined, and have no wide registers then.
    let seen = [
        Wide::splat(simd, seen[0]),
        Wide::splat(simd, seen[1]),
        Wide::splat(simd, seen[2]),
    ];
    let radius = Wide::splat(simd, radius);
    let line = Wide::splat(simd, bounds.line);
    let room = Wide::splat(simd, 5.0 * bounds.line);
    let zero = Wide::splat(simd, 0.0);
    let mut verdicts = Verdicts::default();
    for chunk in 0..TARGETS / CHUNK {
        if bits_of(targets, chunk) == 0 {
            continue;
        }
        let direction = segments.directions(simd, chunk);
        let turned = [
            direction[1] * seen[2] - direction[2] * seen[1],
            direction[2] * seen[0] - direction[0] * seen[2],
            direction[0] * seen[1] - direction[1] * seen[0],
        ];
        let length_squared = filter::dot(direction, direction);
        let length = length_squared.sqrt();
        let distance_squared = filter::dot(turned, turned);
        let reach = radius * length;
        let (wide, narrow) = (reach + line, reach - line);
        let is_missed = distance_squared.simd_gt(wide * wide);
        let is_met = narrow.simd_gt(zero) & distance_squared.simd_lt(narrow * narrow);
        let along = direction[0] * seen[0] + direction[1] * seen[1] + direction[2] * seen[2];
        let beyond = along - lanes(simd, &segments.light, chunk) * length * length;
        let is_between = along.simd_gt(room) & beyond.simd_lt(-room);
        let first = chunk * CHUNK;
        verdicts.possible |= (!is_missed.to_bitmask() & 0xffff) << first;
        verdicts.sure |= (is_met & is_between).to_bitmask() << first;
    }
    verdicts.possible &= targets;
    verdicts.sure &= targets;
    if !is_started_outside {
        verdicts.sure = 0;
    }
    verdicts
}

/// One sphere of a group against some starts that look in one direction, by the operations of [`sphere`]. The direction comes with
/// where the light is along it.
#[inline(always)]
pub(super) fn sphere_of_starts<S: Simd>(
    simd: S,
    group: &SphereGroup,
    lane: usize,
    (direction, light): ([f32; 3], f32),
    origins: &[[f32; TARGETS]; 3],
    starts: u64,
    bounds: &FilterBounds,
) -> Verdicts {
    let lane = lane % LANES;
    let center = [
        Wide::splat(simd, group.center[0][lane]),
        Wide::splat(simd, group.center[1][lane]),
        Wide::splat(simd, group.center[2][lane]),
    ];
    let direction = [
        Wide::splat(simd, direction[0]),
        Wide::splat(simd, direction[1]),
        Wide::splat(simd, direction[2]),
    ];
    let radius = Wide::splat(simd, group.radius[lane]);
    let line = Wide::splat(simd, bounds.line);
    let room = Wide::splat(simd, 5.0 * bounds.line);
    let zero = Wide::splat(simd, 0.0);
    let length_squared = filter::dot(direction, direction);
    let length = length_squared.sqrt();
    let reach = radius * length;
    let (wide, narrow) = (reach + line, reach - line);
    let light = Wide::splat(simd, light) * length * length;
    let around = (radius + line) * (radius + line) + line;
    let mut verdicts = Verdicts::default();
    for chunk in 0..TARGETS / CHUNK {
        if bits_of(starts, chunk) == 0 {
            continue;
        }
        let seen = [
            center[0] - lanes(simd, &origins[0], chunk),
            center[1] - lanes(simd, &origins[1], chunk),
            center[2] - lanes(simd, &origins[2], chunk),
        ];
        let turned = [
            direction[1] * seen[2] - direction[2] * seen[1],
            direction[2] * seen[0] - direction[0] * seen[2],
            direction[0] * seen[1] - direction[1] * seen[0],
        ];
        let distance_squared = filter::dot(turned, turned);
        let is_missed = distance_squared.simd_gt(wide * wide);
        let is_met = narrow.simd_gt(zero) & distance_squared.simd_lt(narrow * narrow);
        let along = direction[0] * seen[0] + direction[1] * seen[1] + direction[2] * seen[2];
        let is_between = along.simd_gt(room) & (along - light).simd_lt(-room);
        let is_started_outside = filter::dot(seen, seen).simd_gt(around);
        let first = chunk * CHUNK;
        verdicts.possible |= (!is_missed.to_bitmask() & 0xffff) << first;
        verdicts.sure |= (is_met & is_between & is_started_outside).to_bitmask() << first;
    }
    verdicts.possible &= starts;
    verdicts.sure &= starts;
    verdicts
}
