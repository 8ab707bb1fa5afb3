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
    let own_rule = occluders.own_rule(start);
    let is_shadowed = own_rule.is_some_and(|rule| rule.hides(light))
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
        let own_rule = occluders.own_rule(start);
        *is_shadowed = own_rule.is_some_and(|rule| rule.hides(light));
    }
    bvh.any_hits(occluders, starts, light, is_shadowed, counters);
}
