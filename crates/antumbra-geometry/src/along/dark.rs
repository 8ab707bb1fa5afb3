//! Shaded intervals, merged while they are found.
//!
//! In: intervals in any order. Out: those that are apart, and the gaps between them. Invariant: the intervals are in order
//! and do not touch; so a mesh whose triangles shade a stretch together is one interval, and one more that lies inside of
//! it costs a comparison.

use std::cmp::Ordering;

use super::border::Border;

/// An interval with a length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) begin: Border,
    pub(super) end: Border,
}

/// Intervals in order that do not touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Dark {
    spans: Vec<Span>,
    is_all: bool,
}

impl Dark {
    /// Returns whether everything from end to end is in one interval, as far as its borders are the segment's own.
    pub(super) fn is_all(&self) -> bool {
        self.is_all
    }

    /// Adds an interval; one that touches another is one with it.
    pub(super) fn add(&mut self, span: Span, compare: impl Fn(&Border, &Border) -> Ordering) {
        let spans = &mut self.spans;
        let first = spans
            .iter()
            .position(|other| compare(&other.end, &span.begin).is_ge());
        let Some(first) = first else {
            spans.push(span);
            self.note(0);
            return;
        };
        let rest = spans[first..].iter();
        let count = rest
            .take_while(|other| compare(&other.begin, &span.end).is_le())
            .count();
        let Some(last) = count.checked_sub(1) else {
            spans.insert(first, span);
            return;
        };
        let end = spans[first + last].end;
        let merged = &mut spans[first];
        if compare(&span.begin, &merged.begin).is_lt() {
            merged.begin = span.begin;
        }
        merged.end = if compare(&span.end, &end).is_gt() {
            span.end
        } else {
            end
        };
        if last > 0 {
            spans.drain(first + 1..=first + last);
        }
        self.note(first);
    }

    /// Looks whether an interval is all.
    fn note(&mut self, number: usize) {
        let Span { begin, end } = &self.spans[number];
        self.is_all |= begin.is_first() && end.is_last();
    }

    /// Returns whether an interval is inside of what was added.
    pub(super) fn holds(
        &self,
        span: &Span,
        compare: impl Fn(&Border, &Border) -> Ordering,
    ) -> bool {
        self.spans.iter().any(|other| {
            compare(&other.begin, &span.begin).is_le() && compare(&other.end, &span.end).is_ge()
        })
    }

    /// Calls `visit` with the borders of each gap that has a length.
    pub(super) fn for_each_gap(
        &self,
        compare: impl Fn(&Border, &Border) -> Ordering,
        mut visit: impl FnMut(&Border, &Border),
    ) {
        let mut from = &Border::FIRST;
        for Span { begin, end } in &self.spans {
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
