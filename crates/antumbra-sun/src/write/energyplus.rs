//! CSV in the layout that EnergyPlus imports as shading (`Schedule:File:Shading`): a row for each step of a year, a column for
//! each surface, with the share of its area that is sunlit.
//!
//! In: a study of suns with times, groups of sensors. Out: a file. Invariants: the rows are those of a whole year, 365
//! days or 366; steps without a sun in the study have 0.

use std::io::{self, Write};
use std::path::Path;

use crate::calendar::{DAY_SECONDS, days_in_month};
use crate::groups::{Groups, sunlit_shares};
use crate::positions::Instant;
use crate::record::Study;
use crate::suns::Sun;

const HOUR: i64 = 3600;

/// Suns whose shares are known at a time.
const BLOCK: usize = 512;

/// Writes the shares of groups at all steps of a year. The first column is the end of each step, as `MM/DD HH:MM`, from
/// `01/01 01:00` to `12/31 24:00` for steps of an hour; the head of the first column is `Surface Name`, as in files that EnergyPlus
/// writes itself. Commas, quotes and line ends in names become `_`. Takes 4 KiB a group beside the study.
///
/// # Errors
/// A sun has no time, suns are not at steps of one length that divides an hour, a step is there twice, or the system
/// refuses.
pub fn write_energyplus(path: &Path, study: &Study, groups: &Groups) -> io::Result<()> {
    let year = Year::of(&study.suns, study.about.instant)?;
    antumbra_files::write(path, |error| error, |file| rows(file, study, groups, &year))
}

/// Checks that suns stand at the steps of a year, before anything is asked about them.
///
/// # Errors
/// As [`write_energyplus`].
pub fn check_energyplus(suns: &[Sun], instant: Instant) -> io::Result<()> {
    Year::of(suns, instant).map(|_| ())
}

/// Steps of a year.
struct Year {
    /// A year of that many days.
    is_leap: bool,
    /// Seconds of a step.
    step: i64,
    /// Steps from the begin of the year, and suns of the study.
    suns: Vec<(usize, usize)>,
}

impl Year {
    fn of(list: &[Sun], instant: Instant) -> io::Result<Self> {
        let refuse = |why: &str| {
            let message =
                format!("{why}: the layout of EnergyPlus has rows at equal steps of a year");
            io::Error::new(io::ErrorKind::InvalidInput, message)
        };
        let first = list.first().map_or(0.0, |sun| sun.weight);
        let step = first as i64;
        let is_even = list.iter().all(|sun| sun.weight == first);
        if !is_even || step as f64 != first || step <= 0 || HOUR % step != 0 || step % 60 != 0 {
            return Err(refuse(
                "suns do not stand for equal steps that divide an hour",
            ));
        }
        let times: Option<Vec<_>> = list.iter().map(|sun| sun.time).collect();
        let times = times.ok_or_else(|| refuse("suns have no times"))?;
        let is_leap = times
            .iter()
            .any(|time| (time.date().1, time.date().2) == (2, 29));
        let behind = match instant {
            Instant::Start => 0,
            Instant::Middle => step / 2,
            Instant::End => step,
        };
        let steps_a_day = DAY_SECONDS / step;
        let mut suns = Vec::with_capacity(times.len());
        for (sun, time) in times.iter().enumerate() {
            let begin = time.second() - behind;
            if begin % step != 0 || begin < 0 {
                return Err(refuse(&format!(
                    "the sun of {time} does not stand at its step"
                )));
            }
            let (_, month, day) = time.date();
            let months = (1..month).map(|month| i64::from(days_in_month(leap(is_leap), month)));
            let day = months.sum::<i64>() + i64::from(day) - 1;
            suns.push(((day * steps_a_day + begin / step) as usize, sun));
        }
        suns.sort_unstable();
        if let Some(pair) = suns.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let why = format!(
                "{} and {} are one step of the year",
                times[pair[0].1], times[pair[1].1]
            );
            return Err(refuse(&why));
        }
        Ok(Self {
            is_leap,
            step,
            suns,
        })
    }
}

/// Returns some year of that length.
fn leap(is_leap: bool) -> i32 {
    if is_leap { 2024 } else { 2023 }
}

fn rows(out: &mut impl Write, study: &Study, groups: &Groups, year: &Year) -> io::Result<()> {
    write!(out, "Surface Name")?;
    for name in &groups.names {
        let fit = |letter: char| match letter {
            ',' | '"' => '_',
            letter if letter.is_control() => '_',
            letter => letter,
        };
        write!(out, ",{}", name.chars().map(fit).collect::<String>())?;
    }
    writeln!(out)?;
    let count = groups.names.len();
    let mut suns = year.suns.iter().peekable();
    // Shares of suns that follow each other, from the first on.
    let (mut shares, mut first) = (Vec::new(), 0);
    let mut number = 0;
    for month in 1..=12 {
        for day in 1..=days_in_month(leap(year.is_leap), month) {
            antumbra_task::check();
            for step in 1..=DAY_SECONDS / year.step {
                let minutes = step * year.step / 60;
                write!(
                    out,
                    "{month:02}/{day:02} {:02}:{:02}",
                    minutes / 60,
                    minutes % 60
                )?;
                match suns.next_if(|&&(place, _)| place == number) {
                    Some(&(_, sun)) => {
                        if !(first..first + shares.len() / count.max(1)).contains(&sun) {
                            first = sun;
                            let end = study.suns.len().min(first + BLOCK);
                            shares = sunlit_shares(study, groups, first..end);
                        }
                        for share in &shares[(sun - first) * count..][..count] {
                            write!(out, ",{share:.8}")?;
                        }
                    }
                    None => (0..count).try_for_each(|_| write!(out, ",0"))?,
                }
                writeln!(out)?;
                number += 1;
            }
        }
    }
    Ok(())
}
