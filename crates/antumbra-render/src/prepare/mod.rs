//! Scene meets accelerator: the only place.
//!
//! In: a [`Scene`]. Out: [`Gathered`] (its surfaces, and which object each came from), then
//! [`Prepared`] (with the shadow index). Invariant: elements are numbered in the order of the
//! file: each polygon, each face of a mesh, each sphere, cone and disk is one element, unless its
//! alpha says that it is nowhere there. A surface blocks as its material's
//! [`shadow_kind`](antumbra_scene::model::Material::shadow_kind) says.
//!
//! | module | what |
//! |---|---|
//! | `gathered` | objects become numbered surfaces |
//! | `masks` | masks become holes |
//! | `emissive` | surfaces that emit become lights with size |
//! | `surface` | what a hit looks like: normals, texture, coverage |
//! | `memory` | what all this takes |
//! | `stand_in` | another method in the place of the index, for comparisons |

mod emissive;
mod gathered;
mod masks;
mod memory;
mod stand_in;
mod surface;

use std::path::Path;

use antumbra::{
    Answer, BuildError, Counters, GridResolution, Method, QueryError, QuickCheck, RayMethod,
    Refinement, ShadowIndex,
};
use antumbra_geometry::{OccludersError, Start};
use antumbra_scene::model::Scene;

pub use emissive::emissive_lights;
pub use gathered::{Gathered, Place};
pub use memory::{scene_bytes, surface_bytes};
pub use stand_in::StandIn;
pub use surface::Look;

/// Why a scene cannot be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// An object's numbers are out of range.
    #[error("object {object}{}: {source}", named(name))]
    BadObject {
        /// Index into [`Scene::objects`].
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// What is wrong.
        source: OccludersError,
    },
    /// An object names a material, a texture, a position or a face end that is not there.
    #[error("object {object}{}: {what} is out of range", named(name))]
    BadIndex {
        /// Index into [`Scene::objects`].
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// Which index it is.
        what: &'static str,
    },
    /// The index refuses the lights or a setting, or needs too much memory.
    #[error(transparent)]
    Build(#[from] BuildError),
}

fn named(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" ({name})")
    }
}

/// How a scene is accelerated.
#[derive(Clone, Copy, Debug)]
pub struct PrepareOptions {
    /// How shadow queries are answered.
    pub method: Method,
    /// What finds nearest hits.
    pub rays: RayMethod,
    /// How fine the grid is.
    pub grid: GridResolution,
    /// What the quick check of Paper 7.3 does.
    pub quick_check: QuickCheck,
    /// How far the values of [`Method::Voxel`] are refined.
    pub refinement: Refinement,
    /// Most bytes that grid, tree and values may take.
    pub memory_limit: u64,
}

impl Default for PrepareOptions {
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

/// A scene ready to be looked at: its data, its surfaces and its shadow index.
#[derive(Debug)]
pub struct Prepared {
    scene: Scene,
    gathered: Gathered,
    index: ShadowIndex,
    stand_in: Option<Box<dyn StandIn>>,
}

impl Prepared {
    /// Gathers the surfaces of `scene` and builds the index, on all threads of the current rayon
    /// pool. The scene's lights are fixed from here on; cameras are not part of it.
    ///
    /// # Errors
    /// The scene or a setting is out of range, or the memory limit is too small; the need is
    /// predicted and compared before any of it is taken.
    pub fn new(scene: Scene, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let gathered = Gathered::of(&scene)?;
        Self::of_gathered(scene, gathered, options)
    }

    /// Builds the index over surfaces that were gathered from this very `scene`, as
    /// [`Prepared::new`] does.
    ///
    /// # Errors
    /// As [`Prepared::new`].
    pub fn of_gathered(
        scene: Scene,
        gathered: Gathered,
        options: &PrepareOptions,
    ) -> Result<Self, PrepareError> {
        Self::of_gathered_from(scene, gathered, options, None)
    }

    /// Builds the index as [`Prepared::of_gathered`] does, with the values that a file has of the lights
    /// ([`Gathered::index_from`]).
    ///
    /// # Errors
    /// As [`Prepared::new`], or the file is refused.
    pub fn of_gathered_from(
        scene: Scene,
        gathered: Gathered,
        options: &PrepareOptions,
        occlusion: Option<&Path>,
    ) -> Result<Self, PrepareError> {
        let index = gathered.index_from(&scene.lights, options, occlusion)?;
        Ok(Self {
            scene,
            gathered,
            index,
            stand_in: None,
        })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the surfaces and where they come from.
    pub fn gathered(&self) -> &Gathered {
        &self.gathered
    }

    /// Returns the shadow index; its lights have the order of [`Scene::lights`].
    pub fn index(&self) -> &ShadowIndex {
        &self.index
    }

    /// Lets another method, which was built for this index, answer shadow queries in its place.
    #[must_use]
    pub fn with_stand_in(mut self, stand_in: Box<dyn StandIn>) -> Self {
        self.stand_in = Some(stand_in);
        self
    }

    /// Answers a shadow query by the index or its stand-in. Counts under `counters`; `candidates` grows by what
    /// a stand-in found listed where it looked.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow(
        &self,
        start: &Start,
        light: usize,
        counters: &mut Counters,
        candidates: &mut u64,
    ) -> Result<Answer, QueryError> {
        match &self.stand_in {
            Some(other) => other.shadow(&self.index, start, light, counters, candidates),
            None => self.index.shadow(start, light, counters),
        }
    }

    /// Returns the bytes kept for shadow queries, mean over the lights: of a stand-in all that it keeps; of
    /// an index values, lists and tables. Surfaces, grid and tree are left out.
    pub fn bytes_per_light(&self) -> f64 {
        let lights = 0..self.index.lights().len();
        let bytes = match &self.stand_in {
            Some(other) => lights.clone().map(|light| other.bytes(light)).sum(),
            None => self.index.occlusion_bytes() + self.index.table_bytes(),
        };
        bytes as f64 / lights.len().max(1) as f64
    }
}
