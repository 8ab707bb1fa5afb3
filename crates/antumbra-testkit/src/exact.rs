//! Exact numbers `mantissa * 2^exponent`: every finite `f64` is one, and sums, differences and
//! products of them are again.
//!
//! Quotients are avoided by their users, who carry a positive denominator along; so the oracle
//! decides on rational numbers without ever reducing a fraction, which is what would be slow.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::{BigInt, Sign};

/// The integer in front of the power of two.
#[derive(Clone, Debug)]
enum Mantissa {
    /// Small enough for machine arithmetic; overflow is checked, never assumed away.
    Small(i128),
    Big(BigInt),
}

/// An exact number `mantissa * 2^exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Exact {
    mantissa: Mantissa,
    exponent: i64,
}

impl Exact {
    pub(crate) const ZERO: Self = Self {
        mantissa: Mantissa::Small(0),
        exponent: 0,
    };
    pub(crate) const ONE: Self = Self {
        mantissa: Mantissa::Small(1),
        exponent: 0,
    };

    /// The exact value of `value`. Panics when it is not finite: the contract refuses such input
    /// before any rule is asked.
    pub(crate) fn new(value: f64) -> Self {
        assert!(
            value.is_finite(),
            "the oracle takes finite numbers only, not {value}"
        );
        let bits = value.to_bits();
        let biased = ((bits >> 52) & 0x7ff) as i64;
        let fraction = (bits & ((1 << 52) - 1)) as i128;
        let (magnitude, exponent) = if biased == 0 {
            (fraction, -1074)
        } else {
            (fraction | 1 << 52, biased - 1075)
        };
        if magnitude == 0 {
            return Self::ZERO;
        }
        // Without trailing zeros lattice coordinates stay tiny integers.
        let zeros = magnitude.trailing_zeros();
        let odd = magnitude >> zeros;
        Self {
            mantissa: Mantissa::Small(if value < 0.0 { -odd } else { odd }),
            exponent: exponent + i64::from(zeros),
        }
    }

    /// `-1`, `0` or `1`.
    pub(crate) fn sign(&self) -> i8 {
        match &self.mantissa {
            Mantissa::Small(small) => small.signum() as i8,
            Mantissa::Big(big) => match big.sign() {
                Sign::Minus => -1,
                Sign::NoSign => 0,
                Sign::Plus => 1,
            },
        }
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.sign() == 0
    }

    pub(crate) fn square(&self) -> Self {
        self * self
    }

    pub(crate) fn double(&self) -> Self {
        Self {
            mantissa: self.mantissa.clone(),
            exponent: self.exponent + 1,
        }
    }

    pub(crate) fn abs(&self) -> Self {
        if self.sign() < 0 { -self } else { self.clone() }
    }

    pub(crate) fn compare(&self, other: &Self) -> Ordering {
        (self - other).sign().cmp(&0)
    }

    fn big(&self) -> BigInt {
        match &self.mantissa {
            Mantissa::Small(small) => BigInt::from(*small),
            Mantissa::Big(big) => big.clone(),
        }
    }
}

/// `mantissa << shift`, unless it leaves the range of an `i128`.
fn shifted_small(mantissa: i128, shift: u64) -> Option<i128> {
    let room = u64::from(mantissa.unsigned_abs().leading_zeros());
    (shift + 1 < room).then(|| mantissa << shift)
}

impl Add for &Exact {
    type Output = Exact;

    fn add(self, other: &Exact) -> Exact {
        if self.is_zero() {
            return other.clone();
        }
        if other.is_zero() {
            return self.clone();
        }
        let (high, low) = if self.exponent >= other.exponent {
            (self, other)
        } else {
            (other, self)
        };
        let shift = high.exponent.abs_diff(low.exponent);
        let exponent = low.exponent;
        if let (Mantissa::Small(h), Mantissa::Small(l)) = (&high.mantissa, &low.mantissa)
            && let Some(sum) = shifted_small(*h, shift).and_then(|h| h.checked_add(*l))
        {
            return Exact {
                mantissa: Mantissa::Small(sum),
                exponent,
            };
        }
        Exact {
            mantissa: Mantissa::Big((high.big() << shift) + low.big()),
            exponent,
        }
    }
}

impl Neg for &Exact {
    type Output = Exact;

    fn neg(self) -> Exact {
        let mantissa = match &self.mantissa {
            Mantissa::Small(small) if *small != i128::MIN => Mantissa::Small(-small),
            _ => Mantissa::Big(-self.big()),
        };
        Exact {
            mantissa,
            exponent: self.exponent,
        }
    }
}

impl Sub for &Exact {
    type Output = Exact;

    fn sub(self, other: &Exact) -> Exact {
        self + &-other
    }
}

impl Mul for &Exact {
    type Output = Exact;

    fn mul(self, other: &Exact) -> Exact {
        if self.is_zero() || other.is_zero() {
            return Exact::ZERO;
        }
        let exponent = self.exponent + other.exponent;
        if let (Mantissa::Small(a), Mantissa::Small(b)) = (&self.mantissa, &other.mantissa)
            && let Some(product) = a.checked_mul(*b)
        {
            return Exact {
                mantissa: Mantissa::Small(product),
                exponent,
            };
        }
        Exact {
            mantissa: Mantissa::Big(self.big() * other.big()),
            exponent,
        }
    }
}

/// Owned operands, so that formulas read as formulas.
macro_rules! owned_operators {
    ($($trait:ident $method:ident),*) => {$(
        impl $trait for Exact {
            type Output = Exact;
            fn $method(self, other: Exact) -> Exact { (&self).$method(&other) }
        }
        impl $trait<&Exact> for Exact {
            type Output = Exact;
            fn $method(self, other: &Exact) -> Exact { (&self).$method(other) }
        }
        impl $trait<Exact> for &Exact {
            type Output = Exact;
            fn $method(self, other: Exact) -> Exact { self.$method(&other) }
        }
    )*};
}
owned_operators!(Add add, Sub sub, Mul mul);

/// A vector, or a point, of exact numbers.
#[derive(Clone, Debug)]
pub(crate) struct Vec3(pub(crate) [Exact; 3]);

impl Vec3 {
    pub(crate) fn new(xyz: [f64; 3]) -> Self {
        Self(xyz.map(Exact::new))
    }

    pub(crate) fn dot(&self, other: &Self) -> Exact {
        let [a, b, c] = &self.0;
        let [x, y, z] = &other.0;
        a * x + b * y + c * z
    }

    pub(crate) fn cross(&self, other: &Self) -> Self {
        let [a, b, c] = &self.0;
        let [x, y, z] = &other.0;
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    pub(crate) fn scale(&self, factor: &Exact) -> Self {
        Self([0, 1, 2].map(|i| &self.0[i] * factor))
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.0.iter().all(Exact::is_zero)
    }

    pub(crate) fn norm_squared(&self) -> Exact {
        self.dot(self)
    }
}

impl Add for &Vec3 {
    type Output = Vec3;
    fn add(self, other: &Vec3) -> Vec3 {
        Vec3([0, 1, 2].map(|i| &self.0[i] + &other.0[i]))
    }
}

impl Sub for &Vec3 {
    type Output = Vec3;
    fn sub(self, other: &Vec3) -> Vec3 {
        Vec3([0, 1, 2].map(|i| &self.0[i] - &other.0[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decodes_every_kind_of_f64() {
        for (value, mantissa, exponent) in [
            (1.0, 1, 0),
            (-6.0, -3, 1),
            (0.75, 3, -2),
            (f64::from_bits(1), 1, -1074),
            (f64::MIN_POSITIVE, 1, -1022),
        ] {
            let exact = Exact::new(value);
            assert!(
                matches!(exact.mantissa, Mantissa::Small(m) if m == mantissa),
                "{value}"
            );
            assert_eq!(exact.exponent, exponent, "{value}");
        }
        assert_eq!(Exact::new(-0.0).sign(), 0);
    }

    #[test]
    fn large_and_small_numbers_do_not_swallow_each_other() {
        let huge = Exact::new(2f64.powi(1000));
        let tiny = Exact::new(f64::from_bits(1));
        let sum = &huge + &tiny;
        assert_eq!((&sum - &huge).compare(&tiny), Ordering::Equal);
        assert_eq!((&tiny - &sum).sign(), -1);
        // (huge + tiny)(huge - tiny) = huge^2 - tiny^2
        let product = &sum * &(&huge - &tiny);
        assert_eq!(
            product.compare(&(huge.square() - tiny.square())),
            Ordering::Equal
        );
    }

    #[test]
    fn overflow_of_the_small_form_is_exact() {
        let x = Exact::new(2f64.powi(53) - 1.0);
        let mut power = Exact::ONE;
        for _ in 0..10 {
            power = &power * &x;
        }
        let expected = BigInt::from((1i64 << 53) - 1).pow(10);
        assert_eq!(power.big() << power.exponent, expected);
        assert_eq!((&power - &power).sign(), 0);
        assert_eq!((-&power).sign(), -1);
    }
}
