//! `antumbra-bench frames`: series of frames from the first query on.
//!
//! In: a scene, an orbit of cameras, jittered samples of one camera. Out: the time of every frame with
//! every method. `voxel` begins each series without values and makes them while it is timed; what the
//! other methods keep was built before. Ours learns how many queries the frames of a series will ask. A frame is recorded, asked of all methods in all rounds and
//! dropped, so each round has an index of ours to itself.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use antumbra::{LightId, Refine, ShadowCounters};
use antumbra_baselines::embree::{Embree, EmbreeScene};
use antumbra_baselines::{LoadedBatch, ShadowMethod};
use antumbra_render::camera::View;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::methods::Shadows;
use antumbra_cli::screen::Screen;

use super::contender::Contender;
use super::frames_report::{Report, SceneReport, SeriesReport, Timing};
use super::judge::{Verdicts, judge};
use super::measure::{self, Measured, Stopwatch, median};
use super::methods::{self, Built};
use super::record::{self, Aim, Recorded};
use super::report::{Preparation, Shares};
use super::subject::{self, Subject};
use super::typed::Frames;

/// Queries a call where several threads share a frame; one thread is given the whole frame.
const SHARED_SLICE: usize = 65_536;
/// The frame that is asked once more of the values that the frames before it have left.
const WARM_FRAME: usize = 3;

/// Ours, and where they stand among the methods.
const OURS: [Contender; 2] = [
    Contender::Ours(Shadows::Auto),
    Contender::Ours(Shadows::Bvh),
];
const AUTO: usize = 0;
const BVH: usize = 1;

/// Measures all scenes, then reports.
pub(super) fn run(typed: &Frames, screen: &Screen) -> Result<Outcome, Failure> {
    typed.subjects.timed.run(|| work(typed, screen))?
}

fn work(typed: &Frames, screen: &Screen) -> Result<Outcome, Failure> {
    let (stopwatch, embree, head) =
        subject::begin(&typed.subjects.timed, typed.rounds, typed.size, screen);
    let mut report = Report::new(head);
    for path in &typed.subjects.scenes {
        let scene = scene(path, typed, embree.as_ref(), stopwatch, screen)?;
        screen.result(scene.table());
        report.scenes.push(scene);
    }
    report.average();
    screen.result(report.means());
    typed.subjects.figures.write(&report)?;
    let is_clean = report
        .scenes
        .iter()
        .all(|scene| scene.mismatches == 0 && scene.ours_wrong == 0);
    Ok(if is_clean {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// Loads, builds and measures one scene.
fn scene(
    path: &Path,
    typed: &Frames,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
    screen: &Screen,
) -> Result<SceneReport, Failure> {
    let subject = Subject::load(path, &typed.subjects, typed.size, screen)?;
    let orbit = (0..typed.frames)
        .map(|frame| Ok((subject.view(frame, typed.frames)?, Aim::Middle)))
        .collect::<Result<Vec<_>, Failure>>()?;
    let samples = (0..typed.samples)
        .map(|sample| Ok((subject.view(0, 1)?, typed.subjects.jitter(sample))))
        .collect::<Result<Vec<_>, Failure>>()?;

    let cost = &typed.subjects.cost;
    let ours = methods::build(
        &OURS.repeat(typed.rounds as usize),
        subject.recorder.gathered(),
        &subject.recorder.scene().lights,
        Some(subject.eye()),
        cost,
        stopwatch,
    )?;
    let geometry = subject.geometry();
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    let preparation = ours[..OURS.len()]
        .iter()
        .map(|built| (built.method.name().to_owned(), built.preparation()));
    let mut preparation: BTreeMap<_, _> = preparation.collect();
    if let Some((_, time)) = &rival {
        preparation.insert("embree".into(), Preparation::of_rival(*time));
    }
    screen.detail(format!("{}: methods built", path.display()));

    let recording = rayon::ThreadPoolBuilder::new()
        .build()
        .map_err(|error| Failure::system(format!("cannot start threads: {error}")))?;
    let mut bench = Bench {
        typed,
        subject: &subject,
        ours,
        rival: rival.map(|(scene, _)| scene),
        recording,
        stopwatch,
    };
    // Alone, as by those who want one picture.
    let first_played = bench.play(&orbit[..1], None);
    let orbit_played = bench.play(&orbit, Some(WARM_FRAME));
    screen.detail(format!("{}: orbit done", path.display()));
    let samples_played = bench.play(&samples, None);
    screen.detail(format!("{}: samples done", path.display()));

    let mut notes = geometry.notes().to_vec();
    if cost.refinement(Refine::Lazy).refine == Refine::Eager {
        notes.push("values were made before the first query, which no time counts".into());
    }
    let occluders = subject.recorder.gathered().occluders();
    let all = [&first_played, &orbit_played, &samples_played];
    let verdicts = all.iter().flat_map(|series| &series.verdicts);
    Ok(SceneReport {
        name: subject.name.clone(),
        light: subject.light(),
        surfaces: occluders.surface_count(),
        triangles: occluders.triangle_count(),
        mismatches: all.iter().map(|series| series.mismatches).sum(),
        ours_wrong: verdicts.map(|verdicts| verdicts.ours_wrong).sum(),
        notes,
        preparation,
        first_frame: first_played.timing(0..1),
        warm_after_three_views: orbit_played.warm_timing(),
        orbit: orbit_played.report(),
        samples: samples_played.report(),
    })
}

/// Everything that frames are put to.
struct Bench<'a> {
    typed: &'a Frames,
    subject: &'a Subject,
    /// [`OURS`], round after round.
    ours: Vec<Built>,
    rival: Option<EmbreeScene>,
    /// One thread a processor: recording is timed by nobody.
    recording: rayon::ThreadPool,
    stopwatch: Stopwatch,
}

impl Bench<'_> {
    /// Plays a series, each round without values at first. The frame numbered `warm` is asked of
    /// `voxel` once more, before, with nothing made meanwhile.
    fn play(&mut self, frames: &[(View, Aim)], warm: Option<usize>) -> Series {
        for built in &mut self.ours {
            built.method.index_mut().forget_values();
        }
        let rivals = self.rival.as_ref().map(EmbreeScene::methods);
        let rivals = rivals.as_ref().map_or(&[][..], |methods| methods);
        let names = OURS.map(Contender::name).into_iter();
        let names = names.chain(rivals.iter().map(|method| method.name()));
        let mut series = Series::new(names, self.typed.rounds as usize);
        let evictions = |ours: &[Built]| ours[AUTO].method.index().evictions();
        let evictions_before = evictions(&self.ours);

        let mut found = Vec::new();
        for (number, (view, aim)) in frames.iter().enumerate() {
            let recorder = &self.subject.recorder;
            let record = || record::frame(recorder, view, 0, *aim);
            let recorded = self.recording.install(record);
            let shadowed = recorded.is_shadowed.iter().filter(|&&shadowed| shadowed);
            series.shadowed.push(shadowed.count());
            series.queries.push(recorded.is_shadowed.len());
            // Its pages are there before anyone is timed.
            found.clear();
            found.resize(recorded.is_shadowed.len(), false);
            let rivals: Vec<_> = rivals
                .iter()
                .map(|method| method.load(&recorded.batch))
                .collect();
            for (round, ours) in self.ours.chunks(OURS.len()).enumerate() {
                let is_warm = warm == Some(number);
                if is_warm {
                    series.warm.push(self.warm(
                        ours,
                        &recorded,
                        &mut found,
                        &mut series.mismatches,
                    ));
                }
                // Whoever draws frames knows how many.
                let queries = recorded.is_shadowed.len() * (frames.len() - number);
                ours[AUTO]
                    .method
                    .index()
                    .expect_queries(LightId(0), queries as u64);
                let voxel = ours[AUTO].method.load_counted(&recorded.batch);
                let bvh = ours[BVH].method.load(&recorded.batch);
                let all = [&voxel as &dyn LoadedBatch, &*bvh];
                let all: Vec<_> = all.into_iter().chain(rivals.iter().map(|r| &**r)).collect();
                for turn in 0..all.len() {
                    // After the warm pass others come first, so that it leaves nothing in caches.
                    let begin = if is_warm { BVH } else { round + number };
                    let method = (begin + turn) % all.len();
                    let (differences, time) = self.time(all[method], &recorded, &mut found);
                    series.rounds[round][method].push(time);
                    if method < OURS.len() {
                        series.mismatches += differences;
                    } else if round == 0 {
                        let frames_left = frames.len() - number;
                        self.judge(&recorded, &found, &mut series.verdicts[method], frames_left);
                    }
                }
                if round == 0 {
                    series.last_frame = voxel.decisions();
                }
            }
        }
        let index = self.ours[AUTO].method.index();
        series.value_bytes = index.occlusion_bytes();
        series.table_bytes = index.table_bytes();
        series.evictions = evictions(&self.ours) - evictions_before;
        series
    }

    /// Asks `voxel` by the values that it has.
    fn warm(
        &self,
        ours: &[Built],
        recorded: &Recorded,
        found: &mut [bool],
        mismatches: &mut u64,
    ) -> Duration {
        let voxel = &ours[AUTO].method;
        voxel.index().set_refining(false);
        let (differences, time) = self.time(&*voxel.load(&recorded.batch), recorded, found);
        voxel.index().set_refining(true);
        *mismatches += differences;
        time
    }

    /// Judges what Embree answered differently, and leaves some to judge for the frames left.
    fn judge(
        &self,
        recorded: &Recorded,
        found: &[bool],
        verdicts: &mut Verdicts,
        frames_left: usize,
    ) {
        let most = self.typed.subjects.judge - verdicts.judged;
        verdicts.add(&judge(
            self.subject.recorder.index(),
            &recorded.batch,
            &recorded.is_shadowed,
            found,
            most.div_ceil(frames_left),
        ));
    }

    /// Answers a frame once.
    fn time(
        &self,
        batch: &dyn LoadedBatch,
        recorded: &Recorded,
        found: &mut [bool],
    ) -> (u64, Duration) {
        let slice = if self.typed.subjects.timed.count() == 1 {
            found.len().max(1)
        } else {
            SHARED_SLICE
        };
        let expected = &recorded.is_shadowed;
        self.stopwatch
            .time(|| measure::count_differences(batch, 0, expected, found, slice, self.stopwatch))
    }
}

/// What was found about a series.
#[derive(Debug, Default)]
struct Series {
    names: Vec<String>,
    /// Of each frame.
    queries: Vec<usize>,
    shadowed: Vec<usize>,
    /// Round, method, frame.
    rounds: Vec<Vec<Vec<Duration>>>,
    /// Of each round, if there is such a frame.
    warm: Vec<Duration>,
    mismatches: u64,
    /// Method; of the first round, as is the rest.
    verdicts: Vec<Verdicts>,
    last_frame: ShadowCounters,
    value_bytes: u64,
    table_bytes: u64,
    evictions: u64,
}

impl Series {
    fn new<'a>(names: impl Iterator<Item = &'a str>, rounds: usize) -> Self {
        let names: Vec<_> = names.map(str::to_owned).collect();
        Self {
            rounds: vec![vec![Vec::new(); names.len()]; rounds],
            verdicts: vec![Verdicts::default(); names.len()],
            names,
            ..Self::default()
        }
    }

    fn measured(&self, method: usize, frames: Range<usize>) -> Measured {
        let queries: usize = self.queries[frames.clone()].iter().sum();
        let rounds = self.rounds.iter();
        Measured {
            rounds_ns: rounds
                .map(|played| time_ns(played[method][frames.clone()].iter().sum(), queries))
                .collect(),
            differences: 0,
        }
    }

    /// Returns the figures of some frames.
    fn timing(&self, frames: Range<usize>) -> Timing {
        let measured = (0..self.names.len()).map(|method| self.measured(method, frames.clone()));
        self.timing_of(frames.clone(), measured.collect())
    }

    fn timing_of(&self, frames: Range<usize>, measured: Vec<Measured>) -> Timing {
        let queries: usize = self.queries[frames.clone()].iter().sum();
        let shadowed: usize = self.shadowed[frames].iter().sum();
        let shadowed_share = shadowed as f64 / queries.max(1) as f64;
        Timing::new(queries, shadowed_share, &self.names, &measured)
    }

    /// Returns the figures of the frame that was asked of values of others; none in a shorter series.
    fn warm_timing(&self) -> Option<Timing> {
        if self.warm.is_empty() {
            return None;
        }
        let frames = WARM_FRAME..WARM_FRAME + 1;
        let queries = self.queries[WARM_FRAME];
        let all = (0..self.names.len()).map(|method| self.measured(method, frames.clone()));
        let mut measured: Vec<_> = all.collect();
        let warm = self.warm.iter().map(|&time| time_ns(time, queries));
        measured[AUTO].rounds_ns = warm.collect();
        Some(self.timing_of(frames, measured))
    }

    fn report(&self) -> SeriesReport {
        let frames_ns = self.names.iter().enumerate().map(|(method, name)| {
            let frames = 0..self.queries.len();
            let medians = frames.map(|frame| {
                let rounds = self.rounds.iter();
                median(rounds.map(|played| time_ns(played[method][frame], self.queries[frame])))
            });
            (name.clone(), medians.collect())
        });
        let verdicts = self
            .names
            .iter()
            .cloned()
            .zip(self.verdicts.iter().copied());
        SeriesReport {
            frames: self.queries.len(),
            timing: self.timing(0..self.queries.len()),
            frames_ns: frames_ns.collect(),
            last_frame: Shares::of(&self.last_frame),
            value_bytes: self.value_bytes,
            table_bytes: self.table_bytes,
            evictions: self.evictions,
            differences: verdicts.skip(OURS.len()).collect(),
        }
    }
}

/// Nanoseconds a query; NaN where nothing was asked.
fn time_ns(time: Duration, queries: usize) -> f64 {
    time.as_secs_f64() * 1e9
        / if queries == 0 {
            f64::NAN
        } else {
            queries as f64
        }
}
