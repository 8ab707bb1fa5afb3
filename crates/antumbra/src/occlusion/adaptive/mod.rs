//! The values of all lights, made when they pay.
//!
//! In: the surfaces, the lights, the tree. Out: a store and tables, which `lookup` reads. Invariants: what a store
//! says is a function of the scene, the light and the cell; how much it says depends on what was asked.
//! A store that is full is dropped for an empty one. Absent here: rays.

mod demand;
mod keeping;
mod making;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use antumbra_geometry::{DVec3, LightShape, Occluders};
use arc_swap::ArcSwapOption;
use fearless_simd::Level;

use super::bricks::Store;
use super::budget::{Budget, Looks};
use super::column_lookup::Way;
use super::columns::{Columns, Wanted};
use super::forms::START_ROOM;
use super::lattice::Lattice;
use super::packed::Packed;
use super::refine::Depth;
use super::tables::{LightTables, SceneTables, Tables};
use super::value::Audience;
use crate::Refine;
use crate::bvh::Bvh;
use crate::frame::Frame;

pub(crate) use self::keeping::KeptValues;
use self::making::LOOK_PRICE;
pub(crate) use self::making::Scene;

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
                Looks::Scouts | Looks::Try(_) if !is_refining => Looks::All,
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

impl AdaptiveValues {
    /// Returns all values of a light, if they were made before.
    #[inline]
    pub(crate) fn packed(&self, light: usize) -> Option<&Packed> {
        self.lights[light].packed.get()
    }

    /// Returns whether all values of all lights are there.
    pub(crate) fn is_all_packed(&self) -> bool {
        (0..self.lights.len()).all(|light| self.packed(light).is_some())
    }

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
