//! antumbra on starts with many targets: by its walk of many targets, or by a ray a target.

use std::sync::{Mutex, PoisonError};

use antumbra::{Counters, ShadowCounters, ShadowIndex, Targets};
use antumbra_geometry::{AreaShape, LightShape};

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
        write_bits(&words, per_start, is_shadowed);
    }
}

/// Writes the bits of starts one by one.
fn write_bits(words: &[u64], per_start: usize, is_shadowed: &mut [bool]) {
    let stride = per_start.div_ceil(64);
    let starts = is_shadowed.chunks_mut(per_start).zip(words.chunks(stride));
    for (is_shadowed, words) in starts {
        for (is_shadowed, word) in is_shadowed.chunks_mut(64).zip(words) {
            for (bits, is_shadowed) in word
                .to_le_bytes()
                .into_iter()
                .zip(is_shadowed.chunks_mut(8))
            {
                // The byte eight times over, of which each keeps the bit of its place.
                let spread = u64::from_le_bytes([bits; 8]) & 0x8040_2010_0804_0201;
                let spread = spread.to_le_bytes().map(|byte| byte != 0);
                is_shadowed.copy_from_slice(&spread[..is_shadowed.len()]);
            }
        }
    }
}

/// A batch of starts with samples of one light with size, for an index that may know something of it.
#[derive(Debug)]
pub struct LoadedSamples<'a> {
    index: &'a ShadowIndex,
    batch: &'a TargetBatch,
    light: &'a AreaShape,
    counters: Mutex<ShadowCounters>,
}

impl<'a> LoadedSamples<'a> {
    /// Takes a batch, all targets of which are samples of the light, as it is.
    pub fn new(index: &'a ShadowIndex, batch: &'a TargetBatch, light: &'a AreaShape) -> Self {
        Self {
            index,
            batch,
            light,
            counters: Mutex::default(),
        }
    }

    /// Returns how all samples were decided that were answered so far, and forgets it.
    pub fn take_decisions(&self) -> ShadowCounters {
        std::mem::take(&mut *self.counters.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl LoadedBatch for LoadedSamples<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        let per_start = self.batch.per_start;
        assert!(
            first.is_multiple_of(per_start) && is_shadowed.len().is_multiple_of(per_start),
            "starts are whole"
        );
        let (first, count) = (first / per_start, is_shadowed.len() / per_start);
        let starts = &self.batch.starts[first..first + count];
        let samples = Targets::Each {
            targets: &self.batch.targets[first * per_start..][..count * per_start],
            per_start,
        };
        let counters = &mut Counters::default();
        let mut words = vec![0; per_start.div_ceil(64) * count];
        self.index
            .occluded_samples_of(starts, self.light, samples, &mut words, counters)
            .expect(VALID);
        write_bits(&words, per_start, is_shadowed);
        let sum = &mut self.counters.lock().unwrap_or_else(PoisonError::into_inner);
        sum.add(&counters.shadow);
    }
}
