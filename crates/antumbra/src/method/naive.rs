//! The reference: every surface is tested.

use antumbra_geometry::{Occluders, Segment};

use crate::accel::grid::any_hit_by_reference;
use crate::{Answer, Counters, Decided};

/// Answers by testing every surface.
pub(crate) fn by_reference(
    occluders: &Occluders,
    segment: &Segment,
    counters: &mut Counters,
) -> Answer {
    antumbra_task::check();
    counters.intersections += occluders.surface_count() as u64;
    Answer::new(any_hit_by_reference(occluders, segment), Decided::Ray)
}
