//! The words that a map is made of, and the memory that holds them while it grows.
//!
//! A word of 32 bits says what a cell knows: a threshold (an `f32`, not negative), or with its highest bit where to go
//! on: to a node of sixteen cells, to a wide node of 256, to a list, or to a slanted threshold. All lie in one arena that is zero at first and of which only what was
//! written takes memory. Whoever makes a tile or a cell writes what is below it, then publishes its word; nobody reads
//! what is not published. A word of which nothing was known, or a list, is written over, others are not.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

/// What a cell knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Word(pub(in super::super) u32);

pub(super) const NODE: u32 = 0b100 << 29;
pub(super) const WIDE: u32 = 0b101 << 29;
const LIST: u32 = 0b110 << 29;
const SLANT: u32 = 0b111 << 29;
pub(super) const PLACE: u32 = (1 << 29) - 1;

impl Word {
    /// Nobody has asked about the cell.
    pub(in super::super) const UNASKED: Self = Self(u32::MAX);
    /// More surfaces may block its starts than a list holds, and nobody asks often enough to cut it.
    pub(in super::super) const HOPELESS: Self = Self(u32::MAX - 1);
    /// Words of lists are this and larger, those of slanted thresholds this second and larger.
    pub(in super::super) const LIST: u32 = LIST;
    pub(in super::super) const SLANT: u32 = SLANT;

    /// Of free starts nothing is known, and nothing will be.
    pub(in super::super) const NEVER: Self = Self(0);

    /// No start that the cell speaks of is in shadow.
    pub(in super::super) const LIT: Self = Self(f32::INFINITY.to_bits());

    /// Starts deeper than this are in shadow, others are not. As what a cell says of free starts: those before it are lit.
    pub(in super::super) fn threshold(depth: f32) -> Self {
        Self((depth + BIAS).max(0.0).to_bits())
    }

    pub(in super::super) const fn node(place: usize) -> Self {
        Self(NODE | place as u32)
    }

    pub(in super::super) const fn wide(place: usize) -> Self {
        Self(WIDE | place as u32)
    }

    pub(in super::super) const fn list(place: usize) -> Self {
        Self(LIST | place as u32)
    }

    pub(in super::super) const fn slant(place: usize) -> Self {
        Self(SLANT | place as u32)
    }

    /// Returns where a word leads that is one of a tile's own, if it leads on, once that is moved from one place to
    /// another.
    pub(in super::super) fn moved(self, from: usize, to: usize) -> Self {
        if self.0 >> 31 == 0 || self.0 >= Self::HOPELESS.0 {
            self
        } else {
            Self(self.0 - from as u32 + to as u32)
        }
    }

    /// Returns where its nodes are, of a word that leads to one or to a wide one.
    pub(in super::super) fn nodes(self) -> impl Iterator<Item = usize> {
        let count = match self.is_wide() {
            true => NODE_CELLS,
            false => usize::from(self.is_node()),
        };
        (0..count).map(move |number| self.place() + number * NODE_WORDS)
    }

    /// Of either width.
    #[inline(always)]
    pub(in super::super) fn is_node(self) -> bool {
        self.0 >> 30 == NODE >> 30
    }

    #[inline(always)]
    pub(in super::super) fn is_wide(self) -> bool {
        self.0 >> 29 == WIDE >> 29
    }

    #[inline(always)]
    pub(in super::super) fn is_list(self) -> bool {
        self.0 >> 29 == LIST >> 29
    }

    #[inline(always)]
    pub(in super::super) fn is_slant(self) -> bool {
        self.0 >> 29 == SLANT >> 29 && self.0 < Self::HOPELESS.0
    }

    #[inline(always)]
    pub(in super::super) fn is_threshold(self) -> bool {
        self.0 >> 31 == 0
    }

    #[inline(always)]
    pub(in super::super) fn place(self) -> usize {
        (self.0 & PLACE) as usize
    }
}

/// Added to depths, so that thresholds are positive: depths are above -3.
pub(in super::super) const BIAS: f32 = 4.0;

/// Words of a node: what its cells know, and what those with thresholds say of free starts that are not past them: a depth
/// before which they are lit, or a list.
pub(in super::super) const NODE_WORDS: usize = 32;
pub(in super::super) const NODE_CELLS: usize = 16;

/// A wide node is the sixteen nodes below one in a row, so that one step leads two levels down. Where a cell of the
/// upper level has no node, all cells of its node say what it says.
pub(in super::super) const WIDE_WORDS: usize = NODE_CELLS * NODE_WORDS;

/// A list begins with the depth behind which all is in shadow, and a word of how many entries it has for starts on
/// listed surfaces (8 bits) and for others (8 bits), and how many more of them may be tested before it pays to cut its
/// cell (16 bits). An entry is a depth before which it blocks nothing ([`rough_depth`], 16 bits) and the number of a
/// surface among those of the tile.
pub(in super::super) const HEAD: usize = 2;
/// Where in a list its counts are.
pub(in super::super) const COUNTS: usize = 1;
/// In place of tests that are left, of a list that is never cut.
pub(in super::super) const NOT_CUT: u32 = 0xffff;

/// Returns the word of a list's counts: of entries for listed starts and for all, and of tests that are left.
pub(in super::super) fn counts(asked: usize, all: usize, left: u32) -> u32 {
    left << 16 | (all as u32) << 8 | asked as u32
}

/// Returns how many entries a list has for starts on listed surfaces, and for all.
#[inline(always)]
pub(in super::super) fn entry_counts(counts: u32) -> [usize; 2] {
    [counts & 0xff, counts >> 8 & 0xff].map(|count| count as usize)
}

/// Returns a depth in 16 bits. What is not deeper than another thing is not so by these, either: sum, product and
/// whole part all keep the order.
#[inline(always)]
pub(in super::super) fn rough_depth(depth: f32) -> u32 {
    const IN_A_UNIT: f32 = 8_192.0;
    (((depth + BIAS) * IN_A_UNIT) as u32).min(0xffff)
}

/// Returns the entry of a surface by its number among those of the tile, which blocks nothing before a depth.
pub(in super::super) fn entry(nearest: f32, number: u16) -> u32 {
    rough_depth(nearest) << 16 | u32::from(number)
}

/// A slanted threshold is a slope along both axes of the tile and the key that starts are past at its middle, and the
/// depth behind which all is in shadow whatever the key.
pub(in super::super) const SLANT_WORDS: usize = 4;

/// Tiles and slanted thresholds begin at multiples of this.
pub(in super::super) const ALIGNED: usize = 4;
/// No place is nought. What is before the first is there to be read and says nothing.
const FIRST: usize = NODE_WORDS;

#[derive(Debug)]
pub(in super::super) struct Arena {
    words: Box<[AtomicU32]>,
    next: AtomicUsize,
    /// Whether all words count as held, not those only that were taken.
    is_trimmed: bool,
}

impl Arena {
    /// Makes room for so many words; none of them takes memory before it is written.
    pub(in super::super) fn new(words: usize) -> Self {
        let words = words.clamp(2 * FIRST, PLACE as usize);
        Self {
            words: bytemuck::allocation::zeroed_slice_box(words),
            next: AtomicUsize::new(FIRST),
            is_trimmed: false,
        }
    }

    /// Gives room back but for an eighth more words than were taken, and holds that.
    pub(in super::super) fn trimmed(self) -> Self {
        let taken = self.taken();
        let mut words = self.words.into_vec();
        words.truncate(taken + taken / 8);
        words.shrink_to_fit();
        Self {
            words: words.into(),
            is_trimmed: true,
            ..self
        }
    }

    pub(in super::super) fn is_trimmed(&self) -> bool {
        self.is_trimmed
    }

    /// Returns the words that it holds.
    pub(in super::super) fn held(&self) -> usize {
        match self.is_trimmed {
            true => self.words.len(),
            false => self.taken(),
        }
    }

    /// Returns the bytes that so many words take.
    pub(in super::super) fn bytes_of(words: usize) -> u64 {
        4 * words.next_multiple_of(ALIGNED) as u64
    }

    /// Takes so many words; `None` if there is no room.
    pub(in super::super) fn take(&self, words: usize) -> Option<usize> {
        let words = words.next_multiple_of(ALIGNED);
        let end = |next: usize| {
            next.checked_add(words)
                .filter(|&end| end <= self.words.len())
        };
        self.next
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, end)
            .ok()
    }

    /// Returns the words that were taken.
    pub(in super::super) fn taken(&self) -> usize {
        self.next.load(Ordering::Relaxed)
    }

    pub(in super::super) fn write(&self, first: usize, words: impl Iterator<Item = u32>) {
        for (place, word) in self.words[first..].iter().zip(words) {
            place.store(word, Ordering::Relaxed);
        }
    }

    #[inline(always)]
    pub(in super::super) fn read(&self, place: usize) -> u32 {
        self.words[place].load(Ordering::Acquire)
    }

    /// Takes so many tests from those that a list's counts leave; threads may take at once, and some of it be lost.
    /// Returns whether any are left.
    #[inline(always)]
    pub(in super::super) fn spend(&self, place: usize, tests: u32) -> bool {
        let counts = self.words[place].load(Ordering::Relaxed);
        let left = counts >> 16;
        if left == NOT_CUT || tests == 0 {
            return left > 0;
        }
        let left = left.saturating_sub(tests);
        self.words[place].store(left << 16 | counts & 0xffff, Ordering::Relaxed);
        left > 0
    }

    pub(in super::super) fn publish(&self, place: usize, word: Word, free: Word) {
        self.words[place + NODE_CELLS].store(free.0, Ordering::Relaxed);
        self.words[place].store(word.0, Ordering::Release);
    }

    #[inline(always)]
    pub(in super::super) fn slice(&self, first: usize, count: usize) -> &[AtomicU32] {
        &self.words[first..first + count]
    }
}
