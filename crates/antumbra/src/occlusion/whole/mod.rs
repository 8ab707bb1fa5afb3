//! Values for whole lights: what a cell's part of one surface knows of all samples of a light with size at once (Paper 6,
//! 9.3; README.md here).
//!
//! In: starts and a light's shape. Out: that all of the light reaches a start, that nothing of it does, or the leaves of the
//! tree that hold what may block. Invariant: what is known holds for every start of the key in its inflated cell and for every
//! point of the light, by the rule of EXACTNESS.md; it is a function of the scene, the light, the cell and the surface.
//! What was looked at depends on what was asked, and changes no answer. All bytes are taken from the index's room.
//! Absent here: samples, walks.

mod deciding;
mod hull;
mod ledger;
mod lights;
mod maker;
mod making;
mod shaft;
mod table;
#[cfg(test)]
mod tests;

pub(crate) use ledger::Asked as AskedOfWhole;
pub(crate) use lights::{Corners, Told, WHOLE_BLOCK, WholeLights, WholeSide, WholeView};
