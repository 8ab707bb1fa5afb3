//! When values pay: the account of one light (Paper 7.3, 9.2; docs/cost-model.md).
//!
//! In: what queries took, by lookups and by rays, and what making values took. Out: whether to look values up, and
//! whether to make more. Invariant: all together takes at most [`LOSS`] longer than rays alone would have taken, in any
//! order of queries, beside one purchase and one chunk. That holds as far as a query that values answer would have taken
//! as long as rays did lately, or in the mean if that is less. All times are measured in this process. They decide
//! what is made, and no answer.

use std::sync::atomic::{AtomicI64, AtomicU32, AtomicU64, Ordering};

/// Share of the time of rays alone that may be lost in the hope of gaining more. The map of a light has the same
/// (`map/prices.rs`).
pub(crate) const LOSS: f64 = 0.125;
/// Share of the gain so far that may be spent on more: the rest is kept.
const REINVESTED: f64 = 0.5;

/// Share of what may be lost that lookups in vain may take.
const LOOKUPS: f64 = 0.5;

/// Share of a new measurement in the mean of recent ones.
const RECENT: f32 = 0.2;
/// Time of a brick and of a ray until one was measured, in nanoseconds.
const USUAL_BRICK: u64 = 60_000;
const USUAL_RAY: f64 = 100.0;

/// Sums of one light's times in nanoseconds. Threads add to them now and then.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    ray_count: AtomicU64,
    rays_ns: AtomicU64,
    /// Recent time of a ray, the bits of an `f32`; 0 if none was measured.
    recent_ray: AtomicU32,
    /// Nanoseconds that rays alone would have taken for all queries.
    alone_ns: AtomicU64,
    /// Nanoseconds that values saved of that, less the time of lookups.
    saved_ns: AtomicI64,
    made_ns: AtomicU64,
    brick_count: AtomicU64,
    bricks_ns: AtomicU64,
}

/// What some queries took.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Account {
    pub(crate) queries: u64,
    /// Queries that rays answered, and what those took.
    pub(crate) rays: u64,
    pub(crate) rays_ns: u64,
    /// What lookups took, those that found nothing included.
    pub(crate) lookups_ns: u64,
}

/// A state of the account, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Nanoseconds that rays alone would have taken for all queries so far.
    pub(crate) alone: f64,
    /// By how much less all queries took; negative where they took longer.
    pub(crate) saved: f64,
    /// What making values took.
    pub(crate) made: f64,
    /// What rays would take for the queries that the caller says are coming.
    pub(crate) coming: f64,
}

impl Sums {
    /// Returns whether values may be looked up: the loss so far is within bounds, and lookups alone have lost at most half
    /// of what may be lost, so that something is left to make more values with.
    pub(crate) fn is_worth_looking(&self) -> bool {
        let may_lose = LOSS * self.alone;
        self.made <= may_lose + self.saved && -self.saved <= LOOKUPS * may_lose
    }

    /// Returns whether something of a price may be made.
    pub(crate) fn pays(&self, price: f64) -> bool {
        let of_saved = if self.saved > 0.0 { REINVESTED } else { 1.0 };
        self.made + price <= LOSS * (self.alone + self.coming) + of_saved * self.saved
    }
}

impl Budget {
    pub(crate) fn note(&self, account: &Account) {
        let add = |sum: &AtomicU64, more: u64| sum.fetch_add(more, Ordering::Relaxed) + more;
        let (count, sum) = (
            add(&self.ray_count, account.rays),
            add(&self.rays_ns, account.rays_ns),
        );
        if account.rays > 0 {
            let now = account.rays_ns as f32 / account.rays as f32;
            let before = f32::from_bits(self.recent_ray.load(Ordering::Relaxed));
            let share = if before > 0.0 { RECENT } else { 1.0 };
            let recent = before + share * (now - before);
            self.recent_ray.store(recent.to_bits(), Ordering::Relaxed);
        }
        let mean = sum as f64 / count.max(1) as f64;
        let answered = account.queries - account.rays;
        let spared = (answered as f64 * mean.min(self.recent_ray())) as u64;
        add(&self.alone_ns, account.rays_ns + spared);
        let saved = spared as i64 - account.lookups_ns as i64;
        self.saved_ns.fetch_add(saved, Ordering::Relaxed);
    }

    fn recent_ray(&self) -> f64 {
        match f32::from_bits(self.recent_ray.load(Ordering::Relaxed)) {
            0.0 => USUAL_RAY,
            recent => recent.into(),
        }
    }

    /// Returns the account, with so many queries coming.
    pub(crate) fn sums(&self, coming: u64) -> Sums {
        Sums {
            alone: self.alone_ns.load(Ordering::Relaxed) as f64,
            saved: self.saved_ns.load(Ordering::Relaxed) as f64,
            made: self.made_ns.load(Ordering::Relaxed) as f64,
            coming: coming as f64 * self.recent_ray(),
        }
    }

    /// Returns whether a brick may be made, for the mean price of those so far.
    pub(crate) fn allows_brick(&self) -> bool {
        let [count, ns] =
            [&self.brick_count, &self.bricks_ns].map(|sum| sum.load(Ordering::Relaxed));
        let price = ns.checked_div(count).unwrap_or(USUAL_BRICK);
        self.sums(0).pays(price as f64)
    }

    /// Adds what a brick took.
    pub(crate) fn add_brick(&self, ns: u64) {
        self.brick_count.fetch_add(1, Ordering::Relaxed);
        self.bricks_ns.fetch_add(ns, Ordering::Relaxed);
        self.add_made(ns);
    }

    /// Adds what making something took.
    pub(crate) fn add_made(&self, ns: u64) {
        self.made_ns.fetch_add(ns, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests;
