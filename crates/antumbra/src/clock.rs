//! How long work takes that values are made or spared for.

/// A reading of the clock: processor time of this thread where the system tells it, so that other work on
/// the machine does not count; else time on the wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading(#[cfg(unix)] u64, #[cfg(not(unix))] std::time::Instant);

impl Reading {
    #[cfg(unix)]
    pub(crate) fn now() -> Self {
        #[cfg(test)]
        READ.set(READ.get() + 1);
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        // Neither is negative.
        Self(now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64)
    }

    #[cfg(not(unix))]
    pub(crate) fn now() -> Self {
        Self(std::time::Instant::now())
    }

    /// Returns the nanoseconds since the reading, which was on this thread.
    #[cfg(unix)]
    pub(crate) fn elapsed_ns(self) -> u64 {
        Self::now().0.saturating_sub(self.0)
    }

    #[cfg(not(unix))]
    pub(crate) fn elapsed_ns(self) -> u64 {
        self.0.elapsed().as_nanos() as u64
    }

    /// Returns the nanoseconds from an earlier reading on the same thread to this one.
    #[cfg(unix)]
    pub(crate) fn since_ns(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    #[cfg(not(unix))]
    pub(crate) fn since_ns(self, earlier: Self) -> u64 {
        self.0.saturating_duration_since(earlier.0).as_nanos() as u64
    }
}

#[cfg(all(test, unix))]
thread_local! {
    /// How often this thread has read the clock.
    pub(crate) static READ: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}
