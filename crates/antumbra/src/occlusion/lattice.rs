//! Where the voxels of a store of bricks are.

use antumbra_geometry::{Bounds, DVec3};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4};

use super::forms::START_ROOM;
use crate::frame::Frame;

/// Cells of an octree over the scene, and the bricks of 4^3 of them that hold their values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    min: DVec3,
    /// Edge of the octree's root cell in world units.
    edge: f64,
    /// Number of bricks of the coarsest level along each axis.
    pub(crate) root: [u32; 3],
    /// Octree level of the coarsest bricks: so many times the root cell is halved.
    pub(crate) root_level: u32,
    /// Levels of bricks.
    pub(crate) brick_levels: u32,
    finest_per_unit: f64,
    /// Number of finest cells along each axis; the fourth holds every fourth coordinate.
    finest: [f32; 4],
    /// The lowest corner in the frame's units.
    frame_min: [f32; 4],
    finest_per_frame: f32,
    /// What cells are inflated by, in world units.
    room: f64,
}

/// A cell of the octree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell {
    pub(crate) level: u32,
    /// Its number along each axis, in cells of its level.
    pub(crate) at: [u32; 3],
}

impl Cell {
    pub(crate) const ROOT: Self = Self {
        level: 0,
        at: [0; 3],
    };

    /// Returns the eight halves; bit `i` of the place picks the upper one along axis `i`.
    pub(crate) fn children(self) -> [Self; 8] {
        std::array::from_fn(|place| Self {
            level: self.level + 1,
            at: std::array::from_fn(|axis| 2 * self.at[axis] + (place as u32 >> axis & 1)),
        })
    }
}

/// A finest cell: its numbers along the axes in fields of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Finest(u64);

impl Finest {
    const FIELD: u32 = 20;

    /// Returns the cell's place in its brick of a level, given by a shift.
    #[inline(always)]
    pub(crate) fn place_in_brick(self, shift: u32) -> u32 {
        const EACH: u64 = 3 | 3 << Finest::FIELD | 3 << (2 * Finest::FIELD);
        // Brings x to bit 40, y to 42, z to 44; what else the product holds lies beside.
        const GATHER: u64 = 1 << 40 | 1 << 22 | 1 << 4;
        let fields = self.0 >> shift & EACH;
        (fields.wrapping_mul(GATHER) >> 40 & 63) as u32
    }
}

impl Lattice {
    /// Lays cells over the scene, the finest after `finest_level` halvings of its longest side, at
    /// least two.
    pub(crate) fn new(scene: &Bounds, frame: &Frame, finest_level: u32) -> Self {
        // The root table has at most 32^3 places, so that it stays in the caches.
        const MOST_ROOT_LEVELS: u32 = 5;
        let brick_levels = finest_level
            .saturating_sub(MOST_ROOT_LEVELS)
            .div_ceil(2)
            .max(1);
        let root_level = finest_level.saturating_sub(2 * brick_levels);
        let room = 2.0 * START_ROOM / frame.scale;
        let bounds = scene.inflated(DVec3::splat(room));
        let edge = bounds.size().max_element() * (1.0 + 8.0 * f64::EPSILON);
        let brick_edge = edge / f64::from(1u32 << root_level);
        let root = (bounds.size() / brick_edge)
            .to_array()
            .map(|count| (count.ceil() as u32).clamp(1, 1 << root_level));
        let frame_min = frame.point_in_frame(bounds.min);
        let finest_per_brick = f64::from(1u32 << (2 * brick_levels));
        Self {
            min: bounds.min,
            edge,
            root,
            root_level,
            brick_levels,
            finest_per_unit: finest_per_brick / brick_edge,
            finest: [0, 1, 2, 3].map(|axis| match root.get(axis) {
                Some(&count) => count as f32 * finest_per_brick as f32,
                None => 1.0,
            }),
            frame_min: [
                frame_min.x as f32,
                frame_min.y as f32,
                frame_min.z as f32,
                0.0,
            ],
            finest_per_frame: (finest_per_brick / brick_edge / frame.scale) as f32,
            room,
        }
    }

    /// Returns whether a cell holds a part of the scene's box.
    pub(crate) fn is_inside(&self, cell: Cell) -> bool {
        (0..3).all(|axis| {
            let level = cell.level.min(self.root_level);
            let brick = (cell.at[axis] >> (cell.level - level)) << (self.root_level - level);
            brick < self.root[axis]
        })
    }

    /// Returns whether bricks have cells of a level.
    pub(crate) fn is_level_of_cells(&self, level: u32) -> bool {
        level > self.root_level && (level - self.root_level).is_multiple_of(2)
    }

    /// Returns the box of a cell, inflated so that it holds every start whose given point lies in it.
    pub(crate) fn inflated(&self, cell: Cell) -> Bounds {
        let edge = self.edge / f64::from(1u32 << cell.level);
        let min = self.min + DVec3::from_array(cell.at.map(f64::from)) * edge;
        Bounds {
            min,
            max: min + edge,
        }
        .inflated(DVec3::splat(self.room))
    }

    /// Returns the finest cell that holds a point of the frame, or `None` outside. Up to rounding, which
    /// the inflation of cells covers many times.
    #[inline(always)]
    pub(crate) fn finest_at<S: Simd>(&self, simd: S, x: f32x4<S>) -> Option<Finest> {
        // Added to a number, this leaves the nearest whole one in the last bits.
        const WHOLE: f32 = 12_582_912.0; // 3 * 2^22
        let scaled = (x - f32x4::from_slice(simd, &self.frame_min)) * self.finest_per_frame;
        let finest = f32x4::from_slice(simd, &self.finest);
        let is_inside = scaled.simd_ge(0.0) & scaled.simd_lt(finest);
        let shifted = scaled - 0.5 + WHOLE;
        let whole = |axis: usize| u64::from(shifted[axis].to_bits() & 0x3f_ffff);
        is_inside
            .all_true()
            .then(|| Finest(whole(0) | whole(1) << Finest::FIELD | whole(2) << (2 * Finest::FIELD)))
    }

    /// Returns the place of the coarsest brick that holds a finest cell in the root table.
    #[inline(always)]
    pub(crate) fn root_brick(&self, Finest(finest): Finest) -> usize {
        let axis = |axis: u32| {
            let at = finest >> (axis * Finest::FIELD) & ((1 << Finest::FIELD) - 1);
            at as usize >> (2 * self.brick_levels)
        };
        (axis(2) * self.root[1] as usize + axis(1)) * self.root[0] as usize + axis(0)
    }

    /// Returns the shift that gives a cell's place in its coarsest brick.
    #[inline(always)]
    pub(crate) fn coarsest_shift(&self) -> u32 {
        2 * (self.brick_levels - 1)
    }

    /// Returns all coarsest bricks as cells, in the order of their numbers.
    pub(crate) fn root_bricks(&self) -> impl Iterator<Item = Cell> + use<> {
        let Self {
            root: [nx, ny, nz],
            root_level: level,
            ..
        } = *self;
        (0..nz).flat_map(move |z| {
            (0..ny).flat_map(move |y| {
                (0..nx).map(move |x| Cell {
                    level,
                    at: [x, y, z],
                })
            })
        })
    }

    /// Returns the box of all cells; no surface is outside.
    pub(crate) fn bounds(&self) -> Bounds {
        let [x, y, z, _] = self.finest.map(f64::from);
        Bounds {
            min: self.min,
            max: self.min + DVec3::new(x, y, z) / self.finest_per_unit,
        }
    }

    /// Returns what cells are inflated by, in world units.
    pub(crate) fn room(&self) -> f64 {
        self.room
    }

    /// Returns the planes between finest cells: the lowest corner, their edge, and their number along
    /// each axis.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        let [x, y, z, _] = self.finest.map(|count| count as u32);
        (self.min, 1.0 / self.finest_per_unit, [x, y, z])
    }
}
