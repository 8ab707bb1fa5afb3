//! `antumbra bench paper`: the paper's tables, on its scenes, with its method, ours and its rivals (Paper 8).
//!
//! | step | module |
//! |---|---|
//! | the scenes, and the paper's own rows | [`scenes`] |
//! | one picture by one method | [`shot`] |
//! | interleaved rounds over one scene | [`race`] |
//! | grid, size and lights varied | [`sweeps`] |
//! | what was found, as JSON | [`figures`] |
//! | the same as tables | [`tables`], [`table`] |
//! | the same as a page to look at | [`report`] |

mod figures;
mod race;
mod report;
mod scenes;
mod shot;
mod sweeps;
mod table;
mod tables;

use crate::failure::{Failure, Outcome};
use crate::outputs::{Content, Outputs, write_json};
use crate::screen::Screen;
use crate::typed::{Shadows, Threads};

use super::head::Head;
use super::measure::Stopwatch;
use super::typed::Paper;
use figures::Figures;
use scenes::PaperScene;

/// Plain traversal: what all are measured by.
const GRID: Shadows = Shadows::Grid;
/// The paper's own method.
const VOXEL_1990: Shadows = Shadows::Voxel1990;
/// Ours.
const VOXEL: Shadows = Shadows::Voxel;

/// The methods that are compared.
const METHODS: [Shadows; 6] = [
    GRID,
    VOXEL_1990,
    VOXEL,
    Shadows::LightBuffer,
    Shadows::Hybrid,
    Shadows::ShadowVolumes,
];

/// The scenes' names.
pub(super) const NAMES: [&str; 6] = scenes::NAMES;

/// Measures all scenes and tells.
pub(super) fn run(typed: &Paper, screen: &Screen) -> Result<Outcome, Failure> {
    let one = Threads { threads: Some(1) };
    crate::commands::on_threads(&one, || work(typed, screen))?
}

fn work(typed: &Paper, screen: &Screen) -> Result<Outcome, Failure> {
    let mut outputs = Outputs::none();
    outputs.add_if("--json", typed.json.as_ref(), Content::Json)?;
    if let Some(folder) = &typed.html {
        report::prepare(folder, &mut outputs)?;
    }
    let stopwatch = Stopwatch::new(1);
    let chosen: Vec<&PaperScene> = scenes::ALL
        .iter()
        .filter(|scene| typed.scenes.is_empty() || typed.scenes.iter().any(|n| n == scene.name))
        .collect();
    let no_rival = "not measured".to_owned();
    let head = Head::new(stopwatch.name(), 1, typed.rounds, typed.size, no_rival);
    let mut figures = Figures {
        head,
        scenes: Vec::new(),
        sweeps: Vec::new(),
    };
    screen.result(figures.head.text());
    for scene in &chosen {
        figures.scenes.push(race::run(scene, typed, stopwatch)?);
        screen.detail(format!("{}: measured", scene.name));
    }
    for table in tables::all(&figures) {
        screen.result(table.text());
    }
    if !typed.no_sweeps {
        for scene in &chosen {
            figures.sweeps.extend(sweeps::run(scene, typed, stopwatch)?);
            screen.detail(format!("{}: sweeps measured", scene.name));
        }
        figures.sweeps.push(sweeps::rooms(typed, stopwatch)?);
        for table in tables::sweeps(&figures) {
            screen.result(table.text());
        }
    }
    if let Some(path) = &typed.json {
        write_json(path, &figures)?;
    }
    if let Some(folder) = &typed.html {
        report::write(folder, &figures, &chosen, typed.size)?;
    }
    let is_same = figures
        .scenes
        .iter()
        .all(|scene| scene.different_pictures == 0);
    Ok(if is_same {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}
