//! The rows themselves, and what finds them.
//!
//! In: keys and their rows. Out: a table that is only read: whoever makes more makes a new one.

use antumbra_geometry::SurfaceId;

use super::super::room::Share;

/// Words for each 64 lights: which are surely lit, which surely in shadow, which in front of the triangle, which behind.
pub(super) const PARTS: usize = 4;

/// Starts that are looked up together.
pub(crate) const ROW_BLOCK: usize = 32;

/// A cell, and a triangle that meets it or the space in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Key(u64);

/// In place of a triangle.
const SPACE: u32 = u32::MAX;

impl Key {
    /// In place of a key.
    const NONE: Self = Self(u64::MAX);

    #[inline(always)]
    pub(super) fn new(cell: u64, surface: Option<SurfaceId>) -> Self {
        Self(cell << 32 | u64::from(surface.map_or(SPACE, |surface| surface.0)))
    }

    /// Returns the triangle; `None` for space.
    pub(super) fn surface(self) -> Option<SurfaceId> {
        let surface = self.0 as u32;
        (surface != SPACE).then_some(SurfaceId(surface))
    }

    /// Returns the number of the cell among those of its level.
    pub(super) fn cell_number(self) -> u64 {
        self.0 >> 32
    }

    /// Multiplicative hashing (Knuth): the top bits depend on all.
    #[inline(always)]
    fn slot(self, shift: u32) -> usize {
        let mixed = (self.0 ^ self.0 >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> shift) as usize
    }
}

/// Rows, each found by its key.
#[derive(Debug)]
pub(crate) struct RowTable {
    /// A power of two of places, at most half of them taken; a key lies at its place or behind.
    keys: Vec<Key>,
    numbers: Vec<u32>,
    rows: Vec<u64>,
    /// For each 64 lights.
    word_count: usize,
    shift: u32,
    _share: Share,
}

/// What is known of the lights for the starts of one key.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<'a> {
    words: &'a [u64],
    word_count: usize,
}

impl Row<'_> {
    /// Returns which of 64 lights reach every start.
    #[inline(always)]
    pub(crate) fn lit(&self, word: usize) -> u64 {
        self.words[word]
    }

    /// Returns which of 64 lights reach no start.
    #[inline(always)]
    pub(crate) fn dark(&self, word: usize) -> u64 {
        self.words[self.word_count + word]
    }

    /// Returns which of 64 lights are strictly in front of the triangle; all for points of space.
    #[inline(always)]
    pub(crate) fn front(&self, word: usize) -> u64 {
        self.words[2 * self.word_count + word]
    }

    /// Returns which of 64 lights are strictly behind the triangle; all for points of space.
    #[inline(always)]
    pub(crate) fn back(&self, word: usize) -> u64 {
        self.words[3 * self.word_count + word]
    }
}

impl RowTable {
    /// Returns the bytes that a table of so many rows takes.
    pub(super) fn bytes_for(row_count: usize, word_count: usize) -> u64 {
        let slots = slot_count(row_count);
        let bytes = slots * (size_of::<Key>() + size_of::<u32>())
            + row_count * PARTS * word_count * size_of::<u64>();
        bytes as u64
    }

    /// Makes a table of the rows of another, if there is one, and of others, whose keys it does not have.
    pub(super) fn new(
        before: Option<&Self>,
        more: &[Key],
        words: &[u64],
        word_count: usize,
        share: Share,
    ) -> Self {
        let old = before.map_or(0, Self::row_count);
        let slots = slot_count(old + more.len());
        let mut table = Self {
            keys: vec![Key::NONE; slots],
            numbers: vec![0; slots],
            rows: Vec::with_capacity((old + more.len()) * PARTS * word_count),
            word_count,
            shift: u64::BITS - slots.ilog2(),
            _share: share,
        };
        if let Some(before) = before {
            table.rows.extend_from_slice(&before.rows);
            let places = before.keys.iter().zip(&before.numbers);
            for (&key, &number) in places.filter(|&(&key, _)| key != Key::NONE) {
                table.put(key, number);
            }
        }
        table.rows.extend_from_slice(words);
        for (number, &key) in more.iter().enumerate() {
            table.put(key, (old + number) as u32);
        }
        table
    }

    fn put(&mut self, key: Key, number: u32) {
        let mask = self.keys.len() - 1;
        let mut slot = key.slot(self.shift);
        while self.keys[slot] != Key::NONE {
            slot = (slot + 1) & mask;
        }
        self.keys[slot] = key;
        self.numbers[slot] = number;
    }

    /// Returns the number of a key's row.
    #[inline(always)]
    pub(super) fn number_of(&self, key: Key) -> Option<u32> {
        let mask = self.keys.len() - 1;
        let mut slot = key.slot(self.shift) & mask;
        loop {
            let found = self.keys[slot];
            if found == key {
                return Some(self.numbers[slot]);
            }
            if found == Key::NONE {
                return None;
            }
            slot = (slot + 1) & mask;
        }
    }

    /// Returns a row by its number.
    #[inline(always)]
    pub(crate) fn row(&self, number: u32) -> Row<'_> {
        let length = PARTS * self.word_count;
        Row {
            words: &self.rows[number as usize * length..][..length],
            word_count: self.word_count,
        }
    }

    /// Returns how many rows there are.
    pub(crate) fn row_count(&self) -> usize {
        self.rows.len() / (PARTS * self.word_count)
    }

    /// Returns the bytes of all of it.
    pub(crate) fn bytes(&self) -> u64 {
        Self::bytes_for(self.row_count(), self.word_count)
    }
}

/// Returns how many places there are for so many keys: at least twice as many, and two.
fn slot_count(row_count: usize) -> usize {
    (2 * row_count).next_power_of_two().max(2)
}

/// Where a start looks for what is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// The row of a number.
    Row(u32),
    /// There could be a row.
    Missing(Key),
    /// No row speaks of such a start.
    Nowhere,
}
