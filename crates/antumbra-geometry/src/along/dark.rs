//! Shaded intervals, merged while they are found.
//!
//! In: intervals in any order. Out: those that are apart, and the gaps between them. Invariant: what is merged is in order
//! and does not touch; so a mesh whose triangles shade a stretch together is one interval there. New ones wait until they
//! are as many as the merged ones, so that merging costs little however many there are.

use std::cmp::Ordering;

use super::border::Border;

/// New intervals that wait at least, so that few are merged at once.
const FEWEST_WAITING: usize = 8;

/// An interval with a length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) begin: Border,
    pub(super) end: Border,
}

impl Span {
    /// All of the segment.
    pub(super) const WHOLE: Self = Self {
        begin: Border::FIRST,
        end: Border::LAST,
    };
}

/// Intervals, most of them in order and apart.
#[derive(Clone, Debug, Default)]
pub(super) struct Dark {
    merged: Vec<Span>,
    waiting: Vec<Span>,
    /// How often intervals were merged.
    merges: u32,
}

impl Dark {
    /// Returns whether everything from end to end is known to be in one interval.
    #[inline]
    pub(super) fn is_all(&self) -> bool {
        let whole = self.merged.first();
        whole.is_some_and(|span| span.begin.is_first() && span.end.is_last())
    }

    /// Adds an interval.
    #[inline]
    pub(super) fn add(&mut self, span: Span, compare: impl Fn(&Border, &Border) -> Ordering) {
        self.waiting.push(span);
        if self.waiting.len() >= self.merged.len().max(FEWEST_WAITING) {
            self.merge(compare);
        }
    }

    /// Merges all: intervals that touch become one.
    pub(super) fn merge(&mut self, compare: impl Fn(&Border, &Border) -> Ordering) {
        if self.waiting.is_empty() {
            return;
        }
        self.merges += 1;
        self.merged.append(&mut self.waiting);
        // Exact signs order them, so no comparison contradicts another.
        self.merged
            .sort_by(|one, other| compare(&one.begin, &other.begin));
        self.merged.dedup_by(|next, last| {
            let touches = compare(&next.begin, &last.end).is_le();
            if touches && compare(&next.end, &last.end).is_gt() {
                last.end = next.end;
            }
            touches
        });
    }

    /// Returns a number that changes whenever what is merged does.
    #[inline]
    pub(super) fn merges(&self) -> u32 {
        self.merges
    }

    /// Returns shares between which all is surely inside of what is merged, of the `N` widest such intervals; `None` stands for
    /// an end of the segment.
    pub(super) fn widest<const N: usize>(&self) -> impl Iterator<Item = [Option<f64>; 2]> {
        let mut widest = [(0.0, [None; 2]); N];
        for Span { begin, end } in &self.merged {
            let from = (!begin.is_first()).then_some(begin.place + begin.error);
            let to = (!end.is_last()).then_some(end.place - end.error);
            let mut next = (to.unwrap_or(1.0) - from.unwrap_or(0.0), [from, to]);
            for kept in &mut widest {
                if next.0 > kept.0 {
                    std::mem::swap(kept, &mut next);
                }
            }
        }
        let is_some = |(width, _): &(f64, _)| *width > 0.0;
        widest.into_iter().filter(is_some).map(|(_, shares)| shares)
    }

    /// Returns whether all of the segment between two shares is surely inside of what is merged.
    #[inline]
    pub(super) fn covers(&self, [least, most]: [f64; 2]) -> bool {
        let before = |span: &Span| span.begin.is_first() || span.begin.place < least;
        let Some(last) = self.merged.partition_point(before).checked_sub(1) else {
            return false;
        };
        let Span { begin, end } = &self.merged[last];
        (begin.is_first() || begin.place + begin.error < least)
            && (end.is_last() || most < end.place - end.error)
    }

    /// Returns whether an interval is inside of what is merged, which must be all.
    pub(super) fn holds(
        &self,
        span: &Span,
        compare: impl Fn(&Border, &Border) -> Ordering,
    ) -> bool {
        self.merged.iter().any(|other| {
            compare(&other.begin, &span.begin).is_le() && compare(&other.end, &span.end).is_ge()
        })
    }

    /// Calls `visit` with the borders of each gap that has a length, between what is merged, which must be all.
    pub(super) fn for_each_gap(
        &self,
        compare: impl Fn(&Border, &Border) -> Ordering,
        mut visit: impl FnMut(&Border, &Border),
    ) {
        let mut from = &Border::FIRST;
        for Span { begin, end } in &self.merged {
            if compare(from, begin).is_lt() {
                visit(from, begin);
            }
            from = end;
        }
        if compare(from, &Border::LAST).is_lt() {
            visit(from, &Border::LAST);
        }
    }
}
