//! Putting surfaces into voxels, conservatively.

use crate::threads::prelude::*;
use antumbra_geometry::{Bounds, Occluders, SurfaceId};

use super::{Block, Layout, cut};

/// For each voxel the surfaces that may meet it, in ascending order.
#[derive(Debug)]
pub(crate) struct Grid {
    pub(crate) layout: Layout,
    /// Where each voxel's surfaces start in `items`; one more than voxels.
    starts: Vec<u32>,
    items: Vec<SurfaceId>,
}

impl Grid {
    /// Lists every surface in all voxels it may meet, on all threads.
    pub(crate) fn build(occluders: &Occluders, layout: Layout) -> Self {
        // Each chunk of surfaces lists its voxels; chunks keep their order, so the result does not
        // depend on threads.
        let task = antumbra_task::current();
        let ids: Vec<u32> = (0..occluders.surface_count() as u32).collect();
        let chunks: Vec<Vec<(u32, SurfaceId)>> = ids
            .par_chunks(4096)
            .map(|chunk| {
                let mut entries = Vec::new();
                task.enter(|| {
                    for &id in chunk {
                        insert(occluders, &layout, SurfaceId(id), &mut entries);
                    }
                });
                entries
            })
            .collect();

        // Count, then place.
        let mut starts = vec![0u32; layout.voxel_count() + 1];
        for &(voxel, _) in chunks.iter().flatten() {
            starts[voxel as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![SurfaceId(0); starts[starts.len() - 1] as usize];
        for &(voxel, surface) in chunks.iter().flatten() {
            let place = &mut next[voxel as usize];
            items[*place as usize] = surface;
            *place += 1;
        }
        Self {
            layout,
            starts,
            items,
        }
    }

    /// Returns the surfaces of a voxel, by its number in memory.
    pub(crate) fn surfaces(&self, voxel: usize) -> &[SurfaceId] {
        &self.items[self.starts[voxel] as usize..self.starts[voxel + 1] as usize]
    }

    /// Returns the bytes that building the grid takes at its height, and those of the grid, guessing from the boxes of
    /// the surfaces.
    pub(crate) fn predict_bytes(occluders: &Occluders, layout: &Layout) -> [u64; 2] {
        let entries: u64 = occluders
            .surfaces()
            .map(|surface| voxels_of_layer(occluders, layout, surface))
            .sum();
        // Entries live twice while they are sorted: as pairs and in place; and where they start, too.
        let voxels = 4 * (layout.voxel_count() as u64 + 1);
        [2 * voxels + 15 * entries, voxels + 4 * entries]
    }
}

/// Entries of a grid of automatic resolution, for each surface and at least: where every surface meets many
/// voxels, as in a heap of large triangles, finer voxels tell them apart no better.
const MOST_ENTRIES_EACH: f64 = 48.0;
const MOST_ENTRIES: f64 = (1 << 20) as f64;

/// Returns a resolution, made coarser until the surfaces meet a bearable number of voxels. Of many surfaces some
/// are looked at.
pub(crate) fn affordable_resolution(
    occluders: &Occluders,
    bounds: Bounds,
    usual: [u32; 3],
) -> [u32; 3] {
    const SAMPLES: usize = 256;
    let count = occluders.surface_count();
    let step = count.div_ceil(SAMPLES).max(1);
    let samples = || occluders.surfaces().step_by(step);
    let share = 1.0 / samples().count().max(1) as f64;
    let most = MOST_ENTRIES_EACH.max(MOST_ENTRIES / count as f64);

    let layout = Layout::new(bounds, usual);
    let in_boxes: u64 = samples()
        .map(|surface| voxels_of_layer(occluders, &layout, surface))
        .sum();
    if in_boxes as f64 * share <= most {
        return usual;
    }
    // From coarse to fine, so that looking costs no more than building.
    let scaled = |shift: i32| {
        let factor = 2.0_f64.powf(-0.5 * f64::from(shift));
        usual.map(|n| (f64::from(n) * factor).ceil().max(1.0) as u32)
    };
    let finest = usual.into_iter().max().unwrap_or(1);
    let mut best = [1; 3];
    let mut entries = Vec::new();
    for shift in (0..=2 * finest.ilog2() as i32).rev() {
        let layout = Layout::new(bounds, scaled(shift));
        entries.clear();
        for surface in samples() {
            insert(occluders, &layout, surface, &mut entries);
        }
        if entries.len() as f64 * share > most {
            break;
        }
        best = layout.resolution;
    }
    best
}

/// Returns how many voxels a layer of a surface's box has: it meets about so many, not all of the box.
fn voxels_of_layer(occluders: &Occluders, layout: &Layout, surface: SurfaceId) -> u64 {
    let block = layout.block_around(&occluders.surface_bounds(surface));
    let sides: [u64; 3] = std::array::from_fn(|axis| u64::from(block.to[axis] - block.from[axis]));
    let layer = |a: usize, b: usize| sides[a] * sides[b];
    (layer(0, 1) + layer(1, 2) + layer(2, 0)).min(block.voxel_count())
}

/// Appends the voxels that a surface may meet.
fn insert(
    occluders: &Occluders,
    layout: &Layout,
    surface: SurfaceId,
    entries: &mut Vec<(u32, SurfaceId)>,
) {
    let block = layout.block_around(&occluders.surface_bounds(surface));
    if let Some(corners) = occluders.triangle_positions(surface) {
        if occluders.may_meet_box(surface, &layout.inflated(&block)) {
            cut::for_each_voxel(layout, &block, corners, |voxel| {
                entries.push((layout.index(voxel) as u32, surface));
            });
        }
        return;
    }
    let mut pending = vec![block];
    while let Some(block) = pending.pop() {
        antumbra_task::check();
        if !occluders.may_meet_box(surface, &layout.inflated(&block)) {
            continue;
        }
        match block.halves() {
            Some(halves) => pending.extend(halves),
            None => entries.push((layout.index(block.from) as u32, surface)),
        }
    }
}

/// A block of one voxel.
impl From<[u32; 3]> for Block {
    fn from(voxel: [u32; 3]) -> Self {
        Self {
            from: voxel,
            to: voxel.map(|n| n + 1),
        }
    }
}
