//! The part of a triangle in a box, as a set of starts, and what can change its answer.
//!
//! In: a triangle, a box, a light off the triangle's plane. Out: [`Patch`], which says whether an
//! edge or a triangle may matter to it. Invariant: `misses_*` and `is_clear_of` are said only where
//! they hold for every start on the triangle that lies in the box less a rounding. A start on the
//! border of the triangle answers as those inside next to it do (EXACTNESS.md), so what touches the
//! border only does not matter.

use crate::intersect::plane_side;
use crate::mesh::MeshEdge;
use crate::number::Sign;
use crate::occluders::{NO_AXIS, Triangle};
use crate::segment::Plane;
use crate::umbra::{MAX_CORNERS, SidePlane};
use crate::{Bounds, DVec3, LightShape, Occluders, Shaft, SurfaceId};

/// The starts on a triangle in a box.
#[derive(Clone, Debug)]
pub struct Patch<'a> {
    occluders: &'a Occluders,
    surface: SurfaceId,
    triangle: &'a Triangle,
    corners: [DVec3; 3],
    light: LightShape,
    /// The triangle's plane with the light above it.
    plane: SidePlane,
    light_side: Sign,
    polygon: Polygon,
    /// Planes through the light, the patch below them.
    walls: [Wall; MAX_CORNERS],
    wall_count: usize,
    /// Largest error of a coordinate of the polygon.
    rounding: f64,
}

/// A plane through the light and an edge of the polygon.
#[derive(Clone, Copy, Debug)]
struct Wall {
    plane: SidePlane,
    /// The corners of the triangle that lie in the plane exactly, where the edge is one of the
    /// triangle's.
    vertices: Option<[u32; 2]>,
}

/// A triangle cut by a box.
#[derive(Clone, Copy, Debug)]
struct Polygon {
    corners: [Corner; MAX_CORNERS + 1],
    count: usize,
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    point: DVec3,
    /// Which corner of the triangle this is.
    vertex: Option<u8>,
    /// Which edge of the triangle (from the corner of the same number) leads on from here.
    edge: Option<u8>,
}

impl Corner {
    const NONE: Self = Self {
        point: DVec3::ZERO,
        vertex: None,
        edge: None,
    };
}

impl Polygon {
    fn new(corners: [DVec3; 3]) -> Self {
        let mut polygon = Self {
            corners: [Corner::NONE; MAX_CORNERS + 1],
            count: 0,
        };
        for (number, point) in (0u8..).zip(corners) {
            polygon.push(Corner {
                point,
                vertex: Some(number),
                edge: Some(number),
            });
        }
        polygon
    }

    fn push(&mut self, corner: Corner) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    /// Cuts off what lies beyond `limit` along an axis, in direction `sign` (Sutherland and Hodgman
    /// 1974).
    fn cut(&self, axis: usize, sign: f64, limit: f64) -> Self {
        let mut kept = Self { count: 0, ..*self };
        let depth = |corner: &Corner| sign * (corner.point[axis] - limit);
        for (number, corner) in self.corners().iter().enumerate() {
            let next = &self.corners()[(number + 1) % self.count];
            let (here, there) = (depth(corner), depth(next));
            if here <= 0.0 {
                kept.push(*corner);
            }
            if (here <= 0.0) != (there <= 0.0) {
                let mut point =
                    corner.point + (next.point - corner.point) * (here / (here - there));
                point[axis] = limit;
                if here <= 0.0 {
                    // Along the cut from here.
                    kept.push(Corner {
                        point,
                        vertex: None,
                        edge: None,
                    });
                } else {
                    kept.push(Corner {
                        point,
                        vertex: None,
                        edge: corner.edge,
                    });
                }
            }
            if kept.count == MAX_CORNERS {
                break;
            }
        }
        kept
    }
}

impl Occluders {
    /// Returns the part of a triangle in a box, or `None` if there is none, or the surface is no
    /// triangle with area, or the light lies in its plane. `side` is the triangle's of
    /// [`Occluders::light_sides`].
    pub fn patch(
        &self,
        surface: SurfaceId,
        bounds: &Bounds,
        light: &LightShape,
        side: i8,
    ) -> Option<Patch<'_>> {
        let triangle = self.triangles.get(surface.0 as usize)?;
        let light_side = match side {
            1 => Sign::Positive,
            -1 => Sign::Negative,
            _ => return None,
        };
        if triangle.axis == NO_AXIS {
            return None;
        }
        let light = light.without_underflow();
        let corners = self.positions_of(triangle);
        let around = Bounds::of_points(corners);
        let mut polygon = Polygon::new(corners);
        for axis in 0..3 {
            for (sign, limit, farthest) in [
                (1.0, bounds.max[axis], around.max[axis]),
                (-1.0, bounds.min[axis], around.min[axis]),
            ] {
                if sign * (farthest - limit) <= 0.0 {
                    continue;
                }
                polygon = polygon.cut(axis, sign, limit);
                if polygon.count == 0 {
                    return None;
                }
            }
        }
        let [a, b, c] = corners;
        let plane = SidePlane::spanned(b - a, c - a, a);
        let plane = if light_side.is_positive() {
            plane
        } else {
            plane.flipped()
        };
        // Six cuts, each off by a few roundings of a coordinate.
        let largest = around.largest_coordinate();
        let mut patch = Patch {
            occluders: self,
            surface,
            triangle,
            corners,
            light,
            plane,
            light_side,
            polygon,
            walls: [Wall {
                plane: SidePlane::NONE,
                vertices: None,
            }; MAX_CORNERS],
            wall_count: 0,
            rounding: 64.0 * f64::EPSILON * largest,
        };
        patch.raise_walls();
        Some(patch)
    }
}

impl Patch<'_> {
    /// Returns the triangle that this is a part of.
    pub fn surface(&self) -> SurfaceId {
        self.surface
    }

    /// Returns the corners, right up to a rounding.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + use<'_> {
        self.polygon.corners().iter().map(|corner| corner.point)
    }

    /// Returns a point in the middle.
    pub fn middle(&self) -> DVec3 {
        let sum = self.corners().fold(DVec3::ZERO, |sum, corner| sum + corner);
        sum / self.polygon.count as f64
    }

    /// Returns the shaft from the patch to the light.
    pub fn shaft(&self) -> Shaft {
        let mut corners = [DVec3::ZERO; MAX_CORNERS];
        for (corner, point) in corners.iter_mut().zip(self.corners()) {
            *corner = point;
        }
        let walls = self.walls().iter().map(|wall| wall.plane);
        let planes = walls.chain([self.plane.flipped()]);
        Shaft::of_polygon(&corners[..self.polygon.count], planes, self.light)
    }

    fn walls(&self) -> &[Wall] {
        &self.walls[..self.wall_count]
    }

    fn raise_walls(&mut self) {
        let middle = self.middle();
        for number in 0..self.polygon.count {
            let corner = self.polygon.corners[number];
            let next = self.polygon.corners[(number + 1) % self.polygon.count];
            let wall = match corner.edge {
                Some(edge) => self.wall_over_edge(usize::from(edge)),
                None => Some(self.wall_over_cut(corner.point, next.point, middle)),
            };
            if let Some(wall) = wall {
                self.walls[self.wall_count] = wall;
                self.wall_count += 1;
            }
        }
    }

    /// Over an edge of the triangle the plane is exact: the triangle lies below it.
    fn wall_over_edge(&self, edge: usize) -> Option<Wall> {
        let (from, to) = (edge, (edge + 1) % 3);
        let plane = SidePlane::through_light(&self.light, self.corners[from], self.corners[to]);
        let (height, error) = plane.height(self.corners[(edge + 2) % 3]);
        let plane = if height > error {
            plane.flipped()
        } else if -height > error {
            plane
        } else {
            return None;
        };
        let vertices = Some([self.triangle.vertices[from], self.triangle.vertices[to]]);
        Some(Wall { plane, vertices })
    }

    /// Over a cut the plane is a rounded one; its limit keeps the patch below it all the same.
    fn wall_over_cut(&self, from: DVec3, to: DVec3, middle: DVec3) -> Wall {
        let plane = SidePlane::through_light(&self.light, from, to);
        let plane = if plane.height(middle).0 > 0.0 {
            plane.flipped()
        } else {
            plane
        };
        let highest = self.corners().fold(0.0_f64, |highest, corner| {
            let (height, error) = plane.height(corner);
            highest.max(height + error)
        });
        Wall {
            plane: plane.with_limit(highest + plane.steepness(self.rounding)),
            vertices: None,
        }
    }

    /// Returns whether a point, a corner of the mesh with this number, is in front of the triangle's
    /// plane, on the light's side.
    fn is_in_front(&self, vertex: u32, point: DVec3) -> bool {
        if self.triangle.vertices.contains(&vertex) {
            return false;
        }
        let (height, error) = self.plane.height(point);
        if height > error {
            true
        } else if -height > error {
            false
        } else {
            plane_side(&Plane::Points(self.corners), (point, 1.0)) == self.light_side
        }
    }

    /// Returns whether some wall has all these corners above it, or on an edge of the triangle.
    fn is_walled_off<const N: usize>(&self, vertices: &[u32; N], points: &[DVec3; N]) -> bool {
        self.walls().iter().any(|wall| {
            vertices.iter().zip(points).all(|(vertex, &point)| {
                wall.vertices.is_some_and(|own| own.contains(vertex)) || wall.plane.is_above(point)
            })
        })
    }

    /// Returns whether the patch lies on one side of the plane through the light and an edge; the edge
    /// may start from a corner of the patch.
    fn is_beside(&self, vertices: &[u32; 2], ends: &[DVec3; 2]) -> bool {
        let plane = SidePlane::through_light(&self.light, ends[0], ends[1]);
        let room = plane.steepness(self.rounding);
        let (mut above, mut below) = (true, true);
        for corner in self.polygon.corners() {
            let is_on_edge = corner.vertex.is_some_and(|number| {
                vertices.contains(&self.triangle.vertices[usize::from(number)])
            });
            if is_on_edge {
                continue;
            }
            let (height, error) = plane.height(corner.point);
            above &= height > error + room;
            below &= -height > error + room;
        }
        above || below
    }

    /// Returns whether an edge surely does not come between the patch and the light.
    pub fn misses_edge(&self, edge: &MeshEdge) -> bool {
        let vertices = &edge.vertices;
        let own = &self.triangle.vertices;
        if vertices.iter().all(|vertex| own.contains(vertex)) {
            return true;
        }
        let ends = self.occluders.edge_positions(edge);
        let is_behind = || {
            let mut ends = vertices.iter().zip(&ends);
            !ends.any(|(&vertex, &end)| self.is_in_front(vertex, end))
        };
        self.is_walled_off(vertices, &ends) || self.is_beside(vertices, &ends) || is_behind()
    }

    /// Returns whether a triangle surely blocks no start of the patch.
    pub fn misses_triangle(&self, surface: SurfaceId) -> bool {
        if surface == self.surface {
            return true;
        }
        let other = &self.occluders.triangles[surface.0 as usize];
        if other.axis == NO_AXIS {
            return true;
        }
        let points = self.occluders.positions_of(other);
        let is_behind = || {
            let mut corners = other.vertices.iter().zip(&points);
            !corners.any(|(&vertex, &point)| self.is_in_front(vertex, point))
        };
        self.is_walled_off(&other.vertices, &points) || is_behind()
    }

    /// Returns whether the patch surely does not change sides of an opaque triangle by going through
    /// it: they share no point but of a common corner, edge or border, or what they share does not
    /// come between the patch and the light.
    pub fn is_clear_of(&self, surface: SurfaceId) -> bool {
        if self.misses_triangle(surface) {
            return true;
        }
        let other = &self.occluders.triangles[surface.0 as usize];
        let shared = |vertex: &u32| self.triangle.vertices.contains(vertex);
        let shared_count = other
            .vertices
            .iter()
            .filter(|vertex| shared(vertex))
            .count();
        if shared_count >= 2 {
            return true;
        }
        let is_one_sided = |signs: &[Sign; 3]| {
            !(signs.contains(&Sign::Positive) && signs.contains(&Sign::Negative))
        };
        // Its corners strictly in front, but for a shared one.
        let theirs = self.occluders.vertex_sides(self.triangle, other);
        let zeros = theirs.iter().filter(|&&sign| sign == Sign::Zero).count();
        if zeros <= shared_count && is_one_sided(&theirs) {
            return true;
        }
        // The triangle, or the patch, on one side of its plane.
        is_one_sided(&self.occluders.vertex_sides(other, self.triangle))
            || self.is_on_one_side_of(other)
    }

    fn is_on_one_side_of(&self, other: &Triangle) -> bool {
        let [a, b, c] = self.occluders.positions_of(other);
        let plane = SidePlane::spanned(b - a, c - a, a);
        let room = plane.steepness(self.rounding);
        let (mut above, mut below) = (true, true);
        for corner in self.polygon.corners() {
            let is_shared = corner.vertex.is_some_and(|number| {
                other
                    .vertices
                    .contains(&self.triangle.vertices[usize::from(number)])
            });
            if is_shared {
                continue;
            }
            let (height, error) = plane.height(corner.point);
            above &= height > error + room;
            below &= -height > error + room;
        }
        above || below
    }
}

#[cfg(test)]
mod tests;
