//! Shapes, exact predicates and intersections.
//!
//! Floor 1 of the project: vectors, boxes, shapes, light shapes and the rule of EXACTNESS.md.
//! Absent here: files, threads, logs, materials, grids.

mod along;
mod area;
mod bounds;
mod coverage;
mod filter;
mod flat;
mod freeform;
mod ids;
mod intersect;
mod light;
mod lit;
mod mesh;
mod number;
mod occluders;
mod patch;
mod polygon;
mod ray;
mod segment;
mod shape;
mod short;
mod umbra;

pub use along::{KnownStretch, SegmentShadows};
pub use area::{
    AreaError, AreaSample, AreaShape, Directions, DiskLight, Emission, EmittingPoint,
    MAX_LIGHT_SAMPLES, MeshLight, PolygonLight, RectangleLight, SamplePattern, SegmentLight, Sky,
    SphereLight, SunDisc, TriangleLight,
};
pub use bounds::Bounds;
pub use coverage::{Coverage, CoverageId};
pub use filter::{Filter, FilterId, Tint};
pub use freeform::{
    Ball, BezierPatch, Field, Implicit, ImplicitError, MAX_DEGREE, MAX_PATCH_LEVEL, MAX_TERMS, Term,
};
pub use glam::{DVec2, DVec3};
pub use ids::LightId;
pub use light::LightShape;
pub use lit::{Horizon, LightView, MOST_BLOCKERS, MOST_SPANS, Meeting, Shares};
pub use mesh::{Mesh, MeshEdge, NO_COMPONENT, NO_EDGE};
pub use occluders::{
    Element, ElementId, ElementKind, Gap, Occluders, OccludersBuilder, OccludersError, Opacity,
    OwnRule, Precision, ReceiverTriangle, SurfaceId, SurfacePlane, UnidentifiedCoverage,
    sides_of_normal,
};
pub use patch::Patch;
pub use ray::{Hit, Ray, ReceiverPoint};
pub use segment::Segment;
pub use shape::{Cone, Disk, Sphere};
pub use short::Short;
pub use umbra::{Relation, Shaft, Umbra};
