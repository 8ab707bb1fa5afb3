//! What people use instead of antumbra, behind one trait, for measurements.
//!
//! In: a [`Batch`] of shadow queries to one light. Out: one bit a query. Everything that is not
//! answering (conversion to `f32`, packing, building) happens before, in [`ShadowMethod::load`] and
//! in constructors, so that whoever times [`LoadedBatch::answer`] times the method alone.
//!
//! Only [`IndexMethod`], antumbra itself, is exact. A rival's different answer is a difference to
//! be judged by `ShadowIndex::shadow_by_reference`, neither an error of ours nor noise.

pub mod embree;
mod method;
mod own;

pub use method::{Batch, LoadedBatch, ShadowMethod};
pub use own::{CountedBatch, IndexMethod};
