//! The `antumbra` program, to be called by whoever has a command line: the binary, or Python.
//!
//! In: a command line. Out: pictures, figures, and an exit code by meaning. What was typed is in
//! `typed` (with the small values' parsers in `values`), what was meant is made of it by the
//! sub-commands under `commands`, and all printing is in `screen`. Absent here: rules of
//! geometry and of shadows.
//!
//! The modules are public for `antumbra-bench`, which is not published, and for nobody else: they may change at any
//! time.

#[doc(hidden)]
pub mod commands;
#[doc(hidden)]
pub mod failure;
#[doc(hidden)]
pub mod interrupt;
#[doc(hidden)]
pub mod light_values;
#[doc(hidden)]
pub mod load;
#[doc(hidden)]
pub mod machine;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod methods;
#[doc(hidden)]
pub mod outputs;
#[doc(hidden)]
pub mod saved;
#[doc(hidden)]
pub mod scene_source;
#[doc(hidden)]
pub mod screen;
#[doc(hidden)]
pub mod soft;
#[doc(hidden)]
pub mod typed;
#[doc(hidden)]
pub mod values;

use std::ffi::OsString;

use antumbra_task::Task;

use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::screen::Screen;
use crate::typed::{Command, Typed, Verbosity};

/// Returns the most bytes that this process should take where nobody says how many: three quarters of the
/// machine's memory, or of its container's.
pub fn default_memory_limit() -> u64 {
    memory::limit(None)
}

/// Runs the program on a command line, whose first word is the program's name, and returns its exit code.
///
/// Takes over Ctrl-C and, on Unix, `SIGTERM` and `SIGHUP` for the whole process, and may end the process by them. So it is called once, by a
/// process that does nothing else.
pub fn run<I>(command_line: I) -> u8
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    run_typed(command_line, |typed: &Typed| typed.verbosity, do_command)
}

/// Runs a program of this kind: parses the command line, installs the signals and prints how it ends. Returns the exit
/// code.
#[doc(hidden)]
pub fn run_typed<T, I>(
    command_line: I,
    verbosity: impl FnOnce(&T) -> Verbosity,
    work: impl FnOnce(&T, &Screen, &Interrupt) -> Result<Outcome, Failure>,
) -> u8
where
    T: clap::Parser,
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    let typed = match T::try_parse_from(command_line) {
        Ok(typed) => typed,
        // Bad usage, with code 2, or help, with code 0.
        Err(said) => {
            let printed = said.print();
            let code = u8::try_from(said.exit_code()).unwrap_or(2);
            return match printed.map_err(screen::unprintable) {
                Err(Some(failure)) if code == 0 => {
                    Screen::new(false, false).failure(&failure);
                    failure.exit_code()
                }
                _ => code,
            };
        }
    };
    let Verbosity { quiet, verbose } = verbosity(&typed);
    let screen = Screen::new(quiet, verbose);
    let bars = screen.bars();
    let task = Task::with_progress(move |stage, done, count| bars.report(stage, done, count));
    let done = Interrupt::install(task.clone(), screen.shown()).and_then(|interrupt| {
        let done = task.run(|| work(&typed, &screen, &interrupt));
        screen.shown().clear();
        let code = match done.unwrap_or(Ok(Outcome::Interrupted))? {
            Outcome::Done => 0,
            Outcome::Differences => 1,
            Outcome::Interrupted => interrupt.exit_code(),
        };
        screen.is_printed().map(|()| code)
    });
    done.unwrap_or_else(|failure| {
        screen.failure(&failure);
        failure.exit_code()
    })
}

fn do_command(typed: &Typed, screen: &Screen, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    match &typed.command {
        Command::Render(typed) => commands::render::run(typed, screen, interrupt),
        Command::Inspect(typed) => commands::inspect::run(typed, screen),
        Command::Verify(typed) => commands::verify::run(typed, Vec::new(), screen),
        Command::Query(typed) => commands::query::run(typed, screen),
        Command::Sun(typed) => commands::sun::run(typed, screen),
        Command::Bake(typed) => commands::bake::run(typed, screen),
        Command::Export(typed) => commands::export::run(typed, screen),
        Command::Scene(typed) => commands::scene::run(typed, screen),
        Command::Convert(typed) => commands::convert::run(typed, screen),
    }
}
