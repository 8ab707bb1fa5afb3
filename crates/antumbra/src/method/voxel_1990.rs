//! `VoxelOcclusionShadow` of Paper 6: first pass, intermediate test, walk.

use antumbra_geometry::{Bounds, KnownStretch, Occluders, Segment};

use crate::accel::grid::{Block, Grid, Mailbox, Walk};
use crate::occlusion::{Between, DenseValues, Occlusion};
use crate::{Answer, Counters, Decided};

/// Answers by occlusion values where they know, by a walk where they do not.
pub(crate) fn by_voxel_1990(
    occluders: &Occluders,
    grid: &Grid,
    values: &DenseValues,
    segment: &Segment,
    counters: &mut Counters,
) -> Answer {
    if let Some(is_shadowed) = first_pass(occluders, grid, values, segment) {
        return Answer::new(is_shadowed, Decided::FirstPass);
    }
    if !may_believe(occluders, grid, segment) {
        return super::by_grid(occluders, grid, segment, counters);
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

/// Returns whether values speak of a start. What covers a voxel may be the start's own solid, which covers no start
/// that lies on it with its side to the light; a start off a curved surface, on either side, is none of those.
fn may_believe(occluders: &Occluders, grid: &Grid, segment: &Segment) -> bool {
    grid.can_walk(segment)
        && segment.start().surface.is_none_or(|own| {
            let reach = 0.5 * grid.layout.margin;
            occluders.is_surely_near_curved(own, segment.origin(), reach)
        })
}

/// Returns what the own rule and the value of the start's voxel know.
pub(crate) fn first_pass(
    occluders: &Occluders,
    grid: &Grid,
    values: &DenseValues,
    segment: &Segment,
) -> Option<bool> {
    // Null-one speaks of the side that faces the light; the other side of a curved shape is dark by
    // its own rule, which needs no voxel.
    if occluders.own_rule_blocks(segment) {
        return Some(true);
    }
    if !may_believe(occluders, grid, segment) {
        return None;
    }
    let voxel = grid.layout.voxel_holding(segment.origin())?;
    let voxel = grid.layout.index(voxel);
    let value = values.get(voxel);
    let surfaces = grid.surfaces(voxel);
    match segment.start().surface {
        None => value.of_any_point(!surfaces.is_empty()),
        Some(own) => value.of_surface_point().filter(|_| {
            // A start that is not on its surface is not what the values speak of.
            let own = occluders.element_of(own);
            surfaces
                .iter()
                .any(|&surface| occluders.element_of(surface) == own)
        }),
    }
}

/// Returns what values know of the points of a segment that was walked as a ray from its first point to its last, and how many
/// voxels that took: neighbouring voxels with one value are one stretch (Paper 9.4).
pub(crate) fn known_along(
    grid: &Grid,
    values: &DenseValues,
    segment: &Segment,
) -> (Vec<KnownStretch>, u64) {
    let mut stretches: Vec<KnownStretch> = Vec::new();
    let mut voxels = 0;
    // Values hold a margin beyond their voxels; half of it is far more than where voxels begin and end is rounded by.
    let length = segment.direction().abs().max_element();
    let room = 0.5 * grid.layout.margin / length + KnownStretch::ROOM;
    if !grid.can_walk(segment) || !room.is_finite() {
        return (stretches, voxels);
    }
    let mut entered = None;
    for visit in Walk::new(&grid.layout, segment) {
        voxels += 1;
        // Where a ray from outside enters its first voxel nobody tells.
        let from = if visit.is_first { Some(0.0) } else { entered };
        let to = visit.leaves_at.min(1.0);
        entered = Some(visit.leaves_at);
        let holds_surface = !grid.surfaces(visit.voxel).is_empty();
        let value = values.get(visit.voxel).of_any_point(holds_surface);
        let (Some(from), Some(is_dark)) = (from, value) else {
            continue;
        };
        match stretches.last_mut() {
            Some(last) if last.is_dark == is_dark && last.shares[1] == from => last.shares[1] = to,
            _ => stretches.push(KnownStretch {
                shares: [from, to],
                is_dark,
            }),
        }
    }
    // Both ends of the segment are its own; others keep off where voxels that are not known begin.
    for KnownStretch { shares, .. } in &mut stretches {
        if shares[0] > 0.0 {
            shares[0] += room;
        }
        if shares[1] < 1.0 {
            shares[1] -= room;
        }
    }
    stretches.retain(|stretch| stretch.shares[0] < stretch.shares[1]);
    (stretches, voxels)
}

/// Returns whether all points between two are in shadow, or none is, if values know that: all voxels around them must say the
/// same. In a voxel of a surface that is null one (Paper 6.2), that surface alone may shade points beside it.
pub(crate) fn known_between(
    occluders: &Occluders,
    grid: &Grid,
    values: &DenseValues,
    between: &Between,
) -> Option<bool> {
    const MOST_VOXELS: u64 = 64;
    /// Surfaces of the one element of such a voxel.
    const MOST_SURFACES: usize = 8;
    let [first, second] = between.ends;
    let around = Bounds {
        min: first.min(second),
        max: first.max(second),
    };
    let layout = &grid.layout;
    if !layout.bounds.contains(around.min) || !layout.bounds.contains(around.max) {
        return None;
    }
    let block = Block {
        from: layout.voxel_at(around.min),
        to: layout.voxel_at(around.max).map(|last| last + 1),
    };
    if block.voxel_count() > MOST_VOXELS {
        return None;
    }
    let is_clear = |surface| {
        let element = occluders.element_of(surface);
        let is_small = occluders.surfaces_of(element).nth(MOST_SURFACES).is_none();
        let mut parts = occluders.surfaces_of(element);
        is_small && parts.all(|part| between.is_clear_of(occluders, part))
    };
    let mut known = None;
    for voxel in block.voxels() {
        let voxel = layout.index(voxel);
        let (value, surfaces) = (values.get(voxel), grid.surfaces(voxel));
        let is_dark = match value.of_any_point(!surfaces.is_empty()) {
            Some(is_dark) => is_dark,
            None if value == Occlusion::Null && surfaces.iter().all(|&part| is_clear(part)) => {
                false
            }
            None => return None,
        };
        if known.is_some_and(|known| known != is_dark) {
            return None;
        }
        known = Some(is_dark);
    }
    known
}
