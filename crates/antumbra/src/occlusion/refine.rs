//! What is written for the cells of a brick.
//!
//! A brick's cell keeps what may matter to it, is halved twice along each axis, and each part is decided, or keeps
//! the few possible blockers, or waits for a finer brick, or gets it at once: then what may matter is handed down. In:
//! the casters, the lattices. Out: bricks for one receiver class. Invariant: they are a function of the scene, the light, the
//! settings and the cell.

use antumbra_geometry::Bounds;
use antumbra_task::check;

use super::bricks::{Decision, Decisions, Store};
use super::candidates::{Candidates, Casters};
use super::lattice::{Cell, Code, Lattice};
use super::links::Link;
use super::value::ReceiverClass;

/// How far to refine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Depth {
    /// Halvings of the scene's box at most, for starts on surfaces.
    pub(crate) surfaces: u32,
    /// The same for points of space.
    pub(crate) space: u32,
    /// As few blockers are kept instead of finer cells.
    pub(crate) short_list: usize,
    /// The same for points of space.
    pub(crate) space_list: usize,
    /// As few blockers are kept in cells that are not refined further.
    pub(crate) long_list: usize,
}

/// Halvings of the scene's box at most where no surface is.
const EMPTY_SPACE_LEVEL: u32 = 7;

/// After so many halvings longer lists do: finer voxels would be read by few.
const FINE_LEVEL: u32 = 9;
const FINE_LISTS: usize = 3;

/// Testing a sphere takes as long as testing so many triangles.
const CURVED_COST: usize = 3;

/// So many times longer lists do for starts with the light behind.
const BACK_LISTS: usize = 4;

pub(crate) struct Refiner<'a> {
    pub(crate) casters: Casters<'a>,
    pub(crate) lattice: &'a Lattice,
    pub(crate) class: ReceiverClass,
    pub(crate) depth: Depth,
    /// Where bricks are written.
    pub(crate) store: &'a Store,
    /// Rays that a cell without a finer brick is asked until one is made, as a power of two.
    pub(crate) price: u32,
    /// Whether all finer bricks are made at once.
    pub(crate) is_deep: bool,
}

/// A brick's cells are halved so many times along each axis.
const HALVINGS: u32 = 2;

impl Refiner<'_> {
    /// Makes a brick in place of a cell, whose candidates these are; `None` if there is no room. Candidates of finer
    /// cells are kept in those of `spare`.
    pub(crate) fn brick(
        &self,
        cell: Cell,
        candidates: &Candidates,
        spare: &mut Vec<Candidates>,
    ) -> Option<Link> {
        let mut decisions = Box::new([const { Decision::Nobody }; 64]);
        self.decide_halves(cell, candidates, [0; 3], HALVINGS, spare, &mut decisions);
        self.store.write(&decisions, self.price)
    }

    /// Decides the eight halves of a cell, which may be halved so many times. `at` is its place among those of its size
    /// in the brick.
    fn decide_halves(
        &self,
        cell: Cell,
        around: &Candidates,
        at: [u32; 3],
        halvings: u32,
        spare: &mut Vec<Candidates>,
        decisions: &mut Decisions,
    ) {
        let mut kept = spare.pop().unwrap_or_default();
        for (number, half) in cell.children().into_iter().enumerate() {
            if !self.lattice.is_inside(half) {
                continue;
            }
            check();
            let bounds = self.lattice.inflated(half);
            let are_there = self
                .casters
                .narrow_holders(around, &bounds, self.class, &mut kept);
            if !are_there {
                continue;
            }
            self.casters.narrow(around, &bounds, &mut kept);
            let at = std::array::from_fn(|axis| 2 * at[axis] + (number as u32 >> axis & 1));
            let mut decision = self.decide(half, &kept, &bounds);
            if decision == Decision::Pending && halvings > 1 {
                self.decide_halves(half, &kept, at, halvings - 1, spare, decisions);
                continue;
            }
            // What is too much for what is left is not worth finding out.
            if decision == Decision::Pending
                && self.is_deep
                && !self.store.is_full()
                && let Some(link) = self.brick(half, &kept, spare)
            {
                decision = Decision::Finer(link);
            }
            fill(decisions, at, 1 << (halvings - 1), decision);
        }
        spare.push(kept);
    }

    /// Returns what to write for a whole cell.
    fn decide(&self, cell: Cell, candidates: &Candidates, bounds: &Bounds) -> Decision {
        if candidates.triangles.is_empty()
            && candidates.crossing.is_empty()
            && candidates.covering.is_empty()
        {
            return Decision::Known(false);
        }
        let depth = self.depth;
        if self.class == ReceiverClass::Free {
            if let Some(is_shadowed) = self.casters.decide_free(candidates, bounds) {
                return Decision::Known(is_shadowed);
            }
            // Fine cells only near surfaces.
            let finest = if candidates.holders.is_empty() {
                depth.space.min(EMPTY_SPACE_LEVEL)
            } else {
                depth.space
            };
            return self.list(cell.level, finest, depth.space_list, |most, curved_cost| {
                self.casters
                    .blockers(None, candidates, bounds, (most, curved_cost))
            });
        }
        let receivers = self.casters.receivers(self.class, candidates, bounds);
        if receivers.is_empty() {
            return Decision::Nobody;
        }
        let decided = self.casters.decide_surfaces(&receivers, candidates, bounds);
        if let Some(is_shadowed) = decided {
            return Decision::Known(is_shadowed);
        }
        let short_list = match self.class {
            // Few ask from behind.
            ReceiverClass::Back => BACK_LISTS * depth.short_list,
            ReceiverClass::Front | ReceiverClass::Free => depth.short_list,
        };
        let short_list = if cell.level >= FINE_LEVEL {
            FINE_LISTS * short_list
        } else {
            short_list
        };
        self.list(
            cell.level,
            depth.surfaces,
            short_list,
            |most, curved_cost| {
                self.casters
                    .blockers(Some(&receivers), candidates, bounds, (most, curved_cost))
            },
        )
    }

    /// Returns what to write for a cell that has no one answer, given what lists so many blockers at most.
    fn list(
        &self,
        level: u32,
        finest: u32,
        short_list: usize,
        blockers: impl Fn(usize, usize) -> Option<Vec<u32>>,
    ) -> Decision {
        let is_finest = level >= finest;
        let (most, curved_cost) = match () {
            () if is_finest => (self.depth.long_list, 1),
            // Cells of other levels would need a list for each of the cells that they become.
            () if self.lattice.is_level_of_cells(level) => (short_list, CURVED_COST),
            () => (0, 1),
        };
        match (most > 0).then(|| blockers(most, curved_cost)).flatten() {
            Some(list) if list.is_empty() => Decision::Known(false),
            Some(list) => Decision::List(list.into()),
            None if is_finest => Decision::Ray,
            None => Decision::Pending,
        }
    }
}

/// Writes one decision for a cube of cells of a brick, `edge` of them along an axis.
fn fill(decisions: &mut Decisions, at: [u32; 3], edge: u32, decision: Decision) {
    for z in at[2] * edge..(at[2] + 1) * edge {
        for y in at[1] * edge..(at[1] + 1) * edge {
            for x in at[0] * edge..(at[0] + 1) * edge {
                decisions[Code::place_of([x, y, z])] = decision.clone();
            }
        }
    }
}
