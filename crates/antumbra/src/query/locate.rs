//! Which surface a point is meant to lie on.
//!
//! In: a point, perhaps a normal, a tolerance. Out: a start on a surface. It says what is asked; what blocks
//! is the exact rule's. Invariant: the start is a function of the scene and the point, whatever the tree, the
//! grid and the threads, and lies as near to its surface as every method assumes.

use std::cmp::Ordering;

use antumbra_geometry::{Bounds, DVec3, Precision, ReceiverPoint, SurfaceId};

use crate::limits::is_fine;
use crate::{Coordinates, Nearness, ShadowIndex};

/// Normals this near to each other agree alike: steps of the cosine.
const AGREEMENTS: f64 = (1u32 << 20) as f64;

/// What is looked through first is as far as the point's own rounding, then this many times as far each time, a
/// few times, then all that may matter.
const WIDER: f64 = 32.0;
const WIDENINGS: u32 = 4;

/// A surface near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Near {
    distance: f64,
    surface: SurfaceId,
}

impl ShadowIndex {
    /// Returns the start that a point means which is meant to lie on a surface: on the nearest of those that are
    /// near enough to it. `None` if none is.
    ///
    /// Surfaces tie that are farther than the nearest by no more than the rounding of a point on it: at an edge,
    /// rounding decides which of them is nearest. With a `normal` (world space, any length) that one is chosen
    /// whose line agrees best with it, then one that it points out of, then the nearest, then the lowest id.
    /// Without, or with a zero normal, it is the nearest, then the lowest id. Transparent surfaces count,
    /// degenerate ones do not; a closed cone's wall and caps are surfaces of their own. Distances are rounded
    /// (`f64`) as EXACTNESS.md says; a point that is not finite is near nothing.
    ///
    /// The start's point is the given one where it is on the surface up to the rounding of `f64`, or over a triangle
    /// or a disk, onto which the rule of starts (EXACTNESS.md) moves it exactly. Else, beside a triangle or off
    /// a curved surface, it is the surface's nearest point, rounded to `f64`.
    ///
    /// Cost: some walks through the tree, or, in an index without one, through the voxels of the grid around the
    /// point.
    pub fn start_near(
        &self,
        point_in_world: DVec3,
        normal: Option<DVec3>,
        nearness: Nearness,
    ) -> Option<ReceiverPoint> {
        let surface = self.surface_near(point_in_world, normal, nearness)?;
        let occluders = self.occluders();
        if occluders.is_on(surface, point_in_world, Precision::Double) {
            return Some(ReceiverPoint {
                point: point_in_world,
                surface: Some(surface),
            });
        }
        Some(occluders.start_on(surface, point_in_world))
    }

    /// Returns the surface that is nearest to a point, however far, and its distance.
    pub(crate) fn nearest_surface(&self, point_in_world: DVec3) -> Option<(SurfaceId, f64)> {
        let nearest = self.nearest_within(point_in_world, f64::INFINITY, |_, _| true)?;
        Some((nearest.surface, nearest.distance))
    }

    /// Returns whether looking for what is near a point needs nothing that is not built yet.
    pub(crate) fn can_look_near(&self) -> bool {
        self.built_bvh().is_some() || self.has_grid()
    }

    /// Returns whether a point lies on any surface, up to rounding. Looks no farther than the point's own
    /// coordinates may be rounded, so it is cheap and may miss points of a surface that reaches far out.
    fn is_on_any(&self, point: DVec3, precision: Precision) -> bool {
        let occluders = self.occluders();
        let most = precision.share() * point.abs().element_sum();
        let is_on = |surface, _| occluders.is_on(surface, point, precision);
        self.nearest_within(point, most, is_on).is_some()
    }

    /// Returns how many of some points, spread evenly over all, lie on a surface up to rounding to `f32`, and how
    /// many were looked at: at most a thousand, and few against all.
    ///
    /// Who asks about points of space ([`crate::BatchKind::Free`]) of which many lie on surfaces most likely means points
    /// on surfaces: as points of space, rounding puts about half of them behind their own surface. Where there is
    /// neither a tree yet nor a grid none is looked at.
    pub fn sample_on_surfaces<P: Coordinates>(&self, points: &[P]) -> Sample {
        const MOST: usize = 1000;
        /// One of so many points, but for the first few.
        const SHARE: usize = 32;
        const FEWEST: usize = 8;
        if !self.can_look_near() {
            return Sample::default();
        }
        let count = (points.len() / SHARE).clamp(FEWEST, MOST).min(points.len());
        let on_surface = (0..count)
            .filter(|&number| {
                // Below 2^64 for all points that memory holds.
                let place = (number as u128 * points.len() as u128 / count as u128) as usize;
                let point = points[place].as_f64();
                is_fine(point) && self.is_on_any(point, Precision::Single)
            })
            .count();
        Sample {
            looked_at: count,
            on_surface,
        }
    }

    fn surface_near(
        &self,
        point: DVec3,
        normal: Option<DVec3>,
        Nearness {
            precision,
            tolerance,
        }: Nearness,
    ) -> Option<SurfaceId> {
        let occluders = self.occluders();
        let most = tolerance.unwrap_or_else(|| occluders.largest_rounding(point, precision));
        let is_near = |surface, distance: f64| match tolerance {
            Some(tolerance) => distance <= tolerance,
            None => occluders.is_on(surface, point, precision),
        };
        let nearest = self.nearest_within(point, most, is_near)?;
        let normal = normal.map_or(DVec3::ZERO, unit);
        if normal == DVec3::ZERO {
            return Some(nearest.surface);
        }

        // The nearest is now known, so what ties with it is, too.
        let rounding = occluders.rounding(nearest.surface, point, precision);
        let reach = (nearest.distance + rounding.element_sum()).min(most);
        let mut best: Option<(Agreement, SurfaceId)> = None;
        self.visit_near(point, reach, |surface| {
            let Some(gap) = occluders.gap(surface, point) else {
                return reach;
            };
            if gap.distance - nearest.distance <= gap.rounding(rounding)
                && is_near(surface, gap.distance)
            {
                let cosine = occluders.normal_at(surface, point).dot(normal);
                let agreement = Agreement {
                    disagreement: ((1.0 - cosine.abs()) * AGREEMENTS).round(),
                    is_behind: cosine < 0.0,
                    distance: gap.distance,
                };
                if best.is_none_or(|best| (agreement, surface) < best) {
                    best = Some((agreement, surface));
                }
            }
            reach
        });
        best.map(|(_, surface)| surface)
    }

    /// Returns the nearest of the surfaces within `most` that are near enough, the lowest id on ties. Looks close
    /// by first: what is far away costs nothing where something is near.
    fn nearest_within(
        &self,
        point: DVec3,
        most: f64,
        is_near: impl Fn(SurfaceId, f64) -> bool,
    ) -> Option<Near> {
        if !point.is_finite() {
            return None;
        }
        let occluders = self.occluders();
        let own = Precision::Single.share() * point.abs().element_sum();
        let mut widenings = 0;
        let mut within = if own > 0.0 { own.min(most) } else { most };
        loop {
            let mut nearest: Option<Near> = None;
            self.visit_near(point, within, |surface| {
                let reach = nearest.map_or(within, |nearest| nearest.distance);
                let Some(distance) = occluders.distance(surface, point) else {
                    return reach;
                };
                let is_better = distance <= within
                    && nearest
                        .is_none_or(|best| (distance, surface) < (best.distance, best.surface));
                if is_better && is_near(surface, distance) {
                    nearest = Some(Near { distance, surface });
                    return distance;
                }
                reach
            });
            // For NaN, too.
            if nearest.is_some() || within.partial_cmp(&most) != Some(Ordering::Less) {
                return nearest;
            }
            widenings += 1;
            within = if widenings > WIDENINGS {
                most
            } else {
                (within * WIDER).min(most)
            };
        }
    }

    /// Visits at least the surfaces within `reach` of a point; some of them twice.
    fn visit_near(&self, point: DVec3, reach: f64, mut visit: impl FnMut(SurfaceId) -> f64) {
        let tree = self.built_bvh().or_else(|| match self.has_grid() {
            true => None,
            false => self.bvh(),
        });
        let mut reach = reach;
        if let Some(bvh) = tree {
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
}

/// Sample of many points: how many of them lie on surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// How many points were looked at.
    pub looked_at: usize,
    /// How many of them lie on a surface, up to rounding.
    pub on_surface: usize,
}

impl Sample {
    /// Returns whether so many lie on surfaces that most likely all are meant to: an eighth or more.
    pub fn is_suspicious(&self) -> bool {
        self.on_surface > 0 && 8 * self.on_surface >= self.looked_at
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
