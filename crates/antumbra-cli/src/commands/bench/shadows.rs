//! `antumbra bench shadows`: recorded queries through every method, one scene after the other.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use antumbra::Method;
use antumbra_baselines::embree::{Embree, EmbreeError, EmbreeScene, Geometry};
use antumbra_baselines::{Batch, LoadedBatch, ShadowMethod};
use antumbra_render::camera::View;
use antumbra_render::orbit::camera_of_frame;
use antumbra_render::prepare::{PrepareOptions, Prepared};
use antumbra_scene::model::LightKind;

use crate::failure::{Failure, Outcome};
use crate::screen::Screen;
use crate::{load, memory};

use super::judge::judge;
use super::measure::{self, Stopwatch};
use super::methods::{self, Built};
use super::oracle;
use super::record::{self, Aim, Recorded};
use super::report::{Preparation, Report, SceneReport, SetReport, Shares};
use super::typed::Shadows;
use super::write_json;

/// Other cameras whose queries values come from: those of the frames before and after the timed
/// one, of so many around the scene.
const ORBIT_FRAMES: u32 = 16;

/// Measures all scenes, then tells.
pub(super) fn run(typed: &Shadows, screen: &Screen) -> Result<Outcome, Failure> {
    let threads = crate::typed::Threads {
        threads: Some(typed.threads),
    };
    crate::commands::on_threads(&threads, || work(typed, screen))?
}

fn work(typed: &Shadows, screen: &Screen) -> Result<Outcome, Failure> {
    let thread_count = usize::from(typed.threads);
    let stopwatch = Stopwatch::new(thread_count);
    let embree = Embree::load(thread_count);
    let where_embree_is = match &embree {
        Ok(embree) => embree
            .path()
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        Err(error) => {
            screen.warning(format!("{error}; its rows are left out"));
            format!("none: {error}")
        }
    };
    let mut report = Report::new(
        stopwatch.name(),
        thread_count,
        typed.rounds,
        typed.size,
        where_embree_is,
    );
    screen.result(report.head());
    for path in &typed.scenes {
        let scene = scene(path, typed, embree.as_ref().ok(), stopwatch, screen)?;
        screen.result(scene.table());
        report.scenes.push(scene);
    }
    report.average();
    screen.result(report.means());
    if let Some(path) = &typed.json {
        write_json(path, &report)?;
    }
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
    // One light of the scene stays.
    let file = typed.light.file(path);
    let mut scene = load::lit_scene(&file, &typed.cost, screen)?.scene;
    if typed.light_number >= scene.lights.len() {
        return Err(Failure::input(
            format!(
                "{} has no light {}; it has {}",
                path.display(),
                typed.light_number,
                scene.lights.len()
            ),
            "give --light-number a smaller number",
        ));
    }
    scene.lights = vec![scene.lights.swap_remove(typed.light_number)];
    let camera = load::camera(&scene, &file, typed.camera.as_ref(), typed.size, screen)?;

    // Recorded by the plain grid, which stays as the one whose answers are expected.
    let options = PrepareOptions {
        method: Method::Grid,
        grid: typed.cost.grid.unwrap_or_default(),
        memory_limit: memory::limit(typed.cost.memory_limit),
        ..PrepareOptions::default()
    };
    let recorder = Prepared::new(scene, &options)?;
    let view = |frame| {
        View::new(&camera_of_frame(&camera, frame, ORBIT_FRAMES), typed.size)
            .map_err(|error| Failure::input(error.to_string(), "the scene's camera sees nothing"))
    };
    let coherent = record::frame(&recorder, &view(0)?, 0, Aim::Middle);
    let warm = [0, 1, ORBIT_FRAMES - 1].map(|frame| {
        Ok(record::frame(
            &recorder,
            &view(frame)?,
            0,
            jitter(typed, frame),
        ))
    });
    let warm = warm.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let shuffled = record::shuffled(&coherent, typed.seed);
    let free = record::free(&recorder, &coherent, typed.seed);
    screen.detail(format!("{}: queries recorded", path.display()));

    let chosen = methods::chosen(&typed.methods);
    let lights = &recorder.scene().lights;
    let ours = methods::build(&chosen, recorder.gathered(), lights, &typed.cost, stopwatch)?;
    let geometry = Geometry::of(recorder.scene(), recorder.gathered().occluders());
    let rival = embree
        .map(|embree| rival(embree, &geometry, stopwatch))
        .transpose()?;
    screen.detail(format!("{}: methods built", path.display()));

    // Values that are made on demand exist from here on, made for other points.
    for built in &ours {
        for recorded in &warm {
            built.method.decisions(&recorded.batch);
            built
                .method
                .decisions(&record::free(&recorder, recorded, typed.seed + 1).batch);
        }
    }

    // The timed queries find what the others left.
    for built in &ours {
        built.method.index().set_refining(false);
    }

    let bench = Bench {
        typed,
        recorder: &recorder,
        ours: &ours,
        rival: rival.as_ref().map(|(scene, _)| scene),
        stopwatch,
    };
    let [coherent_report, shuffled_report, free_report] =
        [&coherent, &shuffled, &free].map(|recorded| bench.set(recorded));
    let mut preparation: BTreeMap<_, _> = ours.iter().map(preparation_of).collect();
    if let Some((_, time)) = &rival {
        let embree = Preparation {
            seconds: time.as_secs_f64(),
            table_bytes: None,
            value_bytes: None,
            predicted_bytes: None,
        };
        preparation.insert("embree".into(), embree);
    }
    let sets = [&coherent_report, &shuffled_report, &free_report];
    let verdicts = sets.iter().flat_map(|set| set.differences.values());
    let occluders = recorder.gathered().occluders();
    Ok(SceneReport {
        name: path
            .file_stem()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        light: light_text(&recorder.scene().lights[0].kind),
        surfaces: occluders.surface_count(),
        triangles: occluders.triangle_count(),
        mismatches: sets.iter().map(|set| set.mismatches).sum(),
        ours_wrong: verdicts.map(|verdicts| verdicts.ours_wrong).sum(),
        notes: geometry.notes().to_vec(),
        preparation,
        oracle: typed
            .oracle
            .then(|| oracle::capped(&recorder, &coherent))
            .transpose()?,
        coherent: coherent_report,
        shuffled: shuffled_report,
        free: free_report,
    })
}

fn jitter(typed: &Shadows, frame: u32) -> Aim {
    Aim::Jittered(typed.seed.wrapping_mul(1024).wrapping_add(frame.into()))
}

fn rival(
    embree: &Embree,
    geometry: &Geometry,
    stopwatch: Stopwatch,
) -> Result<(EmbreeScene, Duration), Failure> {
    let (scene, time) = stopwatch.time(|| embree.build(geometry, false));
    scene.map(|scene| (scene, time)).map_err(failure)
}

/// Embree was found and then refused: that is the system's.
pub(super) fn failure(error: EmbreeError) -> Failure {
    Failure::system(error.to_string())
}

fn preparation_of(built: &Built) -> (String, Preparation) {
    let preparation = Preparation {
        seconds: built.preparation.as_secs_f64(),
        table_bytes: Some(built.method.index().table_bytes()),
        value_bytes: Some(built.method.index().occlusion_bytes()),
        predicted_bytes: Some(built.predicted_bytes),
    };
    (short(built.method.name()), preparation)
}

/// Returns a method's name as the JSON has it, without `_ns`.
fn short(name: &str) -> String {
    methods::key(name).trim_end_matches("_ns").to_owned()
}

fn light_text(kind: &LightKind) -> String {
    match kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => {
            format!("light at ({}, {}, {})", position.x, position.y, position.z)
        }
        LightKind::Directional { towards_light: to } => {
            format!("light towards ({}, {}, {})", to.x, to.y, to.z)
        }
    }
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
    fn set(&self, recorded: &Recorded) -> SetReport {
        let Recorded { batch, is_shadowed } = recorded;
        let singles = self.rival.map(EmbreeScene::single);
        let packets = self.rival.map(EmbreeScene::packets);
        let methods: Vec<&dyn ShadowMethod> = self
            .ours
            .iter()
            .map(|built| &built.method as &dyn ShadowMethod)
            .chain(singles.iter().map(|method| method as &dyn ShadowMethod))
            .chain(packets.iter().map(|method| method as &dyn ShadowMethod))
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
        let embree = methods
            .iter()
            .position(|method| method.name() == "embree")
            .map(|number| &all[number]);
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
            match built {
                Some(built) => {
                    report.mismatches += measured.differences;
                    let shares = Shares::of(&built.method.decisions(batch));
                    report.shares.insert(name.clone(), shares);
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
            self.typed.judge,
        )
    }
}
