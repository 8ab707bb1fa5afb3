//! From a scene to surfaces that block light: objects become numbered surfaces.
//!
//! In: a [`Scene`](crate::model::Scene). Out: [`Gathered`]: its surfaces, and which object each came from. Invariant: elements are numbered
//! in the order of the file: each polygon, each face of a mesh, each sphere, cone and disk is one element, unless its
//! alpha says that it is nowhere there. A surface blocks as its material's
//! [`shadow_kind`](crate::model::Material::shadow_kind) says.
//!
//! | module | what |
//! |---|---|
//! | `masks` | masks become holes |
//! | `filters` | what transmits or blends colors light |
//! | `emissive` | surfaces that emit become lights with size |
//! | `memory` | what all this takes |

mod emissive;
mod error;
mod faces;
mod filters;
mod gathered;
mod masks;
mod memory;

pub use emissive::emissive_lights;
pub use error::GatherError;
pub use faces::face_of;
pub use gathered::{Gathered, Place, light_shapes};
pub use memory::{scene_bytes, surface_bytes};
