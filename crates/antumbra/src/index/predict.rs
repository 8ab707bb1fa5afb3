//! Bytes that an index will take, predicted before any of them is taken.
//!
//! In: surfaces and settings. Out: bytes, by what takes them. Grid and tree are made once, and take more while they
//! are made; what lights know of method `voxel` keeps to a limit of its own, so that it is never too much.

use antumbra_geometry::Occluders;

use super::ShadowIndex;
use super::needs::{knowledge, layout, needs_bvh, needs_grid};
use super::prediction::Prediction;
use super::refused::BuildError;
use crate::accel::bvh::Bvh;
use crate::accel::grid::Grid;
use crate::accel::parts::{Parts, Split};
use crate::occlusion::{AdaptiveValues, DenseValues, mark_bytes};
use crate::{GridResolution, Method, RayMethod, Refinement};

/// What an index is asked to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked<'a> {
    pub(super) occluders: &'a Occluders,
    pub(super) light_count: usize,
    pub(super) resolution: GridResolution,
    pub(super) has_grid: bool,
    pub(super) method: Method,
    pub(super) has_tree: bool,
    pub(super) refinement: Refinement,
    /// Queries of each light that will come, if that is known.
    pub(super) query_count: Option<u64>,
}

impl Asked<'_> {
    /// Returns the bytes.
    pub(super) fn predict(&self) -> Result<Prediction, BuildError> {
        let split = match self.has_grid {
            true => Split::Narrow,
            false => Split::Wide,
        };
        let bounds = Parts::near_bounds(self.occluders, split);
        let layout = layout(self.occluders, bounds, self.resolution)?;
        let [mut grid_height, mut grid] = [0; 2];
        if self.has_grid {
            [grid_height, grid] = Grid::predict_bytes(self.occluders, &layout);
        }
        let light_count = self.light_count as u64;
        let mut values = 0;
        if self.method == Method::Voxel1990 {
            let stored = DenseValues::bytes_for(layout.voxel_count()) * light_count;
            values = stored + mark_bytes(self.occluders, layout.voxel_count());
        }
        // What making the grid takes beside is free again before anything else is made.
        let grid = grid.max(grid_height.saturating_sub(values));
        let [mut tree_height, mut tree] = [0; 2];
        if self.has_tree {
            [tree_height, tree] = Bvh::predict_bytes(self.occluders);
        }
        let known = match knowledge(self.method) {
            Some(knowledge) => {
                let making = self.refinement.making(knowledge);
                AdaptiveValues::predict_bytes(
                    self.occluders,
                    self.light_count,
                    &making,
                    self.query_count,
                )
            }
            None => 0,
        };
        Ok(Prediction {
            grid,
            tree: tree_height,
            values,
            knowledge: (tree + known).saturating_sub(tree_height),
        })
    }
}

impl ShadowIndex {
    /// Returns about how many bytes an index takes at its height, before any is taken: while it is built, and with
    /// what so many queries of each light make it know, or any number if that is not said.
    ///
    /// # Errors
    /// The resolution is out of range.
    pub fn predict(
        occluders: &Occluders,
        light_count: usize,
        resolution: GridResolution,
        (method, rays): (Method, RayMethod),
        refinement: Refinement,
        query_count: Option<u64>,
    ) -> Result<Prediction, BuildError> {
        Asked {
            occluders,
            light_count,
            resolution,
            has_grid: needs_grid(method, rays),
            method,
            has_tree: needs_bvh(method, rays),
            refinement,
            query_count,
        }
        .predict()
    }

    /// Returns the resolution that a setting means for a scene.
    ///
    /// # Errors
    /// The resolution is out of range.
    pub fn resolve_grid(
        occluders: &Occluders,
        resolution: GridResolution,
    ) -> Result<[u32; 3], BuildError> {
        let bounds = Parts::near_bounds(occluders, Split::Narrow);
        Ok(layout(occluders, bounds, resolution)?.resolution)
    }
}
