//! Interleaved rounds.
//!
//! In: loaded batches of all methods, the expected answers. Out: for each method the nanoseconds a
//! query of every round, and how many answers were not the expected ones. Answers are compared
//! inside the timed loop, for every method alike. On a shared machine one thread's processor time
//! is steadier than the time on the wall, so that is what one thread is measured by.

use std::time::{Duration, Instant};

use antumbra_baselines::LoadedBatch;
use rayon::prelude::*;

/// Queries a call: enough to let a method sort them, few enough that all threads get some.
pub(super) const SLICE: usize = 16_384;
/// What a method does in a round at least; small batches are repeated.
const LEAST_TIME: Duration = Duration::from_millis(20);

/// Time that a way to answer everything takes in a round at least; it is repeated until then.
const LEAST_TIME_OF_WAYS: Duration = Duration::from_millis(50);

/// A way to answer everything once: its name, and what returns how many answers are not the expected ones.
pub(super) type Way<'a> = (&'static str, Box<dyn FnMut() -> u64 + 'a>);

/// How time is taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch {
    is_one_thread: bool,
}

impl Stopwatch {
    pub(super) fn new(thread_count: usize) -> Self {
        Self {
            is_one_thread: thread_count == 1,
        }
    }

    /// Returns whether the time of one thread is measured, which all work has to be on.
    pub(super) fn is_one_thread(self) -> bool {
        self.is_one_thread
    }

    /// Returns what is measured, for tables.
    pub(super) fn name(self) -> &'static str {
        if self.is_one_thread && cfg!(unix) {
            "processor time of the thread"
        } else {
            "time on the wall"
        }
    }

    /// Runs work and returns how long it took. With one thread, call it on that thread.
    pub(super) fn time<T>(self, work: impl FnOnce() -> T) -> (T, Duration) {
        let begin = self.now();
        let result = work();
        (result, self.now().saturating_sub(begin))
    }

    fn now(self) -> Duration {
        if self.is_one_thread
            && let Some(now) = thread_time()
        {
            return now;
        }
        static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        BEGIN.get_or_init(Instant::now).elapsed()
    }
}

#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    let seconds = u64::try_from(now.tv_sec).ok()?;
    let nanoseconds = u32::try_from(now.tv_nsec).ok()?;
    Some(Duration::new(seconds, nanoseconds))
}

#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
}

/// What the rounds found about one method.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    /// Nanoseconds a query, round by round.
    pub(super) rounds_ns: Vec<f64>,
    /// Answers of one pass that were not the expected ones; the largest of all passes.
    pub(super) differences: u64,
}

impl Measured {
    pub(super) fn median_ns(&self) -> f64 {
        median(self.rounds_ns.iter().copied())
    }

    /// Returns the median of the rounds' ratios of this method's time to another's.
    pub(super) fn ratio_to(&self, other: &Self) -> f64 {
        let rounds = self.rounds_ns.iter().zip(&other.rounds_ns);
        median(rounds.map(|(own, other)| own / other))
    }

    /// Returns how far the rounds lie apart: the middle half's width over the median.
    pub(super) fn spread(&self) -> f64 {
        let mut sorted = self.rounds_ns.clone();
        sorted.sort_by(f64::total_cmp);
        let quarter = sorted.len() / 4;
        match (sorted.get(quarter), sorted.get(sorted.len() - 1 - quarter)) {
            (Some(low), Some(high)) => (high - low) / self.median_ns(),
            _ => 0.0,
        }
    }
}

/// Returns the middle of some numbers, the mean of two middles, NaN of none.
pub(super) fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<_> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// Returns the geometric mean, NaN of none.
pub(super) fn geometric_mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let logarithms: Vec<_> = numbers.map(libm::log).collect();
    libm::exp(logarithms.iter().sum::<f64>() / logarithms.len() as f64)
}

/// Lets all methods take turns. Each round begins with another method.
pub(super) fn interleave(
    methods: &[Box<dyn LoadedBatch + '_>],
    expected: &[bool],
    rounds: u32,
    stopwatch: Stopwatch,
) -> Vec<Measured> {
    let mut all = vec![Measured::default(); methods.len()];
    let mut found = vec![false; expected.len()];
    for round in 0..rounds as usize {
        for turn in 0..methods.len() {
            let number = (round + turn) % methods.len();
            let method = &*methods[number];
            let ((passes, differences), time) = stopwatch.time(|| {
                let begin = Instant::now();
                let (mut passes, mut differences) = (0u32, 0);
                while passes == 0 || begin.elapsed() < LEAST_TIME {
                    let here = count_differences(method, 0, expected, &mut found, SLICE, stopwatch);
                    differences = here.max(differences);
                    passes += 1;
                }
                (passes, differences)
            });
            let queries = f64::from(passes) * expected.len().max(1) as f64;
            let measured = &mut all[number];
            measured.rounds_ns.push(time.as_secs_f64() * 1e9 / queries);
            measured.differences = measured.differences.max(differences);
        }
    }
    all
}

/// Lets all ways take turns, each of which gives so many answers. Each round begins with another one.
pub(super) fn interleave_ways(
    ways: &mut [Way<'_>],
    count: usize,
    rounds: u32,
    stopwatch: Stopwatch,
) -> Vec<Measured> {
    let mut all = vec![Measured::default(); ways.len()];
    for round in 0..rounds as usize {
        for turn in 0..ways.len() {
            let number = (round + turn) % ways.len();
            let way = &mut ways[number].1;
            let ((passes, differences), time) = stopwatch.time(|| {
                let begin = Instant::now();
                let (mut passes, mut differences) = (0_u32, 0);
                while passes == 0 || begin.elapsed() < LEAST_TIME_OF_WAYS {
                    differences = way().max(differences);
                    passes += 1;
                }
                (passes, differences)
            });
            let answers = f64::from(passes) * count.max(1) as f64;
            all[number]
                .rounds_ns
                .push(time.as_secs_f64() * 1e9 / answers);
            all[number].differences = all[number].differences.max(differences);
        }
    }
    all
}

/// Answers queries once, at most so many a call, from the one numbered `first` on, and counts answers that are
/// not the expected ones. A slice takes a multiple of 8.
pub(super) fn count_differences(
    method: &dyn LoadedBatch,
    first: usize,
    expected: &[bool],
    found: &mut [bool],
    slice: usize,
    stopwatch: Stopwatch,
) -> u64 {
    /// Rays of the largest packets: no call begins within one.
    const PACKET: usize = 16;
    // Fewer a call where one call would leave threads without.
    let share = expected.len().div_ceil(rayon::current_num_threads());
    let slice = slice.min(share.next_multiple_of(PACKET).max(PACKET));
    let run = |(number, (found, expected)): (usize, (&mut [bool], &[bool]))| {
        method.answer(first + number * slice, found);
        // Few enough at a time for sums of bytes, which cost next to nothing beside what is timed.
        let parts = found.chunks(128).zip(expected.chunks(128));
        parts
            .map(|(found, expected)| {
                let pairs = found.iter().zip(expected);
                u64::from(pairs.fold(0, |sum: u8, (a, b)| sum + u8::from(a != b)))
            })
            .sum::<u64>()
    };
    if stopwatch.is_one_thread {
        let slices = found.chunks_mut(slice).zip(expected.chunks(slice));
        slices.enumerate().map(run).sum()
    } else {
        let slices = found.par_chunks_mut(slice).zip(expected.par_chunks(slice));
        slices.enumerate().map(run).sum()
    }
}

/// Returns all answers of a method.
pub(super) fn answers(method: &dyn LoadedBatch, count: usize) -> Vec<bool> {
    let mut answers = vec![false; count];
    answers
        .par_chunks_mut(SLICE)
        .enumerate()
        .for_each(|(number, answers)| method.answer(number * SLICE, answers));
    answers
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Says that every third query is in shadow.
    struct Thirds;

    impl LoadedBatch for Thirds {
        fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
            for (i, is_shadowed) in is_shadowed.iter_mut().enumerate() {
                *is_shadowed = (first + i).is_multiple_of(3);
            }
        }
    }

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), 2.5);
        assert!(median(std::iter::empty()).is_nan());
        assert!((geometric_mean([2.0, 8.0].into_iter()) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn different_answers_are_counted_over_all_runs() {
        let mut expected = answers(&Thirds, 50_000);
        for thread_count in [1, 2] {
            let stopwatch = Stopwatch::new(thread_count);
            let methods: [Box<dyn LoadedBatch>; 2] = [Box::new(Thirds), Box::new(Thirds)];
            let measured = interleave(&methods, &expected, 3, stopwatch);
            assert_eq!(measured[1].rounds_ns.len(), 3);
            assert_eq!(measured[1].differences, 0);
        }
        for wrong in [0, 15_000, 49_999] {
            expected[wrong] ^= true;
        }
        let stopwatch = Stopwatch::new(1);
        let measured = interleave(&[Box::new(Thirds)], &expected, 1, stopwatch);
        assert_eq!(measured[0].differences, 3);
        assert!(measured[0].median_ns() > 0.0);
    }
}
