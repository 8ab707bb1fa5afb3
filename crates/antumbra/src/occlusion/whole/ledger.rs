//! Whether values of a light pay.
//!
//! In: what starts asked for, and what they took. Out: the keys that are worth making. Nothing here changes an answer.

use std::collections::HashMap;

use super::table::Key;

/// Of what samples took that nothing was known of, this share may be spent on making values, and this share of what values
/// have spared.
const SHARE: f64 = 0.125;
const OF_GAIN: f64 = 0.7;

/// First guesses, in nanoseconds: a key; the tables of a light, for each triangle.
const KEY_NS: f64 = 8_000.0;
const TABLE_NS: f64 = 150.0;

/// Twenty times what it takes to look at a key that waits.
const LOOK_NS: f64 = 200.0;

/// Keys that wait.
const MOST_WAITING: usize = 1 << 20;

/// What a call asked for.
#[derive(Debug, Default)]
pub(crate) struct Asked {
    /// Keys that are not known, as often as they were asked for in a row.
    missing: Vec<(Key, u32)>,
    /// Starts without a key that values may ever have.
    nowhere: u32,
    missed: u32,
    found: u32,
}

impl Asked {
    pub(super) fn miss(&mut self, key: Key) {
        self.missed += 1;
        match self.missing.last_mut() {
            Some((last, count)) if *last == key => *count += 1,
            _ => self.missing.push((key, 1)),
        }
    }

    pub(super) fn find(&mut self) {
        self.found += 1;
    }

    pub(super) fn nowhere(&mut self) {
        self.nowhere += 1;
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.missing.extend(other.missing);
        self.nowhere += other.nowhere;
        self.missed += other.missed;
        self.found += other.found;
    }

    /// Returns whether anything was asked for that is not known, but might be.
    pub(crate) fn has_missed(&self) -> bool {
        self.missed > 0
    }

    pub(super) fn keys(&self) -> impl Iterator<Item = Key> {
        self.missing.iter().map(|&(key, _)| key)
    }
}

/// What was asked of a light, and what it cost.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    waiting: HashMap<Key, u32>,
    /// Nanoseconds of starts that nothing was known of, and of making.
    walked_ns: f64,
    spared_ns: f64,
    spent_ns: f64,
    /// What starts must have taken and spared before all that waits is looked at again.
    next_look_ns: f64,
    /// Of a start that nothing is known of, of one that is known, and of making a key.
    start_ns: Option<f64>,
    known_ns: Option<f64>,
    key_ns: Option<f64>,
}

impl Ledger {
    /// Notes what some starts asked for and how long they took. They stand for `weight` times as many.
    pub(super) fn note(&mut self, asked: &Asked, ns: u64, weight: u32) {
        let (open, found) = (asked.missed + asked.nowhere, asked.found);
        let count = f64::from(open + found);
        if count == 0.0 {
            return;
        }
        let each = ns as f64 / count;
        if f64::from(open) > 0.9 * count {
            smooth(&mut self.start_ns, each);
        } else if f64::from(open) < 0.1 * count {
            smooth(&mut self.known_ns, each);
        }
        let start_ns = self.start_ns.unwrap_or(each);
        let known_ns = self.known_ns.unwrap_or(0.5 * start_ns);
        let weighted = f64::from(weight);
        self.walked_ns += weighted * f64::from(open) * start_ns;
        self.spared_ns += weighted * f64::from(found) * (start_ns - known_ns).max(0.0);
        if self.waiting.len() + asked.missing.len() > MOST_WAITING {
            self.waiting.clear();
        }
        for &(key, count) in asked.missing.iter().take(MOST_WAITING) {
            let waiting = self.waiting.entry(key).or_insert(0);
            *waiting = waiting.saturating_add(count.saturating_mul(weight));
        }
    }

    fn may_be_spent(&self) -> f64 {
        SHARE * self.walked_ns + OF_GAIN * self.spared_ns - self.spent_ns
    }

    /// Returns whether the tables of a light pay, with so many triangles.
    pub(super) fn are_tables_worth_it(&self, triangle_count: usize) -> bool {
        self.may_be_spent() > TABLE_NS * triangle_count as f64
    }

    /// Returns the keys whose values pay, those first that were asked for most: what asking has cost already is as much as
    /// making. Looks at all that wait once starts took much longer than that look.
    pub(super) fn worth_it(&mut self) -> Vec<Key> {
        let so_far = self.walked_ns + self.spared_ns;
        if so_far < self.next_look_ns {
            return Vec::new();
        }
        self.next_look_ns = so_far + LOOK_NS * self.waiting.len() as f64;
        let start_ns = self.start_ns.unwrap_or(0.0);
        let key_ns = self.key_ns.unwrap_or(KEY_NS);
        let mut keys: Vec<(u32, Key)> = self
            .waiting
            .iter()
            .filter(|&(_, &count)| f64::from(count) * start_ns > key_ns)
            .map(|(&key, &count)| (count, key))
            .collect();
        keys.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        keys.truncate((self.may_be_spent() / key_ns).max(0.0) as usize);
        keys.into_iter().map(|(_, key)| key).collect()
    }

    /// Notes that values of some keys were tried, or tables where there are none, and what that took.
    pub(super) fn pay(&mut self, keys: &[Key], ns: u64) {
        let ns = ns as f64;
        self.spent_ns += ns;
        for key in keys {
            self.waiting.remove(key);
        }
        if !keys.is_empty() {
            smooth(&mut self.key_ns, ns / keys.len() as f64);
        }
    }
}

/// Moves an average a quarter of the way to what was measured.
fn smooth(average: &mut Option<f64>, measured: f64) {
    *average = Some(average.map_or(measured, |before| 0.75 * before + 0.25 * measured));
}
