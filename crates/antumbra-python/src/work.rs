//! Work outside of the interpreter's lock: threads, Ctrl-C.
//!
//! In: work. Out: its outcome, or `KeyboardInterrupt`. Invariant: pools of threads belong to the process that
//! made them; a forked child makes its own.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::ThreadPool;

/// How often a signal is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// Points that are answered between two looks for a signal: some tenths of a second.
pub(crate) const BLOCK: usize = 1 << 21;

/// By process and number of threads.
type Pools = HashMap<(u32, usize), Arc<ThreadPool>>;

static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// Returns the pool of so many threads; 0 for one a processor.
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

/// Does work on `threads` threads (0: one a processor) without the interpreter's lock.
pub(crate) fn on_threads<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    Ok(py.detach(|| pool.install(work)))
}

/// Does work as [`on_threads`] does, and looks for Ctrl-C meanwhile: then the flag that the work has is set, and
/// its outcome is `KeyboardInterrupt`.
pub(crate) fn cancellable<T: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let cancel = AtomicBool::new(false);
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, is_done) = channel::<()>();
            let worker = scope.spawn(|| {
                // Dropped with the thread, also by a panic.
                let _done = done;
                pool.install(|| work(&cancel))
            });
            let mut interrupted = None;
            while is_done.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                if interrupted.is_none()
                    && let Err(signal) = Python::attach(|py| py.check_signals())
                {
                    cancel.store(true, Ordering::Relaxed);
                    interrupted = Some(signal);
                }
            }
            match (worker.join(), interrupted) {
                (Err(panic), _) => std::panic::resume_unwind(panic),
                (Ok(_), Some(signal)) => Err(signal),
                (Ok(outcome), None) => Ok(outcome),
            }
        })
    })
}
