//! The order in which a batch is answered: as it came, or by where its starts are.
//!
//! In: starts in the caller's order. Out: an order by which neighbours come one after the other, if theirs is
//! not one. Answers do not depend on it; what is read for one start is then near at hand for the next.

use antumbra_geometry::Start;

use crate::occlusion::AdaptiveValues;

/// Starts that are put in order together: they and their order stay in the caches.
pub(super) const WINDOW: usize = 1 << 16;

/// Batches of fewer starts are answered as they come.
const FEWEST: usize = 1 << 12;

/// Pairs of neighbours that are looked at.
const PAIRS: usize = 64;

/// Smaller stores are in the caches anyway.
const SMALLEST_STORE: u64 = 32 << 20;

/// Returns whether so many neighbours in a batch lie apart that it is worth putting in order.
pub(super) fn is_scattered(values: &AdaptiveValues, starts: &[Start]) -> bool {
    let is_large = || values.value_bytes() + values.list_bytes() >= SMALLEST_STORE;
    // Tests want it at once.
    starts.len() >= FEWEST
        && (values.is_asked() || is_large())
        && are_neighbours_apart(values, starts)
}

fn are_neighbours_apart(values: &AdaptiveValues, starts: &[Start]) -> bool {
    let step = starts.len() / PAIRS;
    let mut keys = [0; 2];
    let are_apart = |pair: &usize| {
        values.keys(&starts[pair * step..][..2], &mut keys);
        keys[0] != keys[1]
    };
    (0..PAIRS).filter(are_apart).count() > PAIRS / 2
}

/// Orders windows of starts by their keys, those of one key as they came (counting sort).
#[derive(Debug)]
pub(super) struct Order {
    keys: Vec<u16>,
    ends: Vec<u32>,
    numbers: Vec<u32>,
}

impl Order {
    pub(super) fn new() -> Self {
        Self {
            keys: Vec::with_capacity(WINDOW),
            ends: Vec::new(),
            numbers: Vec::with_capacity(WINDOW),
        }
    }

    /// Returns the numbers of some starts in order.
    pub(super) fn of(&mut self, values: &AdaptiveValues, starts: &[Start]) -> &[u32] {
        self.keys.clear();
        self.keys.resize(starts.len(), 0);
        values.keys(starts, &mut self.keys);
        self.ends.clear();
        self.ends.resize(AdaptiveValues::KEYS + 1, 0);
        for &key in &self.keys {
            self.ends[usize::from(key) + 1] += 1;
        }
        for key in 0..AdaptiveValues::KEYS {
            self.ends[key + 1] += self.ends[key];
        }
        self.numbers.clear();
        self.numbers.resize(starts.len(), 0);
        for (number, &key) in (0..).zip(&self.keys) {
            let end = &mut self.ends[usize::from(key)];
            self.numbers[*end as usize] = number;
            *end += 1;
        }
        &self.numbers
    }
}
