//! Directions around a point, for ambient occlusion and the sky view factor.

use std::f64::consts::PI;

use glam::DVec3;

use super::sample::{AreaError, AreaSample, frame_of, unit_of};
use super::warp;
use crate::light::LightShape;

/// Directions that a receiver point looks into, spread by what each is worth to it, so that the mean over samples is
/// the weighted share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directions {
    axis: DVec3,
    frame: [DVec3; 2],
    is_sphere: bool,
}

impl Directions {
    /// Makes the half sphere around a normal of any length, by the cosine to it: what a flat receiver gets.
    ///
    /// # Errors
    /// A number is not finite, or the normal is zero.
    pub fn around(normal: DVec3) -> Result<Self, AreaError> {
        let axis = unit_of(normal, "the normal")?;
        Ok(Self {
            axis,
            frame: frame_of(axis),
            is_sphere: false,
        })
    }

    /// Returns all directions, uniformly by solid angle: what a point of space gets.
    pub fn all() -> Self {
        Self {
            axis: DVec3::Z,
            frame: frame_of(DVec3::Z),
            is_sphere: true,
        }
    }

    /// Returns the direction at two numbers in `[0, 1)`: of length 1, up to rounding.
    pub fn at(&self, [u, v]: [f64; 2]) -> DVec3 {
        let local = if self.is_sphere {
            warp::cap(u, v, 2.0)
        } else {
            let place = warp::disk(u, v);
            place.extend((1.0 - place.length_squared()).max(0.0).sqrt())
        };
        let [across, along] = self.frame;
        across * local.x + along * local.y + self.axis * local.z
    }

    /// Returns the sample at two numbers in `[0, 1)`: up to a distance from a point, if there is one that is finite.
    pub fn sample(&self, from: DVec3, place: [f64; 2], distance: Option<f64>) -> AreaSample {
        const LARGEST: f64 = (1_u128 << 100) as f64;
        let direction = self.at(place);
        let end = distance.map(|distance| from + direction * distance);
        let target = match end {
            // Not for NaN.
            Some(end) if end.abs().max_element() <= LARGEST => LightShape::Point(end),
            _ => LightShape::Direction(direction),
        };
        AreaSample {
            target,
            emitted: 1.0,
            solid_angle: if self.is_sphere { 4.0 * PI } else { PI },
        }
    }
}
