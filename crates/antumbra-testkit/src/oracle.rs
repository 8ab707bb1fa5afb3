//! The brute-force oracle: `EXACTNESS.md` in exact rational arithmetic.
//!
//! In: surfaces, starts and lights as plain `f64` data. Out: the answer the contract defines.
//! Every surface is tested, nothing is rounded, and no code is shared with the library: the
//! formulas are other ones than those of the page wherever that is possible (the segment is
//! parametrised, quadrics are decided by signs at interval ends and at the vertex of a parabola),
//! so that a slip in either shows up as a difference.
//!
//! Where the page leaves a case open, the oracle decides it as follows:
//!
//! * a query from a degenerate surface (zero area, zero radius, zero normal, base = apex) is a
//!   free query, and such a surface has no sides ([`Oracle::light_side`] is 0);
//! * the parts of one closed cone are all opaque or all transparent;
//! * a direction is not zero, and no radius is negative.

mod along;
#[cfg(test)]
mod laws;
mod locate;
#[cfg(test)]
mod page;
mod place;
mod planar;
mod point;
mod quadric;
mod share;
mod surface;

pub use place::OraclePlace;
pub use point::OraclePoint;
pub use share::OracleShare;

use crate::exact::{Exact, Vec3};
use planar::{Disk, Triangle};
use quadric::{Sphere, Tube};
use surface::{Light, ReceiverPoint, Segment};
pub use surface::{OracleLight, OracleShape, OracleSurface};

/// What a surface is to the rules.
#[derive(Debug)]
enum Prepared {
    /// Degenerate: never blocks, is never hit.
    Nothing,
    Triangle(Box<Triangle>),
    Disk(Box<Disk>),
    Sphere(Box<Sphere>),
    Tube(Box<Tube>),
}

impl Prepared {
    fn new(shape: &OracleShape) -> Self {
        match *shape {
            OracleShape::Triangle(corners) => {
                Triangle::new(corners).map(|triangle| Self::Triangle(Box::new(triangle)))
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => Disk::new(Vec3::new(center), Vec3::new(normal), radius)
                .map(|disk| Self::Disk(Box::new(disk))),
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => {
                let (base, apex) = (Vec3::new(base), Vec3::new(apex));
                let (inner, outer) = if at_apex { (base, apex) } else { (apex, base) };
                let normal = &outer - &inner;
                Disk::new(outer, normal, radius).map(|disk| Self::Disk(Box::new(disk)))
            }
            OracleShape::Sphere { center, radius } => {
                Sphere::new(center, radius).map(|sphere| Self::Sphere(Box::new(sphere)))
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => Tube::new(base, base_radius, apex, apex_radius)
                .map(|tube| Self::Tube(Box::new(tube))),
        }
        .unwrap_or(Self::Nothing)
    }

    /// The numbers by whose signs a free query is decided, and more. Each is a polynomial of the start, of degree two at most
    /// along a line, for a start of scale one.
    fn decisive(&self, segment: &Segment) -> Vec<Exact> {
        match self {
            Self::Nothing => Vec::new(),
            Self::Triangle(triangle) => triangle.decisive(segment),
            Self::Disk(disk) => disk.decisive(segment),
            Self::Sphere(sphere) => sphere.decisive(segment),
            Self::Tube(tube) => tube.decisive(segment),
        }
    }
}

/// Answers queries against a list of surfaces by the letter of `EXACTNESS.md`.
///
/// Surfaces are named by their index in the list. The cost of a query is that of testing every
/// surface, from a fraction of a microsecond (lattice coordinates) to some microseconds each.
///
/// ```
/// use antumbra_testkit::oracle::{Oracle, OracleLight, OracleSurface};
///
/// let roof = OracleSurface::triangle([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]]);
/// let oracle = Oracle::new(vec![roof]);
/// let up = OracleLight::Direction([0.0, 0.0, 1.0]);
/// assert!(oracle.is_blocked([1.0, 1.0, 0.0], None, up));
/// assert!(!oracle.is_blocked([1.0, 1.0, 0.5], Some(0), up));
/// assert!(!oracle.is_blocked([3.0, 3.0, 0.0], None, up));
/// ```
#[derive(Debug)]
pub struct Oracle {
    surfaces: Vec<OracleSurface>,
    prepared: Vec<Prepared>,
    /// For each surface the tube of its closed cone, if it is part of one.
    closed_tube: Vec<Option<usize>>,
}

impl Oracle {
    /// Prepares the given surfaces.
    ///
    /// # Panics
    ///
    /// When a number is not finite, a radius is negative, or the parts under one
    /// [`OracleSurface::solid`] number are not one tube and its caps with one opacity: that is a
    /// fault of the test that asks.
    pub fn new(surfaces: impl Into<Vec<OracleSurface>>) -> Self {
        let surfaces = surfaces.into();
        let prepared = surfaces
            .iter()
            .map(|surface| Prepared::new(&surface.shape))
            .collect();
        let closed_tube = (0..surfaces.len())
            .map(|part| tube_of_solid(&surfaces, part))
            .collect();
        Self {
            surfaces,
            prepared,
            closed_tube,
        }
    }

    /// The surfaces, in the order of their indices.
    pub fn surfaces(&self) -> &[OracleSurface] {
        &self.surfaces
    }

    /// Says whether the open segment from `point` on surface `surface` (`None`: from a point of
    /// space) to `light` is blocked by any opaque surface.
    ///
    /// # Panics
    ///
    /// When `surface` is no index of a surface, a number is not finite or a direction is zero.
    pub fn is_blocked(&self, point: [f64; 3], surface: Option<usize>, light: OracleLight) -> bool {
        let segment = self.segment(point, surface, light);
        (0..self.surfaces.len()).any(|t| self.blocks_segment(t, surface, &segment))
    }

    /// Says whether surface `t` alone blocks, to find out where two implementations part.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn blocks(
        &self,
        t: usize,
        point: [f64; 3],
        surface: Option<usize>,
        light: OracleLight,
    ) -> bool {
        self.blocks_segment(t, surface, &self.segment(point, surface, light))
    }

    /// Lists all surfaces that block.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn blockers(
        &self,
        point: [f64; 3],
        surface: Option<usize>,
        light: OracleLight,
    ) -> Vec<usize> {
        let segment = self.segment(point, surface, light);
        (0..self.surfaces.len())
            .filter(|&t| self.blocks_segment(t, surface, &segment))
            .collect()
    }

    /// The sign that says on which side of `surface` the light is: 1 in front or outside, -1
    /// behind or inside, 0 when edge-on or when the surface is degenerate.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn light_side(&self, point: [f64; 3], surface: usize, light: OracleLight) -> i8 {
        self.side(surface, &self.segment(point, Some(surface), light))
    }

    /// Lists all transparent surfaces that filter the light (EXACTNESS.md, "What glass lets through").
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn filters(
        &self,
        point: [f64; 3],
        surface: Option<usize>,
        light: OracleLight,
    ) -> Vec<usize> {
        let segment = self.segment(point, surface, light);
        let filters = |&t: &usize| {
            !self.surfaces[t].opaque
                && match &self.prepared[t] {
                    Prepared::Triangle(triangle) => {
                        surface != Some(t) && triangle.is_pierced(&segment)
                    }
                    _ => self.crosses_segment(t, surface, &segment),
                }
        };
        (0..self.surfaces.len()).filter(filters).collect()
    }

    fn segment(&self, point: [f64; 3], surface: Option<usize>, light: OracleLight) -> Segment {
        let point = Vec3::new(point);
        let own_centroid = match surface.map(|s| &self.prepared[s]) {
            Some(Prepared::Triangle(triangle)) => Some(triangle.three_centroids()),
            _ => None,
        };
        let start = match surface.map(|s| &self.prepared[s]) {
            Some(Prepared::Triangle(triangle)) => triangle.start(point),
            Some(Prepared::Disk(disk)) => disk.plane.start(point),
            _ => ReceiverPoint {
                scaled: point,
                scale: Exact::ONE,
            },
        };
        Segment::new(start, Light::new(light), own_centroid)
    }

    fn side(&self, s: usize, segment: &Segment) -> i8 {
        match &self.prepared[s] {
            Prepared::Nothing => 0,
            Prepared::Triangle(triangle) => triangle.plane.side_of_light(&segment.light),
            Prepared::Disk(disk) => disk.plane.side_of_light(&segment.light),
            Prepared::Sphere(sphere) => sphere.side(segment),
            Prepared::Tube(tube) => tube.side(segment),
        }
    }

    fn blocks_segment(&self, t: usize, surface: Option<usize>, segment: &Segment) -> bool {
        self.surfaces[t].opaque && self.crosses_segment(t, surface, segment)
    }

    fn crosses_segment(&self, t: usize, surface: Option<usize>, segment: &Segment) -> bool {
        if let Some(s) = surface
            && let Some(answer) = self.own_rule(t, s, segment)
        {
            return answer;
        }
        match &self.prepared[t] {
            Prepared::Nothing => false,
            Prepared::Triangle(triangle) => triangle.is_crossed(segment),
            Prepared::Disk(disk) => disk.is_crossed(segment),
            Prepared::Sphere(sphere) => sphere.is_crossed(segment),
            Prepared::Tube(tube) => tube.is_crossed(segment),
        }
    }

    /// The answer for `t` when it is `s`, or counts as one with it.
    fn own_rule(&self, t: usize, s: usize, segment: &Segment) -> Option<bool> {
        // Degenerate surfaces have no own rule: they block nothing anyway.
        if matches!(self.prepared[t], Prepared::Nothing) {
            return Some(false);
        }
        match (self.closed_tube[s], self.closed_tube[t]) {
            (Some(own), Some(other)) => {
                if self.surfaces[own].shape != self.surfaces[other].shape {
                    return None;
                }
                let Prepared::Tube(tube) = &self.prepared[own] else {
                    return Some(false);
                };
                let is_behind = if s == own {
                    tube.is_behind_wall(segment)
                } else {
                    self.side(s, segment) < 0
                };
                let is_empty = !segment.light.is_direction() && segment.delta.is_zero();
                Some(is_behind && !is_empty && tube.solid_excludes_light(segment))
            }
            (None, None) => match &self.prepared[t] {
                Prepared::Sphere(sphere) if self.surfaces[s].shape == self.surfaces[t].shape => {
                    Some(self.side(s, segment) < 0 && sphere.excludes_light(segment))
                }
                Prepared::Tube(tube) if self.surfaces[s].shape == self.surfaces[t].shape => {
                    Some(tube.is_crossed_again(segment))
                }
                _ if s == t => Some(false),
                _ => None,
            },
            _ => None,
        }
    }
}

/// The tube of the closed cone that surface `part` belongs to.
fn tube_of_solid(surfaces: &[OracleSurface], part: usize) -> Option<usize> {
    let solid = surfaces[part].solid?;
    let parts = || {
        surfaces
            .iter()
            .enumerate()
            .filter(move |(_, other)| other.solid == Some(solid))
    };
    let tubes: Vec<_> = parts()
        .filter(|(_, p)| matches!(p.shape, OracleShape::Tube { .. }))
        .collect();
    assert_eq!(tubes.len(), 1, "closed cone {solid} must have one tube");
    let (tube, OracleSurface { shape, opaque, .. }) = tubes[0];
    let OracleShape::Tube {
        base,
        base_radius,
        apex,
        apex_radius,
    } = *shape
    else {
        return None;
    };
    for (_, other) in parts() {
        assert_eq!(
            other.opaque, *opaque,
            "closed cone {solid} must have one opacity"
        );
        match other.shape {
            OracleShape::Tube { .. } => {}
            OracleShape::Cap {
                base: b,
                apex: a,
                radius,
                at_apex,
            } => {
                let end_radius = if at_apex { apex_radius } else { base_radius };
                assert!(
                    b == base && a == apex && radius == end_radius,
                    "closed cone {solid} has a cap that is not an end of its tube"
                );
            }
            _ => panic!("closed cone {solid} has a part that is neither tube nor cap"),
        }
    }
    Some(tube)
}
