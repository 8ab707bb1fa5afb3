//! When a map pays.
//!
//! In: what queries took, by rays and by the map, and how many are known to come. Out: whether to make the map, and
//! whether to ask it. Rays answer until an eighth of their time, past and promised, outweighs the map's price. So all
//! together takes at most an eighth longer than rays alone, and an eighth of a promise that is not kept; tiles likewise,
//! which are made where rays to them took twice as long. Times are measured in this process;
//! answers do not depend on them.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// So much of the time that rays took, and would take for the queries that are known to come, may a map cost.
const OF_PAST: f64 = 0.125;
const OF_COMING: f64 = 0.125;

/// A map whose answers take longer than rays is asked by one chunk of queries in so many.
const SELDOM: u32 = 16;

/// Of a map that knows less than this share of what it is asked more is made as it is asked.
const LITTLE: f32 = 0.5;

/// One single query in so many asks a map that is not worth asking.
const FEW: u64 = 32;

/// So many chunks may ask it in vain until it counts.
const VAIN: u32 = 32;

/// How much of what a chunk of so many queries took comes into what queries took lately.
const RECENT: f32 = 0.25;
const FULL: f32 = 8_192.0;
/// A ray takes about so long as long as none was measured, in nanoseconds.
const USUAL_RAY: f32 = 100.0;

/// What some queries took: by rays, or by the map without the rays that it left, and making cells for them beside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spent {
    pub(crate) queries: u64,
    pub(crate) ns: u64,
    pub(crate) made: u64,
    pub(crate) is_by_map: bool,
    /// Those that the map has answered.
    pub(crate) known: u64,
}

impl Spent {
    /// Returns the account of making something beside queries.
    pub(crate) fn making(ns: u64) -> Self {
        Self {
            queries: 0,
            ns: 0,
            made: ns,
            is_by_map: false,
            known: 0,
        }
    }
}

/// Numbers of [`Prices::recent`].
const BY_RAYS: usize = 0;
const BY_MAP: usize = 1;
const KNOWN: usize = 2;

/// The account of one light. Threads add to it now and then.
#[derive(Debug, Default)]
pub(crate) struct Prices {
    /// What a query took lately in nanoseconds, by rays and by the map, and which share the map answered: the bits of an
    /// `f32`, 0 if none was measured.
    recent: [AtomicU32; 3],
    by_rays_ns: AtomicU64,
    /// What making took.
    made_ns: AtomicU64,
    /// Queries that are known to come.
    expected: AtomicU64,
    tries: AtomicU32,
    /// Chunks that asked a map in vain, most of them.
    vain: AtomicU32,
}

impl Prices {
    /// Notes that at least so many queries are known to come.
    pub(crate) fn expect(&self, queries: u64) {
        self.expected.fetch_max(queries, Ordering::Relaxed);
    }

    /// Returns about how many queries are known to come.
    pub(crate) fn expected(&self) -> u64 {
        self.expected.load(Ordering::Relaxed)
    }

    pub(crate) fn note(&self, spent: &Spent) {
        let less = |expected: u64| Some(expected.saturating_sub(spent.queries));
        let (order, expected) = (Ordering::Relaxed, &self.expected);
        // It never fails.
        let _ = expected.fetch_update(order, order, less);
        self.made_ns.fetch_add(spent.made, order);
        if !spent.is_by_map {
            self.by_rays_ns.fetch_add(spent.ns, order);
        }
        if spent.queries == 0 {
            return;
        }
        // What is asked in vain at first says nothing of what a map takes when there is more of it.
        if spent.is_by_map {
            let is_vain = 2 * spent.known < spent.queries;
            let vain = if is_vain {
                self.vain.fetch_add(1, order)
            } else {
                VAIN
            };
            if vain < VAIN {
                return;
            }
        }
        // Few say little: the first of a call find the caches cold.
        let weight = RECENT * (spent.queries as f32 / FULL).min(1.0);
        let update = |way: usize, now: f32| {
            let before = self.recent(way);
            let mean = match before > 0.0 {
                true => before + weight * (now - before),
                false => now,
            };
            self.recent[way].store(mean.to_bits(), order);
        };
        let queries = spent.queries as f32;
        update(usize::from(spent.is_by_map), spent.ns as f32 / queries);
        if spent.is_by_map {
            update(KNOWN, spent.known as f32 / queries);
        }
    }

    fn recent(&self, way: usize) -> f32 {
        f32::from_bits(self.recent[way].load(Ordering::Relaxed))
    }

    /// Returns what a ray took lately, in nanoseconds.
    pub(crate) fn ray_ns(&self) -> f32 {
        match self.recent(BY_RAYS) {
            0.0 => USUAL_RAY,
            recent => recent,
        }
    }

    /// Returns whether to make something of a price, in nanoseconds.
    pub(crate) fn allow(&self, price: u64) -> bool {
        let past = self.by_rays_ns.load(Ordering::Relaxed);
        let made = self.made_ns.load(Ordering::Relaxed);
        pays(price, made, past, self.expected(), self.ray_ns())
    }

    /// Returns whether to ask the map: there is too little of it to tell, it takes less than the rays that it saves, or it
    /// is time to see whether it does.
    pub(crate) fn is_map_worth_it(&self) -> bool {
        let [ray, map, known] = [BY_RAYS, BY_MAP, KNOWN].map(|way| self.recent(way));
        known < LITTLE
            || map <= known * ray
            || self
                .tries
                .fetch_add(1, Ordering::Relaxed)
                .is_multiple_of(SELDOM)
    }
}

impl Prices {
    /// Returns whether to ask the map a single query for which a number was drawn: it takes less than the rays that it
    /// saves, or the query is one of a few. Of what single queries ask in vain hardly any is made, so all of them would
    /// wait for a map that knows little.
    #[inline]
    pub(crate) fn is_map_worth_one(&self, drawn: u64) -> bool {
        let [ray, map, known] = [
            self.recent(BY_RAYS),
            self.recent(BY_MAP),
            self.recent(KNOWN),
        ];
        (map > 0.0 && map <= known * ray) || drawn.is_multiple_of(FEW)
    }
}

/// Returns whether something of a price may be made, after so much was spent on making, rays took so long, and so many
/// queries are known to come that would take a ray each; in nanoseconds.
fn pays(price: u64, made: u64, by_rays: u64, expected: u64, ray: f32) -> bool {
    let to_come = expected as f64 * f64::from(ray);
    (made + price) as f64 <= OF_PAST * by_rays as f64 + OF_COMING * to_come
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_made_when_rays_past_and_promised_outweigh_it() {
        let ms = |ms: u64| 1_000_000 * ms;
        for (price, made, by_rays, expected, ray, is_made) in [
            // Nothing is known to come: an eighth of what rays took.
            (ms(50), 0, ms(399), 0, 100.0, false),
            (ms(50), 0, ms(400), 0, 100.0, true),
            // An eighth of what they would take for what comes.
            (ms(50), 0, 0, 3_999_999, 100.0, false),
            (ms(50), 0, 0, 4_000_000, 100.0, true),
            (ms(50), 0, 0, 2_000_000, 200.0, true),
            (ms(50), 0, ms(200), 2_000_000, 100.0, true),
            // What was made before counts.
            (ms(50), ms(50), 0, 4_000_000, 100.0, false),
            (0, 0, 0, 0, 0.0, true),
            (1, 0, 0, 0, 1e9, false),
        ] {
            let told = pays(price, made, by_rays, expected, ray);
            assert_eq!(told, is_made, "{price} {made} {by_rays} {expected} {ray}");
        }
    }

    #[test]
    fn promises_are_used_up_and_not_added() {
        let prices = Prices::default();
        prices.expect(10_000);
        prices.expect(4_000);
        assert_eq!(prices.expected(), 10_000);
        let spent = Spent {
            queries: 6_000,
            ns: 600_000,
            made: 0,
            is_by_map: false,
            known: 0,
        };
        prices.note(&spent);
        assert_eq!((prices.expected(), prices.ray_ns()), (4_000, 100.0));
        prices.note(&spent);
        assert_eq!(prices.expected(), 0);
    }

    #[test]
    fn few_single_queries_wait_for_a_map_that_saves_nothing() {
        let prices = Prices::default();
        let asked = |prices: &Prices| (0..1024).filter(|&n| prices.is_map_worth_one(n)).count();
        let spent = |each: u64, known, is_by_map| Spent {
            queries: 256,
            ns: 256 * each,
            made: 0,
            is_by_map,
            known,
        };
        prices.note(&spent(200, 0, false));
        assert_eq!(asked(&prices), 1024 / FEW as usize);
        // A fifth of the queries is known: that saves 40 ns each, for a look that takes 150.
        (0..4 * VAIN).for_each(|_| prices.note(&spent(150, 51, true)));
        assert_eq!(asked(&prices), 1024 / FEW as usize);
        assert!(prices.is_map_worth_it());
        // Nearly all of them in 30 ns.
        (0..10_000).for_each(|_| prices.note(&spent(30, 250, true)));
        assert_eq!(asked(&prices), 1024);
    }

    #[test]
    fn what_making_takes_does_not_make_a_map_look_dear() {
        let prices = Prices::default();
        let spent = |ns: u64, is_by_map| Spent {
            queries: 8_192,
            ns,
            made: 0,
            is_by_map,
            known: 8_192,
        };
        prices.note(&spent(800_000, false));
        (0..2 * VAIN).for_each(|_| {
            // As when each call announces where it will ask.
            prices.note(&Spent::making(2_000_000));
            prices.note(&spent(200_000, true));
        });
        assert!((0..2 * SELDOM).all(|_| prices.is_map_worth_it()));
        assert!(!prices.allow(1));
    }

    #[test]
    fn a_map_that_takes_longer_is_asked_seldom_until_it_does_not() {
        let prices = Prices::default();
        let spent = |each: u64, is_by_map| Spent {
            queries: 1_000,
            ns: 1_000 * each,
            made: 0,
            is_by_map,
            known: 1_000,
        };
        prices.note(&spent(100, false));
        assert!(prices.is_map_worth_it());
        (0..20).for_each(|_| prices.note(&spent(150, true)));
        let asked = (0..160).filter(|_| prices.is_map_worth_it()).count();
        assert_eq!(asked, 10);
        (0..20).for_each(|_| prices.note(&spent(20, true)));
        assert!((0..160).all(|_| prices.is_map_worth_it()));
    }
}
