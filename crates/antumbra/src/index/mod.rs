//! An index over surfaces and lights: built, changed, saved, and what it says of itself.
//!
//! In: surfaces, lights, settings. Out: a [`ShadowIndex`], which `query` asks. Invariant: answers do not depend on the
//! settings.

mod builder;
mod glass;
mod lights;
mod memory;
mod needs;
mod options;
mod predict;
mod prediction;
mod refused;
#[cfg(feature = "file")]
mod save;
mod shadow_index;
mod volume;

pub use builder::Builder;
pub use lights::LightError;
pub use options::IndexOptions;
pub use prediction::Prediction;
pub use refused::BuildError;
pub use shadow_index::ShadowIndex;
pub use volume::Volume;
