//! Lights that are added, moved and removed once an index is built.
//!
//! In: an index and a light. Out: the index that [`ShadowIndex::builder`] would make for the changed lights. Invariant:
//! what is known of the other lights stays as it is, bit by bit.

use std::cell::OnceCell;
use std::sync::OnceLock;

use antumbra_geometry::{LightId, LightShape};

use super::ShadowIndex;
use super::needs::{check_light, needs_bvh, needs_grid};
use super::predict::Asked;
use super::refused::BuildError;
use crate::accel::bvh::Tree;
use crate::accel::grid::Grid;
use crate::file::SavedLight;
use crate::occlusion::{DenseValues, mark};
use crate::{GridResolution, Method, Refinement};

/// Why a light cannot be added, moved or removed. The index is as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// There is no such light.
    #[error("light {light} does not exist: the index has {light_count}")]
    Unknown {
        /// The light that was named.
        light: LightId,
        /// Number of lights.
        light_count: usize,
    },
    /// An index for these lights cannot be built.
    #[error(transparent)]
    Refused(#[from] BuildError),
}

impl ShadowIndex {
    /// Adds a light and returns its number, the place behind all others.
    ///
    /// Everything that is known of the other lights stays. Nothing is known of the new one yet, as if the index had just
    /// been built: with [`Refine::Eager`](crate::Refine::Eager) and for [`Method::Voxel1990`] its values are computed now, else while queries
    /// are answered.
    ///
    /// Takes `&mut self`: no query runs meanwhile. If the call is stopped ([`Task`](crate::Task)), the light may be there
    /// already; rays answer for it.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{LightShape, Occluders, Opacity, ShadowIndex, Sphere};
    ///
    /// let mut surfaces = Occluders::builder();
    /// let ball = Sphere { center: [0.0, 0.0, 2.0].into(), radius: 1.0 };
    /// surfaces.add_sphere(ball, Opacity::Opaque)?;
    /// let above = LightShape::Direction([0.0, 0.0, 1.0].into());
    /// let aside = LightShape::Direction([1.0, 0.0, 0.0].into());
    ///
    /// let mut index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![]).build()?;
    /// let sun = index.add_light(above)?;
    /// assert!(index.is_occluded_at([0.0, 0.0, 0.0], sun)?);
    /// index.move_light(sun, aside)?;
    /// assert!(!index.is_occluded_at([0.0, 0.0, 0.0], sun)?);
    /// index.remove_light(sun)?;
    /// assert!(index.lights().is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The light is not finite, too large or a zero direction, or its values would need more memory than
    /// [`Builder::memory_limit`](crate::Builder::memory_limit) allows.
    pub fn add_light(&mut self, light: LightShape) -> Result<LightId, LightError> {
        let number = self.lights.len();
        let id = LightId::from_index(number);
        check_light(id, &light)?;
        self.check_memory(number + 1)?;
        if let Some(glass) = self.built_glass_mut() {
            glass.add_light(light)?;
        }
        self.all_lights = OnceLock::new();
        let dense = self.dense_values(&light);
        self.values.extend(dense);
        self.lights.push(light);
        if let Some(values) = &mut self.adaptive {
            values.add_light(&self.parts.near, &light);
        }
        if self.has_file {
            self.saved_lights.push(SavedLight::Absent);
        }
        self.make_first(number);
        Ok(id)
    }

    /// Moves a light, or replaces it by one of another kind. It keeps its number.
    ///
    /// What was known of it is dropped, and everything that is known of the others stays, as by
    /// [`ShadowIndex::add_light`]. A light that is moved to where it is keeps what is known.
    ///
    /// # Errors
    /// There is no such light, or the new one is not finite, too large or a zero direction.
    pub fn move_light(&mut self, light: LightId, to: LightShape) -> Result<(), LightError> {
        let number = self.check_number(light)?;
        check_light(light, &to)?;
        let light = number;
        if self.lights[light] == to {
            return Ok(());
        }
        if let Some(glass) = self.built_glass_mut() {
            glass.move_light(LightId::from_index(light), to)?;
        }
        self.all_lights = OnceLock::new();
        if let Some(dense) = self.dense_values(&to) {
            self.values[light] = dense;
        }
        self.lights[light] = to;
        if let Some(values) = &mut self.adaptive {
            values.replace_light(&self.parts.near, light, &to);
        }
        if let Some(saved) = self.saved_lights.get_mut(light) {
            *saved = SavedLight::Absent;
        }
        self.make_first(light);
        Ok(())
    }

    /// Removes a light and returns it. The numbers of the lights behind it go down by one, as in a [`Vec`].
    ///
    /// What was known of it is dropped and its memory is free for the others. To keep all numbers, leave the light in
    /// its place: one that nobody asks about costs nothing.
    ///
    /// # Errors
    /// There is no such light.
    pub fn remove_light(&mut self, light: LightId) -> Result<LightShape, LightError> {
        let light = self.check_number(light)?;
        if let Some(glass) = self.built_glass_mut() {
            glass.remove_light(LightId::from_index(light))?;
        }
        self.all_lights = OnceLock::new();
        if light < self.values.len() {
            self.values.remove(light);
        }
        if light < self.saved_lights.len() {
            self.saved_lights.remove(light);
        }
        if let Some(values) = &mut self.adaptive {
            values.remove_light(light);
        }
        Ok(self.lights.remove(light))
    }

    /// Returns the light's place among the lights.
    fn check_number(&self, light: LightId) -> Result<usize, LightError> {
        let light_count = self.lights.len();
        match light.index() < light_count {
            true => Ok(light.index()),
            false => Err(LightError::Unknown { light, light_count }),
        }
    }

    /// Checks that so many lights are within the limit that was set. What lights know of other methods keeps within
    /// what was left, however many they are.
    fn check_memory(&self, light_count: usize) -> Result<(), BuildError> {
        let Some(limit) = self
            .memory_limit
            .filter(|_| self.method == Method::Voxel1990)
        else {
            return Ok(());
        };
        let predicted = Asked {
            occluders: &self.occluders,
            light_count,
            resolution: GridResolution::Fixed(self.layout.resolution),
            has_grid: needs_grid(self.method, self.rays),
            method: self.method,
            has_tree: needs_bvh(self.method, self.rays) && self.tree.is_some(),
            refinement: Refinement::default(),
            query_count: None,
        }
        .predict()?;
        match predicted.needed() <= limit {
            true => Ok(()),
            false => Err(BuildError::Memory { predicted, limit }),
        }
    }

    /// Returns a light's values of the uniform grid, for the method that has them.
    fn dense_values(&self, light: &LightShape) -> Option<DenseValues> {
        let grid: Option<&Grid> = self.grid.as_ref();
        let grid = grid.filter(|_| self.method == Method::Voxel1990)?;
        Some(mark(&self.parts.near, grid, light))
    }

    /// Computes what is wanted of a light before its first query.
    fn make_first(&mut self, light: usize) {
        let near = &*self.parts.near;
        let Some(values) = &mut self.adaptive else {
            return;
        };
        if !values.is_made_first() {
            return;
        }
        let lights = light..light + 1;
        let own = OnceCell::new();
        let tree = || match &self.tree {
            Some(tree) => tree.get(near),
            None => own.get_or_init(|| Tree::now(near)).get(near),
        };
        values.make_first(near, tree, lights);
    }
}
