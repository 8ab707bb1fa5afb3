//! Settings of an index as plain data, for those who keep, compare or pass them on.

#[cfg(feature = "file")]
use std::path::Path;
use std::sync::Arc;

use antumbra_geometry::{LightShape, Occluders};

use super::ShadowIndex;
use super::builder::Builder;
use super::prediction::Prediction;
use super::refused::BuildError;
use crate::{GridResolution, Method, QuickCheck, RayMethod, Refinement};

/// Settings of an index, as plain data: what a [`Builder`] takes one by one.
#[derive(Clone, Copy, Debug)]
pub struct IndexOptions {
    /// How shadow queries are answered.
    pub method: Method,
    /// Method that finds nearest hits.
    pub rays: RayMethod,
    /// How fine the grid is.
    pub grid: GridResolution,
    /// Action on the quick check of Paper 7.3.
    pub quick_check: QuickCheck,
    /// How far the values of [`Method::Voxel`] are refined.
    pub refinement: Refinement,
    /// Maximum number of bytes for grid, tree and values ([`Builder::memory_limit`]).
    pub memory_limit: u64,
}

impl Default for IndexOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            rays: RayMethod::default(),
            grid: GridResolution::default(),
            quick_check: QuickCheck::default(),
            refinement: Refinement::default(),
            memory_limit: u64::MAX,
        }
    }
}

impl IndexOptions {
    /// Returns a builder with these settings.
    pub fn builder(&self, occluders: Arc<Occluders>, lights: Vec<LightShape>) -> Builder {
        ShadowIndex::builder(occluders, lights)
            .method(self.method)
            .rays(self.rays)
            .grid(self.grid)
            .quick_check(self.quick_check)
            .refinement(self.refinement)
            .memory_limit(self.memory_limit)
    }

    /// Builds an index.
    ///
    /// # Errors
    /// As [`Builder::build`].
    pub fn build(
        &self,
        occluders: &Arc<Occluders>,
        lights: Vec<LightShape>,
    ) -> Result<ShadowIndex, BuildError> {
        self.builder(Arc::clone(occluders), lights).build()
    }

    /// Builds an index with what a file knows of the lights ([`Builder::occlusion_file`]), where one is given.
    ///
    /// Needs the feature `file`, which is on by default.
    ///
    /// # Errors
    /// As [`Builder::build`].
    #[cfg(feature = "file")]
    pub fn build_from(
        &self,
        occluders: &Arc<Occluders>,
        lights: Vec<LightShape>,
        file: Option<&Path>,
    ) -> Result<ShadowIndex, BuildError> {
        let builder = self.builder(Arc::clone(occluders), lights);
        match file {
            Some(path) => builder.occlusion_file(path),
            None => builder,
        }
        .build()
    }

    /// Returns the bytes that grid, tree and values will take at their height, before any is taken; with so many
    /// queries of each light, or any number if that is not said.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn predict(
        &self,
        occluders: &Occluders,
        light_count: usize,
        query_count: Option<u64>,
    ) -> Result<Prediction, BuildError> {
        ShadowIndex::predict(
            occluders,
            light_count,
            self.grid,
            (self.method, self.rays),
            self.refinement,
            query_count,
        )
    }

    /// Returns the voxels along x, y and z that the grid will have.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn resolve_grid(&self, occluders: &Occluders) -> Result<[u32; 3], BuildError> {
        ShadowIndex::resolve_grid(occluders, self.grid)
    }
}
