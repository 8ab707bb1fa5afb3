//! Directions that many starts share: prepared once, and what a tile of starts may meet of the tree at all.
//!
//! In: a [`Block`] of directions, a [`Tile`] of starts near each other. Out: a [`Cut`], the nodes and leaves at which the walks
//! of these starts begin in place of the root; and the bits of [`Bvh::any_hit`]. Invariant: a leaf that a segment of the
//! tile may meet is under the cut, unless none of its triangles may block a start by the sides asked about ([`Tile`]).

use antumbra_geometry::Occluders;
use fearless_simd::{Simd, dispatch};

use super::super::data::{Bvh, Child, WIDTH};
use super::super::ray::{INSIDE, USUAL_ORIGIN_ERROR};
use super::super::walk::{USUAL_DEPTH, Waiting, lanes};
use super::pyramid::{Face, Faces, Pyramid};
use super::targets::{Block, Segments, bits};
use super::tile::{OfTile, Tile};
use super::{Asked, Beam, FEW, MANY_LEFT, Memory, ROOT};
use crate::Counters;

/// Most nodes at which the walks of a start begin. Each costs a visit a start.
const MOST_ENTRIES: usize = 24;

/// Height, in sizes of the tile over the range of slopes, below which entries are asked start by start. There, the directions of
/// one start are closer together than the starts of one direction, within a factor. Chosen by timing.
const NEAR: f32 = 1.2;

/// Where directions are farther apart, as the patches of a coarse sky, nothing is near: too few walk with each start.
const WIDE: f32 = 1.0;

/// Directions count as at least so far apart, as the difference of their slopes.
const NARROW: f32 = 0.1;

/// Up to 64 directions, prepared for starts anywhere.
#[derive(Clone, Debug)]
pub(crate) struct Sheaf {
    segments: Segments,
    /// Which of them are neither too long nor too short.
    fit: u64,
    /// The largest factor that a length along a direction is multiplied with.
    largest_scale: f64,
    parts: Vec<Part>,
}

/// Those of a sheaf that go along one face.
#[derive(Clone, Copy, Debug)]
struct Part {
    targets: u64,
    /// Its start is where it was last.
    pyramid: Pyramid,
    /// The largest difference of slopes.
    width: f32,
}

/// Where the walks of a tile's starts begin, for each part of a sheaf: what may be met first comes first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cut {
    parts: Vec<Entries>,
    /// What is found for one part: nodes that were not looked into have all children in their masks.
    found: Vec<Found>,
}

/// Where walks for a part of a sheaf begin.
#[derive(Clone, Debug, Default)]
struct Entries {
    /// Entries that begin where the directions from one start are closer together than the tile's starts.
    near: Vec<Waiting>,
    far: Vec<Waiting>,
}

/// Which entries of a cut are asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reach {
    All,
    /// The near ones, for directions that are fit; others are left.
    Near,
}

/// Children of a node, and the least height at which the pyramid may meet one.
#[derive(Clone, Copy, Debug)]
struct Found {
    height: f32,
    waiting: Waiting,
    is_new: bool,
}

impl Cut {
    /// Returns whether nothing blocks any segment that is fit, of any start of the tile.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        let mut parts = self.parts.iter();
        parts.all(|part| part.near.is_empty() && part.far.is_empty())
    }

    /// Returns whether something near may block.
    #[inline]
    pub(crate) fn has_near(&self) -> bool {
        self.parts.iter().any(|part| !part.near.is_empty())
    }

    /// Returns where walks for a part of the sheaf begin that leave out what is near.
    pub(super) fn far_entries_of(&self, part: usize) -> &[Waiting] {
        &self.parts[part].far
    }
}

impl Sheaf {
    /// Prepares a block that has directions only.
    pub(crate) fn new(bvh: &Bvh, block: &Block) -> Self {
        dispatch!(bvh.level, simd => Self::with(simd, bvh, block))
    }

    #[inline(always)]
    fn with<S: Simd>(simd: S, bvh: &Bvh, block: &Block) -> Self {
        // Directions are the same from everywhere.
        let segments = Segments::new(simd, bvh, (bvh.frame.center, 0.0), block, u64::MAX);
        let fit = segments.fit & block.asked();
        let faces = Faces::of(simd, &segments);
        let mut parts = Vec::new();
        let mut rest = fit;
        while rest != 0 {
            let (face, targets) = faces.shared_by_most(rest);
            if targets == 0 {
                break;
            }
            rest &= !targets;
            let pyramid = Pyramid::new(simd, &segments, face, targets);
            let widths = pyramid.slopes.map(|[low, high]| high - low);
            parts.push(Part {
                targets,
                pyramid,
                width: widths[0].max(widths[1]).max(NARROW),
            });
        }
        Self {
            segments,
            fit: fit & !rest,
            largest_scale: 2.0 / block.least_length(),
            parts,
        }
    }

    pub(super) fn segments(&self) -> &Segments {
        &self.segments
    }

    /// Returns the part that a direction is in, if it is fit.
    pub(super) fn part_of(&self, lane: usize) -> Option<usize> {
        self.parts
            .iter()
            .position(|part| part.targets >> lane & 1 != 0)
    }

    pub(super) fn face_of(&self, part: usize) -> Face {
        self.parts[part].pyramid.face
    }

    /// Returns the starts of a tile for which a cut holds.
    #[inline]
    pub(crate) fn fit_starts(&self, tile: &Tile) -> u64 {
        tile.fit_for(self.largest_scale)
    }

    /// Returns which directions are answered by [`Bvh::any_hit_sheaf`] for a start inside the frame; single rays answer the others.
    #[inline]
    pub(crate) fn fit(&self) -> u64 {
        self.fit
    }
}

impl Bvh {
    /// Returns whether starts can share walks in this tree.
    pub(crate) fn takes_sheaves(&self) -> bool {
        !self.nodes.is_empty() && self.depth <= USUAL_DEPTH
    }

    /// Finds where the walks of a tile's starts begin.
    pub(crate) fn cut(
        &self,
        occluders: &Occluders,
        tile: &mut Tile,
        sheaf: &Sheaf,
        cut: &mut Cut,
        counters: &mut Counters,
    ) {
        dispatch!(self.level, simd => self.cut_with(simd, occluders, tile, sheaf, cut, counters));
    }

    #[inline(always)]
    fn cut_with<S: Simd>(
        &self,
        simd: S,
        occluders: &Occluders,
        tile: &mut Tile,
        sheaf: &Sheaf,
        cut: &mut Cut,
        counters: &mut Counters,
    ) {
        cut.parts.resize_with(sheaf.parts.len(), Entries::default);
        let bounds = tile.bounds();
        let size = (0..3).fold(0.0_f32, |size, axis| {
            size.max(bounds.most[axis] - bounds.least[axis])
        });
        for (part, entries) in sheaf.parts.iter().zip(&mut cut.parts) {
            let near = if part.width > WIDE {
                f32::NEG_INFINITY
            } else {
                NEAR * size / part.width
            };
            entries.near.clear();
            entries.far.clear();
            let mut pyramid = part.pyramid;
            pyramid.start_at(bounds.least, bounds.most);
            let found = &mut cut.found;
            found.clear();
            found.push(Found {
                height: 0.0,
                waiting: ROOT,
                is_new: true,
            });
            while found.len() < MOST_ENTRIES {
                // What is near is looked into first: it is seen under the largest angle.
                let new = found.iter().enumerate().filter(|(_, found)| found.is_new);
                let nearest = new.min_by(|a, b| a.1.height.total_cmp(&b.1.height));
                let Some((place, _)) = nearest else { break };
                let Waiting { node: index, .. } = found.swap_remove(place).waiting;
                let node = &self.nodes[index as usize];
                counters.steps += 1;
                // Leaves that are near, and others.
                let (mut leaves, mut least) = ([0; 2], [f32::INFINITY; 2]);
                let heights = pyramid.heights(node);
                for slot in lanes(pyramid.meets(simd, node)) {
                    let (child, height) = (node.children[slot % WIDTH], heights[slot % WIDTH]);
                    if child.is_node() {
                        found.push(Found {
                            height,
                            waiting: Waiting {
                                node: child.index() as u32,
                                ..ROOT
                            },
                            is_new: true,
                        });
                    } else if !tile.rules_out(self, occluders, child) {
                        let kind = usize::from(height > near);
                        leaves[kind] |= 1 << slot;
                        least[kind] = least[kind].min(height);
                    }
                }
                for (mask, height) in leaves.into_iter().zip(least) {
                    if mask != 0 {
                        found.push(Found {
                            height,
                            waiting: Waiting { node: index, mask },
                            is_new: false,
                        });
                    }
                }
            }
            found.sort_unstable_by(|a, b| a.height.total_cmp(&b.height));
            let first_far = found.partition_point(|found| found.height <= near);
            let (is_near, is_far) = found.split_at(first_far);
            entries
                .near
                .extend(is_near.iter().map(|found| found.waiting));
            entries.far.extend(is_far.iter().map(|found| found.waiting));
        }
    }

    /// Returns which of a sheaf's directions an opaque surface blocks from a start of a tile, among those that a mask asks
    /// about. Own rules have been asked before: they block nothing here.
    #[inline]
    pub(crate) fn any_hit_sheaf(
        &self,
        asked: &Asked,
        sheaf: &mut Sheaf,
        (cut, reach, of): (&Cut, Reach, OfTile<'_>),
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        dispatch!(self.level, simd => {
            self.any_hit_sheaf_with(simd, asked, sheaf, (cut, reach, of), memory, counters)
        })
    }

    #[inline(always)]
    fn any_hit_sheaf_with<S: Simd>(
        &self,
        simd: S,
        asked: &Asked,
        sheaf: &mut Sheaf,
        (cut, reach, of): (&Cut, Reach, OfTile<'_>),
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
        let offset = occluders.start_offset(start);
        let place = self.frame.point_in_frame(start.point);
        // Not for NaN.
        let is_fit = offset <= self.frame.margin_of_starts()
            && place.abs().max_element() <= INSIDE
            && offset * sheaf.largest_scale <= USUAL_ORIGIN_ERROR;
        let fit = if is_fit { sheaf.fit & mask } else { 0 };
        let mut blocked = 0;
        let unfit = match reach {
            Reach::All => mask & !fit,
            Reach::Near => 0,
        };
        for lane in bits(unfit) {
            let is_blocked = self.any_hit(occluders, start, &targets[lane], counters);
            blocked |= u64::from(is_blocked) << lane;
        }
        if fit == 0 {
            return blocked;
        }
        let origin = [place.x as f32, place.y as f32, place.z as f32];
        sheaf.segments.origin = origin;
        memory.made = 0;
        let mut beam = Beam {
            bvh: self,
            asked,
            segments: &sheaf.segments,
            own: start.surface.map_or(u32::MAX, |surface| surface.0),
            last: memory.last[number],
            memory,
            of: Some(of),
            steps: 0,
            tests: 0,
        };
        for (part, entries) in sheaf.parts.iter_mut().zip(&cut.parts) {
            let mut active = fit & part.targets;
            let far: &[Waiting] = match reach {
                Reach::All => &entries.far,
                Reach::Near => &[],
            };
            if active == 0 || entries.near.len() + far.len() == 0 {
                continue;
            }
            let asked = active;
            let mut pyramid = if MANY_LEFT * active.count_ones() <= part.targets.count_ones() {
                Pyramid::new(simd, &sheaf.segments, part.pyramid.face, active)
            } else {
                part.pyramid.start_at(origin, origin);
                part.pyramid
            };
            if beam.last != Child::NONE {
                active &= !beam.blocked_in(simd, beam.last, &pyramid, active);
            }
            for &entry in entries.near.iter().chain(far) {
                if active == 0 {
                    break;
                }
                let mut stack = [Waiting::default(); USUAL_DEPTH];
                stack[0] = entry;
                active &= !if active.count_ones() <= FEW {
                    beam.each(simd, active, &stack, 1)
                } else {
                    beam.walk(simd, &mut pyramid, active, &mut stack, 1)
                };
            }
            blocked |= asked & !active;
        }
        let Beam {
            last, steps, tests, ..
        } = beam;
        memory.last[number] = last;
        counters.steps += steps;
        counters.intersections += tests;
        blocked
    }
}
