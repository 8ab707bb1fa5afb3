//! Which triangles may be in the way of the shadow rays from a segment.
//!
//! In: planes around these rays. Out: every surface that may meet all half-spaces at once: boxes of nodes first, then
//! triangles, four at a time. Invariant: no opaque surface that meets them is left out. A segment and its light lie in one
//! plane, so nearly all triangles of a leaf are on one side of it.

use std::ops::ControlFlow;

use antumbra_geometry::SurfaceId;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x4};

use super::cull::{BOUND, Region, corners, height, meets_planes};
use super::data::{Bvh, Child, ChildKind, LANES, Node, TriangleGroup};

/// Who is shown surfaces.
pub(crate) trait Visitor {
    /// Looks at a surface, and says whether to go on.
    fn visit(&mut self, surface: SurfaceId) -> ControlFlow<()>;

    /// Leaves out of a region what does not matter any more.
    fn narrow(&mut self, region: &mut Region);
}

impl Bvh {
    /// Calls `visit` with every opaque surface that may meet a region, as long as it says so.
    pub(crate) fn visit_wedge(
        &self,
        region: &mut Region,
        pending: &mut Vec<usize>,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        dispatch!(self.level, simd => self.visit_wedge_inline(simd, region, pending, visitor))
    }

    #[inline(always)]
    fn visit_wedge_inline<S: Simd>(
        &self,
        simd: S,
        region: &mut Region,
        pending: &mut Vec<usize>,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        pending.clear();
        if !self.nodes.is_empty() {
            pending.push(0);
        }
        while let Some(index) = pending.pop() {
            visitor.narrow(region);
            let node = &self.nodes[index];
            let mut met = meets_region(simd, node, region);
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
                        visitor.visit(self.others[child.index()])?;
                        continue;
                    }
                    ChildKind::Triangles => {
                        let group = &self.triangles[child.index()];
                        let met = met_triangles(simd, group, region);
                        (&group.members, met)
                    }
                    ChildKind::Spheres => (&self.spheres[child.index()].members, u32::MAX),
                };
                let present = u32::from(members.present & members.opaque);
                let mut lanes = lanes & present;
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    visitor.visit(members.surfaces[lane])?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns a bit for each child whose box may meet a region.
#[inline(always)]
fn meets_region<S: Simd>(simd: S, node: &Node, region: &Region) -> u32 {
    let mut is_met = meets_planes(simd, node, region);
    let [low, high] = corners(simd, node);
    for pair in region.without() {
        if is_met & 0xff == 0 {
            break;
        }
        let mut is_within = u32::MAX;
        for &plane in pair {
            // The corner that is highest.
            let height = height(&high, &low, plane);
            is_within &= height.simd_lt(-2.0 * BOUND).to_bitmask() as u32;
        }
        is_met &= !is_within;
    }
    is_met
}

#[inline(always)]
fn along<S: Simd>(v: &[f32x4<S>; 3], [x, y, z]: [f32; 3]) -> f32x4<S> {
    v[0] * x + v[1] * y + v[2] * z
}

/// Loads three rows. Spelled out: `map` is a function of its own, which takes and returns by memory.
#[inline(always)]
fn rows<S: Simd>(simd: S, [x, y, z]: &[[f32; LANES]; 3]) -> [f32x4<S>; 3] {
    [
        f32x4::from_slice(simd, x),
        f32x4::from_slice(simd, y),
        f32x4::from_slice(simd, z),
    ]
}

/// Returns a bit for each triangle that may meet a region.
///
/// With `u = 2^-24`, heights of a corner and of two edges err by less than `70 u`: roundings of normals, corners and edges
/// `27 u`, products and sums `30 u`, the offset and the sum with it `12 u`. Twice [`BOUND`] is `128 u`.
#[inline(always)]
fn met_triangles<S: Simd>(simd: S, group: &TriangleGroup, region: &Region) -> u32 {
    let corner = rows(simd, &group.corner);
    let ab = rows(simd, &group.edge_ab);
    let ac = rows(simd, &group.edge_ac);
    let mut is_met = u32::MAX;
    for [x, y, z, offset] in region.planes() {
        let first = along(&corner, [x, y, z]) + offset;
        let (second, third) = (along(&ab, [x, y, z]), along(&ac, [x, y, z]));
        let lowest = first + second.min(third).min(0.0);
        is_met &= lowest.simd_le(2.0 * BOUND).to_bitmask() as u32;
        if is_met & 0xf == 0 {
            return 0;
        }
    }
    for pair in region.without() {
        let mut is_within = u32::MAX;
        for &[x, y, z, offset] in pair {
            let first = along(&corner, [x, y, z]) + offset;
            let (second, third) = (along(&ab, [x, y, z]), along(&ac, [x, y, z]));
            let highest = first + second.max(third).max(0.0);
            is_within &= highest.simd_lt(-2.0 * BOUND).to_bitmask() as u32;
        }
        is_met &= !is_within;
    }
    is_met
}
