//! Exact places on a segment where a form is zero.
//!
//! In: a form as a polynomial of the place, of degree two at most. Out: its zeros between the ends, their order and the numbers nearest to them. No root is ever drawn: a zero is an interval that holds it alone, cut in
//! half until it is told from others; whether two are the same place is told by what their polynomials have in common.

use std::cmp::Ordering;

use super::share::OracleShare;
use crate::exact::Exact;

/// How often an interval is cut in half at first, so that most are told apart at once.
const FIRST_CUTS: usize = 40;

/// The function `c0 + c1 t + c2 t^2`.
#[derive(Clone, Debug)]
pub(super) struct Polynomial {
    c0: Exact,
    c1: Exact,
    c2: Exact,
}

/// The quotient of two numbers, the second above zero.
struct Fraction {
    over: Exact,
    under: Exact,
}

/// What zeros two polynomials have in common.
enum Common {
    All,
    One(Fraction),
    None,
}

impl Polynomial {
    /// Returns the polynomial with these values at -1, 0, 1 and 2.
    ///
    /// # Panics
    ///
    /// When there is none of degree two: then the page is wrong about its forms.
    pub(super) fn through([before, at_zero, at_one, behind]: [Exact; 4]) -> Self {
        // All times two.
        let polynomial = Self {
            c0: at_zero.double(),
            c1: &at_one - &before,
            c2: &(&at_one + &before) - &at_zero.double(),
        };
        let at_two = polynomial.at(&Exact::new(2.0), &Exact::ONE);
        assert!(
            at_two.compare(&behind.double()).is_eq(),
            "forms along a segment are quadratic"
        );
        polynomial
    }

    /// The value at `over / under`, times `under^2`.
    fn at(&self, over: &Exact, under: &Exact) -> Exact {
        let linear = &(&self.c0 * under) + &(&self.c1 * over);
        &(&linear * under) + &(&self.c2 * &over.square())
    }

    fn sign_at(&self, x: &Exact) -> i8 {
        self.at(x, &Exact::ONE).sign()
    }

    fn slope_sign_at(&self, x: &Exact) -> i8 {
        (&self.c1 + &(&self.c2.double() * x)).sign()
    }

    /// Returns the zeros strictly between 0 and 1; of a function that is zero throughout none.
    pub(super) fn zeros(&self) -> Vec<OraclePlace> {
        if !self.c2.is_zero() && self.discriminant().is_zero() {
            // It touches zero where its slope is zero.
            let slope = Self {
                c0: self.c1.clone(),
                c1: self.c2.double(),
                c2: Exact::ZERO,
            };
            return slope.zeros();
        }
        let mut ends = vec![Exact::ZERO];
        ends.extend(self.between_zeros());
        ends.push(Exact::ONE);
        let pairs = ends.windows(2).filter_map(|pair| {
            let [low, high] = pair else { return None };
            (self.sign_at(low) * self.sign_at(high) < 0).then(|| {
                let mut place = OraclePlace {
                    polynomial: self.clone(),
                    low: low.clone(),
                    high: high.clone(),
                };
                for _ in 0..FIRST_CUTS {
                    place.cut();
                }
                place
            })
        });
        pairs.collect()
    }

    fn discriminant(&self) -> Exact {
        &self.c1.square() - &(&Exact::new(4.0) * &(&self.c0 * &self.c2))
    }

    /// A place between two zeros, if both may be between 0 and 1.
    fn between_zeros(&self) -> Option<Exact> {
        let bent = self.c2.sign();
        let turns = self.slope_sign_at(&Exact::ZERO) * self.slope_sign_at(&Exact::ONE) < 0;
        if bent == 0 || self.discriminant().sign() <= 0 || !turns {
            return None;
        }
        let (mut low, mut high) = (Exact::ZERO, Exact::ONE);
        loop {
            let middle = half_way(&low, &high);
            if self.sign_at(&middle) == -bent {
                return Some(middle);
            }
            // The lowest point of what opens upwards, or the reverse, is where the slope changes.
            if self.slope_sign_at(&middle) == bent {
                high = middle;
            } else {
                low = middle;
            }
        }
    }

    /// The one zero of a linear polynomial.
    fn quotient(&self) -> Option<Fraction> {
        match self.c1.sign() {
            0 => None,
            1 => Some(Fraction {
                over: -&self.c0,
                under: self.c1.clone(),
            }),
            _ => Some(Fraction {
                over: self.c0.clone(),
                under: -&self.c1,
            }),
        }
    }

    fn common(&self, other: &Self) -> Common {
        let vanishes = |polynomial: &Self, zero: Option<Fraction>| match zero {
            Some(zero) if polynomial.at(&zero.over, &zero.under).is_zero() => Common::One(zero),
            _ => Common::None,
        };
        match (self.c2.is_zero(), other.c2.is_zero()) {
            (true, _) => vanishes(other, self.quotient()),
            (false, true) => vanishes(self, other.quotient()),
            (false, false) => {
                let rest = |own: &Exact, its: &Exact| &(own * &other.c2) - &(its * &self.c2);
                let rest = Self {
                    c0: rest(&self.c0, &other.c0),
                    c1: rest(&self.c1, &other.c1),
                    c2: Exact::ZERO,
                };
                if rest.c0.is_zero() && rest.c1.is_zero() {
                    Common::All
                } else {
                    vanishes(self, rest.quotient())
                }
            }
        }
    }
}

fn half_way(low: &Exact, high: &Exact) -> Exact {
    &(low + high) * &Exact::new(0.5)
}

/// A place on a segment: an end, or a zero between the ends.
#[derive(Clone, Debug)]
pub struct OraclePlace {
    polynomial: Polynomial,
    /// The place is strictly between these, where the polynomial has opposite signs; or they are equal and the place.
    low: Exact,
    high: Exact,
}

impl OraclePlace {
    /// The place with a share of the length from the first end.
    pub(super) fn end(share: f64) -> Self {
        let share = Exact::new(share);
        Self {
            polynomial: Polynomial {
                c0: -&share,
                c1: Exact::ONE,
                c2: Exact::ZERO,
            },
            low: share.clone(),
            high: share,
        }
    }

    fn is_known(&self) -> bool {
        self.low.compare(&self.high).is_eq()
    }

    /// Halves the interval.
    fn cut(&mut self) {
        if self.is_known() {
            return;
        }
        let middle = half_way(&self.low, &self.high);
        let sign = self.polynomial.sign_at(&middle);
        if sign == 0 {
            self.low = middle.clone();
            self.high = middle;
        } else if sign == self.polynomial.sign_at(&self.low) {
            self.low = middle;
        } else {
            self.high = middle;
        }
    }

    /// Says on which side of a share this is.
    fn compare_share(&self, share: &Exact) -> Ordering {
        if self.is_known() {
            return self.low.compare(share);
        }
        if share.compare(&self.low).is_le() {
            return Ordering::Greater;
        }
        if share.compare(&self.high).is_ge() {
            return Ordering::Less;
        }
        match self.polynomial.sign_at(share) {
            0 => Ordering::Equal,
            sign if sign == self.polynomial.sign_at(&self.low) => Ordering::Greater,
            _ => Ordering::Less,
        }
    }

    fn holds(&self, zero: &Fraction) -> bool {
        let is_above = |bound: &Exact| zero.over.compare(&(bound * &zero.under)).is_gt();
        let is_below = |bound: &Exact| zero.over.compare(&(bound * &zero.under)).is_lt();
        is_above(&self.low) && is_below(&self.high)
    }

    fn is_same(&self, other: &Self) -> bool {
        if self.is_known() {
            return other.compare_share(&self.low).is_eq();
        }
        if other.is_known() {
            return self.compare_share(&other.low).is_eq();
        }
        match self.polynomial.common(&other.polynomial) {
            Common::None => false,
            Common::One(zero) => self.holds(&zero) && other.holds(&zero),
            Common::All => {
                let larger = |a: &Exact, b: &Exact| {
                    if a.compare(b).is_gt() {
                        a.clone()
                    } else {
                        b.clone()
                    }
                };
                let smaller = |a: &Exact, b: &Exact| {
                    if a.compare(b).is_lt() {
                        a.clone()
                    } else {
                        b.clone()
                    }
                };
                let (low, high) = (
                    larger(&self.low, &other.low),
                    smaller(&self.high, &other.high),
                );
                let signs = [&low, &high].map(|x| self.polynomial.sign_at(x));
                low.compare(&high).is_lt() && signs[0] * signs[1] < 0
            }
        }
    }

    /// Says which of two places is nearer to the first end.
    pub fn compare(&self, other: &Self) -> Ordering {
        if self.high.compare(&other.low).is_lt() {
            return Ordering::Less;
        }
        if self.low.compare(&other.high).is_gt() {
            return Ordering::Greater;
        }
        if self.is_same(other) {
            return Ordering::Equal;
        }
        let (mut one, mut two) = (self.clone(), other.clone());
        loop {
            if one.high.compare(&two.low).is_le() {
                return Ordering::Less;
            }
            if two.high.compare(&one.low).is_le() {
                return Ordering::Greater;
            }
            one.cut();
            two.cut();
        }
    }

    /// Returns some place strictly between this one and a later one.
    pub(super) fn between(&self, later: &Self) -> OracleShare {
        let (mut one, mut two) = (self.clone(), later.clone());
        while one.high.compare(&two.low).is_ge() {
            one.cut();
            two.cut();
        }
        OracleShare::of(half_way(&one.high, &two.low))
    }

    /// Returns the number nearest to the share, the even one of two.
    pub fn nearest(&self) -> f64 {
        // Numbers from zero up are in the order of their bits.
        let (mut low, mut high) = (0, 1.0_f64.to_bits());
        if self.compare_share(&Exact::ONE).is_eq() {
            return 1.0;
        }
        while high - low > 1 {
            let middle = low.midpoint(high);
            let number = Exact::new(f64::from_bits(middle));
            if self.compare_share(&number).is_lt() {
                high = middle;
            } else {
                low = middle;
            }
        }
        let [below, above] = [low, high].map(f64::from_bits);
        let middle = half_way(&Exact::new(below), &Exact::new(above));
        match self.compare_share(&middle) {
            Ordering::Less => below,
            Ordering::Greater => above,
            Ordering::Equal if low % 2 == 0 => below,
            Ordering::Equal => above,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial([c0, c1, c2]: [f64; 3]) -> Polynomial {
        let [c0, c1, c2] = [c0, c1, c2].map(Exact::new);
        let at = |t: f64| &c0 + &(&(&c1 + &(&c2 * &Exact::new(t))) * &Exact::new(t));
        Polynomial::through([-1.0, 0.0, 1.0, 2.0].map(at))
    }

    #[test]
    fn zeros_are_found_in_order_and_rounded_once() {
        // (t - 1/4)(t - 3/4), t^2 - 1/2, 3 t - 1, a double zero, no zero, zeros at both ends.
        let cases: [([f64; 3], &[f64]); 7] = [
            ([0.1875, -1.0, 1.0], &[0.25, 0.75]),
            ([-0.5, 0.0, 1.0], &[0.5_f64.sqrt()]),
            ([0.5, 0.0, -1.0], &[0.5_f64.sqrt()]),
            ([-1.0, 3.0, 0.0], &[1.0 / 3.0]),
            ([0.25, -1.0, 1.0], &[0.5]),
            ([1.0, -1.0, 1.0], &[]),
            ([0.0, -1.0, 1.0], &[]),
        ];
        for (coefficients, expected) in cases {
            let zeros = polynomial(coefficients).zeros();
            let found: Vec<f64> = zeros.iter().map(OraclePlace::nearest).collect();
            assert_eq!(found, expected, "{coefficients:?}");
            for pair in zeros.windows(2) {
                assert!(pair[0].compare(&pair[1]).is_lt());
            }
        }
        // Half way between two numbers.
        let at = |over: &Exact| {
            let polynomial = Polynomial {
                c0: -over,
                c1: Exact::new(2.0),
                c2: Exact::ZERO,
            };
            polynomial.zeros()[0].nearest()
        };
        let twice = Exact::ONE + Exact::new(0.5 * f64::EPSILON);
        assert_eq!(at(&twice), 0.5);
        assert_eq!(at(&(&twice + &Exact::new(1e-300))), 0.5_f64.next_up());
    }

    #[test]
    fn one_place_is_equal_however_it_is_made() {
        let one =
            |coefficients, number: usize| polynomial(coefficients).zeros().swap_remove(number);
        // sqrt(1/2) twice, as the zero of a cube's factor times another, and of a linear form.
        let root = one([-0.5, 0.0, 1.0], 0);
        assert!(root.compare(&one([2.0, 0.0, -4.0], 0)).is_eq());
        assert!(root.compare(&one([-0.5, 1e-15, 1.0], 0)).is_gt());
        assert!(root.compare(&one([-0.5, -1e-15, 1.0], 0)).is_lt());
        // (3 t - 1)(t - 2) and 3 t - 1.
        let third = one([-1.0, 3.0, 0.0], 0);
        let other = one([2.0, -7.0, 3.0], 0);
        assert!(third.compare(&other).is_eq() && other.compare(&third).is_eq());
        // (4 t - 1)(3 t - 1) has it as its last.
        let last = one([1.0, -7.0, 12.0], 1);
        assert!(last.compare(&third).is_eq() && other.compare(&last).is_eq());
        let first = one([1.0, -7.0, 12.0], 0);
        assert!(first.compare(&last).is_lt() && third.compare(&first).is_gt());
        let ends = [OraclePlace::end(0.0), OraclePlace::end(1.0)];
        assert!(ends[0].compare(&first).is_lt() && ends[1].compare(&root).is_gt());
        assert_eq!([0, 1].map(|end| ends[end].nearest()), [0.0, 1.0]);
    }
}
