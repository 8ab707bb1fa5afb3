//! Numbers of twice the bits of `f64` with a running bound on their error.
//!
//! In: differences of `f64`s, times a power of two. Out: sums, products, quotients and roots. Invariant: the exact value is
//! within the error of the sum of the two parts; overflow gives an error that is infinite or NaN, which no sign is read from.

use super::double::Double;
use crate::number::{Number, Sign};

/// More than what a sum or a product errs, as a share of itself: 3 and 5 units of 2^-106 (Joldes, Muller and Popescu 2017;
/// Muller and Rideau 2022).
const ROUNDING: f64 = 1.0 / (1_u128 << 100) as f64;

/// The same for quotients and roots: fewer than 16 units.
const QUOTIENT_ROUNDING: f64 = 1.0 / (1_u128 << 97) as f64;

/// Covers what rounding takes from bounds.
const SLACK: f64 = 1.0 + 1e-12;

/// An unevaluated sum of two `f64`s that is right to an error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    value: Double,
    error: f64,
}

impl Refined {
    /// Returns `(to - from) scale`; the scale is a power of two.
    pub(super) fn scaled_difference(to: f64, from: f64, scale: f64) -> Self {
        let difference = Double::difference(to, from);
        let value = difference.scaled(scale);
        // Exact, unless a part leaves the normal numbers.
        let back = value.scaled(1.0 / scale);
        let is_exact = back.high == difference.high && back.low == difference.low;
        Self {
            value,
            error: if is_exact { 0.0 } else { f64::MIN_POSITIVE },
        }
    }

    /// Returns the value rounded to `f64`.
    pub(super) fn rounded(&self) -> f64 {
        self.value.high
    }

    /// Returns a bound on the error of the sum of both parts.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// Returns the `f64` nearest to the exact value where the error leaves no doubt.
    pub(super) fn nearest(&self) -> Option<f64> {
        let Double { high, low } = self.value;
        // Not for NaN.
        let is_clear = high + (low + self.error) == high && high + (low - self.error) == high;
        is_clear.then_some(high)
    }

    /// Returns the magnitude of a number whose sign is known, or of one that is near zero.
    pub(super) fn magnitude(&self) -> Self {
        if self.value.high < 0.0 {
            self.negated()
        } else {
            *self
        }
    }

    /// Returns `self / other`; with an error that is NaN where `other` may be zero.
    pub(super) fn over(&self, other: &Self) -> Self {
        let value = self.value.over(other.value);
        let least = other.value.high.abs() / SLACK - other.error;
        let error = if least > 0.0 {
            let carried = self.error + value.high.abs() * other.error * SLACK;
            carried / least + QUOTIENT_ROUNDING * value.high.abs() + f64::MIN_POSITIVE
        } else {
            f64::NAN
        };
        Self {
            value,
            error: error * SLACK,
        }
    }

    /// Returns the square root; with an error that is NaN where the number may not be above zero.
    pub(super) fn root(&self) -> Self {
        let value = self.value.root();
        let is_positive = self.sign() == Some(Sign::Positive);
        let error = if is_positive {
            self.error / value.high + QUOTIENT_ROUNDING * value.high + f64::MIN_POSITIVE
        } else {
            f64::NAN
        };
        Self {
            value,
            error: error * SLACK,
        }
    }

    fn sum(&self, value: Double, other: &Self) -> Self {
        Self {
            value,
            error: (self.error + other.error + ROUNDING * value.high.abs()) * SLACK,
        }
    }

    fn is_one(&self) -> bool {
        self.value.high == 1.0 && self.value.low == 0.0 && self.error == 0.0
    }
}

impl Number for Refined {
    fn from_f64(value: f64) -> Self {
        Self {
            value: Double {
                high: value,
                low: 0.0,
            },
            error: 0.0,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        self.sum(self.value.plus(other.value), other)
    }

    fn minus(&self, other: &Self) -> Self {
        self.sum(self.value.minus(other.value), other)
    }

    fn times(&self, other: &Self) -> Self {
        // Weights are one all the time.
        if self.is_one() {
            return *other;
        }
        if other.is_one() {
            return *self;
        }
        let value = self.value.times(other.value);
        let (size, other_size) = (self.value.high.abs(), other.value.high.abs());
        let is_zero =
            (size == 0.0 && self.error == 0.0) || (other_size == 0.0 && other.error == 0.0);
        let error = if is_zero {
            0.0
        } else {
            // The last term covers underflow.
            (size + self.error) * other.error
                + other_size * self.error
                + ROUNDING * value.high.abs()
                + f64::MIN_POSITIVE
        };
        Self {
            value,
            error: error * SLACK,
        }
    }

    fn negated(&self) -> Self {
        Self {
            value: self.value.negated(),
            error: self.error,
        }
    }

    fn sign(&self) -> Option<Sign> {
        let Double { high, .. } = self.value;
        if high > self.error * SLACK {
            Some(Sign::Positive)
        } else if -high > self.error * SLACK {
            Some(Sign::Negative)
        } else if high == 0.0 && self.error == 0.0 {
            Some(Sign::Zero)
        } else {
            None
        }
    }
}
