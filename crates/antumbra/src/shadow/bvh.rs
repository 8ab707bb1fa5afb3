//! A ray through the tree to the light.

use antumbra_geometry::{Occluders, Segment};

use crate::bvh::Bvh;
use crate::{Answer, Counters, Decided};

/// Answers by a walk through the tree.
pub(crate) fn by_bvh(
    occluders: &Occluders,
    bvh: &Bvh,
    segment: &Segment,
    counters: &mut Counters,
) -> Answer {
    let is_shadowed =
        occluders.own_rule_blocks(segment) || bvh.any_hit(occluders, segment, counters);
    Answer::new(is_shadowed, Decided::Ray)
}
