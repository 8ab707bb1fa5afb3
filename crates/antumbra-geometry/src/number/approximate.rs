//! `f64` with a running bound on its error.

use super::{Number, Sign};

/// Half the distance from 1 to the next `f64`: the largest relative error of one operation.
pub(crate) const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Covers the rounding of the error bound's own arithmetic: a few operations of relative error
/// `UNIT_ROUNDOFF` each.
const SLACK: f64 = 1.0 + 8.0 * f64::EPSILON;

/// A value known to lie within `error` of `value`. Overflow gives an infinite or NaN error, which
/// no sign is read from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approximate {
    value: f64,
    error: f64,
}

impl Approximate {
    pub(crate) fn new(value: f64, error: f64) -> Self {
        Self { value, error }
    }

    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    pub(crate) fn error(&self) -> f64 {
        self.error
    }
}

impl Number for Approximate {
    fn from_f64(value: f64) -> Self {
        Self { value, error: 0.0 }
    }

    fn plus(&self, other: &Self) -> Self {
        let value = self.value + other.value;
        Self {
            value,
            error: (self.error + other.error + UNIT_ROUNDOFF * value.abs()) * SLACK,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        let value = self.value - other.value;
        Self {
            value,
            error: (self.error + other.error + UNIT_ROUNDOFF * value.abs()) * SLACK,
        }
    }

    fn times(&self, other: &Self) -> Self {
        // Homogeneous coordinates multiply by 1 all the time; that rounds nothing.
        if self.value == 1.0 && self.error == 0.0 {
            return *other;
        }
        if other.value == 1.0 && other.error == 0.0 {
            return *self;
        }
        let value = self.value * other.value;
        let carried = self.value.abs() * other.error
            + other.value.abs() * self.error
            + self.error * other.error;
        // The last term covers underflow; it is zero only for products with an exact zero.
        let is_zero =
            (self.value == 0.0 && self.error == 0.0) || (other.value == 0.0 && other.error == 0.0);
        let underflow = if is_zero { 0.0 } else { f64::MIN_POSITIVE };
        Self {
            value,
            error: (carried + UNIT_ROUNDOFF * value.abs() + underflow) * SLACK,
        }
    }

    fn negated(&self) -> Self {
        Self {
            value: -self.value,
            error: self.error,
        }
    }

    fn sign(&self) -> Option<Sign> {
        if self.value > self.error {
            Some(Sign::Positive)
        } else if -self.value > self.error {
            Some(Sign::Negative)
        } else if self.value == 0.0 && self.error == 0.0 {
            Some(Sign::Zero)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn does_not_claim_a_sign_it_cannot_know() {
        let tiny = Approximate::from_f64(1e-200);
        assert_eq!(tiny.times(&tiny).sign(), None, "underflow");
        let huge = Approximate::from_f64(1e200);
        assert_eq!(huge.times(&huge).sign(), None, "overflow");
        let third = Approximate::new(1.0 / 3.0, 1e-17);
        let one = Approximate::from_f64(1.0);
        assert_eq!(
            third.times(&Approximate::from_f64(3.0)).minus(&one).sign(),
            None,
            "rounding"
        );
    }

    #[test]
    fn knows_plain_signs() {
        let two = Approximate::from_f64(2.0);
        assert_eq!(two.minus(&two).sign(), Some(Sign::Zero));
        assert_eq!(two.times(&two).sign(), Some(Sign::Positive));
        assert_eq!(two.negated().sign(), Some(Sign::Negative));
    }
}
