//! `antumbra-bench soft`: shadow rays to 64 samples of a light with a size.
//!
//! The starts are those of one frame. The light is a square around the scene's point light that faces the scene's
//! middle, or a sun disc around the direction of light from afar; it spans some angle seen from there. Samples are
//! jittered cells of 8 by 8, others for each start, in an order in which 16 in a row lie in one quarter of the
//! light, as packets like it. Starts are asked in the frame's order: once of an index that knows nothing, as it is by
//! default, and again and again of one that has made values of whatever they ask.

use std::path::Path;

use antumbra::{IndexOptions, Method, Refine};
use antumbra_baselines::embree::{Embree, EmbreeWay};
use antumbra_baselines::{LoadedBatch, LoadedSamples, LoadedTargets, TargetBatch, TargetWay};
use antumbra_geometry::{AreaShape, DVec3, LightShape, RectangleLight, SunDisc};
use antumbra_render::sampler::uniform;
use antumbra_scene::gather::light_shapes;
use serde::Serialize;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::screen::Screen;

use super::head::Head;
use super::measure::{self, Measured, Stopwatch, geometric_mean};
use super::record::{self, Aim};
use super::shadows::fastest;
use super::subject::{self, Subject};
use super::typed::Soft;

/// Samples a start.
const SAMPLES: usize = 64;

/// The least angle, which 0 stands for, in degrees.
const LEAST_DEGREES: f64 = 1e-6;

/// The reference tells of so many starts, evenly among all, whether the rays that all answers are compared with
/// are right.
const CHECKED_STARTS: usize = 24;

/// Result of one scene and one angle. Times are in nanoseconds per ray.
#[derive(Debug, Serialize)]
struct SceneReport {
    name: String,
    degrees: f64,
    starts: usize,
    /// Starts all of whose samples have one answer.
    uniform_share: f64,
    occluded_share: f64,
    /// After as many passes as it took to know what pays.
    ours_ns: f64,
    /// The first pass of all, with nothing known.
    cold_ns: f64,
    /// Seconds of the first pass, which made all values that it asked for, and bytes of these.
    preparation_s: f64,
    known_bytes: u64,
    /// By the walk of many targets, which knows nothing.
    walk_ns: Option<f64>,
    /// By a ray of ours a sample.
    rays_ns: Option<f64>,
    embree_ns: Option<f64>,
    embree8_ns: Option<f64>,
    embree16_ns: Option<f64>,
    embree_best_ns: Option<f64>,
    /// Points answered by a value for the whole light alone, and by a list of what may block.
    by_value_share: f64,
    by_list_share: f64,
    /// Bits of ours that are not those of single rays, or not the reference's where it was asked.
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

/// Measures all scenes, then reports.
pub(super) fn run(typed: &Soft, screen: &Screen) -> Result<Outcome, Failure> {
    typed.subjects.timed.run(|| work(typed, screen))?
}

fn work(typed: &Soft, screen: &Screen) -> Result<Outcome, Failure> {
    if let Some(degrees) = typed.degrees.iter().find(|d| !(0.0..=90.0).contains(*d)) {
        return Err(Failure::input(
            format!("a light cannot span {degrees} degrees"),
            "give --degrees numbers from 0 to 90",
        ));
    }
    let (stopwatch, embree, head) =
        subject::begin(&typed.subjects.timed, typed.rounds, typed.size, screen);
    let mut report = Report {
        head,
        scenes: Vec::new(),
    };
    for path in &typed.subjects.scenes {
        scene(path, typed, embree.as_ref(), stopwatch, screen, &mut report)?;
    }
    screen.result(means(&report.scenes));
    typed.subjects.figures.write(&report)?;
    let is_clean = report.scenes.iter().all(|scene| scene.mismatches == 0);
    Ok(if is_clean {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// Measures one scene under lights of all angles.
fn scene(
    path: &Path,
    typed: &Soft,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
    screen: &Screen,
    report: &mut Report,
) -> Result<(), Failure> {
    let subject = Subject::load(path, &typed.subjects, typed.size, screen)?;
    let recorder = &subject.recorder;
    let recorded = record::frame(recorder, &subject.view(0, 1)?, 0, Aim::Middle).batch;
    let options = IndexOptions {
        method: Method::Auto,
        ..IndexOptions::default()
    };
    let gathered = recorder.gathered();
    let lights = light_shapes(&recorder.scene().lights);
    let mut index = options.build(gathered.occluders(), lights.clone())?;
    // Values of whatever was queried once.
    let warm_options = IndexOptions {
        refinement: antumbra::Refinement {
            refine: Refine::Queried,
            ..options.refinement
        },
        ..options
    };
    let mut warm = warm_options.build(gathered.occluders(), lights)?;
    let geometry = subject.geometry();
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    let middle = gathered.occluders().bounds().center();
    for &degrees in &typed.degrees {
        // No light has no size.
        let least = degrees.max(LEAST_DEGREES);
        let Some(light) = light_of(&recorded.light_shape, middle, least) else {
            return Err(Failure::input(
                format!("a light cannot span {degrees} degrees here"),
                "give --degrees other numbers",
            ));
        };
        // Each angle finds an index that knows nothing.
        index.forget_values();
        warm.forget_values();
        let targets = recorded
            .starts
            .iter()
            .enumerate()
            .flat_map(|(number, start)| {
                samples(&light, start.point, typed.subjects.seed, number as u64)
            });
        let batch = TargetBatch {
            starts: recorded.starts.clone(),
            normals: recorded.normals.clone(),
            targets: targets.collect(),
            per_start: SAMPLES,
        };
        let mut ways: Vec<(&str, Box<dyn LoadedBatch + '_>)> = vec![
            ("ours", Box::new(LoadedSamples::new(&warm, &batch, &light))),
            (
                "walk",
                Box::new(LoadedTargets::new(&index, &batch, TargetWay::Together)),
            ),
            (
                "rays",
                Box::new(LoadedTargets::new(&index, &batch, TargetWay::Rays)),
            ),
        ];
        if let Some((scene, _)) = &rival {
            for way in EmbreeWay::ALL {
                ways.push((way.name(), scene.load_targets(&batch, way)));
            }
        }
        let rays = LoadedTargets::new(&index, &batch, TargetWay::Rays);
        let is_chosen =
            |name: &str| typed.ways.is_empty() || typed.ways.iter().any(|way| way == name);
        ways.retain(|(name, _)| is_chosen(name));
        let found = measured(
            ([&index, &warm], &light),
            &batch,
            &rays,
            ways,
            typed.rounds,
            stopwatch,
        );
        let found = SceneReport {
            name: subject.name.clone(),
            degrees,
            ..found
        };
        screen.result(found.row());
        report.scenes.push(found);
    }
    Ok(())
}

/// Times all ways and compares their answers with those of single rays.
fn measured(
    ([index, warm], light): ([&antumbra::ShadowIndex; 2], &AreaShape),
    batch: &TargetBatch,
    rays: &LoadedTargets,
    ways: Vec<(&str, Box<dyn LoadedBatch + '_>)>,
    rounds: u32,
    stopwatch: Stopwatch,
) -> SceneReport {
    let count = batch.targets.len();
    let (names, loaded): (Vec<_>, Vec<_>) = ways.into_iter().unzip();
    let mut expected = vec![false; count];
    let mut found = vec![false; count];
    rays.answer(0, &mut expected);
    let differences = |bits: &[bool]| bits.iter().zip(&expected).filter(|(a, b)| a != b).count();
    let first = LoadedSamples::new(index, batch, light);
    let (_, cold) = stopwatch.time(|| first.answer(0, &mut found));
    let mut different = differences(&found) as u64;
    let ours = LoadedSamples::new(warm, batch, light);
    let (_, preparation) = stopwatch.time(|| ours.answer(0, &mut found));
    different = different.max(differences(&found) as u64);
    ours.take_decisions();
    ours.answer(0, &mut found);
    different = different.max(differences(&found) as u64);
    let decided = ours.take_decisions();
    let known_bytes = warm.whole_light_bytes();
    let all = measure::interleave(&loaded, &expected, rounds, stopwatch);
    let of = |name: &str| {
        let number = names.iter().position(|&other| other == name)?;
        Some(&all[number])
    };
    let best = fastest(EmbreeWay::ALL.map(|way| of(way.name())));
    let starts = expected.chunks(SAMPLES);
    let uniform = starts.filter(|bits| bits.iter().all(|bit| *bit == bits[0]));
    let share = |part: usize, of: usize| part as f64 / of.max(1) as f64;
    let median = |name| of(name).map(Measured::median_ns);
    SceneReport {
        name: String::new(),
        degrees: 0.0,
        starts: batch.starts.len(),
        uniform_share: share(uniform.count(), batch.starts.len()),
        occluded_share: share(expected.iter().filter(|&&bit| bit).count(), count),
        ours_ns: median("ours").unwrap_or(f64::NAN),
        cold_ns: cold.as_secs_f64() * 1e9 / count.max(1) as f64,
        preparation_s: preparation.as_secs_f64(),
        known_bytes,
        walk_ns: median("walk"),
        rays_ns: median("rays"),
        embree_ns: median("embree"),
        embree8_ns: median("embree8"),
        embree16_ns: median("embree16"),
        embree_best_ns: best.map(Measured::median_ns),
        by_value_share: decided.first_pass as f64 / count.max(1) as f64,
        by_list_share: decided.blocker_list as f64 / count.max(1) as f64,
        mismatches: of("ours").map_or(0, |ours| ours.differences).max(different)
            + wrong_by_reference(index, batch, &expected),
        embree_differences: best.map_or(0, |best| best.differences),
    }
}

/// Returns how many of some answers are not the reference's.
fn wrong_by_reference(
    index: &antumbra::ShadowIndex,
    batch: &TargetBatch,
    expected: &[bool],
) -> u64 {
    let occluders = index.occluders();
    let step = batch.starts.len().div_ceil(CHECKED_STARTS).max(1);
    let starts = batch.starts.iter().enumerate().step_by(step);
    let mut wrong = 0;
    for (number, start) in starts {
        // One sample of each quarter.
        for sample in (0..SAMPLES).step_by(SAMPLES / 4) {
            let query = number * SAMPLES + sample;
            let segment = occluders.segment(start, &batch.targets[query]);
            let is_blocked = occluders
                .surfaces()
                .any(|surface| occluders.blocks(surface, &segment));
            wrong += u64::from(is_blocked != expected[query]);
        }
    }
    wrong
}

/// Returns the light that spans an angle seen from a point: a square that faces it, or a sun disc.
fn light_of(light: &LightShape, seen_from: DVec3, degrees: f64) -> Option<AreaShape> {
    let towards = light.towards(seen_from);
    let middle = match *light {
        LightShape::Point(point) => point,
        LightShape::Direction(direction) => {
            return SunDisc::new(direction, degrees)
                .ok()
                .map(AreaShape::SunDisc);
        }
    };
    let side = 2.0 * towards.length() * libm::tan(0.5 * degrees.to_radians());
    let axis = if towards.x.abs() < 0.7 * towards.length() {
        DVec3::X
    } else {
        DVec3::Y
    };
    let u = towards.cross(axis).normalize_or_zero();
    let v = towards.cross(u).normalize_or_zero();
    let square = RectangleLight::new(middle, [side * u, side * v], true);
    square.ok().map(AreaShape::Rectangle)
}

/// Returns a start's samples: jittered cells of 8 by 8.
fn samples(
    light: &AreaShape,
    receiver: DVec3,
    seed: u64,
    start: u64,
) -> impl Iterator<Item = LightShape> {
    (0..SAMPLES as u64).map(move |sample| {
        let place = [0, 1].map(|axis: u64| {
            // Every other bit of the sample's number is one of the cell's along the axis.
            let cell = (0..3).fold(0, |cell, bit| {
                cell | (sample >> (2 * bit + axis) & 1) << bit
            });
            (cell as f64 + uniform(&[seed, start, sample, axis])) / 8.0
        });
        // A start in the plane of the light sees none of it: all are asked about nothing.
        let nowhere = LightShape::Direction(DVec3::ZERO);
        light
            .sample(receiver, place)
            .map_or(nowhere, |sample| sample.target)
    })
}

impl SceneReport {
    /// Returns it for people.
    fn row(&self) -> String {
        let by = |ns: Option<f64>| match ns {
            Some(ns) => format!("{ns:6.1} ns ({:5.2}x)", ns / self.ours_ns),
            None => "  none".to_owned(),
        };
        format!(
            "{:<16} {:>4} deg, {:3.0} % of {} starts uniform, {:3.0} % by value, {:3.0} % by list: ours {:6.1} ns a ray \
             (cold {:6.1}; made in {:.2} s, {:.1} MB), walk {}, single rays {}, Embree 1 {}, best {}, mismatches {}",
            self.name,
            self.degrees,
            100.0 * self.uniform_share,
            self.starts,
            100.0 * self.by_value_share,
            100.0 * self.by_list_share,
            self.ours_ns,
            self.cold_ns,
            self.preparation_s,
            self.known_bytes as f64 / 1e6,
            by(self.walk_ns),
            by(self.rays_ns),
            by(self.embree_ns),
            by(self.embree_best_ns),
            self.mismatches,
        )
    }
}

/// Returns the geometric means over all scenes and angles.
fn means(scenes: &[SceneReport]) -> String {
    let mean = |of: &dyn Fn(&SceneReport) -> Option<f64>| {
        geometric_mean(
            scenes
                .iter()
                .filter_map(|scene| Some(of(scene)? / scene.ours_ns)),
        )
    };
    format!(
        "geometric means over ours: the walk {:.2}, single rays {:.2}, Embree 1 {:.2}, Embree's fastest {:.2}",
        mean(&|scene| scene.walk_ns),
        mean(&|scene| scene.rays_ns),
        mean(&|scene| scene.embree_ns),
        mean(&|scene| scene.embree_best_ns),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_samples_in_a_row_lie_in_a_quarter() {
        let light = LightShape::Point(DVec3::new(0.0, 0.0, 10.0));
        let square = light_of(&light, DVec3::ZERO, 6.0).expect("a light");
        let reach = 10.0 * libm::tan(3.0_f64.to_radians());
        let of_start = |start| samples(&square, DVec3::ZERO, 1, start);
        let samples: Vec<DVec3> = of_start(7)
            .map(|sample| sample.homogeneous().0 - DVec3::new(0.0, 0.0, 10.0))
            .collect();
        assert_eq!(samples.len(), SAMPLES);
        for quarter in samples.chunks(16) {
            for axis in [0, 1] {
                assert!(
                    quarter
                        .iter()
                        .all(|at| at[axis].abs() <= reach && at.z == 0.0)
                );
                let sign = quarter[0][axis].signum();
                assert!(quarter.iter().all(|at| at[axis].signum() == sign));
            }
        }
        assert_ne!(
            samples,
            of_start(8)
                .map(|s| s.homogeneous().0 - DVec3::new(0.0, 0.0, 10.0))
                .collect::<Vec<_>>()
        );
    }
}
