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
    fn neither_overflows_nor_underflows() {
        let huge = Exact::from_f64(f64::MAX);
        let tiny = Exact::from_f64(5e-324);
        let product = huge.times(&huge).times(&tiny).times(&tiny);
        assert_eq!(sign_of(&product), Sign::Positive);
        assert_eq!(sign_of(&product.minus(&product)), Sign::Zero);
    }
}
