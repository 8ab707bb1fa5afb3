//! A study that was answered: sensors, suns and bits, as they are written to files and read back.

use antumbra_geometry::DVec3;
use antumbra_scene::defaults;
use serde::{Deserialize, Serialize};

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
    /// Bits: which suns reach which sensors.
    pub bits: Bits,
}

impl Study {
    /// Returns the number of sensors.
    pub fn sensor_count(&self) -> usize {
        self.points.len()
    }
}
