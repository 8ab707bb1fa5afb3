//! What the tree is made of.

use antumbra_geometry::{Bounds, SurfaceId};
use fearless_simd::Level;

use super::ray::FilterBounds;
use crate::accel::frame::Frame;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Shapes of a group, filtered together.
pub(super) const LANES: usize = 4;

/// The tree over all surfaces of a scene.
#[derive(Debug)]
pub(crate) struct Bvh {
    pub(super) frame: Frame,
    /// The box of the surfaces, with room for every rounding.
    pub(super) bounds: Bounds,
    /// The root is the first; children come after their parents. Empty for an empty scene.
    pub(super) nodes: Vec<Node>,
    pub(super) triangles: Vec<TriangleGroup>,
    pub(super) spheres: Vec<SphereGroup>,
    /// Surfaces that have no filter.
    pub(super) others: Vec<SurfaceId>,
    /// Nodes on the longest way down.
    pub(super) depth: usize,
    pub(super) level: Level,
    pub(super) usual_bounds: FilterBounds,
}

/// Eight boxes, axis by axis, so that one instruction handles all of them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Smallest x, y, z, then largest x, y, z, of each child; empty children are points far
    /// away.
    pub(super) planes: [[f32; WIDTH]; 6],
    /// Leaves first, as an any-hit walk wants them.
    pub(super) children: [Child; WIDTH],
}

/// What a child of a node is, with its place, in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A [`Child`], unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChildKind {
    Node,
    Triangles,
    Spheres,
    Other,
}

impl Child {
    const INDEX_BITS: u32 = 30;
    pub(super) const NONE: Self = Self(u32::MAX);

    /// # Panics
    /// `index` needs more than 30 bits; surfaces are fewer.
    pub(super) fn new(kind: ChildKind, index: usize) -> Self {
        assert!(index < 1 << Self::INDEX_BITS, "surfaces fit 30 bits");
        Self((kind as u32) << Self::INDEX_BITS | index as u32)
    }

    /// Returns it as a number.
    #[inline(always)]
    pub(super) fn word(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub(super) fn of_word(word: u32) -> Self {
        Self(word)
    }

    #[inline(always)]
    pub(super) fn is_node(self) -> bool {
        self.0 >> Self::INDEX_BITS == ChildKind::Node as u32
    }

    #[inline(always)]
    pub(super) fn kind(self) -> ChildKind {
        match self.0 >> Self::INDEX_BITS {
            0 => ChildKind::Node,
            1 => ChildKind::Triangles,
            2 => ChildKind::Spheres,
            _ => ChildKind::Other,
        }
    }

    #[inline(always)]
    pub(super) fn index(self) -> usize {
        (self.0 & ((1 << Self::INDEX_BITS) - 1)) as usize
    }
}

/// Up to four triangles in the frame's units, with what the filter needs of each: three cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct TriangleGroup {
    /// The first corner.
    pub(super) corner: [[f32; LANES]; 3],
    /// From the first corner to the second.
    pub(super) edge_ab: [[f32; LANES]; 3],
    /// From the first corner to the third.
    pub(super) edge_ac: [[f32; LANES]; 3],
    /// Largest magnitude of a component of the two edges, at least [`Self::SMALLEST_REACH`].
    pub(super) reach: [f32; LANES],
    pub(super) members: Members,
}

impl TriangleGroup {
    /// Keeps products of two edges far from the smallest `f32`s: their bounds do not shrink further.
    pub(super) const SMALLEST_REACH: f32 = 2.842_171e-14; // 2^-45
}

/// Up to four spheres in the frame's units.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct SphereGroup {
    pub(super) center: [[f32; LANES]; 3],
    pub(super) radius: [f32; LANES],
    pub(super) members: Members,
}

/// Which surfaces the lanes of a group are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Members {
    /// Unused lanes repeat an id.
    pub(super) surfaces: [SurfaceId; LANES],
    /// A bit for each lane in use.
    pub(super) present: u8,
    /// A bit for each lane that blocks shadow rays somewhere.
    pub(super) opaque: u8,
    /// A bit for each lane that blocks shadow rays everywhere.
    pub(super) whole: u8,
}

impl Members {
    /// Returns a bit for each lane of a surface of this number.
    #[inline(always)]
    pub(super) fn those_of(&self, surface: u32) -> u32 {
        (0..LANES).fold(0, |bits, lane| {
            bits | u32::from(self.surfaces[lane].0 == surface) << lane
        })
    }
}

impl Bvh {
    /// Returns the frame that the tree has its numbers in.
    pub(crate) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns all surfaces of the tree.
    pub(super) fn surfaces(&self) -> impl Iterator<Item = SurfaceId> {
        let triangles = self.triangles.iter().map(|group| &group.members);
        let members = triangles.chain(self.spheres.iter().map(|group| &group.members));
        let in_groups = members.flat_map(|members| {
            let lanes = (0..LANES).filter(|lane| members.present >> lane & 1 != 0);
            lanes.map(|lane| members.surfaces[lane])
        });
        in_groups.chain(self.others.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn child_remembers() {
        for kind in [
            ChildKind::Node,
            ChildKind::Triangles,
            ChildKind::Spheres,
            ChildKind::Other,
        ] {
            let child = Child::new(kind, 123_456_789);
            assert_eq!((child.kind(), child.index()), (kind, 123_456_789));
        }
        assert_eq!(size_of::<Node>(), 256);
        assert_eq!(size_of::<TriangleGroup>(), 192);
    }
}
