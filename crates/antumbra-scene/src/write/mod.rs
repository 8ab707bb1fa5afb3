//! Writers. In: a scene. Out: a file of a format, if the format can say what the scene holds, and
//! notes on what it cannot. Invariant: nothing that blocks light is changed in silence; curved
//! shapes are refused where a format has none, never tessellated.

mod error;
mod file;
mod glb;
mod mesh;
mod nff;
mod number;
mod obj;
mod ply;

pub use error::WriteError;
pub use file::{files_of, write_file};
pub use glb::write_glb;
pub use mesh::CURVED;
pub use nff::write_nff;
pub use number::Precision;
pub use obj::{LIBRARY_MARK, write_obj};
pub use ply::write_ply;
