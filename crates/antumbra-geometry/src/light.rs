//! The shapes of lights: where light comes from, never how much.
//!
//! Power, colour and a spot's cone belong to the scene; changing them changes no occlusion
//! value (Paper 7.1).

use glam::DVec3;

/// The place or the direction that shadow queries are asked about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// A point of world space. Spot lights are points too.
    Point(DVec3),
    /// A direction from the scene towards the light (world space, any length but zero).
    Direction(DVec3),
}

impl LightShape {
    /// Returns the light as a homogeneous point: `(x, 1)` or `(direction, 0)`.
    pub fn homogeneous(&self) -> (DVec3, f64) {
        match *self {
            Self::Point(position) => (position, 1.0),
            Self::Direction(direction) => (direction, 0.0),
        }
    }

    /// Returns the same light, a direction's largest component made at least 1 by a power of two, which
    /// rounds nothing: products with tiny directions lose bits, and their reciprocals overflow.
    pub(crate) fn without_underflow(self) -> Self {
        match self {
            Self::Direction(mut direction) if direction != DVec3::ZERO => {
                while direction.abs().max_element() < 1.0 {
                    let missing = -direction.abs().max_element().log2().floor();
                    direction *= 2f64.powi(missing.clamp(1.0, 1000.0) as i32);
                }
                Self::Direction(direction)
            }
            light => light,
        }
    }

    /// Returns a vector from `point_in_world` towards the light (not unit length).
    pub fn towards(&self, point_in_world: DVec3) -> DVec3 {
        match *self {
            Self::Point(position) => position - point_in_world,
            Self::Direction(direction) => direction,
        }
    }
}
