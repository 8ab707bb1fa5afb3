//! A straight line of light, such as a tube lamp without thickness.

use glam::DVec3;

use super::{AreaError, AreaSample, check_point, solid_angle};
use crate::light::LightShape;

/// A line of light between two points. It shines all around.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SegmentLight {
    ends: [DVec3; 2],
    /// Unit length.
    direction: DVec3,
    length: f64,
}

impl SegmentLight {
    /// Makes a line of light from its two ends, world space.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, or the ends are the same point.
    pub fn new(ends: [DVec3; 2]) -> Result<Self, AreaError> {
        ends.iter()
            .try_for_each(|&end| check_point(end, "an end"))?;
        let along = ends[1] - ends[0];
        let length = along.length();
        if length == 0.0 {
            return Err(AreaError::NoSize {
                what: "its ends are the same point",
            });
        }
        Ok(Self {
            ends,
            direction: along / length,
            length,
        })
    }

    /// Returns the two ends.
    pub fn ends(&self) -> [DVec3; 2] {
        self.ends
    }

    /// Returns the length.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns the unit vector from the first end to the second.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    pub(super) fn point_at(&self, u: f64) -> DVec3 {
        let [first, second] = self.ends;
        first + (second - first) * u
    }

    pub(super) fn sample(&self, receiver: DVec3, u: f64) -> Option<AreaSample> {
        let point = self.point_at(u);
        let back = receiver - point;
        let square = back.length_squared();
        if square == 0.0 {
            return None;
        }
        let emitted = (self.direction.cross(back).length() / square.sqrt()).min(1.0);
        Some(AreaSample {
            target: LightShape::Point(point),
            emitted,
            solid_angle: solid_angle(self.length, emitted, square),
        })
    }
}
