//! `antumbra-bench kept`: what a second process gains by a file of values.
//!
//! In: a scene, the queries of one camera. Out: the time to the answers in processes of their own, with a file
//! of values and without. The file is what a process before has left: all values, where they are eager, or baked, or those
//! that it made while it answered other queries of the same camera. With and without take turns, each in a fresh
//! process; answers are compared inside the timed loop.

use std::fs;
use std::path::Path;
use std::process::Command;

use antumbra::{Counters, IndexOptions, LightId, Refine, ShadowCounters, ShadowIndex};
use antumbra_geometry::{DVec3, ReceiverPoint, SurfaceId};
use antumbra_scene::gather::{Gathered, light_shapes};
use serde::{Deserialize, Serialize};

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::outputs::{self, Outputs};
use antumbra_cli::saved as files;
use antumbra_cli::screen::Screen;
use antumbra_cli::{load, memory, values};

use super::head::Head;
use super::measure::{SLICE, Stopwatch, median};
use super::record::{self, Recorded};
use super::subject::Subject;
use super::typed::Kept;

/// What a process took, in seconds, and how it answered.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
struct Took {
    /// Reading the scene and gathering its surfaces.
    scene_s: f64,
    /// Building the index, the file included.
    index_s: f64,
    answers_s: f64,
    differences: u64,
    first_pass: u64,
    blocker_list: u64,
    rays: u64,
}

impl Took {
    /// From the scene in memory to the last answer.
    fn since_scene(&self) -> f64 {
        self.index_s + self.answers_s
    }

    /// From the start of the process on.
    fn whole(&self) -> f64 {
        self.scene_s + self.since_scene()
    }
}

#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    head: Head,
    scene: String,
    light: String,
    refine: &'static str,
    /// Whether the file has all values.
    is_baked: bool,
    queries: usize,
    file_bytes: u64,
    pending: u64,
    /// Making the index and the file, learning included.
    bake_s: f64,
    with_file: Vec<Took>,
    without: Vec<Took>,
    /// Medians of the rounds' ratios.
    ratio_from_scene: f64,
    ratio_whole: f64,
}

/// Measures, or is measured.
pub(super) fn run(typed: &Kept, screen: &Screen) -> Result<Outcome, Failure> {
    let [scene] = &typed.subjects.scenes[..] else {
        return Err(Failure::input(
            "kept takes one scene",
            "measure them one by one",
        ));
    };
    typed.subjects.timed.run(|| match &typed.child {
        Some(queries) => answer(typed, scene, queries, screen),
        None => measure(typed, scene, screen),
    })?
}

fn measure(typed: &Kept, scene: &Path, screen: &Screen) -> Result<Outcome, Failure> {
    let threads = typed.subjects.timed.count();
    let stopwatch = Stopwatch::new(threads);
    let head = Head::new(
        stopwatch.name(),
        threads,
        typed.rounds,
        typed.size,
        "not asked".into(),
    );
    screen.result(head.text());
    let subject = Subject::load(scene, &typed.subjects, typed.size, screen)?;
    // For what the processes share.
    let folder =
        tempfile::tempdir().map_err(|error| outputs::unwritable(&std::env::temp_dir(), error))?;
    let [queries, file] = ["queries", "values.antumbra"].map(|name| folder.path().join(name));

    let view = subject.view(0, 1)?;
    let frame = |number| {
        let aim = typed.subjects.jitter(number);
        record::frame(&subject.recorder, &view, 0, aim)
    };
    // The timed frames are not among those that values come from.
    let wanted = usize::try_from(typed.queries).unwrap_or(usize::MAX);
    let (mut timed, mut number) = (frame(0), 1);
    while timed.is_shadowed.len() < wanted {
        let more = frame(number);
        if more.is_shadowed.is_empty() {
            return Err(Failure::input("the camera sees nothing to ask about", ""));
        }
        timed.batch.starts.extend(more.batch.starts);
        timed.is_shadowed.extend(more.is_shadowed);
        number += 1;
    }
    timed.batch.starts.truncate(wanted);
    timed.is_shadowed.truncate(wanted);
    write_queries(&queries, &timed)?;

    let is_baked = typed.baked || is_eager(typed);
    let (saved, bake) = stopwatch.time(|| -> Result<_, Failure> {
        let mut options = options(typed);
        if is_baked {
            options.refinement.refine = Refine::Eager;
        }
        let lights = &subject.recorder.scene().lights;
        let gathered = subject.recorder.gathered();
        let index = options.build(gathered.occluders(), light_shapes(lights))?;
        if !is_baked {
            for number in number..number + typed.learn {
                let starts = frame(number).batch.starts;
                let mut found = vec![false; starts.len()];
                ask(&index, &starts, &mut found, &mut Counters::default());
            }
        }
        files::save(&index, &file)
    });
    let saved = saved?;
    screen.detail(format!("{}: the first process is done", scene.display()));

    let (mut with_file, mut without) = (Vec::new(), Vec::new());
    for round in 0..typed.rounds {
        for turn in 0..2 {
            if (round + turn) % 2 == 0 {
                with_file.push(process(&queries, Some(&file))?);
            } else {
                without.push(process(&queries, None)?);
            }
        }
    }
    let ratio = |time: fn(&Took) -> f64| {
        let rounds = with_file.iter().zip(&without);
        median(rounds.map(|(with, without)| time(with) / time(without)))
    };
    let report = Report {
        scene: subject.name.clone(),
        light: subject.light(),
        refine: if is_eager(typed) { "eager" } else { "lazy" },
        is_baked,
        queries: wanted,
        file_bytes: saved.bytes,
        pending: saved.pending_count,
        bake_s: bake.as_secs_f64(),
        ratio_from_scene: ratio(Took::since_scene),
        ratio_whole: ratio(Took::whole),
        head,
        with_file,
        without,
    };
    screen.result(report.table());
    typed.subjects.figures.write(&report)?;
    let all = report.with_file.iter().chain(&report.without);
    Ok(if all.map(|took| took.differences).sum::<u64>() == 0 {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

impl Report {
    fn table(&self) -> String {
        let mut lines = vec![format!(
            "{}, {}, {} values: file of {} values, {}, made in {:.2} s; {} queries",
            self.scene,
            self.light,
            self.refine,
            if self.is_baked { "all" } else { "learned" },
            values::format_bytes(self.file_bytes),
            self.bake_s,
            self.queries
        )];
        lines.push(
            "              scene     index   answers   by value, list, ray (median of the rounds)"
                .into(),
        );
        for (name, all) in [("with file", &self.with_file), ("without", &self.without)] {
            let of = |time: fn(&Took) -> f64| median(all.iter().map(time));
            let share = |count: fn(&Took) -> u64| {
                100.0 * median(all.iter().map(|took| count(took) as f64)) / self.queries as f64
            };
            lines.push(format!(
                "  {name:<10} {:7.3} s {:7.3} s {:7.3} s   {:.2}, {:.2}, {:.2} %",
                of(|took| took.scene_s),
                of(|took| took.index_s),
                of(|took| took.answers_s),
                share(|took| took.first_pass),
                share(|took| took.blocker_list),
                share(|took| took.rays)
            ));
        }
        let wrong: u64 = self
            .with_file
            .iter()
            .chain(&self.without)
            .map(|took| took.differences)
            .sum();
        lines.push(format!(
            "  with / without: {:.3} from the scene in memory, {:.3} from the start of the process; \
             {wrong} answers differ",
            self.ratio_from_scene, self.ratio_whole
        ));
        lines.join("\n")
    }
}

fn is_eager(typed: &Kept) -> bool {
    typed.subjects.cost.refinement(Refine::Lazy).refine == Refine::Eager
}

/// Runs this program again with the same command line, and reads what it took.
fn process(queries: &Path, file: Option<&Path>) -> Result<Took, Failure> {
    let failed = |what: String| Failure::system(format!("the second process: {what}"));
    let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
    let mut command = Command::new(program);
    command.args(std::env::args_os().skip(1));
    command.arg("--child").arg(queries);
    if let Some(file) = file {
        command.arg("--occlusion").arg(file);
    }
    let output = command.output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| failed(error.to_string()))
}

/// The second process: from the scene's file to the last answer.
fn answer(typed: &Kept, scene: &Path, queries: &Path, screen: &Screen) -> Result<Outcome, Failure> {
    let (starts, expected) = read_queries(queries)?;
    let mut found = vec![false; starts.len()];
    let stopwatch = Stopwatch::new(typed.subjects.timed.count());
    let (loaded, scene_time) = stopwatch.time(|| -> Result<_, Failure> {
        let file = typed.subjects.light.file(scene);
        let mut scene =
            load::lit_scene(&file, &typed.subjects.cost, &Outputs::none(), screen)?.scene;
        scene.lights = vec![scene.lights.swap_remove(typed.subjects.light_number)];
        let gathered = Gathered::of(&scene)?;
        Ok((scene, gathered))
    });
    let (scene, gathered) = loaded?;
    let file = typed.occlusion.as_deref();
    let (index, index_time) = stopwatch.time(|| {
        let lights = light_shapes(&scene.lights);
        options(typed).build_from(gathered.occluders(), lights, file)
    });
    let index = index?;
    let mut counters = Counters::default();
    let ((), answer_time) = stopwatch.time(|| ask(&index, &starts, &mut found, &mut counters));
    let ShadowCounters {
        first_pass,
        blocker_list,
        rays,
        ..
    } = counters.shadow;
    let differences = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
    let took = Took {
        scene_s: scene_time.as_secs_f64(),
        index_s: index_time.as_secs_f64(),
        answers_s: answer_time.as_secs_f64(),
        differences: differences as u64,
        first_pass,
        blocker_list,
        rays,
    };
    let json = serde_json::to_string(&took);
    screen.result(json.map_err(|error| Failure::system(error.to_string()))?);
    Ok(Outcome::Done)
}

fn options(typed: &Kept) -> IndexOptions {
    let cost = &typed.subjects.cost;
    IndexOptions {
        method: typed.shadows.method(),
        grid: cost.grid.unwrap_or_default(),
        refinement: cost.refinement(Refine::Lazy),
        memory_limit: memory::limit(cost.memory_limit),
        ..IndexOptions::default()
    }
}

/// Asks slice by slice, as a caller with many points does.
fn ask(index: &ShadowIndex, starts: &[ReceiverPoint], found: &mut [bool], counters: &mut Counters) {
    for (starts, found) in starts.chunks(SLICE).zip(found.chunks_mut(SLICE)) {
        index
            .shadows(starts, LightId(0), found, counters)
            .expect("starts are hits, and the scene has the light");
    }
}

/// Bytes of a query: a point, its surface, the answer.
const QUERY: usize = 24 + 4 + 1;

fn write_queries(path: &Path, recorded: &Recorded) -> Result<(), Failure> {
    let mut bytes = Vec::with_capacity(QUERY * recorded.is_shadowed.len());
    for (start, &is_shadowed) in recorded.batch.starts.iter().zip(&recorded.is_shadowed) {
        for x in start.point.to_array() {
            bytes.extend(x.to_le_bytes());
        }
        let surface = start.surface.map_or(u32::MAX, |surface| surface.0);
        bytes.extend(surface.to_le_bytes());
        bytes.push(u8::from(is_shadowed));
    }
    outputs::write(path, &bytes)
}

fn read_queries(path: &Path) -> Result<(Vec<ReceiverPoint>, Vec<bool>), Failure> {
    let unreadable = |what: &str| Failure::input(format!("{}: {what}", path.display()), "");
    let bytes = fs::read(path).map_err(|error| unreadable(&error.to_string()))?;
    let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
    let query = |bytes: &[u8]| {
        let [x, y, z] = [0, 8, 16].map(|at| number(&bytes[at..at + 8]));
        let surface = bytes[24..28]
            .try_into()
            .map_or(u32::MAX, u32::from_le_bytes);
        let start = ReceiverPoint {
            point: DVec3::new(x, y, z),
            surface: (surface != u32::MAX).then_some(SurfaceId(surface)),
        };
        (start, bytes[28] != 0)
    };
    Ok(bytes.chunks_exact(QUERY).map(query).unzip())
}
