//! Values for other programs: a regular grid of cells, a byte for each cell and light.
//!
//! In: an index. Out: a [`Volume`]. Invariant: what is said of a cell holds for every point in it.

use antumbra_geometry::{Bounds, DVec3};

use super::ShadowIndex;
use crate::occlusion::{Cells, LIT, MIXED, SHADOWED};

/// Knowledge about the points of space, in cells of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// How many cells there are along x, y and z.
    pub cells: [u32; 3],
    /// The lowest corner of the first cell, world space. It lies a little below the scene.
    pub min: DVec3,
    /// The edge of a cell, world units.
    pub edge: f64,
    /// How many lights there are.
    pub light_count: usize,
    /// [`Volume::LIT`], [`Volume::SHADOWED`] or [`Volume::MIXED`] for each cell and light: x slowest, then y,
    /// z, and the light fastest. Cell (i, j, k) holds the points from `min + edge * (i, j, k)` to
    /// `min + edge * (i + 1, j + 1, k + 1)`.
    pub values: Vec<u8>,
}

impl Volume {
    /// The light reaches every point of the cell.
    pub const LIT: u8 = LIT;
    /// It reaches none.
    pub const SHADOWED: u8 = SHADOWED;
    /// It reaches some, or that is not known.
    pub const MIXED: u8 = MIXED;

    /// Most cells along an axis.
    pub const MOST_CELLS: u32 = 1024;
}

impl ShadowIndex {
    /// Returns what the values of [`Method::Voxel`](crate::Method::Voxel) say of the points of space, in cells of
    /// which `resolution` (rounded up to a power of two, at most [`Volume::MOST_CELLS`]) lie along the
    /// scene's longest axis; none by another method. Nothing is made for it: an index that makes values
    /// while queries are answered knows little of points that nobody has asked about.
    pub fn volume(&self, resolution: u32) -> Option<Volume> {
        let values = self.adaptive()?;
        let cells = self.volume_cells(resolution)?;
        let light_count = self.lights().len();
        // `volume_bytes` tells beforehand.
        let mut volume = Volume {
            cells: cells.counts,
            min: cells.min,
            edge: cells.edge,
            light_count,
            values: vec![MIXED; cells.count() as usize * light_count],
        };
        for light in 0..light_count {
            values.fill_cells(light, &cells, &mut volume.values[light..], light_count);
        }
        self.doubt_far_lights(&mut volume);
        Some(volume)
    }

    /// Values know nothing of far surfaces: where these may block, nothing is surely lit.
    fn doubt_far_lights(&self, volume: &mut Volume) {
        if self.parts.is_whole() {
            return;
        }
        let [_, ny, nz] = volume.cells.map(|count| count as usize);
        for (number, value) in volume.values.iter_mut().enumerate() {
            let (cell, light) = (number / volume.light_count, number % volume.light_count);
            let at = [cell / nz / ny, cell / nz % ny, cell % nz];
            let min = volume.min + DVec3::from_array(at.map(|place| place as f64)) * volume.edge;
            // Twice as much as a cell, for the rounding of where it is.
            let bounds = Bounds {
                min,
                max: min + volume.edge,
            }
            .inflated(DVec3::splat(0.5 * volume.edge));
            if *value == LIT && self.parts.may_block(&bounds, &self.lights()[light]) {
                *value = MIXED;
            }
        }
    }

    /// Returns the bytes of the values of a [`Volume`], before any is taken; none by another method.
    pub fn volume_bytes(&self, resolution: u32) -> Option<u64> {
        let cells = self.volume_cells(resolution)?;
        Some(cells.count().saturating_mul(self.lights().len() as u64))
    }

    fn volume_cells(&self, resolution: u32) -> Option<Cells> {
        let level = resolution.clamp(1, Volume::MOST_CELLS).next_power_of_two();
        let scene = self.parts.near.bounds();
        let values = self.adaptive()?;
        (!scene.is_empty()).then(|| values.cells(&scene, level.ilog2()))
    }
}
