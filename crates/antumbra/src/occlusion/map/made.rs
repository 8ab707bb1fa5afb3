//! What was built for a cell.

use super::faces::Part;
use super::words::{Arena, NODE_WORDS, Word};

/// The words below a tile or cell, and its own.
pub(super) struct Made<'a> {
    /// Of a tile, what it tells of the surfaces that it lists.
    pub(super) parts: &'a [(u32, Part)],
    pub(super) words: &'a [u32],
    /// The place of the first of them.
    pub(super) first: usize,
    pub(super) own: Word,
    pub(super) free: Word,
}

/// The same, kept.
pub(super) struct Owned {
    parts: Box<[(u32, Part)]>,
    words: Box<[u32]>,
    first: usize,
    own: Word,
    free: Word,
}

impl Owned {
    pub(super) fn borrow(&self) -> Made<'_> {
        Made {
            parts: &self.parts,
            words: &self.words,
            first: self.first,
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
            first: self.first,
            own: self.own,
            free: self.free,
        }
    }

    /// Writes the words where they stand from there on, and returns the cell's own, and what it says of free starts.
    pub(super) fn write(&self, arena: &Arena, place: usize) -> [Word; 2] {
        let mut words = self.words.to_vec();
        let mut due = vec![self.own];
        while let Some(word) = due.pop() {
            for node in word.nodes() {
                for word in &mut words[node - self.first..][..NODE_WORDS] {
                    let cell = Word(*word);
                    due.extend(cell.is_node().then_some(cell));
                    *word = cell.moved(self.first, place).0;
                }
            }
        }
        arena.write(place, words.into_iter());
        [self.own, self.free].map(|word| word.moved(self.first, place))
    }
}
