//! `VoxelOcclusionShadow` of Paper 6: first pass, intermediate test, walk.

use antumbra_geometry::{Occluders, Segment};

use crate::grid::{Grid, Mailbox, Walk};
use crate::occlusion::DenseValues;
use crate::{Answer, Counters, Decided};

/// Answers by occlusion values where they know, by a walk where they do not.
pub(crate) fn by_voxel_1990(
    occluders: &Occluders,
    grid: &Grid,
    values: &DenseValues,
    segment: &Segment,
    counters: &mut Counters,
) -> Answer {
    // Null-one speaks of the side that faces the light; the other side of a curved shape is dark by
    // its own rule, which needs no voxel.
    if occluders.own_rule_blocks(segment) {
        return Answer::new(true, Decided::FirstPass);
    }
    if !grid.can_walk(segment) {
        return super::by_grid(occluders, grid, segment, counters);
    }

    // First pass: the value of the start's voxel.
    if let Some(voxel) = grid.layout.voxel_holding(segment.origin()) {
        let voxel = grid.layout.index(voxel);
        let value = values.get(voxel);
        let surfaces = grid.surfaces(voxel);
        let known = match segment.start().surface {
            None => value.of_any_point(!surfaces.is_empty()),
            Some(own) => value.of_surface_point().filter(|_| {
                // A start that is not on its surface is not what the values speak of.
                let own = occluders.element_of(own);
                surfaces
                    .iter()
                    .any(|&surface| occluders.element_of(surface) == own)
            }),
        };
        if let Some(is_shadowed) = known {
            return Answer::new(is_shadowed, Decided::FirstPass);
        }
    }

    // The walk, with an intermediate test in every voxel but the first.
    let mut mailbox = Mailbox::new();
    for visit in Walk::new(&grid.layout, segment) {
        counters.steps += 1;
        if !visit.is_first {
            let holds_surface = !grid.surfaces(visit.voxel).is_empty();
            if let Some(is_shadowed) = values.get(visit.voxel).of_any_point(holds_surface) {
                return Answer::new(is_shadowed, Decided::Intermediate);
            }
        }
        if grid.is_blocked_in(occluders, visit.voxel, segment, &mut mailbox, counters) {
            return Answer::new(true, Decided::Ray);
        }
    }
    Answer::new(false, Decided::Ray)
}
