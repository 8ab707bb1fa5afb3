//! A ray through the tree to the light.

use antumbra_geometry::{LightShape, Occluders, ReceiverPoint};

use crate::accel::bvh::Bvh;
use crate::{Answer, Counters, Decided};

/// Answers by a walk through the tree.
#[inline]
pub(crate) fn by_bvh(
    occluders: &Occluders,
    bvh: &Bvh,
    start: &ReceiverPoint,
    light: &LightShape,
    counters: &mut Counters,
) -> Answer {
    let is_self_shadowed = || occluders.own_rule_blocks(&occluders.segment(start, light));
    let is_shadowed = (start.surface.is_some_and(|own| occluders.has_own_rule(own))
        && is_self_shadowed())
        || bvh.any_hit(occluders, start, light, counters);
    Answer::new(is_shadowed, Decided::Ray)
}

/// Answers many starts, in an order in which neighbours are near each other if the caller knows one.
pub(crate) fn many_by_bvh(
    occluders: &Occluders,
    bvh: &Bvh,
    starts: &[ReceiverPoint],
    light: &LightShape,
    is_shadowed: &mut [bool],
    counters: &mut Counters,
) {
    for (start, is_shadowed) in starts.iter().zip(&mut *is_shadowed) {
        *is_shadowed = start.surface.is_some_and(|own| occluders.has_own_rule(own))
            && occluders.own_rule_blocks(&occluders.segment(start, light));
    }
    bvh.any_hits(occluders, starts, light, is_shadowed, counters);
}
