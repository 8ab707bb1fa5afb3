//! When rows pay.
//!
//! In: what was asked where there is no row, and how long it took. Out: the keys whose rows pay. A row is made once the
//! starts of its key that are known to come, or that came, would have spared more than it costs; and all rows together
//! may cost [`SHARE`] of what answers without rows would have taken, and [`OF_GAIN`] of what rows have spared. Rates are
//! measured; before the first rows they are guessed. No answer depends on any of it.

use hashbrown::HashMap;

use super::table::{Key, Place};

/// Keys that wait at most. More are forgotten: 24 bytes each.
const MOST_WAITING: usize = 1 << 17;

/// What rows may cost of what answers without them would have taken.
const SHARE: f64 = 1.0 / 16.0;
/// What they may cost of what they have spared.
const OF_GAIN: f64 = 0.7;

/// Guesses before the first rows, in nanoseconds: a light's tables for a triangle, and a bit of a row. From rooms and a
/// city on one thread; what was measured takes their place.
const TABLE_NS: f64 = 400.0;
const BIT_NS: f64 = 2_500.0;
/// A start's light without rows, and with.
const RAY_NS: f64 = 15.0;
const KNOWN_NS: f64 = 0.5;

/// What is known of what rows cost and spare.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    /// How many starts asked for a key without a row.
    waiting: HashMap<Key, u32>,
    /// Starts without rows so far, and with.
    missed: f64,
    found: f64,
    /// What rows took so far.
    spent_ns: f64,
    /// What a start takes without a row, what it takes with one, what a row takes, what tables of all lights take.
    start_ns: Option<f64>,
    known_ns: Option<f64>,
    row_ns: Option<f64>,
    tables_ns: Option<f64>,
}

/// What one caller's starts asked for.
#[derive(Debug, Default)]
pub(crate) struct Asked {
    /// Keys without rows, each with how many starts in a row asked for it.
    missing: Vec<(Key, u32)>,
    found: u32,
    missed: u32,
}

impl Asked {
    /// Notes where a start looked.
    #[inline(always)]
    pub(crate) fn note(&mut self, place: Place) {
        match place {
            Place::Row(_) => self.found += 1,
            Place::Nowhere => {}
            Place::Missing(key) => {
                self.missed += 1;
                match self.missing.last_mut() {
                    Some((last, count)) if *last == key => *count += 1,
                    _ => self.missing.push((key, 1)),
                }
            }
        }
    }

    /// Returns whether every start found its row.
    pub(crate) fn is_content(&self) -> bool {
        self.missing.is_empty()
    }
}

impl Ledger {
    /// Notes what some starts asked for and how long they took.
    pub(super) fn note(&mut self, asked: &Asked, ns: u64) {
        self.missed += f64::from(asked.missed);
        self.found += f64::from(asked.found);
        let count = f64::from(asked.missed + asked.found);
        if count > 0.0 {
            // Calls of one kind say what one takes.
            let each = ns as f64 / count;
            let missed = f64::from(asked.missed) / count;
            if missed > 0.9 {
                smooth(&mut self.start_ns, each);
            } else if missed < 0.02 {
                smooth(&mut self.known_ns, each);
            }
        }
        if self.waiting.len() + asked.missing.len() > MOST_WAITING {
            self.waiting.clear();
        }
        for &(key, count) in asked.missing.iter().take(MOST_WAITING) {
            let waiting = self.waiting.entry(key).or_insert(0);
            *waiting = waiting.saturating_add(count);
        }
    }

    /// Returns the keys whose rows pay, the most asked first, with so many lights and triangles.
    pub(super) fn worth_it(&self, counts: [usize; 2], more: f64) -> Vec<Key> {
        let [light_count, triangle_count] = counts.map(|count| count as f64);
        let start_ns = self.start_ns.unwrap_or(RAY_NS * light_count);
        let known_ns = self.known_ns.unwrap_or(KNOWN_NS * light_count);
        let row_ns = self.row_ns.unwrap_or(BIT_NS * light_count);
        let tables_ns = self
            .tables_ns
            .unwrap_or(TABLE_NS * light_count * triangle_count);
        let spared_ns = (start_ns - known_ns).max(0.0);
        let so_far = (self.missed + self.found) * start_ns * SHARE
            + self.found * spared_ns * OF_GAIN
            - self.spent_ns;
        let mut keys: Vec<(u32, Key)> = self
            .waiting
            .iter()
            .filter(|&(_, &count)| f64::from(count) * more.max(1.0) * spared_ns > row_ns)
            .map(|(&key, &count)| (count, key))
            .collect();
        keys.sort_unstable_by(|a, b| b.cmp(a));
        // Rows pay their tables together, from what is known to come and what may be spent besides.
        let mut budget = so_far - tables_ns;
        let mut count = 0;
        let mut best = 0;
        for &(asked, _) in &keys {
            budget += (f64::from(asked) * more * spared_ns - row_ns).min(f64::MAX);
            if more * spared_ns * f64::from(asked) < row_ns && budget < 0.0 {
                break;
            }
            count += 1;
            if budget >= 0.0 {
                best = count;
            }
        }
        keys.truncate(best);
        keys.into_iter().map(|(_, key)| key).collect()
    }

    /// Notes that rows of some keys were tried, with so many lights and triangles, and what that took.
    pub(super) fn pay(&mut self, keys: &[Key], counts: [usize; 2], ns: f64, is_made: bool) {
        self.spent_ns += ns;
        // What found no room is not tried again at once.
        for key in keys {
            self.waiting.remove(key);
        }
        if is_made {
            let [light_count, triangle_count] = counts.map(|count| count as f64);
            let tables_ns = (0.5 * ns).min(TABLE_NS * light_count * triangle_count);
            self.tables_ns = Some(tables_ns);
            smooth(&mut self.row_ns, (ns - tables_ns) / keys.len() as f64);
        }
    }
}

/// Moves an average a quarter of the way to what was measured.
fn smooth(average: &mut Option<f64>, measured: f64) {
    *average = Some(average.map_or(measured, |before| 0.75 * before + 0.25 * measured));
}
