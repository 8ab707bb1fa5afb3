//! What a look-up works with.

use antumbra_geometry::Occluders;

use super::adaptive::AdaptiveValues;
use super::bricks::Store;
use super::packed::Packed;
use super::tables::Tables;

/// Where values are.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    /// Values are not asked.
    Nothing,
    Growing(&'a Store),
    Packed(&'a Packed),
}

/// What is needed to look up a start.
pub(super) struct Lookup<'a, S> {
    pub(super) simd: S,
    pub(super) values: &'a AdaptiveValues,
    /// Of the light.
    pub(super) number: usize,
    pub(super) tables: Tables<'a>,
    pub(super) source: Source<'a>,
    pub(super) occluders: &'a Occluders,
}
