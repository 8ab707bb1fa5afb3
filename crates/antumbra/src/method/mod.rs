//! Shadow queries: one method a file, all with the same answers.
//!
//! In: a prepared segment. Out: the bit, and how it was decided. Invariant: every method returns
//! the reference's bit (EXACTNESS.md).

mod auto;
mod bvh;
mod grid;
mod naive;
mod order;
mod voxel;
mod voxel_1990;

pub(crate) use bvh::{by_bvh, many_by_bvh};
pub(crate) use grid::by_grid;
pub(crate) use naive::by_reference;
pub(crate) use voxel::{ByVoxel, Rays};
pub(crate) use voxel_1990::{by_voxel_1990, first_pass, known_along, known_between};

use crate::{Answer, Decided, Shadow};

impl Answer {
    pub(crate) fn new(is_shadowed: bool, decided: Decided) -> Self {
        Self {
            shadow: if is_shadowed {
                Shadow::Shadowed
            } else {
                Shadow::Lit
            },
            decided,
        }
    }
}
