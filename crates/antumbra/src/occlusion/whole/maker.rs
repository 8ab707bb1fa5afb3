//! What values of a light are made with, and what is found out.

use antumbra_geometry::{Mesh, SurfaceId};

use super::super::adaptive::Scene;
use super::super::lattice::Lattice;
use super::hull::LightHull;
use crate::accel::bvh::Leaf;
use crate::accel::frame::Frame;

/// A surface that may block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) surface: SurfaceId,
    pub(super) leaf: Leaf,
}

/// Makes values of a light.
pub(super) struct Maker<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) frame: &'a Frame,
    pub(super) lattice: &'a Lattice,
    pub(super) level: u32,
    pub(super) hull: &'a LightHull,
    /// Of each triangle the side that all of the light is on.
    pub(super) sides: &'a [i8],
    pub(super) mesh: &'a Mesh,
}

/// What is found out.
pub(super) enum Decided {
    Lit,
    Dark,
    Open,
    Listed(Vec<Leaf>),
}
