//! Where inside a pixel the samples lie.
//!
//! In: seed, pixel, sample number. Out: a point of the pixel. Invariant: a pure function of those
//! numbers, so a picture depends neither on threads nor on the order of work. The pixel is cut
//! into as many strata of equal area as there are samples, and each sample is jittered in its own.

/// Mixes 64 bits so that every input bit changes about half of the output bits (`SplitMix64`,
/// Steele, Lea and Flood 2014).
pub fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns a number in `0..1` that depends on all of `key` and on nothing else.
pub fn uniform(key: &[u64]) -> f64 {
    let bits = key.iter().fold(0, |state, &part| mix(state ^ part));
    // The upper 53 bits fill a double's significand.
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Stratified samples of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    seed: u64,
    count: u32,
    rows: u32,
}

impl Sampler {
    /// Prepares `count` samples a pixel (at least 1); other seeds give other jitter.
    pub fn new(seed: u64, count: u32) -> Self {
        let count = count.max(1);
        let rows = libm::floor(libm::sqrt(f64::from(count))).max(1.0) as u32;
        Self { seed, count, rows }
    }

    /// Returns how many samples a pixel has.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Returns sample `sample` of pixel number `pixel` as offsets `(across, down)` in `0..1` from
    /// the pixel's top left corner. A single sample is the centre, without jitter.
    pub fn offset(&self, pixel: u64, sample: u32) -> [f64; 2] {
        if self.count == 1 {
            return [0.5, 0.5];
        }
        // Row r holds samples first(r)..first(r + 1) and is as high as its share of the samples:
        // all strata have the same area whether or not the count is a square.
        let [count, rows, sample] = [self.count, self.rows, sample].map(u64::from);
        let row = ((sample + 1) * rows).div_ceil(count) - 1;
        let first = |r: u64| r * count / rows;
        let row_samples = first(row + 1) - first(row);
        let jitter = |axis: u64| uniform(&[self.seed, pixel, sample, axis]);
        let across = ((sample - first(row)) as f64 + jitter(0)) / row_samples as f64;
        let down = (first(row) as f64 + row_samples as f64 * jitter(1)) / count as f64;
        [across, down]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_is_the_centre_for_every_seed() {
        assert_eq!(Sampler::new(7, 1).offset(3, 0), [0.5, 0.5]);
        assert_eq!(Sampler::new(8, 0).offset(4, 0), [0.5, 0.5]);
    }

    #[test]
    fn every_count_has_one_sample_in_each_stratum_of_equal_area() {
        for count in 2..=64u32 {
            let sampler = Sampler::new(1, count);
            let rows = u64::from(sampler.rows);
            let mut sample = 0;
            for row in 0..rows {
                let [first, end] = [row, row + 1].map(|r| r * u64::from(count) / rows);
                for column in 0..end - first {
                    let [across, down] = sampler.offset(99, sample);
                    let across_in_strata = across * (end - first) as f64;
                    let down_in_samples = down * f64::from(count);
                    assert!(
                        across_in_strata >= column as f64
                            && across_in_strata <= (column + 1) as f64
                    );
                    assert!(down_in_samples >= first as f64 && down_in_samples <= end as f64);
                    sample += 1;
                }
            }
            assert_eq!(sample, count);
        }
    }

    #[test]
    fn jitter_depends_on_seed_pixel_and_sample() {
        let base = Sampler::new(1, 4).offset(5, 2);
        assert_ne!(base, Sampler::new(2, 4).offset(5, 2));
        assert_ne!(base, Sampler::new(1, 4).offset(6, 2));
        assert_eq!(base, Sampler::new(1, 4).offset(5, 2));
    }

    #[test]
    fn uniform_stays_below_one_and_averages_one_half() {
        let sum: f64 = (0..10_000)
            .map(|i| uniform(&[3, i]))
            .inspect(|u| assert!((0.0..1.0).contains(u)))
            .sum();
        assert!((sum / 10_000.0 - 0.5).abs() < 0.02, "{sum}");
    }
}
