//! The constant sky.

use std::f64::consts::PI;

use glam::DVec3;

use super::{AreaError, AreaSample, frame_of, unit_of, warp};
use crate::light::LightShape;

/// The half of all directions around up, equally bright.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sky {
    up: DVec3,
    frame: [DVec3; 2],
}

impl Sky {
    /// The steradians of a half sphere.
    pub const SOLID_ANGLE: f64 = 2.0 * PI;

    /// Makes a sky from the direction that points up, of any length.
    ///
    /// # Errors
    /// A number is not finite, or the direction is zero.
    pub fn new(up: DVec3) -> Result<Self, AreaError> {
        let up = unit_of(up, "up")?;
        Ok(Self {
            up,
            frame: frame_of(up),
        })
    }

    /// Returns the unit vector that points up.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    pub(super) fn sample(&self, u: f64, v: f64) -> AreaSample {
        let local = warp::cap(u, v, 1.0);
        let [across, along] = self.frame;
        let direction = across * local.x + along * local.y + self.up * local.z;
        AreaSample {
            target: LightShape::Direction(direction),
            emitted: 1.0,
            solid_angle: Self::SOLID_ANGLE,
        }
    }
}
