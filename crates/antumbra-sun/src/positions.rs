//! Solar positions.
//!
//! In: a place, moments. Out: azimuth (degrees clockwise from north) and elevation (degrees above the horizon) of the
//! middle of the sun's disc, by the Solar Position Algorithm (SPA; Reda and Andreas, 2003). Invariants: a place is
//! checked once; the same bits on every machine. Refraction is left out unless it is asked for.

use serde::{Deserialize, Serialize};
use solar_positioning::time::JulianDate;
use solar_positioning::{Location as Place, RefractionCorrection, SolarPositions, delta_t};

use crate::calendar::{DAY_SECONDS, Dates, Time, YEARS, days_in_month};
use crate::error::BadSetting;
use crate::suns::{Sun, SunKind, Suns};

/// Julian date of 1970-01-01T00:00:00 UTC.
const JULIAN_1970: f64 = 2_440_587.5;

/// Years whose suns have one lag of the Earth's rotation behind even time, in seconds: that of `pvlib` and of the algorithm's
/// report. It is at most 13 seconds off the true lag, which moves suns by less than 0.0002 degrees; the algorithm is
/// good to 0.0003. Other years have an estimate.
const RECENT: std::ops::Range<f64> = 1985.0..2036.0;
const RECENT_DELTA_T: f64 = 67.0;

/// Place on Earth and its clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Location {
    /// Degrees, north positive, -90 to 90.
    pub latitude: f64,
    /// Degrees, east positive, -180 to 180.
    pub longitude: f64,
    /// Meters above the sea.
    pub altitude: f64,
    /// Minutes that the clock is ahead of UTC, all year: daylight saving is never applied.
    pub offset_minutes: i32,
}

impl Location {
    /// Checks the numbers. `timezone` is in hours ahead of UTC and may have a fraction, in whole minutes.
    ///
    /// # Errors
    /// A number is out of range.
    pub fn new(
        latitude: f64,
        longitude: f64,
        altitude: f64,
        timezone: f64,
    ) -> Result<Self, BadSetting> {
        let within = |what: &str, value: f64, most: f64, unit: &str| match value.abs() <= most {
            true => Ok(()),
            false => Err(BadSetting(format!(
                "the {what} is {value}: expected -{most} to {most} {unit}"
            ))),
        };
        within("latitude", latitude, 90.0, "degrees, north positive")?;
        within("longitude", longitude, 180.0, "degrees, east positive")?;
        within("altitude", altitude, 12_000.0, "meters")?;
        within("time zone", timezone, 14.0, "hours ahead of UTC")?;
        let minutes = (timezone * 60.0).round();
        if (timezone * 60.0 - minutes).abs() > 1e-6 {
            return Err(BadSetting(format!(
                "the time zone is {timezone} hours: expected whole minutes, such as 5.5 or -3.75"
            )));
        }
        Ok(Self {
            latitude,
            longitude,
            altitude,
            offset_minutes: minutes as i32,
        })
    }

    /// Returns a statement if clock and longitude are so far apart that one of them is most likely a slip: a sign
    /// that is wrong, or two numbers that were swapped.
    pub fn doubt(&self) -> Option<String> {
        let hours = f64::from(self.offset_minutes) / 60.0;
        let mut apart = (hours - self.longitude / 15.0).abs();
        // Clocks beside the date line differ from the sun by a day.
        apart = apart.min((24.0 - apart).abs());
        (apart > 4.0).then(|| {
            format!(
                "the time zone UTC{hours:+} is {apart:.1} hours off the sun at longitude {}: west is negative in both",
                self.longitude
            )
        })
    }
}

/// Air that bends the light of the sun.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refraction {
    /// Pressure in hPa, above 0, at most 2000.
    pub pressure: f64,
    /// Temperature in degrees Celsius, above -273, at most 100.
    pub temperature: f64,
}

impl Default for Refraction {
    /// 1013.25 hPa and 12 degrees, the yearly means that `pvlib` takes.
    fn default() -> Self {
        Self {
            pressure: 1013.25,
            temperature: 12.0,
        }
    }
}

/// Moment of a step of time that its sun is taken at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Instant {
    /// Its begin.
    Start,
    /// Its middle.
    #[default]
    Middle,
    /// Its end.
    End,
}

impl Instant {
    /// Returns the seconds from the begin of a step to the moment.
    pub(crate) fn after_start(self, step_seconds: i64) -> i64 {
        match self {
            Self::Start => 0,
            Self::Middle => step_seconds / 2,
            Self::End => step_seconds,
        }
    }
}

/// Solar positions at one place.
#[derive(Clone, Copy, Debug)]
pub struct Positions {
    location: Location,
    refraction: Option<RefractionCorrection>,
}

impl Positions {
    /// Makes positions for a place: geometric ones, as `pvlib`'s `elevation`, or with refraction, as its
    /// `apparent_elevation`.
    ///
    /// # Errors
    /// Pressure or temperature is out of range.
    pub fn new(location: Location, refraction: Option<Refraction>) -> Result<Self, BadSetting> {
        let correction = |air: Refraction| {
            RefractionCorrection::new(air.pressure, air.temperature).map_err(|_| {
                BadSetting(format!(
                    "the air has {} hPa and {} degrees Celsius: expected above 0, at most 2000 hPa, and above -273, at most 100 degrees",
                    air.pressure, air.temperature
                ))
            })
        };
        Ok(Self {
            location,
            refraction: refraction.map(correction).transpose()?,
        })
    }

    /// Returns the place.
    pub fn location(&self) -> Location {
        self.location
    }

    /// Returns azimuth and elevation in degrees at a moment. Takes some microseconds.
    ///
    /// # Errors
    /// The moment is before the year 1 or after 2999.
    pub fn at(&self, utc_seconds: i64) -> Result<(f64, f64), BadSetting> {
        let days = utc_seconds as f64 / DAY_SECONDS as f64;
        let julian = JULIAN_1970 + days;
        let place = Place {
            latitude: self.location.latitude,
            longitude: self.location.longitude,
        };
        let year = 1970.0 + days / 365.2425;
        let delta_t = match RECENT.contains(&year) {
            true => Ok(RECENT_DELTA_T),
            false => delta_t::estimate(year),
        };
        let position = delta_t
            .and_then(|delta_t| JulianDate::new(julian, delta_t))
            .and_then(|time| {
                let altitude = self.location.altitude;
                SolarPositions::new().at_from_julian(time, place, altitude, self.refraction)
            });
        let position =
            position.map_err(|error| BadSetting(format!("no solar position: {error}")))?;
        Ok((position.azimuth(), position.elevation_angle()))
    }

    /// Returns the sun of a step of time.
    pub(crate) fn sun(&self, start: Time, step: i64, instant: Instant) -> Result<Sun, BadSetting> {
        let time = Time {
            local: start.local + instant.after_start(step),
            ..start
        };
        let (azimuth, elevation) = self.at(time.utc())?;
        Ok(Sun {
            azimuth,
            elevation,
            weight: step as f64,
            time: Some(time),
            direct_normal: None,
        })
    }

    /// Returns the suns of a year, one for each step of `step` minutes of the local clock, leap day included. Suns
    /// below the horizon are counted and left out.
    ///
    /// # Errors
    /// The year is out of range, or the step does not divide a day.
    pub fn year(
        &self,
        year: i32,
        step: u32,
        instant: Instant,
        dates: Option<Dates>,
    ) -> Result<Suns, BadSetting> {
        if !YEARS.contains(&year) {
            return Err(BadSetting(format!(
                "the year is {year}: expected {} to {}",
                YEARS.start(),
                YEARS.end()
            )));
        }
        check_step(step)?;
        let step = i64::from(step) * 60;
        let mut suns = Suns::new(SunKind::Suns);
        for (month, day) in antumbra_task::checked(days_of(year)) {
            if dates.is_some_and(|dates| !dates.contains(month, day)) {
                continue;
            }
            for start in (0..DAY_SECONDS).step_by(step as usize) {
                let offset = self.location.offset_minutes;
                let start = Time::new([year, month as i32, day as i32], start, offset);
                // Days of the calendar exist.
                let Some(start) = start else { continue };
                suns.push(self.sun(start, step, instant)?);
            }
        }
        Ok(suns)
    }
}

/// Returns the days of a year.
fn days_of(year: i32) -> impl Iterator<Item = (u32, u32)> {
    (1..=12).flat_map(move |month| (1..=days_in_month(year, month)).map(move |day| (month, day)))
}

/// Refuses a step, in minutes, that does not divide a day.
pub(crate) fn check_step(step: u32) -> Result<(), BadSetting> {
    const DAY: u32 = 1440;
    match (1..=DAY).contains(&step) && DAY.is_multiple_of(step) {
        true => Ok(()),
        false => Err(BadSetting(format!(
            "the step is {step} minutes: expected a divisor of 1440, such as 60, 15 or 10"
        ))),
    }
}
