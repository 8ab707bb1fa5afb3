//! Putting surfaces into voxels, conservatively.

use antumbra_geometry::{Occluders, SurfaceId};
use rayon::prelude::*;

use super::{Block, Layout};

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
            .map(|surface| {
                let block = layout.block_around(&occluders.surface_bounds(surface));
                // A surface meets a layer of its box, not all of it.
                let sides: [u64; 3] =
                    std::array::from_fn(|axis| u64::from(block.to[axis] - block.from[axis]));
                let layer = |a: usize, b: usize| sides[a] * sides[b];
                (layer(0, 1) + layer(1, 2) + layer(2, 0)).min(block.voxel_count())
            })
            .sum();
        // Entries live twice while they are sorted: as pairs and in place; and where they start, too.
        let voxels = 4 * (layout.voxel_count() as u64 + 1);
        [2 * voxels + 15 * entries, voxels + 4 * entries]
    }
}

/// Appends the voxels that a surface may meet.
fn insert(
    occluders: &Occluders,
    layout: &Layout,
    surface: SurfaceId,
    entries: &mut Vec<(u32, SurfaceId)>,
) {
    let mut pending = vec![layout.block_around(&occluders.surface_bounds(surface))];
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
