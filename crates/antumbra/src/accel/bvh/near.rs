//! What is near a point.

use antumbra_geometry::{DVec3, SurfaceId};

use super::data::{Bvh, Child, ChildKind, Node, WIDTH};

/// Nodes that may wait in a tree of the usual depth.
const USUAL_PENDING: usize = 1 + 32 * (WIDTH - 1);

impl Bvh {
    /// Visits at least the surfaces that come within `reach` of a point along every axis, in the order of
    /// the tree. `visit` returns the reach to go on with.
    pub(crate) fn visit_near(&self, point: DVec3, reach: f64, visit: impl FnMut(SurfaceId) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let pending = 1 + self.depth * (WIDTH - 1);
        if pending <= USUAL_PENDING {
            self.visit_with(point, reach, &mut [0; USUAL_PENDING], visit);
        } else {
            self.visit_with(point, reach, &mut vec![0; pending], visit);
        }
    }

    fn visit_with(
        &self,
        point: DVec3,
        mut reach: f64,
        stack: &mut [u32],
        mut visit: impl FnMut(SurfaceId) -> f64,
    ) {
        let center = self.frame.point_in_frame(point);
        stack[0] = 0;
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = &self.nodes[stack[height] as usize];
            let mut mask = meets(node, center, reach * self.frame.scale);
            while mask != 0 {
                let child = node.children[mask.trailing_zeros() as usize % WIDTH];
                mask &= mask - 1;
                let members = match child.kind() {
                    _ if child == Child::NONE => continue,
                    ChildKind::Node => {
                        stack[height] = child.index() as u32;
                        height += 1;
                        continue;
                    }
                    ChildKind::Triangles => &self.triangles[child.index()].members,
                    ChildKind::Spheres => &self.spheres[child.index()].members,
                    ChildKind::Other => {
                        reach = visit(self.others[child.index()]);
                        continue;
                    }
                };
                for (lane, &surface) in members.surfaces.iter().enumerate() {
                    if members.present >> lane & 1 == 1 {
                        reach = visit(surface);
                    }
                }
            }
        }
    }
}

/// Returns a bit for each child whose box meets the one around a point. Rounding is towards more.
fn meets(node: &Node, center: DVec3, reach: f64) -> u32 {
    let mut is_met = [true; WIDTH];
    for axis in 0..3 {
        let low = ((center[axis] - reach) as f32).next_down();
        let high = ((center[axis] + reach) as f32).next_up();
        for (child, is_met) in is_met.iter_mut().enumerate() {
            *is_met &= node.planes[axis][child] <= high && node.planes[axis + 3][child] >= low;
        }
    }
    is_met.iter().enumerate().fold(0, |mask, (child, &is_met)| {
        mask | u32::from(is_met) << child
    })
}
