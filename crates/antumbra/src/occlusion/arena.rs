//! Memory for bricks and lists that grows while it is read.
//!
//! Words of 32 bits, zero at first, handed out in order and never taken back: a whole
//! [`Store`](super::bricks::Store) is dropped at once. The system gives memory where words are written.

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

#[cfg(test)]
mod tests {
    use std::thread;

    use super::super::testing::Random;
    use super::*;

    #[test]
    fn threads_take_words_of_their_own() {
        const BYTES: u64 = 1 << 20;
        let arena = Arena::new(BYTES);
        let work = |thread: u64| {
            let random = &mut Random(thread);
            let mut taken = Vec::new();
            loop {
                let count = 1 + random.below(90);
                let Some(place) = arena.take(count) else {
                    return (count, taken);
                };
                let words = (0..count).map(|_| (random.bits() | 1) as u32);
                let words: Vec<u32> = words.collect();
                arena.write(place, words.iter().copied());
                taken.push((place as usize, words));
            }
        };
        let done = thread::scope(|scope| {
            let threads = [1, 2, 3, 4].map(|thread| scope.spawn(move || work(thread)));
            threads.map(|thread| thread.join().unwrap())
        });
        let mut expected = vec![0; arena.words().len()];
        let mut sum = 0;
        for (place, words) in done.iter().flat_map(|(_, taken)| taken) {
            assert!(place.is_multiple_of(4) && *place >= FIRST, "{place}");
            for (at, &word) in words.iter().enumerate() {
                let before = std::mem::replace(&mut expected[place + at], word);
                assert_eq!(before, 0, "word {} is taken twice", place + at);
            }
            sum += 4 * words.len().next_multiple_of(4) as u64;
        }
        let found: Vec<u32> = arena
            .words()
            .iter()
            .map(|word| word.load(Ordering::Relaxed))
            .collect();
        assert!(found == expected);
        assert_eq!(arena.bytes(), sum);
        // All that there is was handed out.
        let left = BYTES - 4 * FIRST as u64 - sum;
        for (refused, _) in &done {
            assert!(4 * refused.next_multiple_of(4) as u64 > left, "{refused}");
        }
    }

    #[test]
    fn what_is_refused_leaves_room_for_less() {
        let arena = Arena::new(4 * (FIRST as u64 + 8));
        assert_eq!(arena.take(9), None);
        assert_eq!(arena.take(usize::MAX - 3), None);
        let places = [(); 3].map(|()| arena.take(4));
        assert_eq!(places, [Some(FIRST as u32), Some(FIRST as u32 + 4), None]);
        assert_eq!(arena.bytes(), 32);
        // No room at all.
        assert_eq!(Arena::new(0).take(1), None);
    }
}
