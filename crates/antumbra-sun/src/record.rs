//! A study that was answered: sensors, suns and bits, as they are written to files and read back.

use antumbra_geometry::DVec3;
use antumbra_scene::defaults;
use serde::{Deserialize, Serialize};

use crate::calendar::Dates;
use crate::positions::{Instant, Location, Refraction};
use crate::study::Bits;
use crate::suns::{Sun, SunKind};

/// Version of the layout of files that hold a study.
pub const VERSION: u32 = 1;

/// Conventions and sources of a study; written as JSON beside its arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Version of the layout: [`VERSION`].
    pub antumbra_sun: u32,
    /// Meaning of the directions.
    pub kind: SunKind,
    /// Source of the suns, in words.
    pub source: String,
    /// Place, if the suns follow from one.
    pub location: Option<Location>,
    /// Air that the positions account for; `None` for geometric positions.
    pub refraction: Option<Refraction>,
    /// Moment of each step of time that its sun is taken at.
    pub instant: Instant,
    /// Degrees from the scene's own north clockwise to true north.
    pub north: f64,
    /// Which way is up, world space.
    pub up: [f64; 3],
    /// Number of suns of the source that are not above the horizon.
    pub below_horizon: usize,
    /// Whether irradiances belong to the suns.
    pub has_weather: bool,
    /// Angular diameter of the suns in degrees, if their visible share counts.
    #[serde(default)]
    pub sun_diameter: Option<f64>,
    /// Whether what see-through surfaces let through counts.
    #[serde(default)]
    pub through_glass: bool,
    /// Light of the sky, if sensors have it.
    #[serde(default)]
    pub diffuse: Option<Diffuse>,
}

/// Light of an isotropic sky.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diffuse {
    /// Patches that view factors are of, in words.
    pub sky: String,
    /// Diffuse horizontal irradiation of all rows of the weather, suns below the horizon included, kWh/m2.
    pub horizontal: f64,
    /// Days of the year that count; `None` for all.
    pub dates: Option<Dates>,
}

/// Compass of a scene: which way is up, and where true north is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    /// Any vector but zero, world space.
    pub up: DVec3,
    /// Degrees from the scene's own north (+y with z up, -z with y up) clockwise, seen from above, to true north.
    pub north: f64,
}

impl Compass {
    /// Returns the unit vector towards a sun, world space.
    pub fn towards(&self, sun: &Sun) -> DVec3 {
        defaults::towards_sun(sun.azimuth + self.north, sun.elevation, self.up)
    }
}

/// A study that was answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Conventions and sources.
    pub about: About,
    /// Points of the sensors, world space.
    pub points: Vec<[f64; 3]>,
    /// Unit normals of the sensors; `None` if they see all directions.
    pub normals: Option<Vec<[f64; 3]>>,
    /// Surfaces of the sensors, if they lie on some.
    pub surfaces: Option<Vec<u32>>,
    /// Areas of the sensors, if these are known; the scene's unit squared.
    pub areas: Option<Vec<f64>>,
    /// Suns, or patches of the sky.
    pub suns: Vec<Sun>,
    /// Unit vectors towards them, world space.
    pub directions: Vec<[f64; 3]>,
    /// Bits: which suns reach which sensors; of suns with a size their middles.
    pub bits: Bits,
    /// Share of each sun that reaches each sensor, 0 to 1, sensor after sensor, where that is more than a bit: the visible
    /// share of its disc, and what glass lets through.
    pub shares: Option<Vec<f32>>,
    /// Sky view factor of each sensor, if the sky's light counts beside suns.
    pub sky_view_factor: Option<Vec<f64>>,
}

impl Study {
    /// Returns the number of sensors.
    pub fn sensor_count(&self) -> usize {
        self.points.len()
    }

    /// Returns the shares of a sensor, one a sun; `None` where bits say all.
    pub(crate) fn shares_of(&self, sensor: usize) -> Option<&[f32]> {
        let count = self.suns.len();
        Some(&self.shares.as_ref()?[sensor * count..][..count])
    }
}
