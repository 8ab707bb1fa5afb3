//! Exact dyadic numbers: an integer times a power of two. Every finite `f64` is one, and sums and
//! products of them are.

use num_bigint::BigInt;

use super::{Number, Sign};

/// `mantissa * 2^exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    mantissa: BigInt,
    exponent: i64,
}

impl Exact {
    fn aligned(&self, other: &Self) -> (BigInt, BigInt, i64) {
        let exponent = self.exponent.min(other.exponent);
        let shifted = |number: &Self| {
            let shift = (number.exponent - exponent) as u64;
            if shift == 0 {
                number.mantissa.clone()
            } else {
                &number.mantissa << shift
            }
        };
        (shifted(self), shifted(other), exponent)
    }

    /// Returns `self / other` to the last bit or two; infinite or NaN for a zero `other`.
    pub(crate) fn over(&self, other: &Self) -> f64 {
        if other.is_zero() {
            return f64::NAN;
        }
        // A quotient of about 100 bits, whatever the operands' sizes.
        let shift = 100 + other.mantissa.bits() as i64 - self.mantissa.bits() as i64;
        let numerator = if shift >= 0 {
            &self.mantissa << shift as u64
        } else {
            &self.mantissa >> shift.unsigned_abs()
        };
        let quotient = i128::try_from(numerator / &other.mantissa).unwrap_or(0) as f64;
        let exponent = self.exponent - other.exponent - shift;
        // In two steps: the power alone may leave the range of f64.
        let half = (exponent / 2).clamp(-2000, 2000) as i32;
        let rest = (exponent - exponent / 2).clamp(-2000, 2000) as i32;
        quotient * 2f64.powi(half) * 2f64.powi(rest)
    }

    fn is_zero(&self) -> bool {
        self.mantissa.sign() == num_bigint::Sign::NoSign
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
            mantissa: BigInt::from(signed),
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
        let (a, b, exponent) = self.aligned(other);
        Self {
            mantissa: a + b,
            exponent,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        if other.is_zero() {
            return self.clone();
        }
        if self.is_zero() {
            return other.negated();
        }
        let (a, b, exponent) = self.aligned(other);
        Self {
            mantissa: a - b,
            exponent,
        }
    }

    fn times(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self {
                mantissa: BigInt::ZERO,
                exponent: 0,
            };
        }
        Self {
            mantissa: &self.mantissa * &other.mantissa,
            exponent: self.exponent + other.exponent,
        }
    }

    fn negated(&self) -> Self {
        Self {
            mantissa: -&self.mantissa,
            exponent: self.exponent,
        }
    }

    fn sign(&self) -> Option<Sign> {
        Some(match self.mantissa.sign() {
            num_bigint::Sign::Minus => Sign::Negative,
            num_bigint::Sign::NoSign => Sign::Zero,
            num_bigint::Sign::Plus => Sign::Positive,
        })
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
        }
        let huge = Exact::from_f64(1e300).times(&Exact::from_f64(1e300));
        assert_eq!(huge.over(&huge), 1.0);
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
