//! What bits amount to: hours, spans, irradiation, shares of the sky.
//!
//! In: a [`Study`]. Out: numbers, one a sensor. Invariants: no ray is traced; times of whole seconds are summed without
//! rounding; the same for any number of threads.

use antumbra_geometry::DVec3;
use rayon::prelude::*;

use crate::record::Study;
use crate::suns::SunKind;

/// Sensors that a thread takes at a time.
const PIECE: usize = 256;

/// Numbers of each sensor of a study. A list is `None` where the study lacks what it needs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums {
    /// Hours of sun.
    pub hours: Option<Vec<f64>>,
    /// Place of the first sun that reaches the sensor, in the order of the suns; -1 for none.
    pub first: Option<Vec<i32>>,
    /// Place of the last one; -1 for none.
    pub last: Option<Vec<i32>>,
    /// Longest time without a break within one day of the local clock, hours. Needs times.
    pub longest: Option<Vec<f64>>,
    /// Direct irradiation, kWh/m2: direct normal irradiance times the cosine of its angle with the sensor's normal,
    /// over time. Missing irradiances count as 0. Needs weather and normals.
    pub irradiation: Option<Vec<f64>>,
    /// Share of the sky's solid angle that is visible, 0 to 1. Of patches of the sky.
    pub sky_visible: Option<Vec<f64>>,
    /// Sky view factor: the share of the light of an even sky that a level surface in the open would get. Of patches
    /// of the sky; needs normals.
    pub sky_view_factor: Option<Vec<f64>>,
}

/// Returns the numbers of each sensor.
pub fn sums(study: &Study) -> Sums {
    const HOUR: f64 = 3600.0;
    let weights: Vec<f64> = study.suns.iter().map(|sun| sun.weight).collect();
    // Not `sum`: that of nothing is -0.
    let total = |words: &[u64]| ones(words).fold(0.0, |sum, sun| sum + weights[sun]);
    match study.about.kind {
        SunKind::Suns => {
            let first = each(study, |_, words| {
                ones(words).next().map_or(-1, |sun| sun as i32)
            });
            let last = each(study, |_, words| {
                ones(words).last().map_or(-1, |sun| sun as i32)
            });
            Sums {
                hours: Some(each(study, |_, words| total(words) / HOUR)),
                first: Some(first),
                last: Some(last),
                longest: longest(study),
                irradiation: irradiation(study),
                ..Sums::default()
            }
        }
        SunKind::Sky => {
            let whole: f64 = weights.iter().sum();
            Sums {
                sky_visible: Some(each(study, |_, words| total(words) / whole)),
                sky_view_factor: sky_view_factor(study),
                ..Sums::default()
            }
        }
    }
}

/// Works out a number for each sensor on all threads.
fn each<T: Send>(study: &Study, of: impl Fn(usize, &[u64]) -> T + Sync) -> Vec<T> {
    let task = antumbra_task::current();
    let count = study.sensor_count();
    let pieces: Vec<Vec<T>> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| {
            task.enter(|| {
                antumbra_task::check();
                let sensors = piece * PIECE..count.min((piece + 1) * PIECE);
                sensors
                    .map(|sensor| of(sensor, study.bits.of(sensor)))
                    .collect()
            })
        })
        .collect();
    pieces.into_iter().flatten().collect()
}

/// Returns the places of bits that are 1, in order.
fn ones(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(place, &word)| {
        let mut rest = word;
        std::iter::from_fn(move || {
            let bit = rest.trailing_zeros() as usize;
            (rest != 0).then(|| {
                rest &= rest - 1;
                64 * place + bit
            })
        })
    })
}

/// Returns the sum of weighted directions of suns that reach a sensor, along its normal. Bits are 0 for suns behind the
/// sensor, so no cosine is negative but by rounding.
fn projected(study: &Study, weighted: &[DVec3], sensor: usize, words: &[u64]) -> Option<f64> {
    let normal = DVec3::from_array(study.normals.as_ref()?[sensor]);
    let sum: DVec3 = ones(words).map(|sun| weighted[sun]).sum();
    // And no -0.
    Some(normal.dot(sum).max(0.0) + 0.0)
}

fn irradiation(study: &Study) -> Option<Vec<f64>> {
    const JOULES_A_KWH: f64 = 3.6e6;
    if !study.about.has_weather {
        return None;
    }
    study.normals.as_ref()?;
    let weighted: Vec<DVec3> = study
        .suns
        .iter()
        .zip(&study.directions)
        .map(|(sun, &to)| {
            DVec3::from_array(to) * (sun.direct_normal.unwrap_or(0.0) * sun.weight / JOULES_A_KWH)
        })
        .collect();
    Some(each(study, |sensor, words| {
        projected(study, &weighted, sensor, words).unwrap_or_default()
    }))
}

fn sky_view_factor(study: &Study) -> Option<Vec<f64>> {
    study.normals.as_ref()?;
    let directions = study.directions.iter().map(|&to| DVec3::from_array(to));
    let weighted: Vec<DVec3> = directions
        .zip(&study.suns)
        .map(|(to, patch)| to * patch.weight)
        .collect();
    // A level surface in the open: pi, up to the size of patches.
    let up = DVec3::from_array(study.about.up).normalize_or_zero();
    let open = weighted.iter().sum::<DVec3>().dot(up);
    Some(each(study, |sensor, words| {
        projected(study, &weighted, sensor, words).unwrap_or_default() / open
    }))
}

/// Returns the longest time without a break: suns that follow each other within a day, each step of time next to the
/// one before.
fn longest(study: &Study) -> Option<Vec<f64>> {
    let times: Option<Vec<_>> = study.suns.iter().map(|sun| sun.time).collect();
    let times = times?;
    // Whether a sun goes on where the one before ends.
    let goes_on: Vec<bool> = (0..times.len())
        .map(|sun| {
            sun > 0 && {
                let between = (times[sun].utc() - times[sun - 1].utc()) as f64;
                let half_steps = (study.suns[sun].weight + study.suns[sun - 1].weight) / 2.0;
                // Rows name whole seconds.
                between <= half_steps + 1.0 && times[sun].day() == times[sun - 1].day()
            }
        })
        .collect();
    Some(each(study, |_, words| {
        let (mut most, mut span, mut before) = (0.0_f64, 0.0, None);
        for sun in ones(words) {
            let is_next = before.is_some_and(|before: usize| before + 1 == sun) && goes_on[sun];
            span = if is_next { span } else { 0.0 } + study.suns[sun].weight;
            most = most.max(span);
            before = Some(sun);
        }
        most / 3600.0
    }))
}
