//! A round patch of directions.

use std::f64::consts::PI;

use glam::DVec3;

use super::{AreaError, AreaSample, frame_of, unit_of, warp};
use crate::light::LightShape;

/// A cone of directions, as the sun's: about 0.53 degrees wide, seen from the Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SunDisc {
    towards_light: DVec3,
    diameter_degrees: f64,
    /// 1 - cos of the half-angle.
    height: f64,
    frame: [DVec3; 2],
}

impl SunDisc {
    /// Makes a disc from the direction towards its middle, of any length, and its angular diameter in degrees.
    ///
    /// # Errors
    /// A number is not finite, the direction is zero, or the diameter is not above 0 and below 180 degrees.
    pub fn new(towards_light: DVec3, diameter_degrees: f64) -> Result<Self, AreaError> {
        let towards_light = unit_of(towards_light, "the direction towards the light")?;
        if diameter_degrees == 0.0 {
            return Err(AreaError::NoSize {
                what: "its diameter is zero",
            });
        }
        // Not for NaN.
        if !(diameter_degrees > 0.0 && diameter_degrees < 180.0) {
            return Err(AreaError::BadDiameter(diameter_degrees));
        }
        let half_sine = libm::sin(diameter_degrees * (PI / 720.0));
        let height = 2.0 * half_sine * half_sine;
        if height == 0.0 {
            return Err(AreaError::NoSize {
                what: "its diameter vanishes",
            });
        }
        Ok(Self {
            towards_light,
            diameter_degrees,
            height,
            frame: frame_of(towards_light),
        })
    }

    /// Returns the unit vector towards the middle.
    pub fn towards_light(&self) -> DVec3 {
        self.towards_light
    }

    /// Returns the angular diameter in degrees.
    pub fn diameter_degrees(&self) -> f64 {
        self.diameter_degrees
    }

    /// Returns the steradians.
    pub fn solid_angle(&self) -> f64 {
        2.0 * PI * self.height
    }

    /// Returns two unit vectors across the direction towards the middle.
    pub(crate) fn frame(&self) -> [DVec3; 2] {
        self.frame
    }

    /// Returns 1 less the cosine of the half-angle.
    pub(crate) fn height(&self) -> f64 {
        self.height
    }

    /// Returns the tangent of the half-angle.
    pub fn tangent(&self) -> f64 {
        libm::tan(self.diameter_degrees * (PI / 360.0))
    }

    pub(super) fn sample(&self, u: f64, v: f64) -> AreaSample {
        let local = warp::cap(u, v, self.height);
        let [across, along] = self.frame;
        let direction = across * local.x + along * local.y + self.towards_light * local.z;
        AreaSample {
            target: LightShape::Direction(direction),
            emitted: 1.0,
            solid_angle: self.solid_angle(),
        }
    }
}
