//! Writers. In: a scene. Out: a file of a format, if the format can say what the scene holds.

mod nff;
mod number;

pub use nff::{WriteError, write_nff};
pub use number::Precision;
