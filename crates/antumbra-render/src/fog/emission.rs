//! Directions in which a point shines, as a ray passes through them.
//!
//! A direction from the light to a point of the ray is `e cos(theta) + D sin(theta)`: `e` leads to the ray's nearest point, `D`
//! is the ray's direction. With `q = tan(pi / 4 + theta / 2)` all of it is rational in `q`.

use antumbra_geometry::DVec3;

use crate::cone;

/// How a point shines, by direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shine {
    /// In all directions alike.
    Even,
    /// Full inside a cone, nothing outside a wider one, and smooth between, as spots of the scene.
    Cone {
        /// Unit vector of the middle.
        axis: DVec3,
        /// Cosine of the half-angle inside which the light is full.
        inner_cosine: f64,
        /// Cosine of the half-angle outside which there is none.
        outer_cosine: f64,
    },
    /// By the cosine to a unit normal.
    Cosine {
        /// The normal.
        normal: DVec3,
        /// Whether the back shines, too.
        is_two_sided: bool,
    },
    /// By the sine to a unit axis.
    Sine {
        /// The axis.
        axis: DVec3,
    },
}

/// Share of a point's light that goes to each point of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    shine: Shine,
    /// Components of the axis along `e` and `D`.
    across: f64,
    along: f64,
}

/// Most places along a ray where what a point shines is not smooth.
pub(super) const MOST_BREAKS: usize = 4;

impl Beam {
    pub(super) fn new(shine: Shine, towards_nearest: DVec3, direction: DVec3) -> Self {
        let axis = match shine {
            Shine::Even => DVec3::ZERO,
            Shine::Cone { axis, .. } | Shine::Sine { axis } => axis,
            Shine::Cosine { normal, .. } => normal,
        };
        Self {
            shine,
            across: axis.dot(towards_nearest),
            along: axis.dot(direction),
        }
    }

    /// Returns the share of the light at a place of the ray, 0 to 1.
    pub(super) fn share(&self, q: f64) -> f64 {
        if self.shine == Shine::Even {
            return 1.0;
        }
        let square = q * q;
        let cosine = (2.0 * self.across * q + self.along * (square - 1.0)) / (square + 1.0);
        match self.shine {
            Shine::Even => 1.0,
            Shine::Cone {
                inner_cosine,
                outer_cosine,
                ..
            } => cone::share_at(cosine, inner_cosine, outer_cosine),
            Shine::Cosine { is_two_sided, .. } => {
                if is_two_sided {
                    cosine.abs()
                } else {
                    cosine.max(0.0)
                }
            }
            Shine::Sine { .. } => (1.0 - cosine * cosine).max(0.0).sqrt(),
        }
    }

    /// Returns the places above 0 where the share is not smooth, in order.
    pub(super) fn breaks(&self) -> impl Iterator<Item = f64> + use<> {
        let none = [f64::NAN; 2];
        let [first, second] = match self.shine {
            Shine::Even => [none; 2],
            Shine::Cone {
                inner_cosine,
                outer_cosine,
                ..
            } => [self.places_of(inner_cosine), self.places_of(outer_cosine)],
            Shine::Cosine { .. } => [self.places_of(0.0), none],
            Shine::Sine { .. } => [self.nearest_to_axis(), none],
        };
        let mut places: [f64; MOST_BREAKS] = [first[0], first[1], second[0], second[1]];
        places.sort_by(f64::total_cmp);
        places
            .into_iter()
            .filter(|&place| place > 0.0 && place.is_finite())
    }

    /// Returns where the cosine to the axis has a value: roots of
    /// `(along - cosine) q^2 + 2 across q - (along + cosine)`.
    fn places_of(&self, cosine: f64) -> [f64; 2] {
        let square = self.across * self.across + (self.along - cosine) * (self.along + cosine);
        if square.is_nan() || square < 0.0 {
            return [f64::NAN; 2];
        }
        // The sum that does not cancel, and by the product of the roots the other one.
        let sum = -(self.across + square.sqrt().copysign(self.across));
        [sum / (self.along - cosine), -(self.along + cosine) / sum]
    }

    /// Returns where directions are nearest to the axis and to its opposite.
    fn nearest_to_axis(&self) -> [f64; 2] {
        // Where the cosine has its greatest and its least value: the derivative's roots.
        let length = (self.across * self.across + self.along * self.along).sqrt();
        let of = |across: f64, along: f64| {
            if along < 0.0 {
                across / (length - along)
            } else {
                (length + along) / across
            }
        };
        [of(self.across, self.along), of(-self.across, -self.along)]
    }
}
