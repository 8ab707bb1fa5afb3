//! Places in a tile as codes, digit by digit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use super::words::NODE_CELLS;

/// Cells are cut so often below a tile.
pub(super) const LEVELS: u32 = 3;

/// Bits of a receiver's place that say its cell in a node.
pub(super) const CELL_BITS: u32 = 4;

/// Returns numbers for places in tiles, whose digits are their cells, level by level.
#[inline(always)]
pub(super) fn place_codes<S: Simd>(simd: S, u: f32x8<S>, v: f32x8<S>) -> u32x8<S> {
    digits(simd, u) | digits(simd, v) << 2
}

/// The digits of one axis, two bits each, apart by those of the other.
#[inline(always)]
pub(super) fn digits<S: Simd>(simd: S, x: f32x8<S>) -> u32x8<S> {
    const ALONG: f32 = (1 << (2 * LEVELS)) as f32;
    let least = f32x8::splat(simd, 0.0);
    let most = f32x8::splat(simd, ALONG - 0.5);
    let whole: u32x8<S> = (x * ALONG).max(least).min(most).to_int();
    (whole & 3) | (whole & 12) << 2 | (whole & 48) << 4
}

/// Returns the first digits of codes.
#[inline(always)]
pub(super) fn next_digit<S: Simd>(code: u32x8<S>) -> u32x8<S> {
    (code >> (CELL_BITS * (LEVELS - 1))) & (NODE_CELLS as u32 - 1)
}

/// Returns the cell of a node of this level, 0 for the tile's, that holds the place of a code.
#[inline(always)]
pub(super) fn digit(code: u32, level: u32) -> usize {
    (code >> (CELL_BITS * (LEVELS - 1 - level))) as usize % NODE_CELLS
}
