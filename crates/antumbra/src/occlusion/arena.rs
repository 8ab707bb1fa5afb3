//! Memory for bricks and lists that grows while it is read.
//!
//! Words of 32 bits, zero at first, handed out in order and never taken back: a whole
//! [`Store`](super::bricks::Store) is dropped at once. They lie in segments, which are taken from the room for all
//! knowledge one by one; what is taken together lies in one segment.

use std::sync::atomic::AtomicUsize;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::links::{Link, publish};
use super::room::{Room, Share};
use super::sync::{AtomicU32, Ordering};

/// Words of 32 bits.
#[derive(Debug)]
pub(crate) struct Arena {
    segments: Box<[OnceLock<Box<[AtomicU32]>>]>,
    next: AtomicUsize,
    /// Words that were handed out.
    taken: AtomicUsize,
    /// Words of the first segment.
    first: usize,
    growth: Mutex<Growth>,
}

/// What whoever makes a segment looks at.
#[derive(Debug)]
struct Growth {
    share: Share,
    /// Words that may be made yet.
    left: usize,
}

/// Words of a segment at most, as a power of two: 256 KiB. More segments are more to look through; larger ones leave
/// more unused, so that the first ones behind the first are smaller.
const SEGMENT_BITS: u32 = 16;
const SEGMENT: usize = 1 << SEGMENT_BITS;
const SMALL: usize = SEGMENT / 16;

/// Places are below 2 to this power.
const PLACE_BITS: u32 = Link::LARGEST_PLACE.count_ones();

/// Segments but the first have at least so many words.
const SMALLEST: usize = 1024;

/// Returns how many segments hold so many words; some are shorter than others.
fn segment_count(words: usize) -> usize {
    (words.div_ceil(SEGMENT) + 8).min(1 << (PLACE_BITS - SEGMENT_BITS))
}

/// The first words are no cell's: a place of 0 is none.
const FIRST: usize = 16;

impl Arena {
    /// Makes room for so many bytes, at most 4 GiB and what the room has left, and at once for so many words; `None` if
    /// that does not hold the table of segments.
    pub(crate) fn new(room: &Arc<Room>, bytes: u64, first: usize) -> Option<Self> {
        let most = (bytes.min(room.most()) / 4).min(u64::from(Link::LARGEST_PLACE)) as usize;
        let count = segment_count(most);
        let table_bytes = count * size_of::<OnceLock<Box<[AtomicU32]>>>();
        let growth = Growth {
            share: room.take(table_bytes as u64)?,
            left: most,
        };
        Some(Self {
            segments: (0..count).map(|_| OnceLock::new()).collect(),
            next: AtomicUsize::new(FIRST),
            taken: AtomicUsize::new(0),
            first: (FIRST + first).next_multiple_of(4).min(SEGMENT),
            growth: Mutex::new(growth),
        })
    }

    /// Returns the bytes of an arena of which so many words were taken, of at most so many bytes.
    pub(crate) fn bytes_for(words: usize, most_bytes: u64) -> u64 {
        let table =
            segment_count((most_bytes / 4) as usize) * size_of::<OnceLock<Box<[AtomicU32]>>>();
        (table + 4 * (FIRST + words)) as u64
    }

    /// Takes so many words, the first at a multiple of four; `None` if there are no more.
    pub(crate) fn take(&self, count: usize) -> Option<u32> {
        if count > SEGMENT {
            return None;
        }
        let aligned = count.next_multiple_of(4);
        let mut next = self.next.load(Ordering::Relaxed);
        loop {
            let mut first = next;
            loop {
                let (number, within) = (first >> SEGMENT_BITS, first & (SEGMENT - 1));
                let segment = self.segment(number, within + aligned)?;
                if within + aligned <= segment.len() {
                    break;
                }
                first = (number + 1) << SEGMENT_BITS;
            }
            let end = first + aligned;
            match self
                .next
                .compare_exchange_weak(next, end, Ordering::Relaxed, Ordering::Relaxed)
            {
                // The place is below 2^30.
                Ok(_) => {
                    self.taken.fetch_add(aligned, Ordering::Relaxed);
                    return Some(first as u32);
                }
                Err(other) => next = other,
            }
        }
    }

    /// Returns a segment; makes it, of at least so many words, where there is room.
    fn segment(&self, number: usize, fewest: usize) -> Option<&[AtomicU32]> {
        let segment = self.segments.get(number)?;
        if let Some(words) = segment.get() {
            return Some(words);
        }
        let mut growth = self.growth.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(words) = segment.get() {
            return Some(words);
        }
        let in_room = (growth.share.room().left() / 4) as usize;
        let (wanted, fewest) = match number {
            0 => (self.first, fewest),
            _ => (SMALL << number.min(4), fewest.max(SMALLEST)),
        };
        let count = wanted.max(fewest).min(growth.left).min(in_room) & !3;
        if count < fewest || !growth.share.grow(4 * count as u64) {
            return None;
        }
        growth.left -= count;
        Some(segment.get_or_init(|| bytemuck::zeroed_slice_box(count)))
    }

    /// Writes words that this thread has taken and no link leads to yet.
    pub(crate) fn write(&self, place: u32, words: impl IntoIterator<Item = u32>) {
        for (slot, word) in self.words_from(place as usize).iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
    }

    /// Says what is known at a link, and everything that was written before.
    pub(crate) fn publish(&self, place: u32, known: Link) {
        publish(self.word(place as usize), known);
    }

    /// Returns the words from a place on that lie in its segment.
    #[inline(always)]
    pub(crate) fn words_from(&self, place: usize) -> &[AtomicU32] {
        match self.segments[place >> SEGMENT_BITS].get() {
            Some(words) => &words[place & (SEGMENT - 1)..],
            None => &[],
        }
    }

    #[inline(always)]
    pub(crate) fn word(&self, place: usize) -> &AtomicU32 {
        &self.words_from(place)[0]
    }

    /// Returns the bytes handed out.
    pub(crate) fn bytes(&self) -> u64 {
        4 * self.taken.load(Ordering::Relaxed) as u64
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
        // Segments of one length, and a shorter one at the end.
        for spare in [BYTES, 3_000] {
            let room = Room::new(BYTES + spare);
            let arena = Arena::new(&room, BYTES, 500).expect("room for a table");
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
            let mut expected = vec![0; SEGMENT * arena.segments.len()];
            for (place, words) in done.iter().flat_map(|(_, taken)| taken) {
                assert!(place.is_multiple_of(4) && *place >= FIRST, "{place}");
                for (at, &word) in words.iter().enumerate() {
                    let before = std::mem::replace(&mut expected[place + at], word);
                    assert_eq!(before, 0, "word {} is taken twice", place + at);
                }
            }
            let mut found = vec![0; expected.len()];
            let (mut word_count, mut segment_count) = (0, 0);
            for (segment, found) in arena.segments.iter().zip(found.chunks_mut(SEGMENT)) {
                let words = segment.get().map_or(&[][..], |words| words);
                for (word, found) in words.iter().zip(found) {
                    *found = word.load(Ordering::Relaxed);
                }
                word_count += words.len();
                segment_count += usize::from(!words.is_empty());
            }
            assert!(found == expected && segment_count > 5);
            // Nearly all that there is was handed out: what a thread was refused did not fit.
            let handed_out = arena.bytes() as usize / 4;
            assert!(handed_out + FIRST <= word_count);
            assert!(handed_out + 92 * segment_count > word_count, "{handed_out}");
            assert!(
                word_count + 2 * SMALLEST > BYTES as usize / 4,
                "{word_count}"
            );
            assert!(room.taken() >= 4 * word_count as u64 && room.taken() <= BYTES + spare);
            drop(arena);
            assert_eq!(room.taken(), 0);
        }
    }

    #[test]
    fn what_is_refused_leaves_room_for_less() {
        let room = Room::new(1 << 20);
        let arena = Arena::new(&room, 4 * (FIRST as u64 + 8), 8).expect("room for a table");
        assert_eq!(arena.take(9), None);
        assert_eq!(arena.take(usize::MAX - 3), None);
        let places = [(); 3].map(|()| arena.take(4));
        assert_eq!(places, [Some(FIRST as u32), Some(FIRST as u32 + 4), None]);
        assert_eq!(arena.bytes(), 32);
        // No room at all.
        assert_eq!(Arena::new(&room, 0, 8).expect("a table").take(1), None);
        assert!(Arena::new(&Room::new(0), 1 << 20, 8).is_none());
    }

    #[test]
    fn an_arena_takes_no_more_than_its_room_has_left() {
        let room = Room::new(100_000);
        let other = room.take(60_000).expect("room");
        let arena = Arena::new(&room, 1 << 30, 64).expect("room for a table");
        let mut count = 0;
        while arena.take(64).is_some() {
            count += 1;
        }
        assert!(room.taken() <= 100_000 && count > 100, "{count}");
        // What becomes free later is used.
        drop(other);
        assert!(arena.take(64).is_some() && room.taken() <= 100_000);
    }
}
