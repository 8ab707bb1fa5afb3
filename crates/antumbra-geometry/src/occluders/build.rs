//! Collecting elements and numbering their surfaces.

use std::collections::HashMap;
use std::hash::BuildHasher;
use std::sync::Arc;

use glam::DVec3;
use hashbrown::hash_table::Entry;
use hashbrown::{DefaultHashBuilder, HashTable};

use super::{
    AlphaTest, Curved, CurvedShape, Element, ElementId, ElementKind, NO_ALPHA_TEST, NO_AXIS,
    NO_CORNER, Occluders, Opacity, Solid, Triangle,
};
use crate::freeform::{Level, parts_of};
use crate::intersect::DiskPlane;
use crate::polygon::{PolygonCorner, TooManyCrossings, triangulate};
use crate::segment::Plane;
use crate::{
    BezierPatch, Cone, Coverage, CoverageId, Disk, Implicit, ImplicitError, MAX_PATCH_LEVEL, Short,
    Sphere,
};

/// Largest magnitude of a coordinate: leaves room for every product a filter forms.
pub(super) const LARGEST: f64 = 1.2676506002282294e30; // 2^100

/// Reason why a shape is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OccludersError {
    /// A number is NaN, infinite or beyond 2^100.
    #[error("element {element}: {} is not finite or its magnitude exceeds 2^100", Short(*value))]
    BadNumber {
        /// The element's number, in the order of adding.
        element: usize,
        /// The number itself.
        value: f64,
    },
    /// A radius is negative.
    #[error("element {element}: radius {} is negative", Short(*value))]
    NegativeRadius {
        /// The element's number, in the order of adding.
        element: usize,
        /// The radius.
        value: f64,
    },
    /// A face with holes needs texture coordinates at each vertex.
    #[error("element {element}: {found} pairs of texture coordinates for {expected} vertices")]
    TextureCoordinates {
        /// The element's number, in the order of adding.
        element: usize,
        /// Vertices given.
        expected: usize,
        /// Pairs of texture coordinates given.
        found: usize,
    },
    /// A polygon crosses itself so often that it cannot be cut in proportionate time and memory.
    #[error(
        "element {element}: the outline of {corners} vertices crosses itself too often; \
         give it as triangles"
    )]
    TooManyCrossings {
        /// The element's number, in the order of adding.
        element: usize,
        /// The vertices of the outline.
        corners: usize,
    },
    /// A triangle of a mesh names a vertex that is not there.
    #[error(
        "triangle {triangle}: corner {corner} names vertex {index}, and there are {vertex_count} vertices"
    )]
    MeshIndex {
        /// The triangle's place in the mesh.
        triangle: usize,
        /// Which of its corners, 0 to 2.
        corner: usize,
        /// The vertex that it names.
        index: u32,
        /// Number of vertices of the mesh.
        vertex_count: usize,
    },
    /// A triangle of a mesh names a vertex with a coordinate that is NaN, infinite or beyond 2^100.
    #[error(
        "triangle {triangle}: vertex {vertex} is {}: coordinates must be finite and at most 2^100 in magnitude",
        Short(*position)
    )]
    MeshVertex {
        /// The triangle's place in the mesh.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// Where that is.
        position: DVec3,
    },
    /// A patch is cut more finely than patches may be.
    #[error("element {element}: a patch of level {level}: levels go up to {MAX_PATCH_LEVEL}")]
    PatchLevel {
        /// The element's number, in the order of adding.
        element: usize,
        /// The level.
        level: u32,
    },
    /// An implicit surface that is none.
    #[error("element {element}: {source}")]
    Implicit {
        /// The element's number, in the order of adding.
        element: usize,
        /// Reason.
        source: ImplicitError,
    },
    /// More than `u32::MAX` vertices or surfaces.
    #[error(
        "element {element}: more than {} vertices or surfaces in all",
        u32::MAX
    )]
    TooMany {
        /// The element's number, in the order of adding.
        element: usize,
    },
}

/// Collects elements.
///
/// Analytic shapes cannot have holes: an alpha-tested sphere, cone or disk counts as whole.
#[derive(Debug, Default)]
pub struct OccludersBuilder {
    pub(super) occluders: Occluders,
    /// Indices of the positions, by these: 5 bytes each instead of 33 with the positions beside.
    vertices: HashTable<u32>,
    hashing: DefaultHashBuilder,
    solid_of: HashMap<Vec<u64>, u32>,
    /// For each element its surfaces as a run of triangles or of curved shapes.
    curved_elements: Vec<usize>,
}

impl OccludersBuilder {
    /// Makes room for so many faces, triangles of theirs and vertices with different positions, so that
    /// nothing grows while they are added.
    pub fn reserve(&mut self, faces: usize, triangles: usize, vertices: usize) {
        self.occluders.elements.reserve_exact(faces);
        self.occluders.triangles.reserve_exact(triangles);
        self.occluders.positions.reserve_exact(vertices);
        let Self {
            occluders: Occluders { positions, .. },
            hashing,
            ..
        } = self;
        self.vertices.reserve(vertices, |&vertex| {
            hash_of(hashing, positions[vertex as usize])
        });
    }

    /// Returns the bytes that so many faces, triangles and vertices take while they are collected,
    /// where room has been made for them.
    pub fn predict_bytes(faces: usize, triangles: usize, vertices: usize) -> u64 {
        // The standard library's table: a byte for each of its places, at most 7 of 8 of which are
        // taken; their number is a power of two.
        let places = vertices.saturating_mul(8).div_ceil(7).next_power_of_two();
        let of = |count: usize, size: usize| count as u64 * size as u64;
        of(faces, size_of::<Element>())
            + of(triangles, size_of::<Triangle>())
            + of(vertices, size_of::<DVec3>())
            + of(places, size_of::<([u64; 3], u32)>() + 1)
    }

    /// Adds a planar polygon with its vertices in order; needs not be convex. Self-crossing
    /// outlines are filled by the even-odd rule. Three vertices always make one surface, also
    /// without area; more make as many as their shape needs.
    ///
    /// # Errors
    /// A coordinate is not finite or too large, or the outline crosses itself too often: more than
    /// 4096 times and 4 times for each vertex.
    pub fn add_face(
        &mut self,
        outline: &[DVec3],
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        self.add_face_with(outline, &[], opacity)
    }

    /// Takes up a coverage for faces with holes.
    pub fn add_coverage(&mut self, coverage: Arc<dyn Coverage>) -> CoverageId {
        self.occluders.coverages.push(coverage);
        CoverageId(self.occluders.coverages.len() as u32 - 1)
    }

    /// Adds a face with holes: as [`OccludersBuilder::add_face`], with texture coordinates for each
    /// vertex. Where the outline crosses itself, triangles at the crossing are whole.
    ///
    /// # Errors
    /// A coordinate is not finite or too large, or there is not one pair of texture coordinates for
    /// each vertex.
    pub fn add_alpha_tested_face(
        &mut self,
        outline: &[DVec3],
        uvs: &[[f64; 2]],
        coverage: CoverageId,
    ) -> Result<ElementId, OccludersError> {
        self.add_textured_face(outline, uvs, Opacity::AlphaTested(coverage))
    }

    pub(super) fn add_textured_face(
        &mut self,
        outline: &[DVec3],
        uvs: &[[f64; 2]],
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        if uvs.len() != outline.len() {
            let element = self.next_element();
            let (expected, found) = (outline.len(), uvs.len());
            return Err(OccludersError::TextureCoordinates {
                element,
                expected,
                found,
            });
        }
        self.check_numbers(uvs.iter().flatten().copied())?;
        self.add_face_with(outline, uvs, opacity)
    }

    fn add_face_with(
        &mut self,
        outline: &[DVec3],
        uvs: &[[f64; 2]],
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        self.check_numbers(outline.iter().flat_map(|vertex| vertex.to_array()))?;
        self.check_room(outline.len())?;
        let first = self.occluders.triangles.len() as u32;
        let element = self.occluders.elements.len() as u32;
        let triangles = triangulate(outline).map_err(|TooManyCrossings { corners }| {
            OccludersError::TooManyCrossings {
                element: element as usize,
                corners,
            }
        })?;
        for corners in triangles {
            let positions = corners.map(|corner| corner.position);
            let axis = Plane::Points(positions).dominant_axis().unwrap_or(NO_AXIS);
            let (is_opaque, alpha_test) = self.presence(opacity, uvs, &corners);
            if let (Opacity::Filtering(_), Some(uvs)) = (opacity, uvs_of(uvs, &corners)) {
                let triangle = self.occluders.triangles.len() as u32;
                self.occluders.filter_uvs.push((triangle, uvs));
            }
            let triangle = Triangle {
                vertices: positions.map(|position| self.vertex(position)),
                corners: corners.map(|corner| corner.outline_index.unwrap_or(NO_CORNER)),
                element,
                axis,
                is_opaque,
                alpha_test,
            };
            self.occluders.triangles.push(triangle);
        }
        let end = self.occluders.triangles.len() as u32;
        self.occluders.elements.push(Element {
            kind: ElementKind::Face,
            surfaces: first..end,
            opacity,
        });
        Ok(ElementId(element))
    }

    /// Adds a sphere. A zero radius makes a surface that is never hit.
    ///
    /// # Errors
    /// A number is not finite or too large, or the radius is negative.
    pub fn add_sphere(
        &mut self,
        sphere: Sphere,
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        self.check_numbers(sphere.center.to_array().into_iter().chain([sphere.radius]))?;
        self.check_radius(sphere.radius)?;
        self.add_curved(
            ElementKind::Sphere,
            vec![CurvedShape::Sphere(sphere)],
            opacity,
        )
    }

    /// Adds a truncated cone or cylinder, open or closed. Equal ends make surfaces that are never
    /// hit.
    ///
    /// # Errors
    /// A number is not finite or too large, or a radius is negative.
    pub fn add_cone(&mut self, cone: Cone, opacity: Opacity) -> Result<ElementId, OccludersError> {
        let Cone {
            base,
            base_radius,
            apex,
            apex_radius,
            is_closed,
        } = cone;
        let numbers = base.to_array().into_iter().chain(apex.to_array());
        self.check_numbers(numbers.chain([base_radius, apex_radius]))?;
        self.check_radius(base_radius)?;
        self.check_radius(apex_radius)?;
        let mut shapes = vec![CurvedShape::Tube(cone)];
        if is_closed {
            let cap = |center, radius, normal_tip, normal_tail| {
                CurvedShape::Cap(
                    DiskPlane {
                        center,
                        normal_tip,
                        normal_tail,
                        radius,
                    },
                    cone,
                )
            };
            // An end of radius zero is a tip, which the wall closes by itself.
            if base_radius > 0.0 {
                shapes.push(cap(base, base_radius, base, apex));
            }
            if apex_radius > 0.0 {
                shapes.push(cap(apex, apex_radius, apex, base));
            }
        }
        let kind = if is_closed {
            ElementKind::ClosedCone
        } else {
            ElementKind::OpenCone
        };
        self.add_curved(kind, shapes, opacity)
    }

    /// Adds a disk. A zero normal or radius makes a surface that is never hit.
    ///
    /// # Errors
    /// A number is not finite or too large, or the radius is negative.
    pub fn add_disk(&mut self, disk: Disk, opacity: Opacity) -> Result<ElementId, OccludersError> {
        let Disk {
            center,
            normal,
            radius,
        } = disk;
        let numbers = center.to_array().into_iter().chain(normal.to_array());
        self.check_numbers(numbers.chain([radius]))?;
        self.check_radius(radius)?;
        let plane = DiskPlane {
            center,
            normal_tip: normal,
            normal_tail: DVec3::ZERO,
            radius,
        };
        let axis = plane
            .plane()
            .dominant_axis()
            .filter(|_| radius > 0.0)
            .unwrap_or(NO_AXIS);
        self.add_curved(
            ElementKind::Disk,
            vec![CurvedShape::Disk(plane, axis)],
            opacity,
        )
    }

    /// Adds a patch. Its parts are surfaces of their own; degenerate parts are never hit.
    ///
    /// # Errors
    /// A number is not finite or too large, or the level is.
    pub fn add_patch(
        &mut self,
        patch: &BezierPatch,
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        self.check_numbers(patch.points().flat_map(|point| point.to_array()))?;
        if patch.level > MAX_PATCH_LEVEL {
            return Err(OccludersError::PatchLevel {
                element: self.next_element(),
                level: patch.level,
            });
        }
        let parts = parts_of(patch).into_iter();
        let shapes = parts.map(|part| CurvedShape::Part(Arc::new(part)));
        self.add_curved(ElementKind::Patch, shapes.collect(), opacity)
    }

    /// Adds an implicit surface.
    ///
    /// # Errors
    /// [`Implicit::check`] refuses it.
    pub fn add_implicit(
        &mut self,
        implicit: &Implicit,
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        implicit
            .check()
            .map_err(|source| OccludersError::Implicit {
                element: self.next_element(),
                source,
            })?;
        let level = CurvedShape::Level(Arc::new(Level::new(implicit.clone())));
        self.add_curved(ElementKind::Implicit, vec![level], opacity)
    }

    /// Finishes: curved surfaces get their ids behind those of the triangles.
    pub fn build(self) -> Occluders {
        let mut occluders = self.occluders;
        let triangle_count = occluders.triangles.len() as u32;
        for index in self.curved_elements {
            let surfaces = &mut occluders.elements[index].surfaces;
            *surfaces = surfaces.start + triangle_count..surfaces.end + triangle_count;
        }
        occluders
    }

    fn add_curved(
        &mut self,
        kind: ElementKind,
        shapes: Vec<CurvedShape>,
        opacity: Opacity,
    ) -> Result<ElementId, OccludersError> {
        self.check_room(shapes.len())?;
        let element = self.occluders.elements.len();
        let first = self.occluders.curved.len() as u32;
        let is_opaque = opacity.blocks();
        let common = match shapes.first() {
            // Every part of a patch has a rule of its own.
            None | Some(CurvedShape::Part(_)) => None,
            Some(first) => Some(self.solid(first, is_opaque)),
        };
        for shape in shapes {
            let solid = common.unwrap_or_else(|| self.solid(&shape, is_opaque));
            let curved = Curved {
                shape,
                element: element as u32,
                solid,
                is_opaque,
            };
            self.occluders.curved.push(curved);
        }
        let end = self.occluders.curved.len() as u32;
        self.occluders.elements.push(Element {
            kind,
            surfaces: first..end,
            opacity,
        });
        self.curved_elements.push(element);
        Ok(ElementId(element as u32))
    }

    /// Returns the number of the solid that a shape of the next element is or is part of.
    fn solid(&mut self, shape: &CurvedShape, is_opaque: bool) -> u32 {
        let next = self.occluders.solids.len() as u32;
        let solid = match solid_key(shape) {
            Some(key) => *self.solid_of.entry(key).or_insert(next),
            None => next,
        };
        if solid == next {
            let element = ElementId(self.next_element() as u32);
            self.occluders.solids.push(Solid { element, is_opaque });
        } else {
            self.occluders.solids[solid as usize].is_opaque |= is_opaque;
        }
        solid
    }

    /// Returns whether a triangle blocks anywhere, and notes where its holes are looked up, if it has any.
    fn presence(
        &mut self,
        opacity: Opacity,
        uvs: &[[f64; 2]],
        corners: &[PolygonCorner; 3],
    ) -> (bool, u32) {
        let Opacity::AlphaTested(coverage) = opacity else {
            return (opacity.blocks(), NO_ALPHA_TEST);
        };
        let Some([a, b, c]) = uvs_of(uvs, corners) else {
            return (true, NO_ALPHA_TEST);
        };
        let bound =
            |choose: fn(f64, f64) -> f64| std::array::from_fn(|i| choose(choose(a[i], b[i]), c[i]));
        let (low, high) = (bound(f64::min), bound(f64::max));
        let is_solid = self.occluders.coverages[coverage.0 as usize].is_solid_throughout(low, high);
        if is_solid == Some(true) {
            return (true, NO_ALPHA_TEST);
        }
        self.occluders.alpha_tests.push(AlphaTest {
            coverage,
            uvs: [a, b, c],
        });
        // A hole all over blocks nothing, and camera rays go through it as through any hole.
        let alpha_test = self.occluders.alpha_tests.len() as u32 - 1;
        (is_solid.is_none(), alpha_test)
    }

    pub(super) fn vertex(&mut self, position: DVec3) -> u32 {
        let Self {
            occluders: Occluders { positions, .. },
            vertices,
            hashing,
            ..
        } = self;
        let found = vertices.entry(
            hash_of(hashing, position),
            |&vertex| positions[vertex as usize] == position,
            |&vertex| hash_of(hashing, positions[vertex as usize]),
        );
        match found {
            Entry::Occupied(vertex) => *vertex.get(),
            Entry::Vacant(place) => {
                let next = positions.len() as u32;
                place.insert(next);
                positions.push(position);
                next
            }
        }
    }

    fn check_numbers(&self, numbers: impl IntoIterator<Item = f64>) -> Result<(), OccludersError> {
        let is_bad = |value: &f64| !value.is_finite() || value.abs() > LARGEST;
        match numbers.into_iter().find(is_bad) {
            None => Ok(()),
            Some(value) => Err(OccludersError::BadNumber {
                element: self.next_element(),
                value,
            }),
        }
    }

    fn check_radius(&self, value: f64) -> Result<(), OccludersError> {
        if value < 0.0 {
            return Err(OccludersError::NegativeRadius {
                element: self.next_element(),
                value,
            });
        }
        Ok(())
    }

    pub(super) fn check_room(&self, added: usize) -> Result<(), OccludersError> {
        // An outline of n vertices makes fewer than n triangles, with crossings at most n^2 more.
        let taken = self
            .occluders
            .surface_count()
            .max(self.occluders.positions.len());
        if taken.saturating_add(added.saturating_mul(4)) >= u32::MAX as usize / 2 {
            return Err(OccludersError::TooMany {
                element: self.next_element(),
            });
        }
        Ok(())
    }

    fn next_element(&self) -> usize {
        self.occluders.elements.len()
    }
}

/// Returns texture coordinates of a triangle's corners, if all of them are corners of the outline.
fn uvs_of(uvs: &[[f64; 2]], corners: &[PolygonCorner; 3]) -> Option<[[f64; 2]; 3]> {
    let uv_of = |corner: &PolygonCorner| uvs.get(corner.outline_index? as usize).copied();
    let [a, b, c] = corners.each_ref().map(uv_of);
    Some([a?, b?, c?])
}

fn hash_of(hashing: &DefaultHashBuilder, position: DVec3) -> u64 {
    // Adding zero makes -0 equal to 0.
    let key = (position + DVec3::ZERO).to_array().map(f64::to_bits);
    hashing.hash_one(key)
}

/// Equal for shapes with the same numbers; open and closed cones differ. `None` for those that are nothing but themselves.
fn solid_key(shape: &CurvedShape) -> Option<Vec<u64>> {
    let mut key = Vec::new();
    let mut add = |kind: u64, numbers: &[f64]| {
        key.push(kind);
        key.extend(numbers.iter().map(|number| (number + 0.0).to_bits()));
    };
    match shape {
        CurvedShape::Sphere(Sphere { center: c, radius }) => add(0, &[c.x, c.y, c.z, *radius]),
        CurvedShape::Tube(Cone {
            base: b,
            base_radius,
            apex: a,
            apex_radius,
            is_closed,
        }) => {
            let numbers = [b.x, b.y, b.z, *base_radius, a.x, a.y, a.z, *apex_radius];
            add(1 + u64::from(*is_closed), &numbers);
        }
        CurvedShape::Cap(disk, _) | CurvedShape::Disk(disk, _) => {
            let (c, n) = (disk.center, disk.normal());
            add(3, &[c.x, c.y, c.z, n.x, n.y, n.z, disk.radius]);
        }
        CurvedShape::Part(_) | CurvedShape::Level(_) => return None,
    }
    Some(key)
}

impl Occluders {
    /// Starts a collection.
    pub fn builder() -> OccludersBuilder {
        OccludersBuilder::default()
    }
}
