//! Groups of sensors, such as those of one object: totals, and sunlit shares sun by sun.
//!
//! In: a study, its sums, the group of each sensor. Out: a [`Total`] a group; for each sun the share of each group's area
//! that it reaches. Sensors without known areas count alike. Invariant: the same for any number of threads.

use std::ops::Range;

use rayon::prelude::*;

use crate::record::Study;
use crate::sums::Sums;

/// Suns of a word of bits.
const WORD: usize = 64;

/// Groups of sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Groups {
    /// A name a group.
    pub names: Vec<String>,
    /// Group of each sensor, as its place in `names`.
    pub of: Vec<u32>,
}

/// Numbers of a list over a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean, weighted by areas.
    pub mean: f64,
    /// Least number.
    pub least: f64,
    /// Greatest number.
    pub most: f64,
}

/// Numbers of a group. Spreads are `None` where the study lacks what they need, or the group has no sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Total {
    /// Number of sensors.
    pub sensors: usize,
    /// Area in the scene's unit squared, or the number of sensors where areas are not known.
    pub area: f64,
    /// Hours of sun.
    pub hours: Option<Spread>,
    /// Direct irradiation, kWh/m2.
    pub irradiation: Option<Spread>,
    /// Diffuse irradiation, kWh/m2.
    pub diffuse: Option<Spread>,
    /// Direct and diffuse irradiation together, kWh/m2.
    pub total: Option<Spread>,
    /// Visible share of the sky.
    pub sky_visible: Option<Spread>,
    /// Sky view factor.
    pub sky_view_factor: Option<Spread>,
}

/// Returns what each group amounts to.
///
/// # Panics
/// There are not as many entries of `groups.of` as sensors, or one is beyond the names.
pub fn totals(study: &Study, sums: &Sums, groups: &Groups) -> Vec<Total> {
    let weights = weights(study);
    let mut totals = vec![Total::default(); groups.names.len()];
    assert_eq!(groups.of.len(), weights.len(), "a group a sensor");
    for (&group, &area) in groups.of.iter().zip(&weights) {
        let total = &mut totals[group as usize];
        total.sensors += 1;
        total.area += area;
    }
    let spreads = |list: &Option<Vec<f64>>| -> Vec<Option<Spread>> {
        let mut found: Vec<Option<Spread>> = vec![None; totals.len()];
        let sensors = list.iter().flatten().zip(&groups.of).zip(&weights);
        for ((&number, &group), &area) in antumbra_task::checked(sensors) {
            let so_far = found[group as usize].get_or_insert(Spread {
                mean: 0.0,
                least: f64::INFINITY,
                most: f64::NEG_INFINITY,
            });
            so_far.mean += number * area;
            so_far.least = so_far.least.min(number);
            so_far.most = so_far.most.max(number);
        }
        for (spread, total) in found.iter_mut().zip(&totals) {
            if let Some(spread) = spread {
                spread.mean /= total.area;
            }
        }
        found
    };
    let lists = [
        &sums.hours,
        &sums.irradiation,
        &sums.sky_visible,
        &sums.sky_view_factor,
        &sums.diffuse,
        &sums.total,
    ]
    .map(spreads);
    for (place, total) in totals.iter_mut().enumerate() {
        let of = |list: usize| lists[list][place];
        total.hours = of(0);
        total.irradiation = of(1);
        total.sky_visible = of(2);
        total.sky_view_factor = of(3);
        total.diffuse = of(4);
        total.total = of(5);
    }
    totals
}

/// Returns for each of some suns the share of each group's area that it reaches, 0 to 1: those of the first sun, then of the
/// next. A group without sensors has 0. What a sun reaches in part counts in part. Takes 8 bytes a sun and group.
///
/// # Panics
/// As [`totals`], or there are fewer suns.
pub fn sunlit_shares(study: &Study, groups: &Groups, suns: Range<usize>) -> Vec<f64> {
    let count = groups.names.len();
    let weights = weights(study);
    assert_eq!(groups.of.len(), weights.len(), "a group a sensor");
    assert!(suns.end <= study.suns.len(), "suns of the study");
    let mut areas = vec![0.0; count];
    for (&group, &area) in groups.of.iter().zip(&weights) {
        areas[group as usize] += area;
    }
    let mut shares = vec![0.0; count * suns.len()];
    if shares.is_empty() {
        return shares;
    }
    let task = antumbra_task::current();
    // Each stretch of suns is of one word, counted from the first sun.
    shares
        .par_chunks_mut(count * WORD)
        .enumerate()
        .for_each(|(number, shares)| {
            task.enter(|| {
                let first = suns.start + number * WORD;
                let length = shares.len() / count;
                for (sensor, (&group, &area)) in
                    antumbra_task::checked(groups.of.iter().zip(&weights).enumerate())
                {
                    if let Some(own) = study.shares_of(sensor) {
                        for (sun, &share) in own[first..first + length].iter().enumerate() {
                            shares[sun * count + group as usize] += area * f64::from(share);
                        }
                        continue;
                    }
                    let mut word = word_at(study.bits.of(sensor), first, length);
                    while word != 0 {
                        let sun = word.trailing_zeros() as usize;
                        shares[sun * count + group as usize] += area;
                        word &= word - 1;
                    }
                }
                for (place, share) in shares.iter_mut().enumerate() {
                    let whole = areas[place % count];
                    // Sums of the same numbers in one order: never above 1.
                    *share = if whole > 0.0 { *share / whole } else { 0.0 };
                }
            });
        });
    shares
}

/// Returns up to 64 bits from any place on.
fn word_at(words: &[u64], first: usize, length: usize) -> u64 {
    let (word, shift) = (first / WORD, first % WORD);
    let low = words[word] >> shift;
    let high = match shift {
        0 => 0,
        _ => words.get(word + 1).copied().unwrap_or(0) << (WORD - shift),
    };
    let kept = if length < WORD {
        (1 << length) - 1
    } else {
        u64::MAX
    };
    (low | high) & kept
}

/// Returns what each sensor counts for.
fn weights(study: &Study) -> Vec<f64> {
    let areas = study.areas.clone();
    areas.unwrap_or_else(|| vec![1.0; study.sensor_count()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_taken_from_any_place_on() {
        let words = [u64::MAX << 60, 0b101];
        assert_eq!(word_at(&words, 0, 64), words[0]);
        assert_eq!(word_at(&words, 58, 10), 0b01_0111_1100);
        assert_eq!(word_at(&words, 64, 2), 0b01);
        assert_eq!(word_at(&words, 66, 64), 1);
    }
}
