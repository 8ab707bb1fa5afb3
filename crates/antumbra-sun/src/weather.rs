//! Weather of a place: rows of irradiance, one for each step of time.
//!
//! In: rows that a reader found. Out: [`Suns`], each with the irradiance of its row. Invariants: rows are in the order of
//! month and day (those of a typical year have several years), and none is there twice; their clock is standard time all year.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::calendar::{DAY_SECONDS, Dates, Time, days_since_1970};
use crate::error::{BadSetting, FileError};
use crate::positions::{Instant, Location, Positions, Refraction};
use crate::suns::{Sun, SunKind, Suns};

/// Irradiance of one step of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeatherRow {
    /// Number of the line in the file, counted from 1.
    pub line: usize,
    /// Year, if the file says it.
    pub year: Option<i32>,
    /// Month, 1 to 12.
    pub month: u32,
    /// Day of the month.
    pub day: u32,
    /// Seconds from the begin of the day to the begin of the step; may be negative.
    pub start: i64,
    /// Direct normal irradiance, mean over the step, W/m2; `None` where it is missing.
    pub direct_normal: Option<f64>,
    /// Diffuse horizontal irradiance, mean over the step, W/m2; `None` where it is missing.
    pub diffuse_horizontal: Option<f64>,
}

impl WeatherRow {
    /// Returns the day of the year and the time of day.
    fn key(&self) -> (u32, u32, i64) {
        (self.month, self.day, self.start)
    }
}

/// Weather of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// Path of the file.
    pub file: PathBuf,
    /// Place, and its clock.
    pub location: Location,
    /// Seconds of a step.
    pub step: i64,
    /// Rows in the order of time.
    pub rows: Vec<WeatherRow>,
    /// Statements about the file that a user should hear of.
    pub notes: Vec<String>,
    /// Whether the rows are of more than one year.
    is_longer_than_a_year: bool,
}

/// Year of weather that names none and has no leap day, and of weather that has one.
const NAMELESS_YEARS: [i32; 2] = [2017, 2016];

impl Weather {
    /// Checks the order of rows and looks for those that are missing.
    ///
    /// # Errors
    /// There are no rows, a row is there twice, or rows are out of order.
    pub(crate) fn new(
        file: &Path,
        location: Location,
        step: i64,
        rows: Vec<WeatherRow>,
        mut notes: Vec<String>,
    ) -> Result<Self, FileError> {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            return Err(FileError::whole(
                file,
                "it has no rows: expected one for each hour",
            ));
        };
        notes.extend(location.doubt());
        let mut is_longer_than_a_year = false;
        let has_leap_day = rows.iter().any(|row| (row.month, row.day) == (2, 29));
        let year = NAMELESS_YEARS[usize::from(has_leap_day)];
        let seconds =
            |row: &WeatherRow| days_since_1970(year, row.month, row.day) * DAY_SECONDS + row.start;
        let mut missing = 0;
        let mut first_missing = None;
        for pair in rows.windows(2) {
            let [one, next] = pair else { continue };
            let gap = if next.key() > one.key() {
                seconds(next) - seconds(one)
            } else if next.year > one.year && one.year.is_some() {
                is_longer_than_a_year = true;
                // From December to January.
                let of_year = days_since_1970(year + 1, 1, 1) - days_since_1970(year, 1, 1);
                seconds(next) - seconds(one) + of_year * DAY_SECONDS
            } else {
                let what = match next.key() == one.key() {
                    true => "is there twice",
                    false => "is out of order",
                };
                let message = format!(
                    "the time {} {what}, after line {}: expected rows in the order of time",
                    shown(next),
                    one.line
                );
                return Err(FileError::at(file, next.line, message));
            };
            let left_out = (gap / step - 1).max(0);
            if left_out > 0 {
                first_missing.get_or_insert(next.line);
                missing += left_out;
            }
        }
        if let Some(line) = first_missing {
            notes.push(format!(
                "{}: {missing} rows are missing, the first before line {line}: these times have no sun",
                file.display()
            ));
        }
        let of_year = if has_leap_day { 366 } else { 365 } * DAY_SECONDS / step;
        if ((rows.len() as i64) + missing) < of_year {
            notes.push(format!(
                "{}: the rows are of a part of the year, {} to {}",
                file.display(),
                shown(first),
                shown(last)
            ));
        }
        Ok(Self {
            file: file.to_path_buf(),
            location,
            step,
            rows,
            notes,
            is_longer_than_a_year,
        })
    }

    /// Returns the suns of all rows, each with its irradiance; those below the horizon are counted and left out.
    ///
    /// `year` replaces the years of the rows. A file that names none counts as of 2017, or of 2016 if it has a leap day.
    ///
    /// # Errors
    /// A day does not exist in the year, the rows are of more than one year and `year` is given, or a setting is out
    /// of range.
    pub fn suns(
        &self,
        year: Option<i32>,
        refraction: Option<Refraction>,
        instant: Instant,
        dates: Option<Dates>,
    ) -> Result<Suns, FileError> {
        let setting = |error: BadSetting| FileError::whole(&self.file, error.0);
        let positions = Positions::new(self.location, refraction).map_err(setting)?;
        if year.is_some() && self.is_longer_than_a_year {
            let message = "the rows are of more than one year: leave the year out";
            return Err(FileError::whole(&self.file, message));
        }
        let has_leap_day = self.rows.iter().any(|row| (row.month, row.day) == (2, 29));
        let nameless = NAMELESS_YEARS[usize::from(has_leap_day)];
        let mut suns = Suns::new(SunKind::Suns);
        suns.has_weather = true;
        suns.notes.clone_from(&self.notes);
        for row in antumbra_task::checked(&self.rows) {
            if dates.is_some_and(|dates| !dates.contains(row.month, row.day)) {
                continue;
            }
            let year = year.or(row.year).unwrap_or(nameless);
            let date = [year, row.month as i32, row.day as i32];
            let start = Time::new(date, row.start, self.location.offset_minutes);
            let Some(start) = start else {
                let message = format!(
                    "the day {:02}-{:02} does not exist in the year {year}",
                    row.month, row.day
                );
                return Err(FileError::at(&self.file, row.line, message));
            };
            let sun = positions.sun(start, self.step, instant);
            let sun = sun.map_err(|error| FileError::at(&self.file, row.line, error.0))?;
            suns.push(Sun {
                direct_normal: row.direct_normal,
                ..sun
            });
        }
        let missing = suns.missing();
        if missing > 0 {
            suns.notes.push(format!(
                "{}: {missing} suns have no direct normal irradiance: sums count them as 0",
                self.file.display()
            ));
        }
        Ok(suns)
    }

    /// Returns the diffuse horizontal irradiation of all rows of some days, kWh/m2, and how many rows miss theirs; those count
    /// as 0. Suns below the horizon do not matter: the sky is bright before sunrise, too.
    pub fn diffuse_horizontal(&self, dates: Option<Dates>) -> (f64, usize) {
        const JOULES_A_KWH: f64 = 3.6e6;
        let is_of =
            |row: &&WeatherRow| dates.is_none_or(|dates| dates.contains(row.month, row.day));
        let (mut sum, mut missing) = (0.0, 0);
        for row in self.rows.iter().filter(is_of) {
            match row.diffuse_horizontal {
                Some(mean) => sum += mean * self.step as f64,
                None => missing += 1,
            }
        }
        (sum / JOULES_A_KWH, missing)
    }

    /// Gives suns of a study the irradiance of the rows of the same day and time, whatever the year. Suns that have
    /// no row lose theirs. Returns how many have one now.
    ///
    /// # Errors
    /// The place is another one, the rows are of more than one year, or suns have no times.
    pub fn replace_irradiance(
        &self,
        suns: &mut [Sun],
        instant: Instant,
        location: Option<Location>,
    ) -> Result<usize, FileError> {
        /// Degrees that stations of one town may lie apart.
        const NEAR: f64 = 0.1;
        let refused = |message: String| Err(FileError::whole(&self.file, message));
        if let Some(of_study) = location {
            let own = self.location;
            let is_near = (own.latitude - of_study.latitude).abs() <= NEAR
                && (own.longitude - of_study.longitude).abs() <= NEAR
                && own.offset_minutes == of_study.offset_minutes;
            if !is_near {
                return refused(format!(
                    "the weather is of latitude {}, longitude {}, UTC{:+}: expected that of the study, {}, {}, UTC{:+}",
                    own.latitude,
                    own.longitude,
                    f64::from(own.offset_minutes) / 60.0,
                    of_study.latitude,
                    of_study.longitude,
                    f64::from(of_study.offset_minutes) / 60.0
                ));
            }
        }
        if self.is_longer_than_a_year {
            return refused("the rows are of more than one year: expected one".to_owned());
        }
        if suns.iter().any(|sun| sun.time.is_none()) {
            return refused("the suns of the study have no times to find rows by".to_owned());
        }
        let by_time: HashMap<_, _> = self
            .rows
            .iter()
            .map(|row| (row.key(), row.direct_normal))
            .collect();
        let mut found = 0;
        for sun in suns {
            sun.direct_normal = None;
            let Some(time) = sun.time else { continue };
            let start = Time {
                local: time.local - instant.after_start(sun.weight as i64),
                ..time
            };
            let (_, month, day) = start.date();
            if let Some(&direct_normal) = by_time.get(&(month, day, start.second())) {
                sun.direct_normal = direct_normal;
                found += usize::from(direct_normal.is_some());
            }
        }
        Ok(found)
    }
}

/// Returns a row's day and the begin of its step.
fn shown(row: &WeatherRow) -> String {
    let minutes = row.start.div_euclid(60);
    format!(
        "{:02}-{:02} {:02}:{:02}",
        row.month,
        row.day,
        minutes.div_euclid(60),
        minutes.rem_euclid(60)
    )
}

/// Reads an irradiance in W/m2: `None` where it is missing, which an empty field, `nan` and 9999 or above say.
///
/// # Errors
/// It is no number, or negative.
pub(crate) fn irradiance(word: &str, what: &str) -> Result<Option<f64>, String> {
    const MISSING: f64 = 9999.0;
    let word = word.trim();
    if word.is_empty() || word.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    match crate::text::number(word) {
        Some(value) if value >= MISSING => Ok(None),
        Some(value) if value >= 0.0 => Ok(Some(value)),
        _ => Err(format!(
            "{what} is `{}`: expected W/m2, zero or more, or 9999 where it is missing",
            crate::text::shown(word)
        )),
    }
}
