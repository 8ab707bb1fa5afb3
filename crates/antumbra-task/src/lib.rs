//! Stopping and watching long calls.
//!
//! In: a [`Task`], held by the caller. Out: the result of the work, or [`Stopped`]. Invariant: work that is not
//! stopped does not depend on being watched. Absent here: threads and signals; who holds a task decides when to
//! stop it.
//!
//! Work calls [`check`] between steps of bounded time, and hands its [`Current`] task to the threads that it
//! uses. A stopped task ends by unwinding, as a panic does but without a message: `check` does not return, and
//! [`Task::run`] does. So no function on the way needs to know of it, and destructors release what was held. A
//! program that is built with `panic = "abort"` ends as a whole instead.

#![warn(missing_docs)]

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// The work was stopped before it was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was done")]
pub struct Stopped;

/// What [`check`] unwinds with: the task that was stopped.
struct Unwinding(Arc<Shared>);

type Progress = dyn Fn(&'static str, u64, u64) + Send + Sync;

#[derive(Default)]
struct Shared {
    is_stopped: AtomicBool,
    progress: Option<Box<Progress>>,
}

impl Shared {
    fn check(self: &Arc<Self>) {
        if self.is_stopped.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Unwinding(Arc::clone(self))));
        }
    }
}

/// Work that another thread may stop, and that may say how far it is. Clones are the same task.
///
/// ```
/// use antumbra_task::{Stopped, Task, check};
///
/// let task = Task::default();
/// assert_eq!(task.run(|| 1 + 1), Ok(2));
/// task.stop();
/// assert_eq!(task.run(|| check()), Err(Stopped));
/// ```
#[derive(Clone, Default)]
pub struct Task(Arc<Shared>);

impl std::fmt::Debug for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Task")
            .field("is_stopped", &self.is_stopped())
            .finish_non_exhaustive()
    }
}

impl Task {
    /// Makes a task that says how far it is. `progress` takes the name of a stage, the steps of it that are
    /// done, and their number; any thread of the work may call it.
    pub fn with_progress(
        progress: impl Fn(&'static str, u64, u64) + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(Shared {
            progress: Some(Box::new(progress)),
            ..Shared::default()
        }))
    }

    /// Asks the work to end soon. It cannot be resumed.
    pub fn stop(&self) {
        self.0.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Returns whether it was asked to end.
    pub fn is_stopped(&self) -> bool {
        self.0.is_stopped.load(Ordering::Relaxed)
    }

    /// Does work that belongs to this task.
    ///
    /// What the work has changed when it is stopped stays as it is. The calls of `antumbra` leave a shadow
    /// index fit for use, and slices that they write to written in parts.
    ///
    /// # Errors
    /// The task was stopped, and the work noticed.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Result<T, Stopped> {
        let current = Current(Some(Arc::clone(&self.0)));
        let done = catch_unwind(AssertUnwindSafe(|| current.enter(work)));
        done.map_err(|payload| match payload.downcast_ref::<Unwinding>() {
            Some(Unwinding(stopped)) if Arc::ptr_eq(stopped, &self.0) => Stopped,
            _ => resume_unwind(payload),
        })
    }
}

thread_local! {
    static CURRENT: RefCell<Current> = const { RefCell::new(Current(None)) };
}

/// The task that a thread works for, if any: to be handed to the threads that help it.
#[derive(Clone, Default)]
pub struct Current(Option<Arc<Shared>>);

impl std::fmt::Debug for Current {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Current").field(&self.0.is_some()).finish()
    }
}

/// Puts the task back that a thread worked for before.
struct Restore(Current);

impl Drop for Restore {
    fn drop(&mut self) {
        CURRENT.set(std::mem::take(&mut self.0));
    }
}

impl Current {
    /// Does work for this task on the calling thread, whatever that works for otherwise.
    #[inline]
    pub fn enter<T>(&self, work: impl FnOnce() -> T) -> T {
        let _restore = Restore(CURRENT.replace(self.clone()));
        work()
    }

    /// Ends the work if its task was stopped; see [`check`].
    #[inline]
    pub fn check(&self) {
        if let Some(shared) = &self.0 {
            shared.check();
        }
    }
}

/// Returns the task that the calling thread works for.
pub fn current() -> Current {
    CURRENT.with_borrow(Clone::clone)
}

/// Ends the calling thread's work if its task was stopped: then it does not return but unwinds to
/// [`Task::run`]. Takes some nanoseconds; to be called between steps of some milliseconds or less.
#[inline]
pub fn check() {
    CURRENT.with_borrow(Current::check);
}

/// Returns the same items, and calls [`check`] before every 256th: for loops whose steps take microseconds.
#[inline]
pub fn checked<I: IntoIterator>(items: I) -> impl Iterator<Item = I::Item> {
    const STRIDE: usize = 256;
    let numbered = items.into_iter().enumerate();
    numbered.map(|(number, item)| {
        if number.is_multiple_of(STRIDE) {
            check();
        }
        item
    })
}

/// Does work that is not stopped, such as keeping what a stopped task has found.
pub fn unwatched<T>(work: impl FnOnce() -> T) -> T {
    Current(None).enter(work)
}

/// The steps of a stage of work, reported to who watches the task.
#[derive(Debug)]
pub struct Steps {
    current: Current,
    name: &'static str,
    done: AtomicU64,
    count: u64,
}

impl Steps {
    /// Begins a stage of so many steps.
    pub fn new(name: &'static str, count: u64) -> Self {
        Self {
            current: current(),
            name,
            done: AtomicU64::new(0),
            count,
        }
    }

    /// Does a step on the calling thread, and reports it.
    pub fn step<T>(&self, work: impl FnOnce() -> T) -> T {
        let found = self.current.enter(|| {
            check();
            work()
        });
        self.tell(1 + self.done.fetch_add(1, Ordering::Relaxed));
        found
    }

    fn tell(&self, done: u64) {
        let shared = self.current.0.as_deref();
        if let Some(progress) = shared.and_then(|shared| shared.progress.as_ref()) {
            progress(self.name, done, self.count);
        }
    }
}

/// A stage that ends with steps left, because there was nothing to do in them or it was stopped, ends for who
/// watches, too.
impl Drop for Steps {
    fn drop(&mut self) {
        if *self.done.get_mut() < self.count {
            self.tell(self.count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn work_that_nobody_stops_is_done() {
        check();
        assert_eq!(Task::default().run(|| (check(), 5).1), Ok(5));
    }

    #[test]
    fn a_helping_thread_stops_with_the_task_that_it_was_handed() {
        let task = Task::default();
        let stopped = task.run(|| {
            let current = current();
            std::thread::scope(|scope| {
                let helper = scope.spawn(|| {
                    // Its own work is not the task's.
                    check();
                    current.enter(|| {
                        loop {
                            check();
                        }
                    })
                });
                task.stop();
                let Err(payload) = helper.join();
                resume_unwind(payload)
            });
        });
        assert_eq!(stopped, Err(Stopped));
        // And the calling thread works for nobody again.
        check();
    }

    #[test]
    fn a_panic_is_no_stop_and_another_task_is_not_this_one() {
        let panicked = catch_unwind(|| Task::default().run(|| resume_unwind(Box::new(7))));
        assert_eq!(panicked.unwrap_err().downcast_ref::<i32>(), Some(&7));
        let (outer, inner) = (Task::default(), Task::default());
        outer.stop();
        let outer_stopped = outer.run(|| {
            let of_outer = current();
            let _: Result<(), _> = inner.run(|| of_outer.check());
        });
        assert_eq!(outer_stopped, Err(Stopped));
    }

    #[test]
    fn what_is_unwatched_goes_on() {
        let task = Task::default();
        task.stop();
        assert_eq!(task.run(|| unwatched(|| (check(), 3).1)), Ok(3));
    }

    #[test]
    fn steps_are_told_in_the_order_they_are_done() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let task = Task::with_progress({
            let told = Arc::clone(&told);
            move |name, done, count| told.lock().unwrap().push((name, done, count))
        });
        let done = task.run(|| {
            let steps = Steps::new("thirds", 3);
            (steps.step(|| 1), steps.step(|| 2))
        });
        assert_eq!(done, Ok((1, 2)));
        // The last one was left out.
        let expected = [1, 2, 3].map(|done| ("thirds", done, 3));
        assert_eq!(*told.lock().unwrap(), expected);
    }
}
