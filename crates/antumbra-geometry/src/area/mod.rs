//! Lights with size: shapes, and the points and directions that stand for them.
//!
//! In: a shape, a receiver point, two numbers in `[0, 1)`. Out: an [`AreaSample`], a point or a
//! direction that shadow queries are asked about (EXACTNESS.md, "Lights with size"; Paper 9.3).
//! Invariants: mappings preserve area, length or solid angle; every bit is the same on every
//! machine. Power and color belong to the scene. Absent here: shadow queries.
//!
//! | module | shape |
//! |---|---|
//! | `shape` | any of them |
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
mod shape;
mod sky;
mod sphere;
mod sun_disc;
#[cfg(test)]
mod tests;
mod triangle;
mod warp;

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
pub use shape::AreaShape;
pub use sky::Sky;
pub use sphere::SphereLight;
pub use sun_disc::SunDisc;
pub use triangle::TriangleLight;
