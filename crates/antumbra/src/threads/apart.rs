//! Work for which others of the pool wait.
//!
//! In: work that may use many threads. Out: what it returns. Invariant: while it lasts, this thread takes up nothing else. A
//! thread of a pool that waits for its own parts of some work does other work meanwhile, such as a query that waits for
//! the very thing that is being made.

use std::panic::resume_unwind;

use rayon::ThreadPoolBuilder;

/// Does the work on threads of its own, as many as the current pool has; on this one where there are none to be had.
pub(crate) fn apart<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = ThreadPoolBuilder::new().num_threads(rayon::current_num_threads());
    let Ok(pool) = pool.build() else {
        return work();
    };
    let task = antumbra_task::current();
    let (pool, task) = (&pool, &task);
    let done = std::thread::scope(|scope| {
        let thread = scope.spawn(move || pool.install(|| task.enter(work)));
        thread.join()
    });
    done.unwrap_or_else(|payload| resume_unwind(payload))
}
