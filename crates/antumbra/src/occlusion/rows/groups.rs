//! The lights of an index in groups that a beam asks together.
//!
//! In: lights. Out: groups of at most 64 that lie near each other, so that the pyramid of a group is narrow. Which light
//! is in which group changes no answer.

use antumbra_geometry::{DVec3, LightShape};

use crate::accel::bvh::{Block, TARGETS as WORD};

/// Lights in groups.
#[derive(Debug)]
pub(crate) struct Groups {
    /// The lights, group after group.
    pub(crate) lights: Vec<LightShape>,
    pub(crate) blocks: Vec<Block>,
    /// For each light in groups its number.
    pub(crate) numbers: Vec<u32>,
    /// For each light its place in groups.
    pub(crate) places: Vec<u32>,
    /// Whether all are where their numbers are.
    pub(crate) is_in_order: bool,
}

impl Groups {
    pub(crate) fn new(lights: &[LightShape]) -> Self {
        let mut numbers: Vec<u32> = (0..lights.len() as u32).collect();
        if lights.len() > WORD {
            let is_afar = |&number: &u32| lights[number as usize].homogeneous().1 == 0.0;
            // Those from afar last.
            numbers.sort_by_key(is_afar);
            gather(lights, &mut numbers);
        }
        let mut places = vec![0; lights.len()];
        for (place, &number) in numbers.iter().enumerate() {
            places[number as usize] = place as u32;
        }
        let is_in_order = numbers.is_sorted();
        let lights: Vec<LightShape> = numbers.iter().map(|&n| lights[n as usize]).collect();
        Self {
            blocks: lights.chunks(WORD).map(Block::new).collect(),
            lights,
            numbers,
            places,
            is_in_order,
        }
    }
}

/// Sorts lights so that those of each group lie together: cut across the longest axis, again and again.
fn gather(lights: &[LightShape], numbers: &mut [u32]) {
    if numbers.len() <= WORD {
        return;
    }
    let at = |number: u32| lights[number as usize].homogeneous().0;
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for &number in numbers.iter() {
        low = low.min(at(number));
        high = high.max(at(number));
    }
    // Halves first: sums of sizes stay in range.
    let size = 0.5 * high - 0.5 * low;
    let axis = (0..3)
        .max_by(|&a, &b| size[a].total_cmp(&size[b]))
        .unwrap_or(0);
    let groups = numbers.len().div_ceil(WORD);
    let middle = groups / 2 * WORD;
    numbers.select_nth_unstable_by(middle, |&a, &b| at(a)[axis].total_cmp(&at(b)[axis]));
    let (first, second) = numbers.split_at_mut(middle);
    gather(lights, first);
    gather(lights, second);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_is_in_one_group_with_its_neighbours() {
        for count in [0, 1, 63, 64, 65, 100, 128, 129, 1000] {
            let lights: Vec<LightShape> = (0..count)
                .map(|number| {
                    let x = f64::from(number * 37 % 101);
                    match number % 5 {
                        0 => LightShape::Direction(DVec3::new(x, 1.0, 2.0)),
                        _ => LightShape::Point(DVec3::new(x, f64::from(number % 7), 0.0)),
                    }
                })
                .collect();
            let groups = Groups::new(&lights);
            assert_eq!(groups.blocks.len(), lights.len().div_ceil(WORD));
            for (number, light) in lights.iter().enumerate() {
                let place = groups.places[number] as usize;
                assert_eq!(groups.numbers[place] as usize, number);
                assert_eq!(groups.lights[place], *light);
            }
            assert_eq!(groups.is_in_order, groups.lights == lights);
        }
    }
}
