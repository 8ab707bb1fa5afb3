//! Surfaces without a closed form (Paper 9.1): bicubic patches and implicit surfaces, as they are, not polygonised.
//!
//! In: control points or a field. Out: whether a segment meets the surface, where, and what a start on it is. Invariants:
//! the answer is that of EXACTNESS.md ("Patches", "Implicit surfaces"), whatever a search leaves out; a search leaves
//! out only what surely changes nothing.

mod bezier;
mod field;
mod implicit;
mod part;
mod value;

pub use bezier::{BezierPatch, MAX_PATCH_LEVEL};
pub use field::{Ball, Field, MAX_DEGREE, MAX_TERMS, Term};
pub use implicit::{Implicit, ImplicitError};

pub(crate) use implicit::Level;
pub(crate) use part::{Half, PatchPart, Piece, parts_of};
