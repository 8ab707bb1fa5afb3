//! Many targets at once: which of a start's targets are occluded, as a mask.
//!
//! In: a start, or many, and for each a list of targets: points, or directions of light from afar. Out: a bit
//! a target, 1 where it is occluded. Invariant: every bit is that of [`ShadowIndex::shadow`] for the start and
//! a light in the target's place (EXACTNESS.md, "Many targets of one start"), for any number of threads.
//! Absent here: lights with a size, which are lists of targets to whoever samples them.

mod batch;
mod words;

pub use batch::Targets;

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};

use crate::accel::bvh::{Asked, Block, Memory, TARGETS};
use crate::{Counters, Method, QueryError, Shadow, ShadowIndex};
pub(super) use words::WORD;
use words::is_fine_target;
pub(super) use words::word_count;

impl ShadowIndex {
    /// Answers which targets of one start are occluded, and writes a bit each: bit `i % 64`, counted from the
    /// lowest, of word `i / 64` is 1 where an opaque surface is between the start and target `i`. Bits beyond
    /// the last target are 0.
    ///
    /// A target is a point of world space, or a direction towards light from afar. Each bit is that of
    /// [`ShadowIndex::shadow`] for a light in the target's place: the segment is open at both ends, and
    /// targets are taken as given, never moved onto a surface. A zero direction is never occluded, nor is a
    /// target where the start is. Which side of its surface a target is on plays no part: callers that leave
    /// out targets behind the surface do so themselves.
    ///
    /// Needs no values, whatever the method, and changes none. Counts a ray a target under
    /// `counters.shadow`.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Counters, ShadowIndex};
    /// # use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, Sphere, ReceiverPoint, SurfaceId};
    /// # let mut builder = Occluders::builder();
    /// # let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    /// # builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
    /// # let ball = Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 1.0 };
    /// # builder.add_sphere(ball, Opacity::Opaque)?;
    /// // A ball over a floor, and three samples of a lamp above.
    /// let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new()).build()?;
    /// let samples = [0.0, 3.0, 6.0].map(|x| LightShape::Point(DVec3::new(x, 0.0, 4.0)));
    /// let start = ReceiverPoint { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
    /// let mut occluded = [0];
    /// index.occluded_targets(&start, &samples, &mut occluded, &mut Counters::default())?;
    /// // The ball hides the first alone.
    /// assert_eq!(occluded, [0b001]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The start is not finite or beyond 2^100 or its surface does not exist, or so is a target
    /// ([`QueryError::BadTarget`]). Nothing is written then.
    ///
    /// # Panics
    /// `occluded` does not have `targets.len().div_ceil(64)` words.
    pub fn occluded_targets(
        &self,
        start: &ReceiverPoint,
        targets: &[LightShape],
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        let starts = std::slice::from_ref(start);
        self.occluded_targets_of(starts, Targets::Shared(targets), occluded, counters)
    }

    /// Answers for many starts, one after another, each as [`ShadowIndex::occluded_targets`] does. The words
    /// of a start lie together, start after start: `n.div_ceil(64)` for `n` targets. Faster than one by one
    /// where consecutive starts are near each other. Uses the calling thread only.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded_targets`], for a start at fault, else the first target; answers to starts before it
    /// may be written.
    ///
    /// # Panics
    /// `occluded` does not have as many words, or the targets are not as many for each start as they say.
    pub fn occluded_targets_of(
        &self,
        starts: &[ReceiverPoint],
        targets: Targets,
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        for start in starts {
            self.check_start(start)?;
        }
        let stride = word_count(targets.per_start());
        assert_eq!(occluded.len(), stride * starts.len(), "a bit a target");
        assert!(targets.fit(starts.len()), "targets for each start");
        let answered = self.answer_targets(starts, targets, occluded, counters);
        answered.map_err(|BadTargets| match targets.first_bad() {
            Some((index, target)) => QueryError::BadTarget { index, target },
            None => unreachable!("a target is bad"),
        })
    }

    /// Answers as [`ShadowIndex::occluded_targets`] does, by a ray a target: for measurements, and for tests that
    /// compare.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded_targets`].
    ///
    /// # Panics
    /// As [`ShadowIndex::occluded_targets`].
    #[doc(hidden)]
    pub fn occluded_targets_by_rays(
        &self,
        start: &ReceiverPoint,
        targets: &[LightShape],
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        if let Some((index, target)) = Targets::Shared(targets).first_bad() {
            return Err(QueryError::BadTarget { index, target });
        }
        self.check_start(start)?;
        assert_eq!(occluded.len(), word_count(targets.len()), "a bit a target");
        for (targets, word) in targets.chunks(WORD).zip(occluded) {
            *word = self.occluded_one_by_one(start, targets, u64::MAX, counters);
            counters.shadow.rays += targets.len() as u64;
            counters.shadow.shadowed += u64::from(word.count_ones());
        }
        Ok(())
    }

    /// Answers starts that were checked, up to targets that have no answer. Shared ones are looked at first.
    fn answer_targets(
        &self,
        starts: &[ReceiverPoint],
        targets: Targets,
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), BadTargets> {
        let per_start = targets.per_start();
        if per_start == 0 {
            return Ok(());
        }
        // Blocks of targets that starts share are made once.
        let shared: Vec<Block> = match targets {
            Targets::Shared(targets) => targets.chunks(TARGETS).map(Block::new).collect(),
            Targets::Each { .. } => Vec::new(),
        };
        if !shared.iter().all(Block::is_fine) {
            return Err(BadTargets);
        }
        let stride = word_count(per_start);
        let mut memory = Memory::new(stride);
        let mut own = Block::NONE;
        for (number, (start, words)) in starts.iter().zip(occluded.chunks_mut(stride)).enumerate() {
            antumbra_task::check();
            let blocks = targets.of(number).chunks(TARGETS).enumerate();
            for ((place, targets), word) in blocks.zip(words) {
                let block = match shared.get(place) {
                    Some(block) => block,
                    None => {
                        own.take(targets);
                        if !own.is_fine() {
                            return Err(BadTargets);
                        }
                        &own
                    }
                };
                let asked = AskedBlock {
                    targets,
                    block,
                    number: place,
                    mask: u64::MAX,
                    leaves: None,
                };
                *word = self.occluded_block(start, &asked, &mut memory, counters);
                counters.shadow.shadowed += u64::from(word.count_ones());
            }
            counters.shadow.rays += per_start as u64;
        }
        Ok(())
    }

    /// Answers up to 64 targets of a start.
    #[inline]
    pub(crate) fn occluded_block(
        &self,
        start: &ReceiverPoint,
        &AskedBlock {
            targets,
            block,
            number,
            mask,
            leaves,
        }: &AskedBlock,
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        let all = block.asked() & mask;
        let is_walked = match self.method() {
            Method::Auto | Method::Voxel | Method::Bvh => true,
            Method::Voxel1990 | Method::Grid | Method::Naive => false,
        };
        let bvh = match self.bvh() {
            Some(bvh) if is_walked => bvh,
            _ => return self.occluded_one_by_one(start, targets, all, counters),
        };
        let near = &*self.parts.near;
        let mut occluded = 0;
        if let Some(rule) = near.own_rule(start) {
            for (place, target) in targets.iter().enumerate() {
                occluded |= u64::from(rule.hides(target)) << place;
            }
            occluded &= all;
            if occluded == all {
                return all;
            }
        }
        let asked = Asked {
            occluders: near,
            start,
            targets,
            mask: all & !occluded,
            number,
        };
        occluded |= match leaves {
            Some(leaves) => bvh.any_hit_listed(&asked, leaves, block, memory, counters),
            None => bvh.any_hit_targets(&asked, block, memory, counters),
        };
        if !self.parts.is_whole() {
            let far = &self.parts;
            for (place, target) in targets.iter().enumerate() {
                if all & !occluded & 1 << place != 0
                    && far.far_blocks(self.occluders(), start, target, counters)
                {
                    occluded |= 1 << place;
                }
            }
        }
        occluded
    }

    /// Answers the targets of a mask by a ray each, without a tree.
    fn occluded_one_by_one(
        &self,
        start: &ReceiverPoint,
        targets: &[LightShape],
        asked: u64,
        counters: &mut Counters,
    ) -> u64 {
        // These are counted with those of other methods.
        let mut counted = Counters::default();
        let mut occluded = 0;
        for (place, target) in targets.iter().enumerate() {
            let is_nowhere = *target == LightShape::Direction(DVec3::ZERO);
            if asked >> place & 1 != 0 && !is_nowhere {
                let answer = self.answer_to(start, target, &mut counted);
                occluded |= u64::from(answer.shadow == Shadow::Shadowed) << place;
            }
        }
        counters.steps += counted.steps;
        counters.intersections += counted.intersections;
        occluded
    }
}

/// Up to 64 targets that are asked together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AskedBlock<'a> {
    pub(crate) targets: &'a [LightShape],
    /// The same targets.
    pub(crate) block: &'a Block,
    /// Its number among the blocks of the start.
    pub(crate) number: usize,
    /// Which of them are asked about; those that are not are not occluded.
    pub(crate) mask: u64,
    /// Leaves of the tree that hold all that may block, where that is known.
    pub(crate) leaves: Option<&'a [u32]>,
}

/// Some target has no answer.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct BadTargets;
