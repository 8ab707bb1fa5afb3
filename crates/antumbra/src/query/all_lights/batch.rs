//! All lights of the points of a batch, on all threads.

use antumbra_geometry::{LightId, ReceiverPoint};

use super::Work;
use crate::clock::Reading;
use crate::occlusion::AllLights;
use crate::query::beam::WORD;
use crate::query::run::{Run, check_length, chunk_length};
use crate::threads::prelude::*;
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, ReceiverSide, Refine, ShadowIndex,
};

/// Points between two looks at whether rows pay.
const ROUND: usize = 1 << 17;

/// As many lights are asked about at once.
pub(super) const MANY: usize = 16;

impl ShadowIndex {
    /// Answers for every point of a batch which of the index's lights reach it, as [`ShadowIndex::lights_visible_of`]
    /// does: the words of a point lie together, point after point, `lights.len().div_ceil(64)` each.
    ///
    /// Points mean starts as for [`ShadowIndex::occluded`]. Points with normals that face see what is on the normal's
    /// side, whatever `side` says.
    ///
    /// Runs on all threads of the current rayon pool. Answers and errors do not depend on them.
    ///
    /// # Errors
    /// Lengths do not fit, or a point has no answer; of several the first is named. `visible` may be written in parts
    /// then.
    pub fn lights_visible_batch<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        visible: &mut [u64],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        let count = batch.points.len();
        let stride = self.lights().len().div_ceil(WORD);
        check_length(
            "words of output",
            count.saturating_mul(stride),
            visible.len(),
        )?;
        let all = self.all_lights();
        let length = chunk_length(count.min(ROUND));
        let task = antumbra_task::current();
        let side_of = |point: usize| match batch.kind {
            BatchKind::Facing { normals } => ReceiverSide::Normal(normals[point].as_f64()),
            _ => side,
        };
        let answer =
            |first: usize, starts: &mut Vec<ReceiverPoint>, visible: &mut [u64], left: f64| {
                starts.clear();
                for index in first..first + visible.len() / stride {
                    antumbra_task::check();
                    starts.push(run.start(index)?);
                }
                Ok(self.some_lights(all, starts, |number| side_of(first + number), left, visible))
            };
        let mut sum = BatchCounters::default();
        if stride == 0 {
            for index in 0..count {
                run.start(index)?;
            }
            return Ok(sum);
        }
        let mut done = 0;
        for visible in visible.chunks_mut(ROUND * stride) {
            let first = done;
            done += visible.len() / stride;
            // What is known to come, for each point that came.
            let left = (count - done) as f64 / done as f64;
            let counted: Vec<Result<BatchCounters, BatchError>> = visible
                .par_chunks_mut(length * stride)
                .enumerate()
                .map_init(Vec::new, |starts, (number, visible)| {
                    task.enter(|| answer(first + number * length, starts, visible, left))
                })
                .collect();
            // The first error is that of the first point at fault.
            for counted in counted {
                let counted = counted?;
                sum.counters.add(&counted.counters);
                sum.facing_away += counted.facing_away;
            }
        }
        Ok(sum)
    }

    /// Returns whether a question about these lights is asked about all at once: where they are all that there are, and
    /// many. What many lights know one by one would not have room beside each other.
    pub(crate) fn asks_lights_at_once(&self, lights: &[LightId]) -> bool {
        let count = self.lights().len();
        count >= MANY
            && lights.iter().copied().map(LightId::index).eq(0..count)
            && self.knows_lights_at_once()
    }

    /// Returns whether rows of all lights are made while they are asked about.
    pub(super) fn knows_lights_at_once(&self) -> bool {
        self.knowledge()
            .is_some_and(|values| values.means().2 == Refine::Lazy)
            && self.all_lights().rows.is_some()
    }

    /// Writes which lights reach each of some starts that were checked. `left` times as many are known to come.
    pub(crate) fn all_lights_of_chunk(
        &self,
        starts: &[ReceiverPoint],
        side_of: impl Fn(usize) -> ReceiverSide,
        left: f64,
        visible: &mut Vec<u64>,
    ) -> BatchCounters {
        visible.clear();
        visible.resize(starts.len() * self.lights().len().div_ceil(WORD), 0);
        self.some_lights(self.all_lights(), starts, side_of, left, visible)
    }

    fn some_lights(
        &self,
        all: &AllLights,
        starts: &[ReceiverPoint],
        side_of: impl Fn(usize) -> ReceiverSide,
        left: f64,
        visible: &mut [u64],
    ) -> BatchCounters {
        if all.refine == Refine::Queried {
            self.make_rows(all, starts);
        }
        let begin = Reading::now();
        let mut counted = BatchCounters::default();
        let mut work = Work::new(self.lights().len());
        self.answer_all_lights(
            all,
            starts,
            side_of,
            visible,
            &mut work,
            &mut counted.counters,
        );
        let shadow = counted.counters.shadow;
        let pairs = starts.len() as u64 * self.lights().len() as u64;
        counted.facing_away = pairs - shadow.first_pass - shadow.rays;
        self.note_all_lights(all, &work.noted, begin, left);
        counted
    }

    /// Proves now what it can of all lights at once for the cells and surfaces of a batch's points, whether that pays or
    /// not, and keeps it in rows as far as there is room in [`Refinement::memory`](crate::Refinement::memory). Returns
    /// how many rows are new. Methods that keep nothing have none.
    ///
    /// For renderers and bakers that will ask about many points near these. Answers do not depend on it. Takes some
    /// microseconds a row and light, and for each light a few hundred nanoseconds a triangle, on all threads.
    ///
    /// # Errors
    /// As [`ShadowIndex::lights_visible_batch`].
    pub fn prepare_lights_visible<P: Coordinates>(
        &self,
        batch: &Batch<P>,
    ) -> Result<usize, BatchError> {
        let run = Run::new(self, batch, &[])?;
        let all: &AllLights = self.all_lights();
        let mut starts = Vec::with_capacity(batch.points.len());
        for index in 0..batch.points.len() {
            antumbra_task::check();
            starts.push(run.start(index)?);
        }
        Ok(self.make_rows(all, &starts))
    }
}
