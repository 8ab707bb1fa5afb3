//! What is known of points of space, in cells of one size.
//!
//! In: what is known, a level of cells. Out: for each cell whether all its points are lit, all in shadow, or neither or not
//! known. Invariant: what is said of a cell holds for every point in it.

use antumbra_geometry::{Bounds, DVec3};

use super::bricks::cell_in_brick;
use super::lattice::{Cell, Lattice};
use super::links::Link;
use super::stream::Known;
use super::value::{ReceiverClass, Values64};

/// A cell that nothing was said of yet.
const NOTHING: u8 = u8::MAX;

/// Where cells of one size are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cells {
    level: u32,
    /// How many, along each axis.
    pub(crate) counts: [u32; 3],
    /// The lowest corner of the first, in world units.
    pub(crate) min: DVec3,
    pub(crate) edge: f64,
}

impl Cells {
    /// Returns those cells of a lattice that hold the scene, its longest side halved so many times.
    pub(crate) fn new(lattice: &Lattice, scene: &Bounds, level: u32) -> Self {
        let (min, longest) = lattice.corner_and_edge();
        let edge = longest / f64::from(1u32 << level);
        let counts = (scene.max - min).to_array().map(|size| {
            let count = (size / edge).floor() + 1.0;
            // The scene lies inside, so it is no more than there are.
            (count.max(1.0) as u32).min(1 << level)
        });
        Self {
            level,
            counts,
            min,
            edge,
        }
    }

    /// Returns how many cells there are.
    pub(crate) fn count(&self) -> u64 {
        self.counts.iter().map(|&count| u64::from(count)).product()
    }

    /// Says of all cells what is known about a light, every `step`th value from the first on; z runs fastest.
    pub(super) fn fill(
        &self,
        known: &impl Known,
        lattice: &Lattice,
        values: &mut [u8],
        step: usize,
    ) {
        let mut filling = Filling {
            cells: self,
            known,
            values,
            step,
        };
        filling
            .values
            .iter_mut()
            .step_by(step)
            .for_each(|value| *value = NOTHING);
        let links = known.roots(ReceiverClass::Free);
        for (brick, link) in lattice.root_bricks().zip(links) {
            filling.link(brick, link);
        }
        let nothing = filling.values.iter_mut().step_by(step);
        nothing
            .filter(|value| **value == NOTHING)
            .for_each(|value| *value = MIXED);
    }
}

/// What is said of a cell.
pub(crate) const LIT: u8 = 0;
pub(crate) const SHADOWED: u8 = 1;
pub(crate) const MIXED: u8 = 2;

struct Filling<'a, K> {
    cells: &'a Cells,
    known: &'a K,
    values: &'a mut [u8],
    step: usize,
}

impl<K: Known> Filling<'_, K> {
    /// Says what a link says of its cell.
    fn link(&mut self, cell: Cell, link: Link) {
        let Some(brick) = link.brick() else {
            return self.all(cell, known(link.answer()));
        };
        let (planes, links) = self.known.brick(brick);
        let mut links = links.into_iter();
        for number in 0..64 {
            let finer = cell_in_brick(cell, number);
            let (value, _) = Values64::read(number, |word| planes[word]);
            match value.of_surface_point() {
                Some(is_shadowed) => self.all(finer, known(Some(is_shadowed))),
                None => {
                    let link = links.next().unwrap_or(Link::RAY);
                    self.link(finer, link);
                }
            }
        }
    }

    /// Says one value of a whole cell: of all that it holds, or of the one that it is a part of.
    fn all(&mut self, cell: Cell, value: u8) {
        let level = self.cells.level;
        let counts = self.cells.counts;
        let finer = level.saturating_sub(cell.level);
        let coarser = cell.level.saturating_sub(level);
        let from = cell.at.map(|at| at >> coarser << finer);
        let to: [u32; 3] =
            std::array::from_fn(|axis| (from[axis] + (1 << finer)).min(counts[axis]));
        for x in from[0]..to[0] {
            for y in from[1]..to[1] {
                for z in from[2]..to[2] {
                    let [x, y, z] = [x, y, z].map(|at| at as usize);
                    let place = (x * counts[1] as usize + y) * counts[2] as usize + z;
                    let said = &mut self.values[place * self.step];
                    *said = match *said {
                        NOTHING => value,
                        same if same == value => value,
                        _ => MIXED,
                    };
                }
            }
        }
    }
}

fn known(answer: Option<bool>) -> u8 {
    match answer {
        Some(false) => LIT,
        Some(true) => SHADOWED,
        None => MIXED,
    }
}
