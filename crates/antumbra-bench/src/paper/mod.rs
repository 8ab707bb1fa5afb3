//! `antumbra-bench paper`: the paper's tables, on its scenes, with its method, ours and its rivals (Paper 8).
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
mod methods;
mod race;
mod report;
mod scenes;
mod shot;
mod sweeps;
mod table;
mod tables;
use antumbra_task::{Steps, Stopped, unwatched};

use super::head::Head;
use super::measure::Stopwatch;
use super::typed::Paper;
use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::interrupt::Interrupt;
use antumbra_cli::screen::Screen;
use antumbra_cli::typed::Threads;
use figures::Figures;
use methods::{GRID, METHODS, VOXEL, VOXEL_1990};
use scenes::PaperScene;

/// Measures all scenes and reports.
pub(super) fn run(
    typed: &Paper,
    screen: &Screen,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    let one = Threads { threads: Some(1) };
    antumbra_cli::commands::on_threads(&one, || work(typed, screen, interrupt))?
}

fn work(typed: &Paper, screen: &Screen, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let mut outputs = typed.figures.outputs(None)?;
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
        is_complete: false,
        scenes: Vec::new(),
        sweeps: Vec::new(),
    };
    screen.result(figures.head.text());
    // What is measured when Ctrl-C comes is told and written.
    interrupt.keep_partial_results();
    let measured = interrupt
        .task()
        .run(|| measure(typed, &chosen, stopwatch, &mut figures, screen));
    figures.is_complete = measured.is_ok();
    unwatched(|| tell(typed, &figures, screen))?;
    match measured {
        Err(Stopped) => {
            let scenes: Vec<_> = figures.scenes.iter().map(|scene| &*scene.name).collect();
            screen.aside(format!(
                "stopped after {} of {} scenes ({}) and {} sweeps{}",
                scenes.len(),
                chosen.len(),
                scenes.join(", "),
                figures.sweeps.len(),
                match &typed.html {
                    Some(_) => "; the report is not written",
                    None => "",
                }
            ));
            return Ok(Outcome::Interrupted);
        }
        Ok(measured) => measured?,
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

/// Measures scene after scene, then the sweeps. What is found stays in `figures` when this is stopped.
fn measure(
    typed: &Paper,
    chosen: &[&PaperScene],
    stopwatch: Stopwatch,
    figures: &mut Figures,
    screen: &Screen,
) -> Result<(), Failure> {
    let steps = Steps::new(
        "measuring scenes",
        chosen.len() as u64 * race::picture_count(typed),
    );
    for scene in chosen {
        figures
            .scenes
            .push(race::run(scene, typed, stopwatch, &steps)?);
        screen.detail(format!("{}: measured", scene.name));
    }
    if typed.no_sweeps {
        return Ok(());
    }
    let steps = Steps::new(
        "measuring sweeps",
        sweeps::picture_count(typed, chosen.len()),
    );
    for scene in chosen {
        let sweeps = sweeps::run(scene, typed, stopwatch, &steps)?;
        figures.sweeps.extend(sweeps);
        screen.detail(format!("{}: sweeps measured", scene.name));
    }
    figures
        .sweeps
        .push(sweeps::rooms(typed, stopwatch, &steps)?);
    Ok(())
}

/// Prints the tables of what was measured and writes it as JSON.
fn tell(typed: &Paper, figures: &Figures, screen: &Screen) -> Result<(), Failure> {
    if !figures.scenes.is_empty() {
        for table in tables::all(figures) {
            screen.result(table.text());
        }
    }
    if !figures.sweeps.is_empty() {
        for table in tables::sweeps(figures) {
            screen.result(table.text());
        }
    }
    typed.figures.write(figures)
}
