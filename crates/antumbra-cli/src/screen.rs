//! The only place that prints.
//!
//! Results go to standard output, all else to standard error. Writing may fail, as when a pipe is
//! closed; there is nobody left to tell then, so it is ignored instead of panicking like
//! `println!`.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use miette::{GraphicalReportHandler, GraphicalTheme};

use crate::failure::Failure;

/// Where and how much to print.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screen {
    is_quiet: bool,
    is_verbose: bool,
}

impl Screen {
    pub(crate) fn new(is_quiet: bool, is_verbose: bool) -> Self {
        Self {
            is_quiet,
            is_verbose,
        }
    }

    /// Prints a line of the result.
    pub(crate) fn result(&self, line: impl Display) {
        let _ = writeln!(io::stdout().lock(), "{line}");
    }

    /// Prints lines that were asked for beside the result, whatever `--quiet` says.
    pub(crate) fn aside(&self, lines: impl Display) {
        let _ = writeln!(io::stderr().lock(), "{lines}");
    }

    /// Says what the program decided by itself.
    pub(crate) fn note(&self, line: impl Display) {
        if !self.is_quiet {
            let _ = writeln!(io::stderr().lock(), "note: {line}");
        }
    }

    /// Says what may be wrong.
    pub(crate) fn warning(&self, line: impl Display) {
        if !self.is_quiet {
            let _ = writeln!(io::stderr().lock(), "warning: {line}");
        }
    }

    /// Says what goes on, for `--verbose`.
    pub(crate) fn detail(&self, line: impl Display) {
        if self.is_verbose {
            let _ = writeln!(io::stderr().lock(), "{line}");
        }
    }

    /// Reports why the program failed, whatever `--quiet` says.
    pub(crate) fn failure(&self, failure: &Failure) {
        let handler = if io::stderr().is_terminal() {
            GraphicalReportHandler::new()
        } else {
            GraphicalReportHandler::new_themed(GraphicalTheme::none())
        };
        let mut text = String::new();
        // Names of files stay whole, so that editors find them.
        let rendered = handler
            .with_wrap_lines(false)
            .render_report(&mut text, &failure.diagnostic());
        if rendered.is_ok() {
            let _ = write!(io::stderr().lock(), "{text}");
        }
    }

    /// Starts a bar with the time left; invisible unless standard error is a terminal.
    pub(crate) fn progress(&self, length: u64, what: &str) -> ProgressBar {
        if self.is_quiet || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(length).with_message(what.to_owned());
        let template = "{msg} [{bar:40}] {percent:>3} %, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    /// Returns bars for the stages that the work itself tells of.
    pub(crate) fn bars(&self) -> Bars {
        Bars {
            screen: *self,
            shown: Mutex::default(),
        }
    }
}

/// A bar for each stage of work, one at a time: of stages within another the outer one is shown.
pub(crate) struct Bars {
    screen: Screen,
    shown: Mutex<Option<(&'static str, ProgressBar)>>,
}

impl Bars {
    /// Shows how many steps of a stage are done.
    pub(crate) fn tell(&self, stage: &'static str, done: u64, count: u64) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let (name, bar) = shown.get_or_insert_with(|| (stage, self.screen.progress(count, stage)));
        if *name != stage {
            return;
        }
        // Threads tell in any order.
        bar.set_position(bar.position().max(done));
        if done == count {
            bar.finish_and_clear();
            *shown = None;
        }
    }
}
