//! Signals. Ctrl-C: the work is asked to stop, and what it held is released. Work that does not stop at once is ended
//! with the process, unless it has a partial result to keep; so is any work by the second Ctrl-C. A request to
//! terminate ends the process at once. Files that are not finished are gone then.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use antumbra_task::Task;

use crate::failure::Failure;

/// The exit code after Ctrl-C: 128 + SIGINT, as shells have it.
pub(crate) const EXIT_CODE: u8 = 130;

/// The exit code after a request to terminate: 128 + SIGTERM.
#[cfg(unix)]
const EXIT_CODE_TERMINATED: u8 = 143;

/// How long work may take to stop.
const PATIENCE: Duration = Duration::from_millis(700);

/// The work that Ctrl-C stops.
#[derive(Clone, Debug)]
pub(crate) struct Interrupt {
    task: Task,
    /// Whether there is a partial result worth keeping.
    is_worth_keeping: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes over Ctrl-C for the whole process.
    pub(crate) fn install(task: Task) -> Result<Self, Failure> {
        let interrupt = Self {
            task,
            is_worth_keeping: Arc::default(),
        };
        let Self {
            task,
            is_worth_keeping,
        } = interrupt.clone();
        ctrlc::set_handler(move || {
            let is_first = !task.is_stopped();
            task.stop();
            if is_first {
                if is_worth_keeping.load(Ordering::SeqCst) {
                    return;
                }
                // This thread does nothing else.
                std::thread::sleep(PATIENCE);
            }
            end(EXIT_CODE);
        })
        .map_err(|error| Failure::system(format!("cannot take over Ctrl-C: {error}")))?;
        #[cfg(unix)]
        unix::install()
            .map_err(|error| Failure::system(format!("cannot take over signals: {error}")))?;
        Ok(interrupt)
    }

    /// Says that from now on there is a partial result, which Ctrl-C shall leave behind.
    pub(crate) fn keep_partial_results(&self) {
        self.is_worth_keeping.store(true, Ordering::SeqCst);
    }

    /// Returns the work that is stopped.
    pub(crate) fn task(&self) -> &Task {
        &self.task
    }
}

/// Ends the process; what it was writing is gone.
fn end(code: u8) -> ! {
    antumbra_files::abandon();
    std::process::exit(i32::from(code))
}

/// Signals that only Unix has.
#[cfg(unix)]
mod unix {
    use std::io;
    use std::sync::Arc;

    use signal_hook::consts::SIGTERM;
    use signal_hook::iterator::Signals;

    /// Ends at a request to terminate, and goes on at the limit of a file's size (`ulimit -f`): then writing fails,
    /// and says so.
    pub(super) fn install() -> io::Result<()> {
        signal_hook::flag::register(rustix::process::Signal::XFSZ.as_raw(), Arc::default())?;
        let mut terminations = Signals::new([SIGTERM])?;
        let wait = move || {
            if terminations.forever().next().is_some() {
                super::end(super::EXIT_CODE_TERMINATED);
            }
        };
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(wait)
            .map(drop)
    }
}
