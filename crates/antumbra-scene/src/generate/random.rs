//! Whole random numbers for generators, the same on every platform.
//!
//! In: a seed. Out: numbers drawn in a fixed order. Invariant: integer arithmetic only.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

/// A stream of numbers.
#[derive(Debug)]
pub(super) struct Random(Pcg64Mcg);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Returns a number of `0..count`; `count` is positive. The bias is below `count / 2^64`.
    pub(super) fn below(&mut self, count: u32) -> u32 {
        let wide = u128::from(self.0.next_u64()) * u128::from(count);
        (wide >> 64) as u32
    }

    /// Returns a number from `least` to `most`.
    pub(super) fn between(&mut self, least: i32, most: i32) -> i32 {
        least + self.below(most.abs_diff(least) + 1) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fill_their_range_and_repeat() {
        let draw = |seed| {
            let mut random = Random::new(seed);
            (0..100).map(move |_| random.between(-2, 2)).collect()
        };
        let numbers: Vec<i32> = draw(1);
        assert_eq!(numbers, draw(1));
        assert_ne!(numbers, draw(2));
        for expected in -2..=2 {
            assert!(numbers.contains(&expected));
        }
        assert!(numbers.iter().all(|n| (-2..=2).contains(n)));
    }
}
