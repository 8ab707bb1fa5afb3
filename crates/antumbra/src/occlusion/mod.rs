//! Occlusion values: what a voxel knows about a light (Paper 6).
//!
//! In: the grid, the elements' umbrae. Out: two bits per voxel and light. Invariants, for every
//! start in the voxel inflated by the grid's margin: see [`value::Occlusion`]. A value depends on
//! the scene, the light's shape and the voxel only. Absent here: queries, rays, cameras, the power
//! of lights.

mod adaptive;
mod arena;
mod balls;
mod between;
mod bricks;
mod budget;
mod by_map;
mod candidates;
mod classify;
mod footprint;
mod forms;
mod found;
mod lattice;
mod links;
mod looking;
mod lookup;
mod many;
mod map;
mod mark;
mod misfit;
mod packed;
mod pairs;
mod planes;
mod quick_check;
mod receivers;
mod refine;
mod room;
mod rows;
mod store;
mod stream;
mod sync;
mod tables;
#[cfg(test)]
pub(crate) mod testing;
mod told;
mod value;
mod vectors;
mod views;
mod volume;
mod when;
mod whole;

pub(crate) use adaptive::{
    AdaptiveValues, KeptValues, Knowledge, Known, Lists, Making, PackedLight, Scene,
};
pub(crate) use between::Between;
pub(crate) use bricks::Store;
pub(crate) use budget::Account;
pub(crate) use lookup::{BLOCK, Found};
pub(crate) use many::MANY;
pub(crate) use map::{Map, Spent};
pub(crate) use mark::{mark, mark_bytes};
pub(crate) use packed::RUNS;
pub use quick_check::QuickCheckVerdict;
pub(crate) use quick_check::quick_check;
pub(crate) use refine::Depth;
pub(crate) use rows::{AllLights, Asked, LightRows, Place, ROW_BLOCK, Row, RowTable};
pub(crate) use store::DenseValues;
pub(crate) use stream::Misfit;
pub(crate) use value::Occlusion;
pub(crate) use volume::{Cells, LIT, MIXED, SHADOWED};
pub use when::Refine;
pub(crate) use whole::{
    AskedOfWhole, Corners, Told, WHOLE_BLOCK, WholeLights, WholeSide, WholeView,
};
