//! Emitting triangles of the scene.

use glam::DVec3;

use super::{AreaError, AreaSample, check_point, from_plane, triangle::point_of};

/// Triangles that are chosen by area.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Fan {
    triangles: Vec<[DVec3; 3]>,
    /// The area of each triangle and all before it.
    ends: Vec<f64>,
}

impl Fan {
    /// Keeps triangles that have an area, in their order.
    pub(super) fn new(mut triangles: Vec<[DVec3; 3]>) -> Self {
        triangles.retain(|triangle| area_of(triangle) > 0.0);
        let mut sum = 0.0;
        let ends = triangles
            .iter()
            .map(|triangle| {
                sum += area_of(triangle);
                sum
            })
            .collect();
        Self { triangles, ends }
    }

    pub(super) fn area(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// Returns the triangles with their areas.
    pub(super) fn with_areas(&self) -> impl Iterator<Item = ([DVec3; 3], f64)> {
        let triangles = self.triangles.iter();
        triangles.map(|triangle| (*triangle, area_of(triangle)))
    }

    pub(super) fn triangle(&self, number: usize) -> &[DVec3; 3] {
        &self.triangles[number]
    }

    /// Returns the triangle at a share of the area, and how far into it that is, below 1.
    ///
    /// # Panics
    /// There is no triangle.
    pub(super) fn choose(&self, u: f64) -> (usize, f64) {
        let place = u * self.area();
        let last = self.triangles.len() - 1;
        let number = self.ends.partition_point(|&end| end <= place).min(last);
        let begin = match number {
            0 => 0.0,
            _ => self.ends[number - 1],
        };
        let into = (place - begin) / (self.ends[number] - begin);
        // Below 1 by definition; rounding may disagree.
        (number, into.clamp(0.0, 1.0 - f64::EPSILON))
    }
}

fn area_of([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Triangles that shine, as one light: those of an object that emits.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeshLight {
    fan: Fan,
    is_two_sided: bool,
}

impl MeshLight {
    /// Makes a light from triangles, world space; those without area are left out. Samples lie on triangles as they
    /// are given, so that a triangle of the scene never blocks its own light.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, or there is no area.
    pub fn new(triangles: Vec<[DVec3; 3]>, is_two_sided: bool) -> Result<Self, AreaError> {
        triangles
            .iter()
            .flatten()
            .try_for_each(|&corner| check_point(corner, "a corner"))?;
        let fan = Fan::new(triangles);
        if fan.triangles.is_empty() {
            return Err(AreaError::NoSize {
                what: "it has no area",
            });
        }
        Ok(Self { fan, is_two_sided })
    }

    /// Returns the triangles that have an area.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        &self.fan.triangles
    }

    /// Returns whether both sides shine.
    pub fn is_two_sided(&self) -> bool {
        self.is_two_sided
    }

    /// Returns the area of all triangles.
    pub fn area(&self) -> f64 {
        self.fan.area()
    }

    /// Returns the triangles with their areas.
    pub(crate) fn triangles_with_areas(&self) -> impl Iterator<Item = ([DVec3; 3], f64)> {
        self.fan.with_areas()
    }

    /// Returns whether a triangle shines towards a receiver point.
    pub(crate) fn shines_to(&self, triangle: &[DVec3; 3], receiver: DVec3) -> bool {
        let side = side_of(triangle, receiver);
        side > 0 || side < 0 && self.is_two_sided
    }

    pub(super) fn sample(&self, receiver: DVec3, u: f64, v: f64) -> Option<AreaSample> {
        let (number, u) = self.fan.choose(u);
        let triangle = self.fan.triangle(number);
        if !self.shines_to(triangle, receiver) {
            return None;
        }
        let side = side_of(triangle, receiver);
        let (point, unit) = on_side(triangle, u, v, side)?;
        Some(from_plane(receiver, point, unit, self.fan.area()))
    }

    /// Returns a place for receivers on one side of its triangle, and the unit normal to that side.
    pub(super) fn point_at(&self, u: f64, v: f64, side: i8) -> Option<(DVec3, DVec3)> {
        let (number, u) = self.fan.choose(u);
        let (point, unit) = on_side(self.fan.triangle(number), u, v, side)?;
        Some((point, f64::from(side) * unit))
    }
}

/// Returns a point of a triangle that is not behind it, seen from one side, and its unit normal.
fn on_side(triangle: &[DVec3; 3], u: f64, v: f64, side: i8) -> Option<(DVec3, DVec3)> {
    let [a, b, c] = *triangle;
    let normal = (b - a).cross(c - a);
    let point = not_behind(triangle, normal, point_of(triangle, u, v), side)?;
    Some((point, normal / normal.length()))
}

/// Returns on which side of a triangle a point is, exactly: 1 in front.
pub(super) fn side_of([a, b, c]: &[DVec3; 3], point: DVec3) -> i8 {
    let coord = |p: &DVec3| robust::Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    // Its sign is positive where the three wind clockwise seen from the fourth.
    let turn = -robust::orient3d(coord(a), coord(b), coord(c), coord(&point));
    i8::from(turn > 0.0) - i8::from(turn < 0.0)
}

/// Returns a point of a triangle that is not strictly on the other side than `side`, rounding undone by the
/// fewest doublings of the coordinates' own precision; `None` if none is found, which numbers near the ends of the
/// range of `f64` might do.
fn not_behind(triangle: &[DVec3; 3], normal: DVec3, mut point: DVec3, side: i8) -> Option<DVec3> {
    let axis = (0..3).fold(0, |best, axis| {
        if normal[axis].abs() > normal[best].abs() {
            axis
        } else {
            best
        }
    });
    let towards = f64::from(side) * normal[axis].signum();
    let mut step = f64::EPSILON * point.abs().max_element();
    for _ in 0..64 {
        if side_of(triangle, point) != -side {
            return Some(point);
        }
        point[axis] += towards * step;
        step *= 2.0;
    }
    None
}
