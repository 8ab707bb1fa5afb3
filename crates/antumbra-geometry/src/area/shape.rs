//! Any light with size.
//!
//! In: one of the shapes. Out: its samples, size and name.

use std::sync::Arc;

use glam::DVec3;

use super::disk::DiskLight;
use super::mesh::MeshLight;
use super::polygon::PolygonLight;
use super::rectangle::RectangleLight;
use super::sample::AreaSample;
use super::segment::SegmentLight;
use super::sky::Sky;
use super::sphere::SphereLight;
use super::sun_disc::SunDisc;
use super::triangle::TriangleLight;

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
