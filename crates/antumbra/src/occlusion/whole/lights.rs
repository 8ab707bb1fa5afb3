//! The lights with size that an index was asked about, and where starts look for what is known of them.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use antumbra_geometry::{AreaShape, LightShape, Mesh, Occluders, ReceiverPoint, SurfaceId};
use arc_swap::{ArcSwap, ArcSwapOption};
use fearless_simd::{Level, Simd, dispatch};

use super::super::adaptive::{AdaptiveValues, Scene, is_ordinary};
use super::super::lattice::Lattice;
use super::super::planes::{self, ReceiverPlane};
use super::super::room::{Room, Share};
use super::hull::LightHull;
use super::ledger::{Asked, Ledger};
use super::maker::Maker;
use super::making::sides;
use super::table::{Key, Table, Value};
use crate::Refine;
use crate::accel::bvh::Block;
use crate::accel::frame::Frame;
use crate::clock::Reading;

/// Halvings of the scene's longest side to the cells.
const WHOLE_LEVEL: u32 = 10;

/// Starts that are looked up together.
pub(crate) const WHOLE_BLOCK: usize = 32;

/// Lights that something is known of.
const MOST_LIGHTS: usize = 256;

/// Calls of fewer starts look at the ledger one time in so many.
const SMALL_CALL: usize = 64;
const LOOK: u32 = 32;

/// Which part of a light is asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WholeSide {
    /// What is strictly in front of the start's surface.
    Front,
    /// What is strictly behind it.
    Back,
    /// All of it.
    All,
}

/// What is known of a start.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Told<'a> {
    /// Nothing blocks any sample that is asked about. Whether these are surely all samples.
    Lit { are_all_asked: bool },
    /// All samples that are asked about are blocked.
    Dark,
    /// What may block: leaves of the tree.
    Listed(&'a [u32]),
    /// Nothing.
    Open,
    /// All of the light is on the other side: nothing is asked about.
    Behind,
}

/// What starts on triangles are told by, and how triangles hang together.
type Tables = (Vec<ReceiverPlane>, Mesh, Share);

/// Lights with size.
#[derive(Debug)]
pub(crate) struct WholeLights {
    frame: Frame,
    lattice: Lattice,
    level: u32,
    room: Arc<Room>,
    refine: Refine,
    /// Whether anything can be known at all.
    is_ordinary: bool,
    tables: OnceLock<Option<Tables>>,
    lights: ArcSwap<Vec<Arc<WholeLight>>>,
    adding: Mutex<()>,
    simd: Level,
}

/// One light with size.
#[derive(Debug)]
pub(crate) struct WholeLight {
    shape: AreaShape,
    hull: Option<LightHull>,
    /// Its corners, as walks take them.
    corners: Option<Box<Corners>>,
    /// Of each triangle the side that all of the light is on.
    sides: OnceLock<Option<(Vec<i8>, Share)>>,
    table: ArcSwapOption<Table>,
    ledger: Mutex<Ledger>,
    is_making: AtomicBool,
    calls: AtomicU32,
    _share: Option<Share>,
}

/// The corners of a light's hull.
#[derive(Debug)]
pub(crate) struct Corners {
    pub(crate) targets: Vec<LightShape>,
    pub(crate) block: Block,
    /// Largest distance of a sample from the hull, in the frame's units.
    pub(crate) slack_in_frame: f64,
    /// The same in the targets' units.
    pub(crate) slack: f64,
}

impl Corners {
    fn new(hull: &LightHull, frame: &Frame) -> Self {
        let targets = hull.targets(frame);
        let slack = match hull.is_afar {
            true => hull.slack,
            false => hull.slack / frame.scale,
        };
        Self {
            block: Block::about(&targets, slack),
            targets,
            slack_in_frame: hull.slack,
            slack,
        }
    }
}

/// A light as a call sees it.
#[derive(Debug)]
pub(crate) struct WholeView<'a> {
    all: &'a WholeLights,
    light: Arc<WholeLight>,
    table: Option<Arc<Table>>,
}

impl WholeLights {
    /// Prepares lights. Nothing is known yet.
    pub(crate) fn new(occluders: &Occluders, knowledge: &AdaptiveValues) -> Self {
        let (room, finest_level, refine) = knowledge.means();
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let level = WHOLE_LEVEL.min(finest_level);
        let afar = LightShape::Direction(antumbra_geometry::DVec3::Z);
        Self {
            lattice: Lattice::new(&bounds, &frame, level),
            level,
            room: Arc::clone(room),
            refine,
            is_ordinary: is_ordinary(occluders, &frame, &afar)
                && occluders.surface_count() < 1 << 30,
            frame,
            tables: OnceLock::new(),
            lights: ArcSwap::default(),
            adding: Mutex::default(),
            simd: Level::new(),
        }
    }

    /// Returns what is known of a light; `None` if nothing ever is.
    pub(crate) fn view(&self, shape: &AreaShape) -> Option<WholeView<'_>> {
        if !self.is_ordinary {
            return None;
        }
        let find = |lights: &[Arc<WholeLight>]| {
            let light = lights.iter().find(|light| is_same(&light.shape, shape))?;
            Some(Arc::clone(light))
        };
        let lights = self.lights.load();
        let light = find(&lights).or_else(|| {
            // Of very many lights most are not known, and nobody waits for that.
            if lights.len() >= MOST_LIGHTS {
                return None;
            }
            let _adding = self.adding.lock().unwrap_or_else(PoisonError::into_inner);
            let lights = self.lights.load_full();
            find(&lights).or_else(|| {
                (lights.len() < MOST_LIGHTS).then(|| {
                    let light = Arc::new(WholeLight::new(shape, self));
                    let mut more = lights.to_vec();
                    more.push(Arc::clone(&light));
                    self.lights.store(Arc::new(more));
                    light
                })
            })
        })?;
        light.hull.as_ref()?;
        Some(WholeView {
            all: self,
            table: light.table.load_full(),
            light,
        })
    }

    /// Returns the bytes of what is known of all lights.
    pub(crate) fn bytes(&self) -> u64 {
        let lights = self.lights.load();
        let tables = lights.iter().filter_map(|light| light.table.load_full());
        tables.map(|table| table.bytes()).sum()
    }

    /// Returns the lowest corner of the cells and their edge, for tests that aim at them.
    pub(crate) fn planes_between(&self) -> (antumbra_geometry::DVec3, f64) {
        let (min, edge) = self.lattice.corner_and_edge();
        (min, edge / f64::from(1_u32 << self.level))
    }

    fn make_tables(&self, occluders: &Occluders) -> Option<Tables> {
        let count = occluders.triangle_count();
        let planes = (count * size_of::<ReceiverPlane>()) as u64;
        let height = planes + Mesh::height_bytes_without_edges(count);
        let share = self.room.take(height)?;
        let mesh = Mesh::without_edges(occluders);
        // The side of the light is of no matter here.
        let plane = |triangle: usize| {
            ReceiverPlane::of_triangle(occluders, &self.frame, SurfaceId(triangle as u32), 1)
        };
        let made: Vec<ReceiverPlane> = (0..count).map(plane).collect();
        share.shrink_to(planes + mesh.memory_bytes());
        Some((made, mesh, share))
    }
}

impl WholeLight {
    fn new(shape: &AreaShape, all: &WholeLights) -> Self {
        let hull = LightHull::new(shape, &all.frame);
        let share = hull.as_ref().and_then(|hull| {
            all.room
                .take((size_of::<Self>() + size_of::<Corners>()) as u64 + hull.memory_bytes())
        });
        // Nothing is known where there is no room for that much.
        let hull = hull.filter(|_| share.is_some());
        let corners = hull.as_ref().map(|hull| Corners::new(hull, &all.frame));
        Self {
            shape: shape.clone(),
            corners: corners.map(Box::new),
            hull,
            sides: OnceLock::new(),
            table: ArcSwapOption::empty(),
            ledger: Mutex::default(),
            is_making: AtomicBool::new(false),
            calls: AtomicU32::new(0),
            _share: share,
        }
    }

    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl WholeView<'_> {
    /// Tells what is known of at most [`WHOLE_BLOCK`] starts, and notes what is not.
    #[inline]
    pub(crate) fn tell(
        &self,
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        side: WholeSide,
        asked: &mut Asked,
    ) -> [Told<'_>; WHOLE_BLOCK] {
        let tables = self.all.tables.get().and_then(Option::as_ref);
        let sides = self.light.sides.get().and_then(Option::as_ref);
        let (Some((planes, ..)), Some((sides, _))) = (tables, sides) else {
            starts.iter().for_each(|_| asked.nowhere());
            return [Told::Open; WHOLE_BLOCK];
        };
        dispatch!(self.all.simd, simd => {
            self.tell_with(simd, occluders, (planes, sides), starts, side, asked)
        })
    }

    #[inline(always)]
    fn tell_with<S: Simd>(
        &self,
        simd: S,
        occluders: &Occluders,
        (planes, sides): (&[ReceiverPlane], &[i8]),
        starts: &[ReceiverPoint],
        side: WholeSide,
        asked: &mut Asked,
    ) -> [Told<'_>; WHOLE_BLOCK] {
        const NOWHERE: &ReceiverPlane = &ReceiverPlane::NOWHERE;
        let frame = &self.all.frame;
        let mut coordinates = [[0.0_f32; WHOLE_BLOCK]; 3];
        let mut of_starts = [NOWHERE; WHOLE_BLOCK];
        // Points of space are where they are.
        let mut are_told = 0_u32;
        for (number, start) in starts.iter().enumerate().take(WHOLE_BLOCK) {
            let mut point = start.point;
            match start.surface {
                None => are_told |= 1 << number,
                Some(SurfaceId(surface)) => match planes.get(surface as usize) {
                    Some(plane) => of_starts[number] = plane,
                    None => {
                        if let Some(moved) = planes::start_on_curved(occluders, frame, start) {
                            point = moved;
                            are_told |= 1 << number;
                        }
                    }
                },
            }
            let x = frame.point_in_frame(point);
            coordinates[0][number] = x.x as f32;
            coordinates[1][number] = x.y as f32;
            coordinates[2][number] = x.z as f32;
        }
        let codes = self.all.lattice.codes(simd, &coordinates);
        are_told |= planes::are_starts(simd, &of_starts, &coordinates);
        let mut told = [Told::Open; WHOLE_BLOCK];
        let level = self.all.level;
        for (number, start) in starts.iter().enumerate().take(WHOLE_BLOCK) {
            let cell = codes.get(number).number(level);
            let of_surface = start
                .surface
                .map(|surface| sides.get(surface.0 as usize).copied());
            let is_behind = match (of_surface, side) {
                // All of the light is in front, behind, or on both sides.
                (Some(Some(1)), WholeSide::Back) | (Some(Some(-1)), WholeSide::Front) => {
                    told[number] = Told::Behind;
                    asked.find();
                    continue;
                }
                // What is known of other surfaces holds for all of the light.
                (None | Some(None), _) => false,
                (Some(Some(_)), WholeSide::Front) | (Some(Some(1)), _) => false,
                (Some(Some(_)), WholeSide::Back) | (Some(Some(-1)), _) => true,
                (Some(Some(_)), WholeSide::All) => {
                    asked.nowhere();
                    continue;
                }
            };
            if are_told >> number & 1 == 0 || cell >> (3 * level) != 0 {
                asked.nowhere();
                continue;
            }
            let key = Key::new(cell, start.surface, is_behind);
            let Some(known) = self.table.as_ref().and_then(|table| table.get(key)) else {
                asked.miss(key);
                continue;
            };
            asked.find();
            told[number] = match (known.value(), &self.table) {
                (Value::Lit, _) => Told::Lit {
                    are_all_asked: known.are_all_asked(),
                },
                (Value::Dark, _) => Told::Dark,
                (Value::Listed(first), Some(table)) => Told::Listed(table.list(first)),
                _ => Told::Open,
            };
        }
        told
    }

    /// Returns the corners of the light's hull.
    #[inline]
    pub(crate) fn corners(&self) -> Option<&Corners> {
        self.light.corners.as_deref()
    }

    /// Returns how many calls a call of so many starts stands for when it is noted; `None` where it need not be, nor timed:
    /// small calls are many, and reading the clock takes as long as some of them.
    pub(crate) fn weight_of(&self, start_count: usize) -> Option<u32> {
        if start_count >= SMALL_CALL {
            return Some(1);
        }
        let number = self.light.calls.fetch_add(1, Ordering::Relaxed);
        number.is_multiple_of(LOOK).then_some(LOOK)
    }

    /// Notes what some starts asked for and how long they took, and makes values where that pays. The call stands for
    /// `weight` calls ([`WholeView::weight_of`]).
    pub(crate) fn note(
        &self,
        scene: &Scene<'_>,
        asked: &Asked,
        (ns, weight): (u64, u32),
        is_refining: bool,
    ) {
        self.light.ledger().note(asked, ns, weight);
        if is_refining {
            self.make_what_pays(scene);
        }
    }

    /// Makes the values of all keys that were not known, whether they pay or not.
    pub(crate) fn make_for(&self, scene: &Scene<'_>, asked: &Asked) {
        let Some(_making) = self.begin_making() else {
            return;
        };
        if self.has_tables(scene.occluders) {
            self.make(scene, asked.keys().collect());
        }
    }

    /// Returns the same light as it is now.
    pub(crate) fn anew(self) -> Self {
        Self {
            table: self.light.table.load_full(),
            ..self
        }
    }

    /// Returns whether values are made for whatever is asked.
    pub(crate) fn is_eager(&self) -> bool {
        self.all.refine == Refine::Queried
    }

    fn make_what_pays(&self, scene: &Scene<'_>) {
        let Some(_making) = self.begin_making() else {
            return;
        };
        let triangle_count = scene.occluders.triangle_count();
        if self.light.sides.get().is_none() {
            if self.light.ledger().are_tables_worth_it(triangle_count) {
                let begin = Reading::now();
                self.has_tables(scene.occluders);
                self.light.ledger().pay(&[], begin.elapsed_ns());
            }
            return;
        }
        let keys = self.light.ledger().worth_it();
        self.make(scene, keys);
    }

    /// Makes the tables of the scene and of the light if they are missing, and returns whether they are there.
    fn has_tables(&self, occluders: &Occluders) -> bool {
        let all = self.all;
        let tables = all.tables.get_or_init(|| all.make_tables(occluders));
        let sides = self.light.sides.get_or_init(|| {
            let hull = self.light.hull.as_ref()?;
            let share = all.room.take(occluders.triangle_count() as u64)?;
            Some((sides(occluders, &all.frame, hull), share))
        });
        tables.is_some() && sides.is_some()
    }

    fn make(&self, scene: &Scene<'_>, mut keys: Vec<Key>) {
        let all = self.all;
        keys.sort_unstable();
        keys.dedup();
        let table = self.light.table.load_full();
        if let Some(table) = &table {
            keys.retain(|&key| table.get(key).is_none());
        }
        let tables = all.tables.get().and_then(Option::as_ref);
        let sides = self.light.sides.get().and_then(Option::as_ref);
        let (Some((_, mesh, _)), Some((sides, _)), Some(hull)) = (tables, sides, &self.light.hull)
        else {
            return;
        };
        if keys.is_empty() {
            return;
        }
        let maker = Maker {
            scene: *scene,
            frame: &all.frame,
            lattice: &all.lattice,
            level: all.level,
            hull,
            sides,
            mesh,
        };
        let (entries, making_ns) = maker.make(&keys);
        let begin = Reading::now();
        let held = all.room.hold(entries.bytes());
        let share = all.room.take(Table::bytes_for(table.as_deref(), &entries));
        if let (true, Some(share)) = (held.bytes() >= entries.bytes(), share) {
            let table = Table::new(table.as_deref(), &entries, share);
            self.light.table.store(Some(Arc::new(table)));
        }
        drop(held);
        let ns = making_ns + begin.elapsed_ns();
        self.light.ledger().pay(&keys, ns);
    }

    /// Returns the right to make values, unless another thread has it. Nobody waits for it.
    fn begin_making(&self) -> Option<Turn<'_>> {
        let is_free = !self.light.is_making.swap(true, Ordering::Acquire);
        is_free.then_some(Turn(&self.light.is_making))
    }
}

/// Returns whether two shapes are the same. Meshes and polygons are told by where they lie first: points are many.
fn is_same(a: &AreaShape, b: &AreaShape) -> bool {
    match (a, b) {
        (AreaShape::Mesh(a), AreaShape::Mesh(b)) => Arc::ptr_eq(a, b) || a == b,
        (AreaShape::Polygon(a), AreaShape::Polygon(b)) => Arc::ptr_eq(a, b) || a == b,
        _ => a == b,
    }
}

/// The right to make values, which goes back when it is dropped.
struct Turn<'a>(&'a AtomicBool);

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}
