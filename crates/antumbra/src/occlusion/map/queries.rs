//! Queries that a tile is built for.

use super::words::NODE_CELLS;

/// Longer lists than [`Queries::longest`], or than this, are none.
pub(super) const LONGEST: usize = 60;

/// A tile that is made for so many queries is not made again.
pub(super) const AGAIN: f32 = 4_000.0;

/// How many queries are expected of a tile or a cell, anywhere in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Queries {
    pub(super) count: f32,
    /// Whether there were more than a list is worth.
    pub(super) are_more: bool,
    /// Lists of more surfaces take longer than rays.
    pub(super) longest: usize,
    /// Whether a cell that has none then is left so.
    pub(super) are_all: bool,
}

impl Queries {
    /// Queries of a whole tile, where a ray takes so many nanoseconds.
    pub(super) fn of_tile(count: f32, ray_ns: f32) -> Self {
        Self {
            count,
            are_more: false,
            longest: longest(ray_ns),
            are_all: count >= AGAIN,
        }
    }

    /// Queries of a cell whose list was asked too often.
    pub(super) fn of_list(ray_ns: f32) -> Self {
        Self {
            are_more: true,
            ..Self::of_tile(0.0, ray_ns)
        }
    }

    pub(super) fn in_a_cell(self) -> Self {
        Self {
            count: self.count / NODE_CELLS as f32,
            are_more: false,
            ..self
        }
    }
}

/// Returns how many surfaces a list has that takes as long as a ray.
pub(super) fn longest(ray_ns: f32) -> usize {
    // About what they take; answers do not depend on it.
    const LIST_NS: f32 = 20.0;
    const TEST_NS: f32 = 3.0;
    (((ray_ns - LIST_NS) / TEST_NS) as usize).clamp(4, LONGEST)
}
