//! Memory for bricks and lists that grows while it is read.
//!
//! Words of 32 bits, zero at first, handed out in order and never taken back: a whole [`Store`] is dropped at
//! once. The system gives memory where words are written.

use std::sync::atomic::AtomicUsize;

use super::links::{Link, publish};
use super::sync::{AtomicU32, Ordering};

/// Words of 32 bits.
#[derive(Debug)]
pub(crate) struct Arena {
    words: Box<[AtomicU32]>,
    next: AtomicUsize,
}

/// The first words are no cell's: a place of 0 is none.
const FIRST: usize = 16;

impl Arena {
    /// Makes room for so many bytes, at most 4 GiB.
    pub(crate) fn new(bytes: u64) -> Self {
        let most = u64::from(Link::LARGEST_PLACE);
        let count = (bytes / 4).clamp(FIRST as u64, most) as usize;
        Self {
            words: bytemuck::zeroed_slice_box(count),
            next: AtomicUsize::new(FIRST),
        }
    }

    /// Takes so many words, the first at a multiple of four; `None` if there are no more.
    pub(crate) fn take(&self, count: usize) -> Option<u32> {
        let aligned = count.next_multiple_of(4);
        let mut next = self.next.load(Ordering::Relaxed);
        loop {
            let end = next.checked_add(aligned)?;
            if end > self.words.len() {
                return None;
            }
            match self
                .next
                .compare_exchange_weak(next, end, Ordering::Relaxed, Ordering::Relaxed)
            {
                // The place is below 2^30.
                Ok(_) => return Some(next as u32),
                Err(other) => next = other,
            }
        }
    }

    /// Writes words that this thread has taken and no link leads to yet.
    pub(crate) fn write(&self, place: u32, words: impl IntoIterator<Item = u32>) {
        for (slot, word) in self.words[place as usize..].iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
    }

    /// Says what is known at a link, and everything that was written before.
    pub(crate) fn publish(&self, place: u32, known: Link) {
        publish(&self.words[place as usize], known);
    }

    #[inline(always)]
    pub(crate) fn words(&self) -> &[AtomicU32] {
        &self.words
    }

    /// Returns the bytes taken.
    pub(crate) fn bytes(&self) -> u64 {
        4 * (self.next.load(Ordering::Relaxed) - FIRST) as u64
    }
}
