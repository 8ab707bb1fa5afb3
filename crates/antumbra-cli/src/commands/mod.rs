//! The sub-commands, one file each.

pub mod bake;
pub mod convert;
pub mod export;
pub mod inspect;
pub mod query;
pub mod render;
pub mod scene;
pub mod sun;
pub mod verify;

use crate::failure::Failure;
use crate::typed::Threads;

/// Runs work on as many threads as typed, or one a processor; it belongs to the caller's task.
pub fn on_threads<T: Send>(typed: &Threads, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let count = typed.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .map_err(|error| Failure::system(format!("cannot start threads: {error}")))?;
    let task = antumbra_task::current();
    Ok(pool.install(|| task.enter(work)))
}
