//! What the rounding of coordinates can make of a point's distance from a surface.
//!
//! In: a point, a surface, the precision of the coordinates. Out: how far rounding may have moved the point. It
//! says which surface a point is meant to lie on and decides no answer. Invariant: only the point and that one
//! surface count, never where the rest of the scene lies.

use glam::DVec3;

use super::nearest::Gap;
use super::{CurvedShape, NO_AXIS, Occluders, Surface, SurfaceId};
use crate::segment::largest_move_onto;

/// How finely the coordinates of points are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// As `f32`.
    Single,
    /// As `f64`.
    #[default]
    Double,
}

impl Precision {
    /// Returns by how much of itself a coordinate may be rounded.
    ///
    /// `f32`: 2^-21, eight roundings of 2^-24. A point made of corners and weights has six at most: two of the
    /// weights, one of a product, two of sums, one of the corners themselves. `f64`: 2^-42, some two thousand of
    /// 2^-53, as after a chain of transformations, or a ray's hit seen from a hundred times as far.
    pub const fn share(self) -> f64 {
        match self {
            Self::Single => 1.0 / (1u64 << 21) as f64,
            Self::Double => 1.0 / (1u64 << 42) as f64,
        }
    }
}

/// Rounding that larger coordinates left in a small one counts up to this share of the surface's extent: of
/// points that are rounded more coarsely what they lie on is not known.
const RESOLVED: f64 = 1.0 / 16.0;

impl Occluders {
    /// Returns how far rounding may have moved a point of a surface, along each axis.
    ///
    /// That is the precision's [share](Precision::share) of the largest magnitude which the coordinate has at the
    /// point or anywhere on the surface. It is at least the same share of the largest coordinate of all, which may
    /// have cancelled, but no more of that than a sixteenth of the surface's extent.
    pub fn rounding(
        &self,
        surface: SurfaceId,
        point_in_world: DVec3,
        precision: Precision,
    ) -> DVec3 {
        let bounds = self.surface_bounds(surface);
        let ends = bounds.min.abs().max(bounds.max.abs());
        let each = point_in_world.abs().max(ends) * precision.share();
        let cancelled = (RESOLVED * bounds.size().max_element()).min(each.max_element());
        each.max(DVec3::splat(cancelled))
    }

    /// Returns how far from a surface rounding may have moved a point that lies on it, in the direction in which
    /// the point is off: what [`Occluders::is_on`] allows. 0 for a degenerate surface.
    pub fn allowed(&self, surface: SurfaceId, point_in_world: DVec3, precision: Precision) -> f64 {
        let rounding = self.rounding(surface, point_in_world, precision);
        self.gap(surface, point_in_world)
            .map_or(0.0, |gap| gap.rounding(rounding))
    }

    /// Returns an upper bound of [`Gap::rounding`] for all surfaces.
    pub fn largest_rounding(&self, point_in_world: DVec3, precision: Precision) -> f64 {
        let bounds = self.bounds();
        let ends = bounds.min.abs().max(bounds.max.abs());
        let largest = point_in_world.abs().max(ends).max_element();
        // The sum over the axes bounds the length.
        if largest.is_finite() {
            3.0 * precision.share() * largest
        } else {
            0.0
        }
    }

    /// Returns whether a point is on a surface up to the rounding of its coordinates. No point is off a degenerate
    /// surface, which holds no start.
    #[inline]
    pub fn is_on(&self, surface: SurfaceId, point_in_world: DVec3, precision: Precision) -> bool {
        // Most points: moved along one axis onto the triangle by less than all axes grant.
        if let Surface::Triangle(triangle) = self.surface(surface)
            && triangle.axis != NO_AXIS
        {
            let corners = self.positions_of(triangle);
            let moved = largest_move_onto(point_in_world, corners, usize::from(triangle.axis));
            let extent = (corners[1] - corners[0]).abs().max_element();
            let largest = point_in_world.abs().max_element();
            if moved <= precision.share() * largest && moved <= RESOLVED * extent {
                return true;
            }
        }
        self.is_on_as_measured(surface, point_in_world, precision)
    }

    #[inline(never)]
    fn is_on_as_measured(&self, surface: SurfaceId, point: DVec3, precision: Precision) -> bool {
        self.gap(surface, point).is_none_or(|gap| {
            gap.distance <= gap.rounding(self.rounding(surface, point, precision))
        })
    }

    /// Returns whether a point is surely within `reach` of a curved surface or a disk; of triangles, which starts
    /// are moved onto exactly, nothing is asked.
    pub fn is_surely_near_curved(&self, surface: SurfaceId, point: DVec3, reach: f64) -> bool {
        let Surface::Curved(curved) = self.surface(surface) else {
            return true;
        };
        if let CurvedShape::Level(level) = &curved.shape {
            return level.is_near(point);
        }
        let Some(gap) = self.gap(surface, point) else {
            return false;
        };
        // Every distance is that from a point which is on the surface up to 2^-49 of the lengths that it is made
        // of. Only at the axis of a tube may it be off by more: by twice the distance.
        let lengths = curved.shape.bounds().size().max_element();
        3.0 * gap.distance + lengths / (1u64 << 45) as f64 <= reach
    }
}

impl Gap {
    /// Returns how much of `rounding`, a length along each axis, points along the gap.
    pub fn rounding(&self, rounding: DVec3) -> f64 {
        rounding.dot(self.direction.abs())
    }
}
