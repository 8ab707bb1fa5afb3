//! Exact places on a segment.

use std::cmp::Ordering;

use crate::exact::Exact;

/// A place on a segment: an exact share of its length from its first end.
#[derive(Clone, Debug)]
pub struct OracleShare {
    pub(super) over: Exact,
    /// Above zero.
    pub(super) under: Exact,
}

impl OracleShare {
    /// Returns a share with exactly this value.
    ///
    /// # Panics
    ///
    /// When the number is not finite.
    pub fn new(share: f64) -> Self {
        Self {
            over: Exact::new(share),
            under: Exact::ONE,
        }
    }

    pub(super) fn of(over: Exact, under: Exact) -> Self {
        if under.sign() < 0 {
            Self {
                over: -&over,
                under: -&under,
            }
        } else {
            Self { over, under }
        }
    }

    /// Says which of two places is nearer to the first end.
    pub fn compare(&self, other: &Self) -> Ordering {
        (&self.over * &other.under).compare(&(&other.over * &self.under))
    }

    /// Returns the place half way between two.
    pub fn between(&self, other: &Self) -> Self {
        Self {
            over: &self.over * &other.under + &other.over * &self.under,
            under: (&self.under * &other.under).double(),
        }
    }

    /// Returns the number nearest to a share from 0 to 1, the even one of two.
    pub fn nearest(&self) -> f64 {
        // Numbers from zero up are in the order of their bits.
        let (mut low, mut high) = (0, 1.0_f64.to_bits());
        while high - low > 1 {
            let middle = low.midpoint(high);
            if Self::new(f64::from_bits(middle)).compare(self).is_gt() {
                high = middle;
            } else {
                low = middle;
            }
        }
        let [below, above] = [low, high].map(f64::from_bits);
        match Self::new(below).between(&Self::new(above)).compare(self) {
            Ordering::Less => above,
            Ordering::Greater => below,
            Ordering::Equal if low % 2 == 0 => below,
            Ordering::Equal => above,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_rounded_to_the_nearest_number() {
        for (over, under) in [
            (1.0, 3.0),
            (2.0, 3.0),
            (0.1, 0.7),
            (5e-300, 0.3),
            (0.0, 2.0),
            (7.0, 7.0),
        ] {
            let share = OracleShare::of(Exact::new(over), Exact::new(under));
            assert_eq!(share.nearest(), over / under, "{over} / {under}");
            let negated = OracleShare::of(Exact::new(-over), Exact::new(-under));
            assert!(negated.compare(&share).is_eq());
        }
        // Half way between two numbers.
        let (low, high) = (0.5, 0.5_f64.next_up());
        let middle = OracleShare::new(low).between(&OracleShare::new(high));
        assert_eq!(middle.nearest(), low);
        let beyond = middle.between(&middle.between(&OracleShare::new(high)));
        assert_eq!(beyond.nearest(), high);
    }
}
