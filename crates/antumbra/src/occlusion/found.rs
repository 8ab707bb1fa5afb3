//! What is known of one start, or of a block of them.

use crate::Decided;

/// Starts that are looked up together.
pub(crate) const BLOCK: usize = 32;

/// What is known of a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Found(pub(super) u8);

impl Found {
    /// Nothing; perhaps the start is no start at all.
    pub(crate) const NOTHING: Self = Self(0b100);
    pub(super) const SHADOWED: u8 = 0b01;
    const BY_LIST: u8 = 0b10;

    #[inline(always)]
    pub(crate) fn by_value(is_shadowed: bool) -> Self {
        Self(u8::from(is_shadowed))
    }

    #[inline(always)]
    pub(super) fn by_list(is_shadowed: bool) -> Self {
        Self(u8::from(is_shadowed) | Self::BY_LIST)
    }

    /// Returns whether the start is in shadow, if something is known.
    #[inline(always)]
    pub(crate) fn is_shadowed(self) -> bool {
        self.0 & Self::SHADOWED != 0
    }

    /// Returns whether nothing is known.
    #[inline(always)]
    pub(crate) fn is_nothing(self) -> bool {
        self == Self::NOTHING
    }

    /// Returns by what an answer was decided that is known.
    #[inline(always)]
    pub(crate) fn decided(self) -> Decided {
        if self.is_by_list() {
            Decided::BlockerList
        } else {
            Decided::FirstPass
        }
    }

    /// Counts a kind, without branches.
    #[inline(always)]
    pub(crate) fn count(all: &[Self; BLOCK], is_one: impl Fn(Self) -> bool) -> u64 {
        let count: u8 = all.iter().map(|&found| u8::from(is_one(found))).sum();
        count.into()
    }

    /// Returns whether a list said so.
    #[inline(always)]
    pub(crate) fn is_by_list(self) -> bool {
        self.0 & Self::BY_LIST != 0
    }
}

/// What is known of a block of starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Looked {
    pub(crate) found: [Found; BLOCK],
    /// Where the links of their cells stand; 0 where that does not matter.
    pub(crate) places: [u32; BLOCK],
}

impl Looked {
    pub(super) const NOTHING: Self = Self {
        found: [Found::NOTHING; BLOCK],
        places: [0; BLOCK],
    };
}
