//! What is left of a segment of light: intervals.
//!
//! A place of the segment is a share of its length from the first end; every border is where a form is zero, so which
//! of two borders comes first is the sign of a product of their numbers.

use glam::DVec3;

use super::answer::{HorizonTrace, Meeting, Shares};
use super::lines::{Candidate, Half, Lines};
use super::pyramid::Pyramid;
use super::trace::{Eye, Trace};
use crate::number::{Number, Sign};
use crate::{Occluders, ReceiverPoint, SurfaceId};

/// Places are right to this share of the length, or are computed exactly first.
const FINE: f64 = 1.0 / (1_u64 << 48) as f64;

/// A segment of light as a start sees it, with the intervals that triangles hide.
#[derive(Debug)]
pub(super) struct SpanView<'a> {
    lines: Lines<'a, 2>,
    /// What is above the horizon.
    asked: Option<Span>,
    is_all_asked: bool,
    /// What triangles hide of it.
    hidden: Vec<Span>,
}

/// An interval: it is inside of both.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// Rises where the interval begins.
    begin: Half,
    /// Falls where it ends.
    end: Half,
}

impl<'a> SpanView<'a> {
    pub(super) fn new(
        occluders: &'a Occluders,
        start: &ReceiverPoint,
        horizon: HorizonTrace<2>,
        ends: [DVec3; 2],
    ) -> Self {
        let places = ends.map(|end| (end, 1.0));
        let eye = Eye::new(occluders, start, places, false);
        let pyramid = Pyramid::new(&eye.segment, &places);
        let mut lines = Lines::new(occluders, eye, pyramid);
        // The form that is the share itself, and what is left of the segment.
        let begin = Half::new(lines.add(Trace::Own([0.0, 1.0])), false);
        let end = Half::new(lines.add(Trace::Own([1.0, 0.0])), false);
        let mut view = Self {
            lines,
            asked: Some(Span { begin, end }),
            is_all_asked: true,
            hidden: Vec::new(),
        };
        if let (Some((trace, is_negative)), Some(whole)) = (horizon, view.asked) {
            let half = Half::new(view.lines.add(trace), is_negative);
            view.asked = if view.lines.is_zero(half.line()) {
                None
            } else {
                view.inside(whole, half)
            };
            view.is_all_asked = view
                .asked
                .is_some_and(|span| span.begin == begin && span.end == end);
        }
        view
    }

    pub(super) fn is_dark(&self) -> bool {
        self.asked.is_none()
    }

    pub(super) fn pyramid(&self) -> &Pyramid {
        &self.lines.pyramid
    }

    pub(super) fn blocker_count(&self) -> usize {
        self.hidden.len()
    }

    /// Looks whether a surface hides some.
    pub(super) fn meet(&mut self, surface: SurfaceId) -> Meeting {
        let Some(mut span) = self.asked else {
            return Meeting::Misses;
        };
        let halves = match self.lines.candidate(surface) {
            Candidate::Misses => return Meeting::Misses,
            Candidate::Unclear => return Meeting::Unclear,
            Candidate::Hides(halves) => halves,
        };
        for half in halves {
            match self.inside(span, half) {
                Some(inside) => span = inside,
                None => return Meeting::Misses,
            }
        }
        if !self.lines.occluders.is_opaque_everywhere(surface) {
            return Meeting::Unclear;
        }
        self.hidden.push(span);
        Meeting::Hides
    }

    /// Returns the part of an interval inside of a form's border, if it has any length.
    fn inside(&mut self, span: Span, half: Half) -> Option<Span> {
        match (self.sign(half, span.begin), self.sign(half, span.end)) {
            (Sign::Zero | Sign::Positive, Sign::Zero | Sign::Positive) => Some(span),
            (Sign::Negative, Sign::Positive) => Some(Span {
                begin: half,
                ..span
            }),
            (Sign::Positive, Sign::Negative) => Some(Span { end: half, ..span }),
            _ => None,
        }
    }

    /// Returns the sign of a form where another one, which is not zero everywhere, is zero.
    fn sign(&mut self, half: Half, place: Half) -> Sign {
        fn at<N: Number>(f: &[N; 2], place: &[N; 2]) -> Option<Sign> {
            let product = f[1].times(&place[0]).minus(&f[0].times(&place[1]));
            let slope = place[0].minus(&place[1]).sign()?;
            let sign = product.sign()?;
            Some(if slope.is_negative() {
                sign.flipped()
            } else {
                sign
            })
        }
        if half.line() == place.line() {
            return Sign::Zero;
        }
        let rough = at(&self.lines.rough(half), &self.lines.rough(place));
        rough.unwrap_or_else(|| {
            let (half, place) = (self.lines.exact(half), self.lines.exact(place));
            at(&half, &place).unwrap_or(Sign::Zero)
        })
    }

    /// Returns whether one border is farther from the first end than another.
    fn is_beyond(&mut self, rising: Half, other: Half) -> bool {
        self.sign(rising, other) == Sign::Negative
    }

    /// Returns where a border is.
    fn place(&mut self, half: Half) -> f64 {
        let [f, g] = self.lines.rough(half);
        let length = f.minus(&g);
        let place = f.value() / length.value();
        let error =
            (f.error() + place.abs() * length.error()) / (length.value().abs() - length.error());
        let place = if (0.0..=FINE).contains(&error) {
            place
        } else {
            let [f, g] = self.lines.exact(half);
            f.over(&f.minus(&g))
        };
        place.clamp(0.0, 1.0)
    }

    /// Returns the lit intervals by their borders.
    fn lit(&mut self) -> Vec<Span> {
        let Some(asked) = self.asked else {
            return Vec::new();
        };
        let mut hidden = self.hidden.clone();
        self.sort(&mut hidden);
        let mut lit = Vec::new();
        // Up to where all is told: a border that rises there.
        let mut told = asked.begin;
        for span in hidden {
            if self.is_beyond(span.begin, told) {
                lit.push(Span {
                    begin: told,
                    end: span.begin.flipped(),
                });
            }
            // An end falls where it is.
            if self.sign(span.end, told) == Sign::Positive {
                told = span.end.flipped();
            }
        }
        if self.sign(asked.end, told) == Sign::Positive {
            lit.push(Span {
                begin: told,
                end: asked.end,
            });
        }
        lit
    }

    /// Sorts intervals by where they begin.
    fn sort(&mut self, spans: &mut [Span]) {
        // Exact signs order them, so no comparison contradicts another.
        spans.sort_by(|one, other| match self.sign(one.begin, other.begin) {
            // The first one's form is still below zero where the other begins.
            Sign::Negative => std::cmp::Ordering::Greater,
            Sign::Zero => std::cmp::Ordering::Equal,
            Sign::Positive => std::cmp::Ordering::Less,
        });
    }

    /// Returns the lit intervals, as shares of the length.
    pub(super) fn intervals(&mut self) -> Vec<[f64; 2]> {
        let mut from: f64 = 0.0;
        let spans = self.lit();
        spans
            .into_iter()
            .map(|span| {
                let begin = self.place(span.begin).max(from);
                from = self.place(span.end).max(begin);
                [begin, from]
            })
            .collect()
    }

    pub(super) fn shares(&mut self) -> Shares {
        let Some(asked) = self.asked else {
            return Shares::default();
        };
        let some = |share: f64| share.clamp(f64::MIN_POSITIVE, 1.0_f64.next_down());
        let asked = if self.is_all_asked {
            1.0
        } else {
            some(self.place(asked.end) - self.place(asked.begin))
        };
        if self.hidden.is_empty() {
            return Shares { asked, lit: asked };
        }
        let intervals = self.intervals();
        let length: f64 = intervals.iter().map(|[begin, end]| end - begin).sum();
        let lit = if intervals.is_empty() {
            0.0
        } else {
            some(length).min(asked.next_down())
        };
        Shares { asked, lit }
    }
}
