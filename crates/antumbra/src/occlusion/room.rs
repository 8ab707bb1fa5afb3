//! Bytes that knowledge may take, and who has them.
//!
//! In: a most. Out: shares of it, which go back when they are dropped. Invariant: all shares together are never
//! more than the most. Whoever makes something large takes a share before, and leaves it unmade if there is none.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes for the knowledge of all lights of an index.
#[derive(Debug)]
pub(crate) struct Room {
    most: u64,
    taken: AtomicU64,
    /// Parts of what is taken that are held for a moment only.
    held: AtomicU64,
}

impl Room {
    pub(crate) fn new(most: u64) -> Arc<Self> {
        Arc::new(Self {
            most,
            taken: AtomicU64::new(0),
            held: AtomicU64::new(0),
        })
    }

    /// Returns the bytes of all shares.
    pub(crate) fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// Returns the bytes that nobody has.
    pub(crate) fn left(&self) -> u64 {
        self.most - self.taken()
    }

    /// Returns the most that there is.
    pub(crate) fn most(&self) -> u64 {
        self.most
    }

    /// Returns whether somebody holds bytes that will be free in a moment.
    pub(crate) fn is_held(&self) -> bool {
        self.held.load(Ordering::Relaxed) > 0
    }

    /// Takes a share; `None` if so much is not left.
    pub(crate) fn take(self: &Arc<Self>, bytes: u64) -> Option<Share> {
        let share = Share {
            room: Arc::clone(self),
            bytes: AtomicU64::new(0),
        };
        share.grow(bytes).then_some(share)
    }

    /// Holds so many bytes for a moment, or as many as are left.
    pub(crate) fn hold(self: &Arc<Self>, bytes: u64) -> Held {
        loop {
            let wanted = bytes.min(self.left());
            if let Some(share) = self.take(wanted) {
                self.held.fetch_add(wanted, Ordering::Relaxed);
                return Held {
                    bytes: wanted,
                    share: Some(share),
                };
            }
        }
    }

    fn add(&self, bytes: u64) -> bool {
        let add = |taken: u64| taken.checked_add(bytes).filter(|&sum| sum <= self.most);
        self.taken
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, add)
            .is_ok()
    }
}

/// Bytes that somebody has.
#[derive(Debug)]
pub(crate) struct Share {
    room: Arc<Room>,
    bytes: AtomicU64,
}

impl Share {
    /// Takes so many bytes more; `false` if they are not left.
    pub(crate) fn grow(&self, bytes: u64) -> bool {
        let is_there = self.room.add(bytes);
        if is_there {
            self.bytes.fetch_add(bytes, Ordering::Relaxed);
        }
        is_there
    }

    /// Lets so many bytes go, which this caller has taken.
    pub(crate) fn give_back(&self, bytes: u64) {
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
        self.room.taken.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Lets all but so many bytes go.
    pub(crate) fn shrink_to(&self, bytes: u64) {
        let before = self.bytes.fetch_min(bytes, Ordering::Relaxed);
        let spare = before.saturating_sub(bytes);
        self.room.taken.fetch_sub(spare, Ordering::Relaxed);
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Returns the room that it is a part of.
    pub(crate) fn room(&self) -> &Arc<Room> {
        &self.room
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let bytes = self.bytes.load(Ordering::Relaxed);
        self.room.taken.fetch_sub(bytes, Ordering::Relaxed);
    }
}

/// Bytes that are held for a moment, while something is made of which only a part stays.
#[derive(Debug)]
pub(crate) struct Held {
    bytes: u64,
    share: Option<Share>,
}

impl Held {
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Keeps so many of the bytes, at most all, and lets the others go.
    pub(crate) fn keep(mut self, bytes: u64) -> Option<Share> {
        let share = self.share.take()?;
        let spare = self.bytes.checked_sub(bytes)?;
        share.bytes.fetch_sub(spare, Ordering::Relaxed);
        share.room.taken.fetch_sub(spare, Ordering::Relaxed);
        share.room.held.fetch_sub(self.bytes, Ordering::Relaxed);
        Some(share)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(share) = &self.share {
            share.room.held.fetch_sub(self.bytes, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_never_exceed_the_room_and_go_back() {
        let room = Room::new(100);
        let first = room.take(60).expect("room");
        assert!(room.take(41).is_none());
        assert!(first.grow(40) && !first.grow(1));
        assert_eq!(room.taken(), 100);
        drop(first);
        assert_eq!((room.taken(), room.left()), (0, 100));
        assert!(room.take(u64::MAX).is_none());
    }

    #[test]
    fn what_is_held_is_free_again_but_for_what_is_kept() {
        let room = Room::new(100);
        let _other = room.take(30).expect("room");
        let held = room.hold(1_000);
        assert!(held.bytes() == 70 && room.is_held());
        let kept = held.keep(20).expect("less than was held");
        assert!(room.taken() == 50 && !room.is_held());
        drop(kept);
        assert_eq!(room.taken(), 30);
        drop(room.hold(50));
        assert!(room.taken() == 30 && !room.is_held());
        assert!(room.hold(50).keep(51).is_none());
        assert!(room.taken() == 30, "{}", room.taken());
    }
}
