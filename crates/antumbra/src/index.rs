//! The product's front door: a scene's surfaces and lights, ready for queries.

use std::sync::Arc;

use antumbra_geometry::{Hit, LightShape, Occluders, Ray, Start};

use crate::Counters;

/// How shadow queries are answered. Every method gives the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Voxel occlusion testing as published in 1990.
    #[default]
    Voxel1990,
    /// A walk through the uniform grid for each query.
    Grid,
    /// Every surface is tested: the reference.
    Naive,
}

/// How fine the uniform grid is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridResolution {
    /// Woo's rule, from the number of surfaces.
    #[default]
    Automatic,
    /// Voxels along x, y and z; each 1 to 2048.
    Fixed([u32; 3]),
}

/// What to do with the quick check of Paper 7.3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QuickCheck {
    /// Do not evaluate it.
    #[default]
    Off,
    /// Evaluate it and say what it advises.
    Report,
    /// Evaluate it and leave voxel occlusion testing out where it advises so.
    Obey,
}

/// What the quick check of Paper 7.3 found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuickCheckVerdict {
    /// Mean share of the grid's voxels that an element occupies, 0..1.
    pub occupied_share: f64,
    /// The share below which the check advises against.
    pub threshold: f64,
    /// Whether the check advises voxel occlusion testing.
    pub is_advised: bool,
}

/// Whether a light reaches a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadow {
    /// Nothing opaque is between.
    Lit,
    /// Something is.
    Shadowed,
}

/// How a query was decided; for statistics, never part of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decided {
    /// By the value of the start's voxel.
    FirstPass,
    /// By the value of a voxel on the way.
    Intermediate,
    /// By a blocker list.
    BlockerList,
    /// By a full walk.
    Ray,
}

/// The answer to a shadow query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The bit.
    pub shadow: Shadow,
    /// How it was found.
    pub decided: Decided,
}

/// Why an index cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// A light is not finite, too large, or a zero direction.
    #[error("light {light}: position or direction must be finite, at most 2^100 and not a zero direction")]
    BadLight {
        /// Index of the light.
        light: usize,
    },
    /// A grid resolution is out of range.
    #[error("grid resolution {0:?}: each axis takes 1 to 2048 voxels")]
    BadResolution([u32; 3]),
    /// The grid and the values would need more memory than allowed.
    #[error("grid and occlusion values need about {needed} bytes, more than the limit of {limit}; lower the grid resolution")]
    Memory {
        /// Predicted bytes.
        needed: u64,
        /// Allowed bytes.
        limit: u64,
    },
}

/// Collects settings for a [`ShadowIndex`].
#[derive(Debug)]
pub struct Builder {}

impl Builder {
    /// Chooses how shadow queries are answered.
    #[must_use]
    pub fn method(self, _method: Method) -> Self {
        todo!()
    }
    /// Chooses the grid's resolution.
    #[must_use]
    pub fn grid(self, _resolution: GridResolution) -> Self {
        todo!()
    }
    /// Chooses what the quick check does.
    #[must_use]
    pub fn quick_check(self, _quick_check: QuickCheck) -> Self {
        todo!()
    }
    /// Limits the memory of grid and values, in bytes.
    #[must_use]
    pub fn memory_limit(self, _bytes: u64) -> Self {
        todo!()
    }
    /// Builds grid and occlusion values, on all threads of the current rayon pool.
    ///
    /// # Errors
    /// A light or a setting is out of range, or the memory limit is too small.
    pub fn build(self) -> Result<ShadowIndex, BuildError> {
        todo!()
    }
}

/// A static scene's surfaces and lights, ready for nearest-hit and shadow queries.
#[derive(Debug)]
pub struct ShadowIndex {}

impl ShadowIndex {
    /// Starts an index over `occluders` for `lights`; queries name lights by their place here.
    pub fn builder(_occluders: Arc<Occluders>, _lights: Vec<LightShape>) -> Builder {
        todo!()
    }

    /// Returns the surfaces.
    pub fn occluders(&self) -> &Occluders {
        todo!()
    }

    /// Returns the lights.
    pub fn lights(&self) -> &[LightShape] {
        todo!()
    }

    /// Returns the nearest surface along `ray`; transparent ones count. Ties go to the lowest id.
    pub fn nearest(&self, _ray: &Ray, _counters: &mut Counters) -> Option<Hit> {
        todo!()
    }

    /// Returns on which side of its surface the light is, at the start (EXACTNESS.md, "The side of
    /// the light"): positive on the side of the normal, negative behind, zero in the tangent plane
    /// and for free starts.
    pub fn light_side(&self, _start: &Start, _light: usize) -> i8 {
        todo!()
    }

    /// Answers a shadow query exactly. Counts under `counters.shadow`.
    pub fn shadow(&self, _start: &Start, _light: usize, _counters: &mut Counters) -> Answer {
        todo!()
    }

    /// Answers a shadow query by testing every surface: the reference of EXACTNESS.md.
    pub fn shadow_by_reference(&self, _start: &Start, _light: usize) -> Shadow {
        todo!()
    }

    /// Returns the grid's voxels along x, y and z.
    pub fn grid_resolution(&self) -> [u32; 3] {
        todo!()
    }

    /// Returns the bytes of all occlusion values: two bits per voxel and light.
    pub fn occlusion_bytes(&self) -> u64 {
        todo!()
    }

    /// Returns the bytes the index would take, before any is taken.
    ///
    /// # Errors
    /// As [`Builder::build`], memory limit apart.
    pub fn predict_bytes(_occluders: &Occluders, _light_count: usize, _resolution: GridResolution, _method: Method) -> Result<u64, BuildError> {
        todo!()
    }

    /// Returns what the quick check found, if it was asked for.
    pub fn quick_check(&self) -> Option<QuickCheckVerdict> {
        todo!()
    }
}
