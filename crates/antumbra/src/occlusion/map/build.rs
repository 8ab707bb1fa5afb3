//! What a tile knows: thresholds, lists, and cells of cells.
//!
//! In: the facets of a tile, who asks. Out: the tile's words. The proofs are in the note beside this file.

use std::collections::HashMap;

use antumbra_geometry::{DVec2, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::super::forms::BOUND;
use super::super::tables::{NONE, Tables};
use super::super::views::CELLS_ALONG_TILE;
use super::super::views::View;
pub(super) use super::codes::{LEVELS, digit};
use super::faces::Part;
use super::facet::{Cells, Depths, Facet, ROOM};
pub(super) use super::made::{Made, Owned};
use super::nodes::{Known, tile_node, write_node};
pub(super) use super::queries::Queries;
pub(super) use super::queries::{AGAIN, LONGEST};
use super::sheet::{MOST_APART, MOST_IN_SHEET, Sheet};
use super::words::{NODE_CELLS, NODE_WORDS, NOT_CUT, WIDE_WORDS, Word, counts, entry};
// Places are moved by no more than a cell.
const _: () = assert!(1 << (2 * LEVELS) == CELLS_ALONG_TILE);

/// A list is cut while its entries, tested by all queries that are expected, are more than this; and later when so many
/// were tested.
const CUT: f32 = 1_500.0;
const TESTS_LEFT: u32 = 2_000;

/// Starts nearer a light among the surfaces may be in no tile.
const LEAST_TOLD: f64 = 1.0 / 32.0;

/// Depths that are compared are off by [`BOUND`] each, and so is a start's.
const APART: f32 = 4.0 * BOUND;
const PAST: f32 = 2.0 * BOUND;

#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) facet: u16,
    pub(super) covers: bool,
    pub(super) near: f32,
    pub(super) far: f32,
}

#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub(super) low: [f32; 2],
    pub(super) side: f32,
    level: u32,
    /// Where its node is written, if there is room for it already.
    room: Option<usize>,
}

impl Cell {
    pub(super) fn middle(&self) -> [f32; 2] {
        self.low.map(|low| low + 0.5 * self.side)
    }
}

/// Makes tiles, one after another.
pub(super) struct Builder<'a, S> {
    simd: S,
    pub(super) tables: Tables<'a>,
    pub(super) depths: Depths,
    /// By how much cells are inflated, in tiles.
    pub(super) margin: f32,
    /// Whether the tile has more surfaces than numbers tell.
    is_crowded: bool,
    pub(super) facets: Vec<Facet>,
    /// For each of them the number of its surface among those of the tile.
    numbers: Vec<u16>,
    /// For each of them its surface, and what cells tell of it.
    parts: Vec<(u32, Part)>,
    /// Facets beyond each side, [`NONE`] where there is none.
    pub(super) beyond: Vec<[u32; 3]>,
    /// For each facet its number in the list at hand.
    pub(super) in_list: Vec<u32>,
    pub(super) words: Vec<u32>,
    /// Place of the first word that is used.
    first: usize,
    order: Vec<(bool, f32, u16)>,
    /// Lists for free starts, by their facets; `None` if none are made.
    free_lists: Option<HashMap<Vec<u16>, Word>>,
    spare: Vec<Vec<Vec<Entry>>>,
}

impl<'a, S: Simd> Builder<'a, S> {
    pub(super) fn new(simd: S, tables: Tables<'a>) -> Self {
        Self {
            simd,
            tables,
            depths: Depths::Parallel,
            margin: 0.0,
            is_crowded: false,
            facets: Vec::new(),
            numbers: Vec::new(),
            parts: Vec::new(),
            beyond: Vec::new(),
            in_list: Vec::new(),
            words: Vec::new(),
            first: 0,
            order: Vec::new(),
            free_lists: None,
            spare: Vec::new(),
        }
    }

    /// Takes up a tile of a view, and the surfaces that it may hold, in ascending order.
    pub(super) fn take_up(&mut self, view: &View, middle: DVec2, surfaces: &[u32]) {
        self.depths = Depths::of(view);
        self.facets.clear();
        self.numbers.clear();
        self.is_crowded = surfaces.len() > usize::from(u16::MAX);
        let mut margin = 0.0_f64;
        for (number, &surface) in surfaces.iter().enumerate() {
            let made = Facet::new(view, self.depths, middle, SurfaceId(surface), &self.tables);
            if let Some((facet, own)) = made {
                margin = margin.max(own);
                self.facets.push(facet);
                self.numbers.push(number as u16);
            }
        }
        self.margin = (margin as f32) + ROOM;
        self.parts.clear();
        // Starts on curved shapes are where their points are. Of what comes too near the light not all starts are
        // in a tile.
        let is_known = |facet: &Facet| {
            self.tables.side(facet.surface as usize).is_some()
                && (!view.is_face || f64::from(facet.nearest()) > LEAST_TOLD)
        };
        let part = |facet: &Facet| match is_known(facet) {
            true => (facet.surface, Part::default()),
            false => (facet.surface, Part::DOUBT),
        };
        self.parts.extend(self.facets.iter().map(part));
        self.find_beyond();
    }

    pub(super) fn facet(&self, entry: &Entry) -> &Facet {
        &self.facets[usize::from(entry.facet)]
    }

    pub(super) fn part_of(&self, facet: u16) -> Part {
        self.parts[usize::from(facet)].1
    }

    pub(super) fn tell(&mut self, facet: u16, part: Part) {
        self.parts[usize::from(facet)].1.add(part);
    }

    /// Tells of all entries of a list.
    fn tell_all(&mut self, list: &[Entry], part: impl Fn(usize, &Entry) -> Part) {
        for (number, entry) in list.iter().enumerate() {
            self.tell(entry.facet, part(number, entry));
        }
    }

    /// Makes the tile itself, or its cell of a level that holds the place of a code; with lists for free starts where
    /// others need thresholds only, if that is wanted.
    pub(super) fn make(
        &mut self,
        (level, code): (u32, u32),
        queries: Queries,
        has_free: bool,
    ) -> Made<'_> {
        self.words.clear();
        self.first = 0;
        self.free_lists = has_free.then(HashMap::new);
        let mut cell = Cell {
            low: [-0.5; 2],
            side: 1.0,
            level,
            room: None,
        };
        for finer in 0..level {
            let number = digit(code, finer);
            cell.side *= 0.25;
            cell.low[0] += cell.side * (number & 3) as f32;
            cell.low[1] += cell.side * (number >> 2) as f32;
        }
        let known = if self.is_crowded {
            self.parts
                .iter_mut()
                .for_each(|(_, part)| part.add(Part::DOUBT));
            Known::alike(Word::HOPELESS)
        } else {
            let mut list = self.simd.vectorize(
                #[inline(always)]
                || self.first_list(&cell),
            );
            self.cell(&mut list, &cell, queries)
        };
        Made {
            parts: &self.parts,
            words: &self.words[self.first..],
            first: self.first,
            own: known.word,
            free: known.free,
        }
    }

    fn find_beyond(&mut self) {
        let facets = &self.facets;
        self.in_list.clear();
        self.in_list.resize(facets.len(), NONE);
        self.beyond.clear();
        let mesh = self.tables.joined();
        self.beyond.extend(facets.iter().map(|facet| {
            let Some(mesh) = mesh.filter(|_| facet.is_whole) else {
                return [NONE; 3];
            };
            let own = SurfaceId(facet.surface);
            let beyond = mesh.beyond(own, self.tables.sides());
            beyond.map(|beyond| {
                let number = beyond.map(|SurfaceId(surface)| {
                    facets.binary_search_by_key(&surface, |facet| facet.surface)
                });
                match number {
                    Some(Ok(number)) => number as u32,
                    _ => NONE,
                }
            })
        }));
    }

    #[inline(always)]
    fn first_list(&self, cell: &Cell) -> Vec<Entry> {
        let [u, v] = cell.middle();
        let cells = Cells {
            u: f32x16::splat(self.simd, u),
            v: f32x16::splat(self.simd, v),
            half: 0.5 * cell.side + self.margin,
        };
        let mut list = Vec::with_capacity(self.facets.len());
        for (number, facet) in self.facets.iter().enumerate() {
            let measured = facet.measure(self.simd, self.depths, &cells);
            if measured.meets & 1 != 0 {
                list.push(Entry {
                    facet: number as u16,
                    covers: measured.covers & 1 != 0,
                    near: measured.near[0],
                    far: measured.far[0],
                });
            }
        }
        list
    }

    /// Cuts a cell into sixteen; a whole tile with room for the nodes of these, so that they may be made one.
    fn node(&mut self, list: &[Entry], cell: &Cell, queries: Queries) -> Known {
        let is_tile = cell.level == 0;
        let first = cell.room.unwrap_or(self.words.len());
        if cell.room.is_none() {
            let size = if is_tile { WIDE_WORDS } else { NODE_WORDS };
            self.words.resize(first + size, 0);
        }
        let side = 0.25 * cell.side;
        let mut middles = [[0.0; NODE_CELLS]; 2];
        for number in 0..NODE_CELLS {
            middles[0][number] = cell.low[0] + side * (0.5 + (number & 3) as f32);
            middles[1][number] = cell.low[1] + side * (0.5 + (number >> 2) as f32);
        }
        let measured = Cells {
            u: f32x16::from_slice(self.simd, &middles[0]),
            v: f32x16::from_slice(self.simd, &middles[1]),
            half: 0.5 * side + self.margin,
        };
        let mut lists = self.spare.pop().unwrap_or_default();
        lists.resize_with(NODE_CELLS, Vec::new);
        lists.iter_mut().for_each(Vec::clear);
        self.simd.vectorize(
            #[inline(always)]
            || self.split(list, &measured, &mut lists),
        );
        let mut cells = [Known::NOTHING; NODE_CELLS];
        for ((number, list), known) in lists.iter_mut().enumerate().zip(&mut cells) {
            let finer = Cell {
                low: [
                    cell.low[0] + side * (number & 3) as f32,
                    cell.low[1] + side * (number >> 2) as f32,
                ],
                side,
                level: cell.level + 1,
                room: is_tile.then_some(number * NODE_WORDS),
            };
            *known = self.cell(list, &finer, queries.in_a_cell());
        }
        self.spare.push(lists);
        if is_tile {
            let known;
            (known, self.first) = tile_node(&mut self.words, cells);
            return known;
        }
        write_node(&mut self.words, first, &cells);
        Known::alike(Word::node(first))
    }

    #[inline(always)]
    fn split(&self, list: &[Entry], cells: &Cells<S>, lists: &mut [Vec<Entry>]) {
        for entry in list {
            let facet = &self.facets[usize::from(entry.facet)];
            let measured = facet.measure(self.simd, self.depths, cells);
            let mut meets = measured.meets;
            while meets != 0 {
                let number = meets.trailing_zeros() as usize % NODE_CELLS;
                meets &= meets - 1;
                lists[number].push(Entry {
                    facet: entry.facet,
                    covers: measured.covers >> number & 1 != 0,
                    near: measured.near[number],
                    far: measured.far[number],
                });
            }
        }
    }

    /// Leaves out what begins so far behind the nearest sheet that it is in shadow.
    fn keep_before(&mut self, list: &mut Vec<Entry>, depth: f32) {
        let parts = &mut self.parts;
        list.retain(|entry| {
            let is_before = entry.near <= depth;
            if !is_before {
                parts[usize::from(entry.facet)].1.add(Part::SHADOWED);
            }
            is_before
        });
    }

    fn cell(&mut self, list: &mut Vec<Entry>, cell: &Cell, queries: Queries) -> Known {
        let covers = list.iter().filter(|entry| entry.covers);
        let mut full = covers.fold(f32::INFINITY, |full, entry| full.min(entry.far));
        self.keep_before(list, full + APART);
        let nearest = list
            .iter()
            .fold(f32::INFINITY, |near, entry| near.min(entry.near))
            - PAST;
        if list.is_empty() {
            return Known::NOTHING;
        }
        if let [entry] = list[..]
            && entry.covers
        {
            let word = Word::threshold(entry.far + PAST);
            self.tell(entry.facet, Part::LIT);
            let free = self.free(list, nearest, |_| true);
            return Known { word, free };
        }
        let mut sheet = Sheet::NONE;
        let mut hidden = 0_u64;
        if list.len() <= MOST_IN_SHEET {
            let over = self.over_a_place(list, cell);
            if let Some(over) = over.filter(|&over| over != 0) {
                sheet = self.sheet(list, cell, full, over);
            }
            if sheet.far <= full {
                full = sheet.far;
                let others = list.iter().enumerate();
                let mut others = others.filter(|&(number, _)| !sheet.holds(number));
                if others.all(|(_, other)| other.near > full + APART) {
                    let word = Word::threshold(full + PAST);
                    self.tell_all(list, |number, _| sheet.part_of(number));
                    let free = self.free(list, nearest, |number| sheet.holds(number));
                    return Known { word, free };
                }
                if let Some(slant) = self.slant(list, cell, &sheet, nearest) {
                    hidden = slant.hidden;
                    let numbers = 0..list.len();
                    let is_behind = |&number: &usize| list[number].near > full + APART;
                    let is_hidden = |number: &usize| hidden >> number & 1 != 0;
                    let mut others = numbers.filter(|number| !sheet.holds(*number));
                    if others.all(|number| is_hidden(&number) || is_behind(&number)) {
                        let word = self.write_slant(&slant, full + PAST);
                        self.tell_all(list, |number, _| sheet.part_of(number));
                        let free = self.free(list, nearest, |number| sheet.holds(number));
                        return Known { word, free };
                    }
                }
            } else {
                sheet = Sheet::NONE;
            }
            // Two over one place are not.
            let may_be_apart = over.is_none_or(|over| over.count_ones() < 2);
            if sheet.is_none() && may_be_apart && list.len() <= MOST_APART && self.are_apart(list) {
                let word = Word::LIT;
                self.tell_all(list, |_, _| Part::LIT);
                let free = self.free(list, nearest, |_| true);
                return Known { word, free };
            }
        }
        // Of the rest what may matter; a sheet behind all others matters to starts on none of these only.
        let mut last = f32::NEG_INFINITY;
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        for (number, entry) in list.iter().enumerate() {
            let is_sheet = sheet.holds(number);
            if !is_sheet && entry.near <= full + APART {
                last = last.max(entry.far);
            }
        }
        // Starts on what hides behind a sheet must ask it.
        let is_behind = !sheet.is_none() && hidden == 0 && last + APART < sheet.near;
        for (number, entry) in list.iter().enumerate() {
            let is_sheet = sheet.holds(number);
            let is_hidden = number < MOST_IN_SHEET && hidden >> number & 1 != 0;
            if is_sheet || !is_hidden && entry.near <= full + APART {
                let number = self.numbers[usize::from(entry.facet)];
                order.push((is_sheet && is_behind, entry.near - PAST, number));
            }
        }
        let asked = order.iter().filter(|entry| !entry.0).count();
        let is_finest = cell.level >= LEVELS;
        let pays = queries.are_more || queries.count * asked as f32 > CUT;
        if is_finest || !pays {
            if asked > queries.longest || order.len() > LONGEST {
                self.order = order;
                self.tell_all(list, |_, _| Part::DOUBT);
                // Rays take less.
                return Known::alike(match is_finest || queries.are_all {
                    true => Word::HOPELESS,
                    false => Word::UNASKED,
                });
            }
            order.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let place = self.words.len();
            self.words.push((full + PAST).to_bits());
            // So many tests later it pays to cut the cell.
            let left = if is_finest { NOT_CUT } else { TESTS_LEFT };
            self.words.push(counts(asked, order.len(), left));
            let entries = order.iter();
            self.words
                .extend(entries.map(|&(_, nearest, number)| entry(nearest, number)));
            self.order = order;
            let is_hidden = |number: usize| number < MOST_IN_SHEET && hidden >> number & 1 != 0;
            let is_asked = |number: usize| {
                sheet.holds(number) || !is_hidden(number) && list[number].near <= full + APART
            };
            self.tell_all(list, |number, _| match is_asked(number) {
                true => Part::default(),
                false => Part::SHADOWED,
            });
            self.resolve(list, is_asked);
            return Known::alike(Word::list(place));
        }
        self.order = order;
        self.keep_before(list, full + APART);
        let list = std::mem::take(list);
        self.node(&list, cell, queries)
    }

    /// Returns what a cell says of free starts that are not past its threshold, of which no other than these of a list
    /// may block any.
    fn free(&mut self, list: &[Entry], nearest: f32, is_one: impl Fn(usize) -> bool) -> Word {
        let Some(lists) = &mut self.free_lists else {
            return Word::threshold(nearest);
        };
        let ones = list.iter().enumerate().filter(|one| is_one(one.0));
        let key: Vec<u16> = ones.map(|(_, entry)| entry.facet).collect();
        if key.len() > LONGEST {
            return Word::NEVER;
        }
        // Many cells of a tile say the same.
        *lists.entry(key).or_insert_with_key(|key| {
            let place = self.words.len();
            let counts = counts(key.len(), key.len(), NOT_CUT);
            self.words.extend([f32::INFINITY.to_bits(), counts]);
            self.words.extend(key.iter().map(|&facet| {
                let facet = usize::from(facet);
                entry(self.facets[facet].nearest() - PAST, self.numbers[facet])
            }));
            Word::list(place)
        })
    }
}
