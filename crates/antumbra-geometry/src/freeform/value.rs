//! Numbers that a field is computed in: `f64`, what `f64` may give anywhere on a stretch, and `f64` with a derivative.

use std::ops::{Add, Mul, Sub};

/// A number of some kind. What is computed twice from the same formula is the same operations in the same order.
pub(super) trait Value:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    fn constant(value: f64) -> Self;
    fn squared(self) -> Self;
    /// Of a number that is not negative.
    fn root(self) -> Self;
    fn sine(self) -> Self;
    fn cosine(self) -> Self;
    /// The number, or 0 where it is less.
    fn not_negative(self) -> Self;

    fn scaled(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
}

impl Value for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn squared(self) -> Self {
        self * self
    }

    fn root(self) -> Self {
        self.sqrt()
    }

    fn sine(self) -> Self {
        libm::sin(self)
    }

    fn cosine(self) -> Self {
        libm::cos(self)
    }

    fn not_negative(self) -> Self {
        self.max(0.0)
    }
}

/// All that the same operations may give in `f64` for arguments between two bounds.
///
/// Rounding to nearest keeps order: a sum, difference, product or root of numbers within bounds is, once rounded, within
/// the rounded ones of the bounds. So bounds need no rounding outwards; only sines do, whose rounding keeps no order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Range {
    pub(super) fn between(one: f64, other: f64) -> Self {
        Self {
            low: one.min(other),
            high: one.max(other),
        }
    }

    /// Sines and cosines: the values at both ends, and 1 or -1 where the stretch holds such a place.
    fn wave(self, at: impl Fn(f64) -> f64, crest: f64) -> Self {
        use std::f64::consts::TAU;
        const ROOM: f64 = 1.0 / (1_u64 << 40) as f64;
        let whole = Self {
            low: -1.0,
            high: 1.0,
        };
        // Far out a turn is lost in rounding.
        let is_short = self.high - self.low < TAU;
        if !is_short || self.low.abs().max(self.high.abs()) > FARTHEST {
            return whole;
        }
        // Whether the stretch holds `place + k TAU`, with room for rounding.
        let holds = |place: f64| {
            let turns = ((self.low - place) / TAU - ROOM).ceil();
            place + turns * TAU <= self.high + ROOM
        };
        let (first, last) = (at(self.low), at(self.high));
        let low = if holds(crest + 0.5 * TAU) {
            -1.0
        } else {
            first.min(last) - ROOM
        };
        let high = if holds(crest) {
            1.0
        } else {
            first.max(last) + ROOM
        };
        Self { low, high }
    }
}

/// Beyond it the argument of a sine is any angle.
const FARTHEST: f64 = 65536.0;

impl Add for Range {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            low: self.low + other.low,
            high: self.high + other.high,
        }
    }
}

impl Sub for Range {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            low: self.low - other.high,
            high: self.high - other.low,
        }
    }
}

impl Mul for Range {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let [a, b, c, d] = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        Self {
            low: a.min(b).min(c.min(d)),
            high: a.max(b).max(c.max(d)),
        }
    }
}

impl Value for Range {
    fn constant(value: f64) -> Self {
        Self {
            low: value,
            high: value,
        }
    }

    fn squared(self) -> Self {
        let (low, high) = (self.low * self.low, self.high * self.high);
        let is_through_zero = self.low <= 0.0 && self.high >= 0.0;
        Self {
            low: if is_through_zero { 0.0 } else { low.min(high) },
            high: low.max(high),
        }
    }

    fn root(self) -> Self {
        Self {
            low: self.low.sqrt(),
            high: self.high.sqrt(),
        }
    }

    fn sine(self) -> Self {
        self.wave(libm::sin, std::f64::consts::FRAC_PI_2)
    }

    fn cosine(self) -> Self {
        self.wave(libm::cos, 0.0)
    }

    fn not_negative(self) -> Self {
        Self {
            low: self.low.max(0.0),
            high: self.high.max(0.0),
        }
    }
}

/// A number and its derivative along some direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    pub(super) value: f64,
    pub(super) slope: f64,
}

impl Add for Slope {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: self.slope + other.slope,
        }
    }
}

impl Sub for Slope {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            slope: self.slope - other.slope,
        }
    }
}

impl Mul for Slope {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
}

impl Value for Slope {
    fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }

    fn squared(self) -> Self {
        Self {
            value: self.value * self.value,
            slope: 2.0 * (self.value * self.slope),
        }
    }

    fn root(self) -> Self {
        let value = self.value.sqrt();
        let slope = if value > 0.0 {
            self.slope / (2.0 * value)
        } else {
            0.0
        };
        Self { value, slope }
    }

    fn sine(self) -> Self {
        Self {
            value: libm::sin(self.value),
            slope: self.slope * libm::cos(self.value),
        }
    }

    fn cosine(self) -> Self {
        Self {
            value: libm::cos(self.value),
            slope: -(self.slope * libm::sin(self.value)),
        }
    }

    fn not_negative(self) -> Self {
        if self.value > 0.0 {
            self
        } else {
            Self::constant(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wild<V: Value>(x: V) -> V {
        let wave = (x.scaled(3.0).sine() * x.cosine() + x.squared().scaled(0.1)).squared();
        (wave + V::constant(0.25)).root() - (V::constant(1.0) - x).not_negative() * x
    }

    #[test]
    fn ranges_hold_what_f64_gives_between_their_ends() {
        let mut random = 1_u64;
        let mut draw = || {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1);
            (random >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..2000 {
            let from = 20.0 * draw() - 10.0;
            let to = from + 3.0 * draw() * draw();
            let range = wild(Range::between(from, to));
            assert!(range.high - range.low < 200.0);
            for number in 0..=50 {
                let x = from + (to - from) * (f64::from(number) / 50.0);
                let value = wild(x.clamp(from, to));
                assert!(range.low <= value && value <= range.high, "{from} {to} {x}");
            }
        }
    }

    #[test]
    fn slopes_are_derivatives() {
        for x in [-2.3, -0.4, 0.3, 1.7, 4.0] {
            let step = 1e-6;
            let expected = (wild(x + step) - wild(x - step)) / (2.0 * step);
            let found = wild(Slope {
                value: x,
                slope: 1.0,
            });
            assert_eq!(found.value, wild(x));
            assert!((found.slope - expected).abs() < 1e-6, "{x}");
        }
    }
}
