//! Sums of bits: hours, spans, irradiation, shares of the sky.
//!
//! In: a [`Study`]. Out: numbers, one a sensor. Invariants: no ray is traced; times of whole seconds are summed without
//! rounding; the same for any number of threads. Where suns reach sensors in part, their shares count in place of bits, but
//! for the first and the last sun and the longest time.

use antumbra_geometry::DVec3;
use rayon::prelude::*;

use crate::record::Study;
use crate::suns::SunKind;

/// Sensors that a thread takes at a time.
const PIECE: usize = 1024;

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
    /// Diffuse irradiation of an isotropic sky, kWh/m2: the sky view factor times the diffuse horizontal irradiation (Liu and
    /// Jordan, 1963). What the ground reflects is left out.
    pub diffuse: Option<Vec<f64>>,
    /// Direct and diffuse irradiation together, kWh/m2.
    pub total: Option<Vec<f64>>,
    /// Share of the sky's solid angle that is visible, 0 to 1. Of patches of the sky.
    pub sky_visible: Option<Vec<f64>>,
    /// Sky view factor: the share of the light of an even sky that a level surface in the open would get. Of patches
    /// of the sky, or where the sky's light counts; needs normals.
    pub sky_view_factor: Option<Vec<f64>>,
}

/// Returns the numbers of each sensor.
pub fn sums(study: &Study) -> Sums {
    match study.about.kind {
        SunKind::Suns => of_suns(study),
        SunKind::Sky => {
            let whole: f64 = study.suns.iter().map(|patch| patch.weight).sum();
            let seen = totals(study).into_iter();
            Sums {
                sky_visible: Some(seen.map(|solid| solid / whole).collect()),
                sky_view_factor: sky_view_factor(study),
                ..Sums::default()
            }
        }
    }
}

fn of_suns(study: &Study) -> Sums {
    const HOUR: f64 = 3600.0;
    let irradiation = irradiation(study);
    let diffuse = diffuse(study);
    let total = irradiation
        .as_ref()
        .zip(diffuse.as_ref())
        .map(|(direct, diffuse)| {
            let both = direct.iter().zip(diffuse);
            both.map(|(direct, diffuse)| direct + diffuse).collect()
        });
    let seconds = totals(study).into_iter();
    Sums {
        hours: Some(seconds.map(|seconds| seconds / HOUR).collect()),
        first: Some(each(study, |words| {
            let word = words.iter().position(|&word| word != 0);
            word.map_or(-1, |at| {
                (64 * at) as i32 + words[at].trailing_zeros() as i32
            })
        })),
        last: Some(each(study, |words| {
            let word = words.iter().rposition(|&word| word != 0);
            word.map_or(-1, |at| {
                (64 * at + 63) as i32 - words[at].leading_zeros() as i32
            })
        })),
        longest: longest(study),
        irradiation,
        diffuse,
        total,
        sky_view_factor: study.sky_view_factor.clone(),
        ..Sums::default()
    }
}

/// Works out numbers of sensors on all threads, some sensors in a row at a time.
fn pieces<T: Send>(study: &Study, of: impl Fn(std::ops::Range<usize>) -> Vec<T> + Sync) -> Vec<T> {
    let task = antumbra_task::current();
    let count = study.sensor_count();
    let pieces: Vec<Vec<T>> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| task.enter(|| of(piece * PIECE..count.min((piece + 1) * PIECE))))
        .collect();
    pieces.into_iter().flatten().collect()
}

/// Works out a number of each sensor from its words.
fn each<T: Send>(study: &Study, of: impl Fn(&[u64]) -> T + Sync) -> Vec<T> {
    pieces(study, |sensors| {
        antumbra_task::check();
        sensors.map(|sensor| of(study.bits.of(sensor))).collect()
    })
}

/// Returns the sum of vectors, one a sun, over the suns that reach each sensor.
///
/// Eight suns at a time: the sums of all 256 choices of them are made once for some sensors, each of which then adds one.
fn vector_sums(study: &Study, vectors: &[DVec3]) -> Vec<DVec3> {
    pieces(study, |sensors| {
        let mut sums = vec![DVec3::ZERO; sensors.len()];
        let mut choices = [DVec3::ZERO; 256];
        for (byte, vectors) in vectors.chunks(8).enumerate() {
            antumbra_task::check();
            for choice in 1..1_usize << vectors.len() {
                let rest = choices[choice & (choice - 1)];
                choices[choice] = rest + vectors[choice.trailing_zeros() as usize];
            }
            for (sum, sensor) in sums.iter_mut().zip(sensors.clone()) {
                let word = study.bits.words[sensor * study.bits.stride + byte / 8];
                *sum += choices[(word >> (8 * (byte % 8)) & 0xff) as usize];
            }
        }
        sums
    })
}

/// Works out a number of each sensor from its shares; `None` where bits say all.
fn each_by_shares(study: &Study, of: impl Fn(usize, &[f32]) -> f64 + Sync) -> Option<Vec<f64>> {
    study.shares.as_ref()?;
    Some(pieces(study, |sensors| {
        let number = |sensor| Some(of(sensor, study.shares_of(sensor)?));
        antumbra_task::checked(sensors).filter_map(number).collect()
    }))
}

/// Returns the sum of the weights of the suns that reach each sensor.
fn totals(study: &Study) -> Vec<f64> {
    let by_shares = each_by_shares(study, |_, shares| {
        let shares = shares.iter().zip(&study.suns);
        shares
            .map(|(&share, sun)| f64::from(share) * sun.weight)
            .sum()
    });
    if let Some(totals) = by_shares {
        return totals;
    }
    let first = study.suns.first().map_or(0.0, |sun| sun.weight);
    if study.suns.iter().all(|sun| sun.weight == first) {
        return each(study, |words| {
            first
                * words
                    .iter()
                    .map(|word| f64::from(word.count_ones()))
                    .sum::<f64>()
        });
    }
    let weights: Vec<DVec3> = study.suns.iter().map(|sun| DVec3::X * sun.weight).collect();
    vector_sums(study, &weights)
        .into_iter()
        .map(|sum| sum.x)
        .collect()
}

/// Returns the sum of weighted directions of suns that reach a sensor, along its normal. Bits are 0 for suns behind the
/// sensor, so no sum is negative but by rounding.
fn projected(study: &Study, weighted: &[DVec3]) -> Option<Vec<f64>> {
    let normals = study.normals.as_ref()?;
    let by_shares = each_by_shares(study, |sensor, shares| {
        let normal = DVec3::from_array(normals[sensor]);
        let shares = shares
            .iter()
            .zip(weighted)
            .filter(|&(&share, _)| share > 0.0);
        // Of a sun with a size a part may be seen while its middle is behind the sensor.
        shares
            .map(|(&share, &to)| f64::from(share) * normal.dot(to).max(0.0))
            .sum()
    });
    if by_shares.is_some() {
        return by_shares;
    }
    let sums = vector_sums(study, weighted).into_iter().zip(normals);
    // No -0, either.
    Some(
        sums.map(|(sum, &normal)| DVec3::from_array(normal).dot(sum).max(0.0) + 0.0)
            .collect(),
    )
}

fn irradiation(study: &Study) -> Option<Vec<f64>> {
    const JOULES_A_KWH: f64 = 3.6e6;
    if !study.about.has_weather {
        return None;
    }
    let suns = study.suns.iter().zip(&study.directions);
    let weighted: Vec<DVec3> = suns
        .map(|(sun, &to)| {
            DVec3::from_array(to) * (sun.direct_normal.unwrap_or(0.0) * sun.weight / JOULES_A_KWH)
        })
        .collect();
    projected(study, &weighted)
}

fn diffuse(study: &Study) -> Option<Vec<f64>> {
    let horizontal = study.about.diffuse.as_ref()?.horizontal;
    let factors = study.sky_view_factor.as_ref()?;
    Some(factors.iter().map(|factor| factor * horizontal).collect())
}

fn sky_view_factor(study: &Study) -> Option<Vec<f64>> {
    let directions = study.directions.iter().map(|&to| DVec3::from_array(to));
    let patches = directions.zip(&study.suns);
    let weighted: Vec<DVec3> = patches.map(|(to, patch)| to * patch.weight).collect();
    // A level surface in the open: pi, up to the size of patches.
    let up = DVec3::from_array(study.about.up).normalize_or_zero();
    let open = weighted.iter().sum::<DVec3>().dot(up);
    let seen = projected(study, &weighted)?;
    Some(seen.into_iter().map(|seen| seen / open).collect())
}

/// Returns the longest time without a break: suns that follow each other within a day, each step of time next to the
/// one before.
fn longest(study: &Study) -> Option<Vec<f64>> {
    let suns = &study.suns;
    let times: Option<Vec<_>> = suns.iter().map(|sun| sun.time).collect();
    let times = times?;
    // Bits of suns that do not go on where the one before ends, and the time from the first sun to each.
    let mut breaks = vec![0_u64; study.bits.stride];
    let mut before = vec![0.0; suns.len() + 1];
    for sun in 0..suns.len() {
        before[sun + 1] = before[sun] + suns[sun].weight;
        let goes_on = sun > 0 && {
            let between = (times[sun].utc() - times[sun - 1].utc()) as f64;
            let half_steps = (suns[sun].weight + suns[sun - 1].weight) / 2.0;
            // Rows name whole seconds.
            between <= half_steps + 1.0 && times[sun].day() == times[sun - 1].day()
        };
        breaks[sun / 64] |= u64::from(!goes_on) << (sun % 64);
    }
    Some(each(study, |words| {
        let mut most = 0.0_f64;
        // First sun of the span that the bits before this word end in.
        let mut open = None;
        for (place, (&word, &breaks)) in words.iter().zip(&breaks).enumerate() {
            let base = 64 * place;
            let mut bit = 0;
            while bit < 64 {
                let rest = u64::MAX << bit;
                let Some(begin) = open else {
                    bit = (word & rest).trailing_zeros() as usize;
                    open = (bit < 64).then_some(base + bit);
                    bit += 1;
                    continue;
                };
                // The span ends before the first sun that is hidden or does not go on.
                bit = ((!word | breaks) & rest).trailing_zeros() as usize;
                if bit < 64 {
                    most = most.max(before[base + bit] - before[begin]);
                    open = None;
                }
            }
        }
        // Bits beyond the last sun are 0: a span is open only where the last word is full.
        if let Some(begin) = open {
            most = most.max(before[suns.len()] - before[begin]);
        }
        most / 3600.0
    }))
}
