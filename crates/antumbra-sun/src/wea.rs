//! Weather files of daylight tools (`.wea`), as `epw2wea` and `gendaymtx` of Radiance have them.
//!
//! In: a path. Out: [`Weather`]. Rows name the middle of their step in hours: 0.5 is from 0:00 to 1:00. West is positive
//! in the header: longitude in degrees, and the clock's meridian in degrees west of Greenwich.

use std::path::Path;

use crate::calendar::{DAY_SECONDS, days_in_month};
use crate::error::FileError;
use crate::positions::Location;
use crate::text;
use crate::weather::{Weather, WeatherRow, irradiance};

/// Keys of the header in the order of its numbers: latitude, longitude, clock's meridian, altitude, units.
const KEYS: [&str; 5] = [
    "latitude",
    "longitude",
    "time_zone",
    "site_elevation",
    "weather_data_file_units",
];

/// Seconds of a step where the rows do not say it.
const HOUR: i64 = 3600;

/// Reads a WEA file.
///
/// # Errors
/// A line is not as the format has it, units are not W/m2, a day or a time does not exist, or rows are out of order.
pub fn read_wea(file: &Path) -> Result<Weather, FileError> {
    parse(file, &text::read(file)?)
}

/// Reads the text of a WEA file.
pub(crate) fn parse(file: &Path, text: &str) -> Result<Weather, FileError> {
    let mut header = [None; KEYS.len()];
    // The middle of each step, in seconds of the day, stands for its begin until the step is known.
    let mut rows: Vec<WeatherRow> = Vec::new();
    for (number, line) in text::lines(text) {
        let at = |message: String| FileError::at(file, number, message);
        let mut words = line.split_whitespace();
        let first = words.next().unwrap_or_default();
        if first.starts_with(|c: char| c.is_ascii_digit()) {
            if let Some(missing) = KEYS.iter().zip(header).find(|(_, value)| value.is_none()) {
                return Err(at(format!("expected `{}` before the rows", missing.0)));
            }
            rows.push(row(number, line).map_err(at)?);
            continue;
        }
        let Some(place) = KEYS.iter().position(|&key| key == first) else {
            if first == "place" && rows.is_empty() {
                continue;
            }
            return Err(at(format!(
                "the line begins with `{}`: expected `place`, {} or a row",
                text::shown(first),
                KEYS.join(", ")
            )));
        };
        let value = words.next().and_then(text::number);
        let value = value.ok_or_else(|| at(format!("expected a number behind `{first}`")))?;
        if header[place].replace(value).is_some() {
            return Err(at(format!("`{first}` is there twice")));
        }
    }
    let [
        Some(latitude),
        Some(west),
        Some(meridian_west),
        Some(altitude),
        Some(units),
    ] = header
    else {
        let message = format!("its header is not whole: expected {}", KEYS.join(", "));
        return Err(FileError::whole(file, message));
    };
    if units != 1.0 {
        let message = format!("weather_data_file_units is {units}: expected 1, irradiance in W/m2");
        return Err(FileError::whole(file, message));
    }
    let location = Location::new(latitude, -west, altitude, -meridian_west / 15.0)
        .map_err(|error| FileError::whole(file, error.0))?;
    let step = step(&rows);
    for row in &mut rows {
        row.start -= step / 2;
    }
    Weather::new(file, location, step, rows, Vec::new())
}

/// Returns the least distance of two rows of a day in seconds, at least a minute.
fn step(rows: &[WeatherRow]) -> i64 {
    let of_a_day = rows
        .windows(2)
        .filter(|pair| (pair[0].month, pair[0].day) == (pair[1].month, pair[1].day));
    let distances = of_a_day.map(|pair| pair[1].start - pair[0].start);
    let least = distances.filter(|&distance| distance > 0).min();
    least.unwrap_or(HOUR).max(60)
}

/// Reads a row: month, day, hour, direct normal and diffuse horizontal irradiance.
fn row(line: usize, text: &str) -> Result<WeatherRow, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let &[month, day, hour, direct_normal, diffuse_horizontal] = &words[..] else {
        return Err(format!(
            "the row has {} words: expected month, day, hour, direct normal and diffuse horizontal irradiance",
            words.len()
        ));
    };
    let month = text::whole(month)
        .filter(|month| (1..=12).contains(month))
        .ok_or_else(|| format!("the month is `{}`: expected 1 to 12", text::shown(month)))?
        as u32;
    let most = days_in_month(2000, month) as i32;
    let day = text::whole(day)
        .filter(|day| (1..=most).contains(day))
        .ok_or_else(|| format!("the day is `{}`: expected 1 to {most}", text::shown(day)))?
        as u32;
    let middle = text::number(hour)
        .map(|hour| (hour * 3600.0).round() as i64)
        .filter(|middle| (0..=DAY_SECONDS).contains(middle))
        .ok_or_else(|| format!("the hour is `{}`: expected 0 to 24", text::shown(hour)))?;
    Ok(WeatherRow {
        line,
        year: None,
        month,
        day,
        start: middle,
        direct_normal: irradiance(direct_normal, "the direct normal irradiance")?,
        diffuse_horizontal: irradiance(diffuse_horizontal, "the diffuse horizontal irradiance")?,
    })
}
