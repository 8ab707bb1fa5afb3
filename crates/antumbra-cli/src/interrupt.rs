//! Signals that ask for an end: Ctrl-C, a request to terminate, a terminal that is closed. All are alike but for the
//! exit code. The work is asked to stop, and what it held is released. Work that does not stop at once is ended with
//! the process, unless it has a partial result to keep; so is any work by the second signal. Files that are not
//! finished are gone then.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::Duration;

use antumbra_task::Task;

use crate::failure::Failure;
use crate::screen::Shown;

/// The number of Ctrl-C among signals, on all systems alike.
const SIGINT: u8 = 2;

/// How long work may take to stop.
const PATIENCE: Duration = Duration::from_millis(700);

/// The work that signals stop.
#[derive(Clone, Debug)]
pub struct Interrupt {
    task: Task,
    /// Whether there is a partial result worth keeping.
    is_worth_keeping: Arc<AtomicBool>,
    /// The first signal that came; 0 before.
    signal: Arc<AtomicU8>,
    /// What is to be taken off the screen.
    shown: Shown,
}

impl Interrupt {
    /// Takes over the signals for the whole process.
    pub fn install(task: Task, shown: Shown) -> Result<Self, Failure> {
        let interrupt = Self {
            task,
            is_worth_keeping: Arc::default(),
            signal: Arc::default(),
            shown,
        };
        let at_ctrl_c = interrupt.clone();
        ctrlc::set_handler(move || at_ctrl_c.come(SIGINT))
            .map_err(|error| Failure::system(format!("cannot take over Ctrl-C: {error}")))?;
        #[cfg(unix)]
        unix::install(&interrupt)
            .map_err(|error| Failure::system(format!("cannot take over signals: {error}")))?;
        Ok(interrupt)
    }

    /// Returns the exit code of a process that a signal ended, as shells have it: 128 and its number.
    pub fn exit_code(&self) -> u8 {
        128 + self.signal.load(Ordering::SeqCst)
    }

    /// Stops the work because of a signal. On a thread that does nothing else.
    fn come(&self, signal: u8) {
        let first = self
            .signal
            .compare_exchange(0, signal, Ordering::SeqCst, Ordering::SeqCst);
        self.task.stop();
        if first.is_err() {
            self.end();
        }
        if self.is_worth_keeping.load(Ordering::SeqCst) {
            return;
        }
        // Beside the thread that waits for the next signal.
        let interrupt = self.clone();
        std::thread::spawn(move || {
            std::thread::sleep(PATIENCE);
            interrupt.end();
        });
    }

    /// Says that from now on there is a partial result, which signals shall leave behind.
    pub fn keep_partial_results(&self) {
        self.is_worth_keeping.store(true, Ordering::SeqCst);
    }

    /// Ends the process; what it was writing is gone.
    fn end(&self) -> ! {
        self.shown.clear();
        antumbra_files::abandon();
        std::process::exit(i32::from(self.exit_code()))
    }

    /// Returns the work that is stopped.
    pub fn task(&self) -> &Task {
        &self.task
    }
}

/// Signals that only Unix has.
#[cfg(unix)]
mod unix {
    use std::io;
    use std::sync::Arc;

    use signal_hook::consts::{SIGHUP, SIGTERM};
    use signal_hook::iterator::Signals;

    use super::Interrupt;

    /// Stops at a request to terminate and when the terminal is closed, and goes on at the limit of a file's size
    /// (`ulimit -f`): then writing fails, and says so.
    pub(super) fn install(interrupt: &Interrupt) -> io::Result<()> {
        signal_hook::flag::register(rustix::process::Signal::XFSZ.as_raw(), Arc::default())?;
        let hangup = (!is_hangup_ignored()).then_some(SIGHUP);
        let mut ends = Signals::new(hangup.into_iter().chain([SIGTERM]))?;
        let interrupt = interrupt.clone();
        let wait = move || {
            for signal in ends.forever() {
                interrupt.come(signal as u8);
            }
        };
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(wait)
            .map(drop)
    }

    /// Returns whether this process is to outlive its terminal (`nohup`). Where the system does not tell, the signal
    /// keeps what it does by itself: that is right under `nohup`, too.
    fn is_hangup_ignored() -> bool {
        let told = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = told.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        mask.is_none_or(|mask| mask >> (SIGHUP - 1) & 1 == 1)
    }
}
