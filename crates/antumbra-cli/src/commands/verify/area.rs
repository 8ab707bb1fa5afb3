//! Lights with size: samples and exact fractions of every method against the judge's.
//!
//! In: starts, the scene's lights with size. Out: how many samples and fractions there were, and which differ. The judge
//! asks a ray for every sample: of the reference, or of the tree.

use antumbra::{Counters, LightSamples, LightSampling, Method, ReceiverSide, ShadowIndex};
use antumbra_geometry::{AreaSample, LightShape, ReceiverPoint};
use antumbra_scene::model::AreaLight;
use rayon::prelude::*;

use super::candidate::{Candidate, VALID};
use super::starts;
use super::surfaces::Surfaces;
use crate::screen::Screen;
use crate::typed::Against;

/// Samples of a light for each start: a word.
const SAMPLES: u32 = 64;

/// Differences that are printed.
const MOST_TOLD: usize = 10;

/// What was found.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) samples: u64,
    pub(super) fractions: u64,
    pub(super) differences: u64,
    told: Vec<String>,
}

/// Who is asked about what.
pub(super) struct Comparison<'a> {
    pub(super) against: Against,
    pub(super) seed: u64,
    pub(super) lights: &'a [AreaLight],
    pub(super) surfaces: &'a Surfaces<'a>,
    pub(super) judge: &'a ShadowIndex,
    pub(super) candidates: &'a [Candidate],
}

impl Comparison<'_> {
    /// Compares about so many samples; lights take turns.
    pub(super) fn run(&self, sample_count: u64, screen: &Screen) -> Found {
        let count = sample_count.div_ceil(u64::from(SAMPLES));
        let bar = screen.progress(count, "comparing lights with size");
        let task = antumbra_task::current();
        let found = (0..count)
            .into_par_iter()
            .fold(Found::default, |mut found, number| {
                task.enter(|| {
                    antumbra_task::check();
                    self.ask(number, &mut found);
                });
                bar.inc(1);
                found
            })
            .reduce(Found::default, Found::with);
        bar.finish_and_clear();
        for told in &found.told {
            screen.result(told);
        }
        found
    }

    fn ask(&self, number: u64, found: &mut Found) {
        let light_count = self.lights.len() as u64;
        let light = (number % light_count) as usize;
        let start = starts::start(number / light_count, self.seed, self.surfaces);
        let side = match number / light_count % 3 {
            0 => ReceiverSide::Front,
            1 => ReceiverSide::Back,
            _ => ReceiverSide::Both,
        };
        let shape = &self.lights[light].shape;
        let sampling = LightSampling {
            samples: SAMPLES,
            seed: self.seed,
            light: light as u64,
        };
        let mut samples = LightSamples::default();
        let counters = &mut Counters::default();
        let mut bits = |index: &ShadowIndex| {
            let asked = index.sample_light(
                &start,
                side,
                shape,
                number,
                &sampling,
                &mut samples,
                counters,
            );
            asked.expect(VALID);
            let targets: Vec<LightShape> = samples.queried().iter().map(target).collect();
            let lit: Vec<LightShape> = samples.lit().map(target).collect();
            (targets, lit)
        };
        let exact = |index: &ShadowIndex| {
            let found = index.exact_fraction(&start, side, shape, &mut Counters::default());
            found.expect(VALID)
        };
        let (targets, _) = bits(self.judge);
        let expected = self.expected(&start, &targets);
        let expected_share = exact(self.judge);
        for Candidate {
            name,
            index,
            stand_in,
            ..
        } in self.candidates
        {
            if stand_in.is_some() {
                continue;
            }
            let (asked, lit) = bits(index);
            found.samples += asked.len() as u64;
            if asked != targets || lit != expected {
                found.differ(format!(
                    "light {light} ({}), query {number}, {}: {} of {} samples lit, expected {}; {start:?}",
                    shape.kind(),
                    name,
                    lit.len(),
                    asked.len(),
                    expected.len()
                ));
            }
            found.fractions += u64::from(expected_share.is_some());
            let share = exact(index);
            if share != expected_share {
                found.differ(format!(
                    "light {light} ({}), query {number}, {}: exact fraction {share:?}, expected {expected_share:?}; {start:?}",
                    shape.kind(),
                    name
                ));
            }
        }
    }

    /// Returns the targets that the judge finds lit, by a ray each.
    fn expected(&self, start: &ReceiverPoint, targets: &[LightShape]) -> Vec<LightShape> {
        let mut words = vec![0; targets.len().div_ceil(64)];
        let counters = &mut Counters::default();
        let judge = self.judge;
        let asked = match self.against {
            // A method without a tree asks the reference about each.
            Against::Reference => judge.occluded_targets(start, targets, &mut words, counters),
            Against::Bvh => judge.occluded_targets_by_rays(start, targets, &mut words, counters),
        };
        asked.expect(VALID);
        let is_lit = |place: usize| words[place / 64] >> (place % 64) & 1 == 0;
        let places = (0..targets.len()).filter(|&place| is_lit(place));
        places.map(|place| targets[place]).collect()
    }
}

/// Returns the method that judges.
pub(super) fn judge_method(against: Against) -> Method {
    match against {
        Against::Reference => Method::Naive,
        Against::Bvh => Method::Bvh,
    }
}

fn target(sample: &AreaSample) -> LightShape {
    sample.target
}

impl Found {
    fn differ(&mut self, told: String) {
        self.differences += 1;
        if self.told.len() < MOST_TOLD {
            self.told.push(told);
        }
    }

    fn with(mut self, other: Self) -> Self {
        self.samples += other.samples;
        self.fractions += other.fractions;
        self.differences += other.differences;
        self.told.extend(other.told);
        self.told.truncate(MOST_TOLD);
        self
    }
}
