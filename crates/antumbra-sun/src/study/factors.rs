//! Sky view factors of sensors, by patches of the sky.
//!
//! In: sensors in a row, a [`Dome`]. Out: the share of the light of an even sky that each gets of what a level surface in
//! the open would get. Patches count by their middles.

use std::ops::Range;

use antumbra::{BatchError, DirectionSet, ShadowIndex};
use antumbra_geometry::DVec3;

use super::bits::sunlit;
use super::questions::Dome;
use super::shares::{Glass, of_bits};
use crate::sensors::Sensors;

/// Answers at a time: 4 MiB of shares.
const BLOCK: usize = 1 << 20;

/// Writes the sky view factors of some sensors in a row. Sensors without a normal have 0.
pub(super) fn sky_view_factors(
    index: &ShadowIndex,
    glass: Option<&Glass>,
    sensors: &Sensors,
    first: usize,
    (dome, set): (&Dome, &DirectionSet),
    factors: &mut [f64],
) -> Result<(), BatchError> {
    let count = dome.directions.len();
    let open = dome.open();
    let block = (BLOCK / count.max(1)).max(1);
    for (number, factors) in factors.chunks_mut(block).enumerate() {
        antumbra_task::check();
        let begin = first + number * block;
        let range: Range<usize> = begin..begin + factors.len();
        let mut words = vec![0; set.word_count() * factors.len()];
        sunlit(index, sensors, begin, set, &mut words)?;
        let mut shares = vec![0.0; count * factors.len()];
        of_bits(&words, count, &mut shares);
        if let Some(glass) = glass {
            glass.filter(
                index,
                sensors,
                range.clone(),
                (&dome.directions, set),
                &mut shares,
            )?;
        }
        for ((sensor, factor), shares) in range.zip(factors).zip(shares.chunks(count.max(1))) {
            let normal = sensors
                .normal(index.occluders(), sensor)
                .unwrap_or_default();
            // In the order of the whole dome, so that what sees all of it has 1.
            let patches = dome.directions.iter().zip(&dome.weights).zip(shares);
            let seen: DVec3 = patches
                .map(|((&to, weight), &share)| to * (weight * f64::from(share)))
                .sum();
            *factor = normal.dot(seen).max(0.0) / open;
        }
    }
    Ok(())
}
