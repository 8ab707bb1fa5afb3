//! `antumbra-bench lights`: which of many lights reach each point of a frame, in rooms.
//!
//! The scenes are those of `antumbra scene rooms`, with several numbers of lights. The points are what the pixels of one
//! frame show, and the lights asked about at a point are those in front of its surface. Ours is
//! `ShadowIndex::lights_visible_of` for all of them at once, with rows made before the rounds for
//! the points of jittered frames, and without. A pair is a
//! point and a light in front of it: all times are nanoseconds a pair. Embree gets the pairs alone, those of a point in a
//! row, and packets are filled across points.

use std::time::Instant;

use antumbra::{Batch, Counters, IndexOptions, Method, ReceiverSide, ShadowIndex};
use antumbra_baselines::embree::{Embree, EmbreeWay, Geometry};
use antumbra_baselines::{LoadedBatch, TargetBatch};
use antumbra_geometry::{DVec3, ReceiverPoint, SurfaceId};
use antumbra_render::camera::View;
use antumbra_render::prepare::Prepared;
use antumbra_scene::generate::rooms;
use serde::Serialize;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::screen::Screen;

use super::head::Head;
use super::measure::{self, Measured, SLICE, Stopwatch, Way};
use super::record::Aim;
use super::typed::Lights;
use super::{record, subject};

/// Points a call of ours.
const POINTS: usize = 1024;

/// The reference answers so many pairs, evenly among all.
const CHECKED_PAIRS: usize = 4096;

/// Result for one number of lights. Times are in nanoseconds per pair.
#[derive(Debug, Serialize)]
struct SceneReport {
    count: u32,
    points: usize,
    /// Pairs of a point and a light in front of its surface.
    pairs: usize,
    occluded_share: f64,
    /// With rows.
    ours_ns: f64,
    /// By beams, without anything known.
    beam_ns: f64,
    embree_ns: Option<f64>,
    embree8_ns: Option<f64>,
    embree16_ns: Option<f64>,
    embree_best_ns: Option<f64>,
    /// Pairs that a row answered.
    known_share: f64,
    rows: usize,
    /// Of all rows and what finds them.
    bytes: u64,
    /// Making the rows, in milliseconds on the wall.
    prepare_ms: f64,
    /// Bits of ours that are not those of beams, or not the reference's where it was asked.
    mismatches: u64,
    /// Bits of Embree's fastest way that are others.
    embree_differences: u64,
}

/// Everything that was measured.
#[derive(Debug, Serialize)]
struct Report {
    head: Head,
    scenes: Vec<SceneReport>,
}

/// Measures all numbers of lights, then reports.
pub(super) fn run(typed: &Lights, screen: &Screen) -> Result<Outcome, Failure> {
    typed.timed.run(|| work(typed, screen))?
}

fn work(typed: &Lights, screen: &Screen) -> Result<Outcome, Failure> {
    // Nothing is read. What may not be written to is told before anything is measured.
    typed.figures.outputs(None)?;
    let (stopwatch, embree, head) = subject::begin(&typed.timed, typed.rounds, typed.size, screen);
    let mut report = Report {
        head,
        scenes: Vec::new(),
    };
    for &count in &typed.counts {
        let found = scene(count, typed, embree.as_ref(), stopwatch)?;
        screen.result(found.row());
        report.scenes.push(found);
    }
    typed.figures.write(&report)?;
    let is_clean = report.scenes.iter().all(|scene| scene.mismatches == 0);
    Ok(if is_clean {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// Points and the lights in front of them.
struct Questions {
    starts: Vec<ReceiverPoint>,
    /// For each point the lights that reach it, in words.
    visible: Vec<u64>,
    stride: usize,
    /// For each pair whether the light is occluded, point after point.
    is_occluded: Vec<bool>,
    /// The pairs as starts with one target each.
    pairs: TargetBatch,
}

impl Questions {
    /// Asks an index about all lights in front of some points.
    fn new(index: &ShadowIndex, starts: Vec<ReceiverPoint>, normals: &[DVec3]) -> Self {
        let lights = index.lights();
        let stride = lights.len().div_ceil(64);
        let mut visible = vec![0; stride * starts.len()];
        ask(index, &starts, &mut visible);
        let mut pairs = TargetBatch {
            per_start: 1,
            ..TargetBatch::default()
        };
        let mut is_occluded = Vec::new();
        for (number, (start, &normal)) in starts.iter().zip(normals).enumerate() {
            for (light, shape) in lights.iter().enumerate() {
                if index.occluders().light_side(start, shape) > 0 {
                    pairs.starts.push(*start);
                    pairs.normals.push(normal);
                    pairs.targets.push(*shape);
                    let word = visible[number * stride + light / 64];
                    is_occluded.push(word >> (light % 64) & 1 == 0);
                }
            }
        }
        Self {
            starts,
            visible,
            stride,
            is_occluded,
            pairs,
        }
    }

    /// Asks an index about all lights at once and returns how many bits are not the expected ones.
    fn differences(&self, index: &ShadowIndex, words: &mut Vec<u64>) -> u64 {
        let mut differences = 0;
        let points = self.starts.chunks(POINTS);
        for (starts, expected) in points.zip(self.visible.chunks(POINTS * self.stride)) {
            words.resize(expected.len(), 0);
            ask(index, starts, words);
            let pairs = words.iter().zip(expected);
            differences += pairs
                .map(|(word, expected)| u64::from((word ^ expected).count_ones()))
                .sum::<u64>();
        }
        differences
    }

    /// Returns how many of some pairs the reference answers otherwise.
    fn wrong_by_reference(&self, index: &ShadowIndex) -> u64 {
        let occluders = index.occluders();
        let step = self.is_occluded.len().div_ceil(CHECKED_PAIRS).max(1);
        let is_wrong = |&pair: &usize| {
            let segment = occluders.segment(&self.pairs.starts[pair], &self.pairs.targets[pair]);
            let is_blocked = occluders
                .surfaces()
                .any(|surface| occluders.blocks(surface, &segment));
            is_blocked != self.is_occluded[pair]
        };
        let pairs = (0..self.is_occluded.len()).step_by(step);
        pairs.filter(is_wrong).count() as u64
    }
}

fn ask(index: &ShadowIndex, starts: &[ReceiverPoint], visible: &mut [u64]) -> Counters {
    let mut counters = Counters::default();
    index
        .lights_visible_of(starts, ReceiverSide::Front, visible, &mut counters)
        .expect("points that were hit have answers");
    counters
}

/// Measures rooms with so many lights.
fn scene(
    count: u32,
    typed: &Lights,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
) -> Result<SceneReport, Failure> {
    let scene = rooms(typed.rooms, count)
        .map_err(|error| Failure::input(error.to_string(), "give --rooms and --counts in range"))?;
    let camera = scene.camera.ok_or_else(|| {
        Failure::input("rooms have no camera", "this is a fault of the generator")
    })?;
    let view = View::new(&camera, typed.size)
        .map_err(|error| Failure::input(error.to_string(), "give --size in range"))?;
    let prepared = |method| -> Result<Prepared, Failure> {
        let options = IndexOptions {
            method,
            ..IndexOptions::default()
        };
        Ok(Prepared::new(scene.clone(), &options)?)
    };
    let (ours, plain) = (prepared(Method::Auto)?, prepared(Method::Bvh)?);
    let (ours_index, plain_index) = (ours.index(), plain.index());
    let (starts, normals) = record::seen(&plain, &view, camera.eye, Aim::Middle);
    let questions = Questions::new(plain_index, starts, &normals);
    let (mut rows, mut prepare_ms) = (0, 0.0);
    // Rows never come from the timed points.
    for frame in 0..typed.frames {
        let (others, _) = record::seen(&plain, &view, camera.eye, Aim::Jittered(frame.into()));
        let (made, ms) = make_rows(ours_index, &others)?;
        rows += made;
        prepare_ms += ms;
    }
    ours_index.set_refining(false);
    let mut words = vec![0; questions.visible.len()];
    let shadow = ask(ours_index, &questions.starts, &mut words).shadow;

    let geometry = Geometry::of(&scene, plain.gathered().occluders());
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    let (mut first, mut second) = (Vec::new(), Vec::new());
    let mut ways: Vec<Way<'_>> = vec![
        (
            "ours",
            Box::new(|| questions.differences(ours_index, &mut first)),
        ),
        (
            "beam",
            Box::new(|| questions.differences(plain_index, &mut second)),
        ),
    ];
    if let Some((scene, _)) = &rival {
        for (name, way) in [
            ("embree", EmbreeWay::Single),
            ("embree8", EmbreeWay::Packets8),
            ("embree16", EmbreeWay::Packets16),
        ] {
            let loaded = scene.load_targets(&questions.pairs, way);
            ways.push((name, by_embree(loaded, &questions.is_occluded, stopwatch)));
        }
    }
    let names: Vec<_> = ways.iter().map(|(name, _)| *name).collect();
    let all = measure::interleave_ways(
        &mut ways,
        questions.is_occluded.len(),
        typed.rounds,
        stopwatch,
    );
    drop(ways);
    let of = |name: &str| {
        let number = names.iter().position(|&other| other == name)?;
        Some(&all[number])
    };
    let median = |name| of(name).map(Measured::median_ns);
    let best = ["embree", "embree8", "embree16"]
        .into_iter()
        .filter_map(of)
        .min_by(|a, b| a.median_ns().total_cmp(&b.median_ns()));
    let differences = |name| of(name).map_or(0, |measured| measured.differences);
    let share = |part: u64, of: u64| part as f64 / of.max(1) as f64;
    let occluded = questions.is_occluded.iter().filter(|&&bit| bit).count();
    Ok(SceneReport {
        count,
        points: questions.starts.len(),
        pairs: questions.is_occluded.len(),
        occluded_share: share(occluded as u64, questions.is_occluded.len() as u64),
        ours_ns: median("ours").unwrap_or(f64::NAN),
        beam_ns: median("beam").unwrap_or(f64::NAN),
        embree_ns: median("embree"),
        embree8_ns: median("embree8"),
        embree16_ns: median("embree16"),
        embree_best_ns: best.map(Measured::median_ns),
        known_share: share(shadow.first_pass, shadow.first_pass + shadow.rays),
        rows,
        bytes: ours_index.row_bytes(),
        prepare_ms,
        mismatches: differences("ours").max(differences("beam"))
            + questions.wrong_by_reference(plain_index),
        embree_differences: best.map_or(0, |best| best.differences),
    })
}

/// Makes the rows of some points; returns how many, and the milliseconds that took.
fn make_rows(index: &ShadowIndex, starts: &[ReceiverPoint]) -> Result<(usize, f64), Failure> {
    let points: Vec<[f64; 3]> = starts.iter().map(|start| start.point.to_array()).collect();
    let surfaces: Vec<SurfaceId> = starts.iter().filter_map(|start| start.surface).collect();
    let begin = Instant::now();
    let rows = index
        .prepare_lights_visible(&Batch::on_surfaces(&points, &surfaces))
        .map_err(|error| Failure::system(error.to_string()))?;
    Ok((rows, begin.elapsed().as_secs_f64() * 1e3))
}

/// Wraps a loaded batch of Embree's.
fn by_embree<'a>(
    loaded: Box<dyn LoadedBatch + 'a>,
    expected: &'a [bool],
    stopwatch: Stopwatch,
) -> Box<dyn FnMut() -> u64 + 'a> {
    let mut found = vec![false; expected.len()];
    Box::new(move || {
        measure::count_differences(&*loaded, 0, expected, &mut found, SLICE, stopwatch)
    })
}

impl SceneReport {
    /// Returns it for people.
    fn row(&self) -> String {
        let by = |ns: Option<f64>| match ns {
            Some(ns) => format!("{ns:6.2} ns ({:5.2}x)", ns / self.ours_ns),
            None => "  none".to_owned(),
        };
        format!(
            "{:>5} lights, {} points, {:.1} lights in front of each, {:2.0} % occluded: ours {:6.2} ns a pair, beam {}, \
             Embree 1 {}, best {}; rows know {:.1} %, {} rows, {} kB, {:.0} ms; mismatches {}",
            self.count,
            self.points,
            self.pairs as f64 / self.points.max(1) as f64,
            100.0 * self.occluded_share,
            self.ours_ns,
            by(Some(self.beam_ns)),
            by(self.embree_ns),
            by(self.embree_best_ns),
            100.0 * self.known_share,
            self.rows,
            self.bytes / 1000,
            self.prepare_ms,
            self.mismatches,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra::LightId;
    use antumbra_geometry::LightShape;

    #[test]
    fn pairs_are_the_lights_in_front_and_answers_are_those_of_single_rays() {
        let scene = rooms(2, 70).expect("rooms");
        let camera = scene.camera.expect("a camera");
        let view = View::new(&camera, [24, 16]).expect("a view");
        let prepared = Prepared::new(scene, &IndexOptions::default()).expect("a scene");
        let (starts, normals) = record::seen(&prepared, &view, camera.eye, Aim::Middle);
        let index = prepared.index();
        let questions = Questions::new(index, starts, &normals);
        let pairs = questions.pairs.starts.iter().zip(&questions.pairs.targets);
        for ((start, target), &is_occluded) in pairs.zip(&questions.is_occluded) {
            assert!(index.occluders().light_side(start, target) > 0);
            let is_target = |light: &LightShape| light == target;
            let light = index.lights().iter().position(is_target).expect("a light");
            let answer = index
                .shadow_by_reference(start, LightId::from_index(light))
                .expect("an answer");
            assert_eq!(answer == antumbra::Shadow::Shadowed, is_occluded);
        }
        assert!(questions.is_occluded.contains(&true) && questions.is_occluded.contains(&false));
        let (rows, _) = make_rows(index, &questions.starts).expect("rows");
        assert!(rows > 10);
        assert_eq!(questions.differences(index, &mut Vec::new()), 0);
        assert_eq!(questions.wrong_by_reference(index), 0);
    }
}
