//! Exact dyadic numbers: an integer times a power of two. Every finite `f64` is one, and sums and
//! products of them are.

use num_bigint::Sign as BigSign;

use super::mantissa::Mantissa;
use super::{Number, Sign};

/// `mantissa * 2^exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    mantissa: Mantissa,
    exponent: i64,
}

impl Exact {
    /// Returns the sum or the difference.
    #[inline]
    fn combined(&self, other: &Self, is_difference: bool) -> Self {
        let shift = other.exponent - self.exponent;
        if shift >= 0 {
            let sum = self
                .mantissa
                .plus_shifted(&other.mantissa, shift as u64, is_difference);
            return Self {
                mantissa: sum,
                exponent: self.exponent,
            };
        }
        let mut sum = Self {
            mantissa: other.mantissa.plus_shifted(
                &self.mantissa,
                shift.unsigned_abs(),
                is_difference,
            ),
            exponent: other.exponent,
        };
        if is_difference {
            sum.mantissa.negate();
        }
        sum
    }

    /// Returns `self / other` to the last bit or two; infinite or NaN for a zero `other`.
    pub(crate) fn over(&self, other: &Self) -> f64 {
        if other.is_zero() {
            return f64::NAN;
        }
        let (numerator, denominator) = (self.mantissa.to_long(), other.mantissa.to_long());
        // A quotient of about 100 bits, whatever the operands' sizes.
        let shift = 100 + denominator.bits() as i64 - numerator.bits() as i64;
        let numerator = if shift >= 0 {
            numerator << shift as u64
        } else {
            numerator >> shift.unsigned_abs()
        };
        let quotient = i128::try_from(numerator / denominator).unwrap_or(0) as f64;
        let exponent = self.exponent - other.exponent - shift;
        // In two steps: the power alone may leave the range of f64.
        let half = (exponent / 2).clamp(-2000, 2000) as i32;
        let rest = (exponent - exponent / 2).clamp(-2000, 2000) as i32;
        quotient * 2f64.powi(half) * 2f64.powi(rest)
    }

    /// Returns the `f64` nearest to `self / other`, the even one of two, for quotients in the range of normal numbers; NaN
    /// for a zero `other`.
    pub(crate) fn over_to_nearest(&self, other: &Self) -> f64 {
        if other.is_zero() {
            return f64::NAN;
        }
        let (numerator, denominator) = (self.mantissa.to_long(), other.mantissa.to_long());
        // A quotient of more bits than f64 has, the last of which says whether anything was cut off.
        let shift = 66 + denominator.bits() as i64 - numerator.bits() as i64;
        let (numerator, denominator) = if shift >= 0 {
            (numerator << shift as u64, denominator)
        } else {
            (numerator, denominator << shift.unsigned_abs())
        };
        let is_negative =
            (numerator.sign() == BigSign::Minus) != (denominator.sign() == BigSign::Minus);
        let (numerator, denominator) = (numerator.magnitude(), denominator.magnitude());
        let cut = numerator / denominator;
        let is_whole = &cut * denominator == *numerator;
        let quotient = u128::try_from(cut).unwrap_or(0) | u128::from(!is_whole);
        let exponent = self.exponent - other.exponent - shift;
        let half = (exponent / 2).clamp(-2000, 2000) as i32;
        let rest = (exponent - exponent / 2).clamp(-2000, 2000) as i32;
        let size = quotient as f64 * 2f64.powi(half) * 2f64.powi(rest);
        if is_negative { -size } else { size }
    }

    fn is_zero(&self) -> bool {
        self.mantissa.is_zero()
    }
}

impl Number for Exact {
    fn from_f64(value: f64) -> Self {
        let bits = value.to_bits();
        let biased = ((bits >> 52) & 0x7ff) as i64;
        let fraction = (bits & ((1 << 52) - 1)) as i64;
        let (mut mantissa, mut exponent) = if biased == 0 {
            (fraction, -1074)
        } else {
            (fraction | (1 << 52), biased - 1075)
        };
        // Fewer bits make every later product cheaper.
        if mantissa != 0 {
            let zeros = mantissa.trailing_zeros();
            mantissa >>= zeros;
            exponent += i64::from(zeros);
        }
        let signed = if value.is_sign_negative() {
            -mantissa
        } else {
            mantissa
        };
        Self {
            mantissa: Mantissa::from(signed),
            exponent,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        if self.is_zero() {
            return other.clone();
        }
        if other.is_zero() {
            return self.clone();
        }
        self.combined(other, false)
    }

    fn minus(&self, other: &Self) -> Self {
        if other.is_zero() {
            return self.clone();
        }
        if self.is_zero() {
            return other.negated();
        }
        self.combined(other, true)
    }

    fn times(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self {
                mantissa: Mantissa::ZERO,
                exponent: 0,
            };
        }
        Self {
            mantissa: self.mantissa.times(&other.mantissa),
            exponent: self.exponent + other.exponent,
        }
    }

    fn negated(&self) -> Self {
        let mut negated = self.clone();
        negated.mantissa.negate();
        negated
    }

    fn sign(&self) -> Option<Sign> {
        Some(self.mantissa.sign())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sign_of(value: &Exact) -> Sign {
        value.sign().unwrap()
    }

    #[test]
    fn holds_every_kind_of_f64() {
        for value in [
            0.0,
            -0.0,
            1.0,
            -1.5,
            0.1,
            5e-324,
            f64::MIN_POSITIVE,
            f64::MAX,
            1e300,
        ] {
            let zero = Exact::from_f64(value).minus(&Exact::from_f64(value));
            assert_eq!(sign_of(&zero), Sign::Zero, "{value}");
            let expected = if value > 0.0 {
                Sign::Positive
            } else if value < 0.0 {
                Sign::Negative
            } else {
                Sign::Zero
            };
            assert_eq!(sign_of(&Exact::from_f64(value)), expected, "{value}");
        }
    }

    #[test]
    fn tells_a_rounded_tenth_from_a_tenth() {
        let tenth = Exact::from_f64(0.1);
        let ten = Exact::from_f64(10.0);
        let excess = tenth.times(&ten).minus(&Exact::from_f64(1.0));
        assert_eq!(
            sign_of(&excess),
            Sign::Positive,
            "0.1 is a little more than 1/10"
        );
    }

    #[test]
    fn divides_as_f64_does() {
        for (a, b) in [
            (1.0, 3.0),
            (-0.1, 0.7),
            (1e300, 1e-5),
            (5e-324, 3.0),
            (0.0, 2.0),
            (7e22, -3.3),
        ] {
            let quotient = Exact::from_f64(a).over(&Exact::from_f64(b));
            assert!(
                (quotient - a / b).abs() <= f64::EPSILON * (a / b).abs(),
                "{a} / {b}: {quotient}"
            );
            let nearest = Exact::from_f64(a).over_to_nearest(&Exact::from_f64(b));
            assert_eq!(nearest, a / b, "{a} / {b}");
        }
        let huge = Exact::from_f64(1e300).times(&Exact::from_f64(1e300));
        assert_eq!(huge.over(&huge), 1.0);
        assert_eq!(huge.over_to_nearest(&huge), 1.0);
        // Half way between two numbers, and a hair beyond.
        let (one, half) = (Exact::from_f64(1.0), Exact::from_f64(f64::EPSILON / 2.0));
        let hair = Exact::from_f64(5e-324);
        let between = one.plus(&half);
        assert_eq!(between.over_to_nearest(&one), 1.0);
        let beyond = between.plus(&hair);
        assert_eq!(beyond.over_to_nearest(&one), 1.0 + f64::EPSILON);
        assert_eq!(between.minus(&hair).over_to_nearest(&one), 1.0);
        assert_eq!(beyond.negated().over_to_nearest(&one), -1.0 - f64::EPSILON);
        assert!(huge.over(&Exact::from_f64(0.0)).is_nan());
    }

    #[test]
    fn neither_overflows_nor_underflows() {
        let huge = Exact::from_f64(f64::MAX);
        let tiny = Exact::from_f64(5e-324);
        let product = huge.times(&huge).times(&tiny).times(&tiny);
        assert_eq!(sign_of(&product), Sign::Positive);
        assert_eq!(sign_of(&product.minus(&product)), Sign::Zero);
    }
}
