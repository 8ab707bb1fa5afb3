//! A ball of light.

use std::f64::consts::PI;

use glam::DVec3;

use super::{AreaError, AreaSample, check_point, check_radius, frame_of, warp};
use crate::light::LightShape;

/// A ball that shines outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SphereLight {
    center: DVec3,
    radius: f64,
}

impl SphereLight {
    /// Makes a ball from its centre and radius, world space.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, or the radius is not positive.
    pub fn new(center: DVec3, radius: f64) -> Result<Self, AreaError> {
        check_point(center, "the centre")?;
        check_radius(radius)?;
        check_point(center.abs() + radius, "the surface")?;
        Ok(Self { center, radius })
    }

    /// Returns the centre.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Returns the radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the area of the whole surface.
    pub fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    /// Returns a point of the half that faces the receiver, uniformly by the solid angle that it has there.
    pub(super) fn sample(&self, receiver: DVec3, u: f64, v: f64) -> Option<AreaSample> {
        let towards = self.center - receiver;
        let distance = towards.length();
        let sine = self.radius / distance;
        // NaN: a receiver at the centre of what is too small for its square.
        if sine.is_nan() || sine >= 1.0 {
            return None;
        }
        let axis = towards / distance;
        let square = sine * sine;
        // 1 - cos of the half-angle, without cancellation.
        let height = square / (1.0 + (1.0 - square).sqrt());
        let local = warp::cap(u, v, height);
        let [across, along] = frame_of(axis);
        let direction = across * local.x + along * local.y + axis * local.z;
        // Where the ray enters: both distances from the point nearest to the centre.
        let off = distance * local.truncate().length();
        let half = ((self.radius - off) * (self.radius + off)).max(0.0).sqrt();
        let point = receiver + direction * (distance * local.z - half);
        Some(AreaSample {
            target: LightShape::Point(point),
            emitted: 1.0,
            solid_angle: 2.0 * PI * height,
        })
    }
}
