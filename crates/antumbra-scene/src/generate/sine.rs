//! Sine and cosine, rounded correctly.
//!
//! In: an angle of a few turns at most, radians. Out: its sine and cosine, the nearest `f64`s but
//! for cases closer than 1e-30 to a tie. Why not `libm`: its last bit differs from that of the C
//! library SPD's files were made with, which shows where a coordinate is all rounding error. A
//! correctly rounded result is the same everywhere.
//!
//! Numbers here are pairs `high + low`, of about 106 bits, with Knuth's and Dekker's exact sums
//! and products.

use std::ops::{Add, Mul, Neg};

/// The unevaluated sum of two numbers that do not overlap.
#[derive(Clone, Copy, Debug)]
struct Pair {
    high: f64,
    low: f64,
}

/// Returns sine and cosine of an angle in radians, of magnitude 100 at most.
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    // A quarter turn in three parts; the third counts only where the first two cancel.
    const QUARTER: [f64; 3] = [
        std::f64::consts::FRAC_PI_2,
        6.123_233_995_736_766e-17,
        -1.497_384_904_859_169_8e-33,
    ];
    let quarters = (angle / QUARTER[0]).round();
    let rest = QUARTER
        .into_iter()
        .map(|part| -product(quarters, part))
        .fold(
            Pair {
                high: angle,
                low: 0.0,
            },
            Pair::add,
        );
    let (sine, cosine) = (
        series(rest, rest, 1.0),
        series(
            Pair {
                high: 1.0,
                low: 0.0,
            },
            rest,
            0.0,
        ),
    );
    match (quarters as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Sums Taylor's series that begins with `term`, of degree `degree` in `x`, up to degree 29: for
/// an eighth of a turn what is left is below 1e-34.
fn series(mut term: Pair, x: Pair, mut degree: f64) -> f64 {
    let negative_square = -(x * x);
    let mut terms = vec![term];
    while degree < 28.0 {
        term = (term * negative_square).over((degree + 1.0) * (degree + 2.0));
        terms.push(term);
        degree += 2.0;
    }
    // Smallest first.
    let sum = terms.into_iter().rev().reduce(Pair::add);
    sum.map_or(0.0, |sum| sum.high)
}

impl Pair {
    /// Divides by a small integer.
    fn over(self, divisor: f64) -> Self {
        let quotient = self.high / divisor;
        let left = (-quotient).mul_add(divisor, self.high) + self.low;
        sum(quotient, left / divisor)
    }
}

impl Add for Pair {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let high = sum(self.high, other.high);
        let low = sum(self.low, other.low);
        let high = sum(high.high, high.low + low.high);
        sum(high.high, high.low + low.low)
    }
}

impl Mul for Pair {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let exact = product(self.high, other.high);
        sum(
            exact.high,
            exact.low + (self.high * other.low + self.low * other.high),
        )
    }
}

impl Neg for Pair {
    type Output = Self;

    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

/// Returns the exact sum: Knuth's TwoSum.
fn sum(a: f64, b: f64) -> Pair {
    let high = a + b;
    let b_in_it = high - a;
    Pair {
        high,
        low: (a - (high - b_in_it)) + (b - b_in_it),
    }
}

/// Returns the exact product; a fused multiply-add leaves what rounding took.
fn product(a: f64, b: f64) -> Pair {
    let high = a * b;
    Pair {
        high,
        low: a.mul_add(b, -high),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Expected values: the digits of arbitrary-precision evaluation, rounded once.
    #[test]
    fn the_nearest_numbers() {
        for (angle, sine, cosine) in [
            (0.0, 0.0, 1.0),
            (1.0, 0.841_470_984_807_896_5, 0.540_302_305_868_139_8),
            (PI, 1.224_646_799_147_353_2e-16, -1.0),
            (
                2.0 * PI / 3.0,
                0.866_025_403_784_438_7,
                -0.499_999_999_999_999_8,
            ),
            (
                4.0 * PI / 3.0,
                -0.866_025_403_784_438_4,
                -0.500_000_000_000_000_4,
            ),
            (-1.0, -0.841_470_984_807_896_5, 0.540_302_305_868_139_8),
        ] {
            assert_eq!(sin_cos(angle), (sine, cosine), "{angle}");
        }
    }

    #[test]
    fn never_far_from_libm() {
        for i in -1000..1000 {
            let angle = f64::from(i) * 0.0123;
            let (sine, cosine) = sin_cos(angle);
            assert!(
                (sine - libm::sin(angle)).abs() <= 1e-15 * sine.abs(),
                "{angle}"
            );
            assert!(
                (cosine - libm::cos(angle)).abs() <= 1e-15 * cosine.abs(),
                "{angle}"
            );
        }
    }
}
