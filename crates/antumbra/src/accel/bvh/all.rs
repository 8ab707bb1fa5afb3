//! Every surface that a ray meets.

use antumbra_geometry::{Bounds, DVec3, Hit, LightShape, Occluders, Segment, SurfaceId};
use fearless_simd::{Simd, dispatch};

use super::data::{Bvh, Child, ChildKind};
use super::filter;
use super::ray::{FrameRay, Prepared};
use super::walk::{enters, lanes, offset};
use crate::Counters;
use crate::accel::sweep::may_meet;

impl Bvh {
    /// Visits every surface that the segment crosses, opaque or not, in the order of the tree.
    pub(crate) fn all(
        &self,
        occluders: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
        mut visit: impl FnMut(Hit),
    ) {
        let crossed = |surface: SurfaceId| {
            if occluders.crosses(surface, segment) {
                visit(occluders.hit(surface, segment));
            }
        };
        dispatch!(self.level, simd => self.all_with(simd, segment, counters, crossed));
    }

    #[inline(always)]
    fn all_with<S: Simd>(
        &self,
        simd: S,
        segment: &Segment,
        counters: &mut Counters,
        mut test: impl FnMut(SurfaceId),
    ) {
        let point = segment.start().point;
        let light = LightShape::Direction(segment.direction());
        match self.prepare(simd, point, offset(segment), &light, || segment.clone()) {
            Prepared::Miss => {}
            Prepared::Ray(_) if self.nodes.is_empty() => {}
            Prepared::Ray(ray) => self.all_along(simd, &ray, counters, test),
            Prepared::Unfit => self.all_by_rule(segment, counters, &mut test),
        }
    }

    /// Tests every surface, if the segment may come near them.
    #[cold]
    pub(super) fn all_by_rule(
        &self,
        segment: &Segment,
        counters: &mut Counters,
        mut test: impl FnMut(SurfaceId),
    ) {
        let (point, light) = (segment.origin(), LightShape::Direction(segment.direction()));
        let start = Bounds {
            min: point,
            max: point,
        }
        .inflated(DVec3::splat(segment.origin_error()));
        if may_meet(&start, &light, &self.bounds) {
            self.surfaces().for_each(|surface| {
                counters.intersections += 1;
                test(surface);
            });
        }
    }

    #[inline(always)]
    pub(super) fn all_along<S: Simd>(
        &self,
        simd: S,
        ray: &FrameRay,
        counters: &mut Counters,
        mut test: impl FnMut(SurfaceId),
    ) {
        let mut waiting = vec![Child::new(ChildKind::Node, 0)];
        while let Some(child) = waiting.pop() {
            let (possible, members) = match child.kind() {
                ChildKind::Node => {
                    counters.steps += 1;
                    let node = &self.nodes[child.index()];
                    let (_, mask) = enters(simd, node, ray, ray.end);
                    waiting.extend(lanes(mask).map(|slot| node.children[slot]));
                    continue;
                }
                ChildKind::Triangles => {
                    let group = &self.triangles[child.index()];
                    (filter::triangles(simd, group, ray).possible, &group.members)
                }
                ChildKind::Spheres => {
                    let group = &self.spheres[child.index()];
                    (filter::spheres(simd, group, ray).possible, &group.members)
                }
                ChildKind::Other => {
                    counters.intersections += 1;
                    test(self.others[child.index()]);
                    continue;
                }
            };
            counters.intersections += u64::from(members.present.count_ones());
            for lane in lanes(possible & u32::from(members.present)) {
                test(members.surfaces[lane]);
            }
        }
    }
}
