//! Lights and starts, aimed at ties.

use rand::RngExt;

use super::{Frame, Nasty, NastyQuery};
use crate::build::{lerp, nudged};
use crate::oracle::{OracleLight, OracleShape, OracleSurface};

impl Nasty {
    /// The `i`-th light of a scene: the kinds take turns, from a random one on.
    pub(super) fn light(
        &mut self,
        i: usize,
        surfaces: &[OracleSurface],
        frame: Frame,
    ) -> OracleLight {
        let kind = (self.below(4) + 3 * i) % 12;
        let near = |rng: &mut Self| {
            let corner = rng.corner_of_any(surfaces);
            let reach = frame.scale();
            [0, 1, 2].map(|i| corner[i] + rng.real(-1.0, 1.0) * reach)
        };
        match kind {
            // above and outside
            0 | 1 => OracleLight::Point(frame.place([
                self.real(-9.0, 9.0),
                self.real(-9.0, 9.0),
                self.real(4.0, 20.0),
            ])),
            2 => {
                let point = self.lattice_point(-6, 6);
                OracleLight::Point(frame.place([point[0], point[1], point[2].abs() + 3.0]))
            }
            3 => OracleLight::Point(frame.place(self.lattice_point(-2, 4))),
            // directions
            4 => {
                let mut direction = [0.0; 3];
                let axis = self.pick(&[2, 2, 1, 0]);
                direction[axis] = self.pick(&[1.0, -1.0, 0.1]);
                OracleLight::Direction(direction)
            }
            5 => OracleLight::Direction([
                self.real(-1.0, 1.0),
                self.real(-1.0, 1.0),
                self.real(1e-3, 1.0),
            ]),
            6 => OracleLight::Direction([self.integer(-2, 2), self.integer(-2, 2), 1.0]),
            // inside the scene, next to something
            7 => OracleLight::Point(near(self)),
            // on a surface, or in its plane
            8 => OracleLight::Point(self.point_on(surfaces, true)),
            9 => OracleLight::Point(self.point_on(surfaces, false)),
            // on an edge or an axis, extended
            10 => {
                let (a, b) = self.line_of_any(surfaces);
                OracleLight::Point(lerp(a, b, self.pick(&[2.0, 3.0, -1.0, 1.5, 0.5])))
            }
            _ => {
                let (a, b) = self.line_of_any(surfaces);
                let direction = [0, 1, 2].map(|i| b[i] - a[i]);
                let usable = direction.iter().any(|&x| x != 0.0);
                OracleLight::Direction(if usable { direction } else { [0.0, 0.0, 1.0] })
            }
        }
    }

    /// Two points that span an edge, an axis, or a radius.
    fn line_of_any(&mut self, surfaces: &[OracleSurface]) -> ([f64; 3], [f64; 3]) {
        match self.pick(surfaces).shape {
            OracleShape::Triangle(corners) => {
                let i = self.below(3);
                (corners[i], corners[(i + 1) % 3])
            }
            OracleShape::Tube { base, apex, .. } | OracleShape::Cap { base, apex, .. } => {
                if self.chance(0.5) {
                    (base, apex)
                } else {
                    (apex, base)
                }
            }
            OracleShape::Sphere { center, radius } => {
                (center, [center[0], center[1], center[2] + radius])
            }
            OracleShape::Disk { center, normal, .. } => {
                (center, [0, 1, 2].map(|i| center[i] + normal[i]))
            }
        }
    }

    /// A point that the data of some surface names.
    fn corner_of_any(&mut self, surfaces: &[OracleSurface]) -> [f64; 3] {
        match self.pick(surfaces).shape {
            OracleShape::Triangle(corners) => self.pick(&corners),
            OracleShape::Tube { base, apex, .. } | OracleShape::Cap { base, apex, .. } => {
                self.pick(&[base, apex])
            }
            OracleShape::Sphere { center, .. } | OracleShape::Disk { center, .. } => center,
        }
    }

    fn point_on(&mut self, surfaces: &[OracleSurface], inside: bool) -> [f64; 3] {
        let surface = self.pick(surfaces);
        self.point_on_shape(&surface.shape, inside)
    }

    /// A point of a surface, rounded as a renderer rounds it; not `inside`, also one of the plane
    /// or quadric beyond the surface.
    fn point_on_shape(&mut self, shape: &OracleShape, inside: bool) -> [f64; 3] {
        let reach = if inside { 1.0 } else { 3.0 };
        // a point of the unit circle, often a rational one
        let (cosine, sine) = match self.below(4) {
            0 => self.pick(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]),
            1 => self.pick(&[(0.6, 0.8), (-0.8, 0.6)]),
            _ => {
                let t = self.real(-2.0, 2.0);
                ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t))
            }
        };
        match *shape {
            OracleShape::Triangle([a, b, c]) => {
                let (mut u, mut v) = match self.below(8) {
                    0 => (0.0, 0.0),                 // a corner
                    1 => (1.0, 0.0),                 // another
                    2 => (self.real(0.0, 1.0), 0.0), // an edge
                    3 => (0.0, self.real(0.0, 1.0)), // another
                    4 => (0.5, 0.5),                 // the middle of the third
                    5 => {
                        let u = self.real(0.0, 1.0);
                        (u, 1.0 - u) // the third, rounded
                    }
                    _ => (self.real(0.0, 1.0), self.real(0.0, 1.0)),
                };
                if u + v > 1.0 + 1e-9 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                (u, v) = (u * reach, v * reach);
                [0, 1, 2].map(|i| a[i] * (1.0 - u - v) + b[i] * u + c[i] * v)
            }
            OracleShape::Sphere { center, radius } => {
                let z = self.pick(&[0.0, 1.0, -1.0, 0.6, 0.28]);
                let z = if self.chance(0.5) {
                    z
                } else {
                    self.real(-1.0, 1.0)
                };
                let ring = (1.0 - z * z).sqrt();
                let unit = [ring * cosine, ring * sine, z];
                [0, 1, 2].map(|i| center[i] + radius * unit[i] * reach)
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let t = if self.chance(0.3) {
                    self.pick(&[0.0, 1.0])
                } else {
                    self.real(0.0, 1.0)
                };
                let t = t * reach;
                let radius = base_radius + (apex_radius - base_radius) * t;
                on_circle(
                    lerp(base, apex, t),
                    base,
                    apex,
                    radius * cosine,
                    radius * sine,
                )
            }
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => {
                let center = if at_apex { apex } else { base };
                let r = self.pick(&[0.0, 0.5, 1.0, 1.0]);
                let r = radius
                    * reach
                    * if self.chance(0.5) {
                        r
                    } else {
                        self.real(0.0, 1.0)
                    };
                on_circle(center, base, apex, r * cosine, r * sine)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let r = self.pick(&[0.0, 1.0]);
                let r = radius
                    * reach
                    * if self.chance(0.3) {
                        r
                    } else {
                        self.real(0.0, 1.0)
                    };
                on_circle(center, [0.0; 3], normal, r * cosine, r * sine)
            }
        }
    }

    pub(super) fn query(&mut self, surfaces: &[OracleSurface], frame: Frame) -> NastyQuery {
        // Scenes of few shapes on many tiles would ask about tiles only.
        let triangle_count =
            surfaces.partition_point(|s| matches!(s.shape, OracleShape::Triangle(_)));
        let surface = if triangle_count < surfaces.len() && self.chance(0.6) {
            self.0.random_range(triangle_count..surfaces.len())
        } else {
            self.below(surfaces.len())
        };
        let mut point = self.point_on_shape(&surfaces[surface].shape, true);
        match self.below(8) {
            // one ulp off
            0 | 1 => {
                let axis = self.below(3);
                let up = self.chance(0.5);
                NastyQuery {
                    point: nudged(point, axis, up),
                    surface: Some(surface),
                }
            }
            // a point of space on or next to a surface
            2 => {
                if self.chance(0.5) {
                    point = nudged(point, self.below(3), self.chance(0.5));
                }
                NastyQuery {
                    point,
                    surface: None,
                }
            }
            // a point of space, also of the lattice
            3 => {
                let point = if self.chance(0.5) {
                    self.lattice_point(-3, 3)
                } else {
                    self.any_point(-5.0, 5.0)
                };
                NastyQuery {
                    point: frame.place(point),
                    surface: None,
                }
            }
            _ => NastyQuery {
                point,
                surface: Some(surface),
            },
        }
    }
}

/// The point `center + x u + y v` with `u`, `v` orthonormal to `to - from` up to rounding.
fn on_circle(center: [f64; 3], from: [f64; 3], to: [f64; 3], x: f64, y: f64) -> [f64; 3] {
    let axis = [0, 1, 2].map(|i| to[i] - from[i]);
    let largest = axis.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if largest == 0.0 {
        return center;
    }
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let unit = |a: [f64; 3]| {
        let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        a.map(|c| c / length)
    };
    let axis = unit(axis.map(|c| c / largest));
    // The axis that is least like the tube's own; for an upright tube u, v are x, y.
    let helper = if axis[0].abs() <= axis[2].abs() {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let v = unit(cross(axis, helper));
    let u = cross(v, axis);
    [0, 1, 2].map(|i| center[i] + x * u[i] + y * v[i])
}
