//! What the first queries cost while values are made on the way, and when that has paid.
//!
//! In: an index whose values are forgotten, the queries of one camera, frame by frame. Out: the time of
//! the first frame, and from how many queries on all of them together took less time than rays, up to the
//! last frame.

use std::time::Duration;

use antumbra::Refine;
use antumbra_baselines::{LoadedBatch, ShadowMethod as _};

pub(super) use super::break_even::BreakEven;
use super::measure::{self, Measured, SLICE, Stopwatch};
use super::methods::Built;
use super::record::Recorded;

/// Frames of one camera in which values may pay. All are asked: who is ahead by a hair may fall back.
const MOST_FRAMES: u32 = 16;

/// Times of `auto` from nothing.
pub(super) struct Cold {
    /// The first frame's queries.
    pub(super) measured: Measured,
    /// None without `bvh`.
    pub(super) break_even: Option<BreakEven>,
}

/// Measures cold `auto`, if it is among the methods and makes its maps on the way. `more` records
/// further frames of the camera, from 1 on. Leaves no values behind.
pub(super) fn measure(
    ours: &mut [Built],
    refine: Refine,
    first: &Recorded,
    more: impl Fn(u32) -> Recorded,
    rounds: u32,
    stopwatch: Stopwatch,
    thread_count: usize,
) -> Option<Cold> {
    let position = |ours: &[Built], name| ours.iter().position(|built| built.method.name() == name);
    let auto = position(ours, "auto").filter(|_| refine != Refine::Eager)?;
    let bvh = position(ours, "bvh");
    let mut cold = Cold {
        measured: Measured::default(),
        break_even: None,
    };
    let mut later: Vec<Recorded> = Vec::new();
    let mut break_evens = Vec::new();
    for round in 0..rounds {
        ours[auto].method.index_mut().forget_values();
        let mut race = Race::default();
        for frame in 0..MOST_FRAMES {
            let recorded = match frame.checked_sub(1) {
                None => first,
                Some(number) => {
                    let number = number as usize;
                    if number == later.len() {
                        let mut recorded = more(frame);
                        // None of ours reads them.
                        recorded.batch.normals = Vec::new();
                        later.push(recorded);
                    }
                    &later[number]
                }
            };
            let run = |number: usize| {
                let loaded = ours[number].method.load(&recorded.batch);
                times(&*loaded, &recorded.is_shadowed, stopwatch, thread_count)
            };
            // Who comes first finds the queries in no cache: both take turns.
            let auto_first = (round + frame).is_multiple_of(2).then(|| run(auto));
            let by_rays = bvh.map(run);
            let (by_auto, differences) = auto_first.unwrap_or_else(|| run(auto));
            cold.measured.differences = cold.measured.differences.max(differences);
            if frame == 0 {
                let time: Duration = by_auto.iter().sum();
                let query_count = recorded.is_shadowed.len().max(1) as f64;
                let time_ns = time.as_secs_f64() * 1e9 / query_count;
                cold.measured.rounds_ns.push(time_ns);
            }
            let Some((by_rays, _)) = by_rays else {
                break;
            };
            let slice = SLICE * thread_count;
            let sizes = recorded.is_shadowed.chunks(slice).map(<[bool]>::len);
            for ((auto, rays), queries) in by_auto.into_iter().zip(by_rays).zip(sizes) {
                race.run(auto, rays, queries);
            }
        }
        break_evens.push(
            race.ahead_since
                .map_or(f64::INFINITY, |queries| queries as f64),
        );
    }
    ours[auto].method.index_mut().forget_values();
    cold.break_even = bvh.map(|_| {
        let queries = measure::median(break_evens.into_iter());
        BreakEven {
            queries: queries.is_finite().then_some(queries),
            most_frames: MOST_FRAMES,
            frame_queries: first.is_shadowed.len(),
        }
    });
    Some(cold)
}

/// Answers a frame once and returns the time of every slice, and how many answers are not the
/// expected ones.
fn times(
    method: &dyn LoadedBatch,
    expected: &[bool],
    stopwatch: Stopwatch,
    thread_count: usize,
) -> (Vec<Duration>, u64) {
    let mut found = vec![true; SLICE * thread_count];
    let mut all_differences = 0;
    let slices = expected.chunks(SLICE * thread_count).enumerate();
    let times = slices.map(|(number, expected)| {
        let first = number * SLICE * thread_count;
        let found = &mut found[..expected.len()];
        let (differences, time) = stopwatch
            .time(|| measure::count_differences(method, first, expected, found, SLICE, stopwatch));
        all_differences += differences;
        time
    });
    (times.collect(), all_differences)
}

/// Two methods' total times.
#[derive(Debug, Default)]
struct Race {
    auto: Duration,
    rays: Duration,
    queries: u64,
    /// Queries after which the first was ahead for the rest of the way.
    ahead_since: Option<u64>,
}

impl Race {
    fn run(&mut self, auto: Duration, rays: Duration, queries: usize) {
        self.auto += auto;
        self.rays += rays;
        self.queries += queries as u64;
        if self.auto >= self.rays {
            self.ahead_since = None;
        } else {
            self.ahead_since.get_or_insert(self.queries);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ahead_counts_from_where_it_lasts() {
        let mut race = Race::default();
        let ahead = [(3, 4), (9, 2), (1, 6), (1, 2), (2, 2)].map(|(auto, rays)| {
            race.run(Duration::from_nanos(auto), Duration::from_nanos(rays), 10);
            race.ahead_since
        });
        // Totals: 3 to 4, 12 to 6, 13 to 12, 14 to 14, 16 to 16.
        assert_eq!(ahead, [Some(10), None, None, None, None]);
        race.run(Duration::from_nanos(1), Duration::from_nanos(2), 10);
        race.run(Duration::from_nanos(2), Duration::from_nanos(2), 10);
        assert_eq!(race.ahead_since, Some(60));
    }
}
