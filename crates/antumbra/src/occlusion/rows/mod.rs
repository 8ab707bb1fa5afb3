//! Rows: what a cell's part of one triangle, or a cell of space, knows of all lights at once (Paper 6; README.md here).
//!
//! In: starts. Out: for each the row of its cell and surface, if there is one: a bit a light for *every start is
//! lit*, one for *every start is in shadow*, neither for what is not known. Invariant: what a row says holds for every
//! start of its surface in its inflated cell, by the rule of EXACTNESS.md. It is a function of the scene, the light, the
//! cell and the surface; which rows there are depends on what was asked, and changes no answer. All bytes are taken from
//! the room of the index. Absent here: rays; who is asked where a row does not know.

mod all;
mod groups;
mod ledger;
mod light_rows;
mod making;
mod paying;
mod table;

pub(crate) use all::AllLights;
pub(crate) use ledger::Asked;
pub(crate) use light_rows::LightRows;
pub(crate) use table::{Place, ROW_BLOCK, Row, RowTable};
