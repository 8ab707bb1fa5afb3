//! An order in which starts that lie near each other are near each other.
//!
//! In: starts. Out: whether theirs is such an order; else one along a curve that fills space (Morton 1966).
//! Answers do not depend on it. Unlike `method::order` it needs no values, and its cells are finer.

use antumbra_geometry::ReceiverPoint;

use super::hull::ReceiverBox;
use super::rays::RAYS;
use crate::accel::frame::Frame;

/// Starts farther apart, in the frame's units, do not walk together. A quarter and four times as much are
/// slower on scenes of all kinds.
pub(super) const FARTHEST_APART: f32 = 1.0 / 16.0;

/// Starts that are put in order together. Four times fewer stay in a nearer cache, and lie farther apart: on
/// the larger scenes that costs a fifth to a third.
pub(super) const WINDOW: usize = 1 << 16;

/// Fewer starts are answered as they come.
const FEWEST: usize = 1 << 8;

/// Runs of sixteen that are looked at.
const SAMPLES: usize = 64;

/// One run in so many may be wider than this, in the frame's units. Of the bench's scenes those that gain
/// have more than two in five, the others one in ten.
const WIDE_SHARE: usize = 5;
const WIDE: f32 = 0.5 * FARTHEST_APART;

/// Cells along an axis, as a power of two. Digits of a key that are sorted by at a time.
const CELL_BITS: u32 = 7;
const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Returns whether so many neighbours lie apart that it is worth putting them in order.
pub(super) fn is_scattered(frame: &Frame, starts: &[ReceiverPoint]) -> bool {
    if starts.len() < FEWEST {
        return false;
    }
    let runs = starts.chunks_exact(RAYS);
    let step = runs.len().div_ceil(SAMPLES);
    let (mut wide_count, mut count) = (0, 0);
    for run in runs.step_by(step) {
        let mut all = ReceiverBox::EMPTY;
        for start in run {
            all.add(place(frame, start));
        }
        count += 1;
        wide_count += usize::from(all.extent() > WIDE);
    }
    WIDE_SHARE * wide_count > count
}

#[inline(always)]
fn place(frame: &Frame, start: &ReceiverPoint) -> [f32; 3] {
    let place = frame.point_in_frame(start.point);
    [place.x as f32, place.y as f32, place.z as f32]
}

/// Orders starts by their cells, those of one cell as they came (radix sort).
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Keys above numbers.
    keyed: Vec<u64>,
    other: Vec<u64>,
    numbers: Vec<u32>,
}

impl Order {
    /// Returns the numbers of some starts in order.
    pub(super) fn of(&mut self, frame: &Frame, starts: &[ReceiverPoint]) -> &[u32] {
        self.keyed.clear();
        self.keyed.extend((0..).zip(starts).map(|(number, start)| {
            let place = place(frame, start);
            u64::from(key(place)) << 32 | number
        }));
        self.other.clear();
        self.other.resize(starts.len(), 0);
        for shift in [32, 32 + DIGIT_BITS] {
            let digit = |one: u64| (one >> shift) as usize % DIGITS;
            let mut places = [0_u32; DIGITS];
            for &one in &self.keyed {
                places[digit(one)] += 1;
            }
            let mut first = 0;
            for place in &mut places {
                first += std::mem::replace(place, first);
            }
            for &one in &self.keyed {
                let place = &mut places[digit(one)];
                self.other[*place as usize] = one;
                *place += 1;
            }
            std::mem::swap(&mut self.keyed, &mut self.other);
        }
        self.numbers.clear();
        self.numbers
            .extend(self.keyed.iter().map(|&one| one as u32));
        &self.numbers
    }
}

/// Interleaves the bits of the three coordinates' cells. Starts outside the frame are in its outermost.
fn key(place: [f32; 3]) -> u32 {
    let half = (1_u32 << (CELL_BITS - 1)) as f32;
    // Not for NaN, which is cell 0.
    let cell = |x: f32| ((x + 1.0) * half).min(2.0 * half - 1.0) as u32;
    spread(cell(place[0])) | spread(cell(place[1])) << 1 | spread(cell(place[2])) << 2
}

/// Puts two zeros between the bits of a number of seven.
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x0000_700f;
    let x = (x | x << 4) & 0x0004_30c3;
    (x | x << 2) & 0x0004_9249
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, DVec3};

    use super::*;
    use crate::occlusion::testing::Random;

    fn frame() -> Frame {
        Frame::new(Bounds {
            min: DVec3::splat(-4.0),
            max: DVec3::splat(4.0),
        })
    }

    #[test]
    fn bits_are_spread() {
        for x in 0..1 << CELL_BITS {
            let expected = (0..CELL_BITS).fold(0, |bits, bit| bits | (x >> bit & 1) << (3 * bit));
            assert_eq!(spread(x), expected);
        }
        const { assert!(3 * CELL_BITS <= 2 * DIGIT_BITS) };
    }

    #[test]
    fn starts_are_put_in_order_of_their_keys() {
        let (random, frame) = (&mut Random(1), frame());
        // One order for windows of all lengths: what is left of one must not touch the next.
        let mut order = Order::default();
        for count in [1, 0, 300, WINDOW, 17] {
            let starts: Vec<ReceiverPoint> = (0..count)
                .map(|_| ReceiverPoint {
                    point: random.pick(&[0.5, 4.0, 1e30]) * random.of_cube(),
                    surface: None,
                })
                .collect();
            let mut expected: Vec<u32> = (0..count as u32).collect();
            // A stable sort gives one permutation.
            expected.sort_by_key(|&number| key(place(&frame, &starts[number as usize])));
            assert_eq!(order.of(&frame, &starts), expected);
        }
    }

    #[test]
    fn shuffled_starts_are_told_from_rows() {
        let (random, frame) = (&mut Random(2), frame());
        let mut starts: Vec<ReceiverPoint> = (0..128 * 128)
            .map(|number| ReceiverPoint {
                point: DVec3::new((number % 128) as f64, (number / 128) as f64, 0.0) / 16.0 - 4.0,
                surface: None,
            })
            .collect();
        // Rows as dense as those of a picture.
        for start in &mut starts {
            start.point.x *= 0.05;
        }
        assert!(!is_scattered(&frame, &starts));
        for number in (1..starts.len()).rev() {
            starts.swap(number, random.below(number + 1));
        }
        assert!(is_scattered(&frame, &starts));
        assert!(!is_scattered(&frame, &starts[..FEWEST - 1]));
    }
}
