//! Signs of quadratic forms, and lengths brought near 1.

use crate::number::{Number, Sign};

/// Returns a power of two that brings a length near 1, so that its fourth power keeps its bits: to
/// scale lengths by it rounds nothing.
pub(crate) fn near_one(largest: f64) -> f64 {
    // The exponent's bits, so that no logarithm is needed for each hit.
    let exponent = (largest.to_bits() >> 52) as i32 - 1023;
    if largest.is_finite() && (-1022..=1022).contains(&exponent) {
        2f64.powi(-exponent)
    } else {
        1.0
    }
}

/// The signs that a quadratic form `A s^2 + 2 B s t + C t^2` takes for `s, t > 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct SignsTaken {
    pub(super) negative: bool,
    pub(super) positive: bool,
}

/// Returns the signs taken inside the quadrant, `None` if undecided.
pub(super) fn signs_in_quadrant<N: Number>(a: &N, b: &N, c: &N) -> Option<SignsTaken> {
    let (sign_a, sign_b, sign_c) = (a.sign()?, b.sign()?, c.sign()?);
    let is_mixed_discriminant =
        || -> Option<bool> { Some(b.times(b).minus(&a.times(c)).sign()?.is_positive()) };
    // At the ends the form has the signs of A and C; in between it can dip below zero only if B
    // pulls it there and the discriminant is positive, and rise above zero likewise.
    let takes = |wanted: Sign| -> Option<bool> {
        if sign_a == wanted || sign_c == wanted {
            return Some(true);
        }
        if sign_b != wanted {
            return Some(false);
        }
        is_mixed_discriminant()
    };
    Some(SignsTaken {
        negative: takes(Sign::Negative)?,
        positive: takes(Sign::Positive)?,
    })
}
