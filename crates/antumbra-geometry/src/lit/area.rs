//! What is left of one flat part of a light.

use super::answer::{HorizonTrace, Meeting, Shares};
use super::light::FlatPart;
use super::lines::{Candidate, Half, Lines};
use super::measure::Measure;
use super::piece::{Cut, Piece, Plan};
use super::pyramid::Pyramid;
use super::trace::Eye;
use crate::{Occluders, ReceiverPoint, SurfaceId};

/// Largest number of pieces that the lit part is held in.
const MOST_PIECES: usize = 4096;

/// Shares above this one are surely above zero.
const SURE: f64 = 1e-6;

/// One flat part of a light as a start sees it, with the triangles that hide some of it.
#[derive(Debug)]
pub(super) struct AreaView<'a> {
    plan: Plan<'a>,
    measure: Measure,
    size: f64,
    /// What is above the horizon, if it is anything, and whether that is all.
    asked: Option<Piece>,
    is_all_asked: bool,
    blockers: Vec<Blocker>,
}

/// A triangle that hides some.
#[derive(Debug)]
struct Blocker {
    surface: SurfaceId,
    halves: Vec<Half>,
    /// What it hides.
    piece: Piece,
}

impl<'a> AreaView<'a> {
    pub(super) fn new(
        occluders: &'a Occluders,
        start: &ReceiverPoint,
        horizon: HorizonTrace<3>,
        part: FlatPart,
    ) -> Self {
        let eye = Eye::new(occluders, start, part.basis, part.is_affine);
        let pyramid = Pyramid::new(&eye.segment, &part.corners);
        let mut plan = Plan::new(Lines::new(occluders, eye, pyramid));
        let outline: Vec<Half> = part
            .traces()
            .map(|trace| Half::new(plan.lines.add(trace), false))
            .collect();
        let whole = plan.piece(&outline);
        let mut view = Self {
            plan,
            measure: part.measure,
            size: part.size,
            asked: None,
            is_all_asked: true,
            blockers: Vec::new(),
        };
        view.asked = match horizon {
            None => Some(whole),
            Some((trace, is_negative)) => {
                let half = Half::new(view.plan.lines.add(trace), is_negative);
                view.above(whole, half)
            }
        };
        view
    }

    /// Returns the part of the whole light above the horizon.
    fn above(&mut self, whole: Piece, half: Half) -> Option<Piece> {
        if self.plan.lines.is_zero(half.line()) {
            return None;
        }
        match self.plan.cut(&whole, half) {
            Cut::Inside => Some(whole),
            Cut::Outside => None,
            Cut::Both(signs) => {
                let below = self.plan.outside(&whole, &signs, half);
                if !self.counts(&below) {
                    return Some(whole);
                }
                self.is_all_asked = false;
                let above = self.plan.inside(&whole, &signs, half);
                self.counts(&above).then_some(above)
            }
        }
    }

    /// Returns whether a piece is any part of the light.
    fn counts(&mut self, piece: &Piece) -> bool {
        !self.measure.is_round() || self.plan.meets_disc(piece)
    }

    pub(super) fn is_dark(&self) -> bool {
        self.asked.is_none()
    }

    pub(super) fn pyramid(&self) -> &Pyramid {
        &self.plan.lines.pyramid
    }

    pub(super) fn size(&self) -> f64 {
        self.size
    }

    pub(super) fn blocker_count(&self) -> usize {
        self.blockers.len()
    }

    /// Looks whether a surface hides some.
    pub(super) fn meet(&mut self, surface: SurfaceId) -> Meeting {
        let Some(asked) = self.asked.clone() else {
            return Meeting::Misses;
        };
        let halves = match self.plan.lines.candidate(surface) {
            Candidate::Misses => return Meeting::Misses,
            Candidate::Unclear => return Meeting::Unclear,
            Candidate::Hides(halves) => halves,
        };
        let mut piece = asked;
        for &half in &halves {
            match self.plan.cut(&piece, half) {
                Cut::Inside => {}
                Cut::Outside => return Meeting::Misses,
                Cut::Both(signs) => piece = self.plan.inside(&piece, &signs, half),
            }
        }
        if !self.counts(&piece) {
            return Meeting::Misses;
        }
        if !self.plan.lines.occluders.is_opaque_everywhere(surface) {
            return Meeting::Unclear;
        }
        self.blockers.push(Blocker {
            surface,
            halves,
            piece,
        });
        Meeting::Hides
    }

    /// Returns the shares of this part; `None` where the lit part falls into too many pieces.
    pub(super) fn shares(&mut self) -> Option<Shares> {
        let Some(asked) = self.asked.clone() else {
            return Some(Shares::default());
        };
        let some = |share: f64| share.clamp(f64::MIN_POSITIVE, 1.0_f64.next_down());
        let asked_share = if self.is_all_asked {
            1.0
        } else {
            some(self.share_of(&asked))
        };
        if self.blockers.is_empty() {
            return Some(Shares {
                asked: asked_share,
                lit: asked_share,
            });
        }
        let pieces = self.left(asked)?;
        // One sum in the order of the surfaces, whatever the order in which they were met.
        let sum: f64 = pieces.iter().map(|piece| self.share_of(piece)).sum();
        let is_lit = sum > SURE || pieces.iter().any(|piece| self.counts(piece));
        Some(Shares {
            asked: asked_share,
            lit: if is_lit {
                some(sum).min(asked_share.next_down())
            } else {
                0.0
            },
        })
    }

    fn share_of(&self, piece: &Piece) -> f64 {
        self.measure.of(self.plan.places(piece)) / self.measure.whole()
    }

    /// Returns what no blocker hides, as pieces that have nothing in common.
    fn left(&mut self, asked: Piece) -> Option<Vec<Piece>> {
        let mut blockers = std::mem::take(&mut self.blockers);
        blockers.sort_by_key(|blocker| blocker.surface.0);
        let mut pieces = vec![asked];
        let mut next = Vec::new();
        for blocker in &blockers {
            for piece in pieces.drain(..) {
                if piece.is_apart(&blocker.piece) {
                    next.push(piece);
                } else {
                    self.subtract(piece, &blocker.halves, &mut next);
                }
            }
            std::mem::swap(&mut pieces, &mut next);
            if pieces.len() > MOST_PIECES {
                return None;
            }
            if pieces.is_empty() {
                break;
            }
        }
        self.blockers = blockers;
        Some(pieces)
    }

    /// Adds what is left of a piece outside of the common part of some half-planes.
    fn subtract(&mut self, piece: Piece, halves: &[Half], left: &mut Vec<Piece>) {
        let count = left.len();
        let mut rest = piece.clone();
        for &half in halves {
            match self.plan.cut(&rest, half) {
                Cut::Inside => {}
                Cut::Outside => {
                    // The piece is not hidden at all.
                    left.truncate(count);
                    left.push(piece);
                    return;
                }
                Cut::Both(signs) => {
                    left.push(self.plan.outside(&rest, &signs, half));
                    rest = self.plan.inside(&rest, &signs, half);
                }
            }
        }
    }
}
