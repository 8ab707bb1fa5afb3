//! Places on a segment where the shadow of a surface may begin or end.
//!
//! In: the segment and its light; which form of which surface is zero. Out: about where that is, which of two such places
//! comes first, and the share of the length that a place is, rounded once. Invariant: the order is exact; places are right to
//! their error.

use std::cmp::Ordering;

use fearless_simd::Level;
use glam::DVec3;

use super::linear::{Ends, FaceForm, Values, ordered};
use super::quadratic::Quadratic;
use super::quadric::{CurvedForm, Measured, Quadric};
use super::refined::Refined;
use super::surd::Surd;
use crate::number::{Exact, Number, Sign, UNIT_ROUNDOFF, Unrounded};
use crate::{Occluders, SurfaceId};

/// Places that err by more are computed exactly first.
const LARGEST_ERROR: f64 = 1.0 / (1_u64 << 36) as f64;

/// A zero of a form of the rule along the segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// The segment's own first end: no form.
    First,
    /// Its last end.
    Last,
    /// A linear form of a face.
    Face(SurfaceId, FaceForm),
    /// A form of a curved surface or a disk; of two zeros the last one, or not.
    Curved(SurfaceId, CurvedForm, bool),
}

/// A place on the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Border {
    /// Share of the length from the first end.
    pub(super) place: f64,
    pub(super) error: f64,
    form: Form,
}

impl Border {
    pub(super) const FIRST: Self = Self {
        place: 0.0,
        error: 0.0,
        form: Form::First,
    };
    pub(super) const LAST: Self = Self {
        place: 1.0,
        error: 0.0,
        form: Form::Last,
    };

    pub(super) fn is_first(&self) -> bool {
        self.form == Form::First
    }

    pub(super) fn is_last(&self) -> bool {
        self.form == Form::Last
    }
}

impl Ends {
    /// Returns the exact signs of a face's form at both ends, where rounded values leave a doubt.
    #[cold]
    #[inline(never)]
    pub(super) fn exact_signs(
        &self,
        occluders: &Occluders,
        surface: SurfaceId,
        form: FaceForm,
    ) -> [Sign; 2] {
        let corners = corners_of(occluders, surface);
        let [first, last] = self.values_in::<Unrounded>(corners, form);
        if let (Some(first), Some(last)) = (first.sign(), last.sign()) {
            return [first, last];
        }
        if let Some(signs) = self.doubled_signs(corners, form) {
            return signs;
        }
        self.values_in::<Exact>(corners, form)
            .map(|value| value.sign().unwrap_or(Sign::Zero))
    }

    /// Returns where a face's form with opposite signs at the ends is zero.
    #[inline]
    pub(super) fn border(
        &self,
        occluders: &Occluders,
        surface: SurfaceId,
        form: FaceForm,
        values: &Values,
    ) -> Border {
        let [a, b] = values.values;
        let length = a.abs() + b.abs();
        let error = values.errors[0].max(values.errors[1]);
        let place = a.abs() / length;
        // Both ends err by so much at most, and the quotient and the sum by a rounding each.
        let error = error / (length - 2.0 * error) * 1.001 + 4.0 * UNIT_ROUNDOFF * place;
        let form = Form::Face(surface, form);
        // Not for NaN.
        if (0.0..=LARGEST_ERROR).contains(&error) {
            Border { place, error, form }
        } else {
            self.exact_border(occluders, form)
        }
    }

    /// Returns where a form of a curved surface is zero, from about where it is.
    pub(super) fn curved_border(
        &self,
        occluders: &Occluders,
        surface: SurfaceId,
        form: CurvedForm,
        is_last: bool,
        share: Option<Refined>,
    ) -> Border {
        let form = Form::Curved(surface, form, is_last);
        if let Some(share) = share {
            let place = share.rounded();
            let error = share.error() + UNIT_ROUNDOFF * place.abs();
            // Not for NaN.
            if (0.0..=LARGEST_ERROR).contains(&error) {
                return Border { place, error, form };
            }
        }
        self.exact_border(occluders, form)
    }

    #[cold]
    #[inline(never)]
    fn exact_border(&self, occluders: &Occluders, form: Form) -> Border {
        let place = self.exact_place(occluders, form);
        Border {
            place,
            error: UNIT_ROUNDOFF * place + f64::MIN_POSITIVE,
            form,
        }
    }

    fn exact_place(&self, occluders: &Occluders, form: Form) -> f64 {
        match form {
            Form::First => 0.0,
            Form::Last => 1.0,
            Form::Face(surface, form) => {
                let [a, b] = self.values_in::<Exact>(corners_of(occluders, surface), form);
                a.over_to_nearest(&a.minus(&b))
            }
            Form::Curved(surface, form, is_last) => {
                let form = self.curved_form::<Exact>(occluders, surface, form);
                form.zero(is_last).nearest_share()
            }
        }
    }

    /// Returns the number nearest to where a border is.
    pub(super) fn nearest_place(
        &self,
        level: Level,
        occluders: &Occluders,
        border: &Border,
    ) -> f64 {
        let rounded = match border.form {
            Form::First | Form::Last => None,
            Form::Face(surface, form) => {
                self.rounded_share(level, corners_of(occluders, surface), form)
            }
            Form::Curved(surface, form, is_last) => {
                let form = self.curved_form::<Refined>(occluders, surface, form);
                form.pattern()
                    .and_then(|pattern| form.shares(pattern.zeros)[usize::from(is_last)]?.nearest())
            }
        };
        rounded.unwrap_or_else(|| self.exact_place(occluders, border.form))
    }

    /// Returns which of two borders is nearer to the first end.
    #[inline]
    pub(super) fn compare(&self, occluders: &Occluders, one: &Border, other: &Border) -> Ordering {
        let difference = one.place - other.place;
        // The difference of two shares is rounded by less than 2^-53.
        let doubt = one.error + other.error + UNIT_ROUNDOFF;
        if difference > doubt {
            Ordering::Greater
        } else if -difference > doubt {
            Ordering::Less
        } else if one.form == other.form || is_one_edge(occluders, one.form, other.form) {
            Ordering::Equal
        } else {
            self.compare_exactly(occluders, one.form, other.form)
        }
    }

    #[cold]
    #[inline(never)]
    fn compare_exactly(&self, occluders: &Occluders, one: Form, other: Form) -> Ordering {
        // Zeros are strictly between the ends.
        let rank = |form| match form {
            Form::First => 0,
            Form::Face(..) | Form::Curved(..) => 1,
            Form::Last => 2,
        };
        rank(one).cmp(&rank(other)).then_with(|| {
            let zeros = (self.zero(occluders, one), self.zero(occluders, other));
            match zeros {
                (Some(one), Some(other)) => one.compare(&other),
                // Both are one end.
                _ => Ordering::Equal,
            }
        })
    }

    /// Returns the exact zero of a form; `None` for the segment's ends.
    fn zero(&self, occluders: &Occluders, form: Form) -> Option<Surd> {
        match form {
            Form::First | Form::Last => None,
            Form::Face(surface, form) => {
                let [first, last] = self.values_in::<Exact>(corners_of(occluders, surface), form);
                Some(Surd::quotient(&first, &last))
            }
            Form::Curved(surface, form, is_last) => {
                let form = self.curved_form::<Exact>(occluders, surface, form);
                Some(form.zero(is_last))
            }
        }
    }

    /// Returns a form of a curved surface.
    pub(super) fn curved_form<N: Measured>(
        &self,
        occluders: &Occluders,
        surface: SurfaceId,
        form: CurvedForm,
    ) -> Quadratic<N> {
        let shape = occluders.round_shape(surface);
        let shape = shape.expect("curved forms are those of curved surfaces");
        Quadric::new(&shape, self.points, self.light).form(form)
    }
}

fn corners_of(occluders: &Occluders, surface: SurfaceId) -> [DVec3; 3] {
    occluders
        .triangle_positions(surface)
        .expect("faces' borders are those of triangles")
}

/// Returns whether two forms are about the same edge, of two faces: nearly all ties are that.
fn is_one_edge(occluders: &Occluders, one: Form, other: Form) -> bool {
    let edges = (edge(occluders, one), edge(occluders, other));
    matches!(edges, (Some(one), Some(other)) if one == other)
}

/// Returns the edge that a form is about, in an order of its own.
fn edge(occluders: &Occluders, form: Form) -> Option<[DVec3; 2]> {
    let Form::Face(surface, FaceForm::Edge(corner)) = form else {
        return None;
    };
    let (corners, corner) = (corners_of(occluders, surface), usize::from(corner));
    Some(ordered(corners[corner], corners[(corner + 1) % 3]))
}
