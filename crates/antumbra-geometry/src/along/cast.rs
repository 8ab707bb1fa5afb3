//! The shadow that a curved surface or a disk casts on a segment.
//!
//! In: a segment with its light, a surface. Out: the spans that it shades. Invariant: in each piece between zeros of its forms
//! the rule of EXACTNESS.md ("Which surfaces block") is asked of the exact signs there. So what is said is the rule's own
//! answer, single points apart, whatever place light and segment have: in the solid, on it, along it.

use super::border::Border;
use super::cells::{Track, for_each_cell};
use super::dark::Span;
use super::linear::Ends;
use super::quadratic::{Pattern, Zeros};
use super::quadric::{CurvedForm, End, Plane, Quadric};
use super::refined::Refined;
use crate::number::{Exact, Sign};
use crate::occluders::RoundShape;
use crate::{Cone, Occluders, SurfaceId};

/// A surface above a segment.
pub(super) struct Cast<'a> {
    ends: &'a Ends,
    occluders: &'a Occluders,
    surface: SurfaceId,
    refined: Quadric<Refined>,
}

/// The points that a line through start and light has between the end planes of a tube.
struct Clipped {
    start: End,
    light: End,
    /// Whether the crossing with a plane was multiplied with a height below zero.
    is_flipped: [bool; 2],
}

/// Returns the spans that a surface shades, which may touch each other.
pub(super) fn for_each_shadow(
    ends: &Ends,
    occluders: &Occluders,
    surface: SurfaceId,
    mut visit: impl FnMut(Span),
) {
    let Some(shape) = occluders.round_shape(surface) else {
        return;
    };
    let cast = Cast {
        ends,
        occluders,
        surface,
        refined: Quadric::new(&shape, ends.points, ends.light),
    };
    match shape {
        RoundShape::Ball(_) => cast.ball(&mut visit),
        RoundShape::Disk(_) => cast.disk(&mut visit),
        RoundShape::Tube(cone) => cast.tube(&cone, &mut visit),
    }
}

impl Cast<'_> {
    fn ball(&self, visit: &mut impl FnMut(Span)) {
        let inside = self.track(CurvedForm::Product(End::Start, End::Start));
        let side = self.track(CurvedForm::Product(End::Start, End::Light));
        let c = self.sign(CurvedForm::Product(End::Light, End::Light));
        let discriminant = self.track(CurvedForm::Discriminant);
        self.cells(
            [&inside, &side, &discriminant],
            &Span::WHOLE,
            |span, signs| {
                let [a, b, discriminant] = signs;
                let is_end_outside = a.is_positive() || c.is_positive();
                let is_end_inside = a.is_negative() || c.is_negative();
                let dips = b.is_negative() && discriminant.is_positive();
                if is_end_outside && (is_end_inside || dips) {
                    visit(span);
                }
            },
        );
    }

    fn disk(&self, visit: &mut impl FnMut(Span)) {
        let light = self.sign(CurvedForm::LightHeight(Plane::Base));
        if light == Sign::Zero {
            return;
        }
        let height = self.track(CurvedForm::Height(Plane::Base));
        let beyond_rim = self.track(CurvedForm::Product(
            End::At(Plane::Base),
            End::At(Plane::Base),
        ));
        self.cells([&height, &beyond_rim], &Span::WHOLE, |span, signs| {
            let [height, beyond_rim] = signs;
            if height.is_opposite(light) && !beyond_rim.is_positive() {
                visit(span);
            }
        });
    }

    fn tube(&self, cone: &Cone, visit: &mut impl FnMut(Span)) {
        let planes = [Plane::Base, Plane::Apex];
        let heights = planes.map(|plane| self.track(CurvedForm::Height(plane)));
        let of_light = planes.map(|plane| self.sign(CurvedForm::LightHeight(plane)));
        self.cells(
            [&heights[0], &heights[1]],
            &Span::WHOLE,
            |span, of_start| {
                if let Some(clipped) = Clipped::new(of_start, of_light) {
                    self.clipped_tube(cone, &clipped, &span, visit);
                }
            },
        );
    }

    /// Visits what a tube shades of a span in which the line to the light crosses the same end planes.
    fn clipped_tube(
        &self,
        cone: &Cone,
        clipped: &Clipped,
        span: &Span,
        visit: &mut impl FnMut(Span),
    ) {
        let Clipped { start, light, .. } = *clipped;
        let a = self.track(CurvedForm::Product(start, start));
        let b = self.track(CurvedForm::Product(start, light));
        let c = self.track(CurvedForm::Product(light, light));
        let discriminant = self.track(CurvedForm::Discriminant);
        let is_b_flipped = clipped.is_flipped[0] != clipped.is_flipped[1];
        // Only where a line goes through a rim all along does it matter whether it touches the wall there.
        let touch = [
            (Plane::Base, cone.base_radius),
            (Plane::Apex, cone.apex_radius),
        ];
        let touch = touch.map(|(plane, radius)| {
            let is_in_rim =
                |end, track: &Track| end == End::At(plane) && track.before == Sign::Zero;
            let is_in_rim = is_in_rim(start, &a) || is_in_rim(light, &c);
            is_in_rim.then(|| {
                let at = if radius == 0.0 {
                    End::Direction
                } else {
                    End::At(plane)
                };
                (self.track(CurvedForm::Product(at, End::Direction)), radius)
            })
        });
        let none = Track {
            before: Sign::Zero,
            zeros: [None; 2],
        };
        let [base, apex] = touch
            .each_ref()
            .map(|touch| touch.as_ref().map_or(&none, |(track, _)| track));
        self.cells(
            [&a, &b, &c, &discriminant, base, apex],
            span,
            |span, signs| {
                let [a, mut b, c, discriminant, base, apex] = signs;
                if is_b_flipped {
                    b = b.flipped();
                }
                let takes = |wanted: Sign| {
                    a == wanted || c == wanted || (b == wanted && discriminant.is_positive())
                };
                let crosses_rim = touch
                    .iter()
                    .zip([base, apex])
                    .any(|(touch, sign)| match touch {
                        None => false,
                        Some((_, 0.0)) => sign.is_negative(),
                        Some(_) => sign != Sign::Zero,
                    });
                if takes(Sign::Negative) && takes(Sign::Positive) || crosses_rim {
                    visit(span);
                }
            },
        );
    }

    fn cells<const FORMS: usize>(
        &self,
        tracks: [&Track; FORMS],
        within: &Span,
        visit: impl FnMut(Span, [Sign; FORMS]),
    ) {
        let compare = |one: &Border, other: &Border| self.ends.compare(self.occluders, one, other);
        for_each_cell(tracks, within, compare, visit);
    }

    /// Returns the sign of a form that does not depend on the place.
    fn sign(&self, form: CurvedForm) -> Sign {
        self.track(form).before
    }

    fn track(&self, form: CurvedForm) -> Track {
        let refined = self.refined.form(form);
        let pattern = refined.pattern();
        let Pattern { before, zeros } = pattern.unwrap_or_else(|| self.exact_pattern(form));
        let shares = match pattern {
            Some(_) => refined.shares(zeros),
            None => [None; 2],
        };
        let count = match zeros {
            Zeros::None => 0,
            Zeros::Rational | Zeros::One => 1,
            Zeros::Two => 2,
        };
        let border = |number: usize| {
            (number < count).then(|| {
                let (share, is_last) = (shares[number], number == 1);
                self.ends
                    .curved_border(self.occluders, self.surface, form, is_last, share)
            })
        };
        Track {
            before,
            zeros: [border(0), border(1)],
        }
    }

    #[cold]
    #[inline(never)]
    fn exact_pattern(&self, form: CurvedForm) -> Pattern {
        let exact = self
            .ends
            .curved_form::<Exact>(self.occluders, self.surface, form);
        exact
            .pattern()
            .expect("exact arithmetic always knows the sign")
    }
}

impl Clipped {
    /// Cuts the line from a start to a light at the end planes, over or under which both are; `None` where no more than a
    /// point is between them.
    fn new(of_start: [Sign; 2], of_light: [Sign; 2]) -> Option<Self> {
        let mut clipped = Self {
            start: End::Start,
            light: End::Light,
            is_flipped: [false; 2],
        };
        for (number, plane) in [Plane::Base, Plane::Apex].into_iter().enumerate() {
            // A point of the base plane is under the apex plane.
            let at = |end: End, of_end: [Sign; 2]| match end {
                End::At(_) => Sign::Positive,
                _ => of_end[number],
            };
            let at_start = at(clipped.start, of_start);
            let at_light = at(clipped.light, of_light);
            match (at_start, at_light) {
                // A line in an end plane keeps all of itself.
                (Sign::Zero, Sign::Zero) => {}
                (Sign::Negative | Sign::Zero, Sign::Negative | Sign::Zero) => return None,
                (Sign::Negative, Sign::Positive) => clipped.start = End::At(plane),
                (Sign::Positive, Sign::Negative) => clipped.light = End::At(plane),
                _ => continue,
            }
            clipped.is_flipped[number] = (clipped.start == End::At(plane)
                || clipped.light == End::At(plane))
                && of_light[number].is_negative();
        }
        Some(clipped)
    }
}
