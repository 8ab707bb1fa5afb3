//! Numbers for predicates: written once, evaluated twice.
//!
//! Every predicate is a polynomial in the given `f64`s, written over [`Number`]. It is first
//! evaluated in [`Approximate`] (`f64` with a running error bound); where that cannot tell a
//! sign, in [`Exact`]. Invariant: a sign that is returned is the sign of the exact real value.

mod approximate;
mod exact;
mod mantissa;
mod space;

pub(crate) use approximate::{Approximate, UNIT_ROUNDOFF};
pub(crate) use exact::Exact;
pub(crate) use space::{Point4, Vector};

/// The sign of an exact value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    Negative,
    Zero,
    Positive,
}

impl Sign {
    pub(crate) fn is_positive(self) -> bool {
        self == Self::Positive
    }

    pub(crate) fn is_negative(self) -> bool {
        self == Self::Negative
    }

    /// Returns whether one is positive and the other negative.
    pub(crate) fn is_opposite(self, other: Self) -> bool {
        self != Self::Zero && other == self.flipped()
    }

    pub(crate) fn flipped(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }

    /// Returns -1, 0 or 1.
    pub(crate) fn to_i8(self) -> i8 {
        match self {
            Self::Negative => -1,
            Self::Zero => 0,
            Self::Positive => 1,
        }
    }
}

/// A ring in which predicates are evaluated.
pub(crate) trait Number: Clone {
    fn from_f64(value: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    fn negated(&self) -> Self;
    /// Returns the sign, or `None` if this evaluation cannot tell.
    fn sign(&self) -> Option<Sign>;
}

/// Returns what the filter says or else what exact arithmetic says.
pub(crate) fn decide<T>(filtered: Option<T>, exact: impl FnOnce() -> Option<T>) -> T {
    filtered
        .or_else(exact)
        .expect("exact arithmetic always knows the sign")
}
