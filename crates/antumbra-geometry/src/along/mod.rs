//! Which points of a segment a light without size reaches.
//!
//! In: a segment of points in space, a light that is a point or a direction, and the surfaces that may shade some of it.
//! Out: the lit intervals of the segment ([`SegmentShadows`]). Invariant: how many there are, and between which borders,
//! is decided by exact signs of the forms of EXACTNESS.md ("Lit intervals along a segment"); each end is rounded once.
//! Absent here: which surfaces may shade some, which whoever has a tree knows. Paper 9.4; shadow volumes along view rays
//! are those of Max (1986) and Nishita, Miyawaki and Nakamae (1987).
//!
//! A triangle's forms are linear in the point that asks, so it shades an interval: what is behind its plane and inside of the
//! planes through the light and its edges. It is the dual of a linear light seen from one point (`lit`): there the light
//! is a segment, here the points are. Those of spheres, disks and tubes are quadratic at most, so their shadows begin and
//! end at square roots.
//!
//! | module | in | out |
//! |---|---|---|
//! | `linear` | a face's corners | its forms at both ends, with bounds or exactly |
//! | `forms` | a face's corners | all its forms at once, with bounds |
//! | `quadric` | a sphere, a disk or a tube | its forms as quadratic functions |
//! | `quadratic` | a quadratic function | its sign and its zeros |
//! | `surd` | exact coefficients | exact zeros, compared and rounded |
//! | `border` | forms and their zeros | which is nearer, and where |
//! | `cells` | zeros of several forms | pieces with the signs there |
//! | `cast` | a curved surface | the spans that it shades |
//! | `dark` | shaded intervals, one after another | those that are apart, in order |
//! | `double`, `refined` | `f64`s | sums, products, quotients and roots of twice their bits, with or without a bound |
//! | `fan` | corners | a stretch that holds their shadow |
//! | `hull` | segment and light | planes around all shadow rays |
//! | `known` | stretches that values know | which shadows do not matter |

mod border;
mod cast;
mod cells;
mod dark;
mod double;
mod fan;
mod forms;
mod hull;
mod known;
mod linear;
mod quadratic;
mod quadric;
mod refined;
mod surd;

use std::cell::OnceCell;

use fearless_simd::Level;
use glam::DVec3;

use self::border::Border;
use self::cast::for_each_shadow;
use self::dark::{Dark, Span};
use self::fan::Fan;
use self::forms::{ALL, EDGES, Forms, form_of};
use self::hull::Hull;
use self::known::Known;
pub use self::known::KnownStretch;
use self::linear::{Ends, FaceForm, Values, certain};
use crate::number::Sign;
use crate::{LightShape, Occluders, SurfaceId};

/// More than what a box around a curved surface errs, as a share of its largest coordinate.
const BOX_ROOM: f64 = 1.0 / (1_u64 << 44) as f64;

/// A segment of points in space under a light without size, with the shadows that surfaces cast on it.
#[derive(Debug)]
pub struct SegmentShadows<'a> {
    occluders: &'a Occluders,
    ends: Ends,
    level: Level,
    hull: Hull,
    /// Made when something is known to be dark.
    fan: OnceCell<Option<Fan>>,
    dark: Dark,
    known: Known,
    /// Spans that triangles with holes and freeform surfaces may shade.
    doubtful: Vec<(Span, SurfaceId)>,
}

impl<'a> SegmentShadows<'a> {
    /// Looks at a segment from its first point to its last; both in world space, finite and at most 2^100 in magnitude,
    /// like the light. Two points in one place are a segment, too.
    pub fn new(occluders: &'a Occluders, points: [DVec3; 2], light: &LightShape) -> Self {
        let light = light.without_underflow().homogeneous();
        Self {
            occluders,
            ends: Ends { points, light },
            level: Level::new(),
            hull: Hull::new(points, light),
            fan: OnceCell::new(),
            dark: Dark::default(),
            known: Known::default(),
            // Which of them may shade the segment depends on how closely somebody looks, so any of them may.
            doubtful: occluders
                .first_freeform()
                .map(|surface| (Span::WHOLE, surface))
                .into_iter()
                .collect(),
        }
    }

    /// Takes what somebody knows of the segment: stretches in order and apart. Surfaces that shade nothing else may be left
    /// out from now on. No surface may be alpha-tested: where its shadow has no closed form is to be said.
    #[must_use]
    pub fn knowing(mut self, stretches: Vec<KnownStretch>) -> Self {
        self.known = Known::new(stretches);
        self
    }

    /// Returns whether one known stretch is all of the segment, so that no surface matters.
    pub fn is_all_known(&self) -> bool {
        self.known.covers([0.0, 1.0])
    }

    /// Returns half-spaces that hold all shadow rays from the segment: outward normals whose largest component is 1, and
    /// for each the largest height over a point that a ray within `reach` of it (along each axis) has.
    pub fn heights_over(
        &self,
        point: DVec3,
        reach: f64,
    ) -> impl Iterator<Item = (DVec3, f64)> + Clone {
        self.hull.heights_over(point, reach)
    }

    /// Returns a number that changes whenever more of the segment is known to be in shadow.
    pub fn dark_version(&self) -> u32 {
        self.dark.merges()
    }

    /// Returns pairs of half-spaces, at most `N`: triangles within both, as far as they are within `reach` of a point along each
    /// axis, shade only what is known to be in shadow. Each is an outward normal whose largest component is 1, and the
    /// height over the point that all of it is below; `None` stands for all of space.
    pub fn dark_sides_over<const N: usize>(
        &self,
        point: DVec3,
        reach: f64,
    ) -> impl Iterator<Item = [Option<(DVec3, f64)>; 2]> {
        let fan = self.fan();
        let wedges = fan.into_iter().flat_map(|fan| {
            let shares = self.dark.widest::<N>();
            shares.map(move |shares| (fan, shares))
        });
        wedges.filter_map(move |(fan, [from, to])| {
            let side = |share: Option<f64>, is_beyond| match share {
                None => Some(None),
                Some(share) => fan.half_space(share, is_beyond, point, reach).map(Some),
            };
            Some([side(from, true)?, side(to, false)?])
        })
    }

    fn fan(&self) -> Option<&Fan> {
        let make = || Fan::new(self.ends.points, self.ends.light);
        self.fan.get_or_init(make).as_ref()
    }

    /// Returns whether the whole segment is known to be in shadow by now, so that no other surface matters.
    pub fn is_all_dark(&self) -> bool {
        self.dark.is_all()
    }

    /// Shows a surface. Each is to be shown once; in which order changes nothing, and those that no shadow ray from the
    /// segment meets may be left out.
    #[inline]
    pub fn meet(&mut self, surface: SurfaceId) {
        let Some((corners, is_whole)) = self.occluders.blocking_triangle(surface) else {
            self.meet_curved(surface);
            return;
        };
        if !self.known.is_nothing() && self.is_known(&corners) {
            return;
        }
        let Some(span) = self.shaded_by(surface, &corners) else {
            return;
        };
        if !is_whole {
            self.doubtful.push((span, surface));
            return;
        }
        let outer = [
            span.begin.place - span.begin.error,
            span.end.place + span.end.error,
        ];
        if !self.dark.covers(outer) {
            let (ends, occluders) = (&self.ends, self.occluders);
            self.dark
                .add(span, |one, other| ends.compare(occluders, one, other));
        }
    }

    #[cold]
    #[inline(never)]
    fn meet_curved(&mut self, surface: SurfaceId) {
        let occluders = self.occluders;
        let is_curved = surface.0 as usize >= occluders.triangle_count();
        // Freeform surfaces were all taken up at once.
        if !is_curved
            || !occluders.is_opaque(surface)
            || occluders.is_freeform(surface)
            || self.misses_curved(surface)
        {
            return;
        }
        let (ends, dark) = (self.ends, &mut self.dark);
        for_each_shadow(&ends, occluders, surface, |span| {
            dark.add(span, |one, other| ends.compare(occluders, one, other));
        });
    }

    /// Returns whether the shadow of what is between some corners is surely beside the segment, or where it is dark.
    #[inline]
    fn is_known(&self, corners: &[DVec3]) -> bool {
        let reach = self.fan().and_then(|fan| fan.reach(corners));
        reach.is_some_and(|[least, most]| {
            let (dark, known) = (&self.dark, &self.known);
            most < 0.0 || least > 1.0 || dark.covers([least, most]) || known.covers([least, most])
        })
    }

    /// Returns whether a surface that is no triangle surely shades nothing that is not dark.
    fn misses_curved(&self, surface: SurfaceId) -> bool {
        let is_missed = self
            .occluders
            .sphere(surface)
            .is_some_and(|sphere| self.hull.misses_ball(sphere.center, sphere.radius));
        if is_missed {
            return true;
        }
        let bounds = self.occluders.surface_bounds(surface);
        let room = BOX_ROOM * bounds.largest_coordinate() + f64::MIN_POSITIVE;
        let corners = bounds.inflated(DVec3::splat(room)).corners();
        self.hull.misses(&corners) || self.is_known(&corners)
    }

    /// Returns the interval that a triangle shades, if that has any length.
    #[inline]
    fn shaded_by(&self, surface: SurfaceId, corners: &[DVec3; 3]) -> Option<Span> {
        let forms = Forms::of(self.level, &self.ends, corners);
        let light_side =
            certain(forms.light).unwrap_or_else(|| self.ends.exact_light_side(*corners));
        // Points in shadow are on the other side of the plane, and on the light's side of all edges.
        let [above, below] = match light_side {
            Sign::Positive => [forms.above, forms.below],
            Sign::Negative => [forms.below, forms.above],
            Sign::Zero => return None,
        };
        let side = |edges: u32, plane: u32| (edges & EDGES) | (plane & !EDGES);
        let inside = [side(above[0], below[0]), side(above[1], below[1])];
        let outside = [side(below[0], above[0]), side(below[1], above[1])];
        if outside[0] & outside[1] != 0 {
            return None;
        }
        let mut span = Span::WHOLE;
        let known = (inside[0] | outside[0]) & (inside[1] | outside[1]);
        if known != ALL {
            return self.shaded_in_doubt(surface, &forms, light_side);
        }
        let mut clipping = outside[0] | outside[1];
        while clipping != 0 {
            let lane = clipping.trailing_zeros() as usize;
            clipping &= clipping - 1;
            let values = forms.lane(lane);
            let border = self
                .ends
                .border(self.occluders, surface, form_of(lane), &values);
            let compare =
                |one: &Border, other: &Border| self.ends.compare(self.occluders, one, other);
            if outside[0] >> lane & 1 != 0 {
                if compare(&border, &span.begin).is_gt() {
                    span.begin = border;
                }
            } else if compare(&border, &span.end).is_lt() {
                span.end = border;
            }
        }
        let order = self.ends.compare(self.occluders, &span.begin, &span.end);
        order.is_lt().then_some(span)
    }

    #[cold]
    #[inline(never)]
    fn shaded_in_doubt(&self, surface: SurfaceId, forms: &Forms, light_side: Sign) -> Option<Span> {
        let mut span = Span::WHOLE;
        for lane in 0..4 {
            let wanted = match lane {
                0 => (light_side.flipped(), false),
                _ => (light_side, true),
            };
            span = self.clipped(span, (surface, form_of(lane)), &forms.lane(lane), wanted)?;
        }
        Some(span)
    }

    /// Returns the part of an interval where a form has a sign, if that has any length; a form that is zero all along has
    /// it where its border counts.
    #[inline]
    fn clipped(
        &self,
        span: Span,
        (surface, form): (SurfaceId, FaceForm),
        values: &Values,
        (wanted, is_closed): (Sign, bool),
    ) -> Option<Span> {
        let signs = match values.signs() {
            [Some(first), Some(last)] => [first, last],
            _ => self.ends.exact_signs(self.occluders, surface, form),
        };
        let signs = match (wanted, signs) {
            (Sign::Negative, [first, last]) => [first.flipped(), last.flipped()],
            (_, signs) => signs,
        };
        match signs {
            [Sign::Zero, Sign::Zero] => is_closed.then_some(span),
            [Sign::Positive, Sign::Zero | Sign::Positive] | [Sign::Zero, Sign::Positive] => {
                Some(span)
            }
            [Sign::Negative | Sign::Zero, Sign::Negative] | [Sign::Negative, Sign::Zero] => None,
            [Sign::Negative, Sign::Positive] => {
                let border = self.ends.border(self.occluders, surface, form, values);
                let compare = |one: &Border, other| self.ends.compare(self.occluders, one, other);
                if compare(&border, &span.end).is_ge() {
                    None
                } else if compare(&border, &span.begin).is_gt() {
                    Some(Span {
                        begin: border,
                        ..span
                    })
                } else {
                    Some(span)
                }
            }
            [Sign::Positive, Sign::Negative] => {
                let border = self.ends.border(self.occluders, surface, form, values);
                let compare = |one: &Border, other| self.ends.compare(self.occluders, one, other);
                if compare(&border, &span.begin).is_le() {
                    None
                } else if compare(&border, &span.end).is_lt() {
                    Some(Span {
                        end: border,
                        ..span
                    })
                } else {
                    Some(span)
                }
            }
        }
    }

    /// Writes the lit intervals in order, as shares of the length from the first point: each end is the number nearest to
    /// the exact one.
    ///
    /// # Errors
    /// A triangle with holes may shade a lit point and has no closed form, or there is a patch or an implicit surface: the one
    /// with the lowest number. Nothing is written then.
    pub fn finish(mut self, intervals: &mut Vec<[f64; 2]>) -> Result<(), SurfaceId> {
        let (occluders, ends, level) = (self.occluders, self.ends, self.level);
        let compare = |one: &Border, other: &Border| ends.compare(occluders, one, other);
        self.dark.merge(compare);
        if self.dark.is_all() {
            return Ok(());
        }
        let doubtful = self.doubtful.iter();
        let doubtful = doubtful.filter(|(span, _)| !self.dark.holds(span, compare));
        if let Some(lowest) = doubtful.map(|&(_, surface)| surface).min() {
            return Err(lowest);
        }
        let nearest = |border: &Border| ends.nearest_place(level, occluders, border);
        self.dark.for_each_gap(compare, |begin, end| {
            let gap = [nearest(begin), nearest(end)];
            if !self.known.is_dark_gap(gap) {
                intervals.push(gap);
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests;
