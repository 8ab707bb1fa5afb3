//! Fields whose zeros are surfaces: negative inside, positive outside.

use glam::DVec3;

use super::value::Value;

/// Largest sum of the exponents of a term.
pub const MAX_DEGREE: u32 = 12;

/// Most terms of a polynomial, and most balls of metaballs.
pub const MAX_TERMS: usize = 256;

/// A field of space.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Field {
    /// A ring: all points within `minor` of a circle.
    Torus {
        /// Middle of the circle, world space.
        center: DVec3,
        /// Axis of the circle, any length but zero.
        axis: DVec3,
        /// Radius of the circle, positive.
        major: f64,
        /// Radius of the tube, positive.
        minor: f64,
    },
    /// Balls that melt together: the sum of `strength (1 - d^2 / radius^2)^3` over those nearer than their radius is above the
    /// threshold inside.
    Metaballs {
        /// The balls, 1 to [`MAX_TERMS`].
        balls: Vec<Ball>,
        /// Threshold, positive.
        threshold: f64,
    },
    /// Schoen's minimal surface, as a wall that divides space in two: `sin x cos y + sin y cos z + sin z cos x` is below a level
    /// inside, with `x = TAU (px - cx) / period` and so on.
    Gyroid {
        /// A point of space where all three angles are zero.
        center: DVec3,
        /// Length after which it repeats, positive.
        period: f64,
        /// Level, -1.5 to 1.5; 0 halves space.
        level: f64,
    },
    /// A polynomial of the coordinates as seen from a point, in units of a length: `((px - cx) / unit)` and so on.
    Polynomial {
        /// Origin of its coordinates, world space.
        center: DVec3,
        /// Length of one of its units, positive.
        unit: f64,
        /// Its terms, 1 to [`MAX_TERMS`].
        terms: Vec<Term>,
    },
}

/// One of the metaballs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ball {
    /// Centre, world space.
    pub center: DVec3,
    /// Radius beyond which it has no influence, positive.
    pub radius: f64,
    /// Its value in the middle; negative ones dent.
    pub strength: f64,
}

/// A term of a polynomial: a factor times powers of x, y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Term {
    /// Factor.
    pub factor: f64,
    /// Exponents of x, y and z; their sum is at most [`MAX_DEGREE`].
    pub exponents: [u32; 3],
}

/// Coordinates that a field is computed in: axes, an origin and a factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    axes: [DVec3; 3],
    origin: DVec3,
    factor: f64,
}

impl Frame {
    pub(super) fn point(&self, point: DVec3) -> DVec3 {
        self.vector(point - self.origin)
    }

    pub(super) fn vector(&self, vector: DVec3) -> DVec3 {
        let [x, y, z] = self
            .axes
            .map(|axis| (axis.x * vector.x + axis.y * vector.y) + axis.z * vector.z);
        DVec3::new(x * self.factor, y * self.factor, z * self.factor)
    }

    /// Returns the world's vector of a gradient in these coordinates, up to its length.
    pub(super) fn outwards(&self, [x, y, z]: [f64; 3]) -> DVec3 {
        let [a, b, c] = self.axes;
        a * x + b * y + c * z
    }

    /// Returns how long one unit of these coordinates is.
    pub(super) fn unit(&self) -> f64 {
        1.0 / self.factor
    }
}

impl Field {
    pub(super) fn frame(&self) -> Frame {
        let (axes, origin, factor) = match self {
            Self::Torus {
                center,
                axis,
                minor,
                ..
            } => {
                let along = (*axis / axis.abs().max_element()).normalize();
                // Of the three axes of the world the one that is least along it; the first of equal ones.
                let size = along.abs();
                let least = match size.min_element() {
                    least if size.x == least => DVec3::X,
                    least if size.y == least => DVec3::Y,
                    _ => DVec3::Z,
                };
                let across = least.cross(along).normalize();
                let beside = along.cross(across);
                ([across, beside, along], *center, 1.0 / minor)
            }
            Self::Metaballs { balls, .. } => {
                let radius = balls
                    .iter()
                    .fold(0.0_f64, |most, ball| most.max(ball.radius));
                let origin = balls.first().map_or(DVec3::ZERO, |ball| ball.center);
                (DVec3::AXES, origin, 1.0 / radius)
            }
            Self::Gyroid { center, period, .. } => {
                (DVec3::AXES, *center, std::f64::consts::TAU / period)
            }
            Self::Polynomial { center, unit, .. } => (DVec3::AXES, *center, 1.0 / unit),
        };
        Frame {
            axes,
            origin,
            factor,
        }
    }

    /// Returns the field in its own coordinates, each operation rounded once and in the order written: that is the rule.
    pub(super) fn at<V: Value>(&self, [x, y, z]: [V; 3], frame: &Frame) -> V {
        match self {
            Self::Torus { major, .. } => {
                let from_axis = (x.squared() + y.squared()).root();
                let off = from_axis - V::constant(major * frame.factor);
                (off.squared() + z.squared()) - V::constant(1.0)
            }
            Self::Metaballs { balls, threshold } => {
                let mut left = V::constant(1.0);
                for ball in balls {
                    let center = frame.point(ball.center);
                    let radius = ball.radius * frame.factor;
                    let off = |x: V, center: f64| (x - V::constant(center)).squared();
                    let square = (off(x, center.x) + off(y, center.y)) + off(z, center.z);
                    let share = square.scaled(1.0 / (radius * radius));
                    let near = (V::constant(1.0) - share).not_negative();
                    left = left - (near.squared() * near).scaled(ball.strength / threshold);
                }
                left
            }
            Self::Gyroid { level, .. } => {
                let [xy, yz, zx] = [
                    x.sine() * y.cosine(),
                    y.sine() * z.cosine(),
                    z.sine() * x.cosine(),
                ];
                ((xy + yz) + zx) - V::constant(*level)
            }
            Self::Polynomial { terms, .. } => {
                let mut sum = V::constant(0.0);
                for Term { factor, exponents } in terms {
                    let [i, j, k] = *exponents;
                    let product = (power(x, i) * power(y, j)) * power(z, k);
                    sum = sum + product.scaled(*factor);
                }
                sum
            }
        }
    }

    /// Returns the size of a number of the field that matters: values this small a share of it count as zero.
    pub(super) fn scale(&self, extent: f64) -> f64 {
        match self {
            Self::Torus { .. } | Self::Gyroid { .. } => 1.0,
            Self::Metaballs { balls, threshold } => balls
                .iter()
                .fold(1.0, |most, ball| most.max(ball.strength.abs() / threshold)),
            Self::Polynomial { terms, .. } => {
                let size = |term: &Term| {
                    let degree: u32 = term.exponents.iter().sum();
                    term.factor.abs() * extent.powi(degree as i32)
                };
                terms.iter().map(size).fold(0.0, f64::max)
            }
        }
    }
}

fn power<V: Value>(x: V, exponent: u32) -> V {
    match exponent {
        0 => V::constant(1.0),
        1 => x,
        _ if exponent.is_multiple_of(2) => power(x, exponent / 2).squared(),
        _ => x * power(x, exponent - 1),
    }
}
