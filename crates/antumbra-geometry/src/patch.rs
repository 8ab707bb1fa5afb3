//! The part of a triangle in a box, as a set of starts, and what can change its answer.
//!
//! In: a triangle, a box, a light off the triangle's plane. Out: [`Patch`], which tells whether an
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
    /// triangle with area, or the light lies in its plane.
    pub fn patch(
        &self,
        surface: SurfaceId,
        bounds: &Bounds,
        light: &LightShape,
    ) -> Option<Patch<'_>> {
        let triangle = self.triangles.get(surface.0 as usize)?;
        if triangle.axis == NO_AXIS {
            return None;
        }
        let light = light.without_underflow();
        let corners = self.positions_of(triangle);
        let light_side = plane_side(&Plane::Points(corners), light.homogeneous());
        if light_side == Sign::Zero {
            return None;
        }
        let mut polygon = Polygon::new(corners);
        for axis in 0..3 {
            for (sign, limit) in [(1.0, bounds.max[axis]), (-1.0, bounds.min[axis])] {
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
        let largest = Bounds::of_points(corners).largest_coordinate();
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
mod tests {
    use super::*;
    use crate::{Mesh, Opacity, Segment, Start};

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn around(center: DVec3, half: f64) -> Bounds {
        Bounds {
            min: center - half,
            max: center + half,
        }
    }

    fn opaque(triangles: &[[DVec3; 3]]) -> Occluders {
        let mut builder = Occluders::builder();
        for triangle in triangles {
            builder.add_face(triangle, Opacity::Opaque).expect("a face");
        }
        builder.build()
    }

    const FLOOR: [DVec3; 3] = [
        DVec3::new(-9.0, -9.0, 0.0),
        DVec3::new(9.0, -9.0, 0.0),
        DVec3::new(0.0, 18.0, 0.0),
    ];

    #[test]
    fn a_wall_cuts_the_floor_where_it_stands() {
        let foot = [v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0)];
        let wall = [foot[0], foot[1], v(0.0, 0.0, 2.0)];
        let occluders = opaque(&[FLOOR, wall]);
        for light in [
            LightShape::Point(v(0.5, 3.0, 7.0)),
            LightShape::Direction(v(0.0, 0.3, 1.0)),
        ] {
            let is_clear = |center: DVec3| {
                let bounds = around(center, 0.25);
                let patch = occluders.patch(SurfaceId(0), &bounds, &light);
                patch.expect("floor").is_clear_of(SurfaceId(1))
            };
            // Beside it, and before its end in its plane.
            for clear in [v(0.0, 1.0, 0.0), v(0.0, -1.0, 0.0), v(2.5, 0.0, 0.0)] {
                assert!(is_clear(clear), "{clear} {light:?}");
            }
            for cut in [v(0.0, 0.0, 0.0), v(0.9, 0.1, 0.0), v(-1.1, -0.2, 0.0)] {
                assert!(!is_clear(cut), "{cut} {light:?}");
            }
        }
        // Lit from below the wall is behind the floor: it is in nobody's way.
        let below = LightShape::Point(v(0.0, 0.0, -5.0));
        let patch = occluders.patch(SurfaceId(0), &around(DVec3::ZERO, 0.5), &below);
        assert!(patch.expect("floor").is_clear_of(SurfaceId(1)));
        // The floor cuts the wall nowhere: it ends there.
        let light = LightShape::Point(v(0.5, 3.0, 7.0));
        let patch = occluders.patch(SurfaceId(1), &around(DVec3::ZERO, 0.5), &light);
        assert!(patch.expect("wall").is_clear_of(SurfaceId(0)));
    }

    #[test]
    fn edges_matter_only_between_the_patch_and_the_light() {
        let light = LightShape::Point(v(0.0, 0.0, 10.0));
        let bounds = around(v(0.0, 0.0, 0.0), 1.0);
        let misses = |edge_of: [DVec3; 2]| {
            // Far apex: only this edge of the triangle is asked.
            let occluders = opaque(&[FLOOR, [edge_of[0], edge_of[1], v(70.0, 0.0, 80.0)]]);
            let mesh = Mesh::new(&occluders);
            let mut edges = mesh.edges().iter();
            let edge = edges
                .find(|edge| {
                    let ends = occluders.edge_positions(edge);
                    edge_of.iter().all(|end| ends.contains(end))
                })
                .expect("the edge");
            let patch = occluders
                .patch(SurfaceId(0), &bounds, &light)
                .expect("floor");
            patch.misses_edge(edge)
        };
        // Across, at all heights; with one end far beside.
        assert!(!misses([v(-3.0, 0.1, 5.0), v(3.0, 0.2, 5.0)]));
        assert!(!misses([v(-3.0, 0.1, 1e-9), v(3.0, 0.2, 1e-9)]));
        assert!(!misses([v(0.1, 0.1, 9.0), v(60.0, 3.0, 9.0)]));
        // It goes through the floor within the patch.
        assert!(!misses([v(0.1, 0.1, -1.0), v(0.2, 0.3, 1.0)]));
        // Behind the plane; touching it from behind.
        assert!(misses([v(-3.0, 0.1, -5.0), v(3.0, 0.2, -1e-9)]));
        assert!(misses([v(-3.0, 0.1, 0.0), v(3.0, 0.2, -1.0)]));
        // In front and beside: of the walls, and of the plane through the light and the edge.
        assert!(misses([v(3.0, -1.0, 1.0), v(3.0, 1.0, 1.0)]));
        assert!(misses([v(3.0, 0.0, 1.0), v(0.0, 3.0, 1.0)]));
        assert!(misses([v(1.9, 0.0, 1.0), v(0.0, 1.9, 1.0)]));
        // Close to the light walls are close together.
        assert!(misses([v(0.2, -1.0, 9.0), v(0.2, 1.0, 9.0)]));
        assert!(!misses([v(0.05, -1.0, 9.0), v(0.05, 1.0, 9.0)]));
        // Beyond the light.
        assert!(misses([v(5.0, 6.0, 11.0), v(5.0, -6.0, 11.0)]));
        // Its own.
        assert!(misses([FLOOR[0], FLOOR[1]]));
        // From an own corner that is not in the box, up and away, and back over the patch.
        assert!(misses([FLOOR[0], v(-9.0, -9.0, 5.0)]));
        assert!(!misses([FLOOR[0], v(9.0, 9.0, 3.0)]));
    }

    /// SplitMix64.
    struct Random(u64);

    impl Random {
        fn bits(&mut self) -> u64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        }

        fn real(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
        }

        fn below(&mut self, count: usize) -> usize {
            (self.bits() % count as u64) as usize
        }

        /// A point around the origin; a whole one half the time, so that things meet.
        fn point(&mut self, reach: f64) -> DVec3 {
            let is_whole = self.below(2) == 0;
            DVec3::from_array(std::array::from_fn(|_| {
                let x = self.real(-reach, reach);
                if is_whole { x.round() } else { x }
            }))
        }

        fn light(&mut self) -> LightShape {
            match self.below(3) {
                0 => LightShape::Direction(self.point(3.0) + v(0.01, 0.02, 0.03)),
                1 => LightShape::Point(self.point(3.0)),
                _ => LightShape::Point(self.point(12.0)),
            }
        }

        /// Triangles that share corners; some stand on others.
        fn scene(&mut self) -> Occluders {
            let count = 1 + self.below(6);
            let pool: Vec<DVec3> = (0..6).map(|_| self.point(3.0)).collect();
            let triangles: Vec<[DVec3; 3]> = (0..count)
                .map(|_| {
                    std::array::from_fn(|_| match self.below(4) {
                        0 => self.point(3.0),
                        _ => pool[self.below(pool.len())],
                    })
                })
                .collect();
            opaque(&triangles)
        }

        /// A box about a point of a triangle.
        fn bounds(&mut self, corners: [DVec3; 3]) -> Bounds {
            let center = self.inside(&corners);
            let half = [0.02, 0.2, 1.0, 8.0][self.below(4)];
            around(center, half)
        }

        /// A point between corners, or one of them, or on an edge.
        fn inside(&mut self, corners: &[DVec3]) -> DVec3 {
            let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
            let first = self.below(corners.len());
            let most = [1, 2, corners.len(), corners.len(), corners.len()][self.below(5)];
            for number in 0..most {
                let weight = self.real(0.0, 1.0);
                sum += weight * corners[(first + number) % corners.len()];
                weights += weight;
            }
            if most == 1 {
                corners[first]
            } else {
                sum / weights
            }
        }
    }

    /// What decides a patch: where nothing is in the way of changing, one start speaks for all.
    #[test]
    fn starts_of_a_clear_patch_have_one_answer() {
        let random = &mut Random(1);
        let (mut told, mut missed) = ([0; 2], 0);
        for round in 0..12_000 {
            let occluders = random.scene();
            let light = random.light();
            let mesh = Mesh::new(&occluders);
            let sides = occluders.light_sides(&light);
            let triangle = SurfaceId(0);
            let corners = occluders.triangle_positions(triangle).expect("a triangle");
            let bounds = random.bounds(corners);
            let Some(patch) = occluders.patch(triangle, &bounds, &light) else {
                continue;
            };
            let places: Vec<DVec3> = patch.corners().collect();
            let starts: Vec<Segment> = (0..12)
                .map(|_| Start {
                    point: random.inside(&places),
                    surface: Some(triangle),
                })
                .map(|start| occluders.segment(&start, &light))
                .collect();
            for other in occluders.surfaces().skip(1) {
                if patch.misses_triangle(other) {
                    missed += 1;
                    for start in &starts {
                        let start_at = start.start();
                        assert!(
                            !occluders.blocks(other, start),
                            "{round}: {other:?} {start_at:?}"
                        );
                    }
                }
            }
            let mut edges = mesh
                .edges()
                .iter()
                .filter(|edge| mesh.is_contour(edge, &sides));
            let is_clear = occluders.surfaces().all(|other| patch.is_clear_of(other))
                && edges.all(|edge| patch.misses_edge(edge));
            if !is_clear {
                continue;
            }
            let answers: Vec<bool> = starts
                .iter()
                .map(|start| {
                    occluders
                        .surfaces()
                        .any(|other| occluders.blocks(other, start))
                })
                .collect();
            assert!(
                answers.iter().all(|&answer| answer == answers[0]),
                "{round}: {answers:?} {light:?} {bounds:?} {:?}",
                occluders
                    .surfaces()
                    .map(|surface| occluders.triangle_positions(surface))
                    .collect::<Vec<_>>()
            );
            told[usize::from(answers[0])] += 1;
        }
        assert!(
            told[0] > 1_000 && told[1] > 300 && missed > 5_000,
            "{told:?} {missed}"
        );
    }

    #[test]
    fn shafts_hold_the_segments_of_their_patches() {
        let random = &mut Random(2);
        let mut asked = 0;
        for _ in 0..6_000 {
            let occluders = opaque(&[[random.point(3.0), random.point(3.0), random.point(3.0)]]);
            let light = random.light();
            let corners = occluders
                .triangle_positions(SurfaceId(0))
                .expect("a triangle");
            let bounds = random.bounds(corners);
            let Some(patch) = occluders.patch(SurfaceId(0), &bounds, &light) else {
                continue;
            };
            let shaft = patch.shaft();
            let places: Vec<DVec3> = patch.corners().collect();
            for _ in 0..10 {
                let start = random.inside(&places);
                let along = match light {
                    LightShape::Point(light) => random.real(0.0, 1.0) * (light - start),
                    LightShape::Direction(direction) => random.real(0.0, 20.0) * direction,
                };
                // What a patch's rounding may be off is for its asker to know (`SMALLEST_COVER`).
                let room = 1e-12 * v(1.0, 1.0, 1.0);
                let ends = [start + along - room, start + along + room];
                assert!(!shaft.misses_edge(&ends), "{corners:?} {light:?} {start}");
                asked += 1;
            }
            // But not everything: what is behind is outside.
            let behind = -patch.light.towards(patch.middle());
            let far = patch.middle() + behind;
            assert!(shaft.misses_edge(&[far, far]), "{corners:?} {light:?}");
        }
        assert!(asked > 10_000, "{asked}");
    }

    #[test]
    fn there_is_no_patch_without_starts() {
        let light = LightShape::Point(v(0.0, 0.0, 9.0));
        let line = [v(0.0, 0.0, 0.0), v(1.0, 1.0, 1.0), v(2.0, 2.0, 2.0)];
        let occluders = opaque(&[FLOOR, line]);
        let patch = |surface, center: DVec3, light| {
            occluders.patch(SurfaceId(surface), &around(center, 0.5), &light)
        };
        assert!(patch(0, DVec3::ZERO, light).is_some());
        // Over the floor, beside it; without area; seen edge on; not there.
        assert!(patch(0, v(0.0, 0.0, 1.0), light).is_none());
        assert!(patch(0, v(-8.0, 15.0, 0.0), light).is_none());
        assert!(patch(1, DVec3::ZERO, light).is_none());
        assert!(patch(0, DVec3::ZERO, LightShape::Point(v(3.0, 4.0, 0.0))).is_none());
        assert!(patch(0, DVec3::ZERO, LightShape::Direction(DVec3::X)).is_none());
        assert!(patch(2, DVec3::ZERO, light).is_none());
    }
}
