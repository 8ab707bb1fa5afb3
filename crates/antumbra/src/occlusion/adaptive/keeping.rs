//! What is kept of values or shown of them: words to be stored, and taken again; cells of one size.

use std::borrow::Cow;
use std::sync::atomic::Ordering;

use antumbra_geometry::{Bounds, Occluders};

use super::super::bricks::Store;
use super::super::forms::{BOUND, START_ROOM};
use super::super::lattice::Lattice;
use super::super::map::{self, Map, MapRuns};
use super::super::packed::{Packed, Runs};
use super::super::refine::Depth;
use super::super::stream::{self, Misfit, Section, Stored, Told};
use super::super::value::ReceiverClass;
use super::super::volume::Cells;
use super::kept::KeptValues;
use super::{AdaptiveValues, Knowledge, Known, Lists, PackedLight};

/// Returns a light's map, as far as there is one.
fn keep_map(known: &Known) -> KeptValues<'static> {
    let mut kept = KeptValues {
        runs: Runs::default(),
        pending_count: 1,
    };
    if let Some(map) = known.lists.map() {
        let (runs, pending_count) = map.runs();
        kept.pending_count = pending_count;
        for (kept, run) in kept.runs.iter_mut().zip(runs) {
            *kept = Cow::Owned(run.into_owned());
        }
    }
    kept
}

impl AdaptiveValues {
    /// Returns everything that says where the cells are which values speak of, or the unit of maps, bit by bit.
    pub(crate) fn identity(&self) -> impl Iterator<Item = u64> {
        let reach = [START_ROOM.to_bits(), BOUND.to_bits().into()];
        let lattices = match self.knowledge {
            Knowledge::Maps => &[][..],
            Knowledge::Values => &self.lattices,
        };
        let cells = lattices.iter().flat_map(Lattice::identity);
        cells.chain(self.frame.identity()).chain(reach)
    }

    /// Returns how far values are refined.
    pub(crate) fn depth(&self) -> Depth {
        self.depth
    }

    /// Returns what is known of a light, to be kept.
    pub(crate) fn keep(&self, light: usize) -> KeptValues<'_> {
        let packed = self.packed(light).map(|light| &light.packed);
        if let Some(runs) = packed.and_then(Packed::runs) {
            return KeptValues {
                runs,
                pending_count: 0,
            };
        }
        let known = self.known(light);
        if let (Knowledge::Maps, Some(known)) = (self.knowledge, &known) {
            return keep_map(known);
        }
        let store = known.as_ref().and_then(|known| known.store.as_ref());
        let Section {
            words,
            pending_count,
        } = match (packed, store) {
            (Some(packed), _) => stream::write(&self.told(packed)),
            (None, Some(store)) => stream::write(&self.stored(store)),
            (None, None) => self.nothing(),
        };
        let mut runs = Runs::default();
        runs[0] = Cow::Owned(words);
        KeptValues {
            runs,
            pending_count,
        }
    }

    /// Returns no words; all coarsest bricks are pending.
    fn nothing(&self) -> Section {
        let brick_count = |lattice: &Lattice| lattice.root_bricks().count() as u64;
        Section {
            words: Vec::new(),
            pending_count: match self.knowledge {
                Knowledge::Maps => 1,
                Knowledge::Values => self.lattices.iter().map(brick_count).sum(),
            },
        }
    }

    fn told<'a>(&'a self, packed: &'a Packed) -> Told<'a> {
        Told {
            packed,
            lattices: &self.lattices,
        }
    }

    fn stored<'a>(&'a self, store: &'a Store) -> Stored<'a> {
        Stored {
            store,
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
            // Nothing was known.
            runs if runs.iter().all(|run| run.is_empty()) => Ok(()),
            runs if self.knowledge == Knowledge::Maps => self.take_map(occluders, light, runs),
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
        let share = self.room.take(bytes as u64).ok_or(Misfit::NoRoom)?;
        let packed = Packed::of_runs(runs, &self.lattices, occluders.surface_count())?;
        self.make_scene_tables(occluders).ok_or(Misfit::NoRoom)?;
        let lists = self.new_lists(occluders, light).ok_or(Misfit::NoRoom)?;
        self.put_packed(light, packed, lists, share);
        self.lights[light]
            .is_complete
            .store(true, Ordering::Relaxed);
        Ok(())
    }

    fn take_map(
        &self,
        occluders: &Occluders,
        light: usize,
        runs: MapRuns<'_>,
    ) -> Result<(), Misfit> {
        let known = self.make_known(occluders, light, false);
        let known = known.ok_or(Misfit::NoRoom)?;
        let taken = self.put_map(occluders, light, &known.lists, runs);
        taken.inspect_err(|_| self.drop_known(light))
    }

    fn put_map(
        &self,
        occluders: &Occluders,
        light: usize,
        lists: &Lists,
        runs: MapRuns<'_>,
    ) -> Result<(), Misfit> {
        // Which of a list lie in one plane is told by the mesh; where there is no room for it rays tell.
        if let Some((scene, _)) = self.tables.get() {
            scene.make_mesh(occluders, &self.room, false);
        }
        let tables = self.tables(occluders, light, lists);
        let tables = tables.ok_or(Misfit::NoRoom)?;
        let height = map::height_bytes(occluders);
        let held = self.room.hold(height + map::most_words(occluders));
        let words = held.bytes().checked_sub(height).ok_or(Misfit::NoRoom)?;
        let map = Map::of_runs(runs, occluders, &tables, words)?;
        let share = held.keep(map.bytes()).ok_or(Misfit::NoRoom)?;
        lists.map.get_or_init(|| Some(map.keep(share)));
        Ok(())
    }

    fn take_stream(
        &self,
        occluders: &Occluders,
        light: usize,
        words: &[u32],
    ) -> Result<(), Misfit> {
        let values = &self.lights[light];
        let known = self.make_known(occluders, light, false);
        let known = known.ok_or(Misfit::NoRoom)?;
        let store = known.store.as_ref().ok_or(Misfit::NoRoom)?;
        let surface_count = occluders.surface_count();
        let pending_count = stream::take(words, store, &self.lattices, surface_count);
        // What was read is in the way of what will be made.
        let pending_count = pending_count.inspect_err(|_| self.drop_known(light))?;
        values
            .is_complete
            .store(pending_count == 0, Ordering::Relaxed);
        Ok(())
    }

    /// Returns cells for points of space that hold the scene, its longest side halved so many times.
    pub(crate) fn cells(&self, scene: &Bounds, level: u32) -> Cells {
        Cells::new(&self.lattices[ReceiverClass::Free as usize], scene, level)
    }

    /// Says of all cells what is known about a light, every `step`th value from the first on.
    pub(crate) fn fill_cells(&self, light: usize, cells: &Cells, values: &mut [u8], step: usize) {
        let lattice = &self.lattices[ReceiverClass::Free as usize];
        if let Some(PackedLight { packed, .. }) = self.packed(light) {
            cells.fill(&self.told(packed), lattice, values, step);
        } else if let Some(known) = self.known(light)
            && let Some(store) = &known.store
        {
            cells.fill(&self.stored(store), lattice, values, step);
        }
    }
}
