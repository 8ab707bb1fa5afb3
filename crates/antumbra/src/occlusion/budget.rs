//! When knowing more pays: the cost rule of lazy refinement (Paper 7.3, 9.2).
//!
//! In: what rays have cost, what values have spared, what was spent on values, all in nanoseconds by estimate. Out:
//! whether to spend more. Invariant: what was spent is at most a share of what rays have cost and of what
//! values have spared; so whatever is asked in whatever order, all together costs little more than rays
//! alone.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::Counters;

/// So much of what rays have cost may be spent in the hope of sparing more.
const HOPE: f64 = 1.0 / 10.0;
/// So much of what values have spared.
const REINVESTED: f64 = 0.5;

/// What a query costs that values or lists answer.
const LOOKUP_NS: u64 = 15;

/// Costs of a ray's parts, measured on scenes of all kinds.
const RAY_NS: u64 = 65;
const STEP_NS: u64 = 10;
const TEST_NS: u64 = 4;

/// Returns what rays have cost between two readings of the counters that differ by so many queries.
#[inline]
pub(crate) fn cost_of_rays(before: &Counters, after: &Counters, ray_count: u64) -> u64 {
    RAY_NS * ray_count
        + STEP_NS * (after.steps - before.steps)
        + TEST_NS * (after.intersections - before.intersections)
}

/// The account of one light. Threads add to it now and then; what they have not added yet is missing.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    rays_ns: AtomicU64,
    ray_count: AtomicU64,
    spared_ns: AtomicU64,
    spent_ns: AtomicU64,
}

/// What some queries came to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Account {
    pub(crate) ray_count: u64,
    pub(crate) rays_ns: u64,
    /// Queries that values or lists answered.
    pub(crate) answered: u64,
}

impl Budget {
    pub(crate) fn note(&self, account: &Account) {
        let add = |sum: &AtomicU64, more: u64| sum.fetch_add(more, Ordering::Relaxed) + more;
        let rays_ns = add(&self.rays_ns, account.rays_ns);
        let ray_count = add(&self.ray_count, account.ray_count);
        // A query that is answered would have cost about as much as those that were not.
        let usual = rays_ns.checked_div(ray_count).unwrap_or(0);
        add(
            &self.spared_ns,
            account.answered * usual.saturating_sub(LOOKUP_NS),
        );
    }

    /// Returns whether something of this price may be bought.
    pub(crate) fn allows(&self, price_ns: u64) -> bool {
        let [rays, spared, spent] = [&self.rays_ns, &self.spared_ns, &self.spent_ns]
            .map(|sum| sum.load(Ordering::Relaxed) as f64);
        spent + price_ns as f64 <= HOPE * rays + REINVESTED * spared
    }

    pub(crate) fn spend(&self, ns: u64) {
        self.spent_ns.fetch_add(ns, Ordering::Relaxed);
    }
}
