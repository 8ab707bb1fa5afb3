//! Suns of a study: plain data that every source of suns makes.

use serde::{Deserialize, Serialize};

use crate::calendar::Time;

/// Meaning of the directions of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SunKind {
    /// Suns, each for a length of time.
    Suns,
    /// Patches of the sky, each with a solid angle.
    Sky,
}

/// One direction of a study: a sun, or the middle of a patch of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Degrees clockwise from north, seen from above.
    pub azimuth: f64,
    /// Degrees above the horizon.
    pub elevation: f64,
    /// Seconds that a sun stands for; steradians of a patch of the sky.
    pub weight: f64,
    /// Moment of a sun, if that is known.
    pub time: Option<Time>,
    /// Direct normal irradiance in W/m2; `None` where it is unknown or missing.
    pub direct_normal: Option<f64>,
}

/// Directions of a study, all above the horizon, in the order of their source.
#[derive(Clone, Debug, PartialEq)]
pub struct Suns {
    /// Meaning of them.
    pub kind: SunKind,
    /// The directions.
    pub list: Vec<Sun>,
    /// Number of suns of the source that are not above the horizon and were left out.
    pub below_horizon: usize,
    /// Whether irradiances belong to the source, so that a `None` is a missing value.
    pub has_weather: bool,
    /// Statements about the source that a user should hear of, each once.
    pub notes: Vec<String>,
}

impl Suns {
    /// Makes an empty set.
    pub(crate) fn new(kind: SunKind) -> Self {
        Self {
            kind,
            list: Vec::new(),
            below_horizon: 0,
            has_weather: false,
            notes: Vec::new(),
        }
    }

    /// Adds a sun, or counts it if it is not above the horizon.
    pub(crate) fn push(&mut self, sun: Sun) {
        match sun.elevation > 0.0 {
            true => self.list.push(sun),
            false => self.below_horizon += 1,
        }
    }

    /// Returns the number of suns whose irradiance is missing; 0 where there is no weather.
    pub fn missing(&self) -> usize {
        match self.has_weather {
            true => self
                .list
                .iter()
                .filter(|sun| sun.direct_normal.is_none())
                .count(),
            false => 0,
        }
    }
}
