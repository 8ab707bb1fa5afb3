//! Directions in cells of at most 64 neighbors.
//!
//! In: directions. Out: cells; the directions of one go along one axis of space more than along the others, and see nearly
//! the same of a scene. Invariant: each direction is in one cell; which is a function of the directions alone.

use antumbra_geometry::{DVec3, LightShape};

use crate::accel::bvh::{Block, TARGETS};

/// Up to 64 directions that are asked about together.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Their numbers among all.
    pub(super) numbers: Vec<u32>,
    pub(super) targets: Vec<LightShape>,
    pub(super) block: Block,
}

impl Cell {
    fn new(directions: &[DVec3], numbers: &[u32]) -> Self {
        let targets: Vec<LightShape> = numbers
            .iter()
            .map(|&number| LightShape::Direction(directions[number as usize]))
            .collect();
        Self {
            numbers: numbers.to_vec(),
            block: Block::new(&targets),
            targets,
        }
    }

    /// Returns a bit for each direction of the cell.
    pub(super) fn all(&self) -> u64 {
        u64::MAX >> (TARGETS - self.targets.len())
    }
}

/// Parts directions into cells.
pub(super) fn cells(directions: &[DVec3]) -> Vec<Cell> {
    let mut faces: [Vec<(u32, [f64; 2])>; 6] = Default::default();
    for (number, direction) in directions.iter().enumerate() {
        let size = direction.abs();
        let axis = (0..3).fold(0, |axis, other| {
            if size[other] > size[axis] {
                other
            } else {
                axis
            }
        });
        // Zero has no slopes.
        let slope = |across: usize| {
            let slope = direction[across % 3] / size[axis];
            if slope.is_finite() { slope } else { 0.0 }
        };
        let face = 2 * axis + usize::from(direction[axis] < 0.0);
        faces[face].push((number as u32, [slope(axis + 1), slope(axis + 2)]));
    }
    let mut cells = Vec::with_capacity(directions.len().div_ceil(TARGETS) + 6);
    for face in &mut faces {
        part(face, &mut |numbers| {
            let numbers: Vec<u32> = numbers.iter().map(|&(number, _)| number).collect();
            cells.push(Cell::new(directions, &numbers));
        });
    }
    cells
}

/// Halves the longer side until few are left. All cells but one of each half are full where they can be.
fn part(of: &mut [(u32, [f64; 2])], take: &mut impl FnMut(&[(u32, [f64; 2])])) {
    if of.len() <= TARGETS {
        if !of.is_empty() {
            take(of);
        }
        return;
    }
    let extent = |axis: usize| {
        let slopes = of.iter().map(|(_, slopes)| slopes[axis]);
        let (least, most) = slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), x| {
            (least.min(x), most.max(x))
        });
        most - least
    };
    let axis = usize::from(extent(1) > extent(0));
    let half = (of.len() / 2).next_multiple_of(TARGETS).min(of.len() - 1);
    of.select_nth_unstable_by(half, |a, b| {
        a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0))
    });
    let (low, high) = of.split_at_mut(half);
    part(low, take);
    part(high, take);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_direction_is_in_one_cell_and_cells_go_one_way() {
        let directions: Vec<DVec3> = (0..1000)
            .map(|i| {
                let (a, b) = (f64::from(i) * 0.37, f64::from(i) * 0.11);
                DVec3::new(a.sin() * b.cos(), a.cos() * b.cos(), b.sin())
            })
            .chain([DVec3::ZERO, DVec3::X, DVec3::X])
            .collect();
        let cells = cells(&directions);
        let mut numbers: Vec<u32> = cells.iter().flat_map(|cell| cell.numbers.clone()).collect();
        numbers.sort_unstable();
        assert!(numbers.into_iter().eq(0..1003));
        assert!(cells.len() <= 1003 / TARGETS + 2 * 6, "{}", cells.len());
        for cell in &cells {
            assert!((1..=TARGETS).contains(&cell.numbers.len()));
            let axes = (0..3).filter(|&axis| {
                cell.numbers.iter().all(|&number| {
                    let direction = directions[number as usize];
                    direction[axis].abs() >= direction.abs().max_element()
                })
            });
            assert!(axes.count() > 0);
        }
    }
}
