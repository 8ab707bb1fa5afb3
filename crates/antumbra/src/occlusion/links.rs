//! How threads hand on what they found, without locks.
//!
//! A *link* is one word that says what is known at a cell: nothing yet, and what its starts have cost since; a
//! brick; a list; or an answer. A list has such a word of its own, that is pending while finer cells may
//! take its place. What a link points to is written before the link is published and never
//! changed after, so who reads a link may read all behind it. One thread at a time works on a link.
//! Absent here: what bricks and lists look like.

use super::sync::{AtomicU32, Ordering};

/// What a link says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link(pub(crate) u32);

const TAG: u32 = 3 << 30;
const PENDING: u32 = 0;
const BRICK: u32 = 1 << 30;
const LIST: u32 = 2 << 30;
const ANSWER: u32 = 3 << 30;

/// In pending links: a thread works on it.
const BUSY: u32 = 1 << 29;
const PRICE_SHIFT: u32 = 24;
const LARGEST_PRICE: u32 = 31;
const COST: u32 = (1 << PRICE_SHIFT) - 1;

impl Link {
    /// All starts are lit.
    pub(crate) const LIT: Self = Self(ANSWER);
    /// All starts are in shadow.
    pub(crate) const SHADOWED: Self = Self(ANSWER | 1);
    /// Ask a ray, and refine no further.
    pub(crate) const RAY: Self = Self(ANSWER | 2);
    /// There is no cell.
    pub(crate) const OUTSIDE: Self = Self(ANSWER | 3);

    /// Where a brick or a list may be.
    pub(crate) const LARGEST_PLACE: u32 = !TAG;

    pub(crate) fn known(is_shadowed: bool) -> Self {
        if is_shadowed {
            Self::SHADOWED
        } else {
            Self::LIT
        }
    }

    /// A cell that nothing is known of, for a price of `2^price` units of cost.
    pub(crate) fn pending(price: u32) -> Self {
        Self(PENDING | price.min(LARGEST_PRICE) << PRICE_SHIFT)
    }

    pub(crate) fn to_brick(place: u32) -> Self {
        Self(BRICK | place)
    }

    pub(crate) fn to_list(place: u32) -> Self {
        Self(LIST | place)
    }

    /// Returns the one answer of all starts.
    #[inline(always)]
    pub(crate) fn answer(self) -> Option<bool> {
        (self.0 & !1 == ANSWER).then_some(self.0 & 1 != 0)
    }

    /// Returns where the brick is.
    #[inline(always)]
    pub(crate) fn brick(self) -> Option<usize> {
        (self.0 & TAG == BRICK).then_some((self.0 & !TAG) as usize)
    }

    /// Returns where the list is.
    #[inline(always)]
    pub(crate) fn list(self) -> Option<usize> {
        (self.0 & TAG == LIST).then_some((self.0 & !TAG) as usize)
    }

    /// Returns whether nothing is known yet.
    #[inline(always)]
    pub(crate) fn is_pending(self) -> bool {
        self.0 & TAG == PENDING
    }

    /// Returns what the link says when no thread works on it.
    pub(crate) fn at_rest(self) -> Self {
        if self.is_pending() {
            Self(self.0 & !BUSY)
        } else {
            self
        }
    }

    fn is_free(self) -> bool {
        self.is_pending() && self.0 & BUSY == 0
    }

    /// Returns the price of knowing more, as a power of two.
    pub(crate) fn price(self) -> u32 {
        self.0 >> PRICE_SHIFT & LARGEST_PRICE
    }

    fn has_paid(self) -> bool {
        u64::from(self.0 & COST) >> self.price().min(PRICE_SHIFT - 1) != 0
    }
}

/// Reads what a link says; what it points to may be read then.
#[inline(always)]
pub(crate) fn read(link: &AtomicU32) -> Link {
    Link(link.load(Ordering::Acquire))
}

/// Adds a cost to a pending link; `true` if the price is paid.
pub(crate) fn charge(link: &AtomicU32, cost: u32) -> bool {
    let mut seen = Link(link.load(Ordering::Relaxed));
    loop {
        if !seen.is_free() {
            return false;
        }
        let sum = (seen.0 & COST).saturating_add(cost).min(COST);
        let charged = Link(seen.0 & !COST | sum);
        match link.compare_exchange_weak(seen.0, charged.0, Ordering::Relaxed, Ordering::Relaxed) {
            Ok(_) => return charged.has_paid(),
            Err(other) => seen = Link(other),
        }
    }
}

/// Takes a pending link for this thread to work on; returns what it said. What the thread before has
/// published may be read then.
pub(crate) fn claim(link: &AtomicU32) -> Option<Link> {
    let mut seen = Link(link.load(Ordering::Relaxed));
    loop {
        if !seen.is_free() {
            return None;
        }
        match link.compare_exchange_weak(
            seen.0,
            seen.0 | BUSY,
            Ordering::Acquire,
            Ordering::Relaxed,
        ) {
            Ok(_) => return Some(seen),
            Err(other) => seen = Link(other),
        }
    }
}

/// Says what is known at a link that this thread has claimed, and everything that was written before.
pub(crate) fn publish(link: &AtomicU32, known: Link) {
    link.store(known.0, Ordering::Release);
}

// `tests/publication.rs` runs these, too, with atomics that are no use outside its models.
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_say_one_thing() {
        for place in [1, 4, 1 << 20, Link::LARGEST_PLACE] {
            let (brick, list) = (Link::to_brick(place), Link::to_list(place));
            assert_eq!(brick.brick(), Some(place as usize));
            assert_eq!(list.list(), Some(place as usize));
            assert_eq!((brick.list(), list.brick()), (None, None));
            assert_eq!([brick.at_rest(), list.at_rest()], [brick, list]);
            for link in [brick, list] {
                assert!(!link.is_pending() && link.answer().is_none(), "{link:?}");
            }
        }
        let answers = [
            (Link::LIT, Some(false)),
            (Link::SHADOWED, Some(true)),
            (Link::RAY, None),
            (Link::OUTSIDE, None),
        ];
        for (link, answer) in answers {
            assert_eq!(link.answer(), answer, "{link:?}");
            assert!(!link.is_pending(), "{link:?}");
            assert_eq!((link.brick(), link.list()), (None, None), "{link:?}");
            let same = answers.iter().filter(|(other, _)| *other == link);
            assert_eq!(same.count(), 1, "{link:?}");
        }
        assert_eq!([true, false].map(Link::known), [Link::SHADOWED, Link::LIT]);
    }

    #[test]
    fn pending_links_keep_their_price_whatever_was_paid() {
        for price in 0..40 {
            let link = Link::pending(price);
            for cost in [0, 1, COST] {
                for busy in [0, BUSY] {
                    let link = Link(link.0 | cost | busy);
                    assert_eq!(link.price(), price.min(LARGEST_PRICE), "{link:?}");
                    assert!(link.is_pending(), "{link:?}");
                    assert_eq!(link.is_free(), busy == 0, "{link:?}");
                    assert_eq!((link.brick(), link.list()), (None, None), "{link:?}");
                    assert_eq!(link.answer(), None, "{link:?}");
                }
            }
        }
    }
}
