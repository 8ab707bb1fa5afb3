//! Which queries are sampled.
//!
//! In: nothing. Out: a number. What is learned of queries, and when the clock is read, must not depend on what is asked:
//! positions on grids and planes have few bits that differ, and lights take turns.

use std::cell::Cell;

/// One single query in so many that a map knows nothing of says what is to be made, for all of them.
pub(crate) const SAMPLED: u64 = 64;
/// One of so many single queries is timed: reading the clock takes as long as several rays.
pub(crate) const TIMED: u64 = 256;

thread_local! {
    /// How many numbers this thread has drawn.
    static DRAWN: Cell<u64> = const { Cell::new(0) };
}

/// Draws a number (SplitMix64), by which queries are sampled: whatever is asked in whatever order, a point or a light
/// again and again or points on a grid, the same share of it is sampled.
pub(crate) fn draw() -> u64 {
    let drawn = DRAWN.get().wrapping_add(1);
    DRAWN.set(drawn);
    let mut bits = drawn.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_queries_are_sampled_whatever_turns_lights_take() {
        const COUNT: usize = 1 << 20;
        let drawn: Vec<u64> = (0..COUNT).map(|_| draw()).collect();
        for light_count in [1, 2, 3, 7, 16, 100, 256] {
            for first in [0, light_count / 2, light_count - 1] {
                let of_light = drawn.iter().skip(first).step_by(light_count);
                let asked = of_light.clone().count() as f64;
                for among in [SAMPLED, TIMED] {
                    let sampled = of_light.clone().filter(|n| n.is_multiple_of(among)).count();
                    let expected = asked / among as f64;
                    let off = (sampled as f64 - expected).abs();
                    assert!(
                        off < 5.0 * expected.sqrt(),
                        "{sampled} of {asked}, by {among}"
                    );
                }
            }
        }
    }
}
