//! Any-hit for one start and up to 64 targets.
//!
//! In: a start, targets as a [`Block`]. Out: the bits of [`Bvh::any_hit`] for each target. The targets of a start
//! walk the tree as one ([`Pyramid`]); a shape is tested against all of them at once (`shapes`), and where
//! that is in doubt the exact rule decides for that target alone. Where a walk costs more than it should, its
//! targets are parted in four that go on by themselves, at last one by one.
//!
//! Invariants: a walk visits every leaf that one of its segments may meet; every segment is tested against all
//! shapes of the leaves that it may meet; a shape that blocks decides wherever it is found, so order is free.
//! `crates/antumbra/src/query/beam/README.md` has the proofs.

pub(super) mod column;
mod forms;
mod listed;
mod pyramid;
mod shapes;
pub(super) mod sheaf;
mod single;
mod targets;
pub(super) mod tile;
pub(super) mod whole;

use antumbra_geometry::{LightShape, Occluders, ReceiverPoint, Segment, SurfaceId};
use fearless_simd::{Simd, dispatch};

use super::data::{Bvh, Child, ChildKind, LANES, Members, Node, WIDTH};
use super::walk::{Question, USUAL_DEPTH, Waiting, enters, lanes};
use crate::Counters;
use pyramid::{Faces, Pyramid};
use shapes::{Edges, Verdicts};
pub(crate) use targets::{Block, TARGETS};
use targets::{Segments, bits};
use tile::OfTile;

/// Largest number of targets that are answered by single rays.
const FEW: u32 = 2;

/// Largest cost of a walk for each of its targets, in nodes, groups and triangles, before the targets are parted. A
/// ray of its own visits some ten. From a sweep of 2 to 40 by `antumbra-bench soft` at 15 degrees: loose leaves want more
/// (94 ns a ray at 3, 75 from 6 on), balls less (at 40 twice as long as at 3).
const COST_EACH: u32 = 4;

/// A sphere against all targets costs as much as so many triangles.
const COST_OF_SPHERE: u32 = 2;

/// The pyramid is made again once at most one in this many of its targets is left.
const MANY_LEFT: u32 = 4;

/// Knowledge that a start leaves to the next ones: last occluders, and triangles that lie in one plane.
#[derive(Debug)]
pub(crate) struct Memory {
    /// The group that blocked the last target that was blocked, for each block.
    last: Vec<Child>,
    /// Segments for the exact rule, made where it is asked. Their room serves all starts.
    exact: Vec<Option<Segment>>,
    /// Which of them are the start's.
    made: u64,
    /// Pairs of a start's triangle and another one, and whether they lie in one plane, by a few of their bits.
    planes: Box<[([u32; 2], bool); PLANES]>,
}

/// Number of pairs of triangles that are remembered.
const PLANES: usize = 256;

impl Memory {
    /// Makes one for so many blocks of targets.
    pub(crate) fn new(block_count: usize) -> Self {
        Self {
            last: vec![Child::NONE; block_count],
            exact: Vec::new(),
            made: 0,
            planes: Box::new([([u32::MAX; 2], false); PLANES]),
        }
    }

    /// Returns a segment for the exact rule by its number, made if it is not yet.
    fn segment(&mut self, number: usize, make: impl FnOnce() -> Segment) -> &Segment {
        if self.exact.is_empty() {
            self.exact.resize(TARGETS, None);
        }
        let segment = &mut self.exact[number % TARGETS];
        if self.made >> number & 1 == 0 {
            *segment = None;
            self.made |= 1 << number;
        }
        segment.get_or_insert_with(make)
    }

    /// Returns whether a start's triangle and another one lie exactly in one plane.
    #[inline]
    fn are_in_one_plane(
        &mut self,
        occluders: &Occluders,
        own: SurfaceId,
        other: SurfaceId,
    ) -> bool {
        let pair = [own.0, other.0];
        // Of both numbers, neighbors apart.
        let place = own.0.wrapping_mul(0x9e37_79b1) ^ other.0.wrapping_mul(0x85eb_ca6b);
        let entry = &mut self.planes[(place >> 16) as usize % PLANES];
        if entry.0 != pair {
            *entry = (pair, occluders.are_in_one_plane(own, other));
        }
        entry.1
    }
}

impl Bvh {
    /// Returns which of a start's targets an opaque surface blocks, among those that a mask asks about. Own rules
    /// have been asked before: they block nothing here.
    #[inline]
    pub(crate) fn any_hit_targets(
        &self,
        asked: &Asked,
        block: &Block,
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        dispatch!(self.level, simd => {
            self.any_hit_targets_with(simd, asked, None, block, memory, counters)
        })
    }

    /// Does as [`Bvh::any_hit_targets`] does, where all that may block lies in some leaves of the tree.
    #[inline]
    pub(crate) fn any_hit_listed(
        &self,
        asked: &Asked,
        leaves: &[u32],
        block: &Block,
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        dispatch!(self.level, simd => {
            self.any_hit_targets_with(simd, asked, Some(leaves), block, memory, counters)
        })
    }

    #[inline(always)]
    fn any_hit_targets_with<S: Simd>(
        &self,
        simd: S,
        asked: &Asked,
        leaves: Option<&[u32]>,
        block: &Block,
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        let Asked {
            occluders,
            start,
            targets,
            mask,
            number,
        } = *asked;
        let mask = mask & block.asked();
        let is_usual = !self.nodes.is_empty() && self.depth <= USUAL_DEPTH;
        let offset = occluders.start_offset(start);
        let segments = Segments::new(simd, self, (start.point, offset), block, mask);
        let fit = if is_usual { segments.fit & mask } else { 0 };
        let mut blocked = 0;
        for lane in bits(mask & !fit) {
            let is_blocked = self.any_hit(occluders, start, &targets[lane], counters);
            blocked |= u64::from(is_blocked) << lane;
        }
        memory.made = 0;
        let mut beam = Beam {
            bvh: self,
            asked,
            segments: &segments,
            own: start.surface.map_or(u32::MAX, |surface| surface.0),
            last: memory.last[number],
            memory,
            of: None,
            steps: 0,
            tests: 0,
        };
        blocked |= match leaves {
            Some(leaves) => beam.blocked_by_leaves(simd, fit, leaves),
            None => beam.blocked(simd, fit),
        };
        let Beam {
            last, steps, tests, ..
        } = beam;
        memory.last[number] = last;
        counters.steps += steps;
        counters.intersections += tests;
        blocked
    }
}

/// A start and what is asked about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) start: &'a ReceiverPoint,
    /// At most 64, those of the block.
    pub(crate) targets: &'a [LightShape],
    /// Which of them.
    pub(crate) mask: u64,
    /// The block's number among the start's.
    pub(crate) number: usize,
}

/// Nodes with children that wait for their turn.
type Stack = [Waiting; USUAL_DEPTH];

/// Segments that were prepared together.
struct Beam<'a> {
    bvh: &'a Bvh,
    asked: &'a Asked<'a>,
    segments: &'a Segments,
    /// The start's surface, or no surface's number.
    own: u32,
    last: Child,
    memory: &'a mut Memory,
    /// Where the start is one of a tile.
    of: Option<OfTile<'a>>,
    steps: u64,
    tests: u64,
}

impl Beam<'_> {
    /// Returns which of the segments of a mask are blocked.
    #[inline(always)]
    fn blocked<S: Simd>(&mut self, simd: S, asked: u64) -> u64 {
        if asked.count_ones() <= FEW {
            return self.each_from_root(simd, asked);
        }
        let faces = Faces::of(simd, self.segments);
        let mut blocked = 0;
        let mut rest = asked;
        while rest != 0 {
            let (face, part) = faces.shared_by_most(rest);
            rest &= !part;
            if part.count_ones() <= FEW {
                blocked |= self.each_from_root(simd, part);
                continue;
            }
            let mut pyramid = Pyramid::new(simd, self.segments, face, part);
            let mut active = part;
            if self.last != Child::NONE {
                active &= !self.blocked_in(simd, self.last, &pyramid, active);
            }
            blocked |= part & !active;
            if active != 0 {
                let mut stack = [Waiting::default(); USUAL_DEPTH];
                stack[0] = ROOT;
                blocked |= self.walk(simd, &mut pyramid, active, &mut stack, 1);
            }
        }
        blocked
    }

    /// Walks on with a stack for some segments of a pyramid, or fewer than it was made for, and returns which are
    /// blocked. The pyramid becomes narrower where few are left. What waits on the stack was met by segments that these are some of.
    #[inline(always)]
    fn walk<S: Simd>(
        &mut self,
        simd: S,
        pyramid: &mut Pyramid,
        asked: u64,
        stack: &mut Stack,
        mut height: usize,
    ) -> u64 {
        let bvh = self.bvh;
        let most_cost = COST_EACH * asked.count_ones();
        let mut cost = 0;
        let mut active = asked;
        // What lies lower was met by more segments than are left.
        let mut stale = height;
        while height > 0 {
            height -= 1;
            let Waiting { node, mut mask } = stack[height];
            let mut index = node as usize;
            if height < stale {
                stale = height;
                mask &= pyramid.meets(simd, &bvh.nodes[index]);
                self.steps += 1;
                cost += 1;
            }
            while mask != 0 {
                let node = &bvh.nodes[index];
                if cost > most_cost {
                    stack[height] = Waiting {
                        node: index as u32,
                        mask,
                    };
                    return asked & !active | self.part(simd, pyramid, active, stack, height + 1);
                }
                let slot = mask.trailing_zeros() as usize % WIDTH;
                let child = node.children[slot];
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
                let each = match child.kind() {
                    ChildKind::Spheres => COST_OF_SPHERE,
                    _ => 1,
                };
                let blocked = match child.kind() {
                    ChildKind::Other => self.blocked_by_other(simd, child, slot, node, active),
                    _ => self.blocked_in(simd, child, pyramid, active),
                };
                cost += 1 + each * (self.tests - before) as u32;
                if blocked == 0 {
                    continue;
                }
                active &= !blocked;
                if active == 0 {
                    return asked;
                }
                if child.kind() != ChildKind::Other {
                    self.last = child;
                }
                if MANY_LEFT * active.count_ones() > pyramid.targets.count_ones() {
                    continue;
                }
                if active.count_ones() <= FEW {
                    stack[height] = Waiting {
                        node: index as u32,
                        mask,
                    };
                    return asked & !active | self.each(simd, active, stack, height + 1);
                }
                *pyramid = Pyramid::new(simd, self.segments, pyramid.face, active);
                mask &= pyramid.meets(simd, node);
                stale = height;
            }
        }
        asked & !active
    }

    /// Goes on for segments in four parts, each by itself.
    #[cold]
    #[inline(never)]
    fn part<S: Simd>(
        &mut self,
        simd: S,
        pyramid: &Pyramid,
        asked: u64,
        stack: &Stack,
        height: usize,
    ) -> u64 {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut blocked = 0;
                for part in pyramid.quarters(simd, self.segments, asked) {
                    if part.count_ones() <= FEW {
                        blocked |= self.each(simd, part, stack, height);
                        continue;
                    }
                    let mut pyramid = Pyramid::new(simd, self.segments, pyramid.face, part);
                    let mut stack = *stack;
                    blocked |= self.walk(simd, &mut pyramid, part, &mut stack, height);
                }
                blocked
            },
        )
    }

    /// Returns which segments a group of shapes blocks; none for a surface that has no filter.
    #[inline(always)]
    fn blocked_in<S: Simd>(
        &mut self,
        simd: S,
        child: Child,
        pyramid: &Pyramid,
        active: u64,
    ) -> u64 {
        let bvh = self.bvh;
        let bounds = &bvh.usual_bounds;
        let segments = self.segments;
        let mut rest = active;
        match child.kind() {
            ChildKind::Triangles => {
                let group = &bvh.triangles[child.index()];
                let members = &group.members;
                let mut opaque = u32::from(members.opaque) & !members.those_of(self.own);
                if let Some(OfTile { tile, place }) = &mut self.of {
                    opaque &= tile.may_block(bvh, self.asked.occluders, child, 1 << *place);
                }
                if opaque == 0 {
                    return 0;
                }
                let edges = Edges::new(simd, group, segments.origin, pyramid, bounds);
                for lane in lanes(edges.possible & opaque) {
                    self.tests += 1;
                    if edges.may_hold_start(lane) && self.is_flat_with_own(members.surfaces[lane]) {
                        continue;
                    }
                    let verdicts = edges.verdicts(simd, lane, segments, rest, bounds);
                    rest &= !self.decided(members, lane, verdicts);
                    if rest == 0 {
                        break;
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
                    let verdicts = shapes::sphere(simd, group, lane, segments, rest, bounds);
                    rest &= !self.decided(members, lane, verdicts);
                    if rest == 0 {
                        break;
                    }
                }
            }
            _ => {}
        }
        active & !rest
    }

    /// Returns which segments a surface without a filter blocks, among those that meet its box.
    #[inline(always)]
    fn blocked_by_other<S: Simd>(
        &mut self,
        simd: S,
        child: Child,
        slot: usize,
        node: &Node,
        active: u64,
    ) -> u64 {
        let surface = self.bvh.others[child.index()];
        let mut blocked = 0;
        for lane in bits(active) {
            let ray = self.segments.ray(simd, lane, &self.bvh.usual_bounds);
            if enters(simd, node, &ray, ray.end).1 >> slot & 1 == 0 {
                continue;
            }
            self.tests += 1;
            blocked |= u64::from(self.question(lane).blocks(surface)) << lane;
        }
        blocked
    }

    /// Returns which segments a shape blocks: those that it surely blocks, and of those in doubt the ones for which
    /// the exact rule says so.
    #[inline(always)]
    fn decided(&mut self, members: &Members, lane: usize, verdicts: Verdicts) -> u64 {
        let is_whole = members.whole >> lane & 1 != 0;
        if is_whole && verdicts.possible == verdicts.sure {
            return verdicts.sure;
        }
        self.exactly(members.surfaces[lane % LANES], is_whole, verdicts)
    }

    #[inline(never)]
    fn exactly(&mut self, surface: SurfaceId, is_whole: bool, verdicts: Verdicts) -> u64 {
        let Verdicts { possible, sure } = verdicts;
        let mut blocked = if is_whole { sure } else { 0 };
        if self.is_own(surface) {
            return blocked;
        }
        let occluders = self.asked.occluders;
        for target in bits(possible & !blocked) {
            let segment = self.segment(target);
            // Of a surface with holes that is surely crossed, only these are asked.
            let is_blocked = if sure >> target & 1 != 0 {
                occluders.is_solid_at_crossing(surface, segment)
            } else {
                occluders.blocks(surface, segment)
            };
            blocked |= u64::from(is_blocked) << target;
        }
        blocked
    }

    /// Returns a segment for the exact rule.
    fn segment(&mut self, target: usize) -> &Segment {
        let Asked {
            occluders,
            start,
            targets,
            ..
        } = *self.asked;
        let make = || occluders.segment(start, &targets[target]);
        self.memory.segment(target, make)
    }

    /// Returns whether a triangle lies in the plane of the start's, and so blocks nothing.
    #[inline]
    fn is_flat_with_own(&mut self, surface: SurfaceId) -> bool {
        let Asked {
            occluders, start, ..
        } = *self.asked;
        start
            .surface
            .is_some_and(|own| self.memory.are_in_one_plane(occluders, own, surface))
    }

    /// Returns whether a shape is the start's own, or one with the same own rule: these block nothing here.
    #[inline(always)]
    fn is_own(&self, surface: SurfaceId) -> bool {
        self.asked.start.surface.is_some_and(|own| {
            own == surface || self.asked.occluders.have_one_own_rule(own, surface)
        })
    }

    #[inline(always)]
    fn question(&self, target: usize) -> Question<'_> {
        Question {
            occluders: self.asked.occluders,
            start: self.asked.start,
            light: &self.asked.targets[target],
        }
    }
}

/// All children of the root.
const ROOT: Waiting = Waiting {
    node: 0,
    mask: (1 << WIDTH) - 1,
};

#[cfg(test)]
mod tests;
