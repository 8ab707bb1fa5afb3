//! What all starts of a part of a surface, or of a cell of space, have in common for a whole light.
//!
//! In: a key's starts, what may block them. Out: that all of the light reaches all, that nothing of it reaches any, or
//! which leaves of the tree hold what may block. README.md here has the proofs; its numbers are in the comments.

use antumbra_geometry::{Bounds, DVec3, LightShape, ReceiverPoint, SurfaceId};

use super::hull::Flat;
use super::maker::{Candidate, Decided, Maker};
use super::shaft::{Planes, Polygon, are_off_plane, passes_beside};
use crate::accel::bvh::Leaf;
use crate::occlusion::forms::START_ROOM;

/// Most blockers of a list.
const MOST_LISTED: usize = 256;

/// Most triangles of a sheet.
const MOST_SHEET: usize = 96;

/// Sheets that are tried.
const MOST_TRIED: usize = 3;

/// The starts of a triangle in a cell, and what lies between them and the light.
struct Patch<'a> {
    surface: SurfaceId,
    /// The side that the light is asked about on.
    side: i8,
    /// Its corners in world space.
    corners: [DVec3; 3],
    flat: Flat,
    polygon: Polygon,
    planes: Planes,
    maker: &'a Maker<'a>,
}

impl Maker<'_> {
    /// Decides the starts of a triangle in a box of the frame, for the part of the light on one side of it, and returns
    /// whether that is surely all of the light.
    pub(super) fn decide_on(
        &self,
        surface: SurfaceId,
        side: i8,
        bounds: &Bounds,
        candidates: &[Candidate],
    ) -> (Decided, bool) {
        let occluders = self.scene.occluders;
        let Some(corners) = occluders.triangle_positions(surface) else {
            return (Decided::Open, false);
        };
        let flat = Flat::new(self.frame, corners);
        let are_on_side = self.hull.side_of(&flat, 4.0 * START_ROOM) == side;
        let Some(polygon) = Polygon::new(flat.corners, bounds) else {
            return (Decided::Open, are_on_side);
        };
        let patch = Patch {
            surface,
            side,
            corners,
            planes: Planes::of_polygon(&polygon, self.hull),
            flat,
            polygon,
            maker: self,
        };
        let kept: Vec<Candidate> = candidates
            .iter()
            .filter(|candidate| patch.may_block(candidate.surface))
            .copied()
            .collect();
        if kept.is_empty() {
            return (Decided::Lit, are_on_side);
        }
        // A start on the light's side only: the middle of the light must be there, too.
        if self.sides[surface.0 as usize] == side && patch.is_covered(&kept) {
            return (Decided::Dark, are_on_side);
        }
        (self.listed(kept, patch.polygon.middle()), are_on_side)
    }

    /// Decides the starts of a surface that is no triangle in a box: which others may block them. Its own rule is asked for
    /// each sample.
    pub(super) fn decide_on_curved(
        &self,
        own: SurfaceId,
        bounds: &Bounds,
        candidates: &[Candidate],
    ) -> Decided {
        let planes = Planes::of_box(bounds, self.hull);
        let has_own_rule = self.scene.occluders.has_own_rule(own);
        let kept: Vec<Candidate> = candidates
            .iter()
            .filter(|candidate| candidate.surface != own || !has_own_rule)
            .filter(|candidate| !self.is_above(&planes, candidate.surface))
            .copied()
            .collect();
        self.listed(kept, bounds.center())
    }

    /// Decides the points of space in a box.
    pub(super) fn decide_free(&self, bounds: &Bounds, candidates: &[Candidate]) -> Decided {
        let planes = Planes::of_box(bounds, self.hull);
        let kept: Vec<Candidate> = candidates
            .iter()
            .filter(|candidate| !self.is_above(&planes, candidate.surface))
            .copied()
            .collect();
        match kept.is_empty() {
            true => Decided::Lit,
            false => self.listed(kept, bounds.center()),
        }
    }

    /// Returns the leaves of what may block, those first that seem largest from a point.
    fn listed(&self, kept: Vec<Candidate>, from: DVec3) -> Decided {
        if kept.len() > MOST_LISTED || !kept.iter().all(|candidate| candidate.leaf.has_filter()) {
            return Decided::Open;
        }
        let size = |surface: SurfaceId| {
            let Some(corners) = self.scene.occluders.triangle_positions(surface) else {
                return f64::INFINITY;
            };
            let flat = Flat::new(self.frame, corners);
            let way = flat.corners[0] - from;
            let square = way.length_squared().max(1e-12);
            flat.normal.dot(way).abs() / (square * square.sqrt())
        };
        let mut leaves: Vec<(Leaf, f64)> = kept
            .iter()
            .map(|candidate| (candidate.leaf, size(candidate.surface)))
            .collect();
        leaves.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        leaves.dedup_by(|next, first| {
            let is_same = next.0 == first.0;
            if is_same {
                first.1 += next.1;
            }
            is_same
        });
        leaves.sort_by(|a, b| b.1.total_cmp(&a.1));
        Decided::Listed(leaves.into_iter().map(|(leaf, _)| leaf).collect())
    }

    /// Returns whether a surface surely lies above a plane of a shaft.
    fn is_above(&self, planes: &Planes, surface: SurfaceId) -> bool {
        match self.scene.occluders.triangle_positions(surface) {
            Some(corners) => planes.misses(&corners.map(|p| self.frame.point_in_frame(p))),
            None => {
                let bounds = self.scene.occluders.surface_bounds(surface);
                planes.misses(&bounds.corners().map(|p| self.frame.point_in_frame(p)))
            }
        }
    }

    /// Returns on which side of a triangle's plane a point of world space lies, exactly.
    fn exact_side(&self, triangle: SurfaceId, point: DVec3) -> i8 {
        let occluders = self.scene.occluders;
        occluders.light_side_of(triangle, &LightShape::Point(point))
    }
}

impl Patch<'_> {
    /// Returns whether a surface may block some start of the patch from some of the light on its side.
    fn may_block(&self, surface: SurfaceId) -> bool {
        if surface == self.surface || self.maker.is_above(&self.planes, surface) {
            return false;
        }
        let Some(corners) = self.maker.scene.occluders.triangle_positions(surface) else {
            return true;
        };
        // (C) All of it is on or behind the plane of the starts' triangle: no segment comes there.
        if !self.reaches_over(&corners) {
            return false;
        }
        // (B) Starts and light are on one side of its plane.
        let side = self.maker.sides[surface.0 as usize];
        side == 0 || !self.is_on_side(surface, &corners, side)
    }

    /// Returns whether some of these points is strictly on the light's side of the starts' triangle.
    fn reaches_over(&self, points: &[DVec3]) -> bool {
        let bound = self.flat.bound(8.0 * self.maker.hull.slack);
        let side = f64::from(self.side);
        let mut in_doubt = [DVec3::ZERO; 3];
        let mut doubt_count = 0;
        for &point in points {
            if self.corners.contains(&point) {
                continue;
            }
            let height = side * self.flat.height(self.maker.frame.point_in_frame(point));
            if height > bound {
                return true;
            }
            // Not for NaN.
            let is_under = height < -bound;
            if !is_under {
                in_doubt[doubt_count] = point;
                doubt_count += 1;
            }
        }
        in_doubt[..doubt_count]
            .iter()
            .any(|&point| self.maker.exact_side(self.surface, point) == self.side)
    }

    /// Returns whether all starts are on one side of another triangle's plane, or on it.
    fn is_on_side(&self, triangle: SurfaceId, corners: &[DVec3; 3], side: i8) -> bool {
        let flat = Flat::new(self.maker.frame, *corners);
        let bound = flat.bound(8.0 * self.maker.hull.slack);
        let mut is_sure = true;
        for corner in self.polygon.corners() {
            let height = f64::from(side) * flat.height(*corner);
            if height < -bound {
                return false;
            }
            is_sure &= height > bound;
        }
        // All of the triangle is on that side, exactly.
        is_sure
            || self.corners.iter().all(|&corner| {
                corners.contains(&corner) || self.maker.exact_side(triangle, corner) != -side
            })
    }

    /// Returns whether a sheet covers all starts for all of the light (README.md, *full*).
    fn is_covered(&self, kept: &[Candidate]) -> bool {
        let occluders = self.maker.scene.occluders;
        let start = ReceiverPoint {
            point: self.maker.frame.center + self.polygon.middle() / self.maker.frame.scale,
            surface: Some(self.surface),
        };
        let segment = occluders.segment(&start, &self.maker.hull.middle(self.maker.frame));
        let mut tried: Vec<SurfaceId> = Vec::new();
        let mut sheet = Vec::new();
        for candidate in kept {
            let surface = candidate.surface;
            let is_member = self
                .maker
                .sides
                .get(surface.0 as usize)
                .is_some_and(|&side| side != 0)
                && occluders.is_opaque_everywhere(surface)
                && !self.maker.mesh.is_repeated(surface);
            if !is_member || !occluders.blocks(surface, &segment) {
                continue;
            }
            sheet.clear();
            if self.covers(surface, &mut sheet) {
                return true;
            }
            tried.push(surface);
            if tried.len() == MOST_TRIED {
                break;
            }
        }
        false
    }

    /// Returns whether the sheet around a triangle that blocks one start has no event. Its triangles go to `sheet`.
    fn covers(&self, first: SurfaceId, sheet: &mut Vec<SurfaceId>) -> bool {
        let occluders = self.maker.scene.occluders;
        sheet.push(first);
        let mut next = 0;
        while let Some(&triangle) = sheet.get(next) {
            next += 1;
            let Some(corners) = occluders.triangle_positions(triangle) else {
                return false;
            };
            if !self.is_clear_of(&corners) {
                return false;
            }
            let beyond = self.maker.mesh.beyond(triangle, self.maker.sides);
            for (side, beyond) in beyond.into_iter().enumerate() {
                let edge = [corners[side], corners[(side + 1) % 3]];
                match beyond {
                    Some(other) if sheet.contains(&other) => {}
                    _ if self.is_missed_by_edge(&edge) => {}
                    Some(other) if sheet.len() < MOST_SHEET => sheet.push(other),
                    _ => return false,
                }
            }
        }
        true
    }

    /// Returns whether no segment meets an edge between its ends.
    fn is_missed_by_edge(&self, edge: &[DVec3; 2]) -> bool {
        let hull = self.maker.hull;
        let in_frame = edge.map(|point| self.maker.frame.point_in_frame(point));
        self.planes.misses(&in_frame)
            || !self.reaches_over(edge)
            || passes_beside(in_frame, self.polygon.corners(), hull)
    }

    /// Returns whether no start but for the border of the patch's triangle lies on another triangle.
    fn is_clear_of(&self, corners: &[DVec3; 3]) -> bool {
        let maker = self.maker;
        let flat = Flat::new(maker.frame, *corners);
        let slack = maker.hull.slack;
        if are_off_plane(&flat, self.polygon.corners(), slack) {
            return true;
        }
        let room = DVec3::splat(8.0 * slack);
        let bounds = Bounds::of_points(flat.corners).inflated(room);
        if !bounds.overlaps(&self.polygon.bounds()) {
            return true;
        }
        // Only corners that it shares are on the plane of the starts, the others all on one side of it.
        let mut sides = 0_i8;
        let mut others = 0;
        for &corner in corners {
            if self.corners.contains(&corner) {
                continue;
            }
            sides += maker.exact_side(self.surface, corner);
            others += 1;
        }
        sides.abs() == others
    }
}
