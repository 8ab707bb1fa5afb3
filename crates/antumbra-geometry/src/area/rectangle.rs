//! A rectangle of light, or another parallelogram.

use glam::DVec3;

use super::{AreaError, AreaSample, Emitter, check_point};

/// A parallelogram around its centre. Its front is the side of `edges[0] x edges[1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RectangleLight {
    edges: [DVec3; 2],
    plane: Emitter,
}

impl RectangleLight {
    /// Makes a rectangle from its centre and two whole edges, world space.
    ///
    /// # Errors
    /// A number is not finite, a corner is beyond 2^100, or there is no area.
    pub fn new(center: DVec3, edges: [DVec3; 2], is_two_sided: bool) -> Result<Self, AreaError> {
        check_point(center, "the centre")?;
        edges
            .iter()
            .try_for_each(|&edge| check_point(edge, "an edge"))?;
        let [first, second] = edges;
        for corner in [first + second, first - second] {
            check_point(center + 0.5 * corner, "a corner")?;
            check_point(center - 0.5 * corner, "a corner")?;
        }
        let normal = first.cross(second);
        Ok(Self {
            edges,
            plane: Emitter::new(center, normal, normal.length(), is_two_sided)?,
        })
    }

    /// Returns the centre.
    pub fn center(&self) -> DVec3 {
        self.plane.origin
    }

    /// Returns the two edges, from corner to corner.
    pub fn edges(&self) -> [DVec3; 2] {
        self.edges
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
        self.plane.sample(receiver, self.point_at(u, v))
    }

    pub(super) fn point_at(&self, u: f64, v: f64) -> DVec3 {
        let [first, second] = self.edges;
        self.plane.origin + first * (u - 0.5) + second * (v - 0.5)
    }
}
