//! The umbra of a polygon, convex or concave.

use glam::DVec3;

use super::shaft::SidePlane;
use super::{Relation, Shaft};
use crate::LightShape;
use crate::intersect::triangle_blocks;

/// A face's umbra.
///
/// While the light lies strictly on one side of all its triangles, the set of
/// starts off the face whose segments meet the face can only be left through a segment that meets
/// the face's boundary; a box whose shaft misses the boundary is wholly in or wholly out, and
/// one segment tells which.
#[derive(Clone, Debug)]
pub(crate) struct FaceUmbra {
    triangles: Vec<[DVec3; 3]>,
    vertices: Vec<DVec3>,
    /// The face's own plane with the light above it.
    plane: SidePlane,
    /// Lowest and highest vertex over that plane, with rounding.
    thickness: (f64, f64),
    is_light_above: bool,
    /// Planes through the light and each boundary edge; for convex faces with the face above.
    edges: Vec<(SidePlane, [DVec3; 2])>,
    is_convex: bool,
}

impl FaceUmbra {
    /// Prepares a face; `boundary` are the edges of exactly one of its triangles;
    /// `is_one_sided` says that the light lies strictly on one side of all of them.
    pub(crate) fn new(
        triangles: Vec<[DVec3; 3]>,
        boundary: &[[DVec3; 2]],
        is_one_sided: bool,
        light: &LightShape,
    ) -> Self {
        let mut vertices: Vec<DVec3> = boundary.iter().map(|edge| edge[0]).collect();
        vertices.extend(boundary.iter().map(|edge| edge[1]));
        vertices.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("finite"));
        vertices.dedup();

        let area = |t: &&[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).length_squared();
        let widest = triangles
            .iter()
            .max_by(|a, b| area(a).total_cmp(&area(b)))
            .copied()
            .unwrap_or([DVec3::ZERO; 3]);
        let mut plane = SidePlane::spanned(widest[1] - widest[0], widest[2] - widest[0], widest[0]);
        let light_height = |plane: &SidePlane| match *light {
            LightShape::Point(position) => plane.height(position),
            LightShape::Direction(direction) => plane.height_of_direction(direction),
        };
        if light_height(&plane).0 < 0.0 {
            plane = plane.flipped();
        }
        let heights = vertices.iter().map(|&v| plane.height(v));
        let thickness = heights.fold((0.0_f64, 0.0_f64), |(low, high), (height, error)| {
            (low.min(height - error), high.max(height + error))
        });
        let (height, error) = light_height(&plane);
        // From infinity any surely positive slope is above all vertices.
        let reach = match light {
            LightShape::Point(_) => thickness.1,
            LightShape::Direction(_) => 0.0,
        };
        let is_light_above = is_one_sided && height - error > reach;

        let mut is_convex = true;
        let edges = boundary
            .iter()
            .map(|&[a, b]| {
                let edge = SidePlane::through_light(light, a, b);
                let heights = || vertices.iter().map(|&v| edge.height(v));
                let is_face_below = heights().all(|(height, error)| height <= error);
                let is_face_above = heights().all(|(height, error)| height >= -error);
                is_convex &= is_face_above != is_face_below;
                (if is_face_below { edge.flipped() } else { edge }, [a, b])
            })
            .collect();
        Self {
            triangles,
            vertices,
            plane,
            thickness,
            is_light_above,
            edges,
            is_convex,
        }
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        if !self.is_light_above {
            // The light is too near the face's plane to say more than that.
            return if self.is_hull_missed(shaft) {
                Relation::Misses
            } else {
                Relation::Crosses
            };
        }
        // On the light's side of the face nothing is in its shadow.
        let (lowest, highest) = self.plane.range(&shaft.bounds);
        if lowest > self.thickness.1 {
            return Relation::Misses;
        }
        let is_box_behind = highest < self.thickness.0;
        if self.is_convex {
            self.convex_relation(shaft, is_box_behind)
        } else {
            self.concave_relation(shaft, is_box_behind)
        }
    }

    fn convex_relation(&self, shaft: &Shaft, is_box_behind: bool) -> Relation {
        let mut is_inside_all = is_box_behind;
        for (edge, _) in &self.edges {
            let (lowest, highest) = edge.range(&shaft.bounds);
            if highest < 0.0 {
                return Relation::Misses;
            }
            is_inside_all &= lowest > 0.0;
        }
        if is_inside_all {
            Relation::Covers
        } else if self.is_hull_missed(shaft) {
            Relation::Misses
        } else {
            Relation::Crosses
        }
    }

    fn concave_relation(&self, shaft: &Shaft, is_box_behind: bool) -> Relation {
        if self.is_hull_missed(shaft) {
            return Relation::Misses;
        }
        if !is_box_behind || self.edges.iter().any(|edge| !is_edge_missed(edge, shaft)) {
            return Relation::Crosses;
        }
        let from_center = shaft.segment_from(shaft.bounds.center());
        if self
            .triangles
            .iter()
            .any(|&triangle| triangle_blocks(triangle, &from_center))
        {
            Relation::Covers
        } else {
            Relation::Misses
        }
    }

    fn is_hull_missed(&self, shaft: &Shaft) -> bool {
        shaft.misses(|plane| self.vertices.iter().all(|&v| plane.is_above(v)))
    }
}

/// Returns whether the shaft surely misses a boundary edge.
fn is_edge_missed((plane, ends): &(SidePlane, [DVec3; 2]), shaft: &Shaft) -> bool {
    let (lowest, highest) = plane.range(&shaft.bounds);
    lowest > 0.0 || highest < 0.0 || shaft.misses_edge(ends)
}
