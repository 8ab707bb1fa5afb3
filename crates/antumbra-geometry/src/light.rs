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

    /// Returns the same light, a short direction made longer by a power of two, which rounds nothing:
    /// products with tiny directions lose bits, and their reciprocals overflow. The largest component
    /// of what comes out is 2^-30 or more; a zero direction stays.
    pub fn without_underflow(self) -> Self {
        const SHORT: f64 = 1.0 / (1 << 30) as f64;
        const MUCH_LONGER: f64 = 4.149515568880993e180; // 2^600
        match self {
            Self::Direction(mut direction)
                if direction.abs().max_element() < SHORT && direction != DVec3::ZERO =>
            {
                while direction.abs().max_element() < 1.0 / MUCH_LONGER {
                    direction *= MUCH_LONGER;
                }
                while direction.abs().max_element() < SHORT {
                    direction *= 1.0 / SHORT;
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
