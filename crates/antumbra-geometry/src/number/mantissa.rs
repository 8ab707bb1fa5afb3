//! Whole numbers of any size, most of them on the stack.
//!
//! In: whole numbers. Out: their sums, differences, products and signs. Invariant: every result is
//! the exact one. What has at most [`LIMBS`] limbs, nearly everything that predicates make of `f64`s
//! of one scene, takes no memory; the rest is a [`BigInt`].

use std::cmp::Ordering;

use num_bigint::{BigInt, BigUint};

use super::Sign;

/// Of 64 bits. The sign of an edge seen from a start on a triangle takes about 500 bits where
/// coordinates are alike in size.
const LIMBS: usize = 9;

/// A whole number. Results are written where they stay: numbers as wide as these are dear to move.
#[derive(Clone, Debug)]
pub(super) struct Mantissa {
    short: Short,
    /// The number, if it is not short; then `short` is zero.
    long: Option<Box<BigInt>>,
}

/// A sign and limbs, the lowest first. Invariant: limbs from `len` on are zero, the one before is not,
/// and zero is not negative.
#[derive(Clone, Copy, Debug)]
struct Short {
    limbs: [u64; LIMBS],
    len: u32,
    is_negative: bool,
}

/// A result has more limbs than there are.
struct TooLong;

impl Mantissa {
    pub(super) const ZERO: Self = Self {
        short: Short::ZERO,
        long: None,
    };

    #[inline]
    pub(super) fn is_zero(&self) -> bool {
        self.long.is_none() && self.short.len == 0
    }

    pub(super) fn sign(&self) -> Sign {
        let is_negative = match &self.long {
            None => self.short.is_negative,
            Some(long) => **long < BigInt::ZERO,
        };
        match (self.is_zero(), is_negative) {
            (true, _) => Sign::Zero,
            (false, true) => Sign::Negative,
            (false, false) => Sign::Positive,
        }
    }

    #[inline]
    pub(super) fn negate(&mut self) {
        match &mut self.long {
            None => self.short.negate(),
            Some(long) => **long = -&**long,
        }
    }

    #[inline]
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = Self::ZERO;
        if self.is_short(other) && product.short.set_product(&self.short, &other.short).is_ok() {
            return product;
        }
        Self::from_long(self.to_long() * other.to_long())
    }

    /// Returns `self + other * 2^shift`, or with `-` in place of `+`.
    #[inline]
    pub(super) fn plus_shifted(&self, other: &Self, shift: u64, is_difference: bool) -> Self {
        let mut sum = Self::ZERO;
        if self.is_short(other) && sum.short.set_shifted(&other.short, shift).is_ok() {
            if is_difference {
                sum.short.negate();
            }
            if sum.short.add(&self.short).is_ok() {
                return sum;
            }
        }
        let moved = other.to_long() << shift;
        Self::from_long(if is_difference {
            self.to_long() - moved
        } else {
            self.to_long() + moved
        })
    }

    #[cold]
    pub(super) fn to_long(&self) -> BigInt {
        match &self.long {
            None => self.short.to_long(),
            Some(long) => (**long).clone(),
        }
    }

    /// Sums can be short again.
    #[cold]
    fn from_long(long: BigInt) -> Self {
        let mut mantissa = Self::ZERO;
        let digits = long.magnitude().iter_u64_digits();
        if digits.len() > LIMBS {
            mantissa.long = Some(Box::new(long));
            return mantissa;
        }
        mantissa.short.len = digits.len() as u32;
        for (limb, digit) in mantissa.short.limbs.iter_mut().zip(digits) {
            *limb = digit;
        }
        mantissa.short.is_negative = long < BigInt::ZERO;
        mantissa
    }

    /// Returns whether both are short.
    #[inline]
    fn is_short(&self, other: &Self) -> bool {
        self.long.is_none() && other.long.is_none()
    }
}

impl From<i64> for Mantissa {
    fn from(value: i64) -> Self {
        let mut mantissa = Self::ZERO;
        mantissa.short.limbs[0] = value.unsigned_abs();
        mantissa.short.len = u32::from(value != 0);
        mantissa.short.is_negative = value < 0;
        mantissa
    }
}

impl Short {
    const ZERO: Self = Self {
        limbs: [0; LIMBS],
        len: 0,
        is_negative: false,
    };

    #[inline]
    fn negate(&mut self) {
        self.is_negative = !self.is_negative && self.len != 0;
    }

    #[inline]
    fn limbs(&self) -> &[u64] {
        &self.limbs[..self.len as usize]
    }

    fn to_long(self) -> BigInt {
        let mut magnitude = BigUint::ZERO;
        for &limb in self.limbs().iter().rev() {
            magnitude = (magnitude << 64_u32) + limb;
        }
        let magnitude = BigInt::from(magnitude);
        if self.is_negative {
            -magnitude
        } else {
            magnitude
        }
    }

    /// Turns zero into `other * 2^shift`.
    #[inline]
    fn set_shifted(&mut self, other: &Self, shift: u64) -> Result<(), TooLong> {
        if other.len == 0 {
            return Ok(());
        }
        let whole = usize::try_from(shift / 64).map_err(|_| TooLong)?;
        let part = (shift % 64) as u32;
        let mut len = whole.saturating_add(other.len as usize);
        if len > LIMBS {
            return Err(TooLong);
        }
        let mut carry = 0;
        for (to, &limb) in self.limbs[whole..].iter_mut().zip(other.limbs()) {
            *to = limb << part | carry;
            // In two steps: a shift by 64 is none.
            carry = (limb >> 1) >> (63 - part);
        }
        if carry != 0 {
            *self.limbs.get_mut(len).ok_or(TooLong)? = carry;
            len += 1;
        }
        self.len = len as u32;
        self.is_negative = other.is_negative;
        Ok(())
    }

    #[inline]
    fn add(&mut self, other: &Self) -> Result<(), TooLong> {
        if self.is_negative == other.is_negative || self.len == 0 || other.len == 0 {
            return self.add_magnitude(other);
        }
        self.subtract_magnitude(other);
        Ok(())
    }

    #[inline]
    fn add_magnitude(&mut self, other: &Self) -> Result<(), TooLong> {
        let mut len = self.len.max(other.len) as usize;
        let mut carry = false;
        for (own, &limb) in self.limbs[..len].iter_mut().zip(&other.limbs) {
            let (half, first) = own.overflowing_add(limb);
            let (whole, second) = half.overflowing_add(u64::from(carry));
            *own = whole;
            carry = first | second;
        }
        if carry {
            *self.limbs.get_mut(len).ok_or(TooLong)? = 1;
            len += 1;
        }
        self.len = len as u32;
        // One of the two has no sign if it is zero.
        self.is_negative |= other.is_negative;
        Ok(())
    }

    /// The sum with a number of the other sign.
    #[inline]
    fn subtract_magnitude(&mut self, other: &Self) {
        let len = self.len.max(other.len) as usize;
        let by_limbs = || self.limbs().iter().rev().cmp(other.limbs().iter().rev());
        let is_smaller = self.len.cmp(&other.len).then_with(by_limbs) == Ordering::Less;
        let mut borrow = false;
        let mut used = 0;
        for (number, (own, &limb)) in self.limbs[..len].iter_mut().zip(&other.limbs).enumerate() {
            let (large, small) = if is_smaller {
                (limb, *own)
            } else {
                (*own, limb)
            };
            let (half, first) = large.overflowing_sub(small);
            let (whole, second) = half.overflowing_sub(u64::from(borrow));
            *own = whole;
            borrow = first | second;
            if whole != 0 {
                used = number + 1;
            }
        }
        self.len = used as u32;
        self.is_negative = used != 0 && self.is_negative != is_smaller;
    }

    /// Turns zero into a product.
    #[inline]
    fn set_product(&mut self, first: &Self, second: &Self) -> Result<(), TooLong> {
        if first.len == 0 || second.len == 0 {
            return Ok(());
        }
        // The product has this many limbs or one less.
        let most = (first.len + second.len) as usize;
        if most > LIMBS {
            return Err(TooLong);
        }
        for (place, &a) in first.limbs().iter().enumerate() {
            let mut carry = 0;
            for (to, &b) in self.limbs[place..].iter_mut().zip(second.limbs()) {
                // At most (2^64 - 1)^2 + 2 (2^64 - 1), which is 2^128 - 1.
                let sum = u128::from(a) * u128::from(b) + u128::from(*to) + u128::from(carry);
                *to = sum as u64;
                carry = (sum >> 64) as u64;
            }
            self.limbs[place + second.len as usize] = carry;
        }
        self.len = most as u32 - u32::from(self.limbs[most - 1] == 0);
        self.is_negative = first.is_negative != second.is_negative;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Checks the value and the invariant.
    fn is(found: &Mantissa, expected: &BigInt) -> Result<(), TestCaseError> {
        prop_assert_eq!(&found.to_long(), expected);
        let Short { limbs, len, .. } = found.short;
        let (used, unused) = limbs.split_at(len as usize);
        prop_assert!(unused.iter().all(|&limb| limb == 0));
        prop_assert!(used.last() != Some(&0));
        prop_assert!(len != 0 || !found.short.is_negative);
        let digits = expected.magnitude().iter_u64_digits();
        prop_assert_eq!(found.long.is_some(), digits.len() > LIMBS);
        prop_assert!(len == 0 || found.long.is_none());
        let sign = match expected.sign() {
            num_bigint::Sign::Minus => Sign::Negative,
            num_bigint::Sign::NoSign => Sign::Zero,
            num_bigint::Sign::Plus => Sign::Positive,
        };
        prop_assert_eq!(found.sign(), sign);
        Ok(())
    }

    /// Numbers of up to a few limbs more than are short; limbs of ones and zeros make carries run.
    fn any_number() -> impl Strategy<Value = BigInt> {
        let limb = prop_oneof![
            Just(0),
            Just(u64::MAX),
            Just(1),
            Just(1 << 63),
            any::<u64>()
        ];
        (prop::collection::vec(limb, 0..LIMBS + 3), any::<bool>()).prop_map(|(limbs, negative)| {
            let mut magnitude = BigInt::ZERO;
            for limb in limbs {
                magnitude = (magnitude << 64_u32) + limb;
            }
            if negative { -magnitude } else { magnitude }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn agrees_with_the_library(
            a in any_number(),
            b in any_number(),
            shift in 0..300_u64,
            is_close in any::<bool>(),
        ) {
            // Numbers that cancel, too.
            let b = if is_close { &a + (&b >> 500_u32) } else { b };
            let (short_a, short_b) = (Mantissa::from_long(a.clone()), Mantissa::from_long(b.clone()));
            is(&short_a, &a)?;
            let mut negated = short_a.clone();
            negated.negate();
            is(&negated, &-&a)?;
            is(&short_a.times(&short_b), &(&a * &b))?;
            for shift in [0, shift] {
                let moved = &b << shift;
                is(&short_a.plus_shifted(&short_b, shift, false), &(&a + &moved))?;
                is(&short_a.plus_shifted(&short_b, shift, true), &(&a - &moved))?;
            }
        }

        #[test]
        fn takes_whole_numbers(value in any::<i64>()) {
            for value in [value, 0, i64::MIN, i64::MAX, -1] {
                is(&Mantissa::from(value), &BigInt::from(value))?;
            }
        }
    }

    #[test]
    fn shifts_of_any_length_are_exact_or_long() {
        let one = Mantissa::from(1);
        for shift in [
            0,
            1,
            63,
            64,
            65,
            64 * LIMBS as u64 - 1,
            64 * LIMBS as u64,
            5000,
        ] {
            let shifted = Mantissa::ZERO.plus_shifted(&one, shift, false);
            assert_eq!(shifted.to_long(), BigInt::from(1) << shift, "{shift}");
            assert_eq!(shifted.long.is_none(), shift < 64 * LIMBS as u64, "{shift}");
        }
    }
}
