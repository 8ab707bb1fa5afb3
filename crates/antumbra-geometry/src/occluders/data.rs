//! Surfaces as they lie in memory, and what is read of them.

use glam::DVec3;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use crate::freeform::{Level, PatchPart};
use crate::ids::{ElementId, SurfaceId};
use crate::intersect::{
    DiskPlane, box_meets_cone, box_meets_disk, box_meets_sphere, box_meets_triangle,
};
use crate::polygon::to_one;
use crate::{Bounds, Cone, Coverage, CoverageId, Filter, FilterId, Sphere};

/// Whether a surface stops light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// Blocks shadow rays.
    Opaque,
    /// Receives shadows and blocks none.
    Transparent,
    /// A face with holes: blocks where its coverage says it is solid; rays of all kinds pass
    /// elsewhere.
    AlphaTested(CoverageId),
    /// Receives shadows and blocks none, but colors the light that goes through: glass.
    Filtering(FilterId),
}

impl Opacity {
    /// Returns whether a surface blocks shadow rays, at least in places.
    pub(super) fn blocks(self) -> bool {
        match self {
            Self::Opaque | Self::AlphaTested(_) => true,
            Self::Transparent | Self::Filtering(_) => false,
        }
    }
}

/// Kind of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// A polygon, cut into triangles.
    Face,
    /// A sphere.
    Sphere,
    /// An open cone or cylinder.
    OpenCone,
    /// A cone or cylinder with caps: its wall, the base cap and the apex cap, in this order; an end
    /// of radius zero has none.
    ClosedCone,
    /// A disk.
    Disk,
    /// A bicubic patch, cut into parts.
    Patch,
    /// An implicit surface.
    Implicit,
}

/// One object of the scene in the paper's sense.
#[derive(Clone, Debug)]
pub struct Element {
    /// Kind.
    pub kind: ElementKind,
    /// Its surfaces, a run of ids.
    pub surfaces: Range<u32>,
    /// Whether it stops light.
    pub opacity: Opacity,
}

/// A triangle of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// Indices of the positions.
    pub(crate) vertices: [u32; 3],
    /// Indices into the face's outline; [`NO_CORNER`] for points that are not of the outline.
    pub(super) corners: [u32; 3],
    pub(super) element: u32,
    /// Axis of the largest normal component; [`NO_AXIS`] if the area is zero.
    pub(crate) axis: u8,
    /// Whether it blocks anywhere.
    pub(super) is_opaque: bool,
    /// Index into the alpha tests; [`NO_ALPHA_TEST`] for whole triangles.
    pub(super) alpha_test: u32,
}

/// Where a triangle of an alpha-tested face looks up whether it is there.
#[derive(Clone, Copy, Debug)]
pub(super) struct AlphaTest {
    pub(super) coverage: CoverageId,
    /// Texture coordinates of the triangle's corners.
    pub(super) uvs: [[f64; 2]; 3],
}

pub(super) const NO_ALPHA_TEST: u32 = u32::MAX;

pub(super) const NO_CORNER: u32 = u32::MAX;

pub(crate) const NO_AXIS: u8 = 3;

/// A surface that is no triangle.
#[derive(Clone, Debug)]
pub(super) struct Curved {
    pub(super) shape: CurvedShape,
    pub(super) element: u32,
    /// Surfaces with equal numbers here share an own rule: the parts of a closed cone, and shapes
    /// with the same numbers.
    pub(super) solid: u32,
    pub(super) is_opaque: bool,
}

impl Curved {
    fn bytes_beside(&self) -> u64 {
        match &self.shape {
            CurvedShape::Part(part) => part.memory_bytes(),
            CurvedShape::Level(level) => level.memory_bytes(),
            _ => 0,
        }
    }
}

/// Curved surfaces with one own rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    /// The first of the elements that are this solid.
    pub(super) element: ElementId,
    /// Whether any of its surfaces is opaque.
    pub(super) is_opaque: bool,
}

#[derive(Clone, Debug)]
pub(super) enum CurvedShape {
    Sphere(Sphere),
    /// The wall of a cone, open or closed.
    Tube(Cone),
    /// A cap of a closed cone.
    Cap(DiskPlane, Cone),
    /// A disk by itself, with the axis of its largest normal component.
    Disk(DiskPlane, u8),
    /// A part of a patch.
    Part(Arc<PatchPart>),
    /// An implicit surface.
    Level(Arc<Level>),
}

/// All surfaces of a static scene.
#[derive(Debug, Default)]
pub struct Occluders {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<Triangle>,
    pub(super) alpha_tests: Vec<AlphaTest>,
    pub(super) coverages: Vec<Arc<dyn Coverage>>,
    pub(super) filters: Vec<Arc<dyn Filter>>,
    /// Texture coordinates of the corners of filtering triangles that have some, by the triangle's number, in order.
    pub(super) filter_uvs: Vec<(u32, [[f64; 2]; 3])>,
    pub(super) curved: Vec<Curved>,
    /// Those that the `solid` numbers of `curved` stand for.
    pub(super) solids: Vec<Solid>,
    pub(super) elements: Vec<Element>,
    /// Made when first asked for: that visits every surface.
    pub(super) bounds: OnceLock<Bounds>,
    /// A bit for each surface that is left out; nothing where none is.
    pub(super) left_out: Vec<u64>,
    /// Found when first asked for.
    pub(super) first_freeform: OnceLock<Option<SurfaceId>>,
}

impl Occluders {
    /// Returns how many surfaces there are.
    pub fn surface_count(&self) -> usize {
        self.triangles.len() + self.curved.len()
    }

    /// Returns how many of the surfaces are triangles; their ids come first.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Returns all surfaces' ids.
    pub fn surfaces(&self) -> impl Iterator<Item = SurfaceId> + use<> {
        (0..self.surface_count() as u32).map(SurfaceId)
    }

    /// Returns the same surfaces with some elements left out. They keep their numbers, and starts on them are
    /// what they were, but they block nothing and are in no box.
    #[must_use]
    pub fn without(&self, elements: &[ElementId]) -> Self {
        let mut left = Self {
            positions: self.positions.clone(),
            triangles: self.triangles.clone(),
            alpha_tests: self.alpha_tests.clone(),
            coverages: self.coverages.clone(),
            filters: self.filters.clone(),
            filter_uvs: self.filter_uvs.clone(),
            curved: self.curved.clone(),
            // Starts on what is left out keep their own rules.
            solids: self.solids.clone(),
            elements: self.elements.clone(),
            bounds: OnceLock::new(),
            left_out: vec![0; self.surface_count().div_ceil(64)],
            first_freeform: OnceLock::new(),
        };
        for &ElementId(element) in elements {
            let element = &mut left.elements[element as usize];
            element.opacity = Opacity::Transparent;
            for surface in element.surfaces.clone() {
                let surface = surface as usize;
                left.left_out[surface / 64] |= 1 << (surface % 64);
                match surface.checked_sub(left.triangles.len()) {
                    None => left.triangles[surface].is_opaque = false,
                    Some(curved) => left.curved[curved].is_opaque = false,
                }
            }
        }
        left
    }

    /// Returns whether a surface is one of those that [`Occluders::without`] left out.
    #[inline]
    pub fn is_left_out(&self, surface: SurfaceId) -> bool {
        let surface = surface.0 as usize;
        let bits = self.left_out.get(surface / 64);
        bits.is_some_and(|bits| bits >> (surface % 64) & 1 != 0)
    }

    /// Returns the ids of all surfaces that are not left out.
    pub fn present_surfaces(&self) -> impl Iterator<Item = SurfaceId> {
        self.surfaces()
            .filter(|&surface| !self.is_left_out(surface))
    }

    /// Returns all elements in the order of adding.
    pub fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// Returns the surfaces of an element.
    pub fn surfaces_of(&self, element: ElementId) -> impl Iterator<Item = SurfaceId> + use<> {
        let surfaces = self.elements[element.0 as usize].surfaces.clone();
        surfaces.map(SurfaceId)
    }

    /// Returns whether an element is made of triangles.
    pub fn is_face(&self, element: ElementId) -> bool {
        self.elements[element.0 as usize].kind == ElementKind::Face
    }

    /// Returns the box around an element, up to rounding.
    pub fn element_bounds(&self, element: ElementId) -> Bounds {
        self.surfaces_of(element)
            .map(|surface| self.surface_bounds(surface))
            .fold(Bounds::EMPTY, Bounds::union)
    }

    /// Returns the axis of the largest component of a triangle's normal, the lowest on ties; `None` for
    /// triangles without area and other surfaces.
    #[inline]
    pub fn dominant_axis(&self, surface: SurfaceId) -> Option<usize> {
        match self.surface(surface) {
            Surface::Triangle(triangle) if triangle.axis != NO_AXIS => {
                Some(usize::from(triangle.axis))
            }
            _ => None,
        }
    }

    /// Returns the element a surface belongs to.
    pub fn element_of(&self, surface: SurfaceId) -> ElementId {
        ElementId(match self.surface(surface) {
            Surface::Triangle(triangle) => triangle.element,
            Surface::Curved(curved) => curved.element,
        })
    }

    /// Returns whether a surface blocks shadow rays, at least in places.
    pub fn is_opaque(&self, surface: SurfaceId) -> bool {
        match self.surface(surface) {
            Surface::Triangle(triangle) => triangle.is_opaque,
            Surface::Curved(curved) => curved.is_opaque,
        }
    }

    /// Returns whether a surface blocks shadow rays everywhere: opaque and without holes.
    pub fn is_opaque_everywhere(&self, surface: SurfaceId) -> bool {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                triangle.is_opaque && triangle.alpha_test == NO_ALPHA_TEST
            }
            Surface::Curved(curved) => curved.is_opaque,
        }
    }

    /// Returns whether there are no alpha-tested surfaces: all that block do so everywhere.
    pub fn are_whole(&self) -> bool {
        self.alpha_tests.is_empty()
    }

    /// Returns whether a surface is part of a patch or an implicit surface.
    pub fn is_freeform(&self, surface: SurfaceId) -> bool {
        match self.surface(surface) {
            Surface::Triangle(_) => false,
            Surface::Curved(curved) => {
                matches!(curved.shape, CurvedShape::Part(_) | CurvedShape::Level(_))
            }
        }
    }

    /// Returns the opaque freeform surface with the lowest number: where there is one, shadows in the air have no closed form.
    pub fn first_freeform(&self) -> Option<SurfaceId> {
        let is_first = |surface: &SurfaceId| self.is_freeform(*surface) && self.is_opaque(*surface);
        let first = self.triangles.len() as u32;
        let curved = (first..self.surface_count() as u32).map(SurfaceId);
        *self
            .first_freeform
            .get_or_init(|| curved.clone().find(is_first))
    }

    /// Returns whether two surfaces are parts of one solid or of identical ones, so that a start on
    /// one of them is answered by the own rule for both.
    pub fn have_one_own_rule(&self, first: SurfaceId, second: SurfaceId) -> bool {
        match (self.surface(first), self.surface(second)) {
            (Surface::Curved(first), Surface::Curved(second)) => first.solid == second.solid,
            _ => false,
        }
    }

    /// Returns the surfaces that the own rule of a start's surface decides: the parts of the first solid that is the same.
    /// The rule holds wherever the start's point is, so a ray may cross them that passes them by. None for triangles.
    pub fn own_parts(&self, own: SurfaceId) -> impl Iterator<Item = SurfaceId> + use<> {
        let parts = match self.surface(own) {
            Surface::Triangle(_) => None,
            // Every part of a patch has a rule of its own.
            Surface::Curved(Curved {
                shape: CurvedShape::Part(_),
                ..
            }) => Some(own.0..own.0 + 1),
            Surface::Curved(own) => {
                let element = self.solids[own.solid as usize].element;
                Some(self.elements[element.0 as usize].surfaces.clone())
            }
        };
        parts.into_iter().flatten().map(SurfaceId)
    }

    /// Returns the sphere that a surface is, `None` for other surfaces.
    pub fn sphere(&self, surface: SurfaceId) -> Option<Sphere> {
        match self.surface(surface) {
            Surface::Curved(Curved {
                shape: CurvedShape::Sphere(sphere),
                ..
            }) => Some(*sphere),
            _ => None,
        }
    }

    /// Returns the three corners of a triangle as indices into the outline given to `add_face`, or
    /// `None` if the surface is no triangle or a corner is a crossing point of the outline.
    pub fn corners(&self, surface: SurfaceId) -> Option<[u32; 3]> {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                (!triangle.corners.contains(&NO_CORNER)).then_some(triangle.corners)
            }
            Surface::Curved(_) => None,
        }
    }

    /// Returns how many positions triangles have; equal ones count once.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Returns the positions of a triangle's vertices in order, `None` for other surfaces.
    #[inline]
    pub fn triangle_positions(&self, surface: SurfaceId) -> Option<[DVec3; 3]> {
        match self.surface(surface) {
            Surface::Triangle(triangle) => Some(self.positions_of(triangle)),
            Surface::Curved(_) => None,
        }
    }

    /// Returns the unit normal of a surface at a point on it: by the winding for triangles,
    /// outwards for curved shapes, as given for disks (outwards for caps). Zero where there is none.
    pub fn normal_at(&self, surface: SurfaceId, point_in_world: DVec3) -> DVec3 {
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                let [a, b, c] = self.positions_of(triangle);
                unit(to_unit_size(b - a).cross(to_unit_size(c - a)))
            }
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Sphere(sphere) => unit(point_in_world - sphere.center),
                CurvedShape::Tube(cone) => tube_normal(cone, point_in_world),
                CurvedShape::Cap(disk, _) | CurvedShape::Disk(disk, _) => unit(disk.normal()),
                CurvedShape::Part(part) => {
                    let [a, b, c] = part.own_triangle(point_in_world);
                    unit(to_unit_size(b - a).cross(to_unit_size(c - a)))
                }
                CurvedShape::Level(level) => unit(level.normal(point_in_world)),
            },
        }
    }

    /// Returns the unit normal that a surface has for shading at a point on it: that of the smooth patch for patches, of which
    /// [`Occluders::normal_at`] gives that of a triangle. The same for others; zero where there is none.
    pub fn smooth_normal_at(&self, surface: SurfaceId, point_in_world: DVec3) -> DVec3 {
        if let Surface::Curved(curved) = self.surface(surface)
            && let CurvedShape::Part(part) = &curved.shape
        {
            let normal = unit(part.smooth_normal(point_in_world));
            if normal != DVec3::ZERO {
                return normal;
            }
        }
        self.normal_at(surface, point_in_world)
    }

    /// Returns the box around everything; empty if there is nothing.
    pub fn bounds(&self) -> Bounds {
        *self.bounds.get_or_init(|| {
            let all = self.present_surfaces();
            all.map(|surface| self.surface_bounds(surface))
                .fold(Bounds::EMPTY, Bounds::union)
        })
    }

    /// Returns the box around a surface, up to rounding.
    pub fn surface_bounds(&self, surface: SurfaceId) -> Bounds {
        match self.surface(surface) {
            Surface::Triangle(triangle) => Bounds::of_points(self.positions_of(triangle)),
            Surface::Curved(curved) => curved.shape.bounds(),
        }
    }

    /// Returns whether a surface may meet the closed box: never `false` if it does, up to rounding
    /// that the caller covers by inflating the box. Degenerate surfaces meet nothing.
    pub fn may_meet_box(&self, surface: SurfaceId, bounds: &Bounds) -> bool {
        let surface_bounds = self.surface_bounds(surface);
        if is_too_small(&surface_bounds) {
            return bounds.overlaps(&surface_bounds);
        }
        match self.surface(surface) {
            Surface::Triangle(triangle) => {
                triangle.axis != NO_AXIS && box_meets_triangle(bounds, self.positions_of(triangle))
            }
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Sphere(sphere) => box_meets_sphere(bounds, sphere),
                CurvedShape::Tube(cone) => box_meets_cone(
                    bounds,
                    &Cone {
                        is_closed: false,
                        ..*cone
                    },
                ),
                CurvedShape::Cap(disk, _) => box_meets_disk(bounds, disk),
                CurvedShape::Disk(disk, axis) => *axis != NO_AXIS && box_meets_disk(bounds, disk),
                CurvedShape::Part(_) => bounds.overlaps(&surface_bounds),
                CurvedShape::Level(level) => {
                    let mut outer = level.boxes().outer.iter();
                    bounds.overlaps(&surface_bounds) && outer.any(|outer| bounds.overlaps(outer))
                }
            },
        }
    }

    /// Returns the bytes the surfaces take.
    pub fn memory_bytes(&self) -> u64 {
        fn bytes<T>(items: &Vec<T>) -> u64 {
            (items.capacity() * size_of::<T>()) as u64
        }
        bytes(&self.positions)
            + bytes(&self.triangles)
            + bytes(&self.alpha_tests)
            + bytes(&self.filter_uvs)
            + bytes(&self.curved)
            + bytes(&self.elements)
            + self.curved.iter().map(Curved::bytes_beside).sum::<u64>()
    }

    #[inline]
    pub(super) fn surface(&self, surface: SurfaceId) -> Surface<'_> {
        let index = surface.0 as usize;
        match self.triangles.get(index) {
            Some(triangle) => Surface::Triangle(triangle),
            None => Surface::Curved(&self.curved[index - self.triangles.len()]),
        }
    }

    #[inline]
    pub(crate) fn positions_of(&self, triangle: &Triangle) -> [DVec3; 3] {
        let [a, b, c] = triangle.vertices;
        [
            self.positions[a as usize],
            self.positions[b as usize],
            self.positions[c as usize],
        ]
    }
}

/// Whether a shape is so small that products of its lengths and of shares of them may underflow,
/// so that no error bound in proportion to them holds. Exact predicates do not mind.
pub(super) fn is_too_small(bounds: &Bounds) -> bool {
    const SMALLEST: f64 = 6.223015277861142e-61; // 2^-200
    bounds.size().max_element() < SMALLEST
}

pub(super) enum Surface<'a> {
    Triangle(&'a Triangle),
    Curved(&'a Curved),
}

impl CurvedShape {
    pub(super) fn bounds(&self) -> Bounds {
        use crate::intersect::{cone_bounds, disk_bounds};
        match self {
            Self::Sphere(sphere) => Bounds {
                min: sphere.center - sphere.radius,
                max: sphere.center + sphere.radius,
            },
            Self::Tube(cone) => cone_bounds(cone),
            Self::Cap(disk, _) | Self::Disk(disk, _) => {
                disk_bounds(disk.center, disk.normal(), disk.radius)
            }
            Self::Part(part) => part.bounds(),
            Self::Level(level) => level.bounds(),
        }
    }
}

/// The normal of a cone's wall is not radial: it tilts with the slope of the wall.
pub(super) fn tube_normal(cone: &Cone, point: DVec3) -> DVec3 {
    let axis = cone.apex - cone.base;
    let exponent = size_exponent(axis);
    let scaled = |vector: DVec3| vector.map(|x| libm::scalbn(x, exponent));
    let [axis, from_base] = [axis, point - cone.base].map(scaled);
    let length_squared = axis.length_squared();
    let across = from_base - axis * (from_base.dot(axis) / length_squared);
    let narrowing = libm::scalbn(cone.base_radius - cone.apex_radius, exponent);
    unit(unit(across) + axis * (narrowing / length_squared))
}

/// Returns the power of two that brings the largest coordinate of a vector to 1 or above, and below 2; 0
/// for a vector without any length.
pub(super) fn size_exponent(vector: DVec3) -> i32 {
    to_one(vector.abs().max_element())
}

/// Scales a vector by a power of two, so that no square of it vanishes. Rounds nothing that counts.
pub(super) fn to_unit_size(vector: DVec3) -> DVec3 {
    let exponent = size_exponent(vector);
    vector.map(|x| libm::scalbn(x, exponent))
}

/// Returns the unit vector of a direction of any length, zero for zero.
pub(super) fn unit(vector: DVec3) -> DVec3 {
    to_unit_size(vector).normalize_or_zero()
}
