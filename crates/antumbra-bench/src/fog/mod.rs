//! `antumbra-bench fog`: what share of a view ray's way through the air a light reaches.
//!
//! Segments are those of eye rays from where they enter the scene's box to what they hit. Ours asks for the exact lit
//! intervals of each and adds their lengths. Rivals march: so many shadow rays from points at even distances, moved along by
//! a random share of a step; or so many look-ups in a shadow map, which is not exact. What errs least at a price is told by
//! the root mean square of the differences from a march of the exact rule in thousands of steps. Each of these steps is
//! compared with the intervals besides.
//!
//! | part | module |
//! |---|---|
//! | segments and places on them | `segments` |
//! | marches of shadow rays, and the exact one | `march` |
//! | a march through a shadow map | `map` |

mod map;
mod march;
mod segments;

use std::path::Path;

use antumbra::{IndexOptions, Method, Refine, ShadowIndex};
use antumbra_baselines::embree::{Embree, EmbreeScene};
use antumbra_baselines::{IndexMethod, ShadowMethod};
use antumbra_geometry::LightShape;
use antumbra_scene::gather::light_shapes;
use rayon::prelude::*;
use serde::Serialize;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::screen::Screen;

use super::head::Head;
use super::measure::{self, Measured, SLICE, Stopwatch, Way, geometric_mean};
use super::subject::{self, Subject};
use super::typed::Fog;
use map::Map;
use march::{March, Order};
use segments::Ends;

/// Embree's ways to march: single rays, and packets of points along a segment or of segments side by side.
const EMBREE: [&str; 5] = [
    "embree",
    "embree8",
    "embree16",
    "embree8_across",
    "embree16_across",
];

/// Result of one scene and one number of steps. Times are in nanoseconds per segment.
#[derive(Debug, Serialize)]
struct SceneReport {
    name: String,
    light: String,
    steps: u32,
    segments: usize,
    /// Of the segments' length.
    lit_share: f64,
    /// Lit intervals a segment.
    intervals: f64,
    ours_ns: f64,
    /// By a shadow ray a step.
    embree_march_ns: Option<f64>,
    embree8_march_ns: Option<f64>,
    embree16_march_ns: Option<f64>,
    /// By packets of neighbouring segments' rays.
    embree8_across_ns: Option<f64>,
    embree16_across_ns: Option<f64>,
    embree_best_march_ns: Option<f64>,
    /// By our own rays, which know nothing.
    own_march_ns: f64,
    /// By `auto` with what it has learnt of these very points.
    auto_march_ns: f64,
    /// By a shadow map, which is not exact.
    map_march_ns: f64,
    rms: Errors,
    reference_steps: u32,
    /// Steps of the reference that are not as our intervals have them.
    mismatches: u64,
    /// Steps of the reference at an interval's very end, which the rule beside it decided.
    at_ends: u64,
    /// Answers of our own rays and of `auto` that are not the reference's, and changes of ours.
    march_mismatches: u64,
    /// Steps of Embree's fastest way that are not the reference's.
    embree_differences: u64,
}

/// Root mean squares of what lit shares of segments differ from those of the reference.
#[derive(Clone, Copy, Debug, Serialize)]
struct Errors {
    /// Of a march of exact answers.
    march: f64,
    map: f64,
    /// Of our lit intervals, whose difference is the reference's own error.
    ours: f64,
}

/// Everything that was measured.
#[derive(Debug, Serialize)]
struct Report {
    head: Head,
    scenes: Vec<SceneReport>,
}

/// Measures all scenes, then reports.
pub(super) fn run(typed: &Fog, screen: &Screen) -> Result<Outcome, Failure> {
    typed.subjects.timed.run(|| work(typed, screen))?
}

fn work(typed: &Fog, screen: &Screen) -> Result<Outcome, Failure> {
    let (stopwatch, embree, head) =
        subject::begin(&typed.subjects.timed, typed.rounds, typed.size, screen);
    let mut report = Report {
        head,
        scenes: Vec::new(),
    };
    for path in &typed.subjects.scenes {
        scene(path, typed, embree.as_ref(), stopwatch, screen, &mut report)?;
    }
    for &steps in &typed.steps {
        screen.result(means(&report.scenes, steps));
    }
    typed.subjects.figures.write(&report)?;
    let is_clean = |scene: &SceneReport| scene.mismatches + scene.march_mismatches == 0;
    Ok(if report.scenes.iter().all(is_clean) {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// The segments of a scene, and what is known of them.
struct Questions<'a> {
    index: &'a ShadowIndex,
    light: LightShape,
    segments: Vec<Ends>,
    /// Our lit intervals of each.
    intervals: Vec<Vec<[f64; 2]>>,
}

impl<'a> Questions<'a> {
    /// Of a scene without holes: their shadows have no closed form.
    fn new(index: &'a ShadowIndex, segments: Vec<Ends>) -> Self {
        let light = index.lights()[0];
        let ask = |ends: &Ends| index.lit_intervals_along(ends[0], ends[1], &light);
        let answered = segments.par_iter().map(ask);
        let intervals = answered.map(|found| found.expect("holes are filled"));
        let intervals = intervals.collect();
        Self {
            index,
            light,
            segments,
            intervals,
        }
    }

    /// Returns what share of a segment is lit.
    fn lit_share(&self, segment: usize) -> f64 {
        length(&self.intervals[segment])
    }

    /// Asks anew and returns how many segments have another lit share than before.
    fn differences(&self, stopwatch: Stopwatch) -> u64 {
        let differs = |segment: usize| {
            let [origin, end] = self.segments[segment];
            let found = self.index.lit_intervals_along(origin, end, &self.light);
            u64::from(found.map_or(f64::NAN, |found| length(&found)) != self.lit_share(segment))
        };
        on_all(self.segments.len(), differs, stopwatch)
    }
}

/// Returns the length of some intervals.
fn length(intervals: &[[f64; 2]]) -> f64 {
    intervals.iter().map(|[begin, end]| end - begin).sum()
}

/// Adds what each of some numbers gives, on this thread where one is measured.
fn on_all(count: usize, of: impl Fn(usize) -> u64 + Sync + Send, stopwatch: Stopwatch) -> u64 {
    if stopwatch.is_one_thread() {
        (0..count).map(of).sum()
    } else {
        (0..count).into_par_iter().map(of).sum()
    }
}

/// Measures one scene with all numbers of steps.
fn scene(
    path: &Path,
    typed: &Fog,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
    screen: &Screen,
    report: &mut Report,
) -> Result<(), Failure> {
    let subject = Subject::load(path, &typed.subjects, typed.size, screen)?;
    let recorder = &subject.recorder;
    let seed = typed.subjects.seed;
    let all = segments::of_frame(recorder, &subject.view(0, 1)?, typed.tiles, seed);
    let build = |method| {
        let options = IndexOptions {
            method,
            refinement: typed.subjects.cost.refinement(Refine::Lazy),
            ..IndexOptions::default()
        };
        let lights = light_shapes(&recorder.scene().lights);
        options.build(recorder.gathered().occluders(), lights)
    };
    let auto = IndexMethod::new("auto", build(Method::Auto)?);
    let own = IndexMethod::new("own", build(Method::Bvh)?);
    let questions = Questions::new(auto.index(), all);
    if questions.segments.is_empty() {
        return Err(Failure::input(
            format!("{}: no segment has an answer", path.display()),
            "give a camera that sees some of it",
        ));
    }
    let geometry = subject.geometry();
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    let rival = rival.as_ref().map(|(scene, _)| scene);
    let reference = march::reference(
        own.index(),
        &questions.segments,
        &questions.intervals,
        typed.reference,
    );
    screen.detail(format!("{}: reference marched", path.display()));
    let most_steps = typed.steps.iter().copied().max().unwrap_or(1);
    let points = questions.segments.iter().enumerate();
    let points = points.flat_map(|(number, &ends)| {
        segments::jittered(ends, number, most_steps, seed).map(|start| start.point)
    });
    let map = Map::new(recorder, &questions.light, points);
    screen.detail(format!("{}: shadow map drawn", path.display()));
    for &steps in &typed.steps {
        let contest = Contest {
            questions: &questions,
            along: March::new(own.index(), &questions.segments, steps, seed, Order::Along),
            across: March::new(own.index(), &questions.segments, steps, seed, Order::Across),
            map: &map,
            steps,
            seed,
        };
        let found = SceneReport {
            name: subject.name.clone(),
            light: subject.light(),
            reference_steps: typed.reference,
            mismatches: reference.mismatches,
            at_ends: reference.at_ends,
            ..contest.held(
                [&own, &auto],
                rival,
                &reference.lit_shares,
                typed.rounds,
                stopwatch,
            )
        };
        screen.result(found.row());
        report.scenes.push(found);
    }
    Ok(())
}

/// All that answer the same segments.
struct Contest<'a> {
    questions: &'a Questions<'a>,
    along: March,
    across: March,
    map: &'a Map,
    steps: u32,
    seed: u64,
}

impl Contest<'_> {
    /// Returns how many steps of a segment the map calls lit.
    fn lit_by_map(&self, segment: usize) -> u32 {
        let shift = segments::shift(segment, self.steps, self.seed);
        let ends = self.questions.segments[segment];
        self.map.lit_steps(ends, self.steps, shift)
    }

    /// Times all, and compares their answers.
    fn held(
        &self,
        [own, auto]: [&IndexMethod; 2],
        rival: Option<&EmbreeScene>,
        reference: &[f64],
        rounds: u32,
        stopwatch: Stopwatch,
    ) -> SceneReport {
        let count = self.questions.segments.len();
        let by_map: Vec<u32> = (0..count).map(|segment| self.lit_by_map(segment)).collect();
        let mut ways: Vec<Way<'_>> = vec![
            ("ours", Box::new(|| self.questions.differences(stopwatch))),
            (
                "map",
                Box::new(|| {
                    let differs = |segment| u64::from(self.lit_by_map(segment) != by_map[segment]);
                    on_all(count, differs, stopwatch)
                }),
            ),
        ];
        let methods = rival.map(EmbreeScene::methods);
        let mut marches: Vec<(&'static str, &dyn ShadowMethod, &March)> =
            vec![("own", own, &self.along), ("auto", auto, &self.along)];
        for method in methods.iter().flatten() {
            let (along, across) = match method.name() {
                "embree8" => ("embree8", Some("embree8_across")),
                "embree16" => ("embree16", Some("embree16_across")),
                _ => ("embree", None),
            };
            marches.push((along, method, &self.along));
            marches
                .extend(across.map(|across| (across, method as &dyn ShadowMethod, &self.across)));
        }
        for (name, method, march) in marches {
            let loaded = method.load(&march.batch);
            let mut found = vec![false; march.is_shadowed.len()];
            let answer = move || {
                let expected = &march.is_shadowed;
                measure::count_differences(&*loaded, 0, expected, &mut found, SLICE, stopwatch)
            };
            ways.push((name, Box::new(answer)));
        }
        let names: Vec<_> = ways.iter().map(|(name, _)| *name).collect();
        let all = measure::interleave_ways(&mut ways, count, rounds, stopwatch);
        drop(ways);
        let of = |name: &str| {
            let number = names.iter().position(|&other| other == name)?;
            Some(&all[number])
        };
        let median = |name| of(name).map(Measured::median_ns);
        let of_ours = |name| median(name).unwrap_or(f64::NAN);
        let best = EMBREE.into_iter().filter_map(of);
        let best = best.min_by(|a, b| a.median_ns().total_cmp(&b.median_ns()));
        let differences = |name| of(name).map_or(0, |measured| measured.differences);
        let ours: Vec<f64> = (0..count)
            .map(|segment| self.questions.lit_share(segment))
            .collect();
        let by_map = by_map
            .iter()
            .map(|&lit| f64::from(lit) / f64::from(self.steps));
        let lengths = self
            .questions
            .segments
            .iter()
            .map(|[from, to]| (*to - *from).length());
        let lit_lengths = lengths
            .clone()
            .zip(&ours)
            .map(|(length, share)| length * share);
        let intervals: usize = self.questions.intervals.iter().map(Vec::len).sum();
        SceneReport {
            name: String::new(),
            light: String::new(),
            steps: self.steps,
            segments: count,
            lit_share: lit_lengths.sum::<f64>() / lengths.sum::<f64>(),
            intervals: intervals as f64 / count as f64,
            ours_ns: of_ours("ours"),
            embree_march_ns: median("embree"),
            embree8_march_ns: median("embree8"),
            embree16_march_ns: median("embree16"),
            embree8_across_ns: median("embree8_across"),
            embree16_across_ns: median("embree16_across"),
            embree_best_march_ns: best.map(Measured::median_ns),
            own_march_ns: of_ours("own"),
            auto_march_ns: of_ours("auto"),
            map_march_ns: of_ours("map"),
            rms: Errors {
                march: rms(self.along.lit_shares(), reference),
                map: rms(by_map, reference),
                ours: rms(ours.iter().copied(), reference),
            },
            reference_steps: 0,
            mismatches: 0,
            at_ends: 0,
            march_mismatches: differences("ours") + differences("own") + differences("auto"),
            embree_differences: best.map_or(0, |best| best.differences),
        }
    }
}

/// Returns the root mean square of differences.
fn rms(found: impl IntoIterator<Item = f64>, expected: &[f64]) -> f64 {
    let squares = found
        .into_iter()
        .zip(expected)
        .map(|(a, b)| (a - b) * (a - b));
    libm::sqrt(squares.sum::<f64>() / expected.len().max(1) as f64)
}

impl SceneReport {
    /// Returns it for people.
    fn row(&self) -> String {
        let by = |ns: Option<f64>| match ns {
            Some(ns) => format!("{:6.2} us ({:6.2}x)", ns / 1e3, ns / self.ours_ns),
            None => "  none".to_owned(),
        };
        format!(
            "{:<16} {:>4} steps, {} segments, {:3.0} % lit in {:5.2} intervals each: ours {:6.2} us a segment \
             (rms {:.1e}); marches (rms {:.1e}): Embree 1 {}, best {}, own rays {}, auto {}; shadow map, not exact, {} \
             (rms {:.1e}); mismatches {} ({} at ends), of marches {}, Embree's {}",
            self.name,
            self.steps,
            self.segments,
            100.0 * self.lit_share,
            self.intervals,
            self.ours_ns / 1e3,
            self.rms.ours,
            self.rms.march,
            by(self.embree_march_ns),
            by(self.embree_best_march_ns),
            by(Some(self.own_march_ns)),
            by(Some(self.auto_march_ns)),
            by(Some(self.map_march_ns)),
            self.rms.map,
            self.mismatches,
            self.at_ends,
            self.march_mismatches,
            self.embree_differences,
        )
    }
}

/// Returns the geometric means over all scenes with so many steps.
fn means(scenes: &[SceneReport], steps: u32) -> String {
    let mean = |of: &dyn Fn(&SceneReport) -> Option<f64>| {
        let scenes = scenes.iter().filter(|scene| scene.steps == steps);
        geometric_mean(scenes.filter_map(|scene| Some(of(scene)? / scene.ours_ns)))
    };
    format!(
        "geometric means over ours, {steps} steps: Embree 1 {:.2}, Embree's fastest {:.2}, own rays {:.2}, auto {:.2}, \
         shadow map {:.2}",
        mean(&|scene| scene.embree_march_ns),
        mean(&|scene| scene.embree_best_march_ns),
        mean(&|scene| Some(scene.own_march_ns)),
        mean(&|scene| Some(scene.auto_march_ns)),
        mean(&|scene| Some(scene.map_march_ns)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_render::camera::View;
    use antumbra_render::prepare::Prepared;

    fn questions(prepared: &Prepared) -> Questions<'_> {
        let camera = prepared.scene().camera.expect("a camera");
        let view = View::new(&camera, [64, 64]).expect("a view");
        Questions::new(prepared.index(), segments::of_frame(prepared, &view, 12, 3))
    }

    fn lit_shares(questions: &Questions<'_>) -> Vec<f64> {
        let segments = 0..questions.segments.len();
        segments
            .map(|segment| questions.lit_share(segment))
            .collect()
    }

    #[test]
    fn the_reference_agrees_with_intervals_and_tells_of_others() {
        let mut scene = antumbra_scene::generate::city(60).expect("a city");
        scene.lights.truncate(1);
        let prepared = Prepared::new(scene, &IndexOptions::default()).expect("a scene");
        let questions = questions(&prepared);
        let reference = |intervals: &[Vec<[f64; 2]>]| {
            march::reference(prepared.index(), &questions.segments, intervals, 256)
        };
        let found = reference(&questions.intervals);
        assert_eq!(found.mismatches, 0);
        let shares = lit_shares(&questions);
        assert!(rms(shares.iter().copied(), &found.lit_shares) < 0.004);
        let marched = |steps, order| {
            March::new(prepared.index(), &questions.segments, steps, 0, order).lit_shares()
        };
        let coarse = rms(marched(8, Order::Along), &shares);
        let fine = rms(marched(64, Order::Along), &shares);
        assert!(fine < 0.3 * coarse && coarse < 0.1, "{fine} {coarse}");
        assert_eq!(marched(8, Order::Along), marched(8, Order::Across));
        // A step wrong in one interval is found.
        let mut wrong = questions.intervals.clone();
        let segment = wrong
            .iter()
            .position(|intervals| intervals.len() > 1)
            .expect("a shadow in the air");
        wrong[segment][0][1] = (wrong[segment][0][1] - 0.005).max(0.0);
        assert!((1..4).contains(&reference(&wrong).mismatches));
    }

    #[test]
    fn a_shadow_map_is_nearly_right() {
        let mut scene = antumbra_scene::generate::city(20).expect("a city");
        scene.lights.truncate(1);
        let prepared = Prepared::new(scene, &IndexOptions::default()).expect("a scene");
        let questions = questions(&prepared);
        let points = questions.segments.as_flattened().iter().copied();
        let map = Map::new(&prepared, &questions.light, points);
        let shares = lit_shares(&questions);
        let by_map = questions
            .segments
            .iter()
            .map(|&ends| map.lit_steps(ends, 256, 0.5));
        let by_map = by_map.map(|lit| f64::from(lit) / 256.0);
        assert!(shares.iter().any(|&share| share < 0.9));
        assert!(rms(by_map, &shares) < 0.02);
    }
}
