//! A color map for numbers: from dark violet over red to light yellow.
//!
//! In: a share from 0 to 1. Out: a color. Invariant: of two shares the larger one has the lighter color, also in print
//! and for readers with any color vision.

use antumbra_scene::model::Color;

use crate::false_color::linear;

/// Colors (sRGB) at equal steps from 0 to 1: the map `inferno` of matplotlib (Nathaniel Smith and Stefan van der Walt, CC0),
/// every fourth color. Between them, sRGB values are interpolated; that is off by at most 5 of 255.
const INFERNO: [u32; 65] = [
    0x000004, 0x02010a, 0x040312, 0x07051b, 0x0b0724, 0x10092d, 0x150b37, 0x1b0c41, 0x210c4a,
    0x280b53, 0x2f0a5b, 0x360961, 0x3d0965, 0x440a68, 0x4a0c6b, 0x510e6c, 0x57106e, 0x5d126e,
    0x64156e, 0x6a176e, 0x71196e, 0x771c6d, 0x7d1e6d, 0x84206b, 0x8a226a, 0x902568, 0x972766,
    0x9d2964, 0xa32c61, 0xa92e5e, 0xb0315b, 0xb63458, 0xbc3754, 0xc13a50, 0xc73e4c, 0xcc4248,
    0xd24644, 0xd74b3f, 0xdb503b, 0xe05536, 0xe45a31, 0xe8602d, 0xeb6628, 0xef6c23, 0xf1731d,
    0xf47918, 0xf68013, 0xf8870e, 0xf98e09, 0xfb9606, 0xfb9d07, 0xfca50a, 0xfcac11, 0xfcb418,
    0xfbbc21, 0xfac42a, 0xf9cb35, 0xf7d340, 0xf5db4c, 0xf3e35a, 0xf2ea69, 0xf1f179, 0xf3f68a,
    0xf8fb9a, 0xfcffa4,
];

/// Returns the sRGB value, `0xRRGGBB`, of a share; shares beyond 0 to 1 have the color of the end, and NaN that of 0.
pub fn inferno_srgb(share: f64) -> u32 {
    let last = INFERNO.len() - 1;
    let place = if share > 0.0 { share.min(1.0) } else { 0.0 } * last as f64;
    let low = (place as usize).min(last - 1);
    let between = place - low as f64;
    let channel = |shift: u32| {
        let at = |step: usize| f64::from(INFERNO[step] >> shift & 0xff);
        let value = at(low) + between * (at(low + 1) - at(low));
        ((value + 0.5) as u32) << shift
    };
    channel(16) | channel(8) | channel(0)
}

/// Returns the linear color of a share, as [`inferno_srgb`].
pub fn inferno(share: f64) -> Color {
    linear(inferno_srgb(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_those_that_were_published() {
        assert_eq!(inferno_srgb(0.0), 0x00_0004);
        assert_eq!(inferno_srgb(1.0), 0xfc_ffa4);
        assert_eq!(inferno_srgb(0.5), 0xbc_3754);
        assert_eq!(inferno_srgb(-1.0), inferno_srgb(0.0));
        assert_eq!(inferno_srgb(f64::NAN), inferno_srgb(0.0));
        assert_eq!(inferno_srgb(f64::INFINITY), inferno_srgb(1.0));
    }

    #[test]
    fn larger_numbers_are_lighter() {
        let luminance = |share: f64| inferno(share).dot(Color::new(0.2126, 0.7152, 0.0722));
        for step in 0..256 {
            let [low, high] = [step, step + 1].map(|step| luminance(f64::from(step) / 256.0));
            assert!(high >= low, "{step}");
        }
    }
}
