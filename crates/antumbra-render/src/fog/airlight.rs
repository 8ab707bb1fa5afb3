//! Airlight of a point light along a ray.
//!
//! With `t0` the distance along the ray to the point nearest to the light, `h` its distance from the light, and `theta` the
//! angle at the light from that point, `t = t0 + h tan(theta)`: the equiangular substitution (Kulla and Fajardo 2012), in which
//! light that falls off has no peak. `q = tan(pi / 4 + theta / 2)` (Sun and others 2005, Pegoraro and Parker 2009) makes the rest simple:
//! the way of the light is `t + d = t0 + h q`, and the cosine of scattering `(1 - q^2) / (1 + q^2)`. Integrands then have
//! singularities at `q = 0` and on the imaginary axis only, so that panels from `q` to `2 q` all converge alike.

use antumbra_geometry::DVec3;

use super::emission::{Beam, Shine};
use super::medium::Fog;
use super::quadrature::integral;
use crate::vector::unit;

/// Most optical length of a panel: over more than that an exponential function is no polynomial of degree 23.
const LONGEST_PANEL: f64 = 4.0;

/// Optical length behind which nothing counts: e^-100 is less than what rounding leaves, however bright a phase function
/// makes it there.
const FAR: f64 = 100.0;

/// Optical length at which e to the power of its negative is zero.
const BLACK: f64 = 746.0;

/// Least distance of a ray from a point light, as a share of the lengths at hand: a ray right through a light that falls off would
/// see infinite light.
const NEAREST: f64 = 1.0 / (1 << 30) as f64;

/// Distance, as a share of the same, below which the direction from the light to the ray is rounding.
const UNCLEAR: f64 = NEAREST / 1024.0;

/// A point light as a ray passes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointView {
    /// Distance along the ray to the point nearest to the light; below 0 behind the origin.
    nearest: f64,
    /// Distance of the light from the line of the ray, above 0.
    distance: f64,
    falls_off: bool,
    beam: Beam,
}

impl PointView {
    /// Looks from `origin` along the unit vector `direction` over a `length` above 0.
    pub fn new(
        [origin, direction]: [DVec3; 2],
        length: f64,
        light: DVec3,
        shine: Shine,
        falls_off: bool,
    ) -> Self {
        let towards = light - origin;
        let nearest = towards.dot(direction);
        let off = direction * nearest - towards;
        let off = off - direction * off.dot(direction);
        let scale = towards.length().max(length);
        let distance = off.length();
        let towards_nearest = if distance > UNCLEAR * scale {
            unit(off).unwrap_or(DVec3::ZERO)
        } else {
            direction.any_orthonormal_vector()
        };
        Self {
            beam: Beam::new(shine, towards_nearest, direction),
            ..Self::of_lengths(nearest, distance.max(NEAREST * scale), falls_off)
        }
    }

    /// Looks past a light that shines in all directions alike.
    pub(super) fn of_lengths(nearest: f64, distance: f64, falls_off: bool) -> Self {
        Self {
            nearest,
            distance,
            falls_off,
            beam: Beam::new(Shine::Even, DVec3::ZERO, DVec3::ZERO),
        }
    }

    /// Returns whether the light shines on no part of the ray up to a length.
    pub fn is_dark(&self, length: f64) -> bool {
        let [first, last] = [0.0, length].map(|t| self.place(t));
        self.parts(first, last)
            .all(|[begin, end]| self.is_dark_between(begin, end))
    }

    /// Returns the airlight between two distances along the ray, for light of intensity 1, or of irradiance 1 everywhere if it
    /// does not fall off; the air weakens it on its way to the ray, and on to the origin.
    ///
    /// The rule's error is below 1e-9 of the value (`docs/fog.md`).
    pub fn airlight(&self, fog: &Fog, begin: f64, end: f64) -> f64 {
        let [first, last] = [begin, end].map(|t| self.place(t));
        let thickness = fog.extinction * self.distance;
        let start = fog.extinction * self.nearest + thickness * first;
        // Not for NaN.
        if !(first < last && thickness > 0.0 && start < BLACK) {
            return 0.0;
        }
        let last = last.min(first + FAR / thickness);
        let longest = LONGEST_PANEL / thickness;
        let forwards = (1.0 + fog.g) * (1.0 + fog.g);
        let backwards = (1.0 - fog.g) * (1.0 - fog.g);
        let integrand = |q: f64| {
            let square = q * q;
            let spread = (1.0 + square) / (forwards * square + backwards);
            let left = libm::exp(-fog.extinction * self.nearest - thickness * q);
            let weight = if self.falls_off {
                1.0 / (1.0 + square)
            } else {
                1.0 + 1.0 / square
            };
            spread * spread.sqrt() * left * weight * self.beam.share(q)
        };

        let mut sum = 0.0;
        for [mut begin, part_end] in self.parts(first, last) {
            if self.is_dark_between(begin, part_end) {
                continue;
            }
            while begin < part_end {
                let end = part_end.min(2.0 * begin).min(begin + longest);
                sum += integral(begin, end, integrand);
                begin = end;
            }
        }
        let scale = if self.falls_off {
            2.0 / self.distance
        } else {
            0.5 * self.distance
        };
        fog.extinction * fog.albedo * fog.phase_scale() * scale * sum
    }

    /// Returns `q` at a distance along the ray.
    fn place(&self, t: f64) -> f64 {
        let tangent = (t - self.nearest) / self.distance;
        let secant = (1.0 + tangent * tangent).sqrt();
        if tangent >= 0.0 {
            tangent + secant
        } else {
            1.0 / (secant - tangent)
        }
    }

    /// Cuts a stretch where the light's share is not smooth.
    fn parts(&self, first: f64, last: f64) -> impl Iterator<Item = [f64; 2]> + use<> {
        let between = move |&place: &f64| first < place && place < last;
        let ends = self.beam.breaks().filter(between).chain([last]);
        ends.scan(first, |begin, end| {
            Some([std::mem::replace(begin, end), end])
        })
    }

    /// Returns whether a part without breaks is dark.
    fn is_dark_between(&self, begin: f64, end: f64) -> bool {
        self.beam.share(begin + 0.5 * (end - begin)) == 0.0
    }
}
