//! EnergyPlus weather files (`.epw`).
//!
//! In: a path. Out: [`Weather`]. Rows name the end of their step: hour 1 is from 0:00 to 1:00. Their clock is standard
//! time, whatever daylight saving the header names (Auxiliary Programs, "EnergyPlus Weather File Data Dictionary").

use std::path::Path;

use crate::calendar::{DAY_SECONDS, days_in_month};
use crate::error::{BadSetting, FileError};
use crate::positions::Location;
use crate::text;
use crate::weather::{Weather, WeatherRow, irradiance};

/// Fields of a row, by their place.
const DIRECT_NORMAL: usize = 14;
const DIFFUSE_HORIZONTAL: usize = 15;

/// Reads an EPW file.
///
/// # Errors
/// A line is not as the format has it, a day or a time does not exist, or rows are out of order.
pub fn read_epw(file: &Path) -> Result<Weather, FileError> {
    parse(file, &text::read(file)?)
}

/// Reads the text of an EPW file.
pub(crate) fn parse(file: &Path, text: &str) -> Result<Weather, FileError> {
    let mut lines = text::lines(text);
    let mut location = None;
    let mut notes = Vec::new();
    let per_hour = loop {
        let Some((number, line)) = lines.next() else {
            let message = "it ends before its line `DATA PERIODS`: expected an EPW file";
            return Err(FileError::whole(file, message));
        };
        let fields = text::fields(line);
        let at = |message: String| FileError::at(file, number, message);
        match fields[0].to_ascii_uppercase().as_str() {
            "LOCATION" => location = Some(place(&fields).map_err(|error| at(error.0))?),
            "HOLIDAYS/DAYLIGHT SAVINGS" => {
                let is_date = |field: &String| !matches!(field.as_str(), "" | "0");
                if fields
                    .get(2..4)
                    .is_some_and(|dates| dates.iter().all(is_date))
                {
                    notes.push(format!(
                        "{}: the header names daylight saving time; rows are standard time, and so are all times",
                        file.display()
                    ));
                }
            }
            "DATA PERIODS" => {
                let count = fields.get(2).and_then(|field| text::whole(field));
                let fits = |&count: &i32| (1..=60).contains(&count) && 60 % count == 0;
                break count.filter(fits).ok_or_else(|| {
                    at("expected the rows of an hour, a divisor of 60, as third field".to_owned())
                })?;
            }
            first if first.starts_with(|c: char| c.is_ascii_digit()) => {
                return Err(at(
                    "expected a line `DATA PERIODS` before the rows".to_owned()
                ));
            }
            _ => {}
        }
    };
    let Some(location) = location else {
        return Err(FileError::whole(
            file,
            "it has no line `LOCATION`: expected an EPW file",
        ));
    };
    let step = i64::from(60 / per_hour);
    let mut rows = Vec::new();
    for (number, line) in lines {
        let row =
            row(number, line, step).map_err(|message| FileError::at(file, number, message))?;
        rows.push(row);
    }
    Weather::new(file, location, step * 60, rows, notes)
}

/// Reads the place: the last four fields, since names may hold commas.
fn place(fields: &[String]) -> Result<Location, BadSetting> {
    let numbers = fields.len().checked_sub(4).filter(|&first| first > 0);
    let numbers = numbers.map(|first| fields[first..].iter().map(|field| text::number(field)));
    match numbers
        .map(|numbers| numbers.collect::<Vec<_>>())
        .as_deref()
    {
        Some(
            &[
                Some(latitude),
                Some(longitude),
                Some(timezone),
                Some(altitude),
            ],
        ) => Location::new(latitude, longitude, altitude, timezone),
        _ => Err(BadSetting(
            "expected `LOCATION` to end in latitude, longitude, time zone and altitude".to_owned(),
        )),
    }
}

/// Reads a row; `step` is in minutes.
fn row(line: usize, text: &str, step: i64) -> Result<WeatherRow, String> {
    let fields: Vec<&str> = text.split(',').collect();
    if fields.len() <= DIFFUSE_HORIZONTAL {
        return Err(format!(
            "the row has {} fields: expected {} or more",
            fields.len(),
            DIFFUSE_HORIZONTAL + 1
        ));
    }
    let whole = |at: usize, what: &str, range: std::ops::RangeInclusive<i32>| {
        let value = text::whole(fields[at]).filter(|value| range.contains(value));
        value.ok_or_else(|| {
            format!(
                "the {what} is `{}`: expected {} to {}",
                text::shown(fields[at].trim()),
                range.start(),
                range.end()
            )
        })
    };
    let year = whole(0, "year", 1..=2999)?;
    let month = whole(1, "month", 1..=12)? as u32;
    // A leap day may stand in a year that has none, where the years of months are mixed.
    let day = whole(2, "day", 1..=days_in_month(2000, month) as i32)? as u32;
    let hour = i64::from(whole(3, "hour", 1..=24)?);
    let mut minute = i64::from(whole(4, "minute", 0..=60)?);
    if step == 60 {
        // Hourly files write 0, 60 or, from older tools, 30: the whole hour is meant.
        minute = 60;
    } else if minute == 0 || minute % step != 0 {
        return Err(format!(
            "the minute is {minute}: expected {step}, {} and so on up to 60, the end of the step",
            2 * step
        ));
    }
    let end = (hour - 1) * 3600 + minute * 60;
    debug_assert!(end <= DAY_SECONDS);
    Ok(WeatherRow {
        line,
        year: Some(year),
        month,
        day,
        start: end - step * 60,
        direct_normal: irradiance(fields[DIRECT_NORMAL], "the direct normal irradiance")?,
        diffuse_horizontal: irradiance(
            fields[DIFFUSE_HORIZONTAL],
            "the diffuse horizontal irradiance",
        )?,
    })
}
