//! Forms along a segment: linear ones and quadratic ones.
//!
//! In: a form's values at both ends, and its polar value between them. Out: its sign behind the first end, and its zeros
//! between the ends at which the sign changes. Invariant: what is found is right, or nothing is.

use super::refined::Refined;
use super::surd::Surd;
use crate::number::{Exact, Number, Sign};

/// The form `first (1 - t)^2 + 2 middle (1 - t) t + last t^2`, or without a middle `first (1 - t) + last t`.
#[derive(Clone, Debug)]
pub(super) struct Quadratic<N> {
    pub(super) first: N,
    pub(super) middle: Option<N>,
    pub(super) last: N,
}

/// How a form's sign changes between the ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pattern {
    /// Right behind the first end; zero for a form that is zero all along.
    pub(super) before: Sign,
    pub(super) zeros: Zeros,
}

/// Zeros between the ends at which the sign changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Zeros {
    None,
    /// Of a linear form, or of one with a zero at an end.
    Rational,
    /// Of a form with opposite signs at the ends.
    One,
    Two,
}

impl<N: Number> Quadratic<N> {
    /// Makes a linear form.
    pub(super) fn linear(first: N, last: N) -> Self {
        Self {
            first,
            middle: None,
            last,
        }
    }

    /// Returns how the sign changes, `None` if undecided.
    pub(super) fn pattern(&self) -> Option<Pattern> {
        let (first, last) = (self.first.sign()?, self.last.sign()?);
        let pattern = |before, zeros| Some(Pattern { before, zeros });
        let is_opposite = first.is_opposite(last);
        let Some(middle) = &self.middle else {
            let zeros = if is_opposite {
                Zeros::Rational
            } else {
                Zeros::None
            };
            return pattern(if first == Sign::Zero { last } else { first }, zeros);
        };
        if is_opposite {
            return pattern(first, Zeros::One);
        }
        if first == Sign::Zero || last == Sign::Zero {
            let middle = middle.sign()?;
            // What is left when the zero at the end is divided out is linear.
            let [before, after] = if first == Sign::Zero {
                [middle, last]
            } else {
                [first, middle]
            };
            let zeros = if before.is_opposite(after) {
                Zeros::Rational
            } else {
                Zeros::None
            };
            return pattern(if before == Sign::Zero { after } else { before }, zeros);
        }
        let towards_zero = middle.sign();
        if towards_zero.is_some_and(|middle| !middle.is_opposite(first)) {
            return pattern(first, Zeros::None);
        }
        if !self.discriminant(middle).sign()?.is_positive() {
            return pattern(first, Zeros::None);
        }
        towards_zero?;
        pattern(first, Zeros::Two)
    }

    fn discriminant(&self, middle: &N) -> N {
        middle.times(middle).minus(&self.first.times(&self.last))
    }
}

impl Quadratic<Refined> {
    /// Returns the zeros of its pattern, as shares, in order. Each is a quotient of sums without cancellation.
    pub(super) fn shares(&self, zeros: Zeros) -> [Option<Refined>; 2] {
        let share = |over: Refined, under: Refined| Some(over.over(&over.plus(&under)));
        let (first, last) = (self.first.magnitude(), self.last.magnitude());
        let middle = self.middle.map(|middle| middle.magnitude());
        match (zeros, middle) {
            (Zeros::None, _) | (Zeros::One | Zeros::Two, None) => [None, None],
            (Zeros::Rational, None) => [share(first, last), None],
            (Zeros::Rational, Some(middle)) => {
                let twice = middle.plus(&middle);
                let is_first = self.first.sign() == Some(Sign::Zero);
                let [over, under] = if is_first {
                    [twice, last]
                } else {
                    [first, twice]
                };
                [share(over, under), None]
            }
            (Zeros::One, Some(middle)) => {
                let square = middle.times(&middle).plus(&first.times(&last));
                let sum = middle.plus(&square.root());
                // With the sign of the last end the middle is on its side.
                let is_on_last = self
                    .middle
                    .is_some_and(|middle| (middle.rounded() > 0.0) == (self.last.rounded() > 0.0));
                let [over, under] = if is_on_last {
                    [first, sum]
                } else {
                    [sum, last]
                };
                [share(over, under), None]
            }
            (Zeros::Two, Some(middle)) => {
                let square = middle.times(&middle).minus(&first.times(&last));
                let sum = middle.plus(&square.root());
                [share(first, sum), share(sum, last)]
            }
        }
    }
}

impl Quadratic<Exact> {
    /// Returns the zero of a pattern with one, or one of two.
    pub(super) fn zero(&self, is_last: bool) -> Surd {
        let Self { first, last, .. } = self;
        let Some(middle) = &self.middle else {
            return Surd::quotient(first, last);
        };
        let is_zero = |number: &Exact| number.sign() == Some(Sign::Zero);
        if is_zero(first) {
            return Surd::quotient(&middle.plus(middle), last);
        }
        if is_zero(last) {
            return Surd::quotient(first, &middle.plus(middle));
        }
        // Of opposite signs at the ends it has a ratio below zero, too.
        let is_one = first.sign() != last.sign();
        Surd::zero([last, middle, first], is_last || is_one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quadratic<N: Number>([first, middle, last]: [f64; 3]) -> Quadratic<N> {
        Quadratic {
            first: N::from_f64(first),
            middle: Some(N::from_f64(middle)),
            last: N::from_f64(last),
        }
    }

    #[test]
    fn zeros_are_where_the_sign_changes() {
        let numbers = [-2.0, -1.0, -0.3, 0.0, 0.3, 1.0, 2.0];
        let mut counts = [0; 4];
        for first in numbers {
            for middle in numbers {
                for last in numbers {
                    let values = [first, middle, last];
                    let (refined, exact) = (quadratic::<Refined>(values), quadratic(values));
                    let pattern = exact.pattern().expect("exact arithmetic knows");
                    if let Some(other) = refined.pattern() {
                        assert_eq!(other, pattern, "{values:?}");
                    }
                    let shares = refined.shares(pattern.zeros).map(|share| {
                        let share = share?;
                        assert!(share.error() < 1e-25, "{values:?} {share:?}");
                        Some(share.rounded())
                    });
                    counts[pattern.zeros as usize] += 1;
                    for (share, is_last) in shares.into_iter().zip([false, true]) {
                        let Some(share) = share else { continue };
                        assert_eq!(exact.zero(is_last).nearest_share(), share, "{values:?}");
                    }
                    // The sign at places in between.
                    for step in 1..64 {
                        let t = f64::from(step) / 64.0;
                        let s = 1.0 - t;
                        let value = first * s * s + 2.0 * middle * s * t + last * t * t;
                        let passed = shares.iter().flatten().filter(|&&x| x < t).count();
                        let sign = if passed == 1 {
                            pattern.before.flipped()
                        } else {
                            pattern.before
                        };
                        if value.abs() > 1e-12 {
                            assert_eq!(f64::from(sign.to_i8()), value.signum(), "{values:?} {t}");
                        }
                    }
                }
            }
        }
        assert!(counts.iter().all(|&count| count > 8), "{counts:?}");
    }

    #[test]
    fn a_touching_form_does_not_change_its_sign() {
        let touching = quadratic::<Exact>([1.0, -1.0, 1.0]);
        let expected = Pattern {
            before: Sign::Positive,
            zeros: Zeros::None,
        };
        assert_eq!(touching.pattern(), Some(expected));
        let third = quadratic::<Exact>([1.0, -2.0, 4.0]);
        assert_eq!(third.pattern(), Some(expected));
        let zero = Quadratic::linear(Exact::from_f64(0.0), Exact::from_f64(0.0));
        assert_eq!(
            zero.pattern().map(|pattern| pattern.before),
            Some(Sign::Zero)
        );
    }
}
