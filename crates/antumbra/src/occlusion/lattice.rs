//! Where the voxels of a store of bricks are.

use antumbra_geometry::{Bounds, DVec3};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, u32x8};

use super::forms::START_ROOM;
use crate::accel::frame::Frame;

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
    finest_per_unit: f64,
    /// Number of finest cells along each axis.
    finest: [u32; 3],
    /// The lowest corner in the frame's units.
    frame_min: [f32; 3],
    /// Cells that a code tells apart, in one of the frame's units.
    codes_per_frame: f32,
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
    #[cfg(test)]
    pub(crate) const ROOT: Self = Self {
        level: 0,
        at: [0; 3],
    };

    /// Returns the cell of a level that has a number ([`Code::number`]).
    pub(crate) fn of_number(number: u64, level: u32) -> Self {
        let along = |axis: u32| {
            (0..level).fold(0, |at, bit| {
                at | ((number >> (3 * bit + axis) & 1) as u32) << bit
            })
        };
        Self {
            level,
            at: [0, 1, 2].map(along),
        }
    }

    /// Returns the eight halves; bit `i` of the place picks the upper one along axis `i`.
    pub(crate) fn children(self) -> [Self; 8] {
        std::array::from_fn(|place| Self {
            level: self.level + 1,
            at: std::array::from_fn(|axis| 2 * self.at[axis] + (place as u32 >> axis & 1)),
        })
    }
}

/// Where a point lies among the cells of all levels: the numbers of its cell along the axes after
/// [`CODE_LEVELS`] halvings, bit by bit in turn, x lowest (Morton 1966). Six bits say which of the 4^3
/// cells of a brick it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Code(u64);

/// Halvings that a [`Code`] tells.
const CODE_LEVELS: u32 = 16;

/// Codes of several points, in halves of 24 bits; the upper half of points outside all cells is larger.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Codes<const N: usize> {
    high: [u32; N],
    low: [u32; N],
}

impl<const N: usize> Codes<N> {
    #[inline(always)]
    pub(crate) fn get(&self, number: usize) -> Code {
        Code(u64::from(self.high[number]) << 24 | u64::from(self.low[number]))
    }

    /// Returns the upper halves, which say where the coarsest bricks are and which of their cells.
    #[inline(always)]
    pub(crate) fn high(&self) -> &[u32; N] {
        &self.high
    }
}

impl Code {
    /// Returns the place of the coarsest brick in the root table; none for points outside.
    #[inline(always)]
    pub(crate) fn place_in_root(self, shift: u32) -> usize {
        (self.0 >> shift) as usize
    }

    /// Returns the first bits; for points outside any.
    #[inline(always)]
    pub(crate) fn key(self, bits: u32) -> u16 {
        (self.0 >> (3 * CODE_LEVELS - bits) & ((1 << bits) - 1)) as u16
    }

    /// Returns the place in a brick that is known by a shift.
    #[inline(always)]
    pub(crate) fn place_in_brick(self, shift: u32) -> u32 {
        (self.0 >> shift & 63) as u32
    }

    /// Returns the number of the cell of a level that holds the point, in Morton order; `8^level` and more for points
    /// outside.
    #[inline(always)]
    pub(crate) fn number(self, level: u32) -> u64 {
        self.0 >> (3 * (CODE_LEVELS - level))
    }

    /// Returns the cell of a level that holds the point.
    pub(crate) fn cell(self, level: u32) -> Cell {
        let number = |axis: u32| {
            (0..CODE_LEVELS).fold(0, |number, bit| {
                number | ((self.0 >> (3 * bit + axis) & 1) as u32) << bit
            })
        };
        Cell {
            level,
            at: [0, 1, 2].map(|axis| number(axis) >> (CODE_LEVELS - level)),
        }
    }

    /// Returns the cell's place among its siblings of a brick or a table, from its numbers.
    pub(crate) fn place_of(at: [u32; 3]) -> usize {
        (0..3).fold(0, |place, axis| place | spread_bits(at[axis]) << axis)
    }
}

/// Moves bit `i` of a small number to bit `3 i`.
fn spread_bits(number: u32) -> usize {
    (0..10).fold(0, |spread, bit| {
        spread | ((number as usize >> bit & 1) << (3 * bit))
    })
}

/// The bits of eight numbers below 256 moved apart, bit `i` to bit `3 i`.
#[inline(always)]
fn spread_wide<S: Simd>(x: u32x8<S>) -> u32x8<S> {
    let x = (x | x << 8) & 0x00_f00f;
    let x = (x | x << 4) & 0x0c_30c3;
    (x | x << 2) & 0x24_9249
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
        let finest_per_brick = 1u32 << (2 * brick_levels);
        Self {
            min: bounds.min,
            edge,
            root,
            root_level,
            finest_per_unit: f64::from(finest_per_brick) / brick_edge,
            finest: root.map(|count| count * finest_per_brick),
            frame_min: frame_min.to_array().map(|x| x as f32),
            codes_per_frame: (f64::from(1u32 << CODE_LEVELS) / edge / frame.scale) as f32,
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

    /// Returns the lowest corner of the octree's root cell and its edge, in world units.
    pub(crate) fn corner_and_edge(&self) -> (DVec3, f64) {
        (self.min, self.edge)
    }

    /// Returns how many bricks may lie one in the other so that codes tell the cells of one more. Bricks for
    /// lack of time to look closer may be finer than the finest that are wanted.
    pub(crate) fn most_bricks(&self) -> u32 {
        (CODE_LEVELS - 2 - self.root_level) / 2
    }

    /// Returns everything that says where cells are, bit by bit.
    pub(crate) fn identity(&self) -> [u64; 17] {
        let &Self {
            min,
            edge,
            root,
            root_level,
            finest_per_unit,
            finest,
            frame_min,
            codes_per_frame,
            room,
        } = self;
        let [x, y, z] = min.to_array().map(f64::to_bits);
        let narrow = |x: f32| u64::from(x.to_bits());
        let [frame_x, frame_y, frame_z] = frame_min.map(narrow);
        let [root_x, root_y, root_z] = root.map(u64::from);
        let [finest_x, finest_y, finest_z] = finest.map(u64::from);
        let reals = [edge, finest_per_unit, room].map(f64::to_bits);
        [
            x,
            y,
            z,
            reals[0],
            reals[1],
            reals[2],
            root_x,
            root_y,
            root_z,
            root_level.into(),
            finest_x,
            finest_y,
            finest_z,
            frame_x,
            frame_y,
            frame_z,
            narrow(codes_per_frame),
        ]
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

    /// Tells where points of the frame lie, given coordinate by coordinate. Up to rounding, which the
    /// inflation of cells covers many times.
    #[inline(always)]
    pub(crate) fn codes<S: Simd, const N: usize>(
        &self,
        simd: S,
        [x, y, z]: &[[f32; N]; 3],
    ) -> Codes<N> {
        // Added to a number, this leaves the nearest whole one in the last bits.
        const WHOLE: f32 = 12_582_912.0; // 3 * 2^22
        const COUNT: f32 = (1 << CODE_LEVELS) as f32;
        let mut codes = Codes {
            high: [0; N],
            low: [0; N],
        };
        for first in (0..N).step_by(8) {
            let mut is_inside = mask32x8::splat(simd, true);
            let mut high = u32x8::splat(simd, 0);
            let mut low = high;
            for (axis, coordinates) in [x, y, z].into_iter().enumerate() {
                let x = f32x8::from_slice(simd, &coordinates[first..first + 8]);
                let scaled = (x - self.frame_min[axis]) * self.codes_per_frame;
                is_inside &= scaled.simd_ge(0.0) & scaled.simd_lt(COUNT);
                let whole: u32x8<S> = (scaled - 0.5 + WHOLE).to_bits();
                high |= spread_wide(whole >> 8 & 0xff) << axis as u32;
                low |= spread_wide(whole & 0xff) << axis as u32;
            }
            let high = is_inside.select(high, u32x8::splat(simd, u32::MAX));
            codes.high[first..first + 8].copy_from_slice(high.as_slice());
            codes.low[first..first + 8].copy_from_slice(low.as_slice());
        }
        codes
    }

    /// Returns where one point lies. Inlined, because only then do its vectors stay in registers.
    #[inline(always)]
    pub(crate) fn code_of<S: Simd>(&self, simd: S, [x, y, z]: [f32; 3]) -> Code {
        self.codes(simd, &[[x; 8], [y; 8], [z; 8]]).get(0)
    }

    /// Returns the shift that gives a brick's place in the root table.
    #[inline(always)]
    pub(crate) fn root_shift(&self) -> u32 {
        3 * (CODE_LEVELS - self.root_level)
    }

    /// Returns how many places the root table has: up to the last of a brick that holds a part of the scene's box.
    pub(crate) fn root_places(&self) -> usize {
        Code::place_of(self.root.map(|count| count - 1)) + 1
    }

    /// Returns the shift that gives a cell's place in its coarsest brick.
    #[inline(always)]
    pub(crate) fn coarsest_shift(&self) -> u32 {
        3 * (CODE_LEVELS - self.root_level - 2)
    }

    /// Returns all coarsest bricks that hold a part of the scene's box.
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
        let size = DVec3::from_array(self.finest.map(f64::from)) / self.finest_per_unit;
        Bounds {
            min: self.min,
            max: self.min + size,
        }
    }

    /// Returns what cells are inflated by, in world units.
    pub(crate) fn room(&self) -> f64 {
        self.room
    }

    /// Returns the planes between finest cells: the lowest corner, their edge, and their number along
    /// each axis.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        (self.min, 1.0 / self.finest_per_unit, self.finest)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::super::testing::Random;
    use super::*;

    fn cell_of(code: Code, level: u32) -> Cell {
        code.cell(level)
    }

    fn narrow(frame: &Frame, point: DVec3) -> [f32; 3] {
        frame.point_in_frame(point).to_array().map(|x| x as f32)
    }

    fn code_at(lattice: &Lattice, x: [f32; 3]) -> Code {
        dispatch!(Level::new(), simd => lattice.code_of(simd, x))
    }

    #[test]
    fn codes_name_cells_that_hold_the_start() {
        let random = &mut Random(1);
        for _ in 0..300 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let finest = 2 + random.below(11) as u32;
            let lattice = Lattice::new(&scene, &frame, finest);
            for _ in 0..100 {
                let mut point = random.in_box(&scene);
                if random.below(2) == 0 {
                    // On a plane between cells, or next to one.
                    let axis = random.below(3);
                    let edge = lattice.edge / f64::from(1 << finest);
                    let plane = ((point[axis] - lattice.min[axis]) / edge).round();
                    let off = random.real(-1.0, 1.0) * random.pick(&[0.0, 1e-7, 1e-6]);
                    point[axis] = lattice.min[axis] + plane * edge + off / frame.scale;
                }
                if !scene.contains(point) {
                    continue;
                }
                let code = code_at(&lattice, narrow(&frame, point));
                let start = point + START_ROOM / frame.scale * random.of_cube();
                for level in 0..=CODE_LEVELS {
                    let cell = cell_of(code, level);
                    assert_eq!(cell, Cell::of_number(code.number(level), level));
                    let bounds = lattice.inflated(cell);
                    assert!(
                        bounds.contains(start),
                        "{scene:?} {finest}: {point:?} {start:?} {cell:?}"
                    );
                    assert!(lattice.is_inside(cell), "{scene:?} {point:?} {cell:?}");
                }
                // Its brick, and its places from brick to brick.
                let brick = cell_of(code, lattice.root_level);
                let place = code.place_in_root(lattice.root_shift());
                assert_eq!(place, Code::place_of(brick.at));
                assert!(place < lattice.root_places());
                assert!((0..3).all(|axis| brick.at[axis] < lattice.root[axis]));
                let (mut shift, mut level) = (lattice.coarsest_shift(), lattice.root_level + 2);
                loop {
                    assert!(lattice.is_level_of_cells(level));
                    let at = cell_of(code, level).at.map(|number| number & 3);
                    assert_eq!(code.place_in_brick(shift) as usize, Code::place_of(at));
                    if level >= finest {
                        break;
                    }
                    level += 2;
                    shift -= 6;
                }
                // Refinement stops at cells of the store's own.
                assert_eq!(level, finest.max(2));
            }
        }
    }

    #[test]
    fn codes_do_not_depend_on_how_fine_cells_are_or_on_their_company() {
        let random = &mut Random(2);
        for _ in 0..200 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let lattices = [2, 8, 12].map(|finest| Lattice::new(&scene, &frame, finest));
            let points: [DVec3; 32] = std::array::from_fn(|_| random.in_box(&scene));
            let places: [[f32; 32]; 3] = std::array::from_fn(|axis| {
                std::array::from_fn(|number| narrow(&frame, points[number])[axis])
            });
            let together = dispatch!(Level::new(), simd => lattices[0].codes(simd, &places));
            for (number, &point) in points.iter().enumerate() {
                for lattice in &lattices {
                    let alone = code_at(lattice, narrow(&frame, point));
                    assert_eq!(together.get(number), alone, "{scene:?} {point:?}");
                }
            }
        }
    }

    #[test]
    fn points_outside_have_no_place() {
        let random = &mut Random(3);
        for _ in 0..300 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let lattice = Lattice::new(&scene, &frame, 2 + random.below(11) as u32);
            let is_outside = |x| {
                code_at(&lattice, x).place_in_root(lattice.root_shift()) >= lattice.root_places()
            };
            let inside = narrow(&frame, random.in_box(&scene));
            assert!(!is_outside(inside));
            for axis in 0..3 {
                let edge = 1e-6 + lattice.edge * frame.scale;
                let low = f64::from(lattice.frame_min[axis]);
                for beyond in [
                    (low - 1e-6) as f32,
                    (low + edge) as f32,
                    -1e30,
                    1e30,
                    f32::NAN,
                    f32::INFINITY,
                    f32::NEG_INFINITY,
                ] {
                    let mut x = inside;
                    x[axis] = beyond;
                    assert!(is_outside(x), "{scene:?} {x:?}");
                }
            }
        }
    }

    #[test]
    fn coarsest_bricks_are_the_cells_that_are_inside() {
        let random = &mut Random(4);
        for _ in 0..50 {
            let scene = random.scene();
            let lattice = Lattice::new(&scene, &Frame::new(scene), 2 + random.below(6) as u32);
            let bricks: Vec<Cell> = lattice.root_bricks().collect();
            let count = 1 << lattice.root_level;
            for place in 0..count * count * count {
                let at = [place % count, place / count % count, place / count / count];
                let cell = Cell {
                    level: lattice.root_level,
                    at,
                };
                assert_eq!(lattice.is_inside(cell), bricks.contains(&cell));
                // A coarser cell is inside if one of its halves is.
                for child in cell.children() {
                    assert_eq!(lattice.is_inside(child), lattice.is_inside(cell));
                }
            }
        }
    }
}
