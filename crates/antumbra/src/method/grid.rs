//! `VoxelTraversalShadow` of Paper 6: a plain walk to the light.

use antumbra_geometry::{Occluders, Segment};

use crate::accel::grid::Grid;
use crate::{Answer, Counters, Decided};

/// Answers by a walk through the grid.
pub(crate) fn by_grid(
    occluders: &Occluders,
    grid: &Grid,
    segment: &Segment,
    counters: &mut Counters,
) -> Answer {
    let is_shadowed =
        occluders.own_rule_blocks(segment) || grid.any_hit(occluders, segment, counters);
    Answer::new(is_shadowed, Decided::Ray)
}
