//! The umbra of a disk.

use super::shaft::SidePlane;
use super::{Relation, SHRINK, Shaft};
use crate::LightShape;
use crate::intersect::{DiskPlane, disk_blocks, plane_side, unit_of};
use crate::number::Sign;

/// A disk's umbra: convex, so eight corners speak for a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiskUmbra {
    disk: DiskPlane,
    shrunk: DiskPlane,
    /// The disk's plane with the light above it.
    plane: SidePlane,
}

impl DiskUmbra {
    /// Returns `None` if the light lies in the disk's plane, so that the disk blocks nothing.
    pub(crate) fn new(disk: DiskPlane, light: &LightShape) -> Option<Self> {
        let side = plane_side(&disk.plane(), light.homogeneous());
        let plane = SidePlane::with_normal(unit_of(disk.normal()), disk.center);
        let plane = match side {
            Sign::Zero => return None,
            Sign::Positive => plane,
            Sign::Negative => plane.flipped(),
        };
        let shrunk = DiskPlane {
            radius: disk.radius * SHRINK,
            ..disk
        };
        Some(Self {
            disk,
            shrunk,
            plane,
        })
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        let axis = unit_of(self.disk.normal());
        let is_missed = self.plane.range(&shaft.bounds).0 > 0.0
            || shaft.misses(|plane| plane.is_disk_above(self.disk.center, axis, self.disk.radius));
        if is_missed {
            Relation::Misses
        } else if shaft
            .corner_segments()
            .all(|segment| disk_blocks(&self.shrunk, &segment))
        {
            Relation::Covers
        } else {
            Relation::Crosses
        }
    }
}
