//! Which numbers sample `i` of a receiver point has.

/// Most samples of a light for one receiver point.
pub const MAX_LIGHT_SAMPLES: u32 = 1 << 16;

/// Well spread samples for every receiver point and light: an Owen-scrambled Sobol sequence, with a scramble of
/// its own for each point and light, so that what is left of the error is noise and no pattern.
///
/// Samples are a pure function of the seed, the point's number, the light's number and the sample's number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SamplePattern {
    /// Another seed gives other samples.
    pub seed: u64,
}

impl SamplePattern {
    /// Returns the scramble of a receiver point and a light.
    pub fn scramble(self, point: u64, light: u64) -> u32 {
        let hash = [point, light]
            .iter()
            .fold(mix(self.seed), |state, &part| mix(state ^ part));
        (hash >> 32) as u32
    }

    /// Returns sample `sample` below [`MAX_LIGHT_SAMPLES`] of a scramble: two numbers in `[0, 1)`.
    pub fn place(scramble: u32, sample: u32) -> [f64; 2] {
        let sample = sample % MAX_LIGHT_SAMPLES;
        [0, 1].map(|dimension| f64::from(sobol_burley::sample(sample, dimension, scramble)))
    }
}

/// Mixes 64 bits so that every input bit changes about half of the output bits (`SplitMix64`, Steele, Lea and
/// Flood 2014).
fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
