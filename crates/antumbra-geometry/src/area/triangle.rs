//! A triangle of light.

use glam::DVec3;

use super::{AreaError, AreaSample, Emitter, check_point, warp};

/// A triangle. Its front is the side from which its corners wind counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TriangleLight {
    corners: [DVec3; 3],
    plane: Emitter,
}

impl TriangleLight {
    /// Makes a triangle from its corners, world space.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, or there is no area.
    pub fn new(corners: [DVec3; 3], is_two_sided: bool) -> Result<Self, AreaError> {
        corners
            .iter()
            .try_for_each(|&corner| check_point(corner, "a corner"))?;
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        Ok(Self {
            corners,
            plane: Emitter::new(a, normal, 0.5 * normal.length(), is_two_sided)?,
        })
    }

    /// Returns the corners.
    pub fn corners(&self) -> [DVec3; 3] {
        self.corners
    }

    /// Returns whether both sides shine.
    pub fn is_two_sided(&self) -> bool {
        self.plane.is_two_sided
    }

    /// Returns the unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.plane.normal
    }

    /// Returns the area.
    pub fn area(&self) -> f64 {
        self.plane.area
    }

    pub(super) fn sample(&self, receiver: DVec3, u: f64, v: f64) -> Option<AreaSample> {
        self.plane.sample(receiver, point_of(&self.corners, u, v))
    }
}

/// Returns a point of a triangle, uniformly by area.
pub(super) fn point_of(&[a, b, c]: &[DVec3; 3], u: f64, v: f64) -> DVec3 {
    let [second, third] = warp::triangle(u, v);
    a + (b - a) * second + (c - a) * third
}
