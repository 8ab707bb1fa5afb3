//! Stretches of a segment of which occlusion values know whether a light reaches them.
//!
//! In: stretches, in order and apart. Out: whether a shadow falls on known points alone, and whether a gap between shadows is
//! dark. Invariant: every point of a stretch is as it is said, and so is every one within [`KnownStretch::ROOM`] of it.
//!
//! Surfaces need be shown only where they shade points that are not known. Shadows change from dark to lit at the ends of
//! what is shaded, never within a known stretch or at its ends. So a gap between all shadows that were shown is lit as a
//! whole, or dark as a whole; and if it is dark, none of it is outside of a known stretch.

/// Points of a segment that are all dark, or all lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownStretch {
    /// Begin and end, as shares of the segment's length.
    pub shares: [f64; 2],
    /// Whether its points are in shadow.
    pub is_dark: bool,
}

impl KnownStretch {
    /// Points so far beyond a stretch, in shares of the segment's length, are like those in it: more than the rounding of
    /// where a shadow ends.
    pub const ROOM: f64 = 1.0 / (1_u64 << 50) as f64;
}

/// Known stretches of a segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    stretches: Vec<KnownStretch>,
}

impl Known {
    pub(super) fn new(stretches: Vec<KnownStretch>) -> Self {
        Self { stretches }
    }

    #[inline]
    pub(super) fn is_nothing(&self) -> bool {
        self.stretches.is_empty()
    }

    /// Returns whether all points between two shares, as far as they are on the segment, are in one known stretch.
    pub(super) fn covers(&self, [least, most]: [f64; 2]) -> bool {
        let before = |stretch: &KnownStretch| stretch.shares[0] <= least.max(0.0);
        let at = self.stretches.partition_point(before).checked_sub(1);
        at.is_some_and(|at| most.min(1.0) <= self.stretches[at].shares[1])
    }

    /// Returns whether a gap between shadows is dark, given the numbers nearest to its ends.
    pub(super) fn is_dark_gap(&self, [begin, end]: [f64; 2]) -> bool {
        let meets = |stretch: &KnownStretch| stretch.shares[0] <= end && stretch.shares[1] >= begin;
        let dark = |stretch: &&KnownStretch| stretch.is_dark;
        self.stretches.iter().filter(dark).any(meets)
    }
}
