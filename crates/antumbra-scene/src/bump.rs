//! Reliefs of surfaces that are no geometry.
//!
//! In: what a file or a flag says. Out: [`Bump`]; heights in space with their slopes. Invariant: what is computed here has the
//! same bits on every platform: hashes of whole numbers, additions and multiplications, and `libm`. Absent here: where a
//! picture lies on a surface, shading, shadows.

use antumbra_geometry::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::quoted;

/// A relief of a surface that is no geometry: it changes shading, and where shadows of others end ("Bumps" in EXACTNESS.md).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Bump {
    /// A picture of heights: the red value as stored, white is high.
    Heights {
        /// Index into [`Scene::textures`](crate::model::Scene::textures).
        texture: usize,
        /// Between black and white there are so many sixty-fourths of the picture's length on the surface. Negative numbers
        /// turn heights round.
        multiplier: f64,
    },
    /// A picture of normals (+x right, +y up, +z out of the surface), as glTF has them.
    Normals {
        /// Index into [`Scene::textures`](crate::model::Scene::textures).
        texture: usize,
        /// What x and y are multiplied by.
        scale: f64,
    },
    /// Bumps of no order, in space.
    Noise {
        /// From the lowest to the highest place, world units; positive.
        height: f64,
        /// Distance of bumps, world units; positive.
        size: f64,
    },
    /// Waves along all three axes, in space.
    Ripples {
        /// From the lowest to the highest place, world units; positive.
        height: f64,
        /// Length of a wave, world units; positive.
        size: f64,
    },
}

/// Why there is no relief of a kind in space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BumpError {
    /// There is no such kind.
    #[error("a relief is {0}: expected noise or ripples")]
    Kind(String),
    /// A length is not positive, or not finite, or beyond 2^99.
    #[error("{what} of a relief is {found}: expected a length above 0 and below 2^99")]
    Length {
        /// Name of the length: `"height"` or `"size"`.
        what: &'static str,
        /// Number that was given.
        found: f64,
    },
}

impl Bump {
    /// Returns the relief in space of a kind, `noise` or `ripples`.
    ///
    /// # Errors
    /// There is no such kind, or a length is none.
    pub fn in_space(kind: &str, height: f64, size: f64) -> Result<Self, BumpError> {
        const LARGEST: f64 = 6.338253001141147e29; // 2^99
        for (what, found) in [("height", height), ("size", size)] {
            // Not for NaN.
            if !(found > 0.0 && found < LARGEST) {
                return Err(BumpError::Length { what, found });
            }
        }
        match kind {
            "noise" => Ok(Self::Noise { height, size }),
            "ripples" => Ok(Self::Ripples { height, size }),
            other => Err(BumpError::Kind(quoted(other))),
        }
    }

    /// Returns the index of its picture, if it has one.
    pub fn texture(&self) -> Option<usize> {
        match *self {
            Self::Heights { texture, .. } | Self::Normals { texture, .. } => Some(texture),
            Self::Noise { .. } | Self::Ripples { .. } => None,
        }
    }

    /// Returns how high a relief in space is, world units.
    pub fn height_in_space(&self) -> Option<f64> {
        match *self {
            Self::Noise { height, .. } | Self::Ripples { height, .. } => Some(height),
            Self::Heights { .. } | Self::Normals { .. } => None,
        }
    }

    /// Returns the share of its height that a relief in space has at a point, 0 to 1, and how it grows along each axis; no
    /// relief for pictures.
    pub fn share_in_space(&self, point_in_world: DVec3) -> (f64, DVec3) {
        match *self {
            Self::Noise { size, .. } => noise(point_in_world, size),
            Self::Ripples { size, .. } => ripples(point_in_world, size),
            Self::Heights { .. } | Self::Normals { .. } => (0.0, DVec3::ZERO),
        }
    }
}

/// Two octaves of value noise.
fn noise(point: DVec3, size: f64) -> (f64, DVec3) {
    let (wide, slope) = value_noise(point / size);
    let (fine, fine_slope) = value_noise(point / size * 2.0 + DVec3::splat(0.5));
    let share = (2.0 * wide + fine) / 3.0;
    (
        share.clamp(0.0, 1.0),
        (2.0 * slope + 2.0 * fine_slope) / (3.0 * size),
    )
}

/// Interpolates random values, 0 to 1, of the corners of a lattice of whole numbers, smoothly (Perlin's quintic).
fn value_noise(point: DVec3) -> (f64, DVec3) {
    let low = point.floor();
    let within = (point - low).clamp(DVec3::ZERO, DVec3::ONE);
    let ease = |x: f64| x * x * x * (x * (x * 6.0 - 15.0) + 10.0);
    let slope_of_ease = |x: f64| 30.0 * x * x * (x - 1.0) * (x - 1.0);
    let weights = within.to_array().map(|x| [1.0 - ease(x), ease(x)]);
    let slopes = within
        .to_array()
        .map(|x| [-slope_of_ease(x), slope_of_ease(x)]);
    // Casts end at the ends of their range; what is beyond has one value.
    let [x, y, z] = low.to_array().map(|at| at as i64);
    let (mut share, mut slope) = (0.0, DVec3::ZERO);
    for corner in 0..8_usize {
        let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let along = |at: i64, step: usize| at.wrapping_add(step as i64) as u64;
        let value = random(along(x, i), along(y, j), along(z, k));
        share += value * (weights[0][i] * weights[1][j] * weights[2][k]);
        slope += value
            * DVec3::new(
                slopes[0][i] * weights[1][j] * weights[2][k],
                weights[0][i] * slopes[1][j] * weights[2][k],
                weights[0][i] * weights[1][j] * slopes[2][k],
            );
    }
    (share, slope)
}

/// Returns a number from 0 to 1 of three whole ones (SplitMix64).
fn random(x: u64, y: u64, z: u64) -> f64 {
    let mix = |seed: u64| {
        let seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let seed = (seed ^ seed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let seed = (seed ^ seed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        seed ^ seed >> 31
    };
    (mix(mix(mix(x) ^ y) ^ z) >> 11) as f64 / (1_u64 << 53) as f64
}

fn ripples(point: DVec3, size: f64) -> (f64, DVec3) {
    let angles = (point / size).to_array().map(|turns| {
        // A turn more changes nothing; sines of large angles are far off.
        std::f64::consts::TAU * (turns - turns.floor())
    });
    let sum: f64 = angles.into_iter().map(libm::sin).sum();
    let slope = DVec3::from_array(angles.map(libm::cos)) * (std::f64::consts::PI / (3.0 * size));
    ((0.5 + sum / 6.0).clamp(0.0, 1.0), slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Bump; 2] = [
        Bump::Noise {
            height: 0.5,
            size: 0.75,
        },
        Bump::Ripples {
            height: 0.5,
            size: 0.75,
        },
    ];

    #[test]
    fn slopes_are_those_of_the_shares() {
        for bump in BOTH {
            let mut steepest = 0.0_f64;
            for number in 0..500 {
                let at = |axis: u64| 8.0 * random(number, axis, 1) - 4.0;
                let point = DVec3::new(at(0), at(1), at(2));
                let (share, slope) = bump.share_in_space(point);
                assert!((0.0..=1.0).contains(&share), "{bump:?} {point}");
                steepest = steepest.max(slope.length());
                for (axis, along) in DVec3::AXES.into_iter().enumerate() {
                    const STEP: f64 = 1e-6;
                    let beside = |step: f64| bump.share_in_space(point + step * along).0;
                    let found = (beside(STEP) - beside(-STEP)) / (2.0 * STEP);
                    assert!((found - slope[axis]).abs() < 1e-5, "{bump:?} {point}");
                }
            }
            assert!(steepest > 0.5, "{bump:?} is flat");
        }
    }

    #[test]
    fn no_point_is_too_odd() {
        for bump in BOTH {
            for odd in [0.0, -0.0, 1e30, -1e30, 1e-300, 9.0e18, 4.5e15] {
                let (share, slope) = bump.share_in_space(DVec3::new(odd, -odd, 1.0));
                assert!((0.0..=1.0).contains(&share) && slope.is_finite(), "{odd}");
            }
        }
    }

    /// The bits, summed: another platform's would differ here first.
    #[test]
    fn reliefs_are_the_same_everywhere() {
        let mut sum = 0_u64;
        for bump in BOTH {
            for number in 0..64 {
                let point = DVec3::new(0.37, -0.61, 0.13) * f64::from(number);
                let (share, slope) = bump.share_in_space(point);
                for value in [share, slope.x, slope.y, slope.z] {
                    sum = sum.rotate_left(1) ^ value.to_bits();
                }
            }
        }
        assert_eq!(sum, 0xd035_28bf_0da0_fe6d, "{sum:#x}");
    }
}
