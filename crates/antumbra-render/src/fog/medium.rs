//! A homogeneous medium.

use antumbra_geometry::Short;

/// A homogeneous medium that absorbs light and scatters it once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fog {
    pub(super) extinction: f64,
    pub(super) albedo: f64,
    pub(super) g: f64,
}

/// Why there is no such medium.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FogError {
    /// The extinction is negative, NaN or infinite.
    #[error("the density is {}: expected a finite number, 0 or above", Short(*.0))]
    BadExtinction(f64),
    /// The albedo is out of range.
    #[error("the albedo is {}: expected 0 to 1", Short(*.0))]
    BadAlbedo(f64),
    /// The asymmetry is out of range.
    #[error("g is {}: expected above -1 and below 1", Short(*.0))]
    BadG(f64),
}

impl Fog {
    /// Makes a medium from its extinction coefficient for each unit of length, the share of extinction that is scattering,
    /// and the mean cosine `g` of Henyey and Greenstein's phase function (1941): above 0 where light goes on forwards.
    ///
    /// # Errors
    /// A number is out of range.
    pub fn new(extinction: f64, albedo: f64, g: f64) -> Result<Self, FogError> {
        if !(extinction >= 0.0 && extinction.is_finite()) {
            return Err(FogError::BadExtinction(extinction));
        }
        if !(0.0..=1.0).contains(&albedo) {
            return Err(FogError::BadAlbedo(albedo));
        }
        if !(g > -1.0 && g < 1.0) {
            return Err(FogError::BadG(g));
        }
        Ok(Self {
            extinction,
            albedo,
            g,
        })
    }

    /// Returns the extinction coefficient, for each unit of length.
    pub fn extinction(&self) -> f64 {
        self.extinction
    }

    /// Returns the share of extinction that is scattering.
    pub fn albedo(&self) -> f64 {
        self.albedo
    }

    /// Returns the mean cosine of scattering.
    pub fn g(&self) -> f64 {
        self.g
    }

    /// Returns the share of light that is left after a length.
    pub fn transmittance(&self, length: f64) -> f64 {
        libm::exp(-self.extinction * length)
    }

    /// Returns Henyey and Greenstein's phase function, whose integral over the sphere is 1, at the cosine between the
    /// directions in which light travels before and after.
    pub fn phase(&self, cosine: f64) -> f64 {
        // Neither form cancels where the peak is.
        let square = if self.g >= 0.0 {
            (1.0 - self.g) * (1.0 - self.g) + 2.0 * self.g * (1.0 - cosine)
        } else {
            (1.0 + self.g) * (1.0 + self.g) - 2.0 * self.g * (1.0 + cosine)
        };
        self.phase_scale() / (square * square.sqrt())
    }

    /// Returns the phase function times the third power of the length whose square is under it.
    pub(super) fn phase_scale(&self) -> f64 {
        (1.0 - self.g) * (1.0 + self.g) / (4.0 * std::f64::consts::PI)
    }

    /// Returns the airlight between two distances along a ray, for light of irradiance 1 from one direction; `cosine` is that
    /// between ray and direction towards the light. That light has not been weakened by the air on its way to the ray.
    pub fn airlight_of_direction(&self, cosine: f64, begin: f64, end: f64) -> f64 {
        let lost = -libm::expm1(-self.extinction * (end - begin));
        self.albedo * self.phase(cosine) * self.transmittance(begin) * lost
    }
}
