//! Nodes: the words of sixteen cells, and what they say of free starts; and wide nodes, of 256 cells.
//!
//! In: what the cells of a node know. Out: its words.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x8};

use super::codes::{CELL_BITS, next_digit};
use super::words::{Arena, NODE, NODE_CELLS, NODE_WORDS, PLACE, WIDE, WIDE_WORDS, Word};

/// The word of a cell, and the one for free starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Known {
    pub(super) word: Word,
    pub(super) free: Word,
}

impl Known {
    pub(super) const NOTHING: Self = Self {
        word: Word::LIT,
        free: Word::LIT,
    };

    /// No threshold, so that free starts need nothing else.
    pub(super) fn alike(word: Word) -> Self {
        Self {
            word,
            free: Word::NEVER,
        }
    }
}

/// Nodes of so many cells of a tile are one wide node.
const ENOUGH_NODES: usize = 8;

/// Returns what the cells of a node say.
pub(super) fn cells(arena: &Arena, node: usize) -> impl Iterator<Item = Known> {
    (node..node + NODE_CELLS).map(|place| Known {
        word: Word(arena.read(place)),
        free: Word(arena.read(place + NODE_CELLS)),
    })
}

/// For eight words that lead to nodes, where in these the cells of their codes are, and what of the codes is left for
/// the next step; 0 for all others.
#[inline(always)]
pub(super) fn step<S: Simd>(simd: S, word: u32x8<S>, code: u32x8<S>) -> (u32x8<S>, u32x8<S>) {
    let is_node = (word >> 30).simd_eq(NODE >> 30);
    let is_wide = (word >> 29).simd_eq(WIDE >> 29);
    let (upper, lower) = (next_digit(code), next_digit(code << CELL_BITS));
    let within = is_wide.select(upper * NODE_WORDS as u32 + lower, upper);
    let left = is_wide.select(code << (2 * CELL_BITS), code << CELL_BITS);
    let nowhere = u32x8::splat(simd, 0);
    (is_node.select((word & PLACE) + within, nowhere), left)
}

/// Writes what the cells of a node say.
pub(super) fn write_node(words: &mut [u32], node: usize, cells: &[Known; NODE_CELLS]) {
    for (number, cell) in cells.iter().enumerate() {
        words[node + number] = cell.word.0;
        words[node + NODE_CELLS + number] = cell.free.0;
    }
}

/// Writes the node of a tile. At the beginning of the words there is room for a wide one, where the nodes of the cells
/// lie in their places. A wide one it becomes if most cells have nodes; else these are moved together, behind the tile's
/// own. Returns the tile's word, and the first of the words that are used.
pub(super) fn tile_node(words: &mut [u32], mut cells: [Known; NODE_CELLS]) -> (Known, usize) {
    let nodes = cells.iter().filter(|cell| cell.word.is_node());
    if nodes.count() >= ENOUGH_NODES {
        for (number, cell) in cells.iter().enumerate() {
            if !cell.word.is_node() {
                write_node(words, number * NODE_WORDS, &[*cell; NODE_CELLS]);
            }
        }
        return (Known::alike(Word::wide(0)), 0);
    }
    let mut first = WIDE_WORDS;
    for cell in cells.iter_mut().rev() {
        if cell.word.is_node() {
            let from = cell.word.place();
            first -= NODE_WORDS;
            // No node that is still to be moved is there.
            words.copy_within(from..from + NODE_WORDS, first);
            cell.word = Word::node(first);
        }
    }
    first -= NODE_WORDS;
    write_node(words, first, &cells);
    (Known::alike(Word::node(first)), first)
}
