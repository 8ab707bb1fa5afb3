//! The pyramid of a start and a light: surfaces outside of it hide nothing of the light.
//!
//! In: the start and the light's outline. Out: planes with the pyramid below them. Invariant: what is said to miss it
//! misses it. Which surfaces are said to is a function of start, light and surface alone, so that answers that depend
//! on it do not depend on the tree that found the surface.

use glam::DVec3;

use crate::Sphere;
use crate::segment::Segment;

/// Planes whose normals err by more are left out. Trees leave 2^-20 of the scene for that.
const LARGEST_ERROR: f64 = 1.0 / (1_u64 << 22) as f64;

/// Some roundings.
const ROUNDINGS: f64 = 1.0 / (1_u64 << 49) as f64;

/// A plane with the pyramid below it.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Unit length, outwards.
    normal: DVec3,
    point: DVec3,
    /// What a height errs per unit of distance from the point.
    error: f64,
}

/// The planes around a start and a light; none says anything where there are none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pyramid {
    sides: Vec<Side>,
    /// What the start and the outline's places err.
    offset: f64,
}

impl Pyramid {
    /// Makes the pyramid of a start and the corners of a convex outline in order: points, or directions.
    pub(super) fn new(segment: &Segment, outline: &[(DVec3, f64)]) -> Self {
        let apex = segment.origin();
        let largest = |v: DVec3| v.abs().max_element();
        let towards: Vec<DVec3> = outline
            .iter()
            .map(|&(place, weight)| unit(place - apex * weight))
            .collect();
        let middle = unit(towards.iter().sum());
        let is_known = |vector: &DVec3| vector.length_squared() > 0.5;
        if !towards.iter().all(is_known) || !is_known(&middle) {
            return Self::default();
        }
        // Places were rounded when they were made, and seen from nearby that turns more.
        let rounding =
            |&(place, weight): &(DVec3, f64)| (largest(place) + largest(apex)) * weight * ROUNDINGS;
        let turn = |place: &(DVec3, f64)| rounding(place) / largest(place.0 - apex * place.1);
        let turn = outline.iter().map(turn).fold(0.0, f64::max);
        let offset = outline.iter().map(rounding).fold(0.0, f64::max);
        let mut sides = Vec::new();
        let count = towards.len();
        if let [first, second] = towards[..] {
            sides = around_two(first, second, apex, turn);
        } else {
            for number in 0..count {
                let normal = towards[number].cross(towards[(number + 1) % count]);
                sides.extend(Side::new(normal, apex, middle, turn));
            }
        }
        if let &[(a, weight), (b, _), .., (c, _)] = outline
            && weight != 0.0
        {
            // Beyond the light nothing counts.
            let normal = unit(b - a).cross(unit(c - a));
            let edges = largest(b - a).min(largest(c - a));
            let turn = offset / edges;
            sides.extend(Side::new(normal, a, a - apex, turn).map(|side| Side {
                normal: -side.normal,
                ..side
            }));
        }
        Self {
            sides,
            offset: segment.origin_error() + offset,
        }
    }

    /// Returns whether the hull of some points surely misses the pyramid.
    pub(super) fn misses(&self, corners: &[DVec3]) -> bool {
        self.sides.iter().any(|side| {
            corners.iter().all(|&corner| {
                let from = corner - side.point;
                let room = side.error * from.abs().element_sum() + 2.0 * self.offset;
                side.normal.dot(from) > room
            })
        })
    }

    /// Returns whether a ball surely misses the pyramid.
    pub(super) fn misses_sphere(&self, sphere: &Sphere) -> bool {
        self.sides.iter().any(|side| {
            let from = sphere.center - side.point;
            let size = from.abs().element_sum() + sphere.radius;
            let room = side.error * size + 2.0 * self.offset;
            side.normal.dot(from) - sphere.radius > room
        })
    }

    /// Returns the planes: outward normals whose largest component is 1, and points on them.
    pub(crate) fn planes(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.sides
            .iter()
            .map(|side| (side.normal / side.normal.abs().max_element(), side.point))
    }

    /// Returns a bound on what the apex errs.
    pub(crate) fn offset(&self) -> f64 {
        self.offset
    }
}

impl Side {
    /// Makes a side with a vector on its inner side, from the product of two unit vectors that may be turned so far;
    /// nothing where that is in doubt.
    fn new(normal: DVec3, point: DVec3, inwards: DVec3, turn: f64) -> Option<Self> {
        let size = normal.length();
        let error = (ROUNDINGS + 2.0 * turn) / size;
        // Not for NaN.
        let is_fine = error <= LARGEST_ERROR;
        if !is_fine {
            return None;
        }
        let normal = normal / size;
        let inside = normal.dot(unit(inwards));
        if inside.abs() < 1e-6 {
            return None;
        }
        Some(Self {
            normal: if inside > 0.0 { -normal } else { normal },
            point,
            error,
        })
    }
}

/// The sides of a pyramid without width: its plane from both sides, and one through each of two unit vectors.
fn around_two(first: DVec3, second: DVec3, apex: DVec3, turn: f64) -> Vec<Side> {
    let normal = first.cross(second);
    let size = normal.length();
    let error = 2.0 * (ROUNDINGS + 2.0 * turn) / size;
    // Not for NaN.
    let is_fine = error <= LARGEST_ERROR;
    if !is_fine {
        return Vec::new();
    }
    let normal = normal / size;
    let across = |along: DVec3, other: DVec3| {
        let across = normal.cross(along);
        if across.dot(other) > 0.0 {
            -across
        } else {
            across
        }
    };
    [
        normal,
        -normal,
        across(first, second),
        across(second, first),
    ]
    .map(|normal| Side {
        normal,
        point: apex,
        error,
    })
    .to_vec()
}

/// Returns the unit vector of a direction, zero where its length cannot be told.
fn unit(vector: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > 0.0 && largest.is_finite() {
        (vector / largest).normalize()
    } else {
        DVec3::ZERO
    }
}
