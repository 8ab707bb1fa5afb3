//! Scenes: the model, the readers, the writer, the generators, and what of a scene blocks light ([`gather`]).
//!
//! In: scene files (NFF, OBJ with MTL, glTF) or a generator's name and size. Out: a
//! [`model::Scene`], plain validated data, with [`Warning`]s for whatever a file says that is
//! not used, or a [`ReadError`] that names file, line, what was expected and what to do.
//! Invariant: nothing a file can contain makes a reader panic, hang, or take memory beyond a
//! small multiple of the file. Absent here: grids, occlusion, pictures.

mod bounds;
mod bump;
pub mod defaults;
mod error;
pub mod gather;
pub mod generate;
mod instance;
mod mesh;
pub mod model;
mod opacity;
pub mod read;
mod room;
mod shadow_kind;
mod shared;
mod tessellate;
mod texture;
mod warning;
pub mod write;

pub use error::{Place, ReadError, ReadErrorKind};
pub use read::{Lights, Loaded, ReadOptions, UpAxis, read_file, read_lights};
pub use tessellate::TESSELLATION;
pub use warning::Warning;
