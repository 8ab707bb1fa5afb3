//! What lights know, and the bytes that it takes.

use antumbra_geometry::LightId;

use super::ShadowIndex;
use crate::occlusion::{AdaptiveValues, DenseValues};

impl ShadowIndex {
    /// Returns how often what a light knows of [`Method::Voxel`](crate::Method::Voxel), or a part of it, was dropped because all that lights
    /// know took all memory that it may take.
    pub fn evictions(&self) -> u64 {
        self.with_glass(|index| index.adaptive.as_ref().map_or(0, AdaptiveValues::evictions))
    }

    /// Returns of how many lights something that was wanted was not made, for want of room in [`Refinement::memory`](crate::Refinement::memory):
    /// rays answer in its place.
    pub fn lights_without_room(&self) -> usize {
        self.adaptive
            .as_ref()
            .map_or(0, AdaptiveValues::refused_count)
    }

    /// Returns the bytes that all lights together have taken of [`Refinement::memory`](crate::Refinement::memory): values, lists, tables, and
    /// room that is not used yet.
    pub fn knowledge_bytes(&self) -> u64 {
        self.with_glass(|index| index.adaptive.as_ref().map_or(0, AdaptiveValues::bytes))
    }

    /// Returns the bytes of all occlusion values: for [`Method::Voxel1990`](crate::Method::Voxel1990) two bits per voxel and light, for
    /// [`Method::Voxel`](crate::Method::Voxel) bricks of values with their links, as far as they are made. Lists and tables are
    /// [`ShadowIndex::table_bytes`].
    pub fn occlusion_bytes(&self) -> u64 {
        self.with_glass(|index| {
            let adaptive = index.adaptive.as_ref();
            let dense = index.values.iter().map(DenseValues::bytes);
            adaptive.map_or(0, AdaptiveValues::value_bytes) + dense.sum::<u64>()
        })
    }

    /// Returns the bytes of blocker lists, their planes and the tables that queries read beside values.
    pub fn table_bytes(&self) -> u64 {
        self.with_glass(|index| {
            index
                .adaptive
                .as_ref()
                .map_or(0, AdaptiveValues::table_bytes)
        })
    }

    /// Forgets all values of [`Method::Voxel`](crate::Method::Voxel) that were made while queries were answered, and all tables for
    /// them, as if the index were new.
    pub fn forget_values(&mut self) {
        self.all_lights = std::sync::OnceLock::new();
        self.whole_lights = std::sync::OnceLock::new();
        self.glass = std::sync::OnceLock::new();
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.forget();
        }
    }

    /// Says that about so many queries of a light will come soon, batch by batch or one by one: what pays for many is
    /// made at the first then. Answers do not depend on it. Batches say it themselves. No light, no effect.
    pub fn expect_queries(&self, light: LightId, queries: u64) {
        let light = light.index();
        if let Some(adaptive) = &self.adaptive
            && light < self.lights.len()
        {
            adaptive.expect(light, queries);
        }
        if let Some(glass) = self.built_glass() {
            glass.expect_queries(LightId::from_index(light), queries);
        }
    }

    /// Stops or resumes making values while queries are answered. Answers do not change.
    ///
    /// Every index makes values unless this call stops it. Without, queries cost a little less where nothing is
    /// known yet, and what is known stays as it is: for measurements.
    pub fn set_refining(&self, is_refining: bool) {
        if let Some(adaptive) = &self.adaptive {
            adaptive.set_refining(is_refining);
        }
        if let Some(glass) = self.built_glass() {
            glass.set_refining(is_refining);
        }
    }

    /// Returns a number of this index and of what it knows of glass together.
    fn with_glass(&self, number: impl Fn(&Self) -> u64) -> u64 {
        number(self) + self.built_glass().map_or(0, &number)
    }
}
