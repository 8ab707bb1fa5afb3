//! A point that is seen, and what shading needs to know there.

use antumbra_geometry::{DVec3, Hit, Ray};

use crate::prepare::Relief;

/// A hit with its normals.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'a> {
    /// The hit.
    pub hit: Hit,
    /// Unit normal by winding, or outwards.
    pub geometric_normal: DVec3,
    /// Unit normal for shading, on the same side.
    pub shading_normal: DVec3,
    /// Unit vector back along the ray.
    pub towards_viewer: DVec3,
    /// Which side is looked at: 1 the side of the geometric normal, -1 the other, 0 edge-on.
    pub viewer_side: i8,
    /// The relief of the surface here, which `shading_normal` has in it.
    pub relief: Option<Relief<'a>>,
}

impl SurfacePoint<'_> {
    /// Returns the ray that leaves the surface here.
    pub(super) fn ray_towards(&self, direction: DVec3) -> Ray {
        Ray {
            origin: self.hit.point,
            direction,
            leaves: Some(self.hit.surface),
        }
    }
}
