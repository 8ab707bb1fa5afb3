//! Nearest-hit and any-hit through the grid, with mailboxes.

use antumbra_geometry::{Hit, Occluders, Segment, SurfaceId};

use super::{Grid, Walk};
use crate::Counters;

/// Remembers the surfaces a ray has tested, so that one that lies in several voxels is tested once
/// (Amanatides and Woo 1987). Forgets when two surfaces share a slot, which costs a test and no more.
#[derive(Debug)]
pub(crate) struct Mailbox {
    slots: [u32; Self::SLOTS],
}

impl Mailbox {
    const SLOTS: usize = 64;

    pub(crate) fn new() -> Self {
        Self {
            slots: [u32::MAX; Self::SLOTS],
        }
    }

    /// Notes a surface and returns whether it was not noted already.
    pub(crate) fn is_new(&mut self, surface: SurfaceId) -> bool {
        let slot = &mut self.slots[surface.0 as usize % Self::SLOTS];
        let is_new = *slot != surface.0;
        *slot = surface.0;
        is_new
    }
}

/// Tests every surface.
pub(crate) fn any_hit_by_reference(occluders: &Occluders, segment: &Segment) -> bool {
    occluders
        .surfaces()
        .any(|surface| occluders.blocks(surface, segment))
}

impl Grid {
    /// Returns whether a walk from the rounded start stays near enough to the exact segment. It
    /// does not for starts that lie far off the plane of a needle-thin triangle, nor from hundreds
    /// of scene sizes away, where the rounding of the distance at which the grid is entered is
    /// more than the margin.
    pub(crate) fn can_walk(&self, segment: &Segment) -> bool {
        let bounds = &self.layout.bounds;
        let origin = segment.origin();
        let is_near = bounds.contains(origin) || {
            let distance = (origin - bounds.center()).abs().max_element();
            2.0 * f64::EPSILON * distance <= 0.25 * self.layout.margin
        };
        is_near && segment.origin_error() <= 0.25 * self.layout.margin
    }

    /// Returns whether an opaque surface of a voxel blocks the segment.
    pub(crate) fn is_blocked_in(
        &self,
        occluders: &Occluders,
        voxel: usize,
        segment: &Segment,
        mailbox: &mut Mailbox,
        counters: &mut Counters,
    ) -> bool {
        self.surfaces(voxel).iter().any(|&surface| {
            if !occluders.is_opaque(surface) || !mailbox.is_new(surface) {
                return false;
            }
            counters.intersections += 1;
            occluders.crosses(surface, segment)
        })
    }

    /// Returns whether an opaque surface blocks the segment.
    pub(crate) fn any_hit(
        &self,
        occluders: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
    ) -> bool {
        if !self.can_walk(segment) {
            counters.intersections += occluders.surface_count() as u64;
            return any_hit_by_reference(occluders, segment);
        }
        let mut mailbox = Mailbox::new();
        Walk::new(&self.layout, segment).any(|visit| {
            counters.steps += 1;
            self.is_blocked_in(occluders, visit.voxel, segment, &mut mailbox, counters)
        })
    }

    /// Returns the nearest surface; ties go to the lowest id.
    pub(crate) fn nearest(
        &self,
        occluders: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
    ) -> Option<Hit> {
        if !self.can_walk(segment) {
            counters.intersections += occluders.surface_count() as u64;
            return nearest_of(occluders, occluders.surfaces(), segment, None);
        }
        let mut mailbox = Mailbox::new();
        let mut best: Option<Hit> = None;
        // A hit is final once the ray has left the voxels near it; the slack covers the rounding of
        // distances (2^-40 of the way, as the margin is of the scene), so that ties in the next
        // voxel are seen.
        let slack = 16.0 * self.layout.margin / segment.direction().abs().max_element();
        let share = 1.0 + 16.0 / (1u64 << 40) as f64;
        for visit in Walk::new(&self.layout, segment) {
            counters.steps += 1;
            let fresh = self
                .surfaces(visit.voxel)
                .iter()
                .copied()
                .filter(|&surface| {
                    let is_new = mailbox.is_new(surface);
                    counters.intersections += u64::from(is_new);
                    is_new
                });
            best = nearest_of(occluders, fresh, segment, best);
            if best.is_some_and(|hit| hit.distance * share + slack < visit.leaves_at) {
                break;
            }
        }
        best
    }
}

/// Returns the nearest of the surfaces and of a hit found before.
pub(crate) fn nearest_of(
    occluders: &Occluders,
    surfaces: impl Iterator<Item = SurfaceId>,
    segment: &Segment,
    before: Option<Hit>,
) -> Option<Hit> {
    surfaces
        .filter(|&surface| occluders.crosses(surface, segment))
        .map(|surface| occluders.hit(surface, segment))
        .fold(before, |best, hit| match best {
            Some(best) if (best.distance, best.surface) <= (hit.distance, hit.surface) => {
                Some(best)
            }
            _ => Some(hit),
        })
}
