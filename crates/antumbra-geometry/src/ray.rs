//! Rays, their hits, and the starts of shadow queries.

use glam::DVec3;

use crate::SurfaceId;

/// A half-line through the scene.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Starting point, world space.
    pub origin: DVec3,
    /// Direction; any length but zero. Hit distances are in units of this length.
    pub direction: DVec3,
    /// The surface it leaves, which is not hit again where it starts.
    pub leaves: Option<SurfaceId>,
}

/// The nearest surface along a ray. Ties go to the lowest surface id.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray direction's length; not negative.
    pub distance: f64,
    /// Surface that was hit.
    pub surface: SurfaceId,
    /// The hit point, world space, rounded.
    pub point: DVec3,
    /// For triangles the weights of the second and third corner; zero for other shapes.
    pub barycentric: [f64; 2],
}

/// A receiver point: where a shadow ray starts (EXACTNESS.md, "The start").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverPoint {
    /// The point, world space.
    pub point: DVec3,
    /// The surface it lies on up to rounding; `None` for a free query.
    pub surface: Option<SurfaceId>,
}
