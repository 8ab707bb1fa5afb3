//! Lights with size: which samples of a light reach a receiver point, and the visible fraction (Paper 9.3).
//!
//! In: receiver points, an [`AreaShape`], how many samples. Out: for each sample whether it is lit, or how
//! many are. Invariant: the bit of a sample is that of [`ShadowIndex::shadow`] for a light in the sample's
//! place (EXACTNESS.md, "Lights with size"), for any method and any number of threads. Absent here: where
//! samples lie, which is geometry, and how they are answered, which [`ShadowIndex::occluded_targets`] knows.

mod ambient;
pub(super) mod exact;
mod walker;
mod whole;

use crate::threads::prelude::*;
use antumbra_geometry::{
    AreaSample, AreaShape, DVec3, LightShape, MAX_LIGHT_SAMPLES, ReceiverPoint, SamplePattern,
};

use super::points::ReceiverSide;
use super::run::{Run, check_length};
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, QueryError, ShadowIndex,
    Targets,
};

/// Bits of a word.
const WORD: usize = 64;

/// Samples that a thread prepares at a time at most, 3 MiB.
const CHUNK_SAMPLES: usize = 1 << 15;

/// Points that a thread takes at a time at most.
const CHUNK_POINTS: usize = 1024;

/// How a light with size is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSampling {
    /// Samples for each receiver point, 1 to [`MAX_LIGHT_SAMPLES`]; what is out of range is taken as the nearest.
    /// Powers of two are spread best.
    pub samples: u32,
    /// Another seed gives other samples.
    pub seed: u64,
    /// The light's number, so that lights have samples of their own.
    pub light: u64,
}

impl LightSampling {
    /// Makes samples of light 0 with seed 0.
    pub fn new(samples: u32) -> Self {
        Self {
            samples,
            seed: 0,
            light: 0,
        }
    }

    /// Returns how many samples there are.
    pub fn count(&self) -> u32 {
        self.samples.clamp(1, MAX_LIGHT_SAMPLES)
    }
}

/// Which samples of one light reach one receiver point. Made once and filled again and again, so that points
/// cost no memory of their own.
#[derive(Clone, Debug, Default)]
pub struct LightSamples {
    total: u32,
    asked: Vec<AreaSample>,
    targets: Vec<LightShape>,
    occluded: Vec<u64>,
}

impl LightSamples {
    /// Returns how many samples there are, those not queried included.
    pub fn total(&self) -> u32 {
        self.total
    }

    /// Returns the samples that were queried: those that the light shines from towards the point, and that the
    /// point's plane does not hide.
    pub fn queried(&self) -> &[AreaSample] {
        &self.asked
    }

    /// Returns the samples that reach the point, in their order.
    pub fn lit(&self) -> impl Iterator<Item = &AreaSample> {
        let is_lit = |place: usize| self.occluded[place / WORD] >> (place % WORD) & 1 == 0;
        self.asked
            .iter()
            .enumerate()
            .filter(move |&(place, _)| is_lit(place))
            .map(|(_, sample)| sample)
    }

    /// Returns how many samples reach the point.
    pub fn lit_count(&self) -> u32 {
        let occluded: u32 = self.occluded.iter().map(|word| word.count_ones()).sum();
        self.asked.len() as u32 - occluded
    }

    /// Returns the visible fraction: lit samples over all samples, 0 to 1.
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.lit_count()) / f64::from(self.total.max(1))
    }
}

impl ShadowIndex {
    /// Answers which samples of a light with size reach a start. `point` is the number of the receiver point, which
    /// chooses its samples: points with numbers of their own have samples of their own.
    ///
    /// Takes at most about as long as a shadow query for each sample that is asked; less where something is known of the whole
    /// light, as [`ShadowIndex::occluded_samples_of`] says.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Counters, LightSamples, LightSampling, ReceiverSide, ShadowIndex};
    /// # use antumbra_geometry::{
    /// #     AreaShape, DVec3, Occluders, Opacity, RectangleLight, Sphere, ReceiverPoint, SurfaceId
    /// # };
    /// # let mut builder = Occluders::builder();
    /// # let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    /// # builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
    /// # let ball = Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 1.0 };
    /// # builder.add_sphere(ball, Opacity::Opaque)?;
    /// // A ball over a floor, and a lamp of 6 x 1 above that shines down.
    /// let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new()).build()?;
    /// let edges = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(6.0, 0.0, 0.0)];
    /// let lamp = RectangleLight::new(DVec3::new(0.0, 0.0, 4.0), edges, false)?;
    /// let lamp = AreaShape::Rectangle(lamp);
    ///
    /// let start = ReceiverPoint { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
    /// let mut samples = LightSamples::default();
    /// let (side, sampling) = (ReceiverSide::Front, LightSampling::new(64));
    /// let mut counters = Counters::default();
    /// index.sample_light(&start, side, &lamp, 0, &sampling, &mut samples, &mut counters)?;
    /// // The ball hides the middle of the lamp, and both ends look past it.
    /// assert!(samples.visible_fraction() > 0.1 && samples.visible_fraction() < 0.3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The start is not finite or beyond 2^100, or its surface does not exist.
    #[expect(
        clippy::too_many_arguments,
        reason = "each changes from call to call on its own"
    )]
    pub fn sample_light(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &AreaShape,
        point: u64,
        sampling: &LightSampling,
        samples: &mut LightSamples,
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        self.check_start(start)?;
        samples.total = sampling.count();
        samples.asked.clear();
        samples.targets.clear();
        let sample = |place| light.sample(start.point, place);
        self.each_sample(start, side, (point, sampling), sample, |sample| {
            if let Some(sample) = sample {
                samples.targets.push(sample.target);
                samples.asked.push(sample);
            }
        });
        samples.occluded.clear();
        samples
            .occluded
            .resize(samples.targets.len().div_ceil(WORD), 0);
        let LightSamples {
            targets, occluded, ..
        } = samples;
        self.occluded_samples(start, side, light, targets, occluded, counters);
        Ok(())
    }

    /// Visits all samples of a start with a number; `None` for those that are not asked.
    fn each_sample(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        (point, sampling): (u64, &LightSampling),
        sample: impl Fn([f64; 2]) -> Option<AreaSample>,
        mut visit: impl FnMut(Option<AreaSample>),
    ) {
        let pattern = SamplePattern {
            seed: sampling.seed,
        };
        let scramble = pattern.scramble(point, sampling.light);
        let is_seen = |target: &LightShape| match side {
            ReceiverSide::Both => true,
            ReceiverSide::Normal(normal) => target.side_of(start.point, normal) > 0,
            ReceiverSide::Front | ReceiverSide::Back if start.surface.is_none() => true,
            ReceiverSide::Front => self.occluders().light_side(start, target) > 0,
            ReceiverSide::Back => self.occluders().light_side(start, target) < 0,
        };
        for number in 0..sampling.count() {
            let place = SamplePattern::place(scramble, number);
            visit(sample(place).filter(|sample| is_seen(&sample.target)));
        }
    }

    /// Writes the visible fraction of a light for every point of a batch, 0 to 1. The number of a point is its
    /// row. Points mean starts as for [`ShadowIndex::occluded`]; those with normals that face see what is on
    /// the normal's side, whatever `side` says.
    ///
    /// Runs on all threads of the current rayon pool. Fractions and errors do not depend on them.
    ///
    /// # Errors
    /// Lengths do not fit, or a point has no answer; of several the first is named. `fractions` may be
    /// written in parts then.
    pub fn visible_fractions<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        light: &AreaShape,
        sampling: &LightSampling,
        fractions: &mut [f32],
    ) -> Result<BatchCounters, BatchError> {
        if self
            .whole_lights()
            .is_some_and(|whole| whole.view(light).is_some())
        {
            return self.lit_shares_of_whole(batch, side, light, sampling, fractions);
        }
        let sampler = |_: usize, start: &ReceiverPoint| {
            let point = start.point;
            move |place| light.sample(point, place)
        };
        self.lit_shares(batch, side, sampling, sampler, fractions)
    }

    /// Writes for every point of a batch how many of its samples are lit, over all of them. The sampler makes what
    /// gives a row's samples.
    fn lit_shares<P: Coordinates, S: Fn([f64; 2]) -> Option<AreaSample>>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        sampling: &LightSampling,
        sampler: impl Fn(usize, &ReceiverPoint) -> S + Sync,
        fractions: &mut [f32],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        check_length("fractions", batch.points.len(), fractions.len())?;
        let per_start = sampling.count() as usize;
        let length = (CHUNK_SAMPLES / per_start).clamp(1, CHUNK_POINTS);
        let task = antumbra_task::current();
        let answer = |first: usize, fractions: &mut [f32], buffers: &mut Buffers| {
            buffers.clear();
            let mut counted = BatchCounters::default();
            for row in first..first + fractions.len() {
                antumbra_task::check();
                let start = run.start(row)?;
                let side = match batch.kind {
                    BatchKind::Facing { normals } => ReceiverSide::Normal(normals[row].as_f64()),
                    _ => side,
                };
                let mut asked = 0;
                let numbered = (row as u64, sampling);
                self.each_sample(&start, side, numbered, sampler(row, &start), |sample| {
                    asked += u32::from(sample.is_some());
                    // A zero direction stands for what is not asked: nothing blocks it.
                    let nowhere = LightShape::Direction(DVec3::ZERO);
                    let target = sample.map_or(nowhere, |sample| sample.target);
                    buffers.targets.push(target);
                });
                buffers.starts.push(start);
                buffers.asked.push(asked);
                counted.facing_away += per_start as u64 - u64::from(asked);
            }
            let stride = per_start.div_ceil(WORD);
            buffers.occluded.resize(stride * fractions.len(), 0);
            let targets = Targets::Each {
                targets: &buffers.targets,
                per_start,
            };
            self.occluded_targets_of(
                &buffers.starts,
                targets,
                &mut buffers.occluded,
                &mut counted.counters,
            )
            .expect("what was checked has answers");
            let words = buffers.occluded.chunks(stride);
            for ((fraction, &asked), words) in fractions.iter_mut().zip(&buffers.asked).zip(words) {
                let occluded: u32 = words.iter().map(|word| word.count_ones()).sum();
                *fraction = (f64::from(asked - occluded) / per_start as f64) as f32;
            }
            Ok(counted)
        };
        let counted: Vec<Result<BatchCounters, BatchError>> = fractions
            .par_chunks_mut(length)
            .enumerate()
            .map_init(Buffers::default, |buffers, (number, fractions)| {
                task.enter(|| answer(number * length, fractions, buffers))
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

/// What a thread works with.
#[derive(Default)]
struct Buffers {
    starts: Vec<ReceiverPoint>,
    asked: Vec<u32>,
    targets: Vec<LightShape>,
    occluded: Vec<u64>,
}

impl Buffers {
    fn clear(&mut self) {
        self.starts.clear();
        self.asked.clear();
        self.targets.clear();
        self.occluded.clear();
    }
}
