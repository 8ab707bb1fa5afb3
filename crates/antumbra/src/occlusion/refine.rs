//! What is written for the cells of a brick.
//!
//! A brick's cell keeps what may matter to it, is halved twice along each axis, and each part is decided, or keeps
//! the few possible blockers, or waits for a finer brick. In: the casters, the lattices. Out: 64 decisions
//! for one audience. Invariant: they are a function of the scene, the light, the settings and the cell.

use antumbra_geometry::Bounds;
use antumbra_task::check;

use super::bricks::{Decision, Decisions, Finer};
use super::candidates::{Candidates, Casters};
use super::lattice::{Cell, Code, Lattice};
use super::value::Audience;

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
    /// As few blockers are kept until there are finer cells.
    pub(crate) early_list: usize,
    /// As few blockers are kept in cells that are not refined further.
    pub(crate) long_list: usize,
}

/// Halvings of the scene's box at most where no surface is.
const EMPTY_SPACE_LEVEL: u32 = 7;

/// After so many halvings longer lists do: finer voxels would be read by few.
const FINE_LEVEL: u32 = 9;
const FINE_LISTS: usize = 3;

/// So many times longer lists do in cells at the root, for a start.
const ROOT_LISTS: usize = 2;

/// Testing a sphere takes as long as testing so many triangles.
const CURVED_COST: usize = 3;

/// So many times longer lists do for starts with the light behind.
const BACK_LISTS: usize = 4;

pub(crate) struct Refiner<'a> {
    pub(crate) casters: Casters<'a>,
    pub(crate) lattice: &'a Lattice,
    pub(crate) audience: Audience,
    pub(crate) depth: Depth,
    pub(crate) care: Care,
}

/// How much work a cell is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Care {
    /// Only what the cell's own candidates tell: there are none, one covers it, or they are few.
    Quick,
    /// Events are looked for.
    Full,
}

impl Refiner<'_> {
    /// Returns what is decided for the 64 cells of a brick in place of a cell, whose candidates these are.
    pub(crate) fn decide_brick(&self, cell: Cell, candidates: &Candidates) -> Box<Decisions> {
        let mut decisions = Box::new([const { Decision::Nobody }; 64]);
        let mut kept = [const { Candidates::NONE }; 2];
        self.decide_halves(cell, candidates, [0; 3], &mut kept, &mut decisions);
        decisions
    }

    /// Decides the eight halves of a cell, which may be halved as often as there is something to keep what
    /// is left in. `at` is its place among those of its size in the brick.
    fn decide_halves(
        &self,
        cell: Cell,
        around: &Candidates,
        at: [u32; 3],
        kept: &mut [Candidates],
        decisions: &mut Decisions,
    ) {
        let Some((kept, deeper)) = kept.split_first_mut() else {
            return;
        };
        for (number, half) in cell.children().into_iter().enumerate() {
            if !self.lattice.is_inside(half) {
                continue;
            }
            check();
            let bounds = self.lattice.inflated(half);
            let are_there = self
                .casters
                .narrow_holders(around, &bounds, self.audience, kept);
            if !are_there {
                continue;
            }
            self.casters.narrow(around, &bounds, kept);
            let at = std::array::from_fn(|axis| 2 * at[axis] + (number as u32 >> axis & 1));
            let decision = self.decide(half, kept, &bounds);
            if decision == Decision::Pending && !deeper.is_empty() {
                self.decide_halves(half, kept, at, deeper, decisions);
            } else {
                fill(decisions, at, 1 << deeper.len(), decision);
            }
        }
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
        if self.care == Care::Quick {
            return self.decide_quickly(cell.level, candidates);
        }
        if self.audience == Audience::Free {
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
                self.casters.blockers(None, candidates, most, curved_cost)
            });
        }
        let receivers = self.casters.receivers(self.audience, candidates, bounds);
        if receivers.is_empty() {
            return Decision::Nobody;
        }
        let decided = self.casters.decide_surfaces(&receivers, candidates, bounds);
        if let Some(is_shadowed) = decided {
            return Decision::Known(is_shadowed);
        }
        let short_list = match self.audience {
            // Few ask from behind.
            Audience::Back => BACK_LISTS * depth.short_list,
            Audience::Front | Audience::Free => depth.short_list,
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
                    .blockers(Some(&receivers), candidates, most, curved_cost)
            },
        )
    }

    /// Returns what a cell's candidates tell at once.
    pub(crate) fn decide_quickly(&self, level: u32, candidates: &Candidates) -> Decision {
        if candidates.is_covered {
            return Decision::Known(true);
        }
        let most = match self.lattice.is_level_of_cells(level) {
            true => self.depth.early_list,
            // At the root.
            false if level <= self.lattice.root_level => ROOT_LISTS * self.depth.early_list,
            false => return Decision::Pending,
        };
        match self.casters.blockers(None, candidates, most, CURVED_COST) {
            Some((list, _)) if list.is_empty() => Decision::Known(false),
            Some((list, _)) => Decision::List(list.into(), Finer::Perhaps),
            None => Decision::Pending,
        }
    }

    /// Returns what to write for a cell that has no one answer, given what lists so many blockers at most.
    fn list(
        &self,
        level: u32,
        finest: u32,
        short_list: usize,
        blockers: impl Fn(usize, usize) -> Option<(Vec<u32>, usize)>,
    ) -> Decision {
        let is_finest = level >= finest;
        // Cells of other levels would need a list for each of the cells that they become.
        let is_own_cell = is_finest || self.lattice.is_level_of_cells(level);
        let (most, curved_cost) = match () {
            () if is_finest => (self.depth.long_list, 1),
            () if is_own_cell => (short_list.max(self.depth.early_list), CURVED_COST),
            () => (0, 1),
        };
        let list = (most > 0).then(|| blockers(most, curved_cost)).flatten();
        match list {
            Some((list, _)) if list.is_empty() => Decision::Known(false),
            Some((list, cost)) if is_finest || cost <= short_list => {
                Decision::List(list.into(), Finer::Never)
            }
            Some((list, _)) => Decision::List(list.into(), Finer::Perhaps),
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
