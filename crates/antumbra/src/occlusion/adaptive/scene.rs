//! What is worked with while values are computed.

use antumbra_geometry::Occluders;

use crate::accel::bvh::Bvh;

/// What is worked with while values are made.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
}
