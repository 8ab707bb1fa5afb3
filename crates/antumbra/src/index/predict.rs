//! What an index will take, told before any of it is taken.
//!
//! In: surfaces and settings. Out: bytes, by what takes them. Grid and tree are made once, and take more while they
//! are made; what lights know of method `voxel` keeps to a limit of its own, so that it is never too much.

use std::fmt;

use antumbra_geometry::Occluders;

use super::builder::{BuildError, knowledge, layout};
use super::settings::{GridResolution, Method, Refinement};
use crate::bvh::Bvh;
use crate::grid::Grid;
use crate::occlusion::{AdaptiveValues, DenseValues, mark_bytes};
use crate::parts::{Parts, Split};

/// Bytes that building and asking an index takes at the height, by what takes them. Surfaces, lights and answers come
/// beside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Prediction {
    /// The uniform grid.
    pub grid: u64,
    /// The tree over the surfaces, while it is built.
    pub tree: u64,
    /// The values of [`Method::Voxel1990`], and what marking them takes.
    pub values: u64,
    /// What lights know of [`Method::Voxel`], as far as it comes beside the height of the tree; within
    /// [`Refinement::memory`].
    pub knowledge: u64,
}

impl Prediction {
    /// Returns the sum of all.
    pub fn total(&self) -> u64 {
        self.needed().saturating_add(self.knowledge)
    }

    /// Returns the sum of what an index cannot do without: all but what lights know, which takes what is left.
    pub fn needed(&self) -> u64 {
        let Self {
            grid,
            tree,
            values,
            knowledge: _,
        } = *self;
        grid.saturating_add(tree).saturating_add(values)
    }
}

impl fmt::Display for Prediction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            grid,
            tree,
            values,
            knowledge: _,
        } = self;
        write!(
            f,
            "the grid {grid}, the tree {tree}, occlusion values {values}"
        )
    }
}

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
