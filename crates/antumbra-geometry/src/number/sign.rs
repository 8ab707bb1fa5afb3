//! Signs, and the rings in which predicates are evaluated.

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
