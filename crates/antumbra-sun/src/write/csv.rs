//! CSV: a row for each sensor, with what its bits amount to.

use std::io::{self, Write};
use std::path::Path;

use crate::record::Study;
use crate::sums::Sums;

/// Writes a row for each sensor: its number, counted from 0, place, normal, area, and every list of `sums`; first and
/// last sun by their time where there is one, else by their place. Fields without a value are empty. Bits are not
/// written.
///
/// # Errors
/// The system refuses.
pub fn write_csv(path: &Path, study: &Study, sums: &Sums) -> io::Result<()> {
    antumbra_files::write(path, |error| error, |file| rows(file, study, sums))
}

fn rows(out: &mut impl Write, study: &Study, sums: &Sums) -> io::Result<()> {
    write!(out, "sensor,x,y,z")?;
    if study.normals.is_some() {
        write!(out, ",nx,ny,nz")?;
    }
    let numbers = [
        ("area", &study.areas),
        ("hours", &sums.hours),
        ("longest_hours", &sums.longest),
        ("irradiation_kwh_m2", &sums.irradiation),
        ("diffuse_kwh_m2", &sums.diffuse),
        ("total_kwh_m2", &sums.total),
        ("sky_visible", &sums.sky_visible),
        ("sky_view_factor", &sums.sky_view_factor),
    ];
    let numbers: Vec<_> = numbers
        .into_iter()
        .filter_map(|(name, list)| Some((name, list.as_ref()?)))
        .collect();
    let places = [("first", &sums.first), ("last", &sums.last)];
    let places: Vec<_> = places
        .into_iter()
        .filter_map(|(name, list)| Some((name, list.as_ref()?)))
        .collect();
    for (name, _) in &numbers {
        write!(out, ",{name}")?;
    }
    for (name, _) in &places {
        write!(out, ",{name}")?;
    }
    writeln!(out)?;
    for sensor in antumbra_task::checked(0..study.sensor_count()) {
        let [x, y, z] = study.points[sensor];
        write!(out, "{sensor},{x},{y},{z}")?;
        if let Some(normals) = &study.normals {
            let [x, y, z] = normals[sensor];
            write!(out, ",{x},{y},{z}")?;
        }
        for (_, list) in &numbers {
            write!(out, ",{}", list[sensor])?;
        }
        for (_, list) in &places {
            let place = usize::try_from(list[sensor]).ok();
            let sun = place.and_then(|place| Some((place, study.suns.get(place)?)));
            match sun {
                None => write!(out, ",")?,
                Some((_, sun)) if let Some(time) = sun.time => write!(out, ",{time}")?,
                Some((place, _)) => write!(out, ",{place}")?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
