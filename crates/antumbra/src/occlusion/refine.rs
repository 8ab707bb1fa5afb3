//! Values for one light, refined where surfaces are.
//!
//! Top down: a cell keeps what may matter to it, is decided, or keeps the few possible blockers, or is
//! halved along each axis. In: the casters, the lattices. Out: one octree per audience. Invariant: what is written for a cell is a function of the scene, the light and the
//! cell.

use antumbra_geometry::Bounds;
use rayon::prelude::*;

use super::bricks::Decisions;
use super::candidates::{Candidates, Casters};
use super::lattice::{Cell, Lattice};
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
    /// As few blockers are kept in cells that are not refined further.
    pub(crate) long_list: usize,
}

/// Decisions for all audiences.
type Decided = [Decisions; 3];

/// Halvings of the scene's box at most where no surface is.
const EMPTY_SPACE_LEVEL: u32 = 7;

/// After so many halvings longer lists do: finer voxels would be read by few.
const FINE_LEVEL: u32 = 9;
const FINE_LISTS: usize = 3;

/// Testing a sphere takes as long as testing so many triangles.
const CURVED_COST: usize = 3;

/// So many times longer lists do for starts with the light behind.
const BACK_LISTS: usize = 4;

/// Cells of fewer halvings are shared among threads.
const PARALLEL_LEVEL: u32 = 6;

pub(crate) struct Refiner<'a> {
    pub(crate) casters: &'a Casters<'a>,
    /// For each [`Audience`].
    pub(crate) lattices: &'a [Lattice; 3],
    pub(crate) depth: Depth,
}

impl Refiner<'_> {
    /// Returns the decisions for the whole scene, for each audience.
    pub(crate) fn refine(&self) -> [Decisions; 3] {
        self.decide(Cell::ROOT, &self.casters.all(), [true; 3])
    }

    fn decide(&self, cell: Cell, around: &Candidates, pending: [bool; 3]) -> Decided {
        const NOBODY: Decided = [const { Decisions::Nobody }; 3];
        let mut lattices = self.lattices.iter();
        if !lattices.any(|lattice| lattice.is_inside(cell)) {
            return NOBODY;
        }
        let bounds = self.lattices[0].inflated(cell);
        let candidates = self.casters.narrow(around, &bounds, cell.level);
        let mut decided = NOBODY;
        let mut still = [false; 3];
        for (number, audience) in Audience::ALL.into_iter().enumerate() {
            if pending[number] {
                match self.decide_for(audience, cell, &candidates, &bounds) {
                    Some(decisions) => decided[number] = decisions,
                    None => still[number] = true,
                }
            }
        }
        if still.contains(&true) {
            let finer = self.decide_children(cell, &candidates, still);
            for (number, finer) in finer.into_iter().enumerate() {
                if still[number] {
                    decided[number] = finer;
                }
            }
        }
        decided
    }

    fn decide_children(&self, cell: Cell, candidates: &Candidates, pending: [bool; 3]) -> Decided {
        let decide = |child: Cell| self.decide(child, candidates, pending);
        let children: Vec<Decided> = if cell.level < PARALLEL_LEVEL {
            cell.children().into_par_iter().map(decide).collect()
        } else {
            cell.children().into_iter().map(decide).collect()
        };
        let mut all = [const { Vec::new() }; 3];
        for child in children {
            for (octrees, octree) in all.iter_mut().zip(child) {
                octrees.push(octree);
            }
        }
        all.map(|octrees| match <Box<[Decisions; 8]>>::try_from(octrees) {
            Ok(octrees) => Decisions::of_children(octrees),
            Err(_) => Decisions::Unknown,
        })
    }

    /// Returns what to write for a whole cell, or `None` to refine it.
    fn decide_for(
        &self,
        audience: Audience,
        cell: Cell,
        candidates: &Candidates,
        bounds: &Bounds,
    ) -> Option<Decisions> {
        if candidates.triangles.is_empty()
            && candidates.crossing.is_empty()
            && candidates.covering.is_empty()
        {
            return Some(Decisions::Known(false));
        }
        if audience == Audience::Free {
            if let Some(is_shadowed) = self.casters.decide_free(candidates, bounds) {
                return Some(Decisions::Known(is_shadowed));
            }
            // Fine cells only near surfaces.
            let finest = if candidates.holders.is_empty() {
                self.depth.space.min(EMPTY_SPACE_LEVEL)
            } else {
                self.depth.space
            };
            let most = self.most_listed(audience, cell.level, finest, self.depth.space_list);
            let list =
                most.and_then(|(most, cost)| self.casters.blockers(None, candidates, most, cost));
            return written(list, cell.level < finest);
        }
        let receivers = self.casters.receivers(audience, candidates, bounds);
        if receivers.is_empty() {
            return Some(Decisions::Nobody);
        }
        let decided = self.casters.decide_surfaces(&receivers, candidates, bounds);
        if let Some(is_shadowed) = decided {
            return Some(Decisions::Known(is_shadowed));
        }
        let finest = self.depth.surfaces;
        let short_list = match audience {
            // Few ask from behind.
            Audience::Back => BACK_LISTS * self.depth.short_list,
            Audience::Front | Audience::Free => self.depth.short_list,
        };
        let short_list = if cell.level >= FINE_LEVEL {
            FINE_LISTS * short_list
        } else {
            short_list
        };
        let most = self.most_listed(audience, cell.level, finest, short_list);
        let list = most.and_then(|(most, cost)| {
            self.casters
                .blockers(Some(&receivers), candidates, most, cost)
        });
        written(list, cell.level < self.depth.surfaces)
    }

    /// Returns how many blockers may be listed for a cell of a level, and as how many one that is no
    /// triangle counts; `None` for no lists.
    fn most_listed(
        &self,
        audience: Audience,
        level: u32,
        finest: u32,
        short_list: usize,
    ) -> Option<(usize, usize)> {
        let (most, curved_cost) = if level < finest {
            (short_list, CURVED_COST)
        } else {
            (self.depth.long_list, 1)
        };
        // Cells of other levels would need a list for each of the cells that they become.
        let is_own_cell =
            self.lattices[audience as usize].is_level_of_cells(level) || level == finest;
        (most > 0 && is_own_cell).then_some((most, curved_cost))
    }
}

/// Returns what to write for a cell of possible blockers, `None` to refine it.
fn written(list: Option<Vec<u32>>, can_refine: bool) -> Option<Decisions> {
    match list {
        Some(list) if list.is_empty() => Some(Decisions::Known(false)),
        Some(list) => Some(Decisions::List(list.into())),
        None if can_refine => None,
        None => Some(Decisions::Unknown),
    }
}

/// Returns the octrees under the coarsest bricks of a lattice.
pub(crate) fn cut_out<'a>(
    octree: &'a Decisions,
    lattice: &'a Lattice,
) -> impl Iterator<Item = (Cell, Decisions)> + 'a {
    lattice.root_bricks().map(move |brick| {
        let mut here = octree;
        for level in (0..brick.level).rev() {
            let Decisions::Split(children) = here else {
                break;
            };
            let place = (0..3).fold(0, |place, axis| {
                place | (brick.at[axis] >> level & 1) << axis
            });
            here = &children[place as usize];
        }
        (brick, here.clone())
    })
}
