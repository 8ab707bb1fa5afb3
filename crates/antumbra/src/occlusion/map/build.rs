//! What a tile knows: thresholds, lists, and cells of cells.
//!
//! In: the facets of a tile, who asks. Out: the tile's words. The proofs are in the note beside this file.

use std::collections::HashMap;

use antumbra_geometry::{DVec2, DVec3, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::super::forms::BOUND;
use super::super::tables::{NONE, Tables};
use super::super::views::CELLS_ALONG_TILE;
use super::super::views::View;
pub(super) use super::codes::{LEVELS, digit, place_codes};
use super::faces::Part;
use super::facet::{Cells, Depths, Facet, ROOM};
pub(super) use super::made::{Made, Owned};
pub(super) use super::queries::Queries;
pub(super) use super::queries::{AGAIN, LONGEST};
use super::sheet::{MOST_IN_SHEET, Sheet, Slant};
use super::words::{ALIGNED, NODE_CELLS, NODE_WORDS, NOT_CUT, Word, counts, entry};
// Places are moved by no more than a cell.
const _: () = assert!(1 << (2 * LEVELS) == CELLS_ALONG_TILE);

/// A list is cut while its entries, tested by all queries that are expected, are more than this; and later when so many
/// were tested.
const CUT: f32 = 1_500.0;
const TESTS_LEFT: u32 = 2_000;
const MOST_APART: usize = 6;

/// Starts nearer a light among the surfaces may be in no tile.
const LEAST_TOLD: f64 = 1.0 / 32.0;

/// Depths that are compared are off by [`BOUND`] each, and so is a start's.
const APART: f32 = 4.0 * BOUND;
const PAST: f32 = 2.0 * BOUND;

#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) facet: u16,
    covers: bool,
    pub(super) near: f32,
    pub(super) far: f32,
}

/// The word of a cell, and the one for free starts.
#[derive(Clone, Copy)]
struct Known {
    word: Word,
    free: Word,
}

impl Known {
    const NOTHING: Self = Self {
        word: Word::LIT,
        free: Word::LIT,
    };

    /// No threshold, so that free starts need nothing else.
    fn alike(word: Word) -> Self {
        Self {
            word,
            free: Word::NEVER,
        }
    }
}

#[derive(Clone, Copy)]
struct Cell {
    low: [f32; 2],
    side: f32,
    level: u32,
}

impl Cell {
    fn middle(&self) -> [f32; 2] {
        self.low.map(|low| low + 0.5 * self.side)
    }
}

/// Makes tiles, one after another.
pub(super) struct Builder<'a, S> {
    simd: S,
    pub(super) tables: Tables<'a>,
    depths: Depths,
    /// By how much cells are inflated, in tiles.
    margin: f32,
    /// Whether the tile has more surfaces than numbers tell.
    is_crowded: bool,
    facets: Vec<Facet>,
    /// For each of them the number of its surface among those of the tile.
    numbers: Vec<u16>,
    /// For each of them its surface, and what cells tell of it.
    parts: Vec<(u32, Part)>,
    /// Facets beyond each side, [`NONE`] where there is none.
    beyond: Vec<[u32; 3]>,
    /// For each facet its number in the list at hand.
    in_list: Vec<u32>,
    words: Vec<u32>,
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
        let is_reported = |facet: &Facet| {
            self.tables.side(facet.surface as usize).is_some()
                && (!view.is_face || f64::from(facet.nearest()) > LEAST_TOLD)
        };
        let part = |facet: &Facet| match is_reported(facet) {
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
        self.free_lists = has_free.then(HashMap::new);
        let mut cell = Cell {
            low: [-0.5; 2],
            side: 1.0,
            level,
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
            words: &self.words,
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

    /// Cuts a cell into sixteen.
    fn node(&mut self, list: &[Entry], cell: &Cell, queries: Queries) -> Known {
        let first = self.words.len();
        self.words.resize(first + NODE_WORDS, 0);
        let side = 0.25 * cell.side;
        let mut middles = [[0.0; NODE_CELLS]; 2];
        for number in 0..NODE_CELLS {
            middles[0][number] = cell.low[0] + side * (0.5 + (number & 3) as f32);
            middles[1][number] = cell.low[1] + side * (0.5 + (number >> 2) as f32);
        }
        let cells = Cells {
            u: f32x16::from_slice(self.simd, &middles[0]),
            v: f32x16::from_slice(self.simd, &middles[1]),
            half: 0.5 * side + self.margin,
        };
        let mut lists = self.spare.pop().unwrap_or_default();
        lists.resize_with(NODE_CELLS, Vec::new);
        lists.iter_mut().for_each(Vec::clear);
        self.simd.vectorize(
            #[inline(always)]
            || self.split(list, &cells, &mut lists),
        );
        for (number, list) in lists.iter_mut().enumerate() {
            let finer = Cell {
                low: [
                    cell.low[0] + side * (number & 3) as f32,
                    cell.low[1] + side * (number >> 2) as f32,
                ],
                side,
                level: cell.level + 1,
            };
            let known = self.cell(list, &finer, queries.in_a_cell());
            self.words[first + number] = known.word.0;
            self.words[first + NODE_CELLS + number] = known.free.0;
        }
        self.spare.push(lists);
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

    /// Returns the nearest sheet of a list: triangles that cover each place of the inflated cell exactly once.
    /// `over` are those over one place of it.
    fn sheet(&mut self, list: &[Entry], cell: &Cell, full: f32, over: u64) -> Sheet {
        for (number, entry) in list.iter().enumerate() {
            self.in_list[usize::from(entry.facet)] = number as u32;
        }
        let mut best = Sheet::NONE;
        let mut left = over;
        while left != 0 {
            let number = left.trailing_zeros() as usize;
            let grown = self.grow_sheet(list, cell, number);
            left &= !(1 << number | grown.map_or(0, |sheet| sheet.members));
            if let Some(sheet) = grown
                && sheet.far < best.far
                && sheet.far <= full
                && (sheet.members & over).count_ones() == 1
            {
                best = sheet;
            }
        }
        for entry in list {
            self.in_list[usize::from(entry.facet)] = NONE;
        }
        best
    }

    /// Returns a slanted threshold as steep as the largest part of a sheet, which lies behind all of it, and those of a
    /// list that lie behind the threshold. `None` if keys do not tell such depths.
    fn slant(&self, list: &[Entry], cell: &Cell, sheet: &Sheet, nearest: f32) -> Option<Slant> {
        let (middle, half) = (cell.middle(), 0.5 * cell.side + self.margin);
        let facet = |number: usize| &self.facets[usize::from(list[number].facet)];
        let members = || (0..list.len()).filter(|&number| sheet.holds(number));
        let slopes = members().filter_map(|number| facet(number).slope(middle, half));
        let (slope, _) = slopes.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let [least, most] = [nearest, sheet.far].map(f64::from);
        let steepness = self
            .depths
            .steepness(least)
            .min(self.depths.steepness(most));
        // Not for NaN, nor nearer than the light.
        let is_reported = steepness > LEAST_SLANTED && self.depths.weight(least) > 0.0;
        if !is_reported {
            return None;
        }
        let key = |depth: f32| self.depths.key(f64::from(depth)) as f32;
        let over = |number: usize| {
            let Entry { near, far, .. } = list[number];
            let at = slope[0] * middle[0] + slope[1] * middle[1];
            let reach = (slope[0].abs() + slope[1].abs()) * half;
            let [low, high] = facet(number).key_less(slope, middle, half);
            [
                low.max(key(near) - at - reach),
                high.min(key(far) - at + reach),
            ]
        };
        // What the key of a start, of a place and of a plane is off, and what `f32` makes of it.
        let steepest = slope[0].abs() + slope[1].abs();
        let size = key(nearest).abs().max(key(sheet.far).abs()) + steepest;
        let error = 2.0 * BOUND / steepness as f32 + steepest * self.margin + size * KEY_ROUNDING;
        let far = members().fold(f32::NEG_INFINITY, |far, number| far.max(over(number)[1]));
        let key = far + 2.0 * error;
        let is_hidden = |&number: &usize| {
            !sheet.holds(number) && number < MOST_IN_SHEET && over(number)[0] > key + 2.0 * error
        };
        let hidden = (0..list.len()).filter(is_hidden);
        let hidden = hidden.fold(0_u64, |hidden, number| hidden | 1 << number);
        (hidden != 0).then_some(Slant { slope, key, hidden })
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

    fn write_slant(&mut self, slant: &Slant, full: f32) -> Word {
        let place = self.words.len().next_multiple_of(ALIGNED);
        self.words.resize(place, 0);
        let [x, y] = slant.slope;
        self.words.extend([x, y, slant.key, full].map(f32::to_bits));
        Word::slant(place)
    }

    /// Returns those of a list that hold a place of a cell to which no side comes near, a bit each, if there is one.
    fn over_a_place(&self, list: &[Entry], cell: &Cell) -> Option<u64> {
        const PLACES: [[f32; 2]; 4] = [[0.47, 0.52], [0.3, 0.4], [0.7, 0.35], [0.6, 0.8]];
        PLACES.iter().find_map(|place| {
            let at = [0, 1].map(|axis| cell.low[axis] + place[axis] * cell.side);
            let mut over = 0_u64;
            for (number, entry) in list.iter().enumerate() {
                let facet = &self.facets[usize::from(entry.facet)];
                if facet.is_whole {
                    over |= u64::from(facet.holds(at)?) << number;
                }
            }
            Some(over)
        })
    }

    /// Returns a member of a list and all that are joined to it over sides that may come into the inflated cell; `None`
    /// if such a side ends what they cover.
    fn grow_sheet(&self, list: &[Entry], cell: &Cell, number: usize) -> Option<Sheet> {
        let middle = cell.middle();
        let half = 0.5 * cell.side + self.margin;
        let mut sheet = Sheet {
            members: 1 << number,
            near: f32::INFINITY,
            far: f32::NEG_INFINITY,
        };
        let mut due = sheet.members;
        while due != 0 {
            let entry = &list[due.trailing_zeros() as usize];
            due &= due - 1;
            sheet.near = sheet.near.min(entry.near);
            sheet.far = sheet.far.max(entry.far);
            if entry.covers {
                continue;
            }
            let facet = &self.facets[usize::from(entry.facet)];
            for side in 0..3 {
                if !facet.side_may_meet(side, middle, half) {
                    continue;
                }
                let beyond = self.beyond[usize::from(entry.facet)][side];
                // Of none, a number that no facet has.
                let &other = self.in_list.get(beyond as usize)?;
                if other == NONE {
                    return None;
                }
                due |= 1 << other & !sheet.members;
                sheet.members |= 1 << other;
            }
        }
        Some(sheet)
    }

    /// Returns whether no two of a list hide one another.
    fn are_apart(&self, list: &[Entry]) -> bool {
        let facet = |entry: &Entry| &self.facets[usize::from(entry.facet)];
        if list.iter().any(|entry| !facet(entry).has_sides()) {
            return false;
        }
        let mut positions = [[DVec3::ZERO; 3]; MOST_APART];
        for (positions, entry) in positions.iter_mut().zip(list) {
            let surface = SurfaceId(facet(entry).surface);
            let Some(corners) = self.tables.occluders.triangle_positions(surface) else {
                return false;
            };
            *positions = corners;
        }
        (0..list.len()).all(|one| {
            (0..one).all(|other| {
                let (a, b) = (facet(&list[one]), facet(&list[other]));
                let (p, q) = (&positions[one], &positions[other]);
                a.parts_from(b, [p, q]) || b.parts_from(a, [q, p])
            })
        })
    }
}

/// Slanted thresholds are made for nothing that is so near a light: a depth changes so little with its key.
const LEAST_SLANTED: f64 = 1.0 / (1u64 << 20) as f64;
/// Rounding of a key less a linear function in `f32`, as a share of the size of both.
const KEY_ROUNDING: f32 = 1.0 / (1u32 << 20) as f32;
