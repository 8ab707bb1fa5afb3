//! Boxes in the frame's units, and the nodes of a tree of two children.

use antumbra_geometry::{Bounds, DVec3};

use super::ray::PLANE_ROOM;
use crate::accel::frame::Frame;

/// A surface's box in the frame's units, moved outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameBox {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

impl FrameBox {
    pub(super) fn new(frame: &Frame, bounds: &Bounds) -> Self {
        let room = DVec3::splat(frame.margin_in_frame + PLANE_ROOM);
        let min = frame.point_in_frame(bounds.min) - room;
        let max = frame.point_in_frame(bounds.max) + room;
        Self {
            min: min.to_array().map(|x| x as f32 - outwards(x as f32)),
            max: max.to_array().map(|x| x as f32 + outwards(x as f32)),
        }
    }
}

/// Returns at least the distance to the next `f32` on either side, and less than thrice that: without the branches of
/// `next_up`.
#[inline(always)]
pub(super) fn outwards(x: f32) -> f32 {
    x.abs() * f32::EPSILON + f32::MIN_POSITIVE
}

impl FrameBox {
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| self.max[axis] - self.min[axis]);
        x * y + y * z + z * x
    }

    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }
}

/// The tree, depth first: a node's left side comes right after it.
#[derive(Debug)]
pub(super) struct Binary {
    pub(super) nodes: Vec<BinaryNode>,
}

/// A node with two children, or a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: FrameBox,
    /// The right child, or a surface and [`Self::IS_SURFACE`].
    pub(super) link: u32,
}

impl BinaryNode {
    pub(super) const IS_SURFACE: u32 = 1 << 31;

    pub(super) fn of_surface(bounds: FrameBox, surface: u32) -> Self {
        Self {
            bounds,
            link: surface | Self::IS_SURFACE,
        }
    }

    /// Returns the number of a leaf's surface among the boxes.
    pub(super) fn surface(&self) -> Option<u32> {
        (self.link & Self::IS_SURFACE != 0).then_some(self.link & !Self::IS_SURFACE)
    }
}
