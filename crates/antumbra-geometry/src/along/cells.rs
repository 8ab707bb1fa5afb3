//! A segment cut where forms change their signs.
//!
//! In: forms with their zeros. Out: the pieces between neighbouring zeros, in order, with the sign that each form has there.
//! Invariant: a form is zero in a piece only if it is zero all along; single points are no pieces.

use std::cmp::Ordering;

use super::border::Border;
use super::dark::Span;
use crate::number::Sign;

/// Forms that are looked at together.
pub(super) const MOST_FORMS: usize = 6;

/// How a form's sign changes along the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Right behind the first end; zero where the form is zero all along.
    pub(super) before: Sign,
    /// Where the sign changes, in order.
    pub(super) zeros: [Option<Border>; 2],
}

impl Track {
    /// Returns the sign right behind a place.
    fn sign_behind(&self, place: &Border, compare: impl Fn(&Border, &Border) -> Ordering) -> Sign {
        let zeros = self.zeros.iter().flatten();
        let passed = zeros.filter(|zero| compare(zero, place).is_le()).count();
        if passed == 1 {
            self.before.flipped()
        } else {
            self.before
        }
    }
}

/// Calls `visit` with each piece of a span and the signs in it, in the order of the forms.
pub(super) fn for_each_cell<const FORMS: usize>(
    tracks: [&Track; FORMS],
    within: &Span,
    compare: impl Fn(&Border, &Border) -> Ordering,
    mut visit: impl FnMut(Span, [Sign; FORMS]),
) {
    const { assert!(FORMS <= MOST_FORMS) };
    let mut zeros = [Border::FIRST; 2 * MOST_FORMS];
    let mut count = 0;
    for zero in tracks.iter().flat_map(|track| track.zeros.iter().flatten()) {
        if compare(zero, &within.begin).is_gt() && compare(zero, &within.end).is_lt() {
            zeros[count] = *zero;
            count += 1;
        }
    }
    let zeros = &mut zeros[..count];
    // Exact signs order them, so no comparison contradicts another.
    zeros.sort_unstable_by(&compare);
    let mut begin = within.begin;
    for end in zeros.iter().chain([&within.end]) {
        if compare(&begin, end).is_lt() {
            let signs = tracks.map(|track| track.sign_behind(&begin, &compare));
            visit(Span { begin, end: *end }, signs);
            begin = *end;
        }
    }
}
