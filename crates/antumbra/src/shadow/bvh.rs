//! A ray through the tree to the light.

use antumbra_geometry::{LightShape, Occluders, Start};

use crate::bvh::Bvh;
use crate::{Answer, Counters, Decided};

/// Answers by a walk through the tree.
#[inline]
pub(crate) fn by_bvh(
    occluders: &Occluders,
    bvh: &Bvh,
    start: &Start,
    light: &LightShape,
    counters: &mut Counters,
) -> Answer {
    let is_self_shadowed = || occluders.own_rule_blocks(&occluders.segment(start, light));
    let is_shadowed = (start.surface.is_some_and(|own| occluders.has_own_rule(own))
        && is_self_shadowed())
        || bvh.any_hit(occluders, start, light, counters);
    Answer::new(is_shadowed, Decided::Ray)
}
