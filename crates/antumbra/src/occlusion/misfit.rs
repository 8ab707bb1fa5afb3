//! Why words of a file are not taken.

/// Why words are no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Misfit {
    /// The store is full.
    NoRoom,
    /// Something is wrong at a word.
    At(usize, &'static str),
}

impl Misfit {
    /// Returns the same where so many words come before.
    pub(super) fn after(self, words: usize) -> Self {
        match self {
            Self::NoRoom => Self::NoRoom,
            Self::At(word, what) => Self::At(words + word, what),
        }
    }
}
