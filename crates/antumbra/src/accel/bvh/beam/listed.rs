//! Any-hit for one start and up to 64 targets where all that may block is listed.
//!
//! In: leaves of the tree, those first that seem largest. Out: the bits of a walk. No node is visited: the leaves are told one
//! after the other, until every target is blocked.

use fearless_simd::Simd;

use super::super::data::Child;
use super::pyramid::{Faces, Pyramid};
use super::{Beam, FEW, MANY_LEFT};

impl Beam<'_> {
    /// Returns which of the segments of a mask the shapes of some leaves block. All leaves have filters.
    #[inline(always)]
    pub(super) fn blocked_by_leaves<S: Simd>(
        &mut self,
        simd: S,
        asked: u64,
        leaves: &[u32],
    ) -> u64 {
        if asked == 0 {
            return 0;
        }
        let faces = Faces::of(simd, self.segments);
        let mut blocked = 0;
        let mut rest = asked;
        while rest != 0 {
            let (face, part) = faces.shared_by_most(rest);
            if part == 0 {
                // Each goes along some face.
                return blocked | self.each_from_root(simd, rest);
            }
            rest &= !part;
            let mut pyramid = Pyramid::new(simd, self.segments, face, part);
            let mut active = part;
            for &leaf in leaves {
                let hit = self.blocked_in(simd, Child::of_word(leaf), &pyramid, active);
                if hit == 0 {
                    continue;
                }
                active &= !hit;
                if active == 0 {
                    break;
                }
                let count = active.count_ones();
                if count > FEW && MANY_LEFT * count <= pyramid.targets.count_ones() {
                    pyramid = Pyramid::new(simd, self.segments, face, active);
                }
            }
            blocked |= part & !active;
        }
        blocked
    }
}
