//! Segment and disk (EXACTNESS.md, "Disk"), also the caps of closed cones.

use glam::DVec3;

use super::segment_triangle::{clear_plane_distance, exact_plane_distance};
use crate::number::{Number, Vector, decide};
use crate::segment::{Ends, Plane, Segment};

/// A disk whose normal is a difference of two points, so that a cap's plane is exactly the end
/// plane of its tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DiskPlane {
    pub(crate) center: DVec3,
    pub(crate) normal_tip: DVec3,
    pub(crate) normal_tail: DVec3,
    pub(crate) radius: f64,
}

impl DiskPlane {
    pub(crate) fn plane(&self) -> Plane {
        Plane::Normal {
            point: self.center,
            tip: self.normal_tip,
            tail: self.normal_tail,
        }
    }

    /// The normal, rounded.
    pub(crate) fn normal(&self) -> DVec3 {
        self.normal_tip - self.normal_tail
    }
}

/// Returns whether the segment crosses the closed disk.
pub(crate) fn disk_blocks(disk: &DiskPlane, segment: &Segment) -> bool {
    fn rule<N: Number>(disk: &DiskPlane, ends: &Ends<N>) -> Option<bool> {
        let plane = disk.plane();
        let start_height = plane.height(&ends.start);
        let light_height = plane.height(&ends.light);
        let start_sign = start_height.sign()?;
        if !start_sign.is_opposite(light_height.sign()?) {
            return Some(false);
        }
        // |h(L)| S + |h(S)| L
        let (u, v) = if start_sign.is_positive() {
            (light_height.negated(), start_height)
        } else {
            (light_height, start_height.negated())
        };
        let crossing = ends.start.blend(&u, &ends.light, &v);
        let from_center = crossing.seen_from(&Vector::from_f64(disk.center));
        let reach = N::from_f64(disk.radius).times(&crossing.w);
        let excess = from_center.dot(&from_center).minus(&reach.times(&reach));
        Some(!excess.sign()?.is_positive())
    }
    decide(rule(disk, &segment.approximate()), || {
        rule(disk, segment.exact())
    })
}

/// Returns where a segment that goes into a closed cone leaves through the plane of a cap; infinity if
/// it goes away from it.
pub(crate) fn cap_exit(cap: &DiskPlane, segment: &Segment) -> f64 {
    let rate = segment.direction().dot(cap.normal());
    if rate > 0.0 {
        ((cap.center - segment.origin()).dot(cap.normal()) / rate).max(0.0)
    } else {
        f64::INFINITY
    }
}

/// Returns the distance of the crossing in lengths of the segment's direction.
pub(crate) fn disk_distance(disk: &DiskPlane, segment: &Segment) -> f64 {
    let normal = disk.normal();
    clear_plane_distance(normal, normal.abs().max_element(), disk.center, segment)
        .unwrap_or_else(|| exact_plane_distance(&disk.plane(), segment))
}
