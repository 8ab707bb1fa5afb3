//! Scene meets accelerator: the only place.
//!
//! In: a [`Scene`] and its surfaces ([`Gathered`]). Out: [`Prepared`], with the shadow index.
//!
//! | module | what |
//! |---|---|
//! | `surface` | what a hit looks like: normals, texture, coverage, relief |
//! | `relief` | how high and how steep a relief is that is no geometry |
//! | `stand_in` | another method in the place of the index, for comparisons |

mod look;
mod relief;
mod stand_in;
mod surface;

use std::path::Path;

use antumbra::{
    Answer, BuildError, Counters, IndexOptions, LightId, QueryError, Shadow, ShadowIndex,
};
use antumbra_geometry::{DVec3, ReceiverPoint};
use antumbra_scene::gather::{GatherError, Gathered, light_shapes};
use antumbra_scene::model::Scene;

pub use look::Look;
pub use relief::Relief;
pub use stand_in::StandIn;

/// Why a scene cannot be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// The surfaces of the scene cannot be gathered.
    #[error(transparent)]
    Gather(#[from] GatherError),
    /// The index refuses the lights or a setting, or needs too much memory.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// A scene ready to be looked at: its data, its surfaces and its shadow index.
#[derive(Debug)]
pub struct Prepared {
    scene: Scene,
    gathered: Gathered,
    index: ShadowIndex,
    stand_in: Option<Box<dyn StandIn>>,
    is_one_by_one: bool,
}

impl Prepared {
    /// Gathers the surfaces of `scene` and builds the index, on all threads of the current rayon
    /// pool. The scene's lights are fixed from here on; cameras are not part of it.
    ///
    /// # Errors
    /// The scene or a setting is out of range, or the memory limit is too small; the need is
    /// predicted and compared before any of it is taken.
    pub fn new(scene: Scene, options: &IndexOptions) -> Result<Self, PrepareError> {
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
        options: &IndexOptions,
    ) -> Result<Self, PrepareError> {
        Self::of_gathered_from(scene, gathered, options, None)
    }

    /// Builds the index as [`Prepared::of_gathered`] does, with the values that a file has of the lights
    /// ([`IndexOptions::build_from`]).
    ///
    /// # Errors
    /// As [`Prepared::new`], or the file is refused.
    pub fn of_gathered_from(
        scene: Scene,
        gathered: Gathered,
        options: &IndexOptions,
        occlusion: Option<&Path>,
    ) -> Result<Self, PrepareError> {
        let lights = light_shapes(&scene.lights);
        let index = options.build_from(gathered.occluders(), lights, occlusion)?;
        Ok(Self {
            scene,
            gathered,
            index,
            stand_in: None,
            is_one_by_one: false,
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

    /// Has lights asked one by one, however many there are: where what is known of each is to be saved, and for
    /// comparisons. Pictures are the same.
    #[must_use]
    pub fn with_lights_one_by_one(mut self) -> Self {
        self.is_one_by_one = true;
        self
    }

    /// Returns whether all lights without size of a point are asked about at once
    /// ([`ShadowIndex::asks_all_lights_at_once`]).
    pub fn asks_lights_at_once(&self) -> bool {
        self.stand_in.is_none() && !self.is_one_by_one && self.index.asks_all_lights_at_once()
    }

    /// Answers a shadow query by the index or its stand-in. Counts under `counters`; `candidates` grows by what
    /// a stand-in found listed where it looked.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow(
        &self,
        start: &ReceiverPoint,
        light: usize,
        counters: &mut Counters,
        candidates: &mut u64,
    ) -> Result<Answer, QueryError> {
        match &self.stand_in {
            Some(other) => other.shadow(&self.index, start, light, counters, candidates),
            None => self
                .index
                .shadow(start, LightId::from_index(light), counters),
        }
    }

    /// Returns what the index knows of all points between two, before any is asked ([`ShadowIndex::known_between`]); nothing
    /// where a stand-in answers.
    ///
    /// # Errors
    /// As [`ShadowIndex::known_between`].
    pub fn known_between(
        &self,
        [from, to]: [DVec3; 2],
        light: usize,
    ) -> Result<Option<Shadow>, QueryError> {
        match &self.stand_in {
            Some(_) => Ok(None),
            None => self
                .index
                .known_between(from, to, LightId::from_index(light)),
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
