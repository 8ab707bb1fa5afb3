//! Which objects take suns away: for each sensor and object the time of the suns that the object is the first to block.
//!
//! In: sensors, suns, their bits. Out: CSV, a row for each sensor and object. Invariants: what is blocked is what the bits
//! say; of several surfaces in the way the one nearest to the sensor counts. The rows are written as they are found, so
//! memory does not grow with sensors. Absent here: names of objects, which whoever has a scene knows.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use antumbra::{Counters, RayBatch, ShadowIndex};
use antumbra_geometry::{DVec3, Ray, ReceiverPoint, SurfaceId};
use antumbra_task::Steps;
use rayon::prelude::*;

use crate::sensors::{Facing, Sensors};
use crate::study::Bits;
use crate::suns::Sun;

/// Answers at a time: some seconds of work.
const CHUNK: usize = 1 << 20;

/// Study whose blockers are asked for.
#[derive(Clone, Copy, Debug)]
pub struct Blockers<'a> {
    /// Surfaces that block.
    pub index: &'a ShadowIndex,
    /// Sensors of the study.
    pub sensors: &'a Sensors,
    /// Suns of the study.
    pub suns: &'a [Sun],
    /// Unit vectors towards them, world space.
    pub directions: &'a [DVec3],
    /// Bits of the study.
    pub bits: &'a Bits,
    /// Whether irradiances belong to the suns.
    pub has_weather: bool,
}

/// Seconds and J/m2 that an object takes from a sensor.
#[derive(Clone, Copy, Default)]
struct Taken {
    seconds: f64,
    joules: f64,
}

/// Writes a row for each sensor and object that blocks suns from it: `sensor`, counted from 0, `blocker`, `hours`, and with
/// weather and normals `irradiation_kwh_m2`. Objects of a sensor are in the order of `names`; `object_of` says the place in
/// `names` of a surface's object. Takes about as long as a ray for each sun that is blocked.
///
/// # Errors
/// The system refuses.
pub fn write_blockers(
    path: &Path,
    of: &Blockers<'_>,
    names: &[String],
    object_of: impl Fn(SurfaceId) -> usize + Sync,
) -> io::Result<()> {
    antumbra_files::write(
        path,
        |error| error,
        |file| rows(file, of, names, &object_of),
    )
}

fn rows(
    out: &mut impl Write,
    of: &Blockers<'_>,
    names: &[String],
    object_of: &(impl Fn(SurfaceId) -> usize + Sync),
) -> io::Result<()> {
    let has_energy = of.has_weather && of.sensors.facing != Facing::All;
    write!(out, "sensor,blocker,hours")?;
    match has_energy {
        true => writeln!(out, ",irradiation_kwh_m2")?,
        false => writeln!(out)?,
    }
    let count = of.sensors.count();
    let length = (CHUNK / of.suns.len().max(1)).max(64);
    let steps = Steps::new("blockers", count.div_ceil(length) as u64);
    for first in (0..count).step_by(length) {
        let sensors = first..count.min(first + length);
        let found = steps.step(|| blocked(of, sensors.clone(), object_of));
        for (sensor, objects) in sensors.zip(found) {
            for (object, Taken { seconds, joules }) in objects {
                write!(
                    out,
                    "{sensor},{},{}",
                    quoted(&names[object]),
                    seconds / 3600.0
                )?;
                match has_energy {
                    true => writeln!(out, ",{}", joules / 3.6e6)?,
                    false => writeln!(out)?,
                }
            }
        }
    }
    Ok(())
}

/// Returns what each object takes from some sensors in a row.
fn blocked(
    of: &Blockers<'_>,
    sensors: Range<usize>,
    object_of: &(impl Fn(SurfaceId) -> usize + Sync),
) -> Vec<BTreeMap<usize, Taken>> {
    let task = antumbra_task::current();
    let of_one = |sensor: usize| {
        antumbra_task::check();
        let occluders = of.index.occluders();
        let start = of.sensors.start(sensor);
        let normal = of.sensors.normal(occluders, sensor).unwrap_or_default();
        let mut taken: BTreeMap<usize, Taken> = BTreeMap::new();
        for (sun, (&to, about)) in of.directions.iter().zip(of.suns).enumerate() {
            if of.bits.is_sunlit(sensor, sun) || !of.sensors.faces(occluders, sensor, to) {
                continue;
            }
            let Some(surface) = first_blocker(of.index, &start, to) else {
                debug_assert!(false, "a sun that is faced and not sunlit is blocked");
                continue;
            };
            let own = taken.entry(object_of(surface)).or_default();
            own.seconds += about.weight;
            let irradiance = about.direct_normal.unwrap_or(0.0) * normal.dot(to).max(0.0);
            own.joules += irradiance * about.weight;
        }
        taken
    };
    sensors
        .into_par_iter()
        .map(|sensor| task.enter(|| of_one(sensor)))
        .collect()
}

/// Returns the opaque surface nearest to a start that blocks a direction, by rounded distances.
fn first_blocker(index: &ShadowIndex, start: &ReceiverPoint, to: DVec3) -> Option<SurfaceId> {
    let ray = Ray {
        origin: start.point,
        direction: to,
        leaves: start.surface,
    };
    let occluders = index.occluders();
    let nearest = index.nearest(&ray, &mut Counters::default())?.surface;
    if occluders.is_opaque(nearest) {
        return Some(nearest);
    }
    // Something see-through is before it.
    let leaves = start.surface.map(|surface| [surface.0]);
    let rays = RayBatch {
        origins: &[start.point.to_array()],
        directions: &[to.to_array()],
        leaves: leaves.as_ref().map(|leaves| &leaves[..]),
    };
    let hits = index.all_hits(&rays).ok()?.hits;
    let mut surfaces = hits.into_iter().map(|hit| hit.surface);
    surfaces.find(|&surface| occluders.is_opaque(surface))
}

/// Returns a name as a field of CSV.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_fields_of_csv() {
        assert_eq!(quoted("wall 3"), "wall 3");
        assert_eq!(quoted("a,b"), "\"a,b\"");
        assert_eq!(quoted("the \"tower\""), "\"the \"\"tower\"\"\"");
    }
}
