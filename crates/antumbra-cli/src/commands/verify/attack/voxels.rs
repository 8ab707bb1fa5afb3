//! The planes between voxels.

use antumbra_geometry::{Bounds, DVec3};

use crate::commands::verify::random::Random;

/// The planes between the finest voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Voxels {
    pub(super) min: DVec3,
    pub(super) edge: f64,
    counts: [u32; 3],
}

impl Voxels {
    /// Takes the voxels of an index, or, without one, cuts the box into some.
    pub(super) fn new(voxels: Option<(DVec3, f64, [u32; 3])>, reach: &Bounds) -> Self {
        const COUNT: u32 = 64;
        let edge = reach.size().max_element() / f64::from(COUNT);
        let (min, edge, counts) = voxels.unwrap_or((reach.min, edge, [COUNT; 3]));
        Self { min, edge, counts }
    }

    /// Returns a plane across an axis between two bounds, or `None` if there is none between voxels of
    /// the size that was drawn.
    pub(super) fn between(
        &self,
        random: &mut Random,
        axis: usize,
        low: f64,
        high: f64,
    ) -> Option<f64> {
        let stride = f64::from(1u32 << random.below(self.counts[axis].ilog2() as usize + 1));
        let step = self.edge * stride;
        let first = ((low - self.min[axis]) / step).ceil().max(0.0);
        let last = ((high - self.min[axis]) / step)
            .floor()
            .min(f64::from(self.counts[axis]) / stride);
        (first <= last).then(|| {
            let number = first + (random.draw() * (last - first + 1.0)).floor();
            self.plane(axis, number.min(last) * stride)
        })
    }

    /// Returns the plane nearest to a coordinate, between voxels of any size.
    pub(super) fn nearest(&self, random: &mut Random, axis: usize, x: f64) -> f64 {
        let stride = f64::from(1u32 << random.below(self.counts[axis].ilog2() as usize + 1));
        let number = ((x - self.min[axis]) / (self.edge * stride)).round();
        self.plane(axis, number * stride)
    }

    pub(super) fn plane(&self, axis: usize, number: f64) -> f64 {
        self.min[axis] + number * self.edge
    }
}
