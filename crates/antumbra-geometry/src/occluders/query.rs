//! The rule of EXACTNESS.md over surfaces of all kinds: which surface blocks, and where.

use std::sync::Arc;

use super::{
    AlphaTest, Curved, CurvedShape, Element, ElementKind, NO_ALPHA_TEST, NO_AXIS, Occluders,
    Surface, SurfaceId, Triangle, is_too_small,
};
use crate::intersect::{
    DiskPlane, cap_exit, cone_distance, cone_is_outside, disk_blocks, disk_distance,
    is_behind_wall, own_sphere_blocks, own_tube_blocks, plane_side, sphere_blocks, sphere_distance,
    sphere_side, triangle_blocks, triangle_distance, tube_blocks, tube_side, wall_exit,
};
use crate::number::Sign;
use crate::segment::{Plane, ReceiverSurface, Segment, largest_move_onto};
use crate::umbra::{ConeUmbra, DiskUmbra, FaceUmbra, FreeformUmbra, SphereUmbra, UmbraShape};
use crate::{
    Bounds, Cone, DVec3, ElementId, Hit, LightShape, Opacity, Ray, ReceiverPoint, Sphere, Umbra,
};

/// Why there is a crossing: whoever asks where it is found it before, by the same triangles and samples.
const CROSSED: &str = "a crossing that was found";

/// A triangle with an area that a start lies on, still without its corners: whoever asks for many of them
/// first, and for their corners then, waits once for memory.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReceiverTriangle {
    vertices: [u32; 3],
    axis: u8,
}

impl ReceiverTriangle {
    /// Returns the axis along which the normal is largest.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        self.axis.into()
    }
}

/// A surface as those see it that start on it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum OwnShape {
    /// A triangle, or a disk by itself: no own rule hides anything.
    Flat(Plane),
    /// A sphere that is more than a point.
    Ball(Sphere),
    /// Any other.
    Other,
}

/// A curved surface or a disk that may block.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RoundShape {
    Ball(Sphere),
    Disk(DiskPlane),
    /// The wall of a cone, whether its ends are closed or not.
    Tube(Cone),
}

impl Occluders {
    /// Returns the shape of a surface that is no triangle; `None` for those that are never hit or freeform.
    pub(crate) fn round_shape(&self, surface: SurfaceId) -> Option<RoundShape> {
        let Surface::Curved(curved) = self.surface(surface) else {
            return None;
        };
        match &curved.shape {
            CurvedShape::Sphere(sphere) => {
                (sphere.radius > 0.0).then_some(RoundShape::Ball(*sphere))
            }
            CurvedShape::Tube(cone) => is_solid(cone).then_some(RoundShape::Tube(*cone)),
            CurvedShape::Cap(disk, cone) => is_solid(cone).then_some(RoundShape::Disk(*disk)),
            CurvedShape::Disk(disk, axis) => (*axis != NO_AXIS).then_some(RoundShape::Disk(*disk)),
            CurvedShape::Part(_) | CurvedShape::Level(_) => None,
        }
    }

    /// Returns what starts on a surface need to know of it.
    pub(crate) fn own_shape(&self, surface: SurfaceId) -> OwnShape {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                OwnShape::Flat(Plane::Points(self.positions_of(triangle)))
            }
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Sphere(sphere) if sphere.radius > 0.0 => OwnShape::Ball(*sphere),
                CurvedShape::Disk(disk, axis) if *axis != NO_AXIS => OwnShape::Flat(disk.plane()),
                _ => OwnShape::Other,
            },
        }
    }

    /// Returns the numbers of a triangle's vertices; equal positions have equal numbers. `None` for triangles without
    /// area and other surfaces.
    pub(crate) fn triangle_vertices(&self, surface: SurfaceId) -> Option<[u32; 3]> {
        let triangle = self.triangles.get(surface.0 as usize)?;
        (triangle.axis != NO_AXIS).then_some(triangle.vertices)
    }

    /// Returns the corners of a triangle that blocks shadow rays at least in places, and whether it does everywhere; `None`
    /// for others and for those without area.
    #[inline]
    pub(crate) fn blocking_triangle(&self, surface: SurfaceId) -> Option<([DVec3; 3], bool)> {
        let triangle = self.triangles.get(surface.0 as usize)?;
        let is_blocking = triangle.is_opaque && triangle.axis != NO_AXIS;
        is_blocking.then(|| {
            let is_whole = triangle.alpha_test == NO_ALPHA_TEST;
            (self.positions_of(triangle), is_whole)
        })
    }

    /// Prepares the segment from a start to a light.
    #[inline]
    pub fn segment(&self, start: &ReceiverPoint, light: &LightShape) -> Segment {
        self.segment_as_given(start, &light.without_underflow())
    }

    #[inline]
    fn segment_as_given(&self, start: &ReceiverPoint, light: &LightShape) -> Segment {
        let surface = start
            .surface
            .and_then(|surface| self.start_surface(surface, start.point));
        Segment::new(*start, light, surface)
    }

    /// Prepares a ray as a segment towards a direction.
    pub fn ray_segment(&self, ray: &Ray) -> Segment {
        let start = ReceiverPoint {
            point: ray.origin,
            surface: ray.leaves,
        };
        // Distances are in lengths of the direction.
        self.segment_as_given(&start, &LightShape::Direction(ray.direction))
    }

    /// Returns a bound on how far, in any coordinate, the exact start (EXACTNESS.md, "The start") lies
    /// from its point as given; infinity where only [`Occluders::segment`] knows.
    #[inline]
    pub fn start_offset(&self, start: &ReceiverPoint) -> f64 {
        let Some(surface) = start.surface else {
            return 0.0;
        };
        match self.surface(surface) {
            Surface::Triangle(triangle) if triangle.axis == NO_AXIS => 0.0,
            Surface::Triangle(triangle) => {
                let corners = self.positions_of(triangle);
                largest_move_onto(start.point, corners, usize::from(triangle.axis))
            }
            Surface::Curved(curved) => match curved.shape {
                CurvedShape::Sphere(_) | CurvedShape::Tube(_) | CurvedShape::Level(_) => 0.0,
                CurvedShape::Cap(..) | CurvedShape::Disk(..) | CurvedShape::Part(_) => {
                    f64::INFINITY
                }
            },
        }
    }

    /// Returns the triangle that a start is moved onto (EXACTNESS.md, "The start"); `None` where there is no
    /// triangle, or it has no area.
    #[inline(always)]
    pub fn start_triangle(&self, surface: SurfaceId) -> Option<ReceiverTriangle> {
        let triangle = self.triangles.get(surface.0 as usize)?;
        let (vertices, axis) = (triangle.vertices, triangle.axis);
        (axis != NO_AXIS).then_some(ReceiverTriangle { vertices, axis })
    }

    /// Returns the corners of a triangle of these surfaces.
    #[inline(always)]
    pub fn start_corners(&self, triangle: &ReceiverTriangle) -> [DVec3; 3] {
        let [a, b, c] = triangle.vertices;
        [
            self.positions[a as usize],
            self.positions[b as usize],
            self.positions[c as usize],
        ]
    }

    /// Returns whether an opaque surface blocks the segment (EXACTNESS.md, "Which surfaces block").
    pub fn blocks(&self, surface: SurfaceId, segment: &Segment) -> bool {
        self.is_opaque(surface) && self.crosses(surface, segment)
    }

    /// Returns whether the surface's own rule blocks the segment; always decided by the start's
    /// surface alone (and its twins), so queries ask it first.
    #[inline]
    pub fn own_rule_blocks(&self, segment: &Segment) -> bool {
        let Some(own) = segment.start().surface else {
            return false;
        };
        match self.surface(own) {
            Surface::Triangle(_) => false,
            Surface::Curved(curved) => {
                self.solids[curved.solid as usize].is_opaque && own_rule(curved, segment)
            }
        }
    }

    /// Returns whether a surface, opaque or not, is crossed by the segment by the same rule.
    pub fn crosses(&self, surface: SurfaceId, segment: &Segment) -> bool {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                if segment.start().surface == Some(surface) || triangle.axis == NO_AXIS {
                    return false;
                }
                let corners = self.positions_of(triangle);
                triangle_blocks(corners, segment)
                    && self.is_solid_where_crossed(triangle, corners, segment)
            }
            Surface::Curved(curved) => self.curved_crosses(surface, curved, segment),
        }
    }

    /// Returns whether two surfaces are triangles with an area that lie exactly in one plane. Neither blocks a start
    /// on the other then.
    pub fn are_in_one_plane(&self, one: SurfaceId, other: SurfaceId) -> bool {
        let corners = |surface| match self.surface(surface) {
            Surface::Triangle(triangle) if triangle.axis != NO_AXIS => {
                Some(self.positions_of(triangle))
            }
            _ => None,
        };
        match (corners(one), corners(other)) {
            (Some(one), Some(other)) => is_flat(&[one, other]),
            _ => false,
        }
    }

    /// Returns whether a surface that a segment is known to cross ([`Occluders::crosses`], holes apart) is there where
    /// it is crossed: always, unless it is alpha-tested. Costs less than asking whether it is crossed.
    pub fn is_solid_at_crossing(&self, surface: SurfaceId, segment: &Segment) -> bool {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                self.is_solid_where_crossed(triangle, self.positions_of(triangle), segment)
            }
            Surface::Curved(_) => true,
        }
    }

    /// Returns whether a triangle is there where a segment crosses it: always, unless it is
    /// alpha-tested.
    fn is_solid_where_crossed(
        &self,
        triangle: &Triangle,
        corners: [DVec3; 3],
        segment: &Segment,
    ) -> bool {
        if triangle.alpha_test == NO_ALPHA_TEST {
            return true;
        }
        let AlphaTest { coverage, uvs } = self.alpha_tests[triangle.alpha_test as usize];
        let (_, [b, c]) = triangle_distance(corners, segment);
        let uv = std::array::from_fn(|i| {
            uvs[0][i] + (uvs[1][i] - uvs[0][i]) * b + (uvs[2][i] - uvs[0][i]) * c
        });
        self.coverages[coverage.0 as usize].is_solid_at(uv)
    }

    pub(super) fn curved_crosses(
        &self,
        surface: SurfaceId,
        curved: &Curved,
        segment: &Segment,
    ) -> bool {
        if let Some(own) = segment.start().surface {
            if own == surface && matches!(curved.shape, CurvedShape::Disk(..)) {
                return false;
            }
            if let Surface::Curved(own) = self.surface(own)
                && own.solid == curved.solid
            {
                return own_rule(own, segment);
            }
        }
        match &curved.shape {
            CurvedShape::Sphere(sphere) => sphere.radius > 0.0 && sphere_blocks(sphere, segment),
            CurvedShape::Tube(cone) => is_solid(cone) && tube_blocks(cone, segment),
            CurvedShape::Cap(disk, cone) => is_solid(cone) && disk_blocks(disk, segment),
            CurvedShape::Disk(disk, axis) => *axis != NO_AXIS && disk_blocks(disk, segment),
            CurvedShape::Part(part) => part.is_crossed(segment),
            CurvedShape::Level(level) => level.is_crossed(segment),
        }
    }

    /// Returns where a crossing that [`Occluders::crosses`] found is.
    pub fn hit(&self, surface: SurfaceId, segment: &Segment) -> Hit {
        let along = |distance: f64| segment.origin() + segment.direction() * distance;
        let is_own_solid = |curved: &Curved| {
            segment
                .start()
                .surface
                .is_some_and(|own| match self.surface(own) {
                    Surface::Curved(own) => own.solid == curved.solid,
                    Surface::Triangle(_) => false,
                })
        };
        let (distance, point, barycentric) = match self.surface(surface) {
            Surface::Triangle(triangle) => {
                let corners = self.positions_of(triangle);
                let (distance, weights) = triangle_distance(corners, segment);
                let [a, b, c] = corners;
                let point = a + (b - a) * weights[0] + (c - a) * weights[1];
                (distance, point, weights)
            }
            Surface::Curved(curved) => {
                let is_own = is_own_solid(curved);
                let (distance, point) = match &curved.shape {
                    CurvedShape::Sphere(sphere) => {
                        let distance = sphere_distance(sphere, segment, is_own);
                        // Back onto the sphere: nearer to it than the ray's rounding.
                        let radial = (along(distance) - sphere.center).normalize_or_zero();
                        (distance, sphere.center + radial * sphere.radius)
                    }
                    // All parts of an own closed cone are crossed by the rule; it is left through the
                    // nearest of them.
                    CurvedShape::Tube(cone) if is_own && cone.is_closed => {
                        let distance = wall_exit(cone, segment, self.starts_on_tube(segment));
                        (distance, along(distance))
                    }
                    CurvedShape::Cap(disk, _) if is_own => {
                        let distance = cap_exit(disk, segment);
                        (distance, along(distance))
                    }
                    CurvedShape::Tube(cone) => {
                        let distance = cone_distance(cone, segment, is_own);
                        (distance, along(distance))
                    }
                    CurvedShape::Cap(disk, _) | CurvedShape::Disk(disk, _) => {
                        let distance = disk_distance(disk, segment);
                        (distance, along(distance))
                    }
                    CurvedShape::Part(part) => part.crossing(segment).expect(CROSSED),
                    CurvedShape::Level(level) => {
                        let distance = level.crossing(segment, is_own).expect(CROSSED);
                        (distance, along(distance))
                    }
                };
                (distance, point, [0.0; 2])
            }
        };
        Hit {
            distance,
            surface,
            point,
            barycentric,
        }
    }

    fn starts_on_tube(&self, segment: &Segment) -> bool {
        segment.start().surface.is_some_and(|own| {
            matches!(self.surface(own), Surface::Curved(own) if matches!(own.shape, CurvedShape::Tube(_)))
        })
    }

    /// Returns on which side of its surface the light is, at the start (EXACTNESS.md, "The side of
    /// the light"): 1 on the side of the normal, -1 behind, 0 in the tangent plane and for free
    /// starts and degenerate surfaces.
    pub fn light_side(&self, start: &ReceiverPoint, light: &LightShape) -> i8 {
        let Some(surface) = start.surface else {
            return 0;
        };
        let sign = match self.surface(surface) {
            Surface::Triangle(triangle) => plane_side(
                &Plane::Points(self.positions_of(triangle)),
                light.homogeneous(),
            ),
            Surface::Curved(curved) => side(curved, &self.segment(start, light)),
        };
        sign.to_i8()
    }

    /// Prepares an element's umbra behind a light.
    pub fn umbra(&self, element: ElementId, light: &LightShape) -> Umbra {
        let light = &light.without_underflow();
        let record = &self.elements[element.0 as usize];
        let is_self_clear = !matches!(
            record.kind,
            ElementKind::OpenCone | ElementKind::Patch | ElementKind::Implicit
        );
        let has_holes = self.has_holes(element);
        let nothing = Umbra {
            shape: UmbraShape::Nothing,
            is_self_clear: true,
            has_holes,
        };
        if !record.opacity.blocks() {
            return nothing;
        }
        if record.kind == ElementKind::Face {
            return self.face_umbra(element, light).unwrap_or(nothing);
        }
        let bounds = self.element_bounds(element);
        if is_too_small(&bounds) {
            return Umbra {
                shape: UmbraShape::Tiny(bounds),
                is_self_clear,
                has_holes,
            };
        }
        let first = SurfaceId(record.surfaces.start);
        let Surface::Curved(curved) = self.surface(first) else {
            return nothing;
        };
        let shape = match &curved.shape {
            CurvedShape::Sphere(sphere) if sphere.radius > 0.0 => {
                UmbraShape::Sphere(SphereUmbra::new(*sphere, light))
            }
            CurvedShape::Tube(cone) if is_solid(cone) => {
                UmbraShape::Cone(ConeUmbra::new(*cone, light))
            }
            CurvedShape::Disk(disk, axis) if *axis != NO_AXIS => {
                DiskUmbra::new(*disk, light).map_or(UmbraShape::Nothing, UmbraShape::Disk)
            }
            CurvedShape::Part(part) => UmbraShape::Freeform(FreeformUmbra::Patch(Arc::clone(part))),
            CurvedShape::Level(level) => {
                UmbraShape::Freeform(FreeformUmbra::of_level(level, light))
            }
            _ => UmbraShape::Nothing,
        };
        Umbra {
            shape,
            is_self_clear,
            has_holes,
        }
    }

    /// Returns `None` for a face that blocks nothing.
    fn face_umbra(&self, element: ElementId, light: &LightShape) -> Option<Umbra> {
        let surfaces = self.elements[element.0 as usize].surfaces.clone();
        let mut triangles = Vec::with_capacity(surfaces.len());
        let mut sides = [0usize; 3];
        for surface in surfaces {
            let triangle = &self.triangles[surface as usize];
            if triangle.axis == NO_AXIS {
                continue;
            }
            let corners = self.positions_of(triangle);
            let side = plane_side(&Plane::Points(corners), light.homogeneous());
            sides[(side.to_i8() + 1) as usize] += 1;
            triangles.push((triangle.vertices, corners));
        }
        if triangles.is_empty() || sides[1] == triangles.len() {
            return None;
        }
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|&(_, corners)| corners).collect();
        let is_one_sided = sides[1] == 0 && (sides[0] == 0 || sides[2] == 0);
        let boundary = boundary_edges(&triangles);
        let bounds = Bounds::of_points(corners.iter().copied().flatten());
        let shape = if is_too_small(&bounds) {
            UmbraShape::Tiny(bounds)
        } else {
            UmbraShape::Face(FaceUmbra::new(
                corners.clone(),
                &boundary,
                is_one_sided,
                light,
            ))
        };
        // Triangles of one plane never block each other; nor do two that share an edge and turn the
        // same way seen from the light, for they meet only in that edge then.
        let is_self_clear = triangles.len() <= 2 && is_one_sided || is_flat(&corners);
        Some(Umbra {
            shape,
            is_self_clear,
            has_holes: self.has_holes(element),
        })
    }

    /// Returns whether an element is not there in places.
    fn has_holes(&self, element: ElementId) -> bool {
        let Element {
            opacity, surfaces, ..
        } = &self.elements[element.0 as usize];
        matches!(opacity, Opacity::AlphaTested(_))
            && surfaces
                .clone()
                .any(|surface| match self.surface(SurfaceId(surface)) {
                    Surface::Triangle(triangle) => triangle.alpha_test != NO_ALPHA_TEST,
                    Surface::Curved(_) => false,
                })
    }

    #[inline]
    fn start_surface(&self, surface: SurfaceId, point: DVec3) -> Option<ReceiverSurface> {
        let (start, axis) = match self.surface(surface) {
            Surface::Triangle(triangle) => {
                let (corners, axis) = (self.positions_of(triangle), triangle.axis);
                (ReceiverSurface::Triangle { corners, axis }, axis)
            }
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Disk(disk, axis) => {
                    let (plane, axis) = (disk.plane(), *axis);
                    (ReceiverSurface::Plane { plane, axis }, axis)
                }
                CurvedShape::Cap(disk, _) => {
                    let plane = disk.plane();
                    let axis = plane.dominant_axis().unwrap_or(NO_AXIS);
                    (ReceiverSurface::Plane { plane, axis }, axis)
                }
                CurvedShape::Part(part) => {
                    let corners = part.own_triangle(point);
                    let axis = Plane::Points(corners).dominant_axis().unwrap_or(NO_AXIS);
                    (ReceiverSurface::Triangle { corners, axis }, axis)
                }
                CurvedShape::Sphere(_) | CurvedShape::Tube(_) | CurvedShape::Level(_) => {
                    return None;
                }
            },
        };
        (axis != NO_AXIS).then_some(start)
    }
}

/// A cone between two different points with some radius.
fn is_solid(cone: &Cone) -> bool {
    cone.base != cone.apex && (cone.base_radius > 0.0 || cone.apex_radius > 0.0)
}

/// Returns the side of the light at a start on a curved surface or disk.
fn side(own: &Curved, segment: &Segment) -> Sign {
    match &own.shape {
        CurvedShape::Sphere(sphere) if sphere.radius > 0.0 => sphere_side(sphere, segment),
        CurvedShape::Tube(cone) if is_solid(cone) => tube_side(cone, segment),
        CurvedShape::Cap(disk, cone) if is_solid(cone) => plane_side(&disk.plane(), segment.light),
        CurvedShape::Disk(disk, axis) if *axis != NO_AXIS => {
            plane_side(&disk.plane(), segment.light)
        }
        CurvedShape::Part(_) => segment
            .own_plane()
            .map_or(Sign::Zero, |plane| plane_side(&plane, segment.light)),
        CurvedShape::Level(level) => level.side(segment),
        _ => Sign::Zero,
    }
}

/// The own rules of EXACTNESS.md: whether the solid of the start's own surface blocks.
fn own_rule(own: &Curved, segment: &Segment) -> bool {
    if segment.is_finite() && segment.start().point == segment.light.0 {
        return false;
    }
    match &own.shape {
        CurvedShape::Disk(..) => false,
        CurvedShape::Sphere(sphere) => sphere.radius > 0.0 && own_sphere_blocks(sphere, segment),
        CurvedShape::Tube(cone) if !cone.is_closed => {
            is_solid(cone) && own_tube_blocks(cone, segment)
        }
        CurvedShape::Tube(cone) => {
            is_solid(cone) && is_behind_wall(cone, segment) && cone_is_outside(cone, segment)
        }
        CurvedShape::Cap(_, cone) => {
            is_solid(cone) && side(own, segment).is_negative() && cone_is_outside(cone, segment)
        }
        CurvedShape::Part(part) => part.is_crossed(segment),
        CurvedShape::Level(level) => level.own_is_crossed(segment),
    }
}

/// Returns the edges that belong to one triangle only, in the order of the triangles.
fn boundary_edges(triangles: &[([u32; 3], [DVec3; 3])]) -> Vec<[DVec3; 2]> {
    let edges = || {
        triangles.iter().flat_map(|(vertices, corners)| {
            (0..3).map(move |i| {
                let j = (i + 1) % 3;
                let key = (vertices[i].min(vertices[j]), vertices[i].max(vertices[j]));
                (key, [corners[i], corners[j]])
            })
        })
    };
    let mut count = std::collections::HashMap::new();
    for (key, _) in edges() {
        *count.entry(key).or_insert(0usize) += 1;
    }
    edges()
        .filter(|(key, _)| count[key] == 1)
        .map(|(_, ends)| ends)
        .collect()
}

/// Returns whether triangles lie exactly in one plane.
fn is_flat(triangles: &[[DVec3; 3]]) -> bool {
    let plane = Plane::Points(triangles[0]);
    let others = triangles.iter().flatten();
    // Neighbors share corners; a corner's own plane needs no arithmetic.
    let mut others = others.filter(|&vertex| !triangles[0].contains(vertex));
    others.all(|&vertex| plane_side(&plane, (vertex, 1.0)) == Sign::Zero)
}
