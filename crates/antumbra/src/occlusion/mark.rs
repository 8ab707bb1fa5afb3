//! Marking: every element's umbra is projected onto the voxels (Paper 6, 6.2).
//!
//! Top down: a block of voxels keeps the elements whose umbrae may cross it, and is cut in two
//! until an element covers it, none is left, or it is one voxel. What the paper does object after
//! object gives the same values in any order, because full beats complicated and complicated beats
//! null.

use std::sync::atomic::{AtomicU8, Ordering};

use antumbra_geometry::{ElementId, LightShape, Occluders, Shaft, Umbra};
use antumbra_task::checked;

use super::{DenseValues, Occlusion};
use crate::accel::grid::{Block, Grid};
use crate::threads::{self, prelude::*};

/// Blocks of more voxels than this are marked in parallel.
const PARALLEL_VOXELS: u64 = 4096;

/// Returns one light's value for every voxel, on all threads.
pub(crate) fn mark(occluders: &Occluders, grid: &Grid, light: &LightShape) -> DenseValues {
    let task = antumbra_task::current();
    let umbrae: Vec<Umbra> = (0..occluders.elements().len() as u32)
        .into_par_iter()
        .map(|element| {
            task.check();
            occluders.umbra(ElementId(element), light)
        })
        .collect();
    let casting: Vec<u32> = (0..umbrae.len() as u32)
        .filter(|&i| !umbrae[i as usize].is_nothing())
        .collect();
    let values: Vec<AtomicU8> = (0..grid.layout.voxel_count())
        .map(|_| AtomicU8::new(Occlusion::Null.bits()))
        .collect();
    let marker = Marker {
        occluders,
        grid,
        light,
        umbrae: &umbrae,
        values: &values,
    };
    marker.mark_block(&grid.layout.whole(), &casting);
    DenseValues::pack(
        values
            .iter()
            .map(|value| Occlusion::from_bits(value.load(Ordering::Relaxed))),
    )
}

/// Returns about the bytes that [`mark`] takes besides the values: an umbra of each element, and a byte a voxel.
pub(crate) fn mark_bytes(occluders: &Occluders, voxel_count: usize) -> u64 {
    /// What the umbra of a face holds elsewhere: of a triangle its corners and the planes through its sides.
    const BESIDE: usize = 540;
    let faces = (0..occluders.elements().len() as u32).filter(|&i| occluders.is_face(ElementId(i)));
    /// The same of every umbra, in the mean.
    const BESIDE_ANY: usize = 50;
    let each = size_of::<Umbra>() + size_of::<u32>() + BESIDE_ANY;
    (each * occluders.elements().len() + BESIDE * faces.count() + voxel_count) as u64
}

struct Marker<'a> {
    occluders: &'a Occluders,
    grid: &'a Grid,
    light: &'a LightShape,
    umbrae: &'a [Umbra],
    /// Each voxel is written by the one block that ends at it.
    values: &'a [AtomicU8],
}

impl Marker<'_> {
    /// Marks the voxels of a block that only the given elements can darken.
    fn mark_block(&self, block: &Block, elements: &[u32]) {
        // Keep the elements whose umbrae may cross the block; one that covers it decides.
        let shaft = Shaft::new(self.grid.layout.inflated(block), *self.light);
        let mut crossing = Vec::new();
        for &element in checked(elements) {
            match self.umbrae[element as usize].relation(&shaft) {
                antumbra_geometry::Relation::Misses => {}
                antumbra_geometry::Relation::Crosses => crossing.push(element),
                antumbra_geometry::Relation::Covers => {
                    return self.fill(block, Occlusion::Full);
                }
            }
        }
        if crossing.is_empty() {
            return;
        }
        match block.halves() {
            None => self.fill(block, self.value_of_voxel(block.from, &crossing)),
            Some([low, high]) if block.voxel_count() > PARALLEL_VOXELS => {
                let task = antumbra_task::current();
                threads::join(
                    || task.enter(|| self.mark_block(&low, &crossing)),
                    || task.enter(|| self.mark_block(&high, &crossing)),
                );
            }
            Some(halves) => halves
                .iter()
                .for_each(|half| self.mark_block(half, &crossing)),
        }
    }

    /// Returns the value of a voxel that some umbrae cross and none covers.
    fn value_of_voxel(&self, voxel: [u32; 3], crossing: &[u32]) -> Occlusion {
        // Null-one: the voxel holds one element, which cannot shadow itself, and nothing else
        // darkens it.
        let mut surfaces = self.grid.surfaces(self.grid.layout.index(voxel)).iter();
        let is_null_one = matches!(crossing, &[only]
            if self.umbrae[only as usize].is_self_clear()
                && surfaces.len() > 0
                && surfaces.all(|&surface| self.occluders.element_of(surface).0 == only));
        if is_null_one {
            Occlusion::Null
        } else {
            Occlusion::Complicated
        }
    }

    fn fill(&self, block: &Block, value: Occlusion) {
        for voxel in block.voxels() {
            self.values[self.grid.layout.index(voxel)].store(value.bits(), Ordering::Relaxed);
        }
    }
}
