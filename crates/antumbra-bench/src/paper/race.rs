//! All methods on one scene, in interleaved rounds.

use std::collections::BTreeMap;
use std::time::Duration;

use antumbra_render::film::Picture;
use antumbra_render::image_file::srgb_bytes;
use antumbra_render::integrator::Tally;
use antumbra_task::Steps;

use super::figures::{MethodFigures, QuickCheckFigures, SceneFigures};
use super::scenes::PaperScene;
use super::shot::{Shot, Subject};
use super::{GRID, METHODS, VOXEL, VOXEL_1990};
use crate::contender::Contender;
use crate::measure::{Measured, Stopwatch, median};
use crate::typed::Paper;
use antumbra_cli::failure::Failure;

/// What the rounds found about one method.
#[derive(Default)]
struct Runner {
    total_s: Vec<f64>,
    prepare_s: Vec<f64>,
    render_s: Vec<f64>,
    second_s: Vec<f64>,
    first: Option<Shot>,
    second: Option<Shot>,
}

/// Returns how many pictures, or pairs of them, [`run`] takes of a scene.
pub(super) fn picture_count(typed: &Paper) -> u64 {
    u64::from(typed.rounds) * (1 + METHODS.len() as u64)
}

/// Measures one scene; each picture is a step.
pub(super) fn run(
    paper_scene: &PaperScene,
    typed: &Paper,
    stopwatch: Stopwatch,
    steps: &Steps,
) -> Result<SceneFigures, Failure> {
    let grid = paper_scene.paper.grid;
    let subject = Subject::new(paper_scene.make()?, typed.size, grid)?;
    let dark = subject.without_lights();
    let mut dark_s = Vec::new();
    let mut runners: Vec<Runner> = METHODS.iter().map(|_| Runner::default()).collect();
    let mut expected = None;
    let mut different_pictures = 0;
    for round in 0..typed.rounds as usize {
        let (shot, _) = steps.step(|| dark.shoot(GRID, false, stopwatch))?;
        dark_s.push(shot.total().as_secs_f64());
        for turn in 0..METHODS.len() {
            let number = (round + turn) % METHODS.len();
            let method = METHODS[number];
            let learns = method == VOXEL;
            let (first, second) = steps.step(|| subject.shoot(method, learns, stopwatch))?;
            for shot in [Some(&first), second.as_ref()].into_iter().flatten() {
                let bytes = bytes(&shot.picture);
                let expected = expected.get_or_insert_with(|| bytes.clone());
                different_pictures += u32::from(*expected != bytes);
            }
            let runner = &mut runners[number];
            runner.total_s.push(first.total().as_secs_f64());
            runner.prepare_s.push(first.prepare.as_secs_f64());
            runner.render_s.push(first.render.as_secs_f64());
            let second_s = second.as_ref().map(|shot| shot.render.as_secs_f64());
            runner.second_s.extend(second_s);
            runner.first.get_or_insert(first);
            runner.second = runner.second.take().or(second);
        }
    }

    let dark_s = median(dark_s.into_iter());
    let methods: BTreeMap<String, MethodFigures> = METHODS
        .iter()
        .zip(&runners)
        .filter_map(|(method, runner)| {
            let figures = runner.figures(&runners[0], dark_s)?;
            Some((method.name().to_owned(), figures))
        })
        .collect();
    let total_s = |method: Contender| methods.get(method.name()).map(|figures| figures.total_s);
    let is_faster = total_s(VOXEL_1990) < total_s(GRID);
    let quick_check = subject.quick_check()?.map(|verdict| QuickCheckFigures {
        occupied_share: verdict.occupied_share,
        threshold: verdict.threshold,
        is_advised: verdict.is_advised,
        is_right: verdict.is_advised == is_faster,
    });
    let tally = runners[0].first.as_ref().map(|shot| shot.tally);
    let tally = tally.unwrap_or_default();
    let rays = antumbra_render::statistics::Rays::from(&tally).total;
    let queries = asked(&tally);
    let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
    Ok(SceneFigures {
        name: paper_scene.name.to_owned(),
        objects: subject.scene.objects.len(),
        lights: subject.scene.lights.len(),
        grid,
        shadow_ray_share: share(tally.counters.shadow.rays, rays),
        queries,
        shadowed_share: share(tally.counters.shadow.shadowed, queries),
        without_lights_s: dark_s,
        different_pictures,
        quick_check,
        methods,
        paper: paper_scene.paper,
    })
}

impl Runner {
    /// Returns the medians, and counts beside those of plain traversal; nothing without a round.
    fn figures(&self, grid: &Self, dark_s: f64) -> Option<MethodFigures> {
        let (first, by_grid) = (self.first.as_ref()?, grid.first.as_ref()?);
        let middle = |times: &[f64]| median(times.iter().copied());
        let total_s = middle(&self.total_s);
        let ratios = grid.total_s.iter().zip(&self.total_s);
        let spread = Measured {
            rounds_ns: self.total_s.clone(),
            differences: 0,
        };
        let counters = &first.tally.counters;
        let by_grid = &by_grid.tally.counters;
        let saved = |by_grid: u64, here: u64| by_grid as i64 - here as i64;
        let last = self.second.as_ref().unwrap_or(first);
        Some(MethodFigures {
            total_s,
            prepare_s: middle(&self.prepare_s),
            render_s: middle(&self.render_s),
            shadow_s: total_s - dark_s,
            spread: spread.spread(),
            speedup: median(ratios.map(|(grid, here)| grid / here)),
            known_share: known_share(&last.tally),
            value_share: last.tally.counters.shadow.first_pass as f64
                / asked(&last.tally).max(1) as f64,
            first_known_share: known_share(&first.tally),
            intermediate: counters.shadow.intermediate,
            steps: counters.steps,
            intersections: counters.intersections,
            steps_saved: saved(by_grid.steps, counters.steps),
            intersections_saved: saved(by_grid.intersections, counters.intersections),
            bytes_per_light: last.bytes_per_light,
            paper_memory: last.paper_memory,
            second_render_s: (!self.second_s.is_empty()).then(|| middle(&self.second_s)),
        })
    }
}

/// Returns the share of queries that needed no shadow ray.
fn known_share(tally: &Tally) -> f64 {
    let shadow = &tally.counters.shadow;
    (shadow.first_pass + shadow.blocker_list) as f64 / asked(tally).max(1) as f64
}

fn asked(tally: &Tally) -> u64 {
    tally.queries - tally.facing_away - tally.out_of_cone
}

/// Returns a picture as its file would have it, and as it was computed.
fn bytes(picture: &Picture) -> (Vec<u8>, Vec<[u32; 3]>) {
    let linear = picture.pixels.iter().map(|pixel| pixel.map(f32::to_bits));
    (srgb_bytes(picture, 0.0), linear.collect())
}

/// Returns the median time of several pictures by each of some methods, which take turns.
pub(super) fn totals(
    subject: &Subject,
    methods: &[Contender],
    rounds: u32,
    stopwatch: Stopwatch,
    steps: &Steps,
) -> Result<BTreeMap<String, f64>, Failure> {
    let mut times: Vec<Vec<Duration>> = vec![Vec::new(); methods.len()];
    for round in 0..rounds as usize {
        for turn in 0..methods.len() {
            let number = (round + turn) % methods.len();
            let (shot, _) = steps.step(|| subject.shoot(methods[number], false, stopwatch))?;
            times[number].push(shot.total());
        }
    }
    let named = methods.iter().zip(times);
    Ok(named
        .map(|(method, times)| {
            let seconds = times.iter().map(Duration::as_secs_f64);
            (method.name().to_owned(), median(seconds))
        })
        .collect())
}
