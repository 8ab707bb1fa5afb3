//! Lists of suns in CSV files.
//!
//! In: a path. Out: [`Suns`]. The first line names the columns: `azimuth` and `elevation` in degrees, and perhaps `time`,
//! `hours` and `weight`, in any order. Times are those of the local clock; an offset from UTC tells the two hours apart
//! that a clock shows twice when daylight saving ends.

use std::path::Path;

use crate::calendar::Time;
use crate::error::FileError;
use crate::suns::{Sun, SunKind, Suns};
use crate::text;
use crate::weather::irradiance;

/// Columns that are read.
const COLUMNS: [&str; 5] = ["azimuth", "elevation", "time", "hours", "weight"];

/// Most hours that a sun stands for.
const MOST_HOURS: f64 = 8784.0;

/// Reads a list of suns. `step` is how many minutes each stands for if there is no column `hours`.
///
/// # Errors
/// A column is missing or there twice, or a row has no number where one is due, or times are not in order.
pub fn read_suns(file: &Path, step: u32) -> Result<Suns, FileError> {
    parse(file, &text::read(file)?, step)
}

/// Reads the text of a list of suns.
pub(crate) fn parse(file: &Path, text: &str, step: u32) -> Result<Suns, FileError> {
    let mut lines = text::lines(text);
    let mut suns = Suns::new(SunKind::Suns);
    let Some((number, head)) = lines.next() else {
        let message = "it is empty: expected a line with the columns `azimuth` and `elevation`";
        return Err(FileError::whole(file, message));
    };
    let mut places = [None; COLUMNS.len()];
    let mut unused = Vec::new();
    let head = text::fields(head);
    for (place, name) in head.iter().enumerate() {
        let plain = name.to_ascii_lowercase();
        match COLUMNS.iter().position(|&column| column == plain) {
            Some(column) if places[column].replace(place).is_some() => {
                let message = format!("the column `{plain}` is there twice");
                return Err(FileError::at(file, number, message));
            }
            Some(_) => {}
            None => unused.push(format!("`{}`", text::shown(name))),
        }
    }
    let [Some(azimuth), Some(elevation), time, hours, weight] = places else {
        let message = format!(
            "expected a line with the columns `azimuth` and `elevation`, found `{}`",
            text::shown(&head.join(","))
        );
        return Err(FileError::at(file, number, message));
    };
    if !unused.is_empty() {
        let names = text::shown(&unused.join(", "));
        suns.notes.push(format!(
            "{}: columns that play no part: {names}; those that do are {}",
            file.display(),
            COLUMNS.join(", ")
        ));
    }
    suns.has_weather = weight.is_some();
    let mut before: Option<(Time, usize)> = None;
    for (number, line) in lines {
        let at = |message: String| FileError::at(file, number, message);
        let fields = text::fields(line);
        if fields.len() != head.len() {
            return Err(at(format!(
                "the row has {} fields: expected {}, as the first line",
                fields.len(),
                head.len()
            )));
        }
        let degrees = |place: usize, what: &str, most: f64| {
            let value = text::number(&fields[place]).filter(|value| value.abs() <= most);
            value.ok_or_else(|| {
                let found = text::shown(&fields[place]);
                at(format!(
                    "the {what} is `{found}`: expected -{most} to {most} degrees"
                ))
            })
        };
        let seconds = match hours {
            None => 60.0 * f64::from(step),
            Some(place) => {
                let hours = text::number(&fields[place]);
                let hours = hours.filter(|hours| (0.0..=MOST_HOURS).contains(hours));
                3600.0
                    * hours.ok_or_else(|| {
                        let found = text::shown(&fields[place]);
                        at(format!(
                            "the column `hours` has `{found}`: expected 0 to {MOST_HOURS}"
                        ))
                    })?
            }
        };
        let moment = match time {
            None => None,
            Some(place) => Some(Time::parse(&fields[place]).ok_or_else(|| {
                let found = text::shown(&fields[place]);
                at(format!(
                    "the time is `{found}`: expected such as 2024-06-21T12:30 or 2024-06-21T12:30:00+02:00"
                ))
            })?),
        };
        if let Some(moment) = moment {
            if let Some((earlier, line)) = before
                && moment.utc() <= earlier.utc()
            {
                return Err(at(format!(
                    "the time {moment} is not after that of line {line}, {earlier}: expected times in order; where a clock shows an hour twice, add offsets such as +02:00"
                )));
            }
            before = Some((moment, number));
        }
        let direct_normal = match weight {
            None => None,
            Some(place) => irradiance(&fields[place], "the weight").map_err(at)?,
        };
        suns.push(Sun {
            azimuth: degrees(azimuth, "azimuth", 3600.0)?,
            elevation: degrees(elevation, "elevation", 90.0)?,
            weight: seconds,
            time: moment,
            direct_normal,
        });
    }
    let missing = suns.missing();
    if missing > 0 {
        suns.notes.push(format!(
            "{}: {missing} suns have no weight: sums count them as 0",
            file.display()
        ));
    }
    Ok(suns)
}
