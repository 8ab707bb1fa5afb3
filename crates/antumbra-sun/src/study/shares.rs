//! Shares of suns: what is visible of their discs, and what glass lets through.
//!
//! In: sensors in a row, their bits. Out: a share for each sensor and sun, 0 to 1. Invariant: the same for any number of
//! threads. Absent here: what shares amount to.

use std::ops::Range;
use std::sync::Arc;

use antumbra::{
    BatchError, Counters, DirectionSet, FractionBy, LightSamples, LightSampling, Method,
    ShadowIndex,
};
use antumbra_geometry::{AreaError, AreaShape, DVec3, LightShape, SunDisc};
use rayon::prelude::*;

use super::bits::{Bits, WORD, sunlit};
use crate::sensors::Sensors;

/// Samples of a disc without a closed form.
const SAMPLES: u32 = 64;

/// Sensors that a thread takes at a time.
const PIECE: usize = 16;

/// Room for the rounding of a unit normal and a direction, as a sine.
const ROUNDING: f64 = 1e-9;

/// Surfaces that filter light, asked as if they were opaque.
pub(super) struct Glass(ShadowIndex);

impl Glass {
    /// Returns the index of filtering surfaces; `None` if there are none.
    pub(super) fn of(index: &ShadowIndex) -> Option<Self> {
        let occluders = index.occluders();
        let build = || {
            let surfaces = Arc::new(occluders.filters_alone());
            let builder = ShadowIndex::builder(surfaces, Vec::new());
            let built = builder.method(Method::Bvh).build();
            built.expect("what builds all surfaces builds some of them")
        };
        occluders.has_filters().then(|| Self(build()))
    }

    /// Multiplies shares above 0 with what glass lets through towards the middle of each sun.
    pub(super) fn filter(
        &self,
        index: &ShadowIndex,
        sensors: &Sensors,
        range: Range<usize>,
        directions: (&[DVec3], &DirectionSet),
        shares: &mut [f32],
    ) -> Result<(), BatchError> {
        let (directions, set) = directions;
        let mut clear = Bits {
            stride: set.word_count(),
            words: vec![0; set.word_count() * range.len()],
        };
        sunlit(&self.0, sensors, range.start, set, &mut clear.words)?;
        let clear = &clear;
        each_row(
            shares,
            directions.len(),
            || (),
            |row, shares, ()| {
                let start = sensors.start(range.start + row);
                for (sun, share) in shares.iter_mut().enumerate() {
                    // Clear pairs are those that a sensor faces.
                    if *share > 0.0 && !clear.is_sunlit(row, sun) {
                        let light = LightShape::Direction(directions[sun]);
                        let through =
                            index.filtered_towards(&start, &light, &mut Counters::default());
                        *share *= luminance(through.expect("bits have answers")) as f32;
                    }
                }
            },
        );
        Ok(())
    }
}

/// Returns the relative luminance of linear red, green and blue (Rec. 709); of a grey exactly its share.
fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    green + 0.2126 * (red - green) + 0.0722 * (blue - green)
}

/// Writes the bits of sensors as shares.
pub(super) fn of_bits(words: &[u64], sun_count: usize, shares: &mut [f32]) {
    let stride = sun_count.div_ceil(WORD);
    each_row(
        shares,
        sun_count,
        || (),
        |row, shares, ()| {
            let words = &words[row * stride..][..stride];
            for (sun, share) in shares.iter_mut().enumerate() {
                *share = f32::from(u8::from(words[sun / WORD] >> (sun % WORD) & 1 == 1));
            }
        },
    );
}

/// Suns with a size.
pub(super) struct Discs {
    /// Discs of the suns, in their order.
    shapes: Vec<AreaShape>,
    /// Unit vectors towards their middles.
    middles: Vec<DVec3>,
    /// Sine of a disc's radius.
    reach: f64,
}

impl Discs {
    /// Makes discs of that many degrees.
    pub(super) fn new(directions: &[DVec3], degrees: f64) -> Result<Self, AreaError> {
        let shape = |&to: &DVec3| Ok(AreaShape::SunDisc(SunDisc::new(to, degrees)?));
        Ok(Self {
            shapes: directions.iter().map(shape).collect::<Result<_, _>>()?,
            middles: directions.iter().map(|to| to.normalize_or_zero()).collect(),
            reach: (degrees / 2.0).to_radians().sin(),
        })
    }

    /// Writes the visible share of each disc; parts of a disc below the plane of its sensor are not visible. Returns how
    /// many shares samples answered, for want of a closed form.
    pub(super) fn shares(
        &self,
        index: &ShadowIndex,
        sensors: &Sensors,
        first: usize,
        shares: &mut [f32],
    ) -> u64 {
        let answer = |row: usize, shares: &mut [f32], samples: &mut LightSamples| {
            self.of_sensor(index, sensors, first + row, shares, samples)
        };
        let count = self.shapes.len();
        each_row(shares, count, LightSamples::default, answer)
            .into_iter()
            .sum()
    }

    fn of_sensor(
        &self,
        index: &ShadowIndex,
        sensors: &Sensors,
        sensor: usize,
        shares: &mut [f32],
        samples: &mut LightSamples,
    ) -> u64 {
        let (start, side) = (sensors.start(sensor), sensors.side(sensor));
        let normal = sensors.normal(index.occluders(), sensor);
        let height = |to: DVec3| normal.map_or(1.0, |normal| normal.dot(to));
        let counters = &mut Counters::default();
        let mut sampled = 0;
        for (sun, share) in shares.iter_mut().enumerate() {
            if normal == Some(DVec3::ZERO) || height(self.middles[sun]) < -self.reach - ROUNDING {
                *share = 0.0;
                continue;
            }
            let sampling = LightSampling {
                light: sun as u64,
                ..LightSampling::new(SAMPLES)
            };
            let (shape, number) = (&self.shapes[sun], sensor as u64);
            let found = index
                .visible_fraction(&start, side, shape, number, &sampling, samples, counters)
                .expect("bits have answers");
            sampled += u64::from(found.by == FractionBy::Samples);
            *share = found.fraction as f32;
        }
        sampled
    }
}

/// Works on the row of each sensor, on all threads.
fn each_row<W, T: Send>(
    shares: &mut [f32],
    sun_count: usize,
    make: impl Fn() -> W + Send + Sync,
    work: impl Fn(usize, &mut [f32], &mut W) -> T + Send + Sync,
) -> Vec<T> {
    if sun_count == 0 {
        return Vec::new();
    }
    let task = antumbra_task::current();
    let pieces: Vec<Vec<T>> = shares
        .par_chunks_mut(sun_count * PIECE)
        .enumerate()
        .map_init(&make, |own, (piece, shares)| {
            task.enter(|| {
                let rows = shares.chunks_mut(sun_count).enumerate();
                antumbra_task::checked(rows)
                    .map(|(row, shares)| work(piece * PIECE + row, shares, own))
                    .collect()
            })
        })
        .collect();
    pieces.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_glass_has_the_luminance_of_its_share_and_white_of_one() {
        for share in [0.0, 0.1, 0.7, 1.0] {
            assert_eq!(luminance([share; 3]), share);
        }
        assert!((luminance([1.0, 0.0, 0.0]) - 0.2126).abs() < 1e-15);
        assert!((luminance([0.0, 1.0, 0.0]) - 0.7152).abs() < 1e-15);
    }
}
