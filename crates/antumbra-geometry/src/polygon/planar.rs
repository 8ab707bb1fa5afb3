//! A triangulation in the plane.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2};

/// One corner of a triangle: a vertex of the outline, or a new point where the outline crosses
/// itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolygonCorner {
    pub(crate) position: DVec3,
    /// Index into the outline, if it is one of its vertices.
    pub(crate) outline_index: Option<u32>,
}

pub(super) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

pub(super) struct PlanarVertex {
    pub(super) flat: Point2<f64>,
    pub(super) corner: PolygonCorner,
}

pub(super) type Planar = ConstrainedDelaunayTriangulation<PlanarVertex>;

impl HasPosition for PlanarVertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.flat
    }
}
