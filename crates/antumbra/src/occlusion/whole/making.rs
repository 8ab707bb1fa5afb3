//! The making of values: cell by cell, from coarse to fine.
//!
//! In: keys. Out: what is known of them. Surfaces that may block are found in the tree for coarse cells and narrowed down;
//! what decides a key is in `deciding`. A function of the scene, the light, the cell and the surface.

use std::ops::ControlFlow;

use antumbra_geometry::{Bounds, DVec3, Occluders, SurfaceId};
use antumbra_task::check;

use super::super::lattice::Cell;
use super::hull::LightHull;
use super::maker::{Candidate, Decided, Maker};
use super::shaft::Planes;
use super::table::{Entries, Key, Known, Value};
use crate::accel::bvh::{Leaf, Region};
use crate::accel::frame::Frame;
use crate::clock::Reading;
use crate::threads::prelude::*;

/// The level of the cells that the tree is asked for, and halvings from one look at what may block to the next.
const FIRST_LEVEL: u32 = 4;
const STEP: u32 = 2;

/// Nothing is known of cells of the last level but one that so many surfaces may block.
const MOST_CANDIDATES: usize = 4096;

impl Maker<'_> {
    /// Makes the values of some keys, sorted, and returns the nanoseconds that all threads took.
    pub(super) fn make(&self, keys: &[Key]) -> (Entries, u64) {
        debug_assert!(keys.is_sorted(), "cells lie together");
        let first_level = FIRST_LEVEL.min(self.level);
        let shift = 3 * (self.level - first_level);
        let parts: Vec<&[Key]> = keys.chunk_by(are_in_one_cell(shift)).collect();
        let task = antumbra_task::current();
        let made: Vec<(Entries, u64)> = parts
            .into_par_iter()
            .map(|part| {
                task.enter(|| {
                    check();
                    let begin = Reading::now();
                    let number = part[0].cell_number() >> shift;
                    let cell = Cell::of_number(number, first_level);
                    let mut entries = Entries::default();
                    let candidates = self.gather(&self.in_frame(cell));
                    self.descend(cell, part, &candidates, &mut entries);
                    (entries, begin.elapsed_ns())
                })
            })
            .collect();
        let mut entries = Entries::default();
        let mut all_ns = 0;
        for (made, ns) in made {
            entries.add(made);
            all_ns += ns;
        }
        (entries, all_ns)
    }

    /// Returns the inflated box of a cell in the frame's units.
    pub(super) fn in_frame(&self, cell: Cell) -> Bounds {
        let bounds = self.lattice.inflated(cell);
        Bounds {
            min: self.frame.point_in_frame(bounds.min),
            max: self.frame.point_in_frame(bounds.max),
        }
    }

    fn region(&self, bounds: &Bounds) -> Region {
        Region::of_heights(Planes::of_box(bounds, self.hull).all())
    }

    /// Returns the surfaces that may block some start of a box.
    fn gather(&self, bounds: &Bounds) -> Vec<Candidate> {
        let region = self.region(bounds);
        let occluders = self.scene.occluders;
        let mut candidates = Vec::new();
        let _ = self.scene.bvh.cull_leaves(&region, |leaf, surface, _| {
            if occluders.is_opaque(surface) {
                candidates.push(Candidate { surface, leaf });
            }
            ControlFlow::Continue(())
        });
        candidates
    }

    /// Makes the values of keys in a cell. `around` is what may block some start of it.
    fn descend(&self, cell: Cell, keys: &[Key], around: &[Candidate], entries: &mut Entries) {
        let bounds = self.in_frame(cell);
        let region = self.region(&bounds);
        let kept: Vec<Candidate> = around
            .iter()
            .filter(|candidate| !self.is_beyond(&region, candidate.surface))
            .copied()
            .collect();
        let left = self.level - cell.level;
        if left <= STEP && kept.len() > MOST_CANDIDATES {
            for &key in keys {
                entries.known.push((key, Known::new(Value::Open, false)));
            }
            return;
        }
        let step = STEP.min(left.saturating_sub(1)).max(1).min(left);
        let shift = 3 * (left - step);
        for part in keys.chunk_by(are_in_one_cell(shift)) {
            let number = part[0].cell_number() >> shift;
            let inner = Cell::of_number(number, cell.level + step);
            if inner.level < self.level {
                self.descend(inner, part, &kept, entries);
                continue;
            }
            let bounds = self.in_frame(inner);
            for &key in part {
                self.enter(key, inner, &bounds, &kept, entries);
            }
        }
    }

    /// Adds what is known of a key.
    fn enter(
        &self,
        key: Key,
        cell: Cell,
        bounds: &Bounds,
        candidates: &[Candidate],
        entries: &mut Entries,
    ) {
        let (decided, are_on_side) = match key.surface() {
            Some(surface) if surface.0 as usize >= self.sides.len() => {
                (self.decide_on_curved(surface, bounds, candidates), false)
            }
            Some(surface) => self.decide_on(surface, key.side(), bounds, candidates),
            None => (self.decide_free(bounds, candidates), false),
        };
        let are_all_asked = are_on_side && self.hull.shines_to(&self.lattice.inflated(cell));
        let value = match decided {
            Decided::Lit => Value::Lit,
            Decided::Dark => Value::Dark,
            Decided::Open => Value::Open,
            Decided::Listed(leaves) => {
                Value::Listed(entries.push_list(leaves.into_iter().map(Leaf::word)))
            }
        };
        entries.known.push((key, Known::new(value, are_all_asked)));
    }

    fn is_beyond(&self, region: &Region, surface: SurfaceId) -> bool {
        let narrow = |point: DVec3| self.frame.point_in_frame(point).as_vec3().to_array();
        match self.scene.occluders.triangle_positions(surface) {
            Some(corners) => region.misses(corners.map(narrow).into_iter()),
            None => {
                let bounds = self.scene.occluders.surface_bounds(surface);
                region.misses(bounds.corners().map(narrow).into_iter())
            }
        }
    }
}

/// Returns of each triangle the side of its plane that all of a light is on.
pub(super) fn sides(occluders: &Occluders, frame: &Frame, hull: &LightHull) -> Vec<i8> {
    let side = |triangle: u32| {
        let corners = occluders.triangle_positions(SurfaceId(triangle));
        corners.map_or(0, |corners| {
            hull.side_of(&super::hull::Flat::new(frame, corners), 0.0)
        })
    };
    (0..occluders.triangle_count() as u32)
        .into_par_iter()
        .map(side)
        .collect()
}

/// Returns whether two keys lie in one cell, whose number is theirs shifted.
fn are_in_one_cell(shift: u32) -> impl Fn(&Key, &Key) -> bool {
    move |a, b| a.cell_number() >> shift == b.cell_number() >> shift
}
