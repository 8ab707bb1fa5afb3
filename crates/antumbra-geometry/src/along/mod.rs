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

mod border;
mod cast;
mod cells;
mod dark;
mod double;
mod fan;
mod hull;
mod linear;
mod quadratic;
mod quadric;
mod refined;
mod surd;

use glam::DVec3;

use self::border::Border;
use self::cast::for_each_shadow;
use self::dark::{Dark, Span};
use self::fan::Fan;
use self::hull::Hull;
use self::linear::{Ends, FaceForm, Values};
use crate::number::Sign;
use crate::{LightShape, Occluders, SurfaceId};

/// More than what a box around a curved surface errs, as a share of its largest coordinate.
const BOX_ROOM: f64 = 1.0 / (1_u64 << 44) as f64;

/// A segment of points in space under a light without size, with the shadows that surfaces cast on it.
#[derive(Debug)]
pub struct SegmentShadows<'a> {
    occluders: &'a Occluders,
    ends: Ends,
    hull: Hull,
    fan: Option<Fan>,
    dark: Dark,
    /// Spans that triangles with holes may shade.
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
            hull: Hull::new(points, light),
            fan: Fan::new(points, light),
            dark: Dark::default(),
            doubtful: Vec::new(),
        }
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
        let fan = self.fan.as_ref();
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

    /// Returns whether the whole segment is known to be in shadow by now, so that no other surface matters.
    pub fn is_all_dark(&self) -> bool {
        self.dark.is_all()
    }

    /// Shows a surface. Each is to be shown once; in which order changes nothing, and those that no shadow ray from the
    /// segment meets may be left out.
    pub fn meet(&mut self, surface: SurfaceId) {
        let occluders = self.occluders;
        if !occluders.is_opaque(surface) {
            return;
        }
        let Some(corners) = occluders.triangle_positions(surface) else {
            if !self.misses_curved(surface) {
                let (ends, dark) = (self.ends, &mut self.dark);
                for_each_shadow(&ends, occluders, surface, |span| {
                    dark.add(span, |one, other| ends.compare(occluders, one, other));
                });
            }
            return;
        };
        if self.is_known(&corners)
            || self.hull.misses(&corners)
            || occluders.triangle_vertices(surface).is_none()
        {
            return;
        }
        let Some(span) = self.shaded_by(surface, corners) else {
            return;
        };
        if occluders.is_opaque_everywhere(surface) {
            self.dark
                .add(span, |one, other| self.ends.compare(occluders, one, other));
        } else {
            self.doubtful.push((span, surface));
        }
    }

    /// Returns whether the shadow of what is between some corners is surely beside the segment, or where it is dark.
    #[inline]
    fn is_known(&self, corners: &[DVec3]) -> bool {
        let reach = self.fan.as_ref().and_then(|fan| fan.reach(corners));
        reach.is_some_and(|[least, most]| {
            most < 0.0 || least > 1.0 || self.dark.covers([least, most])
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
    fn shaded_by(&self, surface: SurfaceId, corners: [DVec3; 3]) -> Option<Span> {
        let light_side = self.ends.light_side(corners);
        if light_side == Sign::Zero {
            return None;
        }
        // Points in shadow are on the other side of the plane, and on the light's side of all edges.
        let heights = self.ends.heights(corners);
        let behind = (light_side.flipped(), false);
        let height = (surface, FaceForm::Height);
        let mut span = self.clipped(Span::WHOLE, height, &heights, behind)?;
        for corner in 0..3 {
            let values = self.ends.sides(corners[corner], corners[(corner + 1) % 3]);
            let edge = (surface, FaceForm::Edge(corner as u8));
            span = self.clipped(span, edge, &values, (light_side, true))?;
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
        let signs = signs.map(|sign| {
            if wanted.is_negative() {
                sign.flipped()
            } else {
                sign
            }
        });
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
    /// A triangle with holes may shade a lit point and has no closed form: the one with the lowest number. Nothing is written
    /// then.
    pub fn finish(mut self, intervals: &mut Vec<[f64; 2]>) -> Result<(), SurfaceId> {
        let (occluders, ends) = (self.occluders, self.ends);
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
        let nearest = |border: &Border| ends.nearest_place(occluders, border);
        self.dark.for_each_gap(compare, |begin, end| {
            intervals.push([nearest(begin), nearest(end)]);
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests;
