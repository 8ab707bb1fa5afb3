//! Reads a map: where starts are in it, and what its words say there.
//!
//! In: starts, the map as far as it is made. Out: answers, lists of surfaces, or nothing yet.

use std::sync::atomic::Ordering;

use antumbra_geometry::ReceiverPoint;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use super::Map;
use super::codes::{LEVELS, place_codes};
use super::found::{List, Located, Told};
use super::nodes::step;
use super::words::{BIAS, COUNTS, HEAD, NODE_CELLS, SLANT_WORDS, Word, entry_counts};

impl Map {
    /// Tells of at most 64 starts which lie on faces that are lit or in shadow as a whole, and of these which are in
    /// shadow, a bit each.
    #[inline]
    pub(crate) fn faces_of(&self, starts: &[ReceiverPoint]) -> (u64, u64) {
        let (mut known, mut shadowed) = (0, 0);
        for (number, start) in starts.iter().enumerate() {
            let value = self.faces.value(start.surface);
            known |= u64::from(value & 1 | value >> 1) << number;
            shadowed |= u64::from(value >> 1) << number;
        }
        (known, shadowed)
    }

    /// Returns whether a start is in shadow, if all starts on its face are, or none is.
    #[inline]
    pub(crate) fn face_of(&self, start: &ReceiverPoint) -> Option<bool> {
        match self.faces.value(start.surface) {
            0 => None,
            value => Some(value >> 1 != 0),
        }
    }

    /// Returns where starts within the scene's box are, given coordinate by coordinate.
    #[inline(always)]
    pub(in super::super) fn locate<S: Simd, const N: usize>(
        &self,
        simd: S,
        places: &[[f32; N]; 3],
    ) -> Located<N> {
        let located = self.views.locate(simd, places);
        let mut codes = [0; N];
        for first in (0..N).step_by(8) {
            let u = f32x8::from_slice(simd, &located.within[0][first..first + 8]);
            let v = f32x8::from_slice(simd, &located.within[1][first..first + 8]);
            codes[first..first + 8].copy_from_slice(place_codes(simd, u, v).as_slice());
        }
        Located {
            tiles: located.tiles,
            codes,
            within: located.within,
            depths: located.depths,
        }
    }

    /// Returns what the words of some starts are, and where it stands what their cells say of free ones: 0 for the tile's.
    #[inline(always)]
    pub(in super::super) fn words<S: Simd, const N: usize>(
        &self,
        simd: S,
        located: &Located<N>,
    ) -> ([u32; N], [u32; N]) {
        let mut words = [Word::UNASKED.0; N];
        let mut cells = [0; N];
        let mut codes = located.codes;
        for (word, &tile) in words.iter_mut().zip(&located.tiles) {
            // Of none, a number that no tile has.
            if let Some(tile) = self.tiles.get(tile as usize) {
                *word = tile.load(Ordering::Acquire);
            }
        }
        for _ in 0..LEVELS {
            let (mut places, mut read) = ([0; N], [0; N]);
            let mut are_nodes = 0;
            for first in (0..N).step_by(8) {
                let word = u32x8::from_slice(simd, &words[first..first + 8]);
                let code = u32x8::from_slice(simd, &codes[first..first + 8]);
                let (place, left) = step(simd, word, code);
                places[first..first + 8].copy_from_slice(place.as_slice());
                codes[first..first + 8].copy_from_slice(left.as_slice());
                are_nodes |= place.simd_gt(0).to_bitmask();
            }
            if are_nodes == 0 {
                break;
            }
            // In one short loop, so that many are waited for at once; others read where nothing is.
            for (read, &place) in read.iter_mut().zip(&places) {
                *read = self.arena.read(place as usize);
            }
            for first in (0..N).step_by(8) {
                let place = u32x8::from_slice(simd, &places[first..first + 8]);
                let word = u32x8::from_slice(simd, &words[first..first + 8]);
                let cell = u32x8::from_slice(simd, &cells[first..first + 8]);
                let read = u32x8::from_slice(simd, &read[first..first + 8]);
                let is_node = place.simd_gt(0);
                words[first..first + 8].copy_from_slice(is_node.select(read, word).as_slice());
                cells[first..first + 8].copy_from_slice(is_node.select(place, cell).as_slice());
            }
        }
        (words, cells)
    }

    /// Returns what a cell says of free starts that are not past its threshold: a depth before which they are lit, or a
    /// list.
    #[inline(always)]
    pub(in super::super) fn free(&self, tile: u32, cell: u32) -> Word {
        Word(match cell {
            0 => self.free[tile as usize].load(Ordering::Relaxed),
            cell => self.arena.read(cell as usize + NODE_CELLS),
        })
    }

    /// Notes that so many entries of a list are tested; returns whether it stays.
    #[inline(always)]
    pub(in super::super) fn test(&self, word: u32, count: u32) -> bool {
        self.arena.spend(Word(word).place() + COUNTS, count)
    }

    /// Returns what a word says of a start of those that were located, on a listed surface or not.
    #[inline(always)]
    pub(in super::super) fn told<const N: usize>(
        &self,
        (located, number): (&Located<N>, usize),
        (word, cell): (u32, u32),
        is_listed: bool,
    ) -> Told {
        let depth = located.depths[number];
        let is_past = match Word(word) {
            list if list.is_list() => return Told::List(word),
            slant if slant.is_slant() => self.is_past_slant((located, number), word),
            threshold if threshold.is_threshold() => depth + BIAS > f32::from_bits(word),
            _ => return Told::Unknown,
        };
        if is_past || is_listed {
            return Told::Is(is_past);
        }
        match self.free(located.tiles[number], cell) {
            list if list.is_list() => Told::List(list.0),
            lit_before if depth + BIAS < f32::from_bits(lit_before.0) => Told::Is(false),
            _ => Told::Unknown,
        }
    }

    /// Returns whether a start is past the slanted threshold of its word.
    #[inline(always)]
    pub(in super::super) fn is_past_slant<const N: usize>(
        &self,
        (located, number): (&Located<N>, usize),
        word: u32,
    ) -> bool {
        let words = self.arena.slice(Word(word).place(), SLANT_WORDS);
        let read = |at: usize| f32::from_bits(words[at].load(Ordering::Relaxed));
        let [u, v] = [0, 1].map(|axis: usize| located.within[axis][number] - 0.5);
        let depth = located.depths[number];
        let key = self.depths.key_of_start(depth);
        (depth > read(3)) | (key - (read(0) * u + read(1) * v) > read(2))
    }

    /// Reads of a list what comes first, so that it is in the caches.
    #[inline(always)]
    pub(in super::super) fn any_word(&self, word: u32) -> u32 {
        self.arena.read(Word(word).place())
    }

    /// Returns what a list of a tile says.
    #[inline(always)]
    pub(in super::super) fn list(&self, tile: u32, word: u32) -> List<'_> {
        let place = Word(word).place();
        let counts = entry_counts(self.arena.read(place + COUNTS));
        List {
            full: f32::from_bits(self.arena.read(place)),
            counts,
            entries: self.arena.slice(place + HEAD, counts[1]),
            surfaces: self.surfaces_of(tile as usize),
        }
    }
}
