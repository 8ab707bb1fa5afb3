//! The only place that prints.
//!
//! Results go to standard output, all else to standard error. Results that cannot be printed are a failure, reported at
//! the end; but not when a pipe is closed: its reader has seen enough. What cannot be printed on standard error is
//! ignored: nobody is left to read it.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::{GraphicalReportHandler, GraphicalTheme};

use crate::failure::Failure;

/// Output of the program: where and how much to print.
#[derive(Debug)]
pub struct Screen {
    is_quiet: bool,
    is_verbose: bool,
    /// Why the first result that was not printed was not.
    unprinted: OnceLock<Failure>,
    shown: Shown,
}

impl Screen {
    pub fn new(is_quiet: bool, is_verbose: bool) -> Self {
        Self {
            is_quiet,
            is_verbose,
            unprinted: OnceLock::new(),
            shown: Shown::default(),
        }
    }

    /// Prints a line of the result.
    pub fn result(&self, line: impl Display) {
        let printed = writeln!(io::stdout().lock(), "{line}");
        self.note_unprinted(printed);
    }

    /// Returns the failure that results were not printed.
    pub fn is_printed(&self) -> Result<(), Failure> {
        self.note_unprinted(io::stdout().flush());
        self.unprinted.get().cloned().map_or(Ok(()), Err)
    }

    fn note_unprinted(&self, printed: io::Result<()>) {
        if let Some(failure) = printed.err().and_then(unprintable) {
            // The first is told.
            let _ = self.unprinted.set(failure);
        }
    }

    /// Prints lines that were asked for beside the result, whatever `--quiet` says.
    pub fn aside(&self, lines: impl Display) {
        let _ = writeln!(io::stderr().lock(), "{lines}");
    }

    /// Says what the program decided by itself.
    pub fn note(&self, line: impl Display) {
        if !self.is_quiet {
            let _ = writeln!(io::stderr().lock(), "note: {line}");
        }
    }

    /// Says what may be wrong.
    pub fn warning(&self, line: impl Display) {
        if !self.is_quiet {
            let _ = writeln!(io::stderr().lock(), "warning: {line}");
        }
    }

    /// Says what goes on, for `--verbose`.
    pub fn detail(&self, line: impl Display) {
        if self.is_verbose {
            let _ = writeln!(io::stderr().lock(), "{line}");
        }
    }

    /// Reports why the program failed, whatever `--quiet` says.
    pub fn failure(&self, failure: &Failure) {
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
    pub fn progress(&self, length: u64, what: &str) -> ProgressBar {
        self.shown.bar(self.is_quiet, length, what)
    }

    /// Returns the bars that are shown, for whoever ends the process.
    pub fn shown(&self) -> Shown {
        self.shown.clone()
    }

    /// Returns bars for the stages that the work itself reports.
    pub fn bars(&self) -> Bars {
        Bars {
            is_quiet: self.is_quiet,
            all: self.shown(),
            one: Mutex::default(),
        }
    }
}

/// All bars that are shown.
#[derive(Clone, Debug, Default)]
pub struct Shown(MultiProgress);

impl Shown {
    /// Takes away all bars, for good.
    pub fn clear(&self) {
        let _ = self.0.clear();
        self.0.set_draw_target(ProgressDrawTarget::hidden());
    }

    fn bar(&self, is_quiet: bool, length: u64, what: &str) -> ProgressBar {
        if is_quiet || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let bar = self
            .0
            .add(ProgressBar::new(length).with_message(what.to_owned()));
        let template = "{msg} [{bar:40}] {percent:>3} %, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

/// A bar for each stage of work, one at a time: of stages within another the outer one is shown.
pub struct Bars {
    is_quiet: bool,
    all: Shown,
    one: Mutex<Option<(&'static str, ProgressBar)>>,
}

impl Bars {
    /// Shows how many steps of a stage are done.
    pub fn report(&self, stage: &'static str, done: u64, count: u64) {
        let mut shown = self.one.lock().unwrap_or_else(PoisonError::into_inner);
        let (name, shown_bar) =
            shown.get_or_insert_with(|| (stage, self.all.bar(self.is_quiet, count, stage)));
        if *name != stage {
            return;
        }
        // Threads tell in any order.
        shown_bar.set_position(shown_bar.position().max(done));
        if done == count {
            shown_bar.finish_and_clear();
            *shown = None;
        }
    }
}

/// Returns the failure to print a result; none if whoever read has gone.
pub fn unprintable(error: io::Error) -> Option<Failure> {
    let is_gone = error.kind() == io::ErrorKind::BrokenPipe;
    (!is_gone).then(|| Failure::system(format!("cannot print the result: {error}")))
}
