//! When a map pays.
//!
//! In: what queries took, by rays and by the map, and how many are known to come. Out: whether to make the map, and
//! whether to ask it. Rays answer until a sixteenth of their time, past and promised, outweighs the map's price. Tiles
//! are made where what their queries gain is twice as much, while all that was made takes no more than an eighth of that
//! time and half of what lookups gained. A map of which there is little yet may take longer than the rays that it saves: lookups
//! may lose a 32nd of that time. Times are measured in this process; answers do not depend on them.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// So much of the time that rays took, and would take for the queries that are known to come, may a map without tiles cost.
const OF_MAP: f64 = 0.0625;
/// So much of that time, and of what lookups gained, may a map cost with its tiles.
const OF_ALL: f64 = 0.125;
const OF_GAINED: f64 = 0.5;

/// What a map takes that answers less than this share of what it is asked says little of what it will take.
const LITTLE: f32 = 0.5;

/// So much of what rays alone would have taken, and would take for the queries that are known to come, may lookups lose.
const OF_LOST: f64 = 0.03125;

/// By so much of a ray a query is taken to gain that a map answers of which there is little.
const OF_RAY: f32 = 0.5;

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

/// What a ray takes, and what a query gains that the map answers in its place, in nanoseconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Times {
    pub(crate) ray_ns: f32,
    pub(crate) gain_ns: f32,
}

impl Times {
    /// Much is gained.
    pub(crate) const LONG: Self = Self {
        ray_ns: 1e3,
        gain_ns: 1e3,
    };
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
    /// What rays would have taken for the queries that the map was asked.
    in_place_ns: AtomicU64,
    /// By how much longer lookups took than the rays that they saved, less what they gained since.
    lost_ns: AtomicU64,
    /// By how much less they took, where they did.
    gained_ns: AtomicU64,
    /// What making took.
    made_ns: AtomicU64,
    /// Queries that are known to come.
    expected: AtomicU64,
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
        if spent.is_by_map {
            let rays = |queries: u64| (queries as f32 * self.ray_ns()) as u64;
            self.in_place_ns.fetch_add(rays(spent.queries), order);
            let saved = rays(spent.known);
            let lost = |lost: u64| Some((lost + spent.ns).saturating_sub(saved));
            let _ = self.lost_ns.fetch_update(order, order, lost);
            let gained = saved.saturating_sub(spent.ns);
            self.gained_ns.fetch_add(gained, order);
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

    /// Returns what a ray took lately, and what a query gains that the map answers.
    pub(crate) fn times(&self) -> Times {
        let [ray_ns, map, known] = [self.ray_ns(), self.recent(BY_MAP), self.recent(KNOWN)];
        Times {
            ray_ns,
            gain_ns: gain(ray_ns, map, known),
        }
    }

    /// Returns whether to make something of a price, in nanoseconds.
    pub(crate) fn allow(&self, price: u64) -> bool {
        let past = self.by_rays_ns.load(Ordering::Relaxed);
        let made = self.made_ns.load(Ordering::Relaxed);
        pays(price, made, past, self.expected(), self.ray_ns())
    }

    /// Returns what rays alone would have taken so far, and would for the queries that are known to come.
    fn alone(&self) -> (u64, f64) {
        let [by_rays, in_place] =
            [&self.by_rays_ns, &self.in_place_ns].map(|account| account.load(Ordering::Relaxed));
        let to_come = self.expected() as f64 * f64::from(self.ray_ns());
        (by_rays + in_place, to_come)
    }

    fn may_lose(&self) -> bool {
        let (alone, to_come) = self.alone();
        may_lose(self.lost_ns.load(Ordering::Relaxed), alone, to_come)
    }

    /// Returns whether to make more of the map.
    pub(crate) fn may_grow(&self) -> bool {
        let (alone, to_come) = self.alone();
        let [made, gained] =
            [&self.made_ns, &self.gained_ns].map(|account| account.load(Ordering::Relaxed));
        may_grow(made, gained, alone, to_come)
    }

    /// Returns whether to ask the map: it takes less than the rays that it saves, or it has not lost much yet.
    pub(crate) fn is_map_worth_it(&self) -> bool {
        let [ray, map, known] = [BY_RAYS, BY_MAP, KNOWN].map(|way| self.recent(way));
        map <= known * ray || self.may_lose()
    }
}

/// Returns whether lookups may go on that have lost so much, after so many nanoseconds of rays, traced and saved, with so
/// many to come.
fn may_lose(lost: u64, alone: u64, to_come: f64) -> bool {
    lost as f64 <= OF_LOST * (alone as f64 + to_come)
}

/// Returns whether more may be made of a map, of which so much was made and by which so much was gained.
fn may_grow(made: u64, gained: u64, alone: u64, to_come: f64) -> bool {
    made as f64 <= OF_ALL * (alone as f64 + to_come) + OF_GAINED * gained as f64
}

/// Returns what a query gains that the map answers, where a ray takes so long, a lookup so long, and lookups answer this
/// share.
fn gain(ray: f32, map: f32, known: f32) -> f32 {
    match known < LITTLE {
        true => OF_RAY * ray,
        false => (ray - map / known).max(0.0),
    }
}

/// Returns whether something of a price may be made, after so much was spent on making, rays took so long, and so many
/// queries are known to come that would take a ray each; in nanoseconds.
fn pays(price: u64, made: u64, by_rays: u64, expected: u64, ray: f32) -> bool {
    let to_come = expected as f64 * f64::from(ray);
    (made + price) as f64 <= OF_MAP * (by_rays as f64 + to_come)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_made_when_rays_past_and_promised_outweigh_it() {
        let ms = |ms: u64| 1_000_000 * ms;
        for (price, made, by_rays, expected, ray, is_made) in [
            // Nothing is known to come: a sixteenth of what rays took.
            (ms(25), 0, ms(399), 0, 100.0, false),
            (ms(25), 0, ms(400), 0, 100.0, true),
            // A sixteenth of what they would take for what comes.
            (ms(25), 0, 0, 3_999_999, 100.0, false),
            (ms(25), 0, 0, 4_000_000, 100.0, true),
            (ms(25), 0, 0, 2_000_000, 200.0, true),
            (ms(25), 0, ms(200), 2_000_000, 100.0, true),
            // What was made before counts.
            (ms(25), ms(25), 0, 4_000_000, 100.0, false),
            (0, 0, 0, 0, 0.0, true),
            (1, 0, 0, 0, 1e9, false),
        ] {
            let told = pays(price, made, by_rays, expected, ray);
            assert_eq!(told, is_made, "{price} {made} {by_rays} {expected} {ray}");
        }
    }

    #[test]
    fn lookups_may_lose_a_32nd() {
        let ms = |ms: u64| 1_000_000 * ms;
        for (lost, alone, to_come, may_go_on) in [
            (0, 0, 0.0, true),
            (ms(1), 0, 0.0, false),
            (ms(1), ms(32), 0.0, true),
            (ms(1) + 1, ms(32), 0.0, false),
            (ms(2), ms(32), 32e6, true),
            (ms(2) + 1, ms(32), 32e6, false),
        ] {
            assert_eq!(
                may_lose(lost, alone, to_come),
                may_go_on,
                "{lost} {alone} {to_come}"
            );
        }
    }

    #[test]
    fn a_map_grows_by_an_eighth_and_half_of_its_gain() {
        let ms = |ms: u64| 1_000_000 * ms;
        for (made, gained, alone, to_come, may) in [
            (0, 0, 0, 0.0, true),
            (ms(1), 0, ms(8), 0.0, true),
            (ms(1) + 1, 0, ms(8), 0.0, false),
            (ms(2), 0, ms(8), 8e6, true),
            (ms(5), ms(8), ms(8), 0.0, true),
            (ms(5) + 1, ms(8), ms(8), 0.0, false),
        ] {
            let told = may_grow(made, gained, alone, to_come);
            assert_eq!(told, may, "{made} {gained} {alone} {to_come}");
        }
    }

    #[test]
    fn queries_gain_what_a_ray_takes_longer() {
        for (ray, map, known, expected) in [
            (100.0, 0.0, 0.0, 50.0),
            (100.0, 80.0, 0.4, 50.0),
            (100.0, 40.0, 0.5, 20.0),
            (100.0, 40.0, 1.0, 60.0),
            (100.0, 140.0, 1.0, 0.0),
        ] {
            assert_eq!(gain(ray, map, known), expected, "{ray} {map} {known}");
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
    fn a_map_that_takes_longer_is_asked_while_it_has_lost_little() {
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
        // It loses 50 us a chunk; a 32nd of rays of 100 us each is more after 16 chunks by rays.
        prices.note(&spent(150, true));
        assert!(!prices.is_map_worth_it());
        (0..16).for_each(|_| prices.note(&spent(100, false)));
        assert!(prices.is_map_worth_it());
        (0..20).for_each(|_| prices.note(&spent(150, true)));
        assert!(!prices.is_map_worth_it());
        (0..20).for_each(|_| prices.note(&spent(20, true)));
        assert!(prices.is_map_worth_it());
    }
}
