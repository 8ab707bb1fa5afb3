//! The values of all lights, made when they pay.
//!
//! In: the surfaces, the lights, the tree. Out: for a light that was asked often enough tables and a store, or a map,
//! which `lookup` reads. Invariants: what a store says is a function of the scene, the light and the cell; how much
//! it says depends on what was asked. All that lights know is taken from one room: where that is full, a store is
//! dropped for an empty one, a light that is not asked any more loses what it knows, or nothing more is made. A
//! light that was never asked takes what [`LightValues`] takes. Absent here: rays.

mod demand;
mod keeping;
mod kept;
mod lights;
mod making;
mod predict;
mod scene;

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders};
use arc_swap::ArcSwapOption;
use fearless_simd::Level;

use super::bricks::Store;
use super::budget::Budget;
use super::forms::START_ROOM;
use super::lattice::Lattice;
use super::map::{Map, Prices};
use super::packed::Packed;
use super::refine::Depth;
use super::room::{Room, Share};
use super::tables::{LightTables, SceneTables, Tables};
use super::value::ReceiverClass;
use crate::Refine;
use crate::accel::frame::Frame;

pub(crate) use self::kept::KeptValues;
pub(crate) use self::scene::Scene;

/// Values of a scene for its lights.
#[derive(Debug)]
pub(crate) struct AdaptiveValues {
    pub(super) frame: Frame,
    /// How far a start may lie from its point, in world units.
    pub(super) start_room: f64,
    /// For each [`ReceiverClass`].
    pub(super) lattices: [Lattice; 3],
    depth: Depth,
    room: Arc<Room>,
    tables: OnceLock<(SceneTables, Share)>,
    pub(super) lights: Vec<LightValues>,
    /// Lights that know something that may be dropped. Whoever adds or drops something holds it.
    holders: Mutex<Vec<usize>>,
    refine: Refine,
    knowledge: Knowledge,
    is_refining: AtomicBool,
    evictions: AtomicU64,
    /// The light that was asked last, and how often that changed.
    asked_last: AtomicUsize,
    turns: AtomicU32,
    pub(super) level: Level,
}

/// What one light has of its own.
#[derive(Debug)]
pub(super) struct LightValues {
    pub(super) light: LightShape,
    /// Whether values can be made.
    is_ordinary: bool,
    /// All values, if they were made before.
    packed: OnceLock<Box<PackedLight>>,
    /// What is known so far.
    known: ArcSwapOption<Known>,
    /// Whether a thread makes tables.
    is_busy: AtomicBool,
    /// Whether values were taken in which nothing is pending.
    is_complete: AtomicBool,
    /// Whether something was not made for want of room.
    is_refused: AtomicBool,
    /// The turn in which it was asked last, and the one in which it was before.
    turns: [AtomicU32; 2],
    budget: Budget,
    /// When a map pays.
    pub(super) prices: Prices,
}

/// What is known of a light while more is made.
#[derive(Debug)]
pub(crate) struct Known {
    pub(crate) lists: Arc<Lists>,
    /// `None` where it found no room.
    pub(crate) store: Option<Store>,
}

/// What is known of a light whose values are all made.
#[derive(Debug)]
pub(crate) struct PackedLight {
    pub(super) packed: Packed,
    pub(super) lists: Lists,
    /// Of the values.
    _share: Share,
}

/// What is made at once for a light.
#[derive(Debug)]
pub(crate) struct Lists {
    pub(super) tables: LightTables,
    /// The light's map; `None` where no view suits it or there was no room.
    map: OnceLock<Option<Map>>,
    /// Of the tables.
    share: Share,
}

impl Lists {
    /// Returns what all directions from the light know, if there is a map.
    #[inline(always)]
    pub(crate) fn map(&self) -> Option<&Map> {
        self.map.get()?.as_ref()
    }

    fn map_bytes(&self) -> u64 {
        self.map().map_or(0, Map::bytes)
    }
}

/// The kind of knowledge that lights keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Knowledge {
    /// Maps of their directions.
    Maps,
    /// Values of voxels.
    Values,
}

/// How values are made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Making {
    pub(crate) depth: Depth,
    /// When values are made.
    pub(crate) refine: Refine,
    pub(crate) knowledge: Knowledge,
    /// Bytes at most of lights, of all that they know, and of what is needed to make it.
    pub(crate) most_bytes: u64,
}

/// Bytes that a light takes before anything is known of it, here and in the index.
const LIGHT_BYTES: u64 = 400;

/// Rays that a cell is asked before a brick is made in its place, as a power of two: a brick takes 40 to 100 us, as long
/// as so many rays, so at worst twice as much is spent on a cell as by who knows what will be asked.
const ASKS: u32 = 8;

/// In place of a light.
const NO_LIGHT: usize = usize::MAX;

impl AdaptiveValues {
    /// Prepares values for all lights. Nothing is known yet.
    pub(crate) fn new(occluders: &Occluders, lights: &[LightShape], making: &Making) -> Self {
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let depth = making.depth;
        let lattices = lattices(&bounds, &frame, depth);
        let unasked = LIGHT_BYTES * lights.len() as u64;
        let mut values = Self {
            frame,
            start_room: START_ROOM / frame.scale,
            lattices,
            depth,
            room: Room::new(making.most_bytes.saturating_sub(unasked)),
            tables: OnceLock::new(),
            lights: Vec::with_capacity(lights.len()),
            holders: Mutex::new(Vec::new()),
            refine: making.refine,
            knowledge: making.knowledge,
            is_refining: AtomicBool::new(true),
            evictions: AtomicU64::new(0),
            asked_last: AtomicUsize::new(NO_LIGHT),
            turns: AtomicU32::new(0),
            level: Level::new(),
        };
        for light in lights {
            values.add_light(occluders, light);
        }
        values
    }

    /// Returns the room that all knowledge is taken from, the finest level of cells for surfaces, and when values are made.
    pub(crate) fn means(&self) -> (&Arc<Room>, u32, Refine) {
        (&self.room, self.depth.surfaces, self.refine)
    }

    pub(crate) fn set_refining(&self, is_refining: bool) {
        self.is_refining.store(is_refining, Ordering::Relaxed);
    }

    /// Returns whether queries may make values.
    #[inline(always)]
    pub(crate) fn is_refining(&self) -> bool {
        self.refine != Refine::Eager && self.is_refining.load(Ordering::Relaxed)
    }

    /// Returns whether lights know maps.
    #[inline(always)]
    pub(crate) fn has_maps(&self) -> bool {
        self.knowledge == Knowledge::Maps
    }

    /// Returns whether to ask the map of a light.
    pub(crate) fn is_map_worth_it(&self, light: usize, is_refining: bool) -> bool {
        !is_refining || self.refine != Refine::Lazy || self.lights[light].prices.is_map_worth_it()
    }

    /// Returns whether to ask the map of a light, if there is one, a single query for which a number was drawn.
    #[inline]
    pub(crate) fn is_map_worth_one(&self, light: usize, drawn: u64) -> bool {
        let is_lazy = self.refine == Refine::Lazy && self.is_refining();
        !is_lazy || self.lights[light].prices.is_map_worth_one(drawn)
    }

    /// Returns whether nothing waits until it pays.
    pub(crate) fn is_made_when_queried(&self) -> bool {
        self.refine == Refine::Queried
    }

    /// Drops all that queries have made.
    pub(crate) fn forget(&mut self) {
        if self.refine == Refine::Eager {
            return;
        }
        for light in &mut self.lights {
            *light = LightValues::new(light.light, light.is_ordinary);
        }
        self.tables = OnceLock::new();
        self.holders = Mutex::default();
        self.evictions = AtomicU64::new(0);
    }

    /// Returns how many rays a cell is asked before it is refined, as a power of two.
    fn price(&self) -> u32 {
        match self.refine {
            Refine::Queried => 0,
            Refine::Lazy | Refine::Eager => ASKS,
        }
    }

    /// Returns what is known of a light for some queries, if it is not packed.
    #[inline]
    pub(crate) fn known(&self, light: usize) -> Option<Arc<Known>> {
        self.lights[light].known.load_full()
    }

    /// Returns what is known of the surfaces for a light.
    #[inline(always)]
    pub(super) fn tables<'a>(
        &'a self,
        occluders: &'a Occluders,
        light: usize,
        lists: &'a Lists,
    ) -> Option<Tables<'a>> {
        let (scene, _) = self.tables.get()?;
        let light = &self.lights[light].light;
        Some(Tables::new(
            occluders,
            &self.frame,
            light,
            scene,
            &lists.tables,
        ))
    }

    /// Returns whether to look up the values of a light: while more are made, as long as that pays.
    #[inline(always)]
    pub(crate) fn is_looked_up(&self, light: usize, is_refining: bool) -> bool {
        let is_free = !is_refining || self.refine == Refine::Queried;
        is_free || self.lights[light].budget.sums(0).is_worth_looking()
    }
}

/// Returns the cells of each receiver class.
fn lattices(bounds: &Bounds, frame: &Frame, depth: Depth) -> [Lattice; 3] {
    ReceiverClass::ALL.map(|class| {
        let finest = match class {
            ReceiverClass::Front | ReceiverClass::Back => depth.surfaces,
            ReceiverClass::Free => depth.space,
        };
        Lattice::new(bounds, frame, finest)
    })
}

/// Whether numbers stay so far from the ends of their range that products of lengths are safe, and
/// coordinates so small beside the scene that its frame can tell them.
pub(super) fn is_ordinary(occluders: &Occluders, frame: &Frame, light: &LightShape) -> bool {
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
            packed: OnceLock::new(),
            known: ArcSwapOption::empty(),
            is_busy: AtomicBool::new(false),
            is_complete: AtomicBool::new(false),
            is_refused: AtomicBool::new(false),
            turns: [AtomicU32::new(0), AtomicU32::new(0)],
            budget: Budget::default(),
            prices: Prices::default(),
        }
    }

    fn is_complete(&self) -> bool {
        self.is_complete.load(Ordering::Relaxed)
    }
}

impl AdaptiveValues {
    /// Returns all values of a light, if they were made before.
    #[inline]
    pub(crate) fn packed(&self, light: usize) -> Option<&PackedLight> {
        self.lights[light].packed.get().map(|packed| &**packed)
    }

    /// Returns whether all values of all lights are there.
    pub(crate) fn is_all_packed(&self) -> bool {
        (0..self.lights.len()).all(|light| self.packed(light).is_some())
    }

    /// Returns the bytes of all that is known, and of what is needed to make more.
    pub(crate) fn bytes(&self) -> u64 {
        self.room.taken()
    }

    /// Returns the bytes of a light's values, links and lists.
    pub(crate) fn bytes_of(&self, light: usize) -> u64 {
        match (self.packed(light), self.known(light)) {
            (Some(light), _) => light.packed.bytes(),
            (None, Some(known)) => {
                let of_store = known.store.as_ref().map_or(0, |store| {
                    let (values, lists) = store.bytes();
                    values + lists
                });
                of_store + known.lists.map_bytes()
            }
            (None, None) => 0,
        }
    }

    /// Returns the bytes of values and links, and of maps.
    pub(crate) fn value_bytes(&self) -> u64 {
        let maps = (0..self.lights.len()).filter_map(|light| self.known(light));
        let of_maps = maps.map(|known| known.lists.map_bytes());
        self.sum(Packed::value_bytes, |store| store.bytes().0) + of_maps.sum::<u64>()
    }

    /// Returns the bytes of lists.
    fn list_bytes(&self) -> u64 {
        self.sum(Packed::list_bytes, |store| store.bytes().1)
    }

    fn sum(&self, of_packed: impl Fn(&Packed) -> u64, of_store: impl Fn(&Store) -> u64) -> u64 {
        let lights = 0..self.lights.len();
        lights
            .map(|light| match (self.packed(light), self.known(light)) {
                (Some(light), _) => of_packed(&light.packed),
                (None, Some(known)) => known.store.as_ref().map_or(0, &of_store),
                (None, None) => 0,
            })
            .sum()
    }

    /// Returns the bytes of lists and tables.
    pub(crate) fn table_bytes(&self) -> u64 {
        let lights = 0..self.lights.len();
        let of_lights = lights.map(|light| {
            let of_lists = |lists: &Lists| lists.share.bytes() + lists.tables.edge_bytes();
            match (self.packed(light), self.known(light)) {
                (Some(light), _) => of_lists(&light.lists),
                (None, Some(known)) => of_lists(&known.lists),
                (None, None) => 0,
            }
        });
        let of_scene = |(tables, share): &(SceneTables, Share)| share.bytes() + tables.mesh_bytes();
        self.list_bytes() + of_lights.sum::<u64>() + self.tables.get().map_or(0, of_scene)
    }

    /// Returns how often something that was known was dropped for want of room.
    pub(crate) fn evictions(&self) -> u64 {
        self.evictions.load(Ordering::Relaxed)
    }

    /// Returns of how many lights something was not made for want of room.
    pub(crate) fn refused_count(&self) -> usize {
        let is_refused = |light: &&LightValues| light.is_refused.load(Ordering::Relaxed);
        self.lights.iter().filter(is_refused).count()
    }

    /// Returns the planes between the finest cells.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        self.lattices[ReceiverClass::Front as usize].planes()
    }
}
