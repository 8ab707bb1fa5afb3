//! Surfaces, lights and segments as the oracle has them.

use crate::exact::{Exact, Vec3};

/// The shape of one surface, as exact values of the given numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OracleShape {
    /// A triangle with the given corners; its winding decides where its front is.
    Triangle([[f64; 3]; 3]),
    /// A sphere.
    Sphere {
        /// Its centre.
        center: [f64; 3],
        /// Its radius, not negative.
        radius: f64,
    },
    /// The wall of a truncated cone or of a cylinder, without caps.
    Tube {
        /// The centre of one end.
        base: [f64; 3],
        /// The radius there, not negative.
        base_radius: f64,
        /// The centre of the other end.
        apex: [f64; 3],
        /// The radius there, not negative.
        apex_radius: f64,
    },
    /// A disk that stands alone.
    Disk {
        /// Its centre.
        center: [f64; 3],
        /// Its normal, of any length.
        normal: [f64; 3],
        /// Its radius, not negative.
        radius: f64,
    },
    /// The disk that closes a tube, exactly in the tube's end plane: its normal is
    /// `apex - base`, not rounded (at the base, the opposite).
    Cap {
        /// The base of the tube.
        base: [f64; 3],
        /// The apex of the tube.
        apex: [f64; 3],
        /// The radius of the tube at this end.
        radius: f64,
        /// Whether it closes the apex end.
        at_apex: bool,
    },
}

/// One surface of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleSurface {
    /// Position.
    pub shape: OracleShape,
    /// Whether it blocks light. A transparent surface only receives.
    pub opaque: bool,
    /// The closed cone it is part of. The parts of one closed cone carry the same number, which
    /// no other surface carries.
    pub solid: Option<usize>,
}

impl OracleSurface {
    /// Makes an opaque surface that is no part of a closed cone.
    pub fn opaque(shape: OracleShape) -> Self {
        Self {
            shape,
            opaque: true,
            solid: None,
        }
    }

    /// Makes an opaque triangle.
    pub fn triangle(corners: [[f64; 3]; 3]) -> Self {
        Self::opaque(OracleShape::Triangle(corners))
    }

    /// Makes an opaque sphere.
    pub fn sphere(center: [f64; 3], radius: f64) -> Self {
        Self::opaque(OracleShape::Sphere { center, radius })
    }

    /// Makes an opaque tube without caps.
    pub fn open_tube(base: [f64; 3], base_radius: f64, apex: [f64; 3], apex_radius: f64) -> Self {
        Self::opaque(OracleShape::Tube {
            base,
            base_radius,
            apex,
            apex_radius,
        })
    }

    /// Makes the parts of an opaque closed cone: tube, base cap, apex cap, in this order; a cap
    /// of radius zero is left out. `solid` tells it from the other closed cones of the scene.
    pub fn closed_cone(
        solid: usize,
        base: [f64; 3],
        base_radius: f64,
        apex: [f64; 3],
        apex_radius: f64,
    ) -> Vec<Self> {
        let tube = OracleShape::Tube {
            base,
            base_radius,
            apex,
            apex_radius,
        };
        let caps = [(base_radius, false), (apex_radius, true)]
            .into_iter()
            .filter(|&(radius, _)| radius != 0.0)
            .map(|(radius, at_apex)| OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            });
        std::iter::once(tube)
            .chain(caps)
            .map(|shape| Self {
                shape,
                opaque: true,
                solid: Some(solid),
            })
            .collect()
    }

    /// Returns the surface letting all light through.
    pub fn transparent(self) -> Self {
        Self {
            opaque: false,
            ..self
        }
    }
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OracleLight {
    /// A point that shines in all directions.
    Point([f64; 3]),
    /// A light at infinity: the direction *towards* it, of any length but zero.
    Direction([f64; 3]),
}

/// The light with exact coordinates: `(position, 1)` or `(position, 0)` in the page's notation.
#[derive(Clone, Debug)]
pub(super) struct Light {
    pub(super) position: Vec3,
    pub(super) weight: Exact,
}

impl Light {
    pub(super) fn new(light: OracleLight) -> Self {
        match light {
            OracleLight::Point(point) => Self {
                position: Vec3::new(point),
                weight: Exact::ONE,
            },
            OracleLight::Direction(direction) => {
                let position = Vec3::new(direction);
                assert!(
                    !position.is_zero(),
                    "the direction towards a light must not be zero"
                );
                Self {
                    position,
                    weight: Exact::ZERO,
                }
            }
        }
    }

    pub(super) fn is_direction(&self) -> bool {
        self.weight.is_zero()
    }
}

/// A start with rational coordinates `scaled / scale`, `scale > 0`.
#[derive(Debug)]
pub(super) struct ReceiverPoint {
    pub(super) scaled: Vec3,
    pub(super) scale: Exact,
}

/// The open segment `x(v) = start + v (light - start)`, `0 < v < 1`, or the open ray
/// `x(v) = start + v light`, `0 < v`; everything times the start's scale:
/// `scale x(v) = start.scaled + v delta`. (On a ray the scale is put into `v`.)
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) start: ReceiverPoint,
    pub(super) delta: Vec3,
    pub(super) light: Light,
    /// Three times the centroid of the triangle that the start lies on.
    pub(super) own_centroid: Option<Vec3>,
}

impl Segment {
    pub(super) fn new(start: ReceiverPoint, light: Light, own_centroid: Option<Vec3>) -> Self {
        let delta = if light.is_direction() {
            light.position.clone()
        } else {
            &light.position.scale(&start.scale) - &start.scaled
        };
        Self {
            start,
            delta,
            light,
            own_centroid,
        }
    }

    /// The same segment with its start moved into its own triangle by a share of 2^-16000, which
    /// stands for an infinitely small one: every form over `f64`s that is not zero is larger than
    /// anything that the share could do to it.
    pub(super) fn nudged(&self) -> Option<Self> {
        let centroid = self.own_centroid.as_ref()?;
        let mut share = Exact::new(2.0_f64.powi(-1000));
        for _ in 0..4 {
            share = share.square();
        }
        let three = Exact::new(3.0);
        let scaled = self.start.scaled.scale(&three);
        let inwards = &centroid.scale(&self.start.scale) - &scaled;
        let start = ReceiverPoint {
            scaled: &scaled + &inwards.scale(&share),
            scale: &self.start.scale * &three,
        };
        Some(Self::new(start, self.light.clone(), None))
    }

    /// A copy of the segment with its start moved by `(e, e^2, e^3)`, `e` being 2^-20000: infinitely little even beside the share
    /// of [`Segment::nudged`], and each component beside the one before.
    pub(super) fn moved(&self) -> Self {
        let mut step = Exact::new(2.0_f64.powi(-1000));
        for _ in 0..4 {
            step = step.square();
        }
        let step = (0..4).fold(step, |step, _| &step * &Exact::new(2.0_f64.powi(-1000)));
        let squared = step.square();
        let steps = Vec3([step.clone(), squared.clone(), &squared * &step]);
        let start = ReceiverPoint {
            scaled: &self.start.scaled + &steps.scale(&self.start.scale),
            scale: self.start.scale.clone(),
        };
        Self::new(start, self.light.clone(), None)
    }
}
