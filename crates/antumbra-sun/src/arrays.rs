//! A study as named arrays: what every format of files writes.
//!
//! In: a [`Study`] and its [`Sums`]. Out: [`Array`]s that borrow them. Absent here: bytes of a format.

use std::io::{self, Write};

use crate::record::Study;
use crate::study::{Bits, le_bytes};
use crate::sums::Sums;

/// Numbers of an array, in C order.
#[derive(Clone, Debug)]
pub(crate) enum Numbers<'a> {
    F64(std::borrow::Cow<'a, [f64]>),
    F32(&'a [f32]),
    I32(&'a [i32]),
    U32(&'a [u32]),
    U8(Vec<u8>),
    /// Seconds since 1970 on the local clock.
    Time(Vec<i64>),
    /// Bits, so many bytes a row.
    Bits(&'a Bits, usize),
}

/// A named array.
#[derive(Clone, Debug)]
pub(crate) struct Array<'a> {
    pub(crate) name: &'static str,
    /// Names of the axes and their lengths.
    pub(crate) axes: Vec<(&'static str, usize)>,
    /// Unit, or meaning of the numbers.
    pub(crate) unit: &'static str,
    pub(crate) numbers: Numbers<'a>,
}

impl Numbers<'_> {
    /// Returns the bytes of a number.
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::F64(_) | Self::Time(_) => 8,
            Self::F32(_) | Self::I32(_) | Self::U32(_) => 4,
            Self::U8(_) | Self::Bits(..) => 1,
        }
    }

    /// Writes the numbers, lowest byte first.
    pub(crate) fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::F64(numbers) => numbers
                .iter()
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Self::F32(numbers) => antumbra_task::checked(numbers.iter())
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Self::I32(numbers) => numbers
                .iter()
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Self::U32(numbers) => numbers
                .iter()
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Self::Time(numbers) => numbers
                .iter()
                .try_for_each(|x| out.write_all(&x.to_le_bytes())),
            Self::U8(numbers) => out.write_all(numbers),
            &Self::Bits(bits, row_bytes) => {
                bits.words.chunks(bits.stride.max(1)).try_for_each(|row| {
                    antumbra_task::check();
                    out.write_all(&le_bytes(row)[..row_bytes])
                })
            }
        }
    }
}

impl Array<'_> {
    /// Returns how many numbers there are.
    pub(crate) fn count(&self) -> usize {
        self.axes.iter().map(|&(_, length)| length).product()
    }
}

/// Returns all arrays of a study.
pub(crate) fn arrays<'a>(study: &'a Study, sums: &'a Sums) -> Vec<Array<'a>> {
    let (sensors, suns) = (study.sensor_count(), study.suns.len());
    let mut all = Vec::new();
    let mut add = |name, axes: &[(&'static str, usize)], unit, numbers| {
        all.push(Array {
            name,
            axes: axes.to_vec(),
            unit,
            numbers,
        });
    };
    let of_sensors = [("sensor", sensors)];
    let of_suns = [("sun", suns)];
    let places = [("sensor", sensors), ("axis", 3)];
    let flat = |rows: &'a [[f64; 3]]| Numbers::F64(rows.as_flattened().into());
    add(
        "points",
        &places,
        "scene unit, world space",
        flat(&study.points),
    );
    if let Some(normals) = &study.normals {
        add(
            "normals",
            &places,
            "unit vectors, world space",
            flat(normals),
        );
    }
    if let Some(surfaces) = &study.surfaces {
        add(
            "surfaces",
            &of_sensors,
            "number of the triangle",
            Numbers::U32(surfaces),
        );
    }
    if let Some(areas) = &study.areas {
        let areas = Numbers::F64(areas.into());
        add("areas", &of_sensors, "scene unit squared", areas);
    }
    let row = suns.div_ceil(8);
    let bits = Numbers::Bits(&study.bits, row);
    let unit = "1 where sunlit, eight suns a byte, the first in the lowest bit";
    add("sunlit", &[("sensor", sensors), ("byte", row)], unit, bits);
    if let Some(shares) = &study.shares {
        let unit = "share of the sun that reaches the sensor, 0 to 1";
        let axes = [("sensor", sensors), ("sun", suns)];
        add("shares", &axes, unit, Numbers::F32(shares));
    }
    let column = |of: fn(&crate::suns::Sun) -> f64| {
        Numbers::F64(study.suns.iter().map(of).collect::<Vec<_>>().into())
    };
    add(
        "azimuth",
        &of_suns,
        "degrees clockwise from north",
        column(|sun| sun.azimuth),
    );
    add(
        "elevation",
        &of_suns,
        "degrees above the horizon",
        column(|sun| sun.elevation),
    );
    let directions = [("sun", suns), ("axis", 3)];
    add(
        "directions",
        &directions,
        "unit vectors towards the sun, world space",
        flat(&study.directions),
    );
    let unit = match study.about.kind {
        crate::suns::SunKind::Suns => "seconds",
        crate::suns::SunKind::Sky => "steradians",
    };
    add("weights", &of_suns, unit, column(|sun| sun.weight));
    if let Some(times) = study
        .suns
        .iter()
        .map(|sun| sun.time)
        .collect::<Option<Vec<_>>>()
    {
        let local = times.iter().map(|time| time.local).collect();
        add(
            "times",
            &of_suns,
            "local standard time",
            Numbers::Time(local),
        );
        let offsets: Vec<f64> = times
            .iter()
            .map(|time| time.offset_minutes.into())
            .collect();
        add(
            "utc_offsets",
            &of_suns,
            "minutes ahead of UTC",
            Numbers::F64(offsets.into()),
        );
    }
    if study.about.has_weather {
        let direct = column(|sun| sun.direct_normal.unwrap_or(f64::NAN));
        add("direct_normal", &of_suns, "W/m2, NaN where missing", direct);
    }
    let mut add_sum = |name, unit, list: &'a Option<Vec<f64>>| {
        if let Some(list) = list {
            add(name, &of_sensors, unit, Numbers::F64(list.into()));
        }
    };
    add_sum("hours", "hours of sun", &sums.hours);
    add_sum(
        "longest",
        "hours without a break within a day",
        &sums.longest,
    );
    add_sum("irradiation", "kWh/m2, direct", &sums.irradiation);
    add_sum(
        "diffuse_irradiation",
        "kWh/m2, isotropic sky",
        &sums.diffuse,
    );
    add_sum(
        "total_irradiation",
        "kWh/m2, direct and diffuse",
        &sums.total,
    );
    add_sum(
        "sky_visible",
        "share of the sky's solid angle",
        &sums.sky_visible,
    );
    add_sum(
        "sky_view_factor",
        "share of the light of an even sky",
        &sums.sky_view_factor,
    );
    for (name, list) in [("first", &sums.first), ("last", &sums.last)] {
        if let Some(list) = list {
            add(
                name,
                &of_sensors,
                "place of the sun, -1 for none",
                Numbers::I32(list),
            );
        }
    }
    all
}
