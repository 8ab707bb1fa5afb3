//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{LightShape, Occluders, Start};

use crate::bvh::Bvh;
use crate::occlusion::{AdaptiveValues, Known};
use crate::{Answer, Counters, Decided};

/// Answers by the value or the list of the start's voxel where there is one, by a ray where not.
#[inline]
pub(crate) fn by_voxel(
    occluders: &Occluders,
    bvh: &Bvh,
    values: &AdaptiveValues,
    start: &Start,
    (number, light): (usize, &LightShape),
    counters: &mut Counters,
) -> Answer {
    // Values speak of starts that no own rule shadows.
    if start.surface.is_some_and(|own| occluders.has_own_rule(own))
        && occluders.own_rule_blocks(&occluders.segment(start, light))
    {
        return Answer::new(true, Decided::FirstPass);
    }
    match values.get(occluders, start, number) {
        Known::Value(is_shadowed) => Answer::new(is_shadowed, Decided::FirstPass),
        Known::List(is_shadowed) => Answer::new(is_shadowed, Decided::BlockerList),
        Known::Nothing => {
            let is_shadowed = bvh.any_hit(occluders, start, light, counters);
            Answer::new(is_shadowed, Decided::Ray)
        }
    }
}
