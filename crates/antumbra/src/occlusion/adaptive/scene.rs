//! What is worked with while values are computed, and what it is said to cost.

use antumbra_geometry::Occluders;

use crate::accel::bvh::Bvh;

/// What is worked with while values are made.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
}

/// What a first look at a cell at the root costs, as a power of two of units.
pub(super) const LOOK_PRICE: u32 = 9;

/// A unit of cost in links, in nanoseconds, as a power of two.
pub(super) const UNIT: u32 = 4;

/// A cell is worth so many times what it has cost: more queries will come, and the account of all
/// cells bounds what is spent in vain.
pub(super) const HASTE: u64 = 4;
