//! Which triangles may be in the way of the shadow rays from a segment.
//!
//! In: planes around these rays. Out: every surface that may meet all half-spaces at once: boxes of nodes first, then
//! triangles, four at a time. Invariant: no opaque surface that meets them is left out. A segment and its light lie in one
//! plane, so nearly all triangles of a leaf are on one side of it.

use std::ops::ControlFlow;

use antumbra_geometry::SurfaceId;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x4};

use super::cull::{BOUND, Region, meets_planes};
use super::data::{Bvh, Child, ChildKind, LANES, TriangleGroup};

impl Bvh {
    /// Calls `visit` with every opaque surface that may meet a region, as long as it says so.
    pub(crate) fn visit_wedge(
        &self,
        region: &Region,
        pending: &mut Vec<usize>,
        mut visit: impl FnMut(SurfaceId) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        pending.clear();
        if !self.nodes.is_empty() {
            pending.push(0);
        }
        while let Some(index) = pending.pop() {
            let node = &self.nodes[index];
            let mut met = dispatch!(self.level, simd => meets_planes(simd, node, region));
            while met != 0 {
                let number = met.trailing_zeros() as usize;
                met &= met - 1;
                let Some(&child) = node.children.get(number) else {
                    break;
                };
                if child == Child::NONE {
                    continue;
                }
                let (members, lanes) = match child.kind() {
                    ChildKind::Node => {
                        pending.push(child.index());
                        continue;
                    }
                    ChildKind::Other => {
                        visit(self.others[child.index()])?;
                        continue;
                    }
                    ChildKind::Triangles => {
                        let group = &self.triangles[child.index()];
                        let met = dispatch!(self.level, simd => met_triangles(simd, group, region));
                        (&group.members, met)
                    }
                    ChildKind::Spheres => (&self.spheres[child.index()].members, u32::MAX),
                };
                let present = u32::from(members.present & members.opaque);
                let mut lanes = lanes & present;
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    visit(members.surfaces[lane])?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns a bit for each triangle that may meet a region.
///
/// With `u = 2^-24`, heights of a corner and of two edges err by less than `70 u`: roundings of normals, corners and edges
/// `27 u`, products and sums `30 u`, the offset and the sum with it `12 u`. Twice [`BOUND`] is `128 u`.
#[inline(always)]
fn met_triangles<S: Simd>(simd: S, group: &TriangleGroup, region: &Region) -> u32 {
    let load = |rows: &[[f32; LANES]; 3]| rows.each_ref().map(|row| f32x4::from_slice(simd, row));
    let (corner, ab, ac) = (
        load(&group.corner),
        load(&group.edge_ab),
        load(&group.edge_ac),
    );
    let mut is_met = u32::MAX;
    for [x, y, z, offset] in region.planes() {
        let along = |v: &[f32x4<S>; 3]| v[0] * x + v[1] * y + v[2] * z;
        let first = along(&corner) + offset;
        let lowest = first + along(&ab).min(along(&ac)).min(0.0);
        is_met &= lowest.simd_le(2.0 * BOUND).to_bitmask() as u32;
        if is_met & 0xf == 0 {
            break;
        }
    }
    is_met
}
