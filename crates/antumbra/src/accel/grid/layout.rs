//! Where the voxels are.

use antumbra_geometry::{Bounds, DVec3};

/// Position, size and number of the voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// The box of all voxels: the scene's, inflated by the margin.
    pub(crate) bounds: Bounds,
    pub(crate) resolution: [u32; 3],
    /// Edge lengths of a voxel.
    pub(crate) voxel_size: DVec3,
    voxels_per_unit: DVec3,
    /// What voxels are inflated by for everything that must not miss: far more than the rounding of
    /// index computations, walks and starts, far less than a voxel.
    pub(crate) margin: f64,
}

/// A box of voxels, `from` inclusive, `to` exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) from: [u32; 3],
    pub(crate) to: [u32; 3],
}

/// The margin in shares of the scene's largest coordinate and size: 2^12 roundings.
const MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

/// Woo's rule: voxels along the longest axis for each cube root of the number of objects.
const VOXELS_PER_CUBE_ROOT: f64 = 3.0;

/// Few objects want voxels too, for their occlusion values: the paper's own grids for scenes of 12
/// to 92 objects have 20 to 50 along an axis (Paper 8.1, Table 1).
const FEWEST_VOXELS: f64 = 40.0;
const MOST_VOXELS: f64 = 512.0;

impl Layout {
    pub(crate) fn new(scene: Bounds, resolution: [u32; 3]) -> Self {
        let scene = if scene.is_empty() {
            Bounds {
                min: DVec3::ZERO,
                max: DVec3::ZERO,
            }
        } else {
            scene
        };
        let margin = Self::margin_of(&scene);
        let bounds = scene.inflated(DVec3::splat(2.0 * margin));
        let counts = DVec3::from_array(resolution.map(f64::from));
        let voxel_size = bounds.size() / counts;
        Self {
            bounds,
            resolution,
            voxel_size,
            voxels_per_unit: voxel_size.recip(),
            margin,
        }
    }

    /// Returns the margin for surfaces in a box.
    pub(crate) fn margin_of(scene: &Bounds) -> f64 {
        let scale = if scene.is_empty() {
            0.0
        } else {
            scene.largest_coordinate() + scene.size().max_element()
        };
        // A scene that is a point at the origin still needs a voxel.
        (MARGIN * scale).max(f64::MIN_POSITIVE * 1e30)
    }

    /// Returns the resolution by Woo's rule: voxels as near to cubes as can be, their number along
    /// the longest axis in proportion to the cube root of the number of objects.
    pub(crate) fn automatic_resolution(scene: Bounds, object_count: usize) -> [u32; 3] {
        if scene.is_empty() {
            return [1; 3];
        }
        let longest = (VOXELS_PER_CUBE_ROOT * (object_count as f64).cbrt())
            .ceil()
            .clamp(FEWEST_VOXELS, MOST_VOXELS);
        let size = scene.size();
        let shares = size / size.max_element();
        shares.to_array().map(|share| {
            if share.is_finite() {
                (share * longest).ceil().max(1.0) as u32
            } else {
                1
            }
        })
    }

    pub(crate) fn voxel_count(&self) -> usize {
        self.resolution.iter().map(|&n| n as usize).product()
    }

    pub(crate) fn whole(&self) -> Block {
        Block {
            from: [0; 3],
            to: self.resolution,
        }
    }

    /// Returns the number of a voxel in memory.
    pub(crate) fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.resolution;
        (z as usize * ny as usize + y as usize) * nx as usize + x as usize
    }

    /// Returns the voxel that holds a point, clamped into the grid.
    pub(crate) fn voxel_at(&self, point: DVec3) -> [u32; 3] {
        std::array::from_fn(|axis| self.voxel_along(axis, point[axis]))
    }

    /// Returns the number along an axis of the voxels that hold a coordinate, clamped into the grid.
    pub(crate) fn voxel_along(&self, axis: usize, coordinate: f64) -> u32 {
        let scaled = (coordinate - self.bounds.min[axis]) * self.voxels_per_unit[axis];
        // Casting clamps below zero and NaN to zero.
        (scaled as u32).min(self.resolution[axis] - 1)
    }

    /// Returns the voxel that holds a point, or `None` outside the grid.
    pub(crate) fn voxel_holding(&self, point: DVec3) -> Option<[u32; 3]> {
        self.bounds.contains(point).then(|| self.voxel_at(point))
    }

    /// Returns the lower plane of the voxels with number `i` along an axis.
    pub(crate) fn plane(&self, axis: usize, i: u32) -> f64 {
        self.bounds.min[axis] + self.voxel_size[axis] * f64::from(i)
    }

    /// Returns the box of a block of voxels, inflated by the margin.
    pub(crate) fn inflated(&self, block: &Block) -> Bounds {
        let corner = |at: [u32; 3]| {
            DVec3::new(
                self.plane(0, at[0]),
                self.plane(1, at[1]),
                self.plane(2, at[2]),
            )
        };
        Bounds {
            min: corner(block.from),
            max: corner(block.to),
        }
        .inflated(DVec3::splat(self.margin))
    }

    /// Returns the voxels that a box may meet once they are inflated.
    pub(crate) fn block_around(&self, bounds: &Bounds) -> Block {
        let reach = bounds.inflated(DVec3::splat(2.0 * self.margin));
        let (from, last) = (self.voxel_at(reach.min), self.voxel_at(reach.max));
        Block {
            from,
            to: last.map(|n| n + 1),
        }
    }
}

impl Block {
    pub(crate) fn voxel_count(&self) -> u64 {
        (0..3)
            .map(|axis| u64::from(self.to[axis] - self.from[axis]))
            .product()
    }

    /// Cuts the block in two along its longest side; `None` for a single voxel.
    pub(crate) fn halves(&self) -> Option<[Self; 2]> {
        let length = |axis: &usize| self.to[*axis] - self.from[*axis];
        let axis = (0..3).max_by_key(length)?;
        if length(&axis) < 2 {
            return None;
        }
        let middle = self.from[axis] + length(&axis) / 2;
        let (mut low, mut high) = (*self, *self);
        low.to[axis] = middle;
        high.from[axis] = middle;
        Some([low, high])
    }

    pub(crate) fn voxels(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let Self { from, to } = *self;
        (from[2]..to[2]).flat_map(move |z| {
            (from[1]..to[1]).flat_map(move |y| (from[0]..to[0]).map(move |x| [x, y, z]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_layout(n: u32) -> Layout {
        Layout::new(
            Bounds {
                min: DVec3::ZERO,
                max: DVec3::ONE,
            },
            [n; 3],
        )
    }

    #[test]
    fn every_point_lies_in_its_inflated_voxel() {
        let layout = unit_layout(7);
        for i in 0..=700u32 {
            let point = DVec3::new(f64::from(i) / 700.0, f64::from(i) / 7.0 % 1.0, 1.0);
            let from = layout.voxel_holding(point).expect("inside");
            let block = Block {
                from,
                to: from.map(|n| n + 1),
            };
            assert!(
                layout.inflated(&block).contains(point),
                "{point} in {from:?}"
            );
        }
    }

    #[test]
    fn woos_rule_makes_near_cubes() {
        let flat = Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(10.0, 5.0, 0.0),
        };
        assert_eq!(Layout::automatic_resolution(flat, 1_000_000), [300, 150, 1]);
        assert_eq!(Layout::automatic_resolution(Bounds::EMPTY, 0), [1, 1, 1]);
    }

    #[test]
    fn halves_partition_a_block() {
        let block = Block {
            from: [0, 0, 0],
            to: [3, 5, 2],
        };
        let [low, high] = block.halves().expect("several voxels");
        assert_eq!(low.voxel_count() + high.voxel_count(), block.voxel_count());
        assert!(
            Block {
                from: [1; 3],
                to: [2; 3]
            }
            .halves()
            .is_none()
        );
    }
}
