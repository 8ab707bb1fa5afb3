//! The shapes of lights: where light comes from, never how much.
//!
//! Power, color and a spot's cone belong to the scene; changing them changes no occlusion
//! value (Paper 7.1).

use glam::DVec3;

use crate::number::{Approximate, Exact, Number, Point4, Sign, Vector, decide};

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

    /// Returns on which side of the plane through a point with a normal, of any length, the light is:
    /// 1 on the normal's side, -1 behind, 0 in the plane and for zero normals. The sign is exact for
    /// numbers up to 2^100.
    pub fn side_of(&self, point_in_world: DVec3, normal: DVec3) -> i8 {
        fn side<N: Number>(light: (DVec3, f64), point: DVec3, normal: DVec3) -> Option<Sign> {
            let seen = Point4::<N>::from_f64(light).seen_from(&Vector::from_f64(point));
            Vector::from_f64(normal).dot(&seen).sign()
        }
        let light = self.homogeneous();
        let exactly = || side::<Exact>(light, point_in_world, normal);
        decide(side::<Approximate>(light, point_in_world, normal), exactly).to_i8()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_exact() {
        let v = DVec3::new;
        let lamp = LightShape::Point(v(0.1, 0.2, 0.3));
        assert_eq!(lamp.side_of(v(0.0, 0.0, 0.0), v(0.0, 0.0, 5.0)), 1);
        assert_eq!(lamp.side_of(v(0.0, 0.0, 1.0), v(0.0, 0.0, 5.0)), -1);
        assert_eq!(lamp.side_of(v(7.0, 0.0, 0.3), v(0.0, 0.0, 1.0)), 0);
        assert_eq!(lamp.side_of(v(7.0, 0.0, 0.0), DVec3::ZERO), 0);
        let up = v(0.0, 0.0, 0.3_f64.next_up());
        assert_eq!(lamp.side_of(up, v(0.0, 0.0, 1e-300)), -1);
        let sum = 0.1_f64 + 0.2;
        let sun = LightShape::Direction(v(0.1, 0.2, -sum));
        // In f64 the three add up to zero; the sum was rounded up.
        assert_eq!(sun.side_of(DVec3::ZERO, DVec3::ONE), -1);
        assert_eq!(
            LightShape::Direction(v(1.0, -1.0, 0.0)).side_of(up, DVec3::ONE),
            0
        );
    }
}
