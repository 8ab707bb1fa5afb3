//! The sub-commands, one file each.

pub(crate) mod bake;
pub(crate) mod bench;
pub(crate) mod convert;
pub(crate) mod export;
pub(crate) mod inspect;
pub(crate) mod kept;
pub(crate) mod query;
pub(crate) mod render;
pub(crate) mod scene;
pub(crate) mod verify;

use crate::failure::Failure;
use crate::typed::Threads;

/// Runs work on as many threads as typed, or one a processor; it belongs to the caller's task.
fn on_threads<T: Send>(typed: &Threads, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let count = typed.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .map_err(|error| Failure::system(format!("cannot start threads: {error}")))?;
    let task = antumbra_task::current();
    Ok(pool.install(|| task.enter(work)))
}
