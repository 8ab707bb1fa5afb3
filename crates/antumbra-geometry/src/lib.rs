//! Shapes, exact predicates and intersections.
//!
//! Floor 0 of the project: vectors, boxes, shapes, light shapes and the rule of EXACTNESS.md.
//! Absent here: files, threads, logs, materials, grids.

mod bounds;
mod coverage;
mod flat;
mod intersect;
mod light;
mod mesh;
mod number;
mod occluders;
mod patch;
mod polygon;
mod ray;
mod segment;
mod shape;
mod umbra;

pub use bounds::Bounds;
pub use coverage::{Coverage, CoverageId};
pub use glam::{DVec2, DVec3};
pub use light::LightShape;
pub use mesh::{Mesh, MeshEdge, NO_COMPONENT, NO_EDGE};
pub use occluders::{
    Element, ElementId, ElementKind, Gap, Occluders, OccludersBuilder, OccludersError, Opacity,
    Precision, StartTriangle, SurfaceId, UnidentifiedCoverage,
};
pub use patch::Patch;
pub use ray::{Hit, Ray, Start};
pub use segment::Segment;
pub use shape::{Cone, Disk, Sphere};
pub use umbra::{Relation, Shaft, Umbra};
