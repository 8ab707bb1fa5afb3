//! Shadow volumes. F. C. Crow, "Shadow Algorithms for Computer Graphics", Computer Graphics 11(2) (Proceedings of
//! SIGGRAPH 77), August 1977, 242-248; Paper 2.
//!
//! In: surfaces, one light. Out: for each opaque triangle the pyramid behind it, as four planes. A query counts
//! the volumes that hold the start and is in shadow where there is one; since only that is asked, it stops at the
//! first. Crow walks scanlines through the volumes' sides and keeps a count; a start by itself has no scanline.
//!
//! Invariant: answers are the reference's. Where a plane's sign is not certain, the exact rule is asked of that
//! triangle; curved and alpha-tested surfaces, which have no pyramid, are always asked of it.
//!
//! Kinder than the paper: blocks of neighbouring surfaces are passed by when the start is outside the shadow of
//! the ball around them.

use antumbra::{Answer, Decided, LightId, QueryError, ShadowIndex};
use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders, ReceiverPoint, Segment, SurfaceId};

use super::forms::{Frame, Polygon};
use super::formulas::PaperMemory;
use super::{Rival, RivalError, RivalKind, RivalOptions, Work, answer};

/// Surfaces of a block.
const BLOCK: usize = 32;
/// What the distance of a ray from a ball's middle may be off by, in shares of all coordinates at hand: some
/// thousand roundings.
const BALL_MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

/// Shadow volumes of all lights.
#[derive(Debug)]
pub struct ShadowVolumes {
    frame: Frame,
    /// The scene's largest coordinate plus its size.
    scale: f64,
    lights: Vec<Volumes>,
}

/// Of one light.
#[derive(Debug)]
struct Volumes {
    blocks: Vec<Block>,
    /// Block after block.
    members: Vec<Member>,
    pyramids: Vec<Polygon>,
}

#[derive(Debug)]
struct Block {
    middle: DVec3,
    radius: f64,
    /// Where its members end; they begin where those of the block before end.
    end: u32,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    surface: SurfaceId,
    /// [`NO_PYRAMID`] for surfaces that the exact rule is asked of.
    pyramid: u32,
}

const NO_PYRAMID: u32 = u32::MAX;

impl ShadowVolumes {
    /// Builds the volumes of all lights of an index.
    ///
    /// # Errors
    /// They need more memory than they may take.
    pub fn new(index: &ShadowIndex, options: &RivalOptions) -> Result<Self, RivalError> {
        let occluders = index.occluders();
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let each = size_of::<Member>() + size_of::<Polygon>() + size_of::<Block>() / BLOCK;
        let needed = (occluders.surface_count() * each * index.lights().len()) as u64;
        if needed > options.memory_limit {
            return Err(RivalError::Memory {
                kind: RivalKind::ShadowVolumes,
                limit: options.memory_limit,
            });
        }
        let order = in_order(occluders, &bounds);
        let of_light = |light| Volumes::new(occluders, light, &order, &frame);
        Ok(Self {
            frame,
            scale: if bounds.is_empty() {
                0.0
            } else {
                bounds.largest_coordinate() + bounds.size().max_element()
            },
            lights: index.lights().iter().map(of_light).collect(),
        })
    }
}

/// Returns the opaque surfaces, neighbours in space beside each other: along a Morton curve.
fn in_order(occluders: &Occluders, bounds: &Bounds) -> Vec<SurfaceId> {
    let size = bounds.size();
    let code = |surface: SurfaceId| {
        let at = (occluders.surface_bounds(surface).center() - bounds.min) / size;
        let at = at
            .to_array()
            .map(|share| (share * 1024.0).min(1023.0) as u32);
        (0..10).fold(0u32, |code, bit| {
            (0..3).fold(code, |code, axis| {
                code | (at[axis] >> bit & 1) << (3 * bit + axis as u32)
            })
        })
    };
    let mut order: Vec<_> = occluders
        .surfaces()
        .filter(|&surface| occluders.is_opaque(surface))
        .map(|surface| (code(surface), surface))
        .collect();
    order.sort_unstable();
    order.into_iter().map(|(_, surface)| surface).collect()
}

impl Volumes {
    fn new(occluders: &Occluders, light: &LightShape, order: &[SurfaceId], frame: &Frame) -> Self {
        let light = light.without_underflow();
        let mut volumes = Self {
            blocks: Vec::new(),
            members: Vec::new(),
            pyramids: Vec::new(),
        };
        for block in order.chunks(BLOCK) {
            let mut bounds = Bounds::EMPTY;
            for &surface in block {
                let mut pyramid = NO_PYRAMID;
                if let Some(corners) = occluders.triangle_positions(surface) {
                    let side = occluders.light_side_of(surface, &light);
                    if side == 0 {
                        // No area, or seen from the edge.
                        continue;
                    }
                    if occluders.is_opaque_everywhere(surface) {
                        pyramid = volumes.pyramids.len() as u32;
                        let cap = Polygon::cap(surface.0, corners, side, &light, frame);
                        volumes.pyramids.push(cap);
                    }
                }
                bounds = bounds.union(occluders.surface_bounds(surface));
                volumes.members.push(Member { surface, pyramid });
            }
            volumes.blocks.push(Block {
                middle: bounds.center(),
                radius: 0.5 * bounds.size().length() * (1.0 + BALL_MARGIN),
                end: volumes.members.len() as u32,
            });
        }
        volumes
    }
}

impl Block {
    /// Returns whether the ball may be in the way; never `false` if it is.
    fn may_block(&self, segment: &Segment, scale: f64) -> bool {
        let (from, along) = (segment.origin(), segment.direction());
        let seen = self.middle - from;
        let share = seen.dot(along) / along.length_squared();
        let end = if segment.is_finite() {
            1.0
        } else {
            f64::INFINITY
        };
        let off = seen - share.clamp(0.0, end) * along;
        let margin =
            BALL_MARGIN * (scale + from.abs().element_sum()) + 2.0 * segment.origin_error();
        let radius = self.radius + margin;
        let distance_squared = off.length_squared();
        distance_squared <= radius * radius || distance_squared.is_nan()
    }
}

impl Rival for ShadowVolumes {
    fn kind(&self) -> RivalKind {
        RivalKind::ShadowVolumes
    }

    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError> {
        index.check_query(start, LightId::from_index(light))?;
        let occluders = index.occluders();
        let segment = occluders.segment(start, &index.lights()[light]);
        // The far side of a closed solid is dark without any volume.
        let is_shadowed = occluders.own_rule_blocks(&segment)
            || self.count(light, occluders, &segment, 1, work) > 0;
        let answer = answer(is_shadowed, Decided::FirstPass);
        work.counters.shadow.count(answer);
        Ok(answer)
    }

    fn bytes(&self, light: usize) -> u64 {
        let volumes = &self.lights[light];
        (size_of_val(volumes.blocks.as_slice())
            + size_of_val(volumes.members.as_slice())
            + size_of_val(volumes.pyramids.as_slice())) as u64
    }

    fn paper_memory(&self, _: &ShadowIndex) -> Option<PaperMemory> {
        // The paper does not count it.
        None
    }
}

impl ShadowVolumes {
    /// Counts the volumes that hold a start, curved and alpha-tested surfaces that block it included; the far
    /// side of its own closed solid is none.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn volumes_holding(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
    ) -> Result<u64, QueryError> {
        index.check_query(start, LightId::from_index(light))?;
        let occluders = index.occluders();
        let segment = occluders.segment(start, &index.lights()[light]);
        Ok(self.count(light, occluders, &segment, u64::MAX, &mut Work::default()))
    }

    /// Counts the volumes that hold the start, up to so many.
    fn count(
        &self,
        light: usize,
        occluders: &Occluders,
        segment: &Segment,
        most: u64,
        work: &mut Work,
    ) -> u64 {
        let volumes = &self.lights[light];
        let mut count = 0;
        let own = segment.start().surface;
        let start = self.frame.start(segment);
        let mut first = 0;
        for block in &volumes.blocks {
            let members = first..block.end as usize;
            first = members.end;
            work.counters.steps += 1;
            if members.is_empty() || !block.may_block(segment, self.scale) {
                continue;
            }
            work.candidates += members.len() as u64;
            for member in &volumes.members[members] {
                if Some(member.surface) == own {
                    continue;
                }
                work.counters.intersections += 1;
                let by_volume = start.and_then(|start| {
                    let pyramid = volumes.pyramids.get(member.pyramid as usize)?;
                    pyramid.volume_holds(start)
                });
                if by_volume.unwrap_or_else(|| occluders.blocks(member.surface, segment)) {
                    count += 1;
                    if count == most {
                        return count;
                    }
                }
            }
        }
        count
    }
}
