//! Lights with size: shapes, and the points and directions that stand for them.
//!
//! In: a shape, a receiver point, two numbers in `[0, 1)`. Out: an [`AreaSample`], a point or a
//! direction that shadow queries are asked about (EXACTNESS.md, "Lights with size"; Paper 9.3).
//! Invariants: mappings preserve area, length or solid angle; every bit is the same on every
//! machine. Power and color belong to the scene. Absent here: shadow queries.
//!
//! | module | shape |
//! |---|---|
//! | `segment`, `rectangle`, `polygon`, `triangle`, `disk`, `sphere` | lights given by numbers |
//! | `sun_disc`, `sky` | directions |
//! | `directions` | directions around a receiver point, which are no light |
//! | `emitting` | places of a light without a receiver |
//! | `mesh` | emitting triangles of the scene |
//! | `warp` | square to disk, square to cap |
//! | `pattern` | which numbers sample `i` of a receiver point has |

mod directions;
mod disk;
mod emitting;
mod mesh;
mod pattern;
mod polygon;
mod rectangle;
mod sample;
mod segment;
mod sky;
mod sphere;
mod sun_disc;
#[cfg(test)]
mod tests;
mod triangle;
mod warp;

use std::sync::Arc;

use glam::DVec3;

pub use directions::Directions;
pub use disk::DiskLight;
pub use emitting::{Emission, EmittingPoint};
pub use mesh::MeshLight;
pub use pattern::{MAX_LIGHT_SAMPLES, SamplePattern};
pub use polygon::PolygonLight;
pub use rectangle::RectangleLight;
pub use sample::{AreaError, AreaSample};
use sample::{Emitter, check_point, check_radius, frame_of, from_plane, solid_angle, unit_of};
pub use segment::SegmentLight;
pub use sky::Sky;
pub use sphere::SphereLight;
pub use sun_disc::SunDisc;
pub use triangle::TriangleLight;

/// The shape of a light with size. World space.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AreaShape {
    /// A straight line of light.
    Segment(SegmentLight),
    /// A rectangle or another parallelogram.
    Rectangle(RectangleLight),
    /// A triangle.
    Triangle(TriangleLight),
    /// A convex polygon.
    Polygon(Arc<PolygonLight>),
    /// A flat round disk.
    Disk(DiskLight),
    /// A ball.
    Sphere(SphereLight),
    /// A round patch of directions, as the sun is.
    SunDisc(SunDisc),
    /// The half of all directions around up.
    Sky(Sky),
    /// Emitting triangles.
    Mesh(Arc<MeshLight>),
}

impl AreaShape {
    /// Returns the sample at `u` and `v`, both in `[0, 1)`, for a receiver point, or `None` where the light does
    /// not shine from there towards the point at all.
    pub fn sample(&self, receiver: DVec3, [u, v]: [f64; 2]) -> Option<AreaSample> {
        match self {
            Self::Segment(light) => light.sample(receiver, u),
            Self::Rectangle(light) => light.sample(receiver, u, v),
            Self::Triangle(light) => light.sample(receiver, u, v),
            Self::Polygon(light) => light.sample(receiver, u, v),
            Self::Disk(light) => light.sample(receiver, u, v),
            Self::Sphere(light) => light.sample(receiver, u, v),
            Self::SunDisc(light) => Some(light.sample(u, v)),
            Self::Sky(light) => Some(light.sample(u, v)),
            Self::Mesh(light) => light.sample(receiver, u, v),
        }
    }

    /// Returns the light's size: square units of area; length for segments; steradians for sun disc and sky.
    pub fn size(&self) -> f64 {
        match self {
            Self::Segment(light) => light.length(),
            Self::Rectangle(light) => light.area(),
            Self::Triangle(light) => light.area(),
            Self::Polygon(light) => light.area(),
            Self::Disk(light) => light.area(),
            Self::Sphere(light) => light.area(),
            Self::SunDisc(light) => light.solid_angle(),
            Self::Sky(_) => Sky::SOLID_ANGLE,
            Self::Mesh(light) => light.area(),
        }
    }

    /// Returns what the shape is called: `segment`, `rectangle`, `triangle`, `polygon`, `disk`, `sphere`, `sun`,
    /// `sky` or `mesh`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Segment(_) => "segment",
            Self::Rectangle(_) => "rectangle",
            Self::Triangle(_) => "triangle",
            Self::Polygon(_) => "polygon",
            Self::Disk(_) => "disk",
            Self::Sphere(_) => "sphere",
            Self::SunDisc(_) => "sun",
            Self::Sky(_) => "sky",
            Self::Mesh(_) => "mesh",
        }
    }
}
