//! Segments of a start that walk the tree by themselves, from the root or from where a walk of several left off.

use fearless_simd::Simd;

use super::super::data::{Child, ChildKind, WIDTH};
use super::super::filter;
use super::super::ray::FrameRay;
use super::super::walk::{USUAL_DEPTH, Waiting, enters};
use super::targets::bits;
use super::{Beam, ROOT, Stack};

impl Beam<'_> {
    /// Goes on for each segment by itself.
    #[inline(always)]
    pub(super) fn each<S: Simd>(
        &mut self,
        simd: S,
        asked: u64,
        stack: &Stack,
        height: usize,
    ) -> u64 {
        let mut blocked = 0;
        for lane in bits(asked) {
            let mut stack = *stack;
            let ray = self.segments.ray(simd, lane, &self.bvh.usual_bounds);
            let is_blocked = self.is_blocked(simd, lane, &ray, &mut stack, height);
            blocked |= u64::from(is_blocked) << lane;
        }
        blocked
    }

    #[inline(always)]
    pub(super) fn each_from_root<S: Simd>(&mut self, simd: S, asked: u64) -> u64 {
        let mut stack = [Waiting::default(); USUAL_DEPTH];
        stack[0] = ROOT;
        self.each(simd, asked, &stack, 1)
    }

    /// Walks on with a stack for one segment.
    #[inline(always)]
    fn is_blocked<S: Simd>(
        &mut self,
        simd: S,
        lane: usize,
        ray: &FrameRay,
        stack: &mut Stack,
        mut height: usize,
    ) -> bool {
        let bvh = self.bvh;
        let mut stale = height;
        while height > 0 {
            height -= 1;
            let Waiting { node, mut mask } = stack[height];
            let mut index = node as usize;
            if height < stale {
                stale = height;
                mask &= enters(simd, &bvh.nodes[index], ray, ray.end).1;
                self.steps += 1;
            }
            while mask != 0 {
                let child = bvh.nodes[index].children[mask.trailing_zeros() as usize % WIDTH];
                mask &= mask - 1;
                if child.is_node() {
                    if mask != 0 {
                        stack[height] = Waiting {
                            node: index as u32,
                            mask,
                        };
                        height += 1;
                    }
                    index = child.index();
                    mask = enters(simd, &bvh.nodes[index], ray, ray.end).1;
                    self.steps += 1;
                    continue;
                }
                if self.is_blocked_in(simd, child, lane, ray) {
                    return true;
                }
            }
        }
        false
    }

    #[inline(always)]
    fn is_blocked_in<S: Simd>(
        &mut self,
        simd: S,
        child: Child,
        lane: usize,
        ray: &FrameRay,
    ) -> bool {
        let bvh = self.bvh;
        let (verdicts, members) = match child.kind() {
            ChildKind::Triangles => {
                let group = &bvh.triangles[child.index()];
                (filter::triangles(simd, group, ray), &group.members)
            }
            ChildKind::Spheres => {
                let group = &bvh.spheres[child.index()];
                (filter::spheres(simd, group, ray), &group.members)
            }
            _ => {
                self.tests += 1;
                return self.question(lane).blocks(bvh.others[child.index()]);
            }
        };
        self.tests += u64::from(members.opaque.count_ones());
        let possible = verdicts.possible & u32::from(members.opaque) & !members.those_of(self.own);
        let verdicts = filter::Verdicts {
            possible,
            ..verdicts
        };
        possible != 0 && self.question(lane).is_blocked_by(members, verdicts)
    }
}
