//! How antumbra opens and writes files: every crate of it that touches files does so through this one.
//!
//! In: paths. Out: regular files to read, and files that appear whole or not at all. Invariants: nothing waits for
//! a pipe that nobody writes; a crash leaves the file before; no device, pipe or link is ever replaced by a file;
//! what is left of a killed process never stands in the way of the next.
//!
//! | module | what |
//! |---|---|
//! | `identity` | whether two paths lead to one file |
//! | `open` | opening what is to be read |
//! | `own` | whether a file was written by this project |
//! | `place` | what stands where a file is to be written |
//! | `write` | writing |

mod identity;
mod open;
mod own;
mod place;
mod write;

pub use identity::Identity;
pub use open::{NotRegular, open};
pub use own::is_own;
pub use place::{Place, Refusal};
pub use write::{Writing, abandon, write, write_bytes};
