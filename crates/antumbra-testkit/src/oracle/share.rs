//! Rational places on a segment.

use std::cmp::Ordering;

use crate::exact::Exact;

/// A place on a segment: an exact share of its length from its first end.
#[derive(Clone, Debug)]
pub struct OracleShare(pub(super) Exact);

impl OracleShare {
    /// Returns a share with exactly this value.
    ///
    /// # Panics
    ///
    /// When the number is not finite.
    pub fn new(share: f64) -> Self {
        Self(Exact::new(share))
    }

    pub(super) fn of(share: Exact) -> Self {
        Self(share)
    }

    /// Says which of two places is nearer to the first end.
    pub fn compare(&self, other: &Self) -> Ordering {
        self.0.compare(&other.0)
    }

    /// Returns the place half way between two.
    pub fn between(&self, other: &Self) -> Self {
        Self(&(&self.0 + &other.0) * &Exact::new(0.5))
    }
}
