//! When knowing more pays: the cost rule of lazy refinement (Paper 7.3, 9.2).
//!
//! In: what queries took, what rays alone would have taken, what making values took. Out: whether to look values
//! up, and whether to make more. Invariant: all together takes little longer than rays alone would,
//! whatever is asked in whatever order: the gain so far, less what values have cost, stays above minus a share
//! of the time of rays. That holds as far as a query that is answered would have cost what rays cost lately,
//! or in the mean if that is less. Times are measured, so what is known differs from run to run; answers
//! do not.

use std::sync::atomic::{AtomicI64, AtomicU32, AtomicU64, Ordering};

use crate::Counters;

/// So much of what rays alone would have taken may be lost in the hope of gaining more.
const HOPE: f64 = 1.0 / 16.0;
/// Share of the time of rays that may be lost for tables, which are bought once.
pub(crate) const HOPE_FOR_TABLES: f64 = 1.0 / 10.0;
/// So much of the gain may be spent on values.
const REINVESTED: f64 = 0.7;

/// So much of the time of rays may be spent at once that queries which are known to come would take.
pub(crate) const FORESIGHT: f64 = 0.3;

/// How much of what is new comes into the share of answers found lately.
const RECENT: f32 = 0.2;
/// Where a smaller share of looks than this finds an answer, only some queries are looked up.
const WORTH_LOOKING: f32 = 0.25;
/// One block of queries in so many.
pub(crate) const SCOUTS: u64 = 8;

/// Costs of a ray's parts in nanoseconds, measured on scenes of all kinds, for rays that walk together (a
/// step of theirs costs more, and there are few) and alone; how fast the machine is, is measured where there
/// are only rays.
const RAY_NS: u64 = 20;
const STEP_NS: u64 = 22;
const TEST_NS: u64 = 5;
/// What a query costs that values or lists answer, and what a look costs that finds nothing.
const LOOKUP_NS: u64 = 15;
const MISS_NS: u64 = 30;

/// Where looks cost less than rays, rays are asked for one chunk of queries in so many.
const RAY_TRIES: u32 = 32;
/// How much of what a chunk cost comes into what looks and rays cost lately.
const CHEAPER: f32 = 0.5;
/// Returns what rays have cost between two readings of the counters that differ by so many queries.
#[inline]
pub(crate) fn cost_of_rays(before: &Counters, after: &Counters, ray_count: u64) -> u64 {
    RAY_NS * ray_count
        + STEP_NS * (after.steps - before.steps)
        + TEST_NS * (after.intersections - before.intersections)
}

/// The account of one light, in nanoseconds. Threads add to it now and then; what they have not added yet is
/// missing.
#[derive(Debug, Default)]
pub(crate) struct Budget {
    /// Rays, and what they cost by their parts.
    ray_count: AtomicU64,
    rays_ns: AtomicU64,
    /// Rays that were all that there was: what they took, and what they cost by their parts.
    alone_took: AtomicU64,
    alone_ns: AtomicU64,
    /// What rays would have taken for all queries.
    by_rays: AtomicU64,
    /// By how much less queries took, without the making of values.
    gain: AtomicI64,
    /// What making values took.
    spent: AtomicU64,
    /// The share of looks that found an answer lately, the bits of an `f32`.
    found_share: AtomicU32,
    /// What a ray cost lately, the bits of an `f32`.
    recent_ray: AtomicU32,
    /// What a query cost lately where there were rays alone, and where all were looked up, the bits of an `f32`; and how often it was weighed which is cheaper.
    recent_alone: AtomicU32,
    recent_values: AtomicU32,
    ray_tries: AtomicU32,
}

/// Which queries to look up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Looks {
    /// None: rays answer until they have made up for the loss.
    None,
    /// None of this chunk, to see what rays cost.
    Rays,
    /// One block in [`SCOUTS`], to find where values pay.
    Scouts,
    /// All of this chunk, which stands for so many.
    Try(u64),
    All,
}

impl Looks {
    /// For so many queries one stands that is looked up.
    pub(crate) fn weight(self) -> u64 {
        match self {
            Self::None | Self::Rays | Self::All => 1,
            Self::Scouts => SCOUTS,
            Self::Try(weight) => weight,
        }
    }
}

/// What some queries came to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Account {
    pub(crate) query_count: u64,
    pub(crate) ray_count: u64,
    pub(crate) rays_ns: u64,
    /// Of the queries, those that were looked up, and those that were found.
    pub(crate) looked_count: u64,
    pub(crate) found_count: u64,
    /// What all took, without the making of values; `None` if nobody has measured.
    pub(crate) took: Option<u64>,
}

impl Budget {
    /// Takes it that looks will find answers: values were there before the first query.
    pub(crate) fn expect_answers(&self) {
        self.found_share.store(1.0_f32.to_bits(), Ordering::Relaxed);
    }

    pub(crate) fn note(&self, account: &Account) {
        let add = |sum: &AtomicU64, more: u64| sum.fetch_add(more, Ordering::Relaxed) + more;
        let ray_count = add(&self.ray_count, account.ray_count);
        let rays_ns = add(&self.rays_ns, account.rays_ns);
        let is_alone = account.looked_count == 0;
        if let (Some(took), true) = (account.took, is_alone) {
            add(&self.alone_took, took);
            add(&self.alone_ns, account.rays_ns);
        }
        // A query that is answered would have cost about as much as those that were not.
        let mean = rays_ns as f64 / ray_count.max(1) as f64;
        if account.ray_count > 0 {
            let now = account.rays_ns as f32 / account.ray_count as f32;
            renew(&self.recent_ray, now, RECENT, RECENT);
        }
        let recent = f32::from_bits(self.recent_ray.load(Ordering::Relaxed));
        let usual = mean.min(recent.into());
        let answered = account.query_count - account.ray_count;
        let by_rays = account.rays_ns as f64 + usual * answered as f64;
        let took = match account.took {
            Some(took) => took as f64 / self.slowness(),
            None => {
                let missed = MISS_NS * account.looked_count.saturating_sub(answered);
                (account.rays_ns + missed + LOOKUP_NS * answered) as f64
            }
        };
        add(&self.by_rays, by_rays as u64);
        if account.looked_count > 0 {
            let now = account.found_count as f32 / account.looked_count as f32;
            let before = f32::from_bits(self.found_share.load(Ordering::Relaxed));
            let share = before + RECENT * (now - before);
            self.found_share.store(share.to_bits(), Ordering::Relaxed);
        }
        let is_timed = account.took.is_some() && account.query_count > 0;
        if is_timed && is_alone {
            let now = took as f32 / account.query_count as f32;
            renew(&self.recent_alone, now, RECENT, RECENT);
        }
        if is_timed && account.looked_count == account.query_count {
            let now = took as f32 / account.query_count as f32;
            renew(&self.recent_values, now, CHEAPER, RECENT);
        }
        if !is_alone {
            // What another process took is no loss.
            let gain = (by_rays - took).max(-8.0 * by_rays);
            self.gain.fetch_add(gain as i64, Ordering::Relaxed);
        }
    }

    /// Returns how much longer than by their parts rays take here.
    fn slowness(&self) -> f64 {
        let [took, by_parts] =
            [&self.alone_took, &self.alone_ns].map(|sum| sum.load(Ordering::Relaxed) as f64);
        if by_parts > 0.0 { took / by_parts } else { 1.0 }
    }

    /// Returns which queries to look up: fewer where that costs more than rays alone, but for a try now and then.
    pub(crate) fn looks(&self) -> Looks {
        let looks = self.affordable_looks();
        if looks != Looks::All {
            return looks;
        }
        let [alone, values] = [&self.recent_alone, &self.recent_values]
            .map(|recent| f32::from_bits(recent.load(Ordering::Relaxed)));
        let tries = self.ray_tries.fetch_add(1, Ordering::Relaxed);
        if values == 0.0 {
            Looks::All
        } else if alone == 0.0 || (values <= alone && tries.is_multiple_of(RAY_TRIES)) {
            Looks::Rays
        } else if values <= alone {
            Looks::All
        } else if tries.is_multiple_of(SCOUTS as u32) {
            Looks::Try(SCOUTS)
        } else {
            // Rays are asked together.
            Looks::None
        }
    }

    /// Returns which queries may be looked up, and are likely to be answered.
    fn affordable_looks(&self) -> Looks {
        let [by_rays, gain, spent] = self.sums();
        let share = f32::from_bits(self.found_share.load(Ordering::Relaxed));
        if spent > HOPE * by_rays + gain {
            Looks::None
        } else if share < WORTH_LOOKING {
            Looks::Scouts
        } else {
            Looks::All
        }
    }

    /// Returns whether something of this price may be bought.
    pub(crate) fn allows(&self, price: u64) -> bool {
        self.allows_within(HOPE, price, 0)
    }

    /// Returns whether tables may be bought, with so many queries known to come that they serve.
    pub(crate) fn allows_tables(&self, price: u64, ahead: u64) -> bool {
        self.allows_within(HOPE_FOR_TABLES, price, ahead)
    }

    fn allows_within(&self, hope: f64, price: u64, ahead: u64) -> bool {
        let [by_rays, gain, spent] = self.sums();
        let share = if gain > 0.0 { REINVESTED } else { 1.0 };
        let to_come = ahead as f64 * self.usual_ray();
        spent + price as f64 <= hope * by_rays + share * gain + FORESIGHT * to_come
    }

    /// Returns what a ray costs, by its parts.
    fn usual_ray(&self) -> f64 {
        let [count, ns] =
            [&self.ray_count, &self.rays_ns].map(|sum| sum.load(Ordering::Relaxed) as f64);
        let recent = f32::from_bits(self.recent_ray.load(Ordering::Relaxed));
        (ns / count.max(1.0)).min(recent.into())
    }

    fn sums(&self) -> [f64; 3] {
        [
            self.by_rays.load(Ordering::Relaxed) as f64,
            self.gain.load(Ordering::Relaxed) as f64,
            self.spent.load(Ordering::Relaxed) as f64,
        ]
    }

    /// Notes that making values took so long.
    pub(crate) fn spend(&self, took: u64) {
        let took = took as f64 / self.slowness();
        self.spent.fetch_add(took as u64, Ordering::Relaxed);
    }
}

/// Brings what was seen now into a mean of what was seen lately: so much of it where it is less, and where it is
/// more.
fn renew(mean: &AtomicU32, now: f32, less: f32, more: f32) {
    let before = f32::from_bits(mean.load(Ordering::Relaxed));
    let share = if now < before { less } else { more };
    let renewed = if before > 0.0 {
        before + share * (now - before)
    } else {
        now
    };
    mean.store(renewed.to_bits(), Ordering::Relaxed);
}

#[cfg(test)]
mod tests;
