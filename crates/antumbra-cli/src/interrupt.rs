//! Ctrl-C: the first one during rendering asks for the partial picture, any other ends at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// The exit code after Ctrl-C: 128 + SIGINT, as shells have it.
pub(crate) const EXIT_CODE: u8 = 130;

/// Whether and how Ctrl-C was pressed.
#[derive(Clone, Debug)]
pub(crate) struct Interrupt {
    /// Set by the first Ctrl-C while work can be cancelled.
    cancel: Arc<AtomicBool>,
    /// Whether there is a partial result worth keeping.
    is_worth_keeping: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes over Ctrl-C for the whole process.
    pub(crate) fn install() -> Result<Self, Failure> {
        let interrupt = Self {
            cancel: Arc::default(),
            is_worth_keeping: Arc::default(),
        };
        let Self {
            cancel,
            is_worth_keeping,
        } = interrupt.clone();
        ctrlc::set_handler(move || {
            let is_first = !cancel.swap(true, Ordering::SeqCst);
            if !(is_first && is_worth_keeping.load(Ordering::SeqCst)) {
                std::process::exit(i32::from(EXIT_CODE));
            }
        })
        .map_err(|error| Failure::system(format!("cannot take over Ctrl-C: {error}")))?;
        Ok(interrupt)
    }

    /// Says that from now on there is a partial result, which Ctrl-C shall leave behind.
    pub(crate) fn keep_partial_results(&self) {
        self.is_worth_keeping.store(true, Ordering::SeqCst);
    }

    /// Returns the flag that stops the work.
    pub(crate) fn cancel(&self) -> &AtomicBool {
        &self.cancel
    }
}
