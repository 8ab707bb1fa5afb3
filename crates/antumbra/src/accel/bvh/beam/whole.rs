//! All segments from one start to a convex light at once: nothing is in the way of any, or one shape is in the way of all.
//!
//! In: a start, the corners of the light's hull as a [`Block`], and all of the tree or the leaves that hold what may block. Out:
//! [`Whole`]. Invariant: what is told holds for every target between the corners, by the exact rule (`README.md` of
//! `crate::query::beam`, "A whole light"). Absent here: single targets, and the own rules of curved surfaces.

use antumbra_geometry::{Occluders, ReceiverPoint};
use fearless_simd::{Simd, dispatch};

use super::super::data::{Bvh, Child, ChildKind, LANES, WIDTH};
use super::super::ray::{FARTHEST, U};
use super::super::walk::{USUAL_DEPTH, Waiting, lanes};
use super::pyramid::{Faces, Pyramid};
use super::shapes::{Edges, sphere};
use super::targets::{Block, Segments, bits};
use super::{Asked, Beam, Memory, ROOT};
use crate::Counters;

/// Most leaves that are handed on as what may block.
const MOST_FOUND: usize = 16;

/// Largest cost of a walk, in nodes, groups and triangles: what costs more mostly finds too many leaves. Not swept.
const MOST_COST: u32 = 96;

/// Larger slacks of a hull, in the frame's units, leave no room in boxes.
const LARGEST_SLACK: f64 = 0.25 * U;

/// An answer for all targets of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Whole {
    /// Nothing blocks any.
    Lit,
    /// All are blocked.
    Dark,
    /// Only shapes in the leaves that were found may block.
    Found,
    /// Nothing is known: too much may block, or numbers are out of range.
    Open,
}

/// Leaves of the tree, some of which a start was found to depend on.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    leaves: [u32; MOST_FOUND],
    count: usize,
}

impl Default for Found {
    fn default() -> Self {
        Self {
            leaves: [0; MOST_FOUND],
            count: 0,
        }
    }
}

impl Found {
    /// Returns the leaves.
    pub(crate) fn leaves(&self) -> &[u32] {
        &self.leaves[..self.count]
    }

    /// Adds a leaf and returns whether there was room.
    #[inline(always)]
    fn add(&mut self, leaf: Child) -> bool {
        let has_room = self.count < MOST_FOUND;
        if has_room {
            self.leaves[self.count % MOST_FOUND] = leaf.word();
            self.count += 1;
        }
        has_room
    }
}

/// A group of shapes against all targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OfGroup {
    Misses,
    MayBlock,
    Covers,
}

impl Bvh {
    /// Tells what it can of all targets between the corners of a hull, for a start that no own rule shadows from any of
    /// them. `slack` is what targets may be off the hull, in the frame's units; the block has it in those of the world.
    #[inline]
    pub(crate) fn tell_whole(
        &self,
        (occluders, start): (&Occluders, &ReceiverPoint),
        (corners, slack): (&Block, f64),
        leaves: Option<&[u32]>,
        (found, memory): (&mut Found, &mut Memory),
        counters: &mut Counters,
    ) -> Whole {
        let is_usual = !self.nodes.is_empty() && self.depth <= USUAL_DEPTH;
        // Not for NaN.
        let has_room = slack <= LARGEST_SLACK;
        if !is_usual || !has_room {
            return Whole::Open;
        }
        let asked = Asked {
            occluders,
            start,
            targets: &[],
            mask: corners.asked(),
            number: 0,
        };
        dispatch!(self.level, simd => {
            self.tell_whole_with(simd, &asked, (corners, slack), leaves, (found, memory), counters)
        })
    }

    #[inline(always)]
    fn tell_whole_with<S: Simd>(
        &self,
        simd: S,
        asked: &Asked,
        (corners, slack): (&Block, f64),
        leaves: Option<&[u32]>,
        (found, memory): (&mut Found, &mut Memory),
        counters: &mut Counters,
    ) -> Whole {
        let offset = asked.occluders.start_offset(asked.start);
        let segments = Segments::new(simd, self, (asked.start.point, offset), corners, asked.mask);
        let all = asked.mask;
        let (face, part) = Faces::of(simd, &segments).shared_by_most(all);
        if all == 0 || part & segments.fit != all {
            return Whole::Open;
        }
        let mut pyramid = Pyramid::new(simd, &segments, face, all);
        let is_far = |lane: usize| segments.light[lane] >= FARTHEST as f32;
        // Between corners that lie outside the frame the light may be farther along the face.
        let end = if bits(all).any(is_far) {
            pyramid.end.max(FARTHEST as f32)
        } else {
            pyramid.end
        };
        pyramid.end = end + (2.0 * slack) as f32;
        found.count = 0;
        let mut beam = Beam {
            bvh: self,
            asked,
            segments: &segments,
            own: asked.start.surface.map_or(u32::MAX, |surface| surface.0),
            last: memory.last[0],
            memory,
            of: None,
            steps: 0,
            tests: 0,
        };
        let told = match leaves {
            Some(leaves) => beam.whole_of_leaves(simd, &pyramid, leaves, found),
            None => beam.whole_of_tree(simd, &pyramid, found),
        };
        let Beam {
            last, steps, tests, ..
        } = beam;
        memory.last[0] = last;
        counters.steps += steps;
        counters.intersections += tests;
        told
    }
}

impl Beam<'_> {
    #[inline(always)]
    fn whole_of_leaves<S: Simd>(
        &mut self,
        simd: S,
        pyramid: &Pyramid,
        leaves: &[u32],
        found: &mut Found,
    ) -> Whole {
        for &leaf in leaves {
            let leaf = Child::of_word(leaf);
            match self.whole_of_group(simd, leaf, pyramid) {
                OfGroup::Misses => {}
                OfGroup::Covers => {
                    self.last = leaf;
                    return Whole::Dark;
                }
                OfGroup::MayBlock => {
                    if !found.add(leaf) {
                        return Whole::Open;
                    }
                }
            }
        }
        Self::of_found(found)
    }

    #[inline(always)]
    fn whole_of_tree<S: Simd>(&mut self, simd: S, pyramid: &Pyramid, found: &mut Found) -> Whole {
        let bvh = self.bvh;
        if self.last != Child::NONE
            && self.whole_of_group(simd, self.last, pyramid) == OfGroup::Covers
        {
            return Whole::Dark;
        }
        let mut cost = 0;
        let mut stack = [Waiting::default(); USUAL_DEPTH];
        let mut height = 1;
        stack[0] = Waiting {
            mask: pyramid.meets(simd, &bvh.nodes[0]),
            ..ROOT
        };
        while height > 0 {
            height -= 1;
            let Waiting { node, mut mask } = stack[height];
            let mut index = node as usize;
            while mask != 0 {
                let child = bvh.nodes[index].children[mask.trailing_zeros() as usize % WIDTH];
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
                    mask = pyramid.meets(simd, &bvh.nodes[index]);
                    self.steps += 1;
                    cost += 1;
                    continue;
                }
                let before = self.tests;
                match self.whole_of_group(simd, child, pyramid) {
                    OfGroup::Misses => {}
                    OfGroup::Covers => {
                        self.last = child;
                        return Whole::Dark;
                    }
                    OfGroup::MayBlock => {
                        if child.kind() == ChildKind::Other || !found.add(child) {
                            return Whole::Open;
                        }
                    }
                }
                cost += 1 + (self.tests - before) as u32;
                if cost > MOST_COST {
                    return Whole::Open;
                }
            }
        }
        Self::of_found(found)
    }

    fn of_found(found: &Found) -> Whole {
        match found.count {
            0 => Whole::Lit,
            _ => Whole::Found,
        }
    }

    /// Tells what a group does to all targets: a shape that surely hits the segments to all corners hits those between them.
    #[inline(always)]
    fn whole_of_group<S: Simd>(&mut self, simd: S, child: Child, pyramid: &Pyramid) -> OfGroup {
        let bvh = self.bvh;
        let bounds = &bvh.usual_bounds;
        let (segments, all) = (self.segments, pyramid.targets);
        let mut told = OfGroup::Misses;
        match child.kind() {
            ChildKind::Triangles => {
                let group = &bvh.triangles[child.index()];
                let members = &group.members;
                let opaque = u32::from(members.opaque) & !members.those_of(self.own);
                if opaque == 0 {
                    return told;
                }
                let edges = Edges::new(simd, group, segments.origin, pyramid, bounds);
                for lane in lanes(edges.possible & opaque) {
                    self.tests += 1;
                    if edges.may_hold_start(lane) {
                        if !self.is_flat_with_own(members.surfaces[lane % LANES]) {
                            told = OfGroup::MayBlock;
                        }
                        continue;
                    }
                    told = OfGroup::MayBlock;
                    let is_whole = members.whole >> lane & 1 != 0;
                    if is_whole && edges.verdicts(simd, lane, segments, all, bounds).sure == all {
                        return OfGroup::Covers;
                    }
                }
            }
            ChildKind::Spheres => {
                let group = &bvh.spheres[child.index()];
                let members = &group.members;
                let possible = pyramid.may_meet_spheres(simd, group, segments.origin, bounds);
                for lane in lanes(possible & u32::from(members.opaque)) {
                    if self.is_own(members.surfaces[lane % LANES]) {
                        continue;
                    }
                    self.tests += 1;
                    told = OfGroup::MayBlock;
                    let is_whole = members.whole >> lane & 1 != 0;
                    if is_whole && sphere(simd, group, lane, segments, all, bounds).sure == all {
                        return OfGroup::Covers;
                    }
                }
            }
            _ => told = OfGroup::MayBlock,
        }
        told
    }
}
