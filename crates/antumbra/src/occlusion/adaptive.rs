//! The values of all lights, made when they pay.
//!
//! In: the surfaces, the lights, the tree. Out: a store and tables, which `lookup` reads. Invariants: what a store
//! says is a function of the scene, the light and the cell; how much it says depends on what was asked.
//! A store that is full is dropped for an empty one. Absent here: rays.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders, Start};
use arc_swap::ArcSwapOption;
use fearless_simd::Level;
use rayon::prelude::*;

use super::bricks::{Decision, Store, cell_in_brick};
use super::budget::{Account, Budget, Looks};
use super::candidates::{Candidates, Casters};
use super::column_lookup::Way;
use super::columns::{Columns, Wanted};
use super::forms::{BOUND, START_ROOM};
use super::lattice::{Cell, Lattice};
use super::links::{Link, charge, claim, publish, read};
use super::packed::Packed;
use super::refine::{Care, Depth, Refiner};
use super::stream::{self, Misfit, Nothing, Section, Stored, Told};
use super::tables::{LightTables, SceneTables, Tables};
use super::value::Audience;
use super::volume::Cells;
use crate::Refine;
use crate::bvh::Bvh;
use crate::clock::Reading;
use crate::frame::Frame;

/// Values of a scene for its lights.
#[derive(Debug)]
pub(crate) struct AdaptiveValues {
    pub(super) frame: Frame,
    /// How far a start may lie from its point, in world units.
    pub(super) start_room: f64,
    /// For each [`Audience`].
    pub(super) lattices: [Lattice; 3],
    depth: Depth,
    tables: OnceLock<SceneTables>,
    pub(super) lights: Vec<LightValues>,
    store: ArcSwapOption<Store>,
    store_bytes: u64,
    refine: Refine,
    is_refining: AtomicBool,
    evictions: AtomicU64,
    pub(super) level: Level,
}

/// What one light has of its own.
#[derive(Debug)]
pub(super) struct LightValues {
    pub(super) light: LightShape,
    /// Whether values can be made.
    is_ordinary: bool,
    tables: OnceLock<LightTables>,
    /// All values, if they were made before.
    packed: OnceLock<Packed>,
    /// Lists for all directions from the light, if there can be any.
    columns: OnceLock<Option<Columns>>,
    /// Whether a thread makes tables.
    is_busy: AtomicBool,
    /// Whether values were taken in which nothing is pending.
    is_complete: AtomicBool,
    budget: Budget,
}

/// How values are made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Making {
    pub(crate) depth: Depth,
    /// When values are made.
    pub(crate) refine: Refine,
    /// Bytes of values and lists at most.
    pub(crate) most_bytes: u64,
}

/// A unit of cost in links, in nanoseconds, as a power of two.
const UNIT: u32 = 4;
/// What a first look at a cell at the root costs, as a power of two of units.
const LOOK_PRICE: u32 = 9;
/// Bricks so many halvings below the root are made quickly.
const QUICK_LEVELS: u32 = 2;
/// What a brick costs, quick and full: itself, and each candidate.
const QUICK_NS: [u64; 2] = [6_000, 300];
const FULL_NS: [u64; 2] = [20_000, 1_100];
/// A cell is worth so many times what it has cost: more queries will come, and the account of all
/// cells bounds what is spent in vain.
const HASTE: u64 = 4;
/// What tables cost: for each triangle that none is entered for, for each that is, and for each other surface.
const TABLE_NS: u64 = 15;
const WHOLE_NS: u64 = 700;
const CURVED_NS: u64 = 500;

fn cost([own, each]: [u64; 2], candidate_count: usize) -> u64 {
    own + each * candidate_count as u64
}

impl AdaptiveValues {
    /// Prepares values for all lights. Nothing is known yet.
    pub(crate) fn new(occluders: &Occluders, lights: &[LightShape], making: &Making) -> Self {
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let depth = making.depth;
        let lattices = Audience::ALL.map(|audience| {
            let finest = match audience {
                Audience::Front | Audience::Back => depth.surfaces,
                Audience::Free => depth.space,
            };
            Lattice::new(&bounds, &frame, finest)
        });
        let lights: Vec<_> = lights
            .iter()
            .map(|&light| {
                // Filters square directions.
                let light = light.without_underflow();
                LightValues::new(light, is_ordinary(occluders, &frame, &light))
            })
            .collect();
        let values = Self {
            frame,
            start_room: START_ROOM / frame.scale,
            lattices,
            depth,
            tables: OnceLock::new(),
            lights,
            store: ArcSwapOption::empty(),
            store_bytes: making.most_bytes,
            refine: making.refine,
            is_refining: AtomicBool::new(true),
            evictions: AtomicU64::new(0),
            level: Level::new(),
        };
        values.store.store(values.empty_store());
        values
    }

    /// Makes what is wanted before the first query, on all threads.
    pub(crate) fn make_first(&self, occluders: &Occluders, bvh: &Bvh) {
        match self.refine {
            Refine::Eager => self.make_all(occluders, bvh),
            Refine::Lazy => {}
            Refine::Asked => (0..self.lights.len()).for_each(|light| {
                if self.lights[light].is_ordinary {
                    self.make_tables(occluders, light);
                    self.make_columns(occluders, light, Wanted::Few);
                }
            }),
        }
    }

    pub(crate) fn set_refining(&self, is_refining: bool) {
        self.is_refining.store(is_refining, Ordering::Relaxed);
    }

    /// Returns whether queries may make values.
    #[inline(always)]
    pub(crate) fn is_refining(&self) -> bool {
        self.refine != Refine::Eager && self.is_refining.load(Ordering::Relaxed)
    }

    /// Returns whether nothing waits until it pays.
    pub(crate) fn is_asked(&self) -> bool {
        self.refine == Refine::Asked
    }

    /// Drops all that queries have made.
    pub(crate) fn forget(&mut self) {
        if self.refine == Refine::Eager {
            return;
        }
        self.tables = OnceLock::new();
        for light in &mut self.lights {
            *light = LightValues::new(light.light, light.is_ordinary);
        }
        self.store.store(self.empty_store());
        self.evictions = AtomicU64::new(0);
    }

    fn empty_store(&self) -> Option<Arc<Store>> {
        let price = self.look_price();
        Store::new(self.store_bytes, &self.lattices, self.lights.len(), price).map(Arc::new)
    }

    /// Returns the price of a first look at a cell at the root.
    fn look_price(&self) -> u32 {
        match self.refine {
            Refine::Asked => 0,
            Refine::Lazy | Refine::Eager => LOOK_PRICE,
        }
    }

    /// Returns the store for some queries.
    pub(crate) fn store(&self) -> Option<Arc<Store>> {
        self.store.load_full()
    }

    /// Returns what is known of the surfaces for a light, if there are tables yet.
    #[inline(always)]
    pub(super) fn tables<'a>(
        &'a self,
        occluders: &'a Occluders,
        light: usize,
    ) -> Option<Tables<'a>> {
        let scene = self.tables.get()?;
        let values = &self.lights[light];
        let of_light = values.tables.get()?;
        Some(Tables::new(
            occluders,
            &self.frame,
            &values.light,
            scene,
            of_light,
        ))
    }

    /// Returns lists for all directions from a light, if there are any and they are worth asking.
    #[inline(always)]
    pub(crate) fn columns(&self, light: usize, is_refining: bool) -> Option<&Columns> {
        let light = &self.lights[light];
        let columns = light.columns.get()?.as_ref()?;
        (!is_refining || self.refine == Refine::Asked || light.budget.are_columns_worth_it())
            .then_some(columns)
    }

    /// Returns how to ask the columns of a light.
    #[inline(always)]
    pub(crate) fn column_way(&self, light: usize) -> Way {
        self.lights[light].budget.column_way()
    }

    /// Returns which queries to look up: none as long as there are no tables, and while values are made those
    /// that pay.
    #[inline(always)]
    pub(crate) fn looks(&self, light: usize, is_refining: bool) -> Looks {
        let light = &self.lights[light];
        let has_columns = self.refine == Refine::Lazy && light.columns().is_some();
        if light.tables.get().is_none() {
            Looks::None
        } else if has_columns {
            match light.budget.looks_beside_columns() {
                Looks::Scouts | Looks::Try if !is_refining => Looks::All,
                looks => looks,
            }
        } else if !is_refining || self.refine == Refine::Asked {
            Looks::All
        } else {
            light.budget.looks()
        }
    }
}

/// Whether numbers stay so far from the ends of their range that products of lengths are safe, and
/// coordinates so small beside the scene that its frame can tell them.
fn is_ordinary(occluders: &Occluders, frame: &Frame, light: &LightShape) -> bool {
    const LARGEST: f64 = 1.4272476927059598e45; // 2^150
    let size = occluders.bounds().size().max_element();
    let reach = match *light {
        LightShape::Point(position) => position.abs().max_element(),
        LightShape::Direction(_) => 0.0,
    };
    occluders.surface_count() > 0
        && size > 1.0 / LARGEST
        && size.max(reach) < LARGEST
        && reach * frame.scale < 1e12
        && frame.margin_in_frame < START_ROOM / 64.0
}

impl LightValues {
    fn new(light: LightShape, is_ordinary: bool) -> Self {
        Self {
            light,
            is_ordinary,
            tables: OnceLock::new(),
            packed: OnceLock::new(),
            columns: OnceLock::new(),
            is_busy: AtomicBool::new(false),
            is_complete: AtomicBool::new(false),
            budget: Budget::default(),
        }
    }

    /// Returns lists for all directions from the light, if there are any.
    #[inline(always)]
    pub(super) fn columns(&self) -> Option<&Columns> {
        self.columns.get()?.as_ref()
    }

    fn is_complete(&self) -> bool {
        self.is_complete.load(Ordering::Relaxed)
    }
}

/// What is worked with while values are made.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
}

impl AdaptiveValues {
    /// Makes all values of all lights, as far as there is room.
    fn make_all(&self, occluders: &Occluders, bvh: &Bvh) {
        let Some(store) = self.store() else {
            return;
        };
        let scene = Scene { occluders, bvh };
        for light in 0..self.lights.len() {
            if !self.lights[light].is_ordinary {
                continue;
            }
            self.make_whole_tables(occluders, light);
            if self.lights[light].is_complete() {
                continue;
            }
            for audience in Audience::ALL {
                let lattice = &self.lattices[audience as usize];
                let finder = store.finder(light, audience, lattice);
                let cells: Vec<Cell> = lattice.root_bricks().collect();
                cells.into_par_iter().for_each(|cell| {
                    let place = finder.place_in_root(cell);
                    self.make_rest(&store, &scene, light, audience, cell, place);
                });
            }
        }
        self.pack(occluders, &store);
    }

    /// Packs the values of all lights for reading and drops the store, if all of it can be told so.
    fn pack(&self, occluders: &Occluders, store: &Store) {
        let packed: Option<Vec<_>> = (0..self.lights.len())
            .filter(|&light| self.lights[light].is_ordinary)
            .map(|light| {
                // Of a light that was kept there may be none yet.
                self.make_whole_tables(occluders, light);
                Some((light, Packed::new(store, light, &self.lattices)?))
            })
            .collect();
        for (light, packed) in packed.into_iter().flatten() {
            // What was kept is to be there at once.
            if !self.lights[light].is_complete() {
                self.make_columns(occluders, light, Wanted::For(u64::MAX));
            }
            self.lights[light].packed.get_or_init(|| packed);
            self.store.store(None);
        }
    }

    /// Returns all values of a light, if they were made before.
    #[inline]
    pub(crate) fn packed(&self, light: usize) -> Option<&Packed> {
        self.lights[light].packed.get()
    }

    /// Makes the values that are missing of a cell whose link this is, and of all finer ones.
    fn make_rest(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        audience: Audience,
        cell: Cell,
        place: u32,
    ) {
        let link = read(store.word(place));
        let is_pending = match link.list() {
            Some(list) => read(store.word(Store::list_counter(list))).is_pending(),
            None => link.is_pending(),
        };
        if is_pending {
            self.make_below(store, scene, light, audience, cell, place);
        } else if let Some(brick_at) = link.brick() {
            for (place, number) in store.unfinished(brick_at) {
                let finer = cell_in_brick(cell, number);
                self.make_rest(store, scene, light, audience, finer, place);
            }
        }
    }

    /// Makes the values of a cell whose link this is, and of all finer ones.
    fn make_below(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        audience: Audience,
        cell: Cell,
        place: u32,
    ) {
        let Some(made) = self.brick(store, scene, (light, audience, cell)) else {
            return;
        };
        store.publish(place, made);
        let Some(brick_at) = made.brick() else {
            return;
        };
        for (place, number) in store.unfinished(brick_at) {
            let finer = cell_in_brick(cell, number);
            self.make_below(store, scene, light, audience, finer, place);
        }
    }

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

    /// Writes what is known of a light, to be kept.
    pub(crate) fn section(&self, light: usize) -> Section {
        match (self.packed(light), self.store()) {
            (Some(packed), _) => stream::write(&self.told(packed)),
            (None, Some(store)) => stream::write(&self.stored(&store, light)),
            (None, None) => stream::write(&Nothing(&self.lattices)),
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
        words: &[u32],
    ) -> Result<(), Misfit> {
        let values = &self.lights[light];
        if !values.is_ordinary {
            // Nothing is ever known of it.
            return Ok(());
        }
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

    /// Makes tables of the scene and a light, in which triangles are entered when they are asked for.
    fn make_tables(&self, occluders: &Occluders, light: usize) {
        self.tables.get_or_init(|| SceneTables::new(occluders));
        let values = &self.lights[light];
        values
            .tables
            .get_or_init(|| LightTables::new(occluders, &self.frame, &values.light));
    }

    /// Makes tables of all triangles.
    fn make_whole_tables(&self, occluders: &Occluders, light: usize) {
        self.make_tables(occluders, light);
        let values = &self.lights[light];
        if let (Some(scene), Some(of_light)) = (self.tables.get(), values.tables.get()) {
            of_light.make_whole(scene, occluders, &self.frame, &values.light);
        }
    }

    /// Returns what refines the cells of an audience.
    fn refiner<'a>(&'a self, tables: Tables<'a>, audience: Audience, care: Care) -> Refiner<'a> {
        Refiner {
            casters: Casters::new(tables),
            lattice: &self.lattices[audience as usize],
            audience,
            depth: self.depth,
            care,
        }
    }

    /// Returns how much work goes into the cells below one.
    fn care(&self, level: u32, audience: Audience) -> Care {
        let is_coarse = level <= self.lattices[audience as usize].root_level + QUICK_LEVELS;
        if is_coarse && self.refine != Refine::Eager && self.depth.early_list > 0 {
            Care::Quick
        } else {
            Care::Full
        }
    }

    /// Takes a first look at a cell at the root.
    fn look(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        (light, audience, cell): (usize, Audience, Cell),
    ) -> Option<Link> {
        let tables = self.tables(scene.occluders, light)?;
        let refiner = self.refiner(tables, audience, Care::Quick);
        let bounds = self.lattices[audience as usize].inflated(cell);
        let gathered = refiner.casters.gather(scene.bvh, &bounds, false);
        let mut candidates = Candidates::NONE;
        refiner.casters.narrow(&gathered, &bounds, &mut candidates);
        let decision = refiner.decide_quickly(cell.level, &candidates);
        let price = match self.refine {
            Refine::Asked => 1,
            Refine::Lazy | Refine::Eager => {
                price_of(cost(QUICK_NS, candidates.triangles.len())).max(LOOK_PRICE + 1)
            }
        };
        store.write_one(&decision, price, |list| refiner.casters.side_by_side(list))
    }

    /// Makes a brick in place of a cell; `None` if there is no room.
    fn brick(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        (light, audience, cell): (usize, Audience, Cell),
    ) -> Option<Link> {
        let tables = self.tables(scene.occluders, light)?;
        let lattice = &self.lattices[audience as usize];
        let care = self.care(cell.level, audience);
        let refiner = self.refiner(tables, audience, care);
        let bounds = lattice.inflated(cell);
        let casters = &refiner.casters;
        let gathered = casters.gather(scene.bvh, &bounds, care == Care::Full);
        let mut candidates = Candidates::NONE;
        casters.narrow_holders(&gathered, &bounds, audience, &mut candidates);
        casters.narrow(&gathered, &bounds, &mut candidates);
        let decisions = refiner.decide_brick(cell, &candidates);
        let price = match self.refine {
            Refine::Asked => 0,
            Refine::Lazy | Refine::Eager => {
                let costs = match self.care(cell.level + 2, audience) {
                    Care::Quick => QUICK_NS,
                    Care::Full => FULL_NS,
                };
                price_below(&decisions, costs, candidates.count())
            }
        };
        store.write(&decisions, price, |list| {
            (care == Care::Quick)
                .then(|| casters.side_by_side(list))
                .flatten()
        })
    }

    /// Adds what some queries of a light came to, with so many more known to come; makes the light's tables
    /// and columns when they pay.
    pub(crate) fn note(&self, occluders: &Occluders, light: usize, account: &Account, ahead: u64) {
        let values = &self.lights[light];
        values.budget.note(account);
        if values.columns.get().is_some() || !values.is_ordinary || values.is_complete() {
            return;
        }
        let wanted = match self.refine {
            Refine::Asked => Wanted::Few,
            Refine::Lazy | Refine::Eager => Wanted::For(ahead),
        };
        let curved_count = occluders.surface_count() - occluders.triangle_count();
        let price = TABLE_NS * occluders.triangle_count() as u64
            + CURVED_NS * curved_count as u64
            + Columns::price(occluders, &self.frame, &values.light, wanted);
        let can_make = self.refine == Refine::Asked || values.budget.allows_columns(price, ahead);
        if can_make && !values.is_busy.swap(true, Ordering::Acquire) {
            let begin = Reading::now();
            self.make_tables(occluders, light);
            self.make_columns(occluders, light, wanted);
            values.budget.spend(begin.elapsed_ns());
            values.is_busy.store(false, Ordering::Release);
        }
    }

    /// Makes the lists of all directions from a light, where there is room.
    fn make_columns(&self, occluders: &Occluders, light: usize, wanted: Wanted) {
        let has_room = self.store_bytes >= Columns::predict_bytes(occluders);
        let may_list = self.depth.long_list > 0;
        self.lights[light].columns.get_or_init(|| {
            if !has_room || !may_list {
                return None;
            }
            let values = &self.lights[light];
            let of_light = values.tables.get()?;
            of_light.make_all(occluders, &self.frame, &values.light);
            let tables = self.tables(occluders, light)?;
            Columns::new(occluders, &tables, wanted)
        });
    }

    /// Returns what a query of the list at a cell costs more than a value.
    pub(crate) fn cost_of_list(&self, store: &Store, place: u32) -> u64 {
        const ENTRY_NS: u64 = 1;
        let list = read(store.word(place)).list();
        list.map_or(0, |list| {
            4 + ENTRY_NS * store.list(list).surfaces.len() as u64
        })
    }

    /// Returns what to charge a cell for where columns answer.
    pub(crate) fn cost_of_column(&self, light: usize) -> u64 {
        match self.refine {
            // So that what is made does not depend on times.
            Refine::Asked => 16,
            Refine::Lazy | Refine::Eager => self.lights[light].budget.column_charge(),
        }
    }

    /// Adds what a query has cost at the cell whose link or list stands there; makes finer cells when the price
    /// is paid. Returns what that took, in nanoseconds.
    pub(crate) fn charge(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        start: &Start,
        place: u32,
        cost_ns: u64,
    ) -> u64 {
        let counter = match read(store.word(place)).list() {
            Some(list) => Store::list_counter(list),
            None => place,
        };
        let units = (cost_ns >> UNIT).max(1) as u32;
        if !charge(store.word(counter), units) {
            return 0;
        }
        let price = read(store.word(counter)).price();
        let budget = &self.lights[light].budget;
        if self.refine != Refine::Asked && !budget.allows(HASTE << (price + UNIT)) {
            return 0;
        }
        let took = self.refine(store, scene, light, start, counter);
        budget.spend(took);
        took
    }

    /// Makes what pays where a counter has its price; returns what that took, in nanoseconds.
    #[cold]
    #[inline(never)]
    fn refine(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        start: &Start,
        counter: u32,
    ) -> u64 {
        let Some((audience, code)) = self.code_of_start(store, scene.occluders, light, start)
        else {
            return 0;
        };
        let Some(claimed) = claim(store.word(counter)) else {
            return 0;
        };
        let lattice = &self.lattices[audience as usize];
        let finder = store.finder(light, audience, lattice);
        let leaf = finder.find(code);
        let is_its = leaf.place == counter
            || leaf
                .link
                .list()
                .is_some_and(|list| Store::list_counter(list) == counter);
        if !is_its {
            // Another thread was faster, or the list is another cell's, too.
            publish(store.word(counter), Link::pending(claimed.price()));
            return 0;
        }
        let level = finder.level_of(code, lattice);
        let target = (light, audience, code.cell(level));
        let is_first_look = level <= lattice.root_level
            && counter == leaf.place
            && claimed.price() <= self.look_price()
            && self.depth.early_list > 0;
        let begin = Reading::now();
        let made = if is_first_look {
            self.look(store, scene, target)
        } else if self.care(level, audience) == Care::Quick
            || self.has_whole_tables(scene.occluders, light)
        {
            self.brick(store, scene, target)
        } else {
            publish(store.word(counter), Link::pending(claimed.price()));
            return 0;
        };
        let took = begin.elapsed_ns();
        // First the cell, then the list's counter: who claims that again must see what came of it.
        if let Some(made) = made {
            store.publish(leaf.place, made);
        }
        if counter != leaf.place || made.is_none() {
            publish(store.word(counter), Link::pending(claimed.price()));
        }
        if made.is_none() {
            self.evict(store);
        }
        took
    }

    /// Returns whether there are tables of all triangles; makes them when they pay.
    fn has_whole_tables(&self, occluders: &Occluders, light: usize) -> bool {
        let values = &self.lights[light];
        if values.tables.get().is_some_and(LightTables::is_whole) {
            return true;
        }
        let price = WHOLE_NS * occluders.triangle_count() as u64;
        let can_make = self.refine == Refine::Asked || values.budget.allows(price);
        if can_make && !values.is_busy.swap(true, Ordering::Acquire) {
            self.make_whole_tables(occluders, light);
            values.is_busy.store(false, Ordering::Release);
            return true;
        }
        false
    }

    /// Drops a store that is full for an empty one, unless that was done.
    fn evict(&self, full: &Store) {
        let current = self.store.load();
        if !current
            .as_ref()
            .is_some_and(|now| std::ptr::eq(&raw const **now, full))
        {
            return;
        }
        let before = self.store.compare_and_swap(&current, self.empty_store());
        if before
            .as_ref()
            .is_some_and(|before| std::ptr::eq(&raw const **before, full))
        {
            self.evictions.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Returns the price of a brick below one that was decided so, as a power of two of units: what it will
/// cost, and more where few cells were decided.
fn price_below(decisions: &[Decision; 64], costs: [u64; 2], candidate_count: usize) -> u32 {
    let (mut asked, mut decided) = (0_u64, 0_u64);
    for decision in decisions {
        asked += u64::from(*decision != Decision::Nobody);
        decided += u64::from(!matches!(
            decision,
            Decision::Nobody | Decision::Pending | Decision::Ray
        ));
    }
    let cost_ns = cost(costs, candidate_count / 4);
    let weighed = cost_ns * asked.max(1) / decided.max(1);
    price_of(weighed)
}

/// Returns what a cell must have cost before so much is spent on it, as a power of two of units.
fn price_of(ns: u64) -> u32 {
    ((ns / HASTE) >> UNIT).max(1).ilog2() + 1
}

impl AdaptiveValues {
    /// Returns the bytes of values and links.
    pub(crate) fn value_bytes(&self) -> u64 {
        self.store().map_or(0, |store| store.bytes().0) + self.sum(Packed::value_bytes)
    }

    /// Returns the bytes of lists.
    pub(crate) fn list_bytes(&self) -> u64 {
        self.store().map_or(0, |store| store.bytes().1) + self.sum(Packed::list_bytes)
    }

    fn sum(&self, bytes_of: impl Fn(&Packed) -> u64) -> u64 {
        let packed = self.lights.iter().filter_map(|light| light.packed.get());
        packed.map(bytes_of).sum()
    }

    /// Returns the bytes of lists and tables.
    pub(crate) fn table_bytes(&self) -> u64 {
        let of_lights = self.lights.iter().filter_map(|light| light.tables.get());
        let columns = self
            .lights
            .iter()
            .filter_map(|light| light.columns.get()?.as_ref());
        self.list_bytes()
            + columns.map(Columns::bytes).sum::<u64>()
            + of_lights.map(LightTables::bytes).sum::<u64>()
            + self.tables.get().map_or(0, SceneTables::bytes)
    }

    /// Returns how often a full store was dropped.
    pub(crate) fn evictions(&self) -> u64 {
        self.evictions.load(Ordering::Relaxed)
    }

    /// Returns the planes between the finest cells.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        self.lattices[Audience::Front as usize].planes()
    }
}
