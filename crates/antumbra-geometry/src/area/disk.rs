//! A flat round disk of light.

use std::f64::consts::PI;

use glam::DVec3;

use super::{AreaError, AreaSample, Emitter, check_point, check_radius, frame_of, unit_of, warp};

/// A disk. Its front is the side of the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DiskLight {
    radius: f64,
    frame: [DVec3; 2],
    plane: Emitter,
}

impl DiskLight {
    /// Makes a disk from its centre, a normal of any length and a radius, world space.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, the normal is zero, or the radius is not positive.
    pub fn new(
        center: DVec3,
        normal: DVec3,
        radius: f64,
        is_two_sided: bool,
    ) -> Result<Self, AreaError> {
        check_point(center, "the centre")?;
        check_radius(radius)?;
        check_point(center.abs() + radius, "the rim")?;
        let normal = unit_of(normal, "the normal")?;
        Ok(Self {
            radius,
            frame: frame_of(normal),
            plane: Emitter::new(center, normal, PI * radius * radius, is_two_sided)?,
        })
    }

    /// Returns the centre.
    pub fn center(&self) -> DVec3 {
        self.plane.origin
    }

    /// Returns the unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.plane.normal
    }

    /// Returns the radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns whether both sides shine.
    pub fn is_two_sided(&self) -> bool {
        self.plane.is_two_sided
    }

    /// Returns the area.
    pub fn area(&self) -> f64 {
        self.plane.area
    }

    /// Returns two unit vectors in the plane.
    pub(crate) fn frame(&self) -> [DVec3; 2] {
        self.frame
    }

    pub(super) fn sample(&self, receiver: DVec3, u: f64, v: f64) -> Option<AreaSample> {
        self.plane.sample(receiver, self.point_at(u, v))
    }

    pub(super) fn point_at(&self, u: f64, v: f64) -> DVec3 {
        let place = warp::disk(u, v) * self.radius;
        let [across, along] = self.frame;
        self.plane.origin + across * place.x + along * place.y
    }
}
