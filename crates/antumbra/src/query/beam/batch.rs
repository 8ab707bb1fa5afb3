//! Targets of many starts, and a batch of points with targets, on all threads.

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};

use super::{WORD, is_fine_target, word_count};
use crate::query::run::{Run, check_length};
use crate::threads::{self, prelude::*};
use crate::{Batch, BatchCounters, BatchError, BatchKind, Coordinates, ShadowIndex};

/// Fewest and most starts that a thread takes at a time: each may have many targets.
const CHUNK: [usize; 2] = [32, 4096];

/// Chunks a thread, so that threads that are done early find more.
const CHUNKS_A_THREAD: usize = 8;

/// Targets of many starts: the same number for each start, all finite and at most 2^100 in magnitude.
#[derive(Clone, Copy, Debug)]
pub enum Targets<'a> {
    /// Targets that all starts share.
    Shared(&'a [LightShape]),
    /// Others for each start.
    Each {
        /// Those of a start lie together, start after start.
        targets: &'a [LightShape],
        /// How many each start has.
        per_start: usize,
    },
}

impl<'a> Targets<'a> {
    /// Returns how many targets each start has.
    pub fn per_start(&self) -> usize {
        match *self {
            Self::Shared(targets) => targets.len(),
            Self::Each { per_start, .. } => per_start,
        }
    }

    /// Returns whether there are as many as so many starts have.
    pub(in crate::query) fn fit(&self, start_count: usize) -> bool {
        match *self {
            Self::Shared(_) => true,
            Self::Each { targets, per_start } => {
                start_count.checked_mul(per_start) == Some(targets.len())
            }
        }
    }

    /// Returns the targets of one start.
    pub(in crate::query) fn of(&self, number: usize) -> &'a [LightShape] {
        match *self {
            Self::Shared(targets) => targets,
            Self::Each { targets, per_start } => &targets[number * per_start..][..per_start],
        }
    }

    /// Returns those of some starts in a row.
    pub(in crate::query) fn part(&self, first: usize, count: usize) -> Self {
        match *self {
            Self::Shared(_) => *self,
            Self::Each { targets, per_start } => Self::Each {
                targets: &targets[first * per_start..][..count * per_start],
                per_start,
            },
        }
    }

    /// Returns the first that has no answer.
    pub(in crate::query) fn first_bad(&self) -> Option<(usize, DVec3)> {
        let (Self::Shared(targets) | Self::Each { targets, .. }) = *self;
        let index = targets.iter().position(|target| !is_fine_target(target))?;
        Some((index, targets[index].homogeneous().0))
    }
}

impl ShadowIndex {
    /// Answers which targets of every point of a batch are occluded, and writes a bit each, as
    /// [`ShadowIndex::occluded_targets`] does: the words of a point lie together, point after point,
    /// `n.div_ceil(64)` for `n` targets.
    ///
    /// Points mean starts as for [`ShadowIndex::occluded`]: what is on the far side of the normal of a
    /// [`BatchKind::Facing`] is occluded.
    ///
    /// Runs on all threads of the current rayon pool, some points a thread at a time. Answers and errors do
    /// not depend on them. Takes no memory for each query.
    ///
    /// # Errors
    /// Lengths do not fit, or a target or a point has no answer. Targets are checked first; of several
    /// points at fault the first is named. `occluded` may be written in parts then.
    pub fn occluded_targets_batch<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        targets: Targets,
        occluded: &mut [u64],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        let count = batch.points.len();
        let stride = word_count(targets.per_start());
        check_length(
            "words of output",
            count.saturating_mul(stride),
            occluded.len(),
        )?;
        if let Targets::Each { targets, per_start } = targets {
            let expected = count.saturating_mul(per_start);
            check_length("targets", expected, targets.len())?;
        }
        if let Some((index, found)) = targets.first_bad() {
            let what = "target";
            return Err(BatchError::BadTarget { what, index, found });
        }
        let share = count / (CHUNKS_A_THREAD * threads::count());
        let length = share.clamp(CHUNK[0], CHUNK[1]);
        let task = antumbra_task::current();
        let answer = |first: usize, starts: &mut Vec<ReceiverPoint>, words: &mut [u64]| {
            starts.clear();
            for index in first..count.min(first + length) {
                antumbra_task::check();
                starts.push(run.start(index)?);
            }
            let mut counted = BatchCounters::default();
            let targets = targets.part(first, starts.len());
            self.answer_targets(starts, targets, words, &mut counted.counters)
                .expect("targets were checked");
            if let BatchKind::Facing { normals } = batch.kind {
                for (number, start) in starts.iter().enumerate() {
                    let normal = normals[first + number].as_f64();
                    let words = &mut words[number * stride..][..stride];
                    counted.facing_away += hide_behind(start, normal, targets.of(number), words);
                }
            }
            Ok(counted)
        };
        let mut rest = occluded;
        let mut parts = Vec::with_capacity(count.div_ceil(length));
        for first in (0..count).step_by(length) {
            let words = length.min(count - first) * stride;
            let (part, others) = std::mem::take(&mut rest).split_at_mut(words);
            parts.push((first, part));
            rest = others;
        }
        let counted: Vec<Result<BatchCounters, BatchError>> = parts
            .into_par_iter()
            .map_init(Vec::new, |starts, (first, words)| {
                task.enter(|| answer(first, starts, words))
            })
            .collect();
        let mut sum = BatchCounters::default();
        // The first error is that of the first point at fault.
        for counted in counted {
            let counted = counted?;
            sum.counters.add(&counted.counters);
            sum.facing_away += counted.facing_away;
        }
        Ok(sum)
    }
}

/// Marks the targets that are not strictly on the normal's side and returns how many these are.
fn hide_behind(
    start: &ReceiverPoint,
    normal: DVec3,
    targets: &[LightShape],
    words: &mut [u64],
) -> u64 {
    let mut count = 0;
    for (index, target) in targets.iter().enumerate() {
        if target.side_of(start.point, normal) <= 0 {
            words[index / WORD] |= 1 << (index % WORD);
            count += 1;
        }
    }
    count
}
