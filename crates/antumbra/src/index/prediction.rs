//! Bytes that an index will take, by what takes them.

use std::fmt;

/// Bytes that building and asking an index takes at the height, by what takes them. Surfaces, lights and answers come
/// beside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Prediction {
    /// The uniform grid.
    pub grid: u64,
    /// The tree over the surfaces, while it is built.
    pub tree: u64,
    /// The values of [`Method::Voxel1990`](crate::Method::Voxel1990), and what marking them takes.
    pub values: u64,
    /// Knowledge of lights of [`Method::Voxel`](crate::Method::Voxel), as far as it comes beside the height of the tree; within
    /// [`Refinement::memory`](crate::Refinement::memory).
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
