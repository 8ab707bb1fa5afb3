//! The boundary of all shadow volumes of a light.
//!
//! In: triangles that block everywhere, a light. Out: each triangle, and a wall behind each edge that more
//! volumes lie on one side of than on the other. Invariant: along a way that touches no polygon's rim, the
//! changes at all polygons crossed add up to how the number of volumes that hold a point changes. Edges are
//! joined by bit-equal positions; volumes on both sides of a wall cancel exactly, so of a mesh only the contour
//! edges seen from the light have walls.

use antumbra_geometry::{DVec3, LightShape, Occluders};

use crate::rival::forms::{Frame, Polygon};

/// Returns all polygons: the triangles, then the walls.
pub(super) fn polygons(occluders: &Occluders, light: &LightShape, frame: &Frame) -> Vec<Polygon> {
    let mut polygons = Vec::new();
    let mut sides: Vec<(Edge, i32)> = Vec::new();
    let triangles = occluders.surfaces().take(occluders.triangle_count());
    for triangle in triangles.filter(|&triangle| occluders.is_opaque_everywhere(triangle)) {
        let light_side = occluders.light_side_of(triangle, light);
        let corners = occluders.triangle_positions(triangle);
        // No area, or seen from the edge: an empty volume.
        let (Some(corners), true) = (corners, light_side != 0) else {
            continue;
        };
        polygons.push(Polygon::cap(triangle.0, corners, light_side, light, frame));
        for i in 0..3 {
            let (edge, is_turned) = Edge::new(corners[i], corners[(i + 1) % 3]);
            // Seen along an edge, the triangle lies on the other side of the wall than the light lies of it.
            let side = i32::from(if is_turned { light_side } else { -light_side });
            sides.push((edge, side));
        }
    }
    sides.sort_unstable();
    for of_edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let change = of_edge.iter().map(|&(_, side)| side).sum();
        if change != 0 {
            let ends = of_edge[0].0.ends();
            polygons.push(Polygon::wall(ends, change, light, frame));
        }
    }
    polygons
}

/// The bits of two positions, in an order that does not depend on the triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Edge([[u64; 3]; 2]);

impl Edge {
    /// Also returns whether the ends were exchanged.
    fn new(from: DVec3, to: DVec3) -> (Self, bool) {
        // Zeros have one sign.
        let bits = |point: DVec3| (point + 0.0).to_array().map(f64::to_bits);
        let (from, to) = (bits(from), bits(to));
        if from <= to {
            (Self([from, to]), false)
        } else {
            (Self([to, from]), true)
        }
    }

    fn ends(&self) -> [DVec3; 2] {
        self.0.map(|end| DVec3::from_array(end.map(f64::from_bits)))
    }
}
