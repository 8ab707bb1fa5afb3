//! Work outside of the interpreter's lock: threads, Ctrl-C, progress.
//!
//! In: work, perhaps a callable that hears how far it is. Out: its outcome, or `KeyboardInterrupt`. Invariant: pools of threads belong to the process that
//! made them; a forked child makes its own.

use std::collections::HashMap;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use antumbra_task::Task;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use rayon::ThreadPool;

/// How often a signal is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// By process and number of threads.
type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// A stage of the work, its steps that are done, and all of them.
type Stage = (&'static str, u64, u64);

/// A callable of Python's that hears how far work is, if there is one: on the calling thread, twenty times a second
/// at most.
#[derive(Clone, Default)]
pub(crate) struct Progress {
    callable: Option<Arc<Py<PyAny>>>,
    latest: Arc<Mutex<Option<Stage>>>,
}

impl Progress {
    pub(crate) fn new(callable: Option<Py<PyAny>>) -> Self {
        Self {
            callable: callable.map(Arc::new),
            latest: Arc::default(),
        }
    }

    /// Returns whether anybody wants to know.
    pub(crate) fn is_reported(&self) -> bool {
        self.callable.is_some()
    }

    /// Notes how far a stage is, from any thread.
    pub(crate) fn note(&self, stage: &'static str, done: u64, count: u64) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        *latest = Some((stage, done, count));
    }

    /// Calls the callable if there is news.
    fn tell(&self, py: Python<'_>) -> PyResult<()> {
        let news = {
            let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
            latest.take()
        };
        if let (Some(callable), Some(news)) = (&self.callable, news) {
            callable.call1(py, news)?;
        }
        Ok(())
    }

    fn task(&self) -> Task {
        if self.callable.is_none() {
            return Task::default();
        }
        let noted = self.clone();
        Task::with_progress(move |stage, done, count| noted.note(stage, done, count))
    }
}

/// Returns the pool with this number of threads; 0 for one a processor.
fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_default();
    let process = std::process::id();
    if let Some(pool) = pools.get(&(process, threads)) {
        return Ok(Arc::clone(pool));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|number| format!("antumbra {number}"))
        .build()
        .map_err(|error| PyRuntimeError::new_err(format!("cannot start threads: {error}")))?;
    let pool = Arc::new(pool);
    pools.insert((process, threads), Arc::clone(&pool));
    Ok(pool)
}

/// Does work on `threads` threads (0: one a processor) without the interpreter's lock, and looks for signals
/// meanwhile: after Ctrl-C the work is stopped, and its outcome is `KeyboardInterrupt`.
///
/// Only the interpreter's main thread hears of signals; calls from others are not stopped by them.
pub(crate) fn stoppable<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(&Task) -> T + Send,
) -> PyResult<T> {
    watched(py, threads, &Progress::default(), work)
}

/// Does work as [`stoppable`], and reports how far it is. What the callable raises stops the work and is its outcome.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: usize,
    progress: &Progress,
    work: impl FnOnce(&Task) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let task = progress.task();
    let (sender, receiver) = channel();
    let (interrupted, done) = py.detach(move || {
        let mut interrupted = None;
        let done = pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                // Nobody waits any more only after a panic of this very thread.
                let _ = sender.send(task.run(|| work(&task)));
            });
            loop {
                match receiver.recv_timeout(PATIENCE) {
                    Ok(done) => break Some(done),
                    // The work panicked, which the scope passes on.
                    Err(RecvTimeoutError::Disconnected) => break None,
                    Err(RecvTimeoutError::Timeout) => {
                        if interrupted.is_none()
                            && let Err(signal) = Python::attach(|py| {
                                py.check_signals()?;
                                progress.tell(py)
                            })
                        {
                            task.stop();
                            interrupted = Some(signal);
                        }
                    }
                }
            }
        });
        (interrupted, done)
    });
    match (interrupted, done) {
        (Some(signal), _) => Err(signal),
        (None, Some(Ok(outcome))) => {
            progress.tell(py)?;
            Ok(outcome)
        }
        (None, Some(Err(_)) | None) => Err(PyKeyboardInterrupt::new_err(())),
    }
}
