//! What finds surfaces along a ray: the tree, the grid, and where surfaces are in them.
//!
//! In: surfaces. Out: hits, and whether a segment is blocked. Absent here: lights' values, and what is asked why.

pub(crate) mod bvh;
pub(crate) mod frame;
pub(crate) mod grid;
pub(crate) mod parts;
pub(crate) mod sweep;
