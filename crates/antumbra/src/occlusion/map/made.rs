//! What was built for a cell.

use super::faces::Part;
use super::words::{Arena, NODE_CELLS, Word};

/// The words below a tile or cell, places from its first on, and its own.
pub(super) struct Made<'a> {
    /// Of a tile, what it tells of the surfaces that it lists.
    pub(super) parts: &'a [(u32, Part)],
    pub(super) words: &'a [u32],
    pub(super) own: Word,
    pub(super) free: Word,
}

/// The same, kept.
pub(super) struct Owned {
    pub(super) parts: Box<[(u32, Part)]>,
    pub(super) words: Box<[u32]>,
    pub(super) own: Word,
    pub(super) free: Word,
}

impl Owned {
    pub(super) fn borrow(&self) -> Made<'_> {
        Made {
            parts: &self.parts,
            words: &self.words,
            own: self.own,
            free: self.free,
        }
    }
}

impl Made<'_> {
    pub(super) fn to_owned(&self) -> Owned {
        Owned {
            parts: self.parts.into(),
            words: self.words.into(),
            own: self.own,
            free: self.free,
        }
    }

    /// Writes the words where they stand.
    pub(super) fn write(&self, arena: &Arena, place: usize) {
        let mut words = self.words.to_vec();
        let mut due = vec![self.own];
        while let Some(word) = due.pop() {
            if !word.is_node() {
                continue;
            }
            for number in 0..NODE_CELLS {
                let word = &mut words[word.place() + number];
                due.push(Word(*word));
                *word = Word(*word).moved(place).0;
            }
            for free in &mut words[word.place() + NODE_CELLS..][..NODE_CELLS] {
                *free = Word(*free).moved(place).0;
            }
        }
        arena.write(place, words.into_iter());
    }
}
