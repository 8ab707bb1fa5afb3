//! The rows of all lights of an index, and where starts look for theirs.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use arc_swap::ArcSwapOption;
use fearless_simd::{Level, Simd, dispatch};

use super::super::adaptive::is_ordinary;
use super::super::lattice::Lattice;
use super::super::planes::{self, ReceiverPlane};
use super::super::room::{Room, Share};
use super::ledger::Ledger;
use super::table::{Key, Place, ROW_BLOCK, RowTable};
use crate::accel::frame::Frame;

/// Halvings of the scene's longest side to the cells of rows. From rooms with 100 lights: 7 leaves 3.7 % of the pairs of a
/// point and a light in front of it open, 8 leaves 1.9 %, and takes twice the rows.
const ROW_LEVEL: u32 = 8;

/// Rows of all lights of an index.
#[derive(Debug)]
pub(crate) struct LightRows {
    pub(super) frame: Frame,
    pub(super) lattice: Lattice,
    pub(super) level: u32,
    pub(super) room: Arc<Room>,
    /// Of each light, whether anything can be known of it.
    pub(super) are_ordinary: Vec<bool>,
    /// What tells of each triangle whether points are where starts on it are; `None` where there was no room.
    pub(super) planes: OnceLock<Option<(Vec<ReceiverPlane>, Share)>>,
    pub(super) table: ArcSwapOption<RowTable>,
    /// What was asked where there is no row, and whether one would pay.
    pub(super) ledger: Mutex<Ledger>,
    /// Whether a thread makes rows.
    pub(super) is_making: AtomicBool,
    pub(super) simd: Level,
}

impl LightRows {
    /// Prepares rows. Nothing is known yet.
    pub(crate) fn new(
        occluders: &Occluders,
        lights: &[LightShape],
        room: &Arc<Room>,
        finest_level: u32,
    ) -> Self {
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let level = ROW_LEVEL.min(finest_level);
        let are_ordinary = lights
            .iter()
            .map(|light| is_ordinary(occluders, &frame, light));
        Self {
            frame,
            lattice: Lattice::new(&bounds, &frame, level),
            level,
            room: Arc::clone(room),
            are_ordinary: are_ordinary.collect(),
            planes: OnceLock::new(),
            table: ArcSwapOption::empty(),
            ledger: Mutex::default(),
            is_making: AtomicBool::new(false),
            simd: Level::new(),
        }
    }

    /// Returns the rows that there are.
    pub(crate) fn table(&self) -> Option<Arc<RowTable>> {
        self.table.load_full()
    }

    /// Returns the bytes of all rows.
    pub(crate) fn bytes(&self) -> u64 {
        self.table().map_or(0, |table| table.bytes())
    }

    /// Tells where at most [`ROW_BLOCK`] starts look for what is known.
    #[inline]
    pub(crate) fn find(
        &self,
        occluders: &Occluders,
        table: Option<&RowTable>,
        starts: &[ReceiverPoint],
    ) -> [Place; ROW_BLOCK] {
        let made = self.planes.get_or_init(|| self.make_planes(occluders));
        let Some((planes, _)) = made else {
            return [Place::Nowhere; ROW_BLOCK];
        };
        dispatch!(self.simd, simd => self.find_with(simd, occluders, planes, table, starts))
    }

    #[inline(always)]
    fn find_with<S: Simd>(
        &self,
        simd: S,
        occluders: &Occluders,
        planes: &[ReceiverPlane],
        table: Option<&RowTable>,
        starts: &[ReceiverPoint],
    ) -> [Place; ROW_BLOCK] {
        const NOWHERE: &ReceiverPlane = &ReceiverPlane::NOWHERE;
        let mut coordinates = [[0.0_f32; ROW_BLOCK]; 3];
        let mut of_starts = [NOWHERE; ROW_BLOCK];
        // Points of space are where they are.
        let mut are_told = 0_u32;
        for (number, start) in starts.iter().enumerate().take(ROW_BLOCK) {
            let mut point = start.point;
            match start.surface {
                None => are_told |= 1 << number,
                Some(SurfaceId(surface)) => match planes.get(surface as usize) {
                    Some(plane) => of_starts[number] = plane,
                    None => {
                        if let Some(moved) = planes::start_on_curved(occluders, &self.frame, start)
                        {
                            point = moved;
                            are_told |= 1 << number;
                        }
                    }
                },
            }
            let x = self.frame.point_in_frame(point);
            coordinates[0][number] = x.x as f32;
            coordinates[1][number] = x.y as f32;
            coordinates[2][number] = x.z as f32;
        }
        let codes = self.lattice.codes(simd, &coordinates);
        are_told |= planes::are_starts(simd, &of_starts, &coordinates);
        let mut places = [Place::Nowhere; ROW_BLOCK];
        for (number, start) in starts.iter().enumerate().take(ROW_BLOCK) {
            let cell = codes.get(number).number(self.level);
            if are_told >> number & 1 == 0 || cell >> (3 * self.level) != 0 {
                continue;
            }
            let key = Key::new(cell, start.surface);
            places[number] = match table.and_then(|table| table.number_of(key)) {
                Some(row) => Place::Row(row),
                None => Place::Missing(key),
            };
        }
        places
    }

    fn make_planes(&self, occluders: &Occluders) -> Option<(Vec<ReceiverPlane>, Share)> {
        let count = occluders.triangle_count();
        let share = self
            .room
            .take((count * size_of::<ReceiverPlane>()) as u64)?;
        // The side of the light is of no matter here.
        let plane = |triangle: usize| {
            ReceiverPlane::of_triangle(occluders, &self.frame, SurfaceId(triangle as u32), 1)
        };
        Some(((0..count).map(plane).collect(), share))
    }

    pub(super) fn ledger(&self) -> std::sync::MutexGuard<'_, Ledger> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the lowest corner of the cells of rows and their edge, for tests that aim at them.
    pub(crate) fn planes_between(&self) -> (DVec3, f64) {
        let (min, edge) = self.lattice.corner_and_edge();
        (min, edge / f64::from(1_u32 << self.level))
    }
}
