//! Which part of a light a start sees, without samples.
//!
//! In: a start, an [`AreaShape`], and the surfaces that may hide some of it. Out: the share of the light that is lit,
//! or the lit intervals of a segment ([`LightView`]). Invariant: where a light is hidden is decided by exact signs of
//! the forms of EXACTNESS.md ("The exact visible fraction"); only the size of what is left is rounded. Absent here:
//! which surfaces may hide some, which whoever has a tree knows.
//!
//! All forms of the rule are linear in the light's place, so a triangle hides a convex part of a flat light: what is
//! beyond its plane and inside of the planes through the start and its edges.
//!
//! | module | in | out |
//! |---|---|---|
//! | `trace` | a plane | its line on the light, in both arithmetics |
//! | `lines` | a surface | the half-planes whose common part it hides |
//! | `piece` | a convex piece, a line | its parts on both sides |
//! | `answer` | | what views are asked and say |
//! | `area` | pieces and blockers | what is left |
//! | `span` | the same for a segment | intervals |
//! | `measure` | a piece | its area or solid angle |
//! | `light` | an [`AreaShape`] | its flat parts |
//! | `pyramid` | a start, an outline | planes around all segments |

mod answer;
mod area;
mod light;
mod lines;
mod measure;
mod piece;
mod pyramid;
mod span;
mod trace;

use glam::DVec3;

use self::answer::HorizonTrace;
use self::area::AreaView;
use self::span::SpanView;
use self::trace::Trace;
use crate::occluders::OwnShape;
use crate::segment::Plane;
use crate::{AreaShape, Occluders, ReceiverPoint, SurfaceId};

pub use answer::{Meeting, Shares};

/// Largest number of triangles that hide some of a light with area; above it samples answer.
pub const MOST_BLOCKERS: usize = 256;

/// Largest number of triangles that hide some of a segment.
pub const MOST_SPANS: usize = 4096;

/// Part of a light that is above the plane of the receiver point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Horizon {
    /// All of it.
    Open,
    /// What is in front of the start's surface; all of it for free starts.
    Front,
    /// What is behind the start's surface; all of it for free starts.
    Back,
    /// What is on this normal's side of the start.
    Normal(DVec3),
}

/// A light as one start sees it.
#[derive(Debug)]
pub struct LightView<'a> {
    parts: Vec<Part<'a>>,
    /// How many parts there are, and their size, those included that do not shine here.
    count: usize,
    size: f64,
    /// How many triangles more may hide some.
    room: usize,
}

#[derive(Debug)]
enum Part<'a> {
    Area(AreaView<'a>),
    Span(SpanView<'a>),
}

impl<'a> LightView<'a> {
    /// Looks at a light; `None` where there is no closed form: spheres of light and skies, lights of more than 64
    /// triangles, and starts on curved surfaces that may hide the light by their own rule.
    pub fn new(
        occluders: &'a Occluders,
        start: &ReceiverPoint,
        horizon: Horizon,
        light: &AreaShape,
    ) -> Option<Self> {
        if let AreaShape::Segment(segment) = light {
            let horizon = horizon_trace(occluders, start, horizon)?;
            let part = SpanView::new(occluders, start, horizon, segment.ends());
            return Some(Self {
                parts: vec![Part::Span(part)],
                count: 1,
                size: 1.0,
                room: MOST_SPANS,
            });
        }
        let horizon = horizon_trace::<3>(occluders, start, horizon)?;
        let (parts, count, size) = light::parts_towards(light, start.point)?;
        let parts = parts.into_iter();
        let parts = parts.map(|part| Part::Area(AreaView::new(occluders, start, horizon, part)));
        Some(Self {
            parts: parts.collect(),
            count,
            size,
            room: MOST_BLOCKERS,
        })
    }

    /// Returns how many parts there are; surfaces are shown to each.
    pub fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Returns whether nothing of a part is asked about, so that no surface matters.
    pub fn is_dark(&self, part: usize) -> bool {
        match &self.parts[part] {
            Part::Area(view) => view.is_dark(),
            Part::Span(view) => view.is_dark(),
        }
    }

    /// Returns planes that have all segments to a part on their inner side, up to rounding: outward normals whose
    /// largest component is 1, and points on them. They err by less than 2^-21 of a distance from those points.
    pub fn planes(&self, part: usize) -> Vec<(DVec3, DVec3)> {
        match &self.parts[part] {
            Part::Area(view) => view.pyramid().planes().collect(),
            Part::Span(view) => view.pyramid().planes().collect(),
        }
    }

    /// Returns a bound on how far the planes' common point is from the exact start, in world units.
    pub fn offset(&self, part: usize) -> f64 {
        match &self.parts[part] {
            Part::Area(view) => view.pyramid().offset(),
            Part::Span(view) => view.pyramid().offset(),
        }
    }

    /// Shows a surface to a part. Each is to be shown once to each part; in which order changes nothing.
    pub fn meet(&mut self, part: usize, surface: SurfaceId) -> Meeting {
        let meeting = match &mut self.parts[part] {
            Part::Area(view) => view.meet(surface),
            Part::Span(view) => view.meet(surface),
        };
        if meeting == Meeting::Hides {
            match self.room.checked_sub(1) {
                Some(room) => self.room = room,
                None => return Meeting::Unclear,
            }
        }
        meeting
    }

    /// Returns how many triangles hide some so far.
    pub fn blocker_count(&self) -> usize {
        let parts = self.parts.iter();
        parts
            .map(|part| match part {
                Part::Area(view) => view.blocker_count(),
                Part::Span(view) => view.blocker_count(),
            })
            .sum()
    }

    /// Returns what is lit; `None` where it falls into too many pieces.
    pub fn shares(&mut self) -> Option<Shares> {
        let mut sum = Shares::default();
        let (mut has_dark, mut has_lit, mut is_all_asked) = (false, false, true);
        for part in &mut self.parts {
            let (shares, part_size) = match part {
                Part::Area(view) => (view.shares()?, view.size()),
                Part::Span(view) => (view.shares(), 1.0),
            };
            sum.asked += shares.asked * part_size;
            sum.lit += shares.lit * part_size;
            has_dark |= shares.lit < shares.asked;
            has_lit |= shares.lit > 0.0;
            is_all_asked &= shares.asked == 1.0;
        }
        let some = |share: f64| share.clamp(f64::MIN_POSITIVE, 1.0_f64.next_down());
        let mut shares = Shares::default();
        if sum.asked > 0.0 {
            // Some parts may not shine towards the start.
            shares.asked = if is_all_asked && self.parts.len() == self.count {
                1.0
            } else {
                some(sum.asked / self.size)
            };
        }
        shares.lit = match (has_lit, has_dark) {
            (false, _) => 0.0,
            (true, false) => shares.asked,
            (true, true) => some(sum.lit / self.size).min(shares.asked.next_down()),
        };
        Some(shares)
    }

    /// Returns the lit intervals of a segment in order, as shares of its length from its first end; `None` for other
    /// lights.
    pub fn intervals(&mut self) -> Option<Vec<[f64; 2]>> {
        match &mut self.parts[..] {
            [Part::Span(view)] => Some(view.intervals()),
            _ => None,
        }
    }
}

/// Returns the plane of a horizon; the outer `None` where the start's own surface may hide some of the light by a rule
/// that has no closed form.
fn horizon_trace<const K: usize>(
    occluders: &Occluders,
    start: &ReceiverPoint,
    horizon: Horizon,
) -> Option<HorizonTrace<K>> {
    let own = start.surface.map(|surface| occluders.own_shape(surface));
    if matches!(own, Some(OwnShape::Other)) {
        return None;
    }
    let is_back = horizon == Horizon::Back;
    Some(match (own, horizon) {
        // The own rule of a sphere hides nothing of what is in front.
        (Some(OwnShape::Ball(sphere)), Horizon::Front) => Some((Trace::Tangent(sphere), false)),
        (Some(OwnShape::Ball(_)), _) => return None,
        (_, Horizon::Normal(normal)) => {
            let plane = Plane::Normal {
                point: start.point,
                tip: normal,
                tail: DVec3::ZERO,
            };
            Some((Trace::Plane(plane), false))
        }
        (Some(OwnShape::Flat(plane)), Horizon::Front | Horizon::Back) => {
            Some((Trace::Plane(plane), is_back))
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests;
