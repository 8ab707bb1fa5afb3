//! Settings of an index, but for its lights.

use crate::occlusion::{Depth, Knowledge, Making, Refine};

/// How shadow queries are answered. Every method gives the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Voxel occlusion testing as published in 1990.
    Voxel1990,
    /// Whatever is fastest: for each light an exact shadow map of its directions, made where it pays, and rays for the
    /// rest.
    #[default]
    Auto,
    /// Values that are exact on meshes, in voxels refined where surfaces are; blocker lists; rays for
    /// the rest.
    Voxel,
    /// A walk through the uniform grid for each query.
    Grid,
    /// A ray through the bounding volume hierarchy for each query.
    Bvh,
    /// Every surface is tested: the reference.
    Naive,
}

/// How rays that ask for the nearest hit find it. Both give the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum RayMethod {
    /// The bounding volume hierarchy.
    #[default]
    Bvh,
    /// The uniform grid.
    Grid,
}

/// How fine the uniform grid is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum GridResolution {
    /// Woo's rule, from the number of surfaces.
    #[default]
    Automatic,
    /// Voxels along x, y and z: each 1 to 2048, their product below 2^32 - 1.
    Fixed([u32; 3]),
}

/// How far the values of [`Method::Voxel`] are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refinement {
    /// Finest voxels along the longest axis of the scene, where surfaces are: rounded up to a power
    /// of two, 4 to 4096.
    pub resolution: u32,
    /// Finest voxels along the longest axis for points of space near surfaces.
    pub space_resolution: u32,
    /// Maximum number of potential blockers stored as a list instead of subdividing a voxel; 0 disables lists.
    pub short_list: usize,
    /// Maximum number of potential blockers stored as a list for points of space.
    pub space_list: usize,
    /// Maximum number of them stored as a list in the finest voxels; 0 disables lists.
    pub long_list: usize,
    /// When values are made.
    pub refine: Refine,
    /// Bytes that may be taken for all that lights know, for all lights together: values, lists, tables of the
    /// surfaces, and what is needed for a moment to make them. Values of one light take 4 GiB at most. Where that is
    /// too little, values that are made while queries are answered are dropped and made again, or lights are answered
    /// by rays; answers do not change. [`ShadowIndex::evictions`](crate::ShadowIndex::evictions) and
    /// [`ShadowIndex::lights_without_room`](crate::ShadowIndex::lights_without_room) report. Each light
    /// takes 400 bytes of it, asked or not. Beside it come the surfaces, the tree and the grid.
    pub memory: u64,
}

impl Default for Refinement {
    fn default() -> Self {
        Self {
            resolution: 2048,
            space_resolution: 2048,
            short_list: 3,
            space_list: 8,
            long_list: 32,
            refine: Refine::default(),
            memory: 512 << 20,
        }
    }
}

impl Refinement {
    pub(crate) fn making(self, knowledge: Knowledge) -> Making {
        Making {
            depth: self.depth(),
            knowledge,
            refine: self.refine,
            most_bytes: self.memory,
        }
    }

    pub(crate) fn depth(self) -> Depth {
        let level = |resolution: u32| resolution.clamp(4, 4096).next_power_of_two().ilog2();
        Depth {
            surfaces: level(self.resolution),
            space: level(self.space_resolution),
            short_list: self.short_list,
            space_list: self.space_list,
            long_list: self.long_list,
        }
    }
}

/// Action on the quick check of Paper 7.3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum QuickCheck {
    /// Do not evaluate it.
    #[default]
    Off,
    /// Evaluate it and say what it advises.
    Report,
    /// Evaluate it and leave voxel occlusion testing out where it advises so.
    Obey,
}
