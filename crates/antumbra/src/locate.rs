//! Which surface a point is meant to lie on.
//!
//! In: a point, perhaps a normal, a tolerance. Out: a start on a surface. It says what is asked; what blocks
//! is the exact rule's. Invariant: the start is a function of the scene and the point, whatever the tree, the
//! grid and the threads, and lies as near to its surface as every method assumes.

use antumbra_geometry::{Bounds, DVec3, Start, SurfaceId};

use crate::ShadowIndex;
use crate::grid::Layout;

/// Largest distance taken for rounding, in shares of the scene's size (largest coordinate plus extent):
/// rounding to `f32` moves a coordinate by 2^-24 of itself, so a point by less than 2^-23 of that size.
const ROUNDING: f64 = 1.0 / (1u64 << 22) as f64;

/// The grid's margin in the same shares.
const MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

/// Normals this near to each other agree alike: steps of the cosine.
const AGREEMENTS: f64 = (1u32 << 20) as f64;

impl ShadowIndex {
    /// Returns how far from its surface [`ShadowIndex::start_near`] expects a point by default, in world
    /// units: 2^-22 of the scene's size (its largest coordinate plus its extent), which is more than
    /// rounding to `f32` moves a point.
    pub fn default_tolerance(&self) -> f64 {
        self.margin() / MARGIN * ROUNDING
    }

    /// Returns the start that a point means which is meant to lie on a surface: on the nearest, if that is no
    /// farther than `tolerance` (world units, not negative, infinite for any distance).
    ///
    /// Surfaces tie that are farther than the nearest by no more than `tolerance` and
    /// [`ShadowIndex::default_tolerance`]: at an edge, rounding decides which of them is nearest. With a
    /// `normal` (world space, any length) that one is chosen whose line agrees best with it, then one that
    /// it points out of, then the nearest, then the lowest id. Without, or with a zero normal, it is the
    /// nearest, then the lowest id. Transparent surfaces count, degenerate ones do not; a closed cone's wall
    /// and caps are surfaces of their own. Distances are rounded (`f64`); a point that is not finite is
    /// near nothing.
    ///
    /// The start's point is the given one where it is on the surface up to rounding, or over a triangle or
    /// a disk, onto which the rule of starts (EXACTNESS.md) moves it exactly. Else, beside a triangle or off
    /// a curved surface, it is the surface's nearest point, rounded to `f64`.
    ///
    /// Cost: one or two walks through the tree, or, in an index without one, through the voxels of the grid
    /// around the point.
    pub fn start_near(
        &self,
        point_in_world: DVec3,
        normal: Option<DVec3>,
        tolerance: f64,
    ) -> Option<Start> {
        let (distance, surface) = self.nearest_surface(point_in_world, normal, tolerance)?;
        // What every method assumes of starts, with room for the rounding of the distance.
        if distance <= 0.25 * self.margin() {
            return Some(Start {
                point: point_in_world,
                surface: Some(surface),
            });
        }
        Some(self.occluders().start_on(surface, point_in_world))
    }

    fn nearest_surface(
        &self,
        point_in_world: DVec3,
        normal: Option<DVec3>,
        tolerance: f64,
    ) -> Option<(f64, SurfaceId)> {
        let occluders = self.occluders();
        let mut nearest: Option<(f64, SurfaceId)> = None;
        self.visit_near(point_in_world, tolerance, |surface| {
            let distance = occluders.distance(surface, point_in_world);
            let is_better = |distance: f64| {
                distance <= tolerance && nearest.is_none_or(|best| (distance, surface) < best)
            };
            if let Some(distance) = distance.filter(|&distance| is_better(distance)) {
                nearest = Some((distance, surface));
            }
            nearest.map_or(tolerance, |(distance, _)| distance)
        });
        let (least, _) = nearest?;
        let normal = normal.map_or(DVec3::ZERO, unit);
        if normal == DVec3::ZERO {
            return nearest;
        }

        // The nearest is now known, so what ties with it is, too.
        let reach = (least + tolerance.min(self.default_tolerance())).min(tolerance);
        let mut best: Option<(Agreement, SurfaceId)> = None;
        self.visit_near(point_in_world, reach, |surface| {
            let distance = occluders.distance(surface, point_in_world);
            if let Some(distance) = distance.filter(|&distance| distance <= reach) {
                let cosine = occluders.normal_at(surface, point_in_world).dot(normal);
                let agreement = Agreement {
                    disagreement: ((1.0 - cosine.abs()) * AGREEMENTS).round(),
                    is_behind: cosine < 0.0,
                    distance,
                };
                if best.is_none_or(|best| (agreement, surface) < best) {
                    best = Some((agreement, surface));
                }
            }
            reach
        });
        best.map(|(agreement, surface)| (agreement.distance, surface))
    }

    /// Visits at least the surfaces within `reach` of a point; some of them twice.
    fn visit_near(&self, point: DVec3, reach: f64, mut visit: impl FnMut(SurfaceId) -> f64) {
        let mut reach = reach;
        if let Some(bvh) = self.bvh() {
            bvh.visit_near(point, reach, |surface| {
                reach = visit(surface);
                reach
            });
            return self.parts.visit_near(point, reach, &mut visit);
        }
        let around = Bounds {
            min: point - reach,
            max: point + reach,
        };
        let layout = &self.layout;
        for voxel in layout.block_around(&around).voxels() {
            for &surface in self.grid().surfaces(layout.index(voxel)) {
                visit(surface);
            }
        }
        self.parts.visit_near(point, reach, &mut visit);
    }

    /// The margin of all surfaces together.
    fn margin(&self) -> f64 {
        Layout::margin_of(&self.occluders().bounds())
    }
}

/// How well a surface fits a point and its normal; less is better.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Agreement {
    disagreement: f64,
    is_behind: bool,
    distance: f64,
}

/// Scales by the largest component first: normals of any length have one.
fn unit(normal: DVec3) -> DVec3 {
    let largest = normal.abs().max_element();
    if largest > 0.0 {
        (normal / largest).normalize_or_zero()
    } else {
        DVec3::ZERO
    }
}
