//! The umbra of a truncated cone or cylinder, open or closed.

use glam::DVec3;

use super::shaft::SidePlane;
use super::{Relation, SHRINK, Shaft};
use crate::intersect::{cone_is_outside, cone_meets_interior};
use crate::segment::Segment;
use crate::{Cone, LightShape, ReceiverPoint};

/// A cone's umbra. With the light outside, that of the closed cone is convex. An open tube lets
/// light through its ends, so it covers only what its hull covers through the wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConeUmbra {
    cone: Cone,
    shrunk: Cone,
    axis: DVec3,
    is_light_outside: bool,
}

impl ConeUmbra {
    pub(crate) fn new(cone: Cone, light: &LightShape) -> Self {
        let start = ReceiverPoint {
            point: cone.base,
            surface: None,
        };
        let is_light_outside = cone_is_outside(&cone, &Segment::new(start, light, None));
        // Radii and length shrink, the middle stays.
        let middle = 0.5 * (cone.base + cone.apex);
        let shrunk = Cone {
            base: middle + (cone.base - middle) * SHRINK,
            apex: middle + (cone.apex - middle) * SHRINK,
            base_radius: cone.base_radius * SHRINK,
            apex_radius: cone.apex_radius * SHRINK,
            is_closed: cone.is_closed,
        };
        Self {
            cone,
            shrunk,
            axis: (cone.apex - cone.base).normalize(),
            is_light_outside,
        }
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        if self.is_missed(shaft) {
            return Relation::Misses;
        }
        if !self.is_light_outside {
            return Relation::Crosses;
        }
        let is_in_hull_umbra = shaft
            .corner_segments()
            .all(|segment| cone_meets_interior(&self.shrunk, &segment));
        let is_covered = is_in_hull_umbra
            && (self.cone.is_closed
                || (self.is_clear_of_box(shaft)
                    && (self.is_end_missed(shaft, false) || self.is_end_missed(shaft, true))));
        if is_covered {
            Relation::Covers
        } else {
            Relation::Crosses
        }
    }

    fn is_missed(&self, shaft: &Shaft) -> bool {
        let is_above = |plane: &SidePlane| self.is_above(plane);
        shaft.misses(is_above) || self.is_box_beyond_end(shaft)
    }

    fn is_above(&self, plane: &SidePlane) -> bool {
        let Cone {
            base,
            base_radius,
            apex,
            apex_radius,
            ..
        } = self.cone;
        plane.is_disk_above(base, self.axis, base_radius)
            && plane.is_disk_above(apex, self.axis, apex_radius)
    }

    /// Returns whether box and light lie beyond the same end plane.
    fn is_box_beyond_end(&self, shaft: &Shaft) -> bool {
        [(self.cone.apex, self.axis), (self.cone.base, -self.axis)]
            .iter()
            .any(|&(point, normal)| {
                let plane = SidePlane::with_normal(normal, point);
                let slack = 1e-9 * (self.cone.apex - self.cone.base).length();
                let is_light_beyond = match shaft.light {
                    LightShape::Point(position) => plane.height(position).0 > slack,
                    LightShape::Direction(direction) => {
                        let (height, error) = plane.height_of_direction(direction);
                        height > error
                    }
                };
                is_light_beyond && plane.range(&shaft.bounds).0 > slack
            })
    }

    /// Returns whether the shaft surely misses one end disk.
    fn is_end_missed(&self, shaft: &Shaft, is_apex: bool) -> bool {
        let Cone {
            base,
            base_radius,
            apex,
            apex_radius,
            ..
        } = self.cone;
        let (center, radius) = if is_apex {
            (apex, apex_radius)
        } else {
            (base, base_radius)
        };
        shaft.misses(|plane| plane.is_disk_above(center, self.axis, radius))
    }

    /// Returns whether the box surely lies outside the closed cone.
    fn is_clear_of_box(&self, shaft: &Shaft) -> bool {
        let bounds = &shaft.bounds;
        let box_sides = (0..3).flat_map(|axis| {
            let mut normal = DVec3::ZERO;
            normal[axis] = 1.0;
            [
                SidePlane::with_normal(normal, bounds.max),
                SidePlane::with_normal(-normal, bounds.min),
            ]
        });
        let length = (self.cone.apex - self.cone.base).length();
        let slack = 1e-9 * length;
        let is_beyond_end = |point: DVec3, normal: DVec3| {
            SidePlane::with_normal(normal, point).range(bounds).0 > slack
        };
        box_sides.into_iter().any(|plane| self.is_above(&plane))
            || is_beyond_end(self.cone.apex, self.axis)
            || is_beyond_end(self.cone.base, -self.axis)
            || self.is_box_beside(shaft, slack)
    }

    /// Returns whether the plane that touches the wall nearest to the box, moved a hair outwards, surely
    /// separates them. Which way is nearest is rounding alone for a box in the middle of the axis: the
    /// plane is put to the test on both sides.
    fn is_box_beside(&self, shaft: &Shaft, slack: f64) -> bool {
        let Cone {
            base,
            base_radius,
            apex,
            apex_radius,
            ..
        } = self.cone;
        let from_base = shaft.bounds.center() - base;
        let across = (from_base - self.axis * self.axis.dot(from_base)).normalize_or_zero();
        // Through the two rim points on the box's side, square to the axis' plane there.
        let (low, high) = (base + across * base_radius, apex + across * apex_radius);
        let along = (high - low).normalize_or_zero();
        let normal = (across - along * across.dot(along)).normalize_or_zero();
        let plane = SidePlane::with_normal(normal, low + normal * slack);
        plane.range(&shaft.bounds).0 > 0.0 && self.is_above(&plane.flipped())
    }
}
