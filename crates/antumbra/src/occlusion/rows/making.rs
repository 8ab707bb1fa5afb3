//! The making of rows: light by light, cell by cell, by the visibility events of the occlusion note.
//!
//! In: keys. Out: a table with their rows. The cells that the keys lie in are narrowed down from coarse to fine, as
//! bricks of values are, and each patch is decided by [`Casters::decide_surfaces`], each cell of space by
//! [`Casters::decide_free`]: there is no other theory here. Tables of a light are there only while its bits are made.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use antumbra_geometry::{LightShape, Occluders};
use antumbra_task::{Steps, check};

use super::super::adaptive::Scene;
use super::super::candidates::{Candidates, Casters};
use super::super::classify::Receivers;
use super::super::lattice::Cell;
use super::super::tables::{LightTables, SceneTables, Tables};
use super::super::value::ReceiverClass;
use super::light_rows::LightRows;
use super::table::{Key, PARTS, RowTable};
use crate::threads::prelude::*;

/// Cells of this level are the first whose candidates the tree is asked for.
const FIRST_LEVEL: u32 = 2;

impl LightRows {
    /// Makes rows for keys that have none, sorted, as many as there is room for, and returns the new table; `None` if
    /// there is no room. Nobody else makes rows meanwhile.
    pub(super) fn make(
        &self,
        scene: &Scene<'_>,
        lights: &[LightShape],
        keys: &[Key],
    ) -> Option<Arc<RowTable>> {
        debug_assert!(keys.is_sorted(), "cells lie together");
        let word_count = lights.len().div_ceil(64);
        let before = self.table();
        let old = before.as_ref().map_or(0, |table| table.row_count());
        let mut count = keys.len();
        // The rows are there twice while the table is written.
        let row_bytes = (PARTS * word_count * size_of::<u64>()) as u64;
        let (share, _held) = loop {
            if count == 0 {
                return None;
            }
            let share = self.room.take(RowTable::bytes_for(old + count, word_count));
            let most = count as u64 * row_bytes;
            let held = self.room.hold(most);
            match share {
                Some(share) if held.bytes() == most => break (share, held),
                _ => count /= 2,
            }
        };
        let keys = &keys[..count];
        let words = self.words(scene, lights, keys)?;
        let table = RowTable::new(before.as_deref(), keys, &words, word_count, share);
        let table = Arc::new(table);
        self.table.store(Some(Arc::clone(&table)));
        Some(table)
    }

    /// Returns the words of all rows, row by row; `None` if there is no room for what makes them.
    fn words(&self, scene: &Scene<'_>, lights: &[LightShape], keys: &[Key]) -> Option<Vec<u64>> {
        let occluders = scene.occluders;
        let _share = self.room.take(SceneTables::bytes_for(occluders, true))?;
        let tables = SceneTables::new(occluders, &self.frame, true);
        tables.make_mesh(occluders, &self.room, true)?;
        let stride = PARTS * lights.len().div_ceil(64);
        let words: Vec<AtomicU64> = (0..keys.len() * stride)
            .map(|_| AtomicU64::new(0))
            .collect();
        let steps = Steps::new("baking", lights.len() as u64);
        let task = antumbra_task::current();
        (0..lights.len()).into_par_iter().for_each(|light| {
            task.enter(|| {
                steps.step(|| {
                    let row = Bits {
                        keys,
                        words: &words,
                        stride,
                        light,
                    };
                    self.make_light(scene, &tables, &lights[light], &row);
                });
            });
        });
        Some(words.into_iter().map(AtomicU64::into_inner).collect())
    }

    /// Makes the bits of one light, as far as there is room for its tables.
    fn make_light(
        &self,
        scene: &Scene<'_>,
        of_scene: &SceneTables,
        light: &LightShape,
        row: &Bits<'_>,
    ) {
        let occluders = scene.occluders;
        row.set_sides(occluders, light);
        if !self.are_ordinary[row.light] {
            return;
        }
        let Some(_share) = self.room.take(LightTables::bytes_for(occluders)) else {
            return;
        };
        let of_light = LightTables::new(occluders, &self.frame, light);
        if !of_light.make_edges(of_scene, occluders, (&self.frame, light), &self.room) {
            return;
        }
        let tables = Tables::new(occluders, &self.frame, light, of_scene, &of_light);
        let descent = Descent {
            rows: self,
            casters: Casters::new(tables),
            row,
        };
        let first_level = FIRST_LEVEL.min(self.level);
        let mut pool = vec![Candidates::NONE; self.level as usize + 1];
        for part in parts(0..row.keys.len(), row.keys, 3 * (self.level - first_level)) {
            check();
            let number = row.keys[part.start].cell_number() >> (3 * (self.level - first_level));
            let cell = Cell::of_number(number, first_level);
            let bounds = self.lattice.inflated(cell);
            let gathered = descent.casters.gather(scene.bvh, &bounds);
            descent.cell(cell, part, &gathered, &mut pool);
        }
    }
}

/// Where the bits of one light are written.
struct Bits<'a> {
    keys: &'a [Key],
    words: &'a [AtomicU64],
    stride: usize,
    light: usize,
}

impl Bits<'_> {
    fn set(&self, key: usize, part: usize) {
        let word = key * self.stride + part * (self.stride / PARTS) + self.light / 64;
        self.words[word].fetch_or(1 << (self.light % 64), Ordering::Relaxed);
    }

    /// Says what is known of the starts of a key.
    fn set_known(&self, key: usize, is_shadowed: bool) {
        self.set(key, usize::from(is_shadowed));
    }

    /// Says for each key on which side of its triangle the light is.
    fn set_sides(&self, occluders: &Occluders, light: &LightShape) {
        let sides = occluders.light_sides(light);
        for (number, key) in self.keys.iter().enumerate() {
            // Surfaces that are no triangles have sides for each start.
            let side = key
                .surface()
                .map(|surface| sides.get(surface.0 as usize).map_or(0, |side| *side));
            if side.is_none_or(|side| side > 0) {
                self.set(number, 2);
            }
            if side.is_none_or(|side| side < 0) {
                self.set(number, 3);
            }
        }
    }
}

/// One light's bits on the way down.
struct Descent<'a> {
    rows: &'a LightRows,
    casters: Casters<'a>,
    row: &'a Bits<'a>,
}

impl Descent<'_> {
    /// Decides the keys of a range, which lie in a cell. `around` is what may matter to a cell that holds it.
    fn cell(
        &self,
        cell: Cell,
        range: std::ops::Range<usize>,
        around: &Candidates,
        pool: &mut [Candidates],
    ) {
        let Some((kept, pool)) = pool.split_first_mut() else {
            return;
        };
        let bounds = self.rows.lattice.inflated(cell);
        self.casters
            .narrow_holders(around, &bounds, ReceiverClass::Front, kept);
        self.casters.narrow(around, &bounds, kept);
        let is_clear =
            kept.triangles.is_empty() && kept.crossing.is_empty() && kept.covering.is_empty();
        if is_clear || kept.is_covered {
            for key in range {
                // Of starts whose triangle's plane holds the light nothing is said.
                let surface = self.row.keys[key].surface();
                let side = surface.and_then(|surface| self.casters.side(surface.0));
                if side != Some(0) {
                    self.row.set_known(key, !is_clear);
                }
            }
            return;
        }
        if cell.level == self.rows.level {
            for key in range {
                let decided = self.decide(self.row.keys[key], kept, &bounds);
                if let Some(is_shadowed) = decided {
                    self.row.set_known(key, is_shadowed);
                }
            }
            return;
        }
        let shift = 3 * (self.rows.level - cell.level - 1);
        for part in parts(range, self.row.keys, shift) {
            let number = self.row.keys[part.start].cell_number() >> shift;
            self.cell(Cell::of_number(number, cell.level + 1), part, kept, pool);
        }
    }

    /// Returns the one answer of all starts of a key, if it is proven.
    fn decide(
        &self,
        key: Key,
        candidates: &Candidates,
        bounds: &antumbra_geometry::Bounds,
    ) -> Option<bool> {
        let casters = &self.casters;
        let Some(surface) = key.surface() else {
            return casters.decide_free(candidates, bounds);
        };
        let receivers = match casters.side(surface.0) {
            Some(side) => {
                let patch = casters
                    .occluders
                    .patch(surface, bounds, &casters.light, side)?;
                Receivers::of_patch(patch, candidates)
            }
            // Of starts that its own rule does not shadow.
            None => Receivers::of_curved(surface, candidates),
        };
        casters.decide_surfaces(&receivers, candidates, bounds)
    }
}

/// Returns the parts of a range of keys that lie in one cell each, whose numbers are those of the finest shifted.
fn parts(
    range: std::ops::Range<usize>,
    keys: &[Key],
    shift: u32,
) -> impl Iterator<Item = std::ops::Range<usize>> {
    let mut first = range.start;
    std::iter::from_fn(move || {
        let rest = keys[first..range.end].iter();
        let number = keys[first..range.end].first()?.cell_number() >> shift;
        let count = rest
            .take_while(|key| key.cell_number() >> shift == number)
            .count();
        let part = first..first + count;
        first += count;
        Some(part)
    })
}
