//! Surfaces, tables and the tree, as values are computed with them.

use antumbra_geometry::Occluders;

use crate::accel::bvh::Bvh;

/// Surfaces, tables and the tree, as values are made with them.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
}
