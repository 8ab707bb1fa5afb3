//! What people use instead of antumbra, behind one trait, for measurements.
//!
//! In: a [`Batch`] of shadow queries to one light. Out: one bit a query. Everything that is not
//! answering (conversion to `f32`, packing, building) happens before, in [`ShadowMethod::load`] and
//! in constructors, so that whoever times [`LoadedBatch::answer`] times the method alone.
//!
//! Exact are antumbra itself ([`IndexMethod`]) and the [`rival`]s of the paper's time but for
//! `shadow-map`, which can also be asked one query at a time. A different answer of any other is a
//! difference to be judged by `ShadowIndex::shadow_by_reference`, neither an error of ours nor noise.

pub mod embree;
mod method;
mod own;
pub mod rival;
mod targets;

pub use method::{Batch, LoadedBatch, ShadowMethod, TargetBatch};
pub use own::{CountedBatch, IndexMethod};
pub use rival::{Rival, RivalError, RivalKind, RivalOptions, Work};
pub use targets::{LoadedSamples, LoadedTargets, TargetWay};
