//! Numbers and points in messages.

use std::fmt;

use glam::DVec3;

/// Displays a number or a point in few characters: all digits that distinguish it from its neighbours, in scientific
/// notation where many zeros would pad them.
///
/// ```
/// use antumbra_geometry::{DVec3, Short};
///
/// assert_eq!(Short(691_000.25).to_string(), "691000.25");
/// assert_eq!(Short(1e300).to_string(), "1e300");
/// assert_eq!(Short(DVec3::new(0.5, -1e-9, f64::NAN)).to_string(), "(0.5, -1e-9, NaN)");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Short<T>(pub T);

impl fmt::Display for Short<f64> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Within these, zeros are read more easily than an exponent.
        const PLAIN: std::ops::Range<f64> = 1e-4..1e10;
        let Self(number) = *self;
        if number == 0.0 || !number.is_finite() || PLAIN.contains(&number.abs()) {
            write!(f, "{number}")
        } else {
            write!(f, "{number:e}")
        }
    }
}

impl fmt::Display for Short<DVec3> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0.to_array().map(Short);
        write!(f, "({x}, {y}, {z})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_takes_more_than_24_characters_and_each_is_read_back() {
        let mut bits = 1_u64;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let number = f64::from_bits(bits);
            let text = Short(number).to_string();
            assert!(text.len() <= 24, "{text}");
            let read: f64 = text.parse().unwrap();
            assert!(read == number || number.is_nan(), "{text}");
        }
        assert_eq!(
            Short(f64::MIN_POSITIVE).to_string(),
            "2.2250738585072014e-308"
        );
        assert_eq!(Short(-0.0).to_string(), "-0");
    }
}
