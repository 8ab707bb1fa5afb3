//! The order in which a batch is answered: as it came, or by where its starts are.
//!
//! In: starts in the caller's order. Out: an order by which neighbours come one after the other, if theirs is
//! not one. Answers do not depend on it; what is read for one start is then near at hand for the next.

use antumbra_geometry::ReceiverPoint;

use crate::occlusion::AdaptiveValues;

/// Starts that are put in order together: they and their order stay in the caches.
pub(super) const WINDOW: usize = 1 << 16;

/// Batches of fewer starts are answered as they come.
const FEWEST: usize = 1 << 12;

/// Pairs of neighbours that are looked at.
const PAIRS: usize = 64;

/// Smaller stores are in the caches anyway.
const SMALLEST_STORE: u64 = 32 << 20;

/// A map is read at more places for a query.
const SMALLEST_MAP: u64 = 4 << 20;

/// Returns whether so many neighbours in a batch lie apart that it is worth putting in order.
pub(super) fn is_scattered(
    values: &AdaptiveValues,
    light: usize,
    starts: &[ReceiverPoint],
) -> bool {
    let smallest = match values.has_maps() {
        true => SMALLEST_MAP,
        false => SMALLEST_STORE,
    };
    let is_large = || values.bytes_of(light) >= smallest;
    // Tests want it at once.
    starts.len() >= FEWEST
        && (values.is_made_when_queried() || is_large())
        && are_neighbours_apart(values, starts)
}

fn are_neighbours_apart(values: &AdaptiveValues, starts: &[ReceiverPoint]) -> bool {
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

    /// Answers starts in order, so many together, by `answer`. Where that fails, the error is the one of the first start
    /// that fails `check` in the caller's order, if one does.
    pub(super) fn answer<E>(
        &mut self,
        (values, together): (&AdaptiveValues, usize),
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        check: impl Fn(&ReceiverPoint) -> Result<(), E>,
        mut answer: impl FnMut(&[ReceiverPoint], &mut [bool]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut near = Vec::with_capacity(together);
        let mut found = vec![false; together];
        for numbers in self.of(values, starts).chunks(together) {
            near.clear();
            near.extend(numbers.iter().map(|&number| starts[number as usize]));
            let found = &mut found[..near.len()];
            if let Err(error) = answer(&near, found) {
                starts.iter().try_for_each(&check)?;
                return Err(error);
            }
            for (&number, &found) in numbers.iter().zip(&*found) {
                is_shadowed[number as usize] = found;
            }
        }
        Ok(())
    }

    /// Returns the numbers of some starts in order.
    pub(super) fn of(&mut self, values: &AdaptiveValues, starts: &[ReceiverPoint]) -> &[u32] {
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

#[cfg(test)]
mod tests {
    use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, Sphere};

    use super::*;
    use crate::Refine;
    use crate::occlusion::testing::Random;
    use crate::occlusion::{Depth, Knowledge, Making};

    fn values() -> AdaptiveValues {
        let mut builder = Occluders::builder();
        let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
        let floor = floor.map(|(x, y)| DVec3::new(x, y, 0.0));
        builder.add_face(&floor, Opacity::Opaque).expect("a face");
        let ball = Sphere {
            center: DVec3::new(0.0, 0.0, 3.0),
            radius: 1.0,
        };
        builder.add_sphere(ball, Opacity::Opaque).expect("a sphere");
        let occluders = builder.build();
        let making = Making {
            depth: Depth {
                surfaces: 6,
                space: 5,
                short_list: 1,
                space_list: 8,
                long_list: 32,
            },
            refine: Refine::Queried,
            knowledge: Knowledge::Values,
            most_bytes: 1 << 20,
        };
        let lights = [LightShape::Direction(DVec3::Z)];
        AdaptiveValues::new(&occluders, &lights, &making)
    }

    /// Starts row by row over the floor, as a picture asks them.
    fn rows(count: usize) -> Vec<ReceiverPoint> {
        let width = (count as f64).sqrt().ceil() as usize;
        let place = |number: usize| 8.0 * (number as f64 + 0.5) / width as f64 - 4.0;
        (0..count)
            .map(|number| ReceiverPoint {
                point: DVec3::new(place(number % width), place(number / width), 0.0),
                surface: None,
            })
            .collect()
    }

    fn shuffle(starts: &mut [ReceiverPoint], random: &mut Random) {
        for number in (1..starts.len()).rev() {
            starts.swap(number, random.below(number + 1));
        }
    }

    #[test]
    fn starts_are_put_in_order_of_their_keys() {
        let values = values();
        let random = &mut Random(1);
        // One order for windows of all lengths: what is left of one must not touch the next.
        let mut order = Order::new();
        for count in [1, 0, 31, 5_000, 33, WINDOW, 1_000] {
            let mut starts = rows(count);
            shuffle(&mut starts, random);
            // Outside all cells, on one point, and no starts at all.
            for start in &mut starts {
                match random.below(20) {
                    0 => start.point = 100.0 * random.in_cube(),
                    1 => start.point = DVec3::ONE,
                    2 => start.point.x = random.pick(&[f64::NAN, f64::INFINITY, -1e300]),
                    _ => {}
                }
            }
            let mut keys = vec![0; count];
            values.keys(&starts, &mut keys);
            let numbers = order.of(&values, &starts);
            // A stable sort gives one permutation.
            let mut expected: Vec<u32> = (0..count as u32).collect();
            expected.sort_by_key(|&number| keys[number as usize]);
            assert_eq!(numbers, expected);
            if count >= 1_000 {
                keys.sort_unstable();
                keys.dedup();
                assert!(keys.len() > 50, "{} keys", keys.len());
            }
        }
    }

    #[test]
    fn neighbours_share_a_key_alone_and_in_company() {
        let values = values();
        let random = &mut Random(2);
        let mut starts = rows(2_000);
        shuffle(&mut starts, random);
        let mut together = vec![0; starts.len()];
        values.keys(&starts, &mut together);
        for (start, expected) in starts.iter().zip(together) {
            let mut alone = [0];
            values.keys(std::slice::from_ref(start), &mut alone);
            assert_eq!(alone, [expected]);
            assert!(usize::from(expected) < AdaptiveValues::KEYS);
            // Keys change at planes alone, sixteen along an axis.
            let beside = ReceiverPoint {
                point: start.point + 1e-4 * random.in_cube(),
                ..*start
            };
            values.keys(&[beside], &mut alone);
            if alone != [expected] {
                let cell = 8.0 / 16.0;
                let to_plane = (start.point + 4.0) / cell;
                let off = (to_plane - to_plane.round()).abs().min_element();
                assert!(off < 0.01, "{start:?}");
            }
        }
    }

    #[test]
    fn shuffled_starts_are_told_from_rows() {
        let values = values();
        let random = &mut Random(3);
        for count in [FEWEST, FEWEST + 63, 20_000, 300_000] {
            let mut starts = rows(count);
            assert!(!is_scattered(&values, 0, &starts), "{count} in rows");
            shuffle(&mut starts, random);
            assert!(is_scattered(&values, 0, &starts), "{count} shuffled");
            let few = &starts[..FEWEST - 1];
            assert!(!is_scattered(&values, 0, few), "few are taken as they come");
            let first = starts[0];
            starts.fill(first);
            assert!(!is_scattered(&values, 0, &starts), "{count} times the same");
        }
        assert!(!is_scattered(&values, 0, &[]));
    }
}
