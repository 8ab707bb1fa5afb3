//! What is kept of values or shown of them: words to be stored, and taken again; cells of one size.

use std::borrow::Cow;
use std::sync::atomic::Ordering;

use antumbra_geometry::{Bounds, Occluders};

use super::super::bricks::Store;
use super::super::candidates::Casters;
use super::super::forms::{BOUND, START_ROOM};
use super::super::lattice::Lattice;
use super::super::packed::{Packed, Runs};
use super::super::refine::Depth;
use super::super::stream::{self, Misfit, Nothing, Section, Stored, Told};
use super::super::value::Audience;
use super::super::volume::Cells;
use super::AdaptiveValues;

/// What is known of one light, to be kept.
pub(crate) struct KeptValues<'a> {
    pub(crate) runs: Runs<'a>,
    /// Links and lists in whose place finer cells may be made.
    pub(crate) pending_count: u64,
}

impl AdaptiveValues {
    /// Returns everything that says where the cells are which values speak of, bit by bit.
    pub(crate) fn identity(&self) -> impl Iterator<Item = u64> {
        let reach = [START_ROOM.to_bits(), BOUND.to_bits().into()];
        let lattices = self.lattices.iter();
        lattices.flat_map(Lattice::identity).chain(reach)
    }

    /// Returns how far values are refined.
    pub(crate) fn depth(&self) -> Depth {
        self.depth
    }

    /// Returns what is known of a light, to be kept.
    pub(crate) fn keep(&self, light: usize) -> KeptValues<'_> {
        let packed = self.packed(light);
        if let Some(runs) = packed.and_then(Packed::runs) {
            return KeptValues {
                runs,
                pending_count: 0,
            };
        }
        let Section {
            words,
            pending_count,
        } = match (packed, self.store()) {
            (Some(packed), _) => stream::write(&self.told(packed)),
            (None, Some(store)) => stream::write(&self.stored(&store, light)),
            (None, None) => stream::write(&Nothing(&self.lattices)),
        };
        let mut runs = Runs::default();
        runs[0] = Cow::Owned(words);
        KeptValues {
            runs,
            pending_count,
        }
    }

    fn told<'a>(&'a self, packed: &'a Packed) -> Told<'a> {
        Told {
            packed,
            lattices: &self.lattices,
        }
    }

    fn stored<'a>(&'a self, store: &'a Store, light: usize) -> Stored<'a> {
        Stored {
            store,
            light,
            lattices: &self.lattices,
        }
    }

    /// Takes what was kept of a light of which nothing is known yet.
    pub(crate) fn take(
        &self,
        occluders: &Occluders,
        light: usize,
        runs: Runs<'_>,
    ) -> Result<(), Misfit> {
        if !self.lights[light].is_ordinary {
            // Nothing is ever known of it.
            return Ok(());
        }
        match runs {
            [words, bricks, leaves, entries] if bricks.is_empty() => {
                match [leaves, entries].iter().all(|run| run.is_empty()) {
                    true => self.take_stream(occluders, light, &words),
                    false => Err(Misfit::At(words.len(), "lists of nothing")),
                }
            }
            runs => self.take_packed(occluders, light, runs),
        }
    }

    /// Takes values that are all there, as they are.
    fn take_packed(
        &self,
        occluders: &Occluders,
        light: usize,
        runs: Runs<'_>,
    ) -> Result<(), Misfit> {
        let bytes: usize = runs.iter().map(|run| size_of_val(&**run)).sum();
        if bytes as u64 > self.store_bytes {
            return Err(Misfit::NoRoom);
        }
        let packed = Packed::of_runs(runs, &self.lattices, occluders.surface_count())?;
        self.make_tables(occluders, light);
        let values = &self.lights[light];
        if let Some(of_light) = values.tables.get() {
            of_light.make_all(occluders, &self.frame, &values.light);
        }
        values.packed.get_or_init(|| packed);
        values.is_complete.store(true, Ordering::Relaxed);
        if self.is_all_packed() {
            self.store.store(None);
        }
        Ok(())
    }

    fn take_stream(
        &self,
        occluders: &Occluders,
        light: usize,
        words: &[u32],
    ) -> Result<(), Misfit> {
        let values = &self.lights[light];
        let store = self.store().ok_or(Misfit::NoRoom)?;
        // Even if nothing is pending lists want forms, and queries sides.
        self.make_tables(occluders, light);
        let tables = self.tables(occluders, light).ok_or(Misfit::NoRoom)?;
        let casters = Casters::new(tables);
        let pending_count = stream::take(
            words,
            &store,
            light,
            &self.lattices,
            occluders.surface_count(),
            |list| casters.side_by_side(list),
        )?;
        values
            .is_complete
            .store(pending_count == 0, Ordering::Relaxed);
        values.budget.expect_answers();
        Ok(())
    }

    /// Returns cells for points of space that hold the scene, its longest side halved so many times.
    pub(crate) fn cells(&self, scene: &Bounds, level: u32) -> Cells {
        Cells::new(&self.lattices[Audience::Free as usize], scene, level)
    }

    /// Says of all cells what is known about a light, every `step`th value from the first on.
    pub(crate) fn fill_cells(&self, light: usize, cells: &Cells, values: &mut [u8], step: usize) {
        let lattice = &self.lattices[Audience::Free as usize];
        match (self.packed(light), self.store()) {
            (Some(packed), _) => cells.fill(&self.told(packed), lattice, values, step),
            (None, Some(store)) => cells.fill(&self.stored(&store, light), lattice, values, step),
            (None, None) => {}
        }
    }
}
