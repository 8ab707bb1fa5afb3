//! Answers of a start as bits in words.

use antumbra_geometry::LightShape;

use crate::accel::bvh::TARGETS;
use crate::limits::is_fine;

/// Bits of a word: as many targets as walk together.
pub(in crate::query) const WORD: usize = TARGETS;

/// Returns how many words the bits of so many targets take.
pub(in crate::query) const fn word_count(target_count: usize) -> usize {
    target_count.div_ceil(WORD)
}

/// Returns whether a target has an answer.
pub(super) fn is_fine_target(target: &LightShape) -> bool {
    is_fine(target.homogeneous().0)
}
