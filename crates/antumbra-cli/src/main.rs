//! The `antumbra` program.
//!
//! In: a command line. Out: pictures, figures, and an exit code by meaning. What was typed is in
//! [`typed`] (with the small values' parsers in [`values`]), what was meant is made of it by the
//! sub-commands under [`commands`], and all printing is in [`screen`]. Absent here: rules of
//! geometry and of shadows.

mod commands;
mod failure;
mod interrupt;
mod load;
mod machine;
mod memory;
mod scene_source;
mod screen;
mod typed;
mod values;

use std::process::ExitCode;

use clap::Parser as _;

use crate::failure::{Failure, Outcome};
use crate::screen::Screen;
use crate::typed::{Command, Typed};

fn main() -> ExitCode {
    // Bad usage ends the program here, with code 2.
    let typed = Typed::parse();
    let screen = Screen::new(typed.quiet, typed.verbose);
    let done = interrupt::Interrupt::install()
        .and_then(|interrupt| run(&typed.command, &screen, &interrupt));
    match done {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => {
            screen.failure(&failure);
            failure.exit_code()
        }
    }
}

fn run(
    command: &Command,
    screen: &Screen,
    interrupt: &interrupt::Interrupt,
) -> Result<Outcome, Failure> {
    match command {
        Command::Render(typed) => commands::render::run(typed, screen, interrupt),
        Command::Inspect(typed) => commands::inspect::run(typed, screen),
        Command::Verify(typed) => commands::verify::run(typed, screen),
        Command::Query(typed) => commands::query::run(typed, screen),
        Command::Bake(typed) => commands::bake::run(typed, screen),
        Command::Export(typed) => commands::export::run(typed, screen),
        Command::Scene(typed) => commands::scene::run(typed, screen),
        Command::Convert(typed) => commands::convert::run(typed, screen),
        Command::Bench(typed) => commands::bench::run(typed, screen),
    }
}
