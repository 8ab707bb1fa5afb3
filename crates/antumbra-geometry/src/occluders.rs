//! All surfaces of a scene, as the accelerator sees them.
//!
//! In: faces and analytic shapes, one *element* each (the paper's "objects"). Out: numbered
//! *surfaces* that rays and queries name: the triangles of the faces first, then spheres, tubes
//! and disks. Invariant: vertices with equal positions have one index; numbers are finite and at
//! most 2^100 in magnitude.

use std::ops::Range;

use glam::DVec3;

use crate::{Bounds, Cone, Disk, Sphere};

/// Names one surface: a triangle of a face, a sphere, a tube (cone wall) or a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceId(pub u32);

/// Names one element: a face, a sphere, a cone or a disk. Numbered in the order of adding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId(pub u32);

/// Whether a surface stops light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// Blocks shadow rays.
    Opaque,
    /// Receives shadows and blocks none.
    Transparent,
}

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// A polygon, cut into triangles.
    Face,
    /// A sphere.
    Sphere,
    /// An open cone or cylinder.
    OpenCone,
    /// A cone or cylinder with caps.
    ClosedCone,
    /// A disk.
    Disk,
}

/// One object of the scene in the paper's sense.
#[derive(Clone, Debug)]
pub struct Element {
    /// What it is.
    pub kind: ElementKind,
    /// Its surfaces, a run of ids.
    pub surfaces: Range<u32>,
    /// Whether it stops light.
    pub opacity: Opacity,
}

/// What is wrong with a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OccludersError {
    /// A number is NaN, infinite or beyond 2^100.
    #[error("element {element}: coordinate {value} is not finite or its magnitude exceeds 2^100")]
    BadNumber {
        /// The element's number, in the order of adding.
        element: usize,
        /// The number itself.
        value: f64,
    },
    /// More than `u32::MAX` surfaces.
    #[error("more than {} surfaces", u32::MAX)]
    TooMany,
}

/// Collects elements.
#[derive(Debug, Default)]
pub struct OccludersBuilder {}

/// All surfaces of a static scene.
#[derive(Debug)]
pub struct Occluders {}

impl OccludersBuilder {
    /// Adds a planar polygon with its vertices in order; needs not be convex. Self-crossing
    /// outlines are filled by the even-odd rule.
    ///
    /// # Errors
    /// A coordinate is not finite or too large.
    pub fn add_face(&mut self, _outline: &[DVec3], _opacity: Opacity) -> Result<ElementId, OccludersError> {
        todo!()
    }

    /// Adds a sphere.
    ///
    /// # Errors
    /// A number is not finite or too large.
    pub fn add_sphere(&mut self, _sphere: Sphere, _opacity: Opacity) -> Result<ElementId, OccludersError> {
        todo!()
    }

    /// Adds a truncated cone or cylinder, open or closed.
    ///
    /// # Errors
    /// A number is not finite or too large.
    pub fn add_cone(&mut self, _cone: Cone, _opacity: Opacity) -> Result<ElementId, OccludersError> {
        todo!()
    }

    /// Adds a disk.
    ///
    /// # Errors
    /// A number is not finite or too large.
    pub fn add_disk(&mut self, _disk: Disk, _opacity: Opacity) -> Result<ElementId, OccludersError> {
        todo!()
    }

    /// Finishes.
    pub fn build(self) -> Occluders {
        todo!()
    }
}

impl Occluders {
    /// Starts a collection.
    pub fn builder() -> OccludersBuilder {
        OccludersBuilder::default()
    }

    /// Returns how many surfaces there are.
    pub fn surface_count(&self) -> usize {
        todo!()
    }

    /// Returns how many of the surfaces are triangles; their ids come first.
    pub fn triangle_count(&self) -> usize {
        todo!()
    }

    /// Returns all elements in the order of adding.
    pub fn elements(&self) -> &[Element] {
        todo!()
    }

    /// Returns the element a surface belongs to.
    pub fn element_of(&self, _surface: SurfaceId) -> ElementId {
        todo!()
    }

    /// Returns the three corners of a triangle as indices into the outline given to `add_face`, or
    /// `None` if the surface is no triangle or a corner is a crossing point of the outline.
    pub fn corners(&self, _surface: SurfaceId) -> Option<[u32; 3]> {
        todo!()
    }

    /// Returns the unit normal of a surface at a point on it: by the winding for triangles,
    /// outwards for curved shapes, as given for disks (outwards for caps).
    pub fn normal_at(&self, _surface: SurfaceId, _point_in_world: DVec3) -> DVec3 {
        todo!()
    }

    /// Returns the box around everything.
    pub fn bounds(&self) -> Bounds {
        todo!()
    }
}
