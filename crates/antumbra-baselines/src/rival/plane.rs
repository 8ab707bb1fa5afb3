//! A plane of cells before a light, and where it sees from.

use antumbra_geometry::DVec3;

/// Margin of cells round a point.
pub(super) const POINT_MARGIN: f64 = 1.0 / (1 << 22) as f64;

/// Largest error of a start, as a share of its distance from a point.
pub(super) const POINT_ERROR: f64 = 1.0 / (1 << 26) as f64;

/// Margin and largest error for directions, as shares of the scene's scale.
pub(super) const DIRECTION_MARGIN: f64 = 1.0 / (1u64 << 36) as f64;

pub(super) const DIRECTION_ERROR: f64 = 1.0 / (1u64 << 38) as f64;

/// Boxes of curved surfaces are right up to rounding only.
pub(super) const BOX_MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

pub(super) const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// More than products of coordinates lose by underflow.
pub(super) const UNDERFLOW: f64 = 1e-290;

/// One plane of cells.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub(super) eye: Eye,
    /// The axes of `p`, of `q` and of depth.
    pub(super) axes: [usize; 3],
    /// 1 if depth grows along its axis, else -1.
    pub(super) sign: f64,
    /// The rectangle of all cells: where the scene is.
    pub(super) from: [f64; 2],
    pub(super) cell: [f64; 2],
    pub(super) margin: f64,
    /// Cells along each side, a power of two.
    pub(super) resolution: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Eye {
    Point(DVec3),
    /// Origin of places, and the slopes of the direction along `p` and `q`.
    Direction(DVec3, [f64; 2]),
}

/// A rectangle of cells, inflated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
}

impl Region {
    pub(super) fn corners(&self) -> [DVec3; 4] {
        let Self { from, to } = *self;
        [
            DVec3::new(from[0], from[1], 1.0),
            DVec3::new(to[0], from[1], 1.0),
            DVec3::new(from[0], to[1], 1.0),
            DVec3::new(to[0], to[1], 1.0),
        ]
    }
}
