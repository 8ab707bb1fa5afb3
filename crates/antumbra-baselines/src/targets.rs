//! antumbra on starts with many targets: by its walk of many targets, or by a ray a target.

use antumbra::{Counters, ShadowIndex, Targets};
use antumbra_geometry::LightShape;

use crate::{LoadedBatch, TargetBatch};

/// Batches hold queries that have an answer.
const VALID: &str = "a batch's starts and targets are fine";

/// Method that answers starts with many targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetWay {
    /// `ShadowIndex::occluded_targets_of`.
    Together,
    /// A ray of the index's own a target.
    Rays,
}

/// A batch of starts with targets for an index. A query is a pair of a start and a target; those of a start lie
/// together.
#[derive(Clone, Copy, Debug)]
pub struct LoadedTargets<'a> {
    index: &'a ShadowIndex,
    batch: &'a TargetBatch,
    way: TargetWay,
}

impl<'a> LoadedTargets<'a> {
    /// Takes a batch as it is.
    pub fn new(index: &'a ShadowIndex, batch: &'a TargetBatch, way: TargetWay) -> Self {
        Self { index, batch, way }
    }

    fn targets(&self, first: usize, count: usize) -> &'a [LightShape] {
        let per_start = self.batch.per_start;
        &self.batch.targets[first * per_start..][..count * per_start]
    }
}

impl LoadedBatch for LoadedTargets<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        let per_start = self.batch.per_start;
        assert!(
            first.is_multiple_of(per_start) && is_shadowed.len().is_multiple_of(per_start),
            "starts are whole"
        );
        let (first, count) = (first / per_start, is_shadowed.len() / per_start);
        let starts = &self.batch.starts[first..first + count];
        let counters = &mut Counters::default();
        let stride = per_start.div_ceil(64);
        let mut words = vec![0; stride * count];
        match self.way {
            TargetWay::Together => {
                let targets = Targets::Each {
                    targets: self.targets(first, count),
                    per_start,
                };
                self.index
                    .occluded_targets_of(starts, targets, &mut words, counters)
                    .expect(VALID);
            }
            TargetWay::Rays => {
                let words = words.chunks_mut(stride).zip(starts);
                for (number, (words, start)) in words.enumerate() {
                    let targets = self.targets(first + number, 1);
                    self.index
                        .occluded_targets_by_rays(start, targets, words, counters)
                        .expect(VALID);
                }
            }
        }
        let starts = is_shadowed.chunks_mut(per_start).zip(words.chunks(stride));
        for (is_shadowed, words) in starts {
            for (is_shadowed, word) in is_shadowed.chunks_mut(64).zip(words) {
                for (bit, is_shadowed) in is_shadowed.iter_mut().enumerate() {
                    *is_shadowed = word >> bit & 1 != 0;
                }
            }
        }
    }
}
