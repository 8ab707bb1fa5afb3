//! `f64`s that know whether any rounding was needed so far.
//!
//! In: few-bit numbers, as modellers type them. Out: exact signs where nothing was rounded, zeros among them, which no error
//! bound can tell; no sign where something was. Invariant: a sign that is told is exact.

use super::{Number, Sign};

/// Products below 2^-900 may lose what rounding took from them to underflow.
const SMALLEST: f64 = 1.183_052_186_166_774_4e-271;

/// A number, and whether it is exact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unrounded {
    value: f64,
    is_exact: bool,
}

impl Number for Unrounded {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self {
            value,
            is_exact: true,
        }
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        let (a, b) = (self.value, other.value);
        let sum = a + b;
        // Knuth's error of a sum.
        let b_part = sum - a;
        let error = (a - (sum - b_part)) + (b - b_part);
        Self {
            value: sum,
            // Not for NaN.
            is_exact: self.is_exact && other.is_exact && error == 0.0,
        }
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        let (a, b) = (self.value, other.value);
        let product = a * b;
        let is_without_error = a.mul_add(b, -product) == 0.0;
        let is_in_range = product.abs() >= SMALLEST || a == 0.0 || b == 0.0;
        Self {
            value: product,
            is_exact: self.is_exact && other.is_exact && is_without_error && is_in_range,
        }
    }

    #[inline(always)]
    fn negated(&self) -> Self {
        Self {
            value: -self.value,
            ..*self
        }
    }

    #[inline(always)]
    fn sign(&self) -> Option<Sign> {
        let sign = if self.value > 0.0 {
            Sign::Positive
        } else if self.value < 0.0 {
            Sign::Negative
        } else {
            Sign::Zero
        };
        self.is_exact.then_some(sign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Exact;

    fn sign_of<N: Number>([a, b, c, d]: [f64; 4]) -> Option<Sign> {
        let [a, b, c, d] = [a, b, c, d].map(N::from_f64);
        a.times(&b).minus(&c.times(&d)).sign()
    }

    #[test]
    fn signs_are_exact_where_they_are_told() {
        let mut told = 0;
        let values = [
            0.0,
            1.0,
            -3.0,
            0.1,
            0.3,
            1e-300,
            1e300,
            1e-160,
            -1e-160,
            0.75,
            12_345.0,
            f64::MIN_POSITIVE,
        ];
        for a in values {
            for b in values {
                for c in values {
                    for d in values {
                        let found = sign_of::<Unrounded>([a, b, c, d]);
                        if (a * b).is_finite() && (c * d).is_finite() && found.is_some() {
                            told += 1;
                            assert_eq!(found, sign_of::<Exact>([a, b, c, d]), "{a} {b} {c} {d}");
                        }
                    }
                }
            }
        }
        assert!(told > 1000, "{told}");
    }

    #[test]
    fn what_is_rounded_has_no_sign() {
        assert_eq!(sign_of::<Unrounded>([0.1, 0.1, 0.01, 1.0]), None);
        assert_eq!(sign_of::<Unrounded>([1e-200, 1e-200, 0.0, 0.0]), None);
        assert_eq!(sign_of::<Unrounded>([3.0, 4.0, 6.0, 2.0]), Some(Sign::Zero));
        assert_eq!(sign_of::<Unrounded>([f64::NAN, 4.0, 6.0, 2.0]), None);
        assert_eq!(sign_of::<Unrounded>([1e300, 1e300, 0.0, 2.0]), None);
    }
}
