//! Any-hit for one direction and the starts of a tile.
//!
//! In: a [`Tile`], one direction of a [`Sheaf`], the [`Cut`] for both. Out: the bits of [`Bvh::any_hit`] for each start.
//! The starts walk as one, with the direction's own pyramid for all of their box, and a triangle is tested against all of
//! them at once ([`Forms`]); what is in doubt the exact rule decides for that start alone. A walk that costs more than it
//! should parts its starts in four. Invariants: those of walks of many targets (`super`), and the proofs of README.md of
//! `crate::query::beam`, "One direction, all starts".

use antumbra_geometry::{LightShape, Occluders, ReceiverPoint, Segment, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x4};

use super::super::data::{Bvh, Child, ChildKind, LANES, Members, Node, WIDTH};
use super::super::ray::{FrameRay, USUAL_ORIGIN_ERROR};
use super::super::walk::{USUAL_DEPTH, Waiting, enters, lanes};
use super::forms::{Forms, StartBounds, StartBox, Towards};
use super::pyramid::Pyramid;
use super::shapes::{self, Verdicts};
use super::sheaf::{Cut, Sheaf};
use super::targets::{TARGETS, bits};
use super::tile::Tile;
use super::{COST_EACH, COST_OF_SPHERE, MANY_LEFT, Memory, Stack};
use crate::Counters;

/// Fewer starts than this part no further.
const FEW_STARTS: u32 = 8;

/// A direction, and the starts of a tile that are asked about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AskedDirection<'a> {
    pub(crate) occluders: &'a Occluders,
    /// All starts of the tile.
    pub(crate) starts: &'a [ReceiverPoint],
    /// Which of them; none with an own rule.
    pub(crate) mask: u64,
    pub(crate) target: &'a LightShape,
    /// Which of the sheaf's directions it is.
    pub(crate) lane: usize,
    /// Its number among all directions that are remembered.
    pub(crate) number: usize,
}

impl Bvh {
    /// Returns from which starts of a tile an opaque surface blocks a direction of a sheaf. Near entries of the cut have been
    /// asked before, with `Reach::Near`: from the starts of the mask they block nothing.
    #[inline]
    pub(crate) fn any_hit_column(
        &self,
        asked: &AskedDirection,
        tile: &mut Tile,
        (sheaf, cut): (&Sheaf, &Cut),
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        dispatch!(self.level, simd => {
            self.any_hit_column_with(simd, asked, tile, (sheaf, cut), memory, counters)
        })
    }

    #[inline(always)]
    fn any_hit_column_with<S: Simd>(
        &self,
        simd: S,
        asked: &AskedDirection,
        tile: &mut Tile,
        (sheaf, cut): (&Sheaf, &Cut),
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        let lane = asked.lane % TARGETS;
        let part = sheaf.part_of(lane);
        let fit = match part {
            Some(_) => asked.mask & sheaf.fit_starts(tile),
            None => 0,
        };
        let mut blocked = 0;
        for start in bits(asked.mask & !fit) {
            let start_point = &asked.starts[start];
            let is_blocked = self.any_hit(asked.occluders, start_point, asked.target, counters);
            blocked |= u64::from(is_blocked) << start;
        }
        let (Some(part), true) = (part, fit != 0) else {
            return blocked;
        };
        let entries = cut.far_entries_of(part);
        if entries.is_empty() {
            return blocked;
        }
        let segments = sheaf.segments();
        memory.made = 0;
        let mut column = Column {
            bvh: self,
            asked,
            towards: Towards {
                direction: [0, 1, 2].map(|axis: usize| segments.direction[axis][lane]),
                target: asked.target,
            },
            bounds: StartBounds::new(self.frame.margin_in_frame, USUAL_ORIGIN_ERROR),
            ends: [segments.light[lane], segments.end[lane]],
            last: memory.last[asked.number],
            memory,
            tile,
            steps: 0,
            tests: 0,
        };
        let mut starts = if fit == column.tile.inside() {
            column.tile.bounds()
        } else {
            StartBox::of(column.tile.origins(), fit)
        };
        let mut pyramid = Pyramid::new(simd, segments, sheaf.face_of(part), 1 << lane);
        pyramid.start_at(starts.least, starts.most);
        let mut active = fit;
        if column.last != Child::NONE {
            active &= !column.blocked_in(simd, column.last, &starts, active);
        }
        for &entry in entries {
            if active == 0 {
                break;
            }
            let mut stack = [Waiting::default(); USUAL_DEPTH];
            stack[0] = entry;
            active &= !column.walk(simd, &mut pyramid, &mut starts, active, &mut stack, 1);
        }
        let Column {
            last, steps, tests, ..
        } = column;
        memory.last[asked.number] = last;
        counters.steps += steps;
        counters.intersections += tests;
        blocked | fit & !active
    }
}

/// A direction, and starts that were prepared together.
struct Column<'a> {
    bvh: &'a Bvh,
    asked: &'a AskedDirection<'a>,
    towards: Towards<'a>,
    bounds: StartBounds,
    /// Where the light is along the direction, and where segments surely have ended.
    ends: [f32; 2],
    last: Child,
    memory: &'a mut Memory,
    tile: &'a mut Tile,
    steps: u64,
    tests: u64,
}

impl Column<'_> {
    /// Walks on with a stack for some starts of a box, and returns which are blocked. Box and pyramid become narrower where few
    /// are left.
    #[inline(always)]
    fn walk<S: Simd>(
        &mut self,
        simd: S,
        pyramid: &mut Pyramid,
        starts: &mut StartBox,
        asked: u64,
        stack: &mut Stack,
        mut height: usize,
    ) -> u64 {
        let bvh = self.bvh;
        let most_cost = COST_EACH * asked.count_ones();
        let mut cost = 0;
        let mut active = asked;
        let mut boxed = asked.count_ones();
        // What lies lower was met by a larger box.
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
                if cost > most_cost && active.count_ones() > FEW_STARTS {
                    stack[height] = Waiting {
                        node: index as u32,
                        mask,
                    };
                    let rest = self.part(simd, pyramid, starts, active, stack, height + 1);
                    return asked & !active | rest;
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
                    _ => self.blocked_in(simd, child, starts, active),
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
                if MANY_LEFT * active.count_ones() <= boxed {
                    boxed = active.count_ones();
                    *starts = StartBox::of(self.tile.origins(), active);
                    pyramid.start_at(starts.least, starts.most);
                    mask &= pyramid.meets(simd, node);
                    stale = height;
                }
            }
        }
        asked & !active
    }

    /// Goes on for starts in four parts, each by itself.
    #[cold]
    #[inline(never)]
    fn part<S: Simd>(
        &mut self,
        simd: S,
        pyramid: &Pyramid,
        starts: &StartBox,
        asked: u64,
        stack: &Stack,
        height: usize,
    ) -> u64 {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut blocked = 0;
                for part in self.quarters(starts, asked) {
                    if part == 0 {
                        continue;
                    }
                    let mut starts = StartBox::of(self.tile.origins(), part);
                    let mut pyramid = *pyramid;
                    pyramid.start_at(starts.least, starts.most);
                    let mut stack = *stack;
                    blocked |= self.walk(simd, &mut pyramid, &mut starts, part, &mut stack, height);
                }
                blocked
            },
        )
    }

    /// Parts starts in up to four, each smaller than all: by the middles of the two longest sides of their box, else in
    /// halves.
    fn quarters(&self, starts: &StartBox, among: u64) -> [u64; 4] {
        let size = |axis: usize| starts.most[axis] - starts.least[axis];
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        let upper = |axis: usize| {
            let origins = &self.tile.origins()[axis];
            bits(among).fold(0, |mask, start| {
                mask | u64::from(origins[start] > starts.middle(axis)) << start
            })
        };
        let (u, v) = (upper(axes[0]), upper(axes[1]));
        let parts = [u & v, u & !v, !u & v, !u & !v].map(|part| part & among);
        if parts.contains(&among) {
            let half = among.count_ones() / 2;
            let low = (0..half).fold(among, |rest, _| rest & rest.wrapping_sub(1));
            return [among & !low, low, 0, 0];
        }
        parts
    }

    /// Returns from which starts a group of shapes blocks; none for a surface that has no filter.
    #[inline(always)]
    fn blocked_in<S: Simd>(
        &mut self,
        simd: S,
        child: Child,
        starts: &StartBox,
        active: u64,
    ) -> u64 {
        let bvh = self.bvh;
        let bounds = &bvh.usual_bounds;
        let occluders = self.asked.occluders;
        let mut rest = active;
        match child.kind() {
            ChildKind::Triangles => {
                let group = &bvh.triangles[child.index()];
                let members = &group.members;
                let below = *self.tile.starts_below(bvh, occluders, child);
                let asked = lanes(u32::from(members.opaque))
                    .filter(|&lane| below[lane % LANES] & active != 0)
                    .fold(0, |asked, lane| asked | 1 << lane);
                if asked == 0 {
                    return 0;
                }
                let forms = Forms::new(
                    simd,
                    group,
                    asked,
                    &self.towards,
                    starts,
                    self.tile.seen(),
                    (occluders, &self.bounds),
                );
                if forms.covering & u32::from(members.whole) != 0 {
                    self.tests += 1;
                    return active;
                }
                for lane in lanes(forms.possible) {
                    let starts = rest & below[lane % LANES];
                    if starts == 0 {
                        continue;
                    }
                    self.tests += 1;
                    let verdicts = forms.verdicts(simd, lane, self.tile.seen(), starts);
                    rest &= !self.decided(members, lane, verdicts);
                    if rest == 0 {
                        break;
                    }
                }
            }
            ChildKind::Spheres => {
                let group = &bvh.spheres[child.index()];
                let members = &group.members;
                for lane in lanes(u32::from(members.opaque)) {
                    self.tests += 1;
                    let towards = (self.towards.direction, self.ends[0]);
                    let verdicts = shapes::sphere_of_starts(
                        simd,
                        group,
                        lane,
                        towards,
                        self.tile.origins(),
                        rest,
                        bounds,
                    );
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

    /// Returns from which starts a surface without a filter blocks, among those whose segments meet its box.
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
        for start in bits(active) {
            let ray = self.ray(simd, start);
            if enters(simd, node, &ray, ray.end).1 >> slot & 1 == 0 || self.is_own(start, surface) {
                continue;
            }
            self.tests += 1;
            let occluders = self.asked.occluders;
            let is_blocked = occluders.blocks(surface, self.segment(start));
            blocked |= u64::from(is_blocked) << start;
        }
        blocked
    }

    /// Returns the segment of a start as the tree sees it.
    #[inline(always)]
    fn ray<S: Simd>(&self, simd: S, start: usize) -> FrameRay {
        let [x, y, z] = self.towards.direction;
        let origins = self.tile.origins();
        let [a, b, c] = [0, 1, 2].map(|axis: usize| origins[axis][start % TARGETS]);
        let inverse = f32x4::splat(simd, 1.0) / f32x4::simd_from(simd, [x, y, z, 1.0]);
        let origin = f32x4::simd_from(simd, [a, b, c, 0.0]);
        FrameRay {
            origin: origin.into(),
            direction: [x, y, z, 0.0],
            inverse: inverse.into(),
            offset: (origin * inverse).into(),
            end: self.ends[1],
            light: self.ends[0],
            length: (x * x + y * y + z * z).sqrt(),
            bounds: self.bvh.usual_bounds,
            entry: 0.0,
            rate: 1.0,
        }
    }

    /// Returns from which starts a shape blocks: those from which it surely does, and of those in doubt the ones for which the
    /// exact rule says so.
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
        let occluders = self.asked.occluders;
        for start in bits(possible & !blocked) {
            if self.is_own(start, surface) || self.is_flat_with(start, surface) {
                continue;
            }
            // Of a surface with holes that is surely crossed, only these are asked.
            let segment = self.segment(start);
            let is_blocked = if sure >> start & 1 != 0 {
                occluders.is_solid_at_crossing(surface, segment)
            } else {
                occluders.blocks(surface, segment)
            };
            blocked |= u64::from(is_blocked) << start;
        }
        blocked
    }

    /// Returns a segment for the exact rule.
    fn segment(&mut self, start: usize) -> &Segment {
        let AskedDirection {
            occluders,
            starts,
            target,
            ..
        } = *self.asked;
        let make = || occluders.segment(&starts[start], target);
        self.memory.segment(start, make)
    }

    fn is_own(&self, start: usize, surface: SurfaceId) -> bool {
        self.asked.starts[start].surface.is_some_and(|own| {
            own == surface || self.asked.occluders.have_one_own_rule(own, surface)
        })
    }

    /// Returns whether a triangle lies in the plane of a start's, and so blocks nothing.
    fn is_flat_with(&mut self, start: usize, surface: SurfaceId) -> bool {
        let occluders = self.asked.occluders;
        let is_triangle = (surface.0 as usize) < occluders.triangle_count();
        is_triangle
            && self.asked.starts[start]
                .surface
                .is_some_and(|own| self.memory.are_in_one_plane(occluders, own, surface))
    }
}
