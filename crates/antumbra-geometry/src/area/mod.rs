//! Lights with size: shapes, and the points and directions that stand for them.
//!
//! In: a shape, a receiver point, two numbers in `[0, 1)`. Out: an [`AreaSample`], a point or a
//! direction that shadow queries are asked about (EXACTNESS.md, "Lights with size"; Paper 9.3).
//! Invariants: mappings preserve area, length or solid angle; every bit is the same on every
//! machine. Power and colour belong to the scene. Absent here: shadow queries.
//!
//! | module | shape |
//! |---|---|
//! | `segment`, `rectangle`, `polygon`, `triangle`, `disk`, `sphere` | lights given by numbers |
//! | `sun_disc`, `sky` | directions |
//! | `mesh` | emitting triangles of the scene |
//! | `warp` | square to disk, square to cap |
//! | `pattern` | which numbers sample `i` of a receiver point has |

mod disk;
mod mesh;
mod pattern;
mod polygon;
mod rectangle;
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

use crate::light::LightShape;

pub use disk::DiskLight;
pub use mesh::MeshLight;
pub use pattern::{MAX_LIGHT_SAMPLES, SamplePattern};
pub use polygon::PolygonLight;
pub use rectangle::RectangleLight;
pub use segment::SegmentLight;
pub use sky::Sky;
pub use sphere::SphereLight;
pub use sun_disc::SunDisc;
pub use triangle::TriangleLight;

/// Largest coordinate of a light.
const LARGEST: f64 = (1_u128 << 100) as f64;

/// Why a light with size is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AreaError {
    /// A number is NaN, infinite or too large.
    #[error("{what} is not finite, or beyond 2^100")]
    BadNumber {
        /// Part that has the number, such as `a corner`.
        what: &'static str,
    },
    /// The light has no length, no area or no direction.
    #[error("{what}: use a point light for a light without size")]
    NoSize {
        /// Reason, such as `its radius is zero`.
        what: &'static str,
    },
    /// A direction is zero.
    #[error("{what} is zero; expected a direction")]
    BadDirection {
        /// Vector that is zero, such as `the normal`.
        what: &'static str,
    },
    /// A radius is negative.
    #[error("the radius is {0}; expected above 0")]
    BadRadius(f64),
    /// An angular diameter is out of range.
    #[error("the angular diameter is {0} degrees; expected above 0, below 180")]
    BadDiameter(f64),
    /// A polygon has fewer than three corners.
    #[error("a polygon needs at least 3 corners, found {0}")]
    TooFewCorners(usize),
    /// A polygon is not convex, or goes around more than once.
    #[error(
        "the polygon is not convex at corner {corner}; cut it into convex ones, or into triangles"
    )]
    NotConvex {
        /// The corner's number, from 0.
        corner: usize,
    },
    /// The corners of a polygon are not in one plane.
    #[error("corner {corner} lies off the polygon's plane; cut the polygon into triangles")]
    NotFlat {
        /// The corner's number, from 0.
        corner: usize,
    },
}

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

/// One sample of a light, for one receiver point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// Point or direction that the shadow query asks about.
    pub target: LightShape,
    /// Cosine (sine, for segments) of the angle at which the light is left: 0 to 1. It is 1 for spheres, sun discs
    /// and the sky.
    pub emitted: f64,
    /// Steradians that the whole light would fill for the receiver if all of it were like this sample: its
    /// area times `emitted` over the square of the distance. For segments length stands for area. The
    /// mean over all samples is the light's solid angle.
    pub solid_angle: f64,
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

/// A plane that shines: what flat lights share.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Emitter {
    /// A point of the plane.
    origin: DVec3,
    /// Unit length, up to rounding.
    normal: DVec3,
    /// In square units.
    area: f64,
    is_two_sided: bool,
}

impl Emitter {
    /// Makes a plane from a normal of any length; the light's area is given apart.
    fn new(origin: DVec3, normal: DVec3, area: f64, is_two_sided: bool) -> Result<Self, AreaError> {
        let none = AreaError::NoSize {
            what: "it has no area",
        };
        let length = normal.length();
        if !(length > 0.0 && length.is_finite() && area > 0.0 && area.is_finite()) {
            return Err(none);
        }
        let normal = normal / length;
        if !normal.is_normalized() {
            return Err(none);
        }
        Ok(Self {
            origin,
            normal,
            area,
            is_two_sided,
        })
    }

    /// Returns a point of the light as a sample, if the light shines towards the receiver.
    fn sample(&self, receiver: DVec3, point: DVec3) -> Option<AreaSample> {
        let side = LightShape::Point(receiver).side_of(self.origin, self.normal);
        if side == 0 || (side < 0 && !self.is_two_sided) {
            return None;
        }
        Some(from_plane(receiver, point, self.normal, self.area))
    }
}

/// Returns a point of a plane that shines towards the receiver.
fn from_plane(receiver: DVec3, point: DVec3, unit_normal: DVec3, area: f64) -> AreaSample {
    let back = receiver - point;
    let square = back.length_squared();
    let emitted = if square > 0.0 {
        (unit_normal.dot(back).abs() / square.sqrt()).min(1.0)
    } else {
        0.0
    };
    AreaSample {
        target: LightShape::Point(point),
        emitted,
        solid_angle: solid_angle(area, emitted, square),
    }
}

/// Returns the steradians of a light of some area that is seen everywhere as at this distance and angle; 0 at the
/// light itself. For a near and large light single samples may be of more than a half sphere; their mean is not.
fn solid_angle(area: f64, emitted: f64, square_of_distance: f64) -> f64 {
    let angle = area * emitted / square_of_distance;
    if angle.is_finite() { angle } else { 0.0 }
}

/// Refuses points that queries refuse.
fn check_point(point: DVec3, what: &'static str) -> Result<(), AreaError> {
    // Not for NaN.
    if point.abs().cmple(DVec3::splat(LARGEST)).all() {
        Ok(())
    } else {
        Err(AreaError::BadNumber { what })
    }
}

fn check_radius(radius: f64) -> Result<(), AreaError> {
    if radius.is_nan() || radius > LARGEST {
        return Err(AreaError::BadNumber { what: "the radius" });
    }
    if radius == 0.0 {
        return Err(AreaError::NoSize {
            what: "its radius is zero",
        });
    }
    if radius < 0.0 {
        return Err(AreaError::BadRadius(radius));
    }
    Ok(())
}

/// Returns a direction at length one.
fn unit_of(direction: DVec3, what: &'static str) -> Result<DVec3, AreaError> {
    check_point(direction, what)?;
    let largest = direction.abs().max_element();
    if largest == 0.0 {
        return Err(AreaError::BadDirection { what });
    }
    // Short ones would lose bits in squares.
    let scaled = direction / largest;
    Ok(scaled / scaled.length())
}

/// Returns two unit vectors that are perpendicular to a unit vector and to each other (Duff and others 2017).
fn frame_of(axis: DVec3) -> [DVec3; 2] {
    let sign = 1.0_f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    [
        DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
        DVec3::new(b, sign + axis.y * axis.y * a, -axis.y),
    ]
}
