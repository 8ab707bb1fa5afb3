//! Questions that a study asks about its sensors.

use antumbra_geometry::DVec3;

use crate::error::BadSetting;
use crate::suns::Sun;

/// Largest angular diameter of a sun, degrees.
pub const LARGEST_SUN: f64 = 10.0;

/// Share of a sun that counts, where that is more than a bit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// Angular diameter of the sun's disc, in degrees: the share of it that is visible counts. `None` for a sun without
    /// size.
    pub sun_diameter: Option<f64>,
    /// Whether what see-through surfaces let through counts, in place of all.
    pub through_glass: bool,
}

impl Light {
    /// Returns whether a sun that reaches a sensor may do so in part.
    pub fn has_shares(&self) -> bool {
        self.sun_diameter.is_some() || self.through_glass
    }

    /// Checks the diameter.
    ///
    /// # Errors
    /// It is not above 0, or above [`LARGEST_SUN`].
    pub fn check(&self) -> Result<(), BadSetting> {
        match self.sun_diameter {
            // Not for NaN.
            Some(degrees) if !(degrees > 0.0 && degrees <= LARGEST_SUN) => {
                Err(BadSetting(format!(
                    "the sun's diameter is {degrees}: expected above 0 and at most {LARGEST_SUN} degrees"
                )))
            }
            _ => Ok(()),
        }
    }
}

/// Patches of the sky whose light sensors get.
#[derive(Clone, Debug, PartialEq)]
pub struct Dome {
    /// Unit vectors towards the middles of patches, world space.
    pub directions: Vec<DVec3>,
    /// Their solid angles, in steradians.
    pub weights: Vec<f64>,
    /// Unit vector upwards.
    pub up: DVec3,
}

impl Dome {
    /// Makes the dome of patches; `towards` returns the unit vector towards one.
    pub fn new(patches: &[Sun], up: DVec3, towards: impl Fn(&Sun) -> DVec3) -> Self {
        Self {
            directions: patches.iter().map(towards).collect(),
            weights: patches.iter().map(|patch| patch.weight).collect(),
            up: up.normalize_or_zero(),
        }
    }

    /// Returns the projected solid angle of the whole dome on a level surface: pi, up to the size of patches.
    pub(crate) fn open(&self) -> f64 {
        let patches = self.directions.iter().zip(&self.weights);
        patches
            .map(|(&to, weight)| to * *weight)
            .sum::<DVec3>()
            .dot(self.up)
    }
}

/// Questions about every sensor.
#[derive(Clone, Copy, Debug)]
pub struct Questions<'a> {
    /// Vectors towards the suns, any length but zero.
    pub directions: &'a [DVec3],
    /// How much of a sun counts.
    pub light: Light,
    /// Sky whose view factor is asked for, if one is. Sensors need normals.
    pub dome: Option<&'a Dome>,
}

impl<'a> Questions<'a> {
    /// Asks for bits alone.
    pub fn bits(directions: &'a [DVec3]) -> Self {
        Self {
            directions,
            light: Light::default(),
            dome: None,
        }
    }
}
