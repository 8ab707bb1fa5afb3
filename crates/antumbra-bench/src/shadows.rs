//! `antumbra-bench shadows`: recorded queries through every method, one scene after the other.

use std::collections::BTreeMap;
use std::path::Path;

use antumbra::Refine;
use antumbra_baselines::embree::{Embree, EmbreeScene, EmbreeWay};
use antumbra_baselines::{Batch, LoadedBatch, ShadowMethod};
use antumbra_render::prepare::Prepared;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::screen::Screen;

use super::judge::judge;
use super::measure::{self, Measured, Stopwatch};
use super::methods::{self, Built};
use super::record::{self, Aim, Recorded};
use super::report::{Preparation, Report, SceneReport, SetReport, Shares, WorkOfQuery};
use super::subject::{self, Subject};
use super::typed::Shadows;
use super::{cold, oracle};

/// Other cameras whose queries values come from: those of the frames before and after the timed
/// one, of so many around the scene.
const ORBIT_FRAMES: u32 = 16;

/// Measures all scenes, then reports.
pub(super) fn run(typed: &Shadows, screen: &Screen) -> Result<Outcome, Failure> {
    typed.subjects.timed.run(|| work(typed, screen))?
}

fn work(typed: &Shadows, screen: &Screen) -> Result<Outcome, Failure> {
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

/// Loads, records, builds and measures one scene.
fn scene(
    path: &Path,
    typed: &Shadows,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
    screen: &Screen,
) -> Result<SceneReport, Failure> {
    let subject = Subject::load(path, &typed.subjects, typed.size, screen)?;
    let recorder = &subject.recorder;
    let view = |frame| subject.view(frame, ORBIT_FRAMES);
    let coherent = record::frame(recorder, &view(0)?, 0, Aim::Middle);
    let warm = [0, 1, ORBIT_FRAMES - 1].map(|frame| {
        let aim = typed.subjects.jitter(frame);
        Ok(record::frame(recorder, &view(frame)?, 0, aim))
    });
    let warm = warm.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let shuffled = record::shuffled(&coherent, typed.subjects.seed);
    let free = record::free(recorder, &coherent, typed.subjects.seed);
    screen.detail(format!("{}: queries recorded", path.display()));

    let chosen = methods::chosen(&typed.methods);
    let lights = &recorder.scene().lights;
    let cost = &typed.subjects.cost;
    let mut ours = methods::build(
        &chosen,
        recorder.gathered(),
        lights,
        Some(subject.eye()),
        cost,
        stopwatch,
    )?;
    let geometry = subject.geometry();
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    screen.detail(format!("{}: methods built", path.display()));

    let still = view(0)?;
    let cold = cold::measure(
        &mut ours,
        cost.refinement(Refine::Lazy).refine,
        &coherent,
        |frame| record::frame(recorder, &still, 0, typed.subjects.jitter(frame)),
        typed.rounds,
        stopwatch,
        typed.subjects.timed.count(),
    );
    screen.detail(format!("{}: cold values measured", path.display()));

    // Values that are made on demand exist from here on, made for other points.
    let keeps_values = |built: &&Built| built.method.rival().is_none();
    for built in ours.iter().filter(keeps_values) {
        for recorded in &warm {
            built.method.decisions(&recorded.batch);
            built
                .method
                .decisions(&record::free(recorder, recorded, typed.subjects.seed + 1).batch);
        }
    }

    // The timed queries find what the others left.
    for built in &ours {
        built.method.index().set_refining(false);
    }

    let bench = Bench {
        typed,
        recorder,
        ours: &ours,
        rival: rival.as_ref().map(|(scene, _)| scene),
        stopwatch,
    };
    let cold_queries = cold.as_ref().map(|cold| &cold.measured);
    let coherent_report = bench.set(&coherent, cold_queries);
    let [shuffled_report, free_report] =
        [&shuffled, &free].map(|recorded| bench.set(recorded, None));
    let preparation = ours
        .iter()
        .map(|built| (short(built.method.name()), built.preparation()));
    let mut preparation: BTreeMap<_, _> = preparation.collect();
    if let Some((_, time)) = &rival {
        preparation.insert("embree".into(), Preparation::of_rival(*time));
    }
    let sets = [&coherent_report, &shuffled_report, &free_report];
    let verdicts = sets.iter().flat_map(|set| set.differences.values());
    let occluders = recorder.gathered().occluders();
    Ok(SceneReport {
        name: subject.name.clone(),
        light: subject.light(),
        surfaces: occluders.surface_count(),
        triangles: occluders.triangle_count(),
        mismatches: sets.iter().map(|set| set.mismatches).sum(),
        ours_wrong: verdicts.map(|verdicts| verdicts.ours_wrong).sum(),
        notes: geometry.notes().to_vec(),
        preparation,
        oracle: typed
            .oracle
            .then(|| oracle::capped(recorder, &coherent))
            .transpose()?,
        break_even: cold.as_ref().and_then(|cold| cold.break_even),
        coherent: coherent_report,
        shuffled: shuffled_report,
        free: free_report,
    })
}

/// Returns a method's name as the JSON has it, without `_ns`.
fn short(name: &str) -> String {
    methods::key(name).trim_end_matches("_ns").to_owned()
}

/// Returns what was faster of Embree's ways.
pub(super) fn fastest(ways: [Option<&Measured>; 3]) -> Option<&Measured> {
    let ways = ways.into_iter().flatten();
    ways.min_by(|a, b| a.median_ns().total_cmp(&b.median_ns()))
}

/// Everything that a set of queries is put to.
struct Bench<'a> {
    typed: &'a Shadows,
    recorder: &'a Prepared,
    ours: &'a [Built],
    rival: Option<&'a EmbreeScene>,
    stopwatch: Stopwatch,
}

impl Bench<'_> {
    /// Measures a set; what cold values took for it is measured already.
    fn set(&self, recorded: &Recorded, cold: Option<&Measured>) -> SetReport {
        let Recorded { batch, is_shadowed } = recorded;
        let rivals = self.rival.map(EmbreeScene::methods);
        let methods: Vec<&dyn ShadowMethod> = self
            .ours
            .iter()
            .map(|built| &built.method as &dyn ShadowMethod)
            .chain(
                rivals
                    .iter()
                    .flatten()
                    .map(|method| method as &dyn ShadowMethod),
            )
            .collect();
        let loaded: Vec<Box<dyn LoadedBatch + '_>> =
            methods.iter().map(|method| method.load(batch)).collect();
        let all = measure::interleave(&loaded, is_shadowed, self.typed.rounds, self.stopwatch);

        let query_count = is_shadowed.len();
        let shadowed = is_shadowed.iter().filter(|&&is_shadowed| is_shadowed);
        let mut report = SetReport {
            queries: query_count,
            shadowed_share: shadowed.count() as f64 / query_count.max(1) as f64,
            times_ns: methods::KEYS.map(|key| (key.to_owned(), None)).into(),
            ..SetReport::default()
        };
        if query_count == 0 {
            return report;
        }
        let measured_of = |name: &str| {
            let number = methods.iter().position(|method| method.name() == name)?;
            Some(&all[number])
        };
        let embree = measured_of("embree");
        let best = fastest(EmbreeWay::ALL.map(|way| measured_of(way.name())));
        if let Some(best) = best {
            let time = Some(best.median_ns());
            report.times_ns.insert("embree_best_ns".into(), time);
        }
        if let Some(cold) = cold {
            let name = "auto_cold".to_owned();
            report
                .times_ns
                .insert(format!("{name}_ns"), Some(cold.median_ns()));
            report.mismatches += cold.differences;
            report.spread.insert(name.clone(), cold.spread());
            if let Some(embree) = embree {
                report.embree_by.insert(name, embree.ratio_to(cold));
            }
        }
        for (number, (method, measured)) in methods.iter().zip(&all).enumerate() {
            let name = short(method.name());
            let time = Some(measured.median_ns());
            report.times_ns.insert(methods::key(method.name()), time);
            report.spread.insert(name.clone(), measured.spread());
            let built = self.ours.get(number);
            if let (Some(embree), Some(_)) = (embree, built) {
                report
                    .embree_by
                    .insert(name.clone(), embree.ratio_to(measured));
            }
            if let (Some(best), Some(_)) = (best, built) {
                report
                    .embree_best_by
                    .insert(name.clone(), best.ratio_to(measured));
            }
            match built {
                Some(built) => {
                    let work = built.method.work(batch);
                    let shares = Shares::of(&work.counters.shadow);
                    report.shares.insert(name.clone(), shares);
                    let work = WorkOfQuery::of(&work, query_count);
                    report.work.insert(name.clone(), work);
                    if built.method.is_exact() {
                        report.mismatches += measured.differences;
                    } else {
                        let verdicts = self.verdicts(batch, is_shadowed, &*loaded[number]);
                        report.differences.insert(name.clone(), verdicts);
                    }
                    let bytes = built.method.index().occlusion_bytes();
                    report.bytes.insert(name, bytes);
                }
                None => {
                    let verdicts = self.verdicts(batch, is_shadowed, &*loaded[number]);
                    report.differences.insert(name, verdicts);
                }
            }
        }
        report
    }

    fn verdicts(
        &self,
        batch: &Batch,
        expected: &[bool],
        rival: &dyn LoadedBatch,
    ) -> super::judge::Verdicts {
        let found = measure::answers(rival, expected.len());
        judge(
            self.recorder.index(),
            batch,
            expected,
            &found,
            self.typed.subjects.judge,
        )
    }
}
