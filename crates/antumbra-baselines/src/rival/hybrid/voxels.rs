//! Voxels of polygons, and the walk through them.
//!
//! In: a box, the grid's resolution. Out: for each voxel the polygons that it may meet; the voxels between two
//! points. Invariant: voxels are inflated by a margin of 2^-43 of the scene's size for whatever is listed or
//! marked; the walk's own rounding is some 2^-50 of it. So where a way crosses a polygon, the polygon is listed
//! in a voxel that the walk visits.

use antumbra_geometry::{Bounds, DVec3, LightShape, Relation, Shaft, Umbra};

use crate::rival::forms::{Frame, Polygon};

const MARGIN: f64 = 1.0 / (1u64 << 43) as f64;

/// Where the voxels are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Voxels {
    bounds: Bounds,
    /// What the polygons' forms are relative to.
    middle: DVec3,
    resolution: [u32; 3],
    size: DVec3,
    margin: f64,
}

/// A box of voxels, `from` inclusive, `to` exclusive.
#[derive(Clone, Copy, Debug)]
struct Block {
    from: [u32; 3],
    to: [u32; 3],
}

impl Block {
    /// Cuts in two along the longest side; `None` for a single voxel.
    fn halves(&self) -> Option<[Self; 2]> {
        let length = |axis: &usize| self.to[*axis] - self.from[*axis];
        let axis = (0..3).max_by_key(length).filter(|axis| length(axis) > 1)?;
        let middle = self.from[axis] + length(&axis) / 2;
        let (mut low, mut high) = (*self, *self);
        low.to[axis] = middle;
        high.from[axis] = middle;
        Some([low, high])
    }
}

impl Voxels {
    pub(super) fn new(frame: &Frame, resolution: [u32; 3]) -> Self {
        let bounds = *frame.bounds();
        let scale = bounds.largest_coordinate() + bounds.size().max_element();
        Self {
            bounds,
            middle: frame.seen(DVec3::ZERO),
            resolution,
            size: bounds.size() / DVec3::from_array(resolution.map(f64::from)),
            margin: MARGIN * scale,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.resolution.iter().map(|&n| n as usize).product()
    }

    fn whole(&self) -> Block {
        Block {
            from: [0; 3],
            to: self.resolution,
        }
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.resolution;
        (z as usize * ny as usize + y as usize) * nx as usize + x as usize
    }

    fn voxel_at(&self, point: DVec3) -> [u32; 3] {
        let at = (point - self.bounds.min) / self.size;
        // Casting clamps below zero and what is not a number to zero.
        std::array::from_fn(|axis| (at[axis] as u32).min(self.resolution[axis] - 1))
    }

    /// Returns the voxel that holds a point of the box.
    pub(super) fn holding(&self, point: DVec3) -> usize {
        self.index(self.voxel_at(point))
    }

    fn plane(&self, axis: usize, number: u32) -> f64 {
        self.bounds.min[axis] + self.size[axis] * f64::from(number)
    }

    fn inflated(&self, block: &Block) -> Bounds {
        let corner =
            |at: [u32; 3]| DVec3::from_array([0, 1, 2].map(|axis| self.plane(axis, at[axis])));
        Bounds {
            min: corner(block.from),
            max: corner(block.to),
        }
        .inflated(DVec3::splat(self.margin))
    }

    /// Sets the bits of all voxels that an umbra may darken.
    pub(super) fn mark_umbra(&self, umbra: &Umbra, light: &LightShape, bits: &mut [u64]) {
        let mut blocks = vec![self.whole()];
        while let Some(block) = blocks.pop() {
            let shaft = Shaft::new(self.inflated(&block), *light);
            if umbra.relation(&shaft) == Relation::Misses {
                continue;
            }
            match block.halves() {
                Some(halves) => blocks.extend(halves),
                None => {
                    let voxel = self.index(block.from);
                    bits[voxel / 64] |= 1 << (voxel % 64);
                }
            }
        }
    }

    /// Calls `found` for each voxel that a polygon may meet.
    fn voxels_of(&self, polygon: &Polygon, found: &mut impl FnMut(usize)) {
        let mut blocks = vec![self.whole()];
        while let Some(block) = blocks.pop() {
            let bounds = self.inflated(&block);
            // Relative to where forms are relative to.
            let middle = bounds.center() + self.middle;
            if !polygon.may_meet(middle, 0.5 * bounds.size()) {
                continue;
            }
            match block.halves() {
                Some(halves) => blocks.extend(halves),
                None => found(self.index(block.from)),
            }
        }
    }

    /// Returns the voxels from one point of the box to another.
    pub(super) fn walk(&self, from: DVec3, to: DVec3) -> Walk<'_> {
        Walk {
            voxels: self,
            from,
            along: to - from,
            at: Some(self.voxel_at(from)),
        }
    }
}

/// Voxels along a way; distances are computed from the voxel's number at each step.
#[derive(Debug)]
pub(super) struct Walk<'a> {
    voxels: &'a Voxels,
    from: DVec3,
    along: DVec3,
    at: Option<[u32; 3]>,
}

impl Iterator for Walk<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let at = self.at?;
        let voxel = self.voxels.index(at);
        let crossing = |axis: usize| {
            let rate = self.along[axis];
            if rate == 0.0 {
                return f64::INFINITY;
            }
            let plane = self.voxels.plane(axis, at[axis] + u32::from(rate > 0.0));
            (plane - self.from[axis]) / rate
        };
        let distances = [0, 1, 2].map(crossing);
        let axis = (0..3)
            .min_by(|&a, &b| distances[a].total_cmp(&distances[b]))
            .filter(|&axis| distances[axis] <= 1.0);
        self.at = axis.and_then(|axis| {
            let mut next = at;
            next[axis] = if self.along[axis] > 0.0 {
                Some(at[axis] + 1).filter(|&n| n < self.voxels.resolution[axis])
            } else {
                at[axis].checked_sub(1)
            }?;
            Some(next)
        });
        Some(voxel)
    }
}

/// Polygons voxel after voxel.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// Where each voxel's list ends.
    ends: Vec<u32>,
    polygons: Vec<u32>,
}

impl Lists {
    /// `None` if they take more than so many bytes, or more entries than are numbered.
    pub(super) fn new(voxels: &Voxels, polygons: &[Polygon], most_bytes: u64) -> Option<Self> {
        let most = (most_bytes / size_of::<u32>() as u64).min(u64::from(u32::MAX));
        let mut ends = vec![0u32; voxels.count()];
        let mut count = voxels.count() as u64;
        for polygon in polygons {
            voxels.voxels_of(polygon, &mut |voxel| {
                ends[voxel] += 1;
                count += 1;
            });
            if count > most {
                return None;
            }
        }
        let mut end = 0;
        for count in &mut ends {
            // Where the list begins, for now.
            (*count, end) = (end, end + *count);
        }
        let mut all = vec![0; end as usize];
        for (number, polygon) in polygons.iter().enumerate() {
            voxels.voxels_of(polygon, &mut |voxel| {
                all[ends[voxel] as usize] = number as u32;
                ends[voxel] += 1;
            });
        }
        Some(Self {
            ends,
            polygons: all,
        })
    }

    pub(super) fn of(&self, voxel: usize) -> &[u32] {
        let first = voxel.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.polygons[first as usize..self.ends[voxel] as usize]
    }

    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(self.ends.as_slice()) + size_of_val(self.polygons.as_slice())) as u64
    }
}
