//! Exact zeros of linear and quadratic forms.
//!
//! In: coefficients. Out: a real number made of exact ones and one square root, which of two is less, and the share of a
//! segment that it stands for, rounded once. Invariant: comparisons are exact. Signs of sums of two roots are found by
//! squaring, so no root is ever drawn.

use std::cmp::Ordering;

use crate::number::{Exact, Number, Sign};

/// The number `(rational + root) / denominator`; the denominator is above zero.
///
/// It is the ratio `t / (1 - t)` of a place `t` inside of a segment: that grows with `t`, and zeros of homogeneous forms are
/// such ratios.
#[derive(Clone, Debug)]
pub(super) struct Surd {
    rational: Exact,
    root: Option<Root>,
    denominator: Exact,
}

/// A square root, or the negative of one.
#[derive(Clone, Debug)]
struct Root {
    is_negative: bool,
    /// Not below zero.
    square: Exact,
}

fn sign_of(number: &Exact) -> Sign {
    number.sign().unwrap_or(Sign::Zero)
}

/// Returns the sign of `a + b sqrt(square)`.
fn sign_of_sum(a: &Exact, b: &Exact, square: &Exact) -> Sign {
    let sign = sign_of(a);
    let other = if sign_of(square) == Sign::Zero {
        Sign::Zero
    } else {
        sign_of(b)
    };
    if other == Sign::Zero || other == sign {
        return sign;
    }
    if sign == Sign::Zero {
        return other;
    }
    let excess = a.times(a).minus(&b.times(b).times(square));
    match sign_of(&excess) {
        Sign::Positive => sign,
        Sign::Zero => Sign::Zero,
        Sign::Negative => other,
    }
}

impl Surd {
    /// Makes a quotient whose parts have one sign, or a zero numerator.
    pub(super) fn quotient(numerator: &Exact, denominator: &Exact) -> Self {
        let magnitude = |number: &Exact| match sign_of(number) {
            Sign::Negative => number.negated(),
            _ => number.clone(),
        };
        Self {
            rational: magnitude(numerator),
            root: None,
            denominator: magnitude(denominator),
        }
    }

    /// Makes a zero `x` of `a x^2 + 2 b x + c`, the larger one or the smaller one; `a` is not zero and there are two.
    pub(super) fn zero([a, b, c]: [&Exact; 3], is_larger: bool) -> Self {
        let square = b.times(b).minus(&a.times(c));
        let (rational, denominator) = match sign_of(a) {
            Sign::Negative => (b.clone(), a.negated()),
            _ => (b.negated(), a.clone()),
        };
        Self {
            rational,
            root: Some(Root {
                is_negative: !is_larger,
                square,
            }),
            denominator,
        }
    }

    pub(super) fn compare(&self, other: &Self) -> Ordering {
        // x + y sqrt(p) + z sqrt(q), over a denominator above zero.
        let x = self
            .rational
            .times(&other.denominator)
            .minus(&other.rational.times(&self.denominator));
        let signed = |factor: &Exact, is_negative: bool| {
            if is_negative {
                factor.negated()
            } else {
                factor.clone()
            }
        };
        let sign = match (&self.root, &other.root) {
            (None, None) => sign_of(&x),
            (Some(own), None) => {
                let y = signed(&other.denominator, own.is_negative);
                sign_of_sum(&x, &y, &own.square)
            }
            (None, Some(its)) => {
                let z = signed(&self.denominator, !its.is_negative);
                sign_of_sum(&x, &z, &its.square)
            }
            (Some(own), Some(its)) => {
                let y = signed(&other.denominator, own.is_negative);
                let z = signed(&self.denominator, !its.is_negative);
                sign_of_both(&x, [&y, &own.square], [&z, &its.square])
            }
        };
        sign.to_i8().cmp(&0)
    }

    /// Returns the number nearest to the share `t`, the even one of two.
    pub(super) fn nearest_share(&self) -> f64 {
        let is_less = |share: f64| self.compare_share(&Exact::from_f64(share)).is_lt();
        // Numbers from zero up are in the order of their bits. A step that doubles finds two around the share.
        let whole = 1.0_f64.to_bits();
        let guess = self.rough_share().to_bits().min(whole - 1);
        let (mut low, mut high) = (guess, guess);
        let mut step = 1;
        if is_less(f64::from_bits(guess)) {
            while low != 0 && is_less(f64::from_bits(low)) {
                high = low;
                low = low.saturating_sub(step);
                step *= 2;
            }
        } else {
            while high != whole && !is_less(f64::from_bits(high)) {
                low = high;
                high = (high + step).min(whole);
                step *= 2;
            }
        }
        while high - low > 1 {
            let middle = low.midpoint(high);
            if is_less(f64::from_bits(middle)) {
                high = middle;
            } else {
                low = middle;
            }
        }
        let [below, above] = [low, high].map(f64::from_bits);
        let sum = Exact::from_f64(below).plus(&Exact::from_f64(above));
        match self.compare_share(&sum.times(&Exact::from_f64(0.5))) {
            Ordering::Less => below,
            Ordering::Greater => above,
            Ordering::Equal if low % 2 == 0 => below,
            Ordering::Equal => above,
        }
    }

    /// Says on which side of a share, from 0 to below 1, this is.
    fn compare_share(&self, share: &Exact) -> Ordering {
        self.compare(&Self {
            rational: share.clone(),
            root: None,
            denominator: Exact::from_f64(1.0).minus(share),
        })
    }

    /// Returns about the share, or any number from 0 to 1.
    fn rough_share(&self) -> f64 {
        let rational = self.rational.over(&self.denominator);
        let root = self.root.as_ref().map_or(0.0, |root| {
            let square = self.denominator.times(&self.denominator);
            let size = root.square.over(&square).sqrt();
            if root.is_negative { -size } else { size }
        });
        let ratio = rational + root;
        let share = ratio / (1.0 + ratio);
        if (0.0..=1.0).contains(&share) {
            share
        } else {
            0.5
        }
    }
}

/// Returns the sign of `x + y sqrt(p) + z sqrt(q)`.
fn sign_of_both(x: &Exact, [y, p]: [&Exact; 2], [z, q]: [&Exact; 2]) -> Sign {
    let first = sign_of_sum(x, y, p);
    let second = match sign_of(q) {
        Sign::Zero => Sign::Zero,
        _ => sign_of(z),
    };
    if second == Sign::Zero || second == first {
        return first;
    }
    if first == Sign::Zero {
        return second;
    }
    // Of opposite signs: the one with the larger square wins. (x + y sqrt(p))^2 - z^2 q
    let squares = x.times(x).plus(&y.times(y).times(p));
    let rest = squares.minus(&z.times(z).times(q));
    let mixed = x.times(y);
    match sign_of_sum(&rest, &mixed.plus(&mixed), p) {
        Sign::Positive => first,
        Sign::Zero => Sign::Zero,
        Sign::Negative => second,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64) -> Exact {
        Exact::from_f64(value)
    }

    fn zero(a: f64, b: f64, c: f64, is_larger: bool) -> Surd {
        let [a, b, c] = [a, b, c].map(number);
        Surd::zero([&a, &b, &c], is_larger)
    }

    fn quotient(numerator: f64, denominator: f64) -> Surd {
        Surd::quotient(&number(numerator), &number(denominator))
    }

    #[test]
    fn roots_are_in_the_order_of_their_values() {
        // sqrt(2), 1 + sqrt(3), 3 - sqrt(5), (1 + sqrt(5)) / 2 and some quotients.
        let numbers = [
            (zero(1.0, -3.0, 4.0, false), 3.0 - 5_f64.sqrt()),
            (quotient(-141.0, -100.0), 1.41),
            (zero(1.0, 0.0, -2.0, true), 2_f64.sqrt()),
            (quotient(3.0, 2.0), 1.5),
            (zero(2.0, -1.0, -2.0, true), 0.5 + 1.25_f64.sqrt()),
            (zero(-1.0, 1.0, 2.0, true), 1.0 + 3_f64.sqrt()),
            (zero(1.0, -3.0, 4.0, true), 3.0 + 5_f64.sqrt()),
        ];
        for (one, value) in &numbers {
            for (other, other_value) in &numbers {
                let expected = value.partial_cmp(other_value).unwrap();
                assert_eq!(one.compare(other), expected, "{value} {other_value}");
            }
            let share = value / (1.0 + value);
            assert!((one.nearest_share() - share).abs() <= f64::EPSILON);
        }
    }

    #[test]
    fn one_number_made_in_two_ways_is_equal() {
        // sqrt(8) = 2 sqrt(2); (2 + sqrt(4)) / 2 = 2; a double root.
        let eight = zero(1.0, 0.0, -8.0, true);
        let twice = zero(0.25, 0.0, -2.0, true);
        assert!(eight.compare(&twice).is_eq());
        assert!(
            zero(2.0, -2.0, 0.0, true)
                .compare(&quotient(2.0, 1.0))
                .is_eq()
        );
        let double = zero(1.0, -3.0, 9.0, false);
        assert!(double.compare(&quotient(3.0, 1.0)).is_eq());
        assert!(double.compare(&zero(1.0, -3.0, 9.0, true)).is_eq());
        // 1e-30 apart, far below what f64 tells.
        let near = zero(1.0, 0.0, -8.0 - 1e-13, true);
        assert!(eight.compare(&near).is_lt() && near.compare(&twice).is_gt());
        let [a, b] = [number(1.0), number(-8.0).minus(&number(1e-60))];
        let nearer = Surd::zero([&a, &number(0.0), &b], true);
        assert!(twice.compare(&nearer).is_lt() && nearer.compare(&near).is_lt());
    }

    #[test]
    fn shares_are_rounded_once() {
        for (numerator, denominator) in [(1.0, 2.0), (5e-324, 1.0), (1.0, 1e300), (1e300, 1.0)] {
            let share = quotient(numerator, denominator).nearest_share();
            assert_eq!(share, numerator / (numerator + denominator), "{numerator}");
        }
        // Half way between 0.5 and the next number, and a hair beside it.
        let at = |offset: f64, beyond: f64| {
            let share = number(0.5).plus(&number(offset)).plus(&number(beyond));
            Surd::quotient(&share, &number(1.0).minus(&share)).nearest_share()
        };
        let quarter = 0.25 * f64::EPSILON;
        assert_eq!(at(quarter, 0.0), 0.5);
        assert_eq!(at(quarter, 1e-300), 0.5_f64.next_up());
        assert_eq!(at(3.0 * quarter, 0.0), 0.5_f64.next_up().next_up());
        assert_eq!(at(3.0 * quarter, -1e-300), 0.5_f64.next_up());
    }
}
