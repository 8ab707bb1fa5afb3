//! Numbers of twice the bits of `f64`, for rounding a quotient or a root once.
//!
//! In: sums, differences and products of `f64`s. Out: an unevaluated sum of two. Invariant: each operation is right to
//! 2^-100 of what it is made of, as long as nothing leaves the range of normal numbers. (Dekker 1971; Hida, Li and Bailey
//! 2001.)

use glam::DVec3;

/// The sum of two numbers, the second at most half a rounding of the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Double {
    pub(super) high: f64,
    pub(super) low: f64,
}

/// Returns a sum and what rounding took from it (Knuth).
#[inline(always)]
fn two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let b_part = high - a;
    let a_part = high - b_part;
    Double {
        high,
        low: (a - a_part) + (b - b_part),
    }
}

impl Double {
    /// Returns a difference, exactly.
    #[inline(always)]
    pub(super) fn difference(a: f64, b: f64) -> Self {
        two_sum(a, -b)
    }

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        let high = two_sum(self.high, other.high);
        let low = two_sum(self.low, other.low);
        let sum = two_sum(high.high, high.low + low.high);
        two_sum(sum.high, sum.low + low.low)
    }

    #[inline(always)]
    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    #[inline(always)]
    pub(super) fn negated(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }

    /// Returns the number times a power of two.
    #[inline(always)]
    pub(super) fn scaled(self, power: f64) -> Self {
        Self {
            high: self.high * power,
            low: self.low * power,
        }
    }

    #[inline(always)]
    pub(super) fn times(self, other: Self) -> Self {
        let high = self.high * other.high;
        let low = self.high.mul_add(other.high, -high);
        two_sum(high, low + (self.high * other.low + self.low * other.high))
    }

    #[inline(always)]
    pub(super) fn over(self, other: Self) -> Self {
        let first = self.high / other.high;
        let product = Self {
            high: first,
            low: 0.0,
        }
        .times(other);
        two_sum(first, self.minus(product).high / other.high)
    }

    /// Returns the square root of a number above zero.
    #[inline(always)]
    pub(super) fn root(self) -> Self {
        let high = self.high.sqrt();
        let first = Self { high, low: 0.0 };
        let rest = self.minus(first.times(first)).high;
        two_sum(high, rest / (2.0 * high))
    }
}

/// A vector of them.
pub(super) type Doubles = [Double; 3];

/// Returns the difference of two vectors, exactly.
#[inline(always)]
pub(super) fn difference(a: DVec3, b: DVec3) -> Doubles {
    [
        Double::difference(a.x, b.x),
        Double::difference(a.y, b.y),
        Double::difference(a.z, b.z),
    ]
}

#[inline(always)]
pub(super) fn cross(a: &Doubles, b: &Doubles) -> Doubles {
    let component = |i: usize, j: usize| a[i].times(b[j]).minus(a[j].times(b[i]));
    [component(1, 2), component(2, 0), component(0, 1)]
}

#[inline(always)]
pub(super) fn dot(a: &Doubles, b: &Doubles) -> Double {
    let (x, y, z) = (a[0].times(b[0]), a[1].times(b[1]), a[2].times(b[2]));
    x.plus(y).plus(z)
}
