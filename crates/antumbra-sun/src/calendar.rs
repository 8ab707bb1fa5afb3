//! Dates and times of day at a fixed offset from UTC.
//!
//! In: years, months, days. Out: seconds since 1970, and back. Invariants: the calendar is the proleptic Gregorian
//! one; a day has 86,400 seconds. Absent here: daylight saving and leap seconds.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Seconds of a day.
pub(crate) const DAY_SECONDS: i64 = 86_400;

/// Years that have a solar position: those with an estimate of the Earth's rotation.
pub const YEARS: std::ops::RangeInclusive<i32> = 1..=2999;

/// Returns whether a year has a 29th of February.
pub(crate) fn is_leap(year: i32) -> bool {
    (year % 4 == 0 && year % 100 != 0) || year % 400 == 0
}

/// Returns how many days a month has; 0 for a month that does not exist.
pub(crate) fn days_in_month(year: i32, month: u32) -> u32 {
    match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 if is_leap(year) => 29,
        2 => 28,
        _ => 0,
    }
}

/// Returns the days from 1970-01-01 to a date that exists.
pub(crate) fn days_since_1970(year: i32, month: u32, day: u32) -> i64 {
    // Years begin in March, so that the leap day is the last one.
    let shifted = i64::from(year) - i64::from(month <= 2);
    let era = shifted.div_euclid(400);
    let of_era = shifted.rem_euclid(400);
    let from_march = i64::from((month + 9) % 12);
    let day_of_year = (153 * from_march + 2) / 5 + i64::from(day) - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + day_of_year - 719_468
}

/// Moment, and the offset from UTC of the clock that shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Time {
    /// Seconds since 1970-01-01T00:00:00 on that clock.
    pub local: i64,
    /// Minutes that the clock is ahead of UTC.
    pub offset_minutes: i32,
}

impl Time {
    /// Returns the time of a date that exists and a second of the day.
    pub fn new(date: [i32; 3], second: i64, offset_minutes: i32) -> Option<Self> {
        let [year, month, day] = date;
        let (month, day) = (u32::try_from(month).ok()?, u32::try_from(day).ok()?);
        let exists = YEARS.contains(&year) && (1..=days_in_month(year, month)).contains(&day);
        exists.then(|| Self {
            local: days_since_1970(year, month, day) * DAY_SECONDS + second,
            offset_minutes,
        })
    }

    /// Returns the seconds since 1970 in UTC.
    pub fn utc(self) -> i64 {
        self.local - 60 * i64::from(self.offset_minutes)
    }

    /// Returns the number of the local day, counted from 1970-01-01.
    pub fn day(self) -> i64 {
        self.local.div_euclid(DAY_SECONDS)
    }

    /// Returns year, month and day of the local clock.
    pub fn date(self) -> (i32, u32, u32) {
        let shifted = self.day() + 719_468;
        let era = shifted.div_euclid(146_097);
        let of_era = shifted.rem_euclid(146_097);
        let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year + year / 4 - year / 100);
        let from_march = (5 * of_year + 2) / 153;
        let day = of_year - (153 * from_march + 2) / 5 + 1;
        let month = (from_march + 2) % 12 + 1;
        let year = year + era * 400 + i64::from(month <= 2);
        (year as i32, month as u32, day as u32)
    }

    /// Returns the second of the local day.
    pub fn second(self) -> i64 {
        self.local.rem_euclid(DAY_SECONDS)
    }

    /// Reads `2024-06-21T12:30`, with seconds and an offset such as `+02:00` or `Z` or without; a space may stand
    /// for the `T`. Returns `None` for anything else, and for days that do not exist.
    pub fn parse(text: &str) -> Option<Self> {
        let (date, clock) = text.trim().split_once(['T', ' '])?;
        let mut parts = date.split('-').map(digits);
        let date = [parts.next()??, parts.next()??, parts.next()??];
        if parts.next().is_some() {
            return None;
        }
        let (clock, offset) = match clock.find(['+', '-', 'Z']) {
            Some(at) => (&clock[..at], offset(&clock[at..])?),
            None => (clock, 0),
        };
        let mut parts = clock.split(':');
        let (hour, minute) = (digits(parts.next()?)?, digits(parts.next()?)?);
        let second = match parts.next() {
            // Tools write `12:30:00.000`; what is no whole second has no place here.
            Some(second) => match second.split_once('.') {
                Some((whole, part)) if part.bytes().all(|b| b == b'0') => digits(whole)?,
                Some(_) => return None,
                None => digits(second)?,
            },
            None => 0,
        };
        let is_time = hour < 24 && minute < 60 && second < 60 && parts.next().is_none();
        let second = i64::from(hour) * 3600 + i64::from(minute) * 60 + i64::from(second);
        is_time.then(|| Self::new(date, second, offset))?
    }
}

/// Reads digits alone, at most nine.
fn digits(text: &str) -> Option<i32> {
    let fits = (1..=9).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    fits.then(|| text.parse().ok())?
}

/// Reads `Z`, `+02:00` or `-0530`, in minutes.
fn offset(text: &str) -> Option<i32> {
    if text == "Z" {
        return Some(0);
    }
    let sign = if text.starts_with('-') { -1 } else { 1 };
    let plain: String = text[1..].chars().filter(|&c| c != ':').collect();
    if plain.len() != 4 {
        return None;
    }
    let (hours, minutes) = (digits(&plain[..2])?, digits(&plain[2..])?);
    (hours <= 14 && minutes < 60).then_some(sign * (60 * hours + minutes))
}

/// `2024-06-21T12:30:00`, as the local clock shows it.
impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = self.date();
        let second = self.second();
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
        )
    }
}

/// Days of the year from one to another, both included; may run over the end of the year.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dates {
    /// Month and day of the first.
    pub first: (u32, u32),
    /// Month and day of the last.
    pub last: (u32, u32),
}

impl Dates {
    /// Returns whether a day of the year is one of them.
    pub fn contains(&self, month: u32, day: u32) -> bool {
        let day = (month, day);
        match self.first <= self.last {
            true => self.first <= day && day <= self.last,
            false => self.first <= day || day <= self.last,
        }
    }

    /// Reads `MM-DD` or `MM-DD..MM-DD`.
    ///
    /// # Errors
    /// It is something else, or no such day exists in a leap year.
    pub fn parse(text: &str) -> Result<Self, String> {
        let day = |text: &str| {
            let (month, day) = text.trim().split_once('-')?;
            let (month, day) = (digits(month)? as u32, digits(day)? as u32);
            // 2000 has every day of the year.
            (1..=days_in_month(2000, month))
                .contains(&day)
                .then_some((month, day))
        };
        let (first, last) = text.split_once("..").unwrap_or((text, text));
        match (day(first), day(last)) {
            (Some(first), Some(last)) => Ok(Self { first, last }),
            _ => Err(format!(
                "expected MM-DD or MM-DD..MM-DD, such as 06-21, found `{text}`"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_three_thousand_years_is_counted_once() {
        let mut expected = days_since_1970(1, 1, 1);
        for year in YEARS {
            for month in 1..=12 {
                for day in 1..=days_in_month(year, month) {
                    let date = [year, month as i32, day as i32];
                    let time = Time::new(date, 86_399, 0).unwrap();
                    assert_eq!((time.day(), time.second()), (expected, 86_399));
                    assert_eq!(time.date(), (year, month, day));
                    expected += 1;
                }
            }
        }
        assert_eq!(days_since_1970(1970, 1, 1), 0);
        assert_eq!(days_since_1970(2000, 3, 1), 11_017);
    }

    #[test]
    fn times_are_read_with_their_offset_or_refused() {
        let read = |text| Time::parse(text).map(|time| (time.to_string(), time.utc()));
        let noon = days_since_1970(2024, 6, 21) * DAY_SECONDS + 43_200;
        let shown = "2024-06-21T12:00:00".to_owned();
        for (text, utc) in [
            ("2024-06-21T12:00", noon),
            ("2024-06-21 12:00:00.000", noon),
            ("2024-06-21T12:00:00Z", noon),
            ("2024-06-21T12:00:00+02:00", noon - 7200),
            ("2024-06-21T12:00:00-0530", noon + 19_800),
        ] {
            assert_eq!(read(text), Some((shown.clone(), utc)), "{text}");
        }
        for bad in [
            "",
            "2024-06-21",
            "2023-02-29T00:00",
            "2024-06-31T00:00",
            "2024-06-21T24:00",
            "2024-06-21T12:60",
            "2024-06-21T12:00:00.5",
            "2024-06-21T12:00+15:00",
            "2024-06-21T12:00+2",
            "2024-06-21T12:00+é",
            "0-1-1T0:0",
            "9999999999-01-01T00:00",
            "2024-06-21T12:00:00:00",
        ] {
            assert_eq!(read(bad), None, "{bad}");
        }
        assert!(Time::parse("2024-02-29T00:00").is_some());
    }

    #[test]
    fn ranges_of_days_may_run_over_the_end_of_the_year() {
        let winter = Dates::parse("12-21..01-06").unwrap();
        assert!(winter.contains(12, 31) && winter.contains(1, 6) && !winter.contains(6, 1));
        let one = Dates::parse("02-29").unwrap();
        assert!(one.contains(2, 29) && !one.contains(2, 28) && !one.contains(3, 1));
        for bad in ["", "13-01", "02-30", "6/21", "06-21..", "06-21..x", "0-0"] {
            assert!(
                Dates::parse(bad).unwrap_err().contains("expected MM-DD"),
                "{bad}"
            );
        }
    }
}
