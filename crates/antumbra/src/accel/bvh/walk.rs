//! Any-hit and nearest-hit through the tree.

use antumbra_geometry::{
    Bounds, DVec3, Hit, LightShape, Occluders, ReceiverPoint, Segment, SurfaceId,
};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8};

use super::data::{Bvh, Child, ChildKind, Members, Node, WIDTH};
use super::filter::{self, Verdicts};
use super::ray::{FrameRay, Prepared};
use crate::Counters;
use crate::accel::grid::nearest_of;
use crate::accel::sweep::may_meet;

/// Trees deeper than this, which no common scene makes, walk with a stack on the heap.
pub(super) const USUAL_DEPTH: usize = 32;

/// As many children may wait in a nearest-hit walk of the usual depth.
const USUAL_PENDING: usize = 1 + USUAL_DEPTH * (WIDTH - 1);

/// Room for the rounding of hit distances when subtrees behind the best hit are left out, in the
/// frame's units and beside the grid's four margins: they lose digits at grazing incidence.
const DISTANCE_ROOM: f64 = 1.0 / (1u64 << 21) as f64;

impl Bvh {
    /// Returns whether an opaque surface blocks the segment from a start to a light. Own rules have
    /// been asked before: they block nothing here.
    #[inline]
    pub(crate) fn any_hit(
        &self,
        occluders: &Occluders,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> bool {
        let question = Question {
            occluders,
            start,
            light,
        };
        dispatch!(self.level, simd => self.any_hit_with(simd, &question, counters))
    }

    /// The whole of it, so that also the preparation has the wide registers.
    #[inline(always)]
    fn any_hit_with<S: Simd>(&self, simd: S, question: &Question, counters: &mut Counters) -> bool {
        let Question {
            occluders,
            start,
            light,
        } = *question;
        // The segment itself is for the exact rule: most queries do without.
        let mut origin = (start.point, occluders.start_offset(start));
        if origin.1 > self.frame.margin_of_starts() {
            origin = question.origin();
        }
        match self.prepare(simd, origin.0, origin.1, light, || question.segment()) {
            Prepared::Miss => false,
            Prepared::Unfit => self.any_hit_by_rule(question, origin, counters),
            Prepared::Ray(_) if self.nodes.is_empty() => false,
            Prepared::Ray(ray) => {
                let query = AnyHit {
                    bvh: self,
                    question,
                    ray: &ray,
                };
                if self.depth <= USUAL_DEPTH {
                    query.walk(simd, &mut [Waiting::default(); USUAL_DEPTH], counters)
                } else {
                    query.walk_deep(simd, self.depth, counters)
                }
            }
        }
    }

    /// Asks the rule about every surface, if the segment may come near them.
    #[cold]
    #[inline(never)]
    fn any_hit_by_rule(
        &self,
        question: &Question,
        (point, offset): (DVec3, f64),
        counters: &mut Counters,
    ) -> bool {
        let start = Bounds {
            min: point,
            max: point,
        };
        if !may_meet(
            &start.inflated(DVec3::splat(offset)),
            question.light,
            &self.bounds,
        ) {
            return false;
        }
        let segment = question.segment();
        let mut surfaces = self.surfaces();
        surfaces.any(|surface| {
            counters.intersections += 1;
            question.occluders.blocks(surface, &segment)
        })
    }

    /// Returns the nearest surface; ties go to the lowest id.
    pub(crate) fn nearest(
        &self,
        occluders: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
    ) -> Option<Hit> {
        dispatch!(self.level, simd => self.nearest_with(simd, occluders, segment, counters))
    }

    #[inline(always)]
    fn nearest_with<S: Simd>(
        &self,
        simd: S,
        occluders: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
    ) -> Option<Hit> {
        let point = segment.start().point;
        let offset = offset(segment);
        let light = LightShape::Direction(segment.direction());
        // From afar, distances are rounded by more than the room that the walk leaves behind a hit.
        let distance = self.frame.point_in_frame(point).abs().max_element();
        let is_near = 2.0 * f64::EPSILON * distance <= 0.25 * self.frame.margin_in_frame;
        match self.prepare(simd, point, offset, &light, || segment.clone()) {
            // What it misses does not depend on the rounding of distances.
            Prepared::Miss => None,
            Prepared::Ray(_) if self.nodes.is_empty() => None,
            Prepared::Ray(ray) if is_near => {
                let query = Nearest {
                    bvh: self,
                    occluders,
                    segment,
                    ray: &ray,
                };
                if self.depth <= USUAL_DEPTH {
                    query.walk(simd, &mut [Ahead::default(); USUAL_PENDING], counters)
                } else {
                    query.walk_deep(simd, self.depth, counters)
                }
            }
            // From afar all that it crosses are compared.
            Prepared::Ray(ray) => {
                let mut best = None;
                self.all_along(simd, &ray, counters, |surface| {
                    best = nearest_of(occluders, [surface].into_iter(), segment, best);
                });
                best
            }
            Prepared::Unfit => {
                let mut best = None;
                self.all_by_rule(segment, counters, |surface| {
                    best = nearest_of(occluders, [surface].into_iter(), segment, best);
                });
                best
            }
        }
    }
}

/// Where the ray enters each child's box, and a bit for each child that it meets before `end`.
#[inline(always)]
pub(super) fn enters<S: Simd>(simd: S, node: &Node, ray: &FrameRay, end: f32) -> (f32x8<S>, u32) {
    let (near_x, far_x) = crossings(simd, node, ray, 0);
    let (near_y, far_y) = crossings(simd, node, ray, 1);
    let (near_z, far_z) = crossings(simd, node, ray, 2);
    let near = near_x.max(near_y).max(near_z.max(f32x8::splat(simd, 0.0)));
    let far = far_x.min(far_y).min(far_z.min(f32x8::splat(simd, end)));
    (near, near.simd_le(far).to_bitmask() as u32)
}

/// Where the ray crosses the nearer and the farther plane of each child's box. No closure: those are not always inlined, and
/// have no wide registers then.
#[inline(always)]
fn crossings<S: Simd>(simd: S, node: &Node, ray: &FrameRay, axis: usize) -> (f32x8<S>, f32x8<S>) {
    let inverse = f32x8::splat(simd, ray.inverse[axis]);
    let offset = f32x8::splat(simd, ray.offset[axis]);
    let low = f32x8::from_slice(simd, &node.planes[axis]).mul_sub(inverse, offset);
    let high = f32x8::from_slice(simd, &node.planes[axis + 3]).mul_sub(inverse, offset);
    (low.min(high), low.max(high))
}

/// A shadow query, with its segment where the exact rule needs it.
pub(super) struct Question<'a> {
    pub(super) occluders: &'a Occluders,
    pub(super) start: &'a ReceiverPoint,
    pub(super) light: &'a LightShape,
}

impl Question<'_> {
    /// Returns the number of the start's surface; of a free start that of no surface.
    #[inline(always)]
    fn own(&self) -> u32 {
        self.start.surface.map_or(u32::MAX, |surface| surface.0)
    }

    #[cold]
    #[inline(never)]
    fn segment(&self) -> Segment {
        self.occluders.segment(self.start, self.light)
    }

    /// The start where its surface is, and how far it may be from there.
    #[cold]
    #[inline(never)]
    fn origin(&self) -> (DVec3, f64) {
        let segment = self.segment();
        (segment.origin(), segment.origin_error())
    }

    /// Asks the rule about the lanes in doubt.
    #[inline(never)]
    pub(super) fn is_blocked_by(&self, members: &Members, verdicts: Verdicts) -> bool {
        // A sure hit needs no more, unless it is the start's own solid.
        let sure = verdicts.sure & verdicts.possible & u32::from(members.whole);
        let Question {
            occluders, start, ..
        } = *self;
        let is_own = |surface: SurfaceId| {
            start
                .surface
                .is_some_and(|own| own == surface || occluders.have_one_own_rule(own, surface))
        };
        if lanes(sure).any(|lane| !is_own(members.surfaces[lane])) {
            return true;
        }
        let in_doubt = lanes(verdicts.possible & !sure)
            .map(|lane| members.surfaces[lane])
            .filter(|&surface| !is_own(surface));
        let mut segment = None;
        in_doubt.into_iter().any(|surface| {
            let segment = segment.get_or_insert_with(|| self.segment());
            occluders.blocks(surface, segment)
        })
    }

    pub(super) fn blocks(&self, surface: SurfaceId) -> bool {
        let Question {
            occluders, start, ..
        } = *self;
        start.surface != Some(surface)
            && occluders.is_opaque(surface)
            && occluders.blocks(surface, &self.segment())
    }
}

/// Returns how far a segment's exact start may lie from its point as given.
pub(super) fn offset(segment: &Segment) -> f64 {
    (segment.origin() - segment.start().point)
        .abs()
        .max_element()
        + segment.origin_error()
}

/// A node whose children of the mask wait for their turn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Waiting {
    pub(super) node: u32,
    pub(super) mask: u32,
}

struct AnyHit<'a> {
    bvh: &'a Bvh,
    question: &'a Question<'a>,
    ray: &'a FrameRay,
}

impl AnyHit<'_> {
    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, stack: &mut [Waiting], counters: &mut Counters) -> bool {
        let (mut steps, mut tests) = (0u64, 0u64);
        let is_blocked = self.walk_counting(simd, stack, &mut steps, &mut tests);
        counters.steps += steps;
        counters.intersections += tests;
        is_blocked
    }

    #[cold]
    #[inline(never)]
    fn walk_deep<S: Simd>(&self, simd: S, depth: usize, counters: &mut Counters) -> bool {
        let stack = &mut vec![Waiting::default(); depth];
        simd.vectorize(
            #[inline(always)]
            || self.walk(simd, stack, counters),
        )
    }

    #[inline(always)]
    fn walk_counting<S: Simd>(
        &self,
        simd: S,
        stack: &mut [Waiting],
        steps: &mut u64,
        tests: &mut u64,
    ) -> bool {
        let mut height = 0;
        let mut index = 0;
        'nodes: loop {
            *steps += 1;
            let mut node = &self.bvh.nodes[index];
            let (_, mut mask) = enters(simd, node, self.ray, self.ray.end);
            loop {
                if mask == 0 {
                    // Up to the lowest node with a child left.
                    if height == 0 {
                        return false;
                    }
                    height -= 1;
                    index = stack[height].node as usize;
                    mask = stack[height].mask;
                    node = &self.bvh.nodes[index];
                }
                let child = node.children[mask.trailing_zeros() as usize % WIDTH];
                mask &= mask - 1;
                if child.is_node() {
                    if mask != 0 {
                        stack[height] = Waiting {
                            node: index as u32,
                            mask,
                        };
                        height += 1;
                    }
                    index = child.index();
                    continue 'nodes;
                }
                if self.is_blocked_in(simd, child, tests) {
                    return true;
                }
            }
        }
    }

    #[inline(always)]
    fn is_blocked_in<S: Simd>(&self, simd: S, child: Child, tests: &mut u64) -> bool {
        let (verdicts, members) = match child.kind() {
            ChildKind::Triangles => {
                let group = &self.bvh.triangles[child.index()];
                (filter::triangles(simd, group, self.ray), &group.members)
            }
            ChildKind::Spheres => {
                let group = &self.bvh.spheres[child.index()];
                (filter::spheres(simd, group, self.ray), &group.members)
            }
            _ => {
                *tests += 1;
                return self.question.blocks(self.bvh.others[child.index()]);
            }
        };
        *tests += u64::from(members.opaque.count_ones());
        // The start's own surface is in doubt as a rule, and blocks nothing.
        let own = members.those_of(self.question.own());
        let possible = verdicts.possible & u32::from(members.opaque) & !own;
        possible != 0
            && self.question.is_blocked_by(
                members,
                Verdicts {
                    possible,
                    ..verdicts
                },
            )
    }
}

/// The numbers of the bits set.
pub(super) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            lane
        })
    })
}

/// A child that the ray enters at a parameter.
#[derive(Clone, Copy, Debug)]
struct Ahead {
    enters: f32,
    child: Child,
}

impl Default for Ahead {
    fn default() -> Self {
        Self {
            enters: 0.0,
            child: Child::NONE,
        }
    }
}

struct Nearest<'a> {
    bvh: &'a Bvh,
    occluders: &'a Occluders,
    segment: &'a Segment,
    ray: &'a FrameRay,
}

impl Nearest<'_> {
    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, stack: &mut [Ahead], counters: &mut Counters) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut end = self.ray.end;
        stack[0] = Ahead {
            enters: 0.0,
            child: Child::new(ChildKind::Node, 0),
        };
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let Ahead { enters, child } = stack[height];
            if enters > end {
                continue;
            }
            if !child.is_node() {
                best = self.nearest_in(simd, child, best, counters);
                end = self.end(best);
                continue;
            }
            counters.steps += 1;
            let node = &self.bvh.nodes[child.index()];
            let (near, mask) = self::enters(simd, node, self.ray, end);
            // The nearest on top.
            let bottom = height;
            for slot in lanes(mask) {
                let ahead = Ahead {
                    enters: near[slot],
                    child: node.children[slot],
                };
                let mut place = height;
                while place > bottom && stack[place - 1].enters < ahead.enters {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = ahead;
                height += 1;
            }
        }
        best
    }

    #[cold]
    #[inline(never)]
    fn walk_deep<S: Simd>(&self, simd: S, depth: usize, counters: &mut Counters) -> Option<Hit> {
        let stack = &mut vec![Ahead::default(); 1 + depth * (WIDTH - 1)];
        simd.vectorize(
            #[inline(always)]
            || self.walk(simd, stack, counters),
        )
    }

    #[inline(always)]
    fn nearest_in<S: Simd>(
        &self,
        simd: S,
        child: Child,
        best: Option<Hit>,
        counters: &mut Counters,
    ) -> Option<Hit> {
        let (verdicts, members) = match child.kind() {
            ChildKind::Triangles => {
                let group = &self.bvh.triangles[child.index()];
                (filter::triangles(simd, group, self.ray), &group.members)
            }
            ChildKind::Spheres => {
                let group = &self.bvh.spheres[child.index()];
                (filter::spheres(simd, group, self.ray), &group.members)
            }
            _ => {
                counters.intersections += 1;
                let surface = self.bvh.others[child.index()];
                return nearest_of(self.occluders, [surface].into_iter(), self.segment, best);
            }
        };
        counters.intersections += u64::from(members.present.count_ones());
        let possible = verdicts.possible & u32::from(members.present);
        if possible == 0 {
            return best;
        }
        let surfaces = lanes(possible).map(|lane| members.surfaces[lane]);
        nearest_of(self.occluders, surfaces, self.segment, best)
    }

    /// Returns where boxes no longer matter: beyond the best hit, by more than the rounding of
    /// distances, so that ties are seen.
    fn end(&self, best: Option<Hit>) -> f32 {
        let Some(hit) = best else {
            return self.ray.end;
        };
        let frame = &self.bvh.frame;
        let along = (hit.distance - self.ray.entry) * self.ray.rate;
        let far_rounding = hit.distance * self.ray.rate * 1e-15;
        let end = along + 4.0 * frame.margin_in_frame + DISTANCE_ROOM + far_rounding;
        (end as f32).next_up().min(self.ray.end)
    }
}
