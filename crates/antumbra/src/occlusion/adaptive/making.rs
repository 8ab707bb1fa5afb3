//! The making of tables, maps and bricks: before the first query, or one by one.

use std::ops::Range;
use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard, OnceLock, PoisonError};

use antumbra_geometry::Occluders;
use antumbra_task::{Steps, check};

use super::super::bricks::{Store, cell_in_brick};
use super::super::candidates::{Candidates, Casters};
use super::super::lattice::Cell;
use super::super::links::{Link, read};
use super::super::map::{self, Map};
use super::super::packed::Packed;
use super::super::refine::Refiner;
use super::super::room::Share;
use super::super::tables::{LightTables, SceneTables};
use super::super::value::ReceiverClass;
use super::scene::Scene;
use super::{AdaptiveValues, Knowledge, Known, Lists, PackedLight};
use crate::Refine;
use crate::accel::bvh::Bvh;
use crate::threads::prelude::*;

/// Queries for which a map is made before the first one.
const WHOLE_MAP: f32 = 2e8;

impl AdaptiveValues {
    /// Returns whether anything is wanted before the first query.
    pub(crate) fn is_made_first(&self) -> bool {
        self.refine != Refine::Lazy
    }

    /// Makes what is wanted of some lights before the first query, on all threads; all values with a tree.
    pub(crate) fn make_first<'a>(
        &mut self,
        occluders: &Occluders,
        tree: impl FnOnce() -> &'a Bvh,
        lights: Range<usize>,
    ) {
        match self.refine {
            Refine::Eager if self.knowledge == Knowledge::Maps => self.make_maps(occluders, lights),
            Refine::Eager if self.is_all_packed() => {}
            Refine::Eager => self.make_all(occluders, tree(), lights),
            Refine::Lazy => {}
            Refine::Queried => lights.for_each(|light| {
                let known = self.make_known(occluders, light, false);
                if let (Some(known), Knowledge::Maps) = (known, self.knowledge) {
                    self.make_map(occluders, light, &known.lists, None);
                }
            }),
        }
    }

    /// Makes whole maps of some lights, as far as there is room.
    fn make_maps(&self, occluders: &Occluders, lights: Range<usize>) {
        let steps = Steps::new("baking", lights.len() as u64);
        for light in lights {
            steps.step(|| {
                if let Some(known) = self.make_known(occluders, light, false) {
                    self.make_map(occluders, light, &known.lists, Some(WHOLE_MAP));
                    self.make_rest_of_map(occluders, light, &known.lists);
                }
            });
        }
    }

    /// Makes the tiles that are missing of a map that was taken.
    fn make_rest_of_map(&self, occluders: &Occluders, light: usize, lists: &Lists) {
        let tables = self.tables(occluders, light, lists);
        if let (Some(map), Some(tables)) = (lists.map(), tables) {
            map.make_all(&tables, WHOLE_MAP);
        }
    }

    /// Makes all values of some lights, light by light, as far as there is room.
    fn make_all(&mut self, occluders: &Occluders, bvh: &Bvh, lights: Range<usize>) {
        self.restore_tables(occluders);
        let scene = Scene { occluders, bvh };
        let brick_count: u64 = ReceiverClass::ALL
            .iter()
            .map(|&class| self.lattices[class as usize].root_bricks().count() as u64)
            .sum();
        let steps = Steps::new("baking", lights.len() as u64 * brick_count);
        for light in lights {
            if !self.lights[light].is_ordinary || self.packed(light).is_some() {
                continue;
            }
            if !self.can_make(occluders) {
                self.lights[light].is_refused.store(true, Ordering::Relaxed);
                continue;
            }
            let is_complete = self.lights[light].is_complete();
            // Where these find no room, rays answer; another light may need less.
            let Some(known) = self.make_known(occluders, light, !is_complete) else {
                continue;
            };
            let Some(store) = &known.store else {
                drop(known);
                self.drop_known(light);
                continue;
            };
            if !is_complete && self.make_edges(occluders, light, &known.lists) {
                self.make_rest_of_light(&scene, light, &known.lists, store, &steps);
            }
            drop(known);
            self.pack(light);
        }
        self.finish();
    }

    fn make_rest_of_light(
        &self,
        scene: &Scene<'_>,
        light: usize,
        lists: &Lists,
        store: &Store,
        steps: &Steps,
    ) {
        for class in ReceiverClass::ALL {
            let lattice = &self.lattices[class as usize];
            let finder = store.finder(class, lattice);
            let cells: Vec<Cell> = lattice.root_bricks().collect();
            cells.into_par_iter().for_each(|cell| {
                let place = finder.place_in_root(cell);
                steps.step(|| self.make_rest((store, lists), scene, light, class, cell, place));
            });
        }
        if store.is_full() {
            self.lights[light].is_refused.store(true, Ordering::Relaxed);
        }
    }

    /// Packs the values of a light for reading and drops its store, if all of it can be told so and there is room.
    /// Nobody asks meanwhile.
    fn pack(&self, light: usize) {
        let values = &self.lights[light];
        let Some(Ok(Known { lists, store })) = values.known.swap(None).map(Arc::try_unwrap) else {
            return;
        };
        let put_back = |lists, store| {
            let known = Known { lists, store };
            values.known.store(Some(Arc::new(known)));
        };
        let (mut lists, store) = match (Arc::try_unwrap(lists), store) {
            (Ok(lists), Some(store)) => (lists, store),
            (Ok(lists), store) => return put_back(Arc::new(lists), store),
            (Err(lists), store) => return put_back(lists, store),
        };
        lists.tables.finish();
        let most = Packed::height_bytes(&store);
        let held = self.room.hold(most);
        let packed = (held.bytes() == most)
            .then(|| Packed::new(&store, &self.lattices))
            .flatten();
        let share = packed.as_ref().and_then(|packed| held.keep(packed.bytes()));
        let (Some(packed), Some(share)) = (packed, share) else {
            return put_back(Arc::new(lists), Some(store));
        };
        drop(store);
        self.holders().retain(|&holder| holder != light);
        self.put_packed(light, packed, lists, share);
    }

    pub(super) fn put_packed(&self, light: usize, packed: Packed, lists: Lists, share: Share) {
        self.lights[light].packed.get_or_init(|| {
            Box::new(PackedLight {
                packed,
                lists,
                _share: share,
            })
        });
    }

    /// Drops what was needed only to make values, where none will be made.
    fn finish(&mut self) {
        let is_any_open = self.lights.iter().any(|light| light.known.load().is_some());
        if let (false, Some((tables, share))) = (is_any_open, self.tables.get_mut()) {
            share.shrink_to(tables.finish());
        }
    }

    /// Makes the scene's tables once more, of which what only makes values was dropped, where there is room. Without,
    /// nothing more can be made.
    fn restore_tables(&mut self, occluders: &Occluders) {
        let has_values = self.knowledge == Knowledge::Values;
        let is_short = |(tables, _): &(SceneTables, Share)| !tables.can_make(occluders);
        if self.tables.get().is_some_and(is_short)
            && let Some(share) = self
                .room
                .take(SceneTables::bytes_for(occluders, has_values))
        {
            let tables = SceneTables::new(occluders, &self.frame, has_values);
            self.tables = OnceLock::from((tables, share));
        }
    }

    /// Returns whether values can be made with the scene's tables, or those are not made yet.
    fn can_make(&self, occluders: &Occluders) -> bool {
        let can_make = |(tables, _): &(SceneTables, Share)| tables.can_make(occluders);
        self.tables.get().is_none_or(can_make)
    }

    /// Makes the values that are missing of a cell whose link this is, and of all finer ones.
    fn make_rest(
        &self,
        (store, lists): (&Store, &Lists),
        scene: &Scene<'_>,
        light: usize,
        class: ReceiverClass,
        cell: Cell,
        place: u32,
    ) {
        // What is too much for what is left is not worth finding out.
        if store.is_full() {
            return;
        }
        let link = read(store.word(place));
        if link.is_pending() {
            check();
            let target = (light, class, cell);
            match self.brick((store, lists), scene, target, true) {
                Some(made) => store.publish(place, made),
                None => self.lights[light].is_refused.store(true, Ordering::Relaxed),
            }
        } else if let Some(brick_at) = link.brick() {
            for (place, number) in store.unfinished(brick_at) {
                let finer = cell_in_brick(cell, number);
                self.make_rest((store, lists), scene, light, class, finer, place);
            }
        }
    }

    /// Makes tables of the scene, where there is room.
    pub(super) fn make_scene_tables(&self, occluders: &Occluders) -> Option<()> {
        if self.tables.get().is_none() {
            let has_values = self.knowledge == Knowledge::Values;
            let share = self
                .room
                .take(SceneTables::bytes_for(occluders, has_values))?;
            // Another thread may be faster.
            let tables = SceneTables::new(occluders, &self.frame, has_values);
            self.tables.get_or_init(|| (tables, share));
        }
        Some(())
    }

    /// Returns what is known of a light, to which more may be added: where nothing is yet, tables and a store in which
    /// nothing is known, if there is room; before the store the edges, if they are wanted. One thread at a time.
    pub(super) fn make_known(
        &self,
        occluders: &Occluders,
        light: usize,
        has_edges: bool,
    ) -> Option<Arc<Known>> {
        let values = &self.lights[light];
        if !values.is_ordinary {
            return None;
        }
        let before = values.known.load_full();
        let is_all = |known: &Known| known.store.is_some() || self.knowledge == Knowledge::Maps;
        if before.as_deref().is_some_and(is_all) {
            return before;
        }
        let made = self
            .make_lists(occluders, light, before.as_deref())
            .filter(|lists| !has_edges || self.make_edges(occluders, light, lists));
        let Some(lists) = made else {
            values.is_refused.store(true, Ordering::Relaxed);
            return None;
        };
        let has_store = self.knowledge == Knowledge::Values;
        let store = has_store.then(|| {
            let (bytes, price) = (self.store_bytes(&lists), self.price());
            Store::new(&self.room, bytes, &self.lattices, price)
        });
        let store = store.flatten();
        if has_store && store.is_none() {
            values.is_refused.store(true, Ordering::Relaxed);
            if before.is_some() {
                return before;
            }
        }
        let known = Arc::new(Known { lists, store });
        let mut holders = self.holders();
        values.known.store(Some(Arc::clone(&known)));
        if !holders.contains(&light) {
            holders.push(light);
        }
        Some(known)
    }

    fn make_lists(
        &self,
        occluders: &Occluders,
        light: usize,
        known: Option<&Known>,
    ) -> Option<Arc<Lists>> {
        if let Some(known) = known {
            return Some(Arc::clone(&known.lists));
        }
        self.make_scene_tables(occluders)?;
        self.new_lists(occluders, light).map(Arc::new)
    }

    /// Makes tables of a light, where there is room. Those of the scene are there.
    pub(super) fn new_lists(&self, occluders: &Occluders, light: usize) -> Option<Lists> {
        let share = self.room.take(LightTables::bytes_for(occluders))?;
        let light = &self.lights[light].light;
        Some(Lists {
            tables: LightTables::new(occluders, &self.frame, light),
            map: OnceLock::new(),
            share,
        })
    }

    /// Returns the bytes that a store may take: before the first query so many that its values can be packed beside it,
    /// once the edges are dropped.
    fn store_bytes(&self, lists: &Lists) -> u64 {
        match self.refine {
            Refine::Eager => (self.room.left() + lists.tables.edge_bytes()) / 5 * 2,
            Refine::Lazy | Refine::Queried => self.room.most(),
        }
    }

    pub(super) fn holders(&self) -> MutexGuard<'_, Vec<usize>> {
        self.holders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Drops what is known of a light.
    pub(super) fn drop_known(&self, light: usize) {
        let mut holders = self.holders();
        holders.retain(|&holder| holder != light);
        self.lights[light].known.store(None);
    }

    /// Makes the mesh and a light's contour edges, where there is room; returns whether they are there.
    pub(super) fn make_edges(&self, occluders: &Occluders, light: usize, lists: &Lists) -> bool {
        let values = &self.lights[light];
        let is_made = self.tables.get().is_some_and(|(scene, _)| {
            let of_light = (&self.frame, &values.light);
            let tables = &lists.tables;
            tables.make_edges(scene, occluders, of_light, &self.room)
        });
        if !is_made {
            values.is_refused.store(true, Ordering::Relaxed);
        }
        is_made
    }

    /// Makes the map of a light, where there is room: all of it for so many queries, or nothing until somebody asks.
    pub(super) fn make_map(
        &self,
        occluders: &Occluders,
        light: usize,
        lists: &Lists,
        queries: Option<f32>,
    ) {
        lists.map.get_or_init(|| {
            let (scene, _) = self.tables.get()?;
            // For sheets; where there is no room for it there are none.
            scene.make_mesh(occluders, &self.room, false);
            let tables = self.tables(occluders, light, lists)?;
            let height = map::height_bytes(occluders);
            let words = map::most_words(occluders);
            let held = self.room.hold(height + words);
            let map = held.bytes().checked_sub(height).and_then(|words| {
                let mut map = Map::new(occluders, &tables, words)?;
                if let Some(queries) = queries {
                    map = map.whole(&tables, queries);
                }
                let share = held.keep(map.bytes())?;
                Some(map.keep(share))
            });
            if map.is_none() {
                let values = &self.lights[light];
                values.is_refused.store(true, Ordering::Relaxed);
            }
            map
        });
    }

    /// Makes a brick in place of a cell, and perhaps all finer ones; `None` if there is no room.
    pub(super) fn brick(
        &self,
        (store, lists): (&Store, &Lists),
        scene: &Scene<'_>,
        (light, class, cell): (usize, ReceiverClass, Cell),
        is_deep: bool,
    ) -> Option<Link> {
        let casters = Casters::new(self.tables(scene.occluders, light, lists)?);
        let lattice = &self.lattices[class as usize];
        let bounds = lattice.inflated(cell);
        let gathered = casters.gather(scene.bvh, &bounds);
        let mut candidates = Candidates::NONE;
        casters.narrow_holders(&gathered, &bounds, class, &mut candidates);
        casters.narrow(&gathered, &bounds, &mut candidates);
        let refiner = Refiner {
            casters,
            lattice,
            class,
            depth: self.depth,
            store,
            price: self.price(),
            is_deep,
        };
        refiner.brick(cell, &candidates, &mut Vec::new())
    }
}
