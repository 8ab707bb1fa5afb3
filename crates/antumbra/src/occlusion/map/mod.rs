//! The exact shadow map of a light: what all directions from it know.
//!
//! In: the surfaces, a light. Out: for a start that is located in a tile whether it is in shadow, by one threshold; or
//! the few surfaces that may block it. The views of [`Views`] are cut into tiles, tiles into cells where that pays.
//! Invariant: what a map says is the reference's answer; what it knows is a function of who has asked. The proofs are in
//! the note beside this file. Absent here: what a start is, exact rules, voxels, when a map pays.

mod build;
mod codes;
mod faces;
mod facet;
mod found;
mod made;
mod nodes;
mod queries;
mod reading;
mod resolve;
mod runs;
mod sheet;
mod sheets;

mod prices;
mod saved;
mod size;
#[cfg(test)]
mod tests;
mod words;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use antumbra_geometry::{DVec2, LightShape, Occluders};
use antumbra_task::{check, checked};
use fearless_simd::{Level, Simd, dispatch};

use self::build::{AGAIN, Builder, Made, Owned, Queries, digit};
use self::faces::Faces;
use self::facet::{Depths, footprint};
pub(crate) use self::prices::{Prices, Spent};
pub(super) use self::runs::MapRuns;
pub(super) use self::size::{height_bytes, most_words, price};
use self::size::{most_entries, tile_count};
use self::words::{Arena, COUNTS, NODE_WORDS};
pub(super) use self::words::{BIAS, Word, rough_depth};
use super::room::Share;
use super::tables::Tables;
use super::views::{NO_TILE, Views};
use crate::accel::frame::Frame;
use crate::threads::prelude::*;
pub(super) use found::{Located, Told};

/// What a light's directions know so far.
#[derive(Debug)]
pub(crate) struct Map {
    pub(super) views: Views,
    depths: Depths,
    /// For each tile where its surfaces begin, and an end.
    first: Box<[u32]>,
    surfaces: Box<[u32]>,
    /// For each tile what it knows, and what it says of free starts.
    tiles: Box<[AtomicU32]>,
    free: Box<[AtomicU32]>,
    faces: Faces,
    /// Queries that found nothing in a tile; once it is made, free ones.
    asked: Box<[AtomicU32]>,
    /// Queries that calls in progress will ask of a tile.
    coming: Box<[AtomicU32]>,
    arena: Arena,
    /// Of all its bytes, once it is made.
    share: OnceLock<Share>,
    is_full: AtomicBool,
}

const TRIES: usize = 3;

/// What a tile costs, and each surface in it, in nanoseconds.
const TILE_NS: f32 = 3_000.0;
const IN_TILE_NS: f32 = 900.0;
/// Of what rays to a tile took a tile may cost this share. Not all come that are announced: views move.
const OF_RAYS: f32 = 0.5;
const OF_COMING: f32 = 0.5;

/// Set beside the code of a start's place if the start is free.
pub(super) const FREE: u32 = 1 << 31;

/// Queries that found no threshold and no list in cells of a tile until it is made again.
const WANTING: f32 = 1_000.0;

/// Tiles of a whole map are made for so many queries at most: for more their lists are cut as they come.
const MOST_WEIGHT: f32 = 40_000.0;

/// Of a whole map rays are taken to last so long, in nanoseconds: lists are of up to 20 surfaces.
const WHOLE_RAY_NS: f32 = 150.0;

impl Map {
    /// Sorts surfaces into tiles, about which nothing is known yet. `None` if no view suits the light. Words take at
    /// most so many bytes.
    pub(crate) fn new(occluders: &Occluders, tables: &Tables<'_>, most_bytes: u64) -> Option<Self> {
        let mut count = tile_count(occluders);
        for _ in 0..TRIES {
            let made = Self::with_tiles(occluders, tables, most_bytes, count);
            if made.is_some() {
                return made;
            }
            count /= 16.0;
        }
        None
    }

    /// `None` also if tiles would hold too many surfaces.
    fn with_tiles(
        occluders: &Occluders,
        tables: &Tables<'_>,
        most_bytes: u64,
        tile_count: f64,
    ) -> Option<Self> {
        let (frame, light): (&Frame, &LightShape) = (tables.frame, tables.light);
        let views = Views::new(&occluders.bounds(), frame, light, tile_count)?;
        let count = views.tile_count();
        let most = most_entries(occluders.surface_count(), count);
        let mut placed: Vec<(u32, u32)> = Vec::with_capacity(most);
        let mut has_room = true;
        for view in &views.all {
            for surface in checked(occluders.surfaces()) {
                let Some((footprint, _)) = footprint(view, surface, tables) else {
                    continue;
                };
                footprint.tiles(view, |[column, row]| {
                    has_room &= placed.len() < most;
                    if has_room {
                        let tile = view.first + row * view.size[0] + column;
                        placed.push((tile as u32, surface.0));
                    }
                });
                if !has_room {
                    return None;
                }
            }
        }
        let mut first = vec![0_u32; count + 1];
        for &(tile, _) in &placed {
            first[tile as usize + 1] += 1;
        }
        for tile in 0..count {
            first[tile + 1] += first[tile];
        }
        let mut next = first.clone();
        let mut surfaces = vec![0_u32; placed.len()];
        for &(tile, surface) in &placed {
            let next = &mut next[tile as usize];
            surfaces[*next as usize] = surface;
            *next += 1;
        }
        let word = |tile: usize| match first[tile] == first[tile + 1] {
            true => Word::LIT,
            false => Word::UNASKED,
        };
        Some(Self {
            tiles: (0..count)
                .map(|tile| AtomicU32::new(word(tile).0))
                .collect(),
            free: (0..count).map(|_| AtomicU32::new(Word::LIT.0)).collect(),
            asked: (0..count).map(|_| AtomicU32::new(0)).collect(),
            coming: (0..count).map(|_| AtomicU32::new(0)).collect(),
            arena: Arena::new((most_bytes / 4) as usize),
            share: OnceLock::new(),
            is_full: AtomicBool::new(false),
            faces: Faces::new(occluders.surface_count(), surfaces.iter().copied()),
            first: first.into(),
            surfaces: surfaces.into(),
            depths: Depths::of(&views.all[0]),
            views,
        })
    }

    pub(crate) fn bytes(&self) -> u64 {
        let tables = size_of::<Self>()
            + size_of_val(&*self.views.all)
            + size_of_val(&*self.first)
            + size_of_val(&*self.surfaces)
            + size_of_val(&*self.tiles)
            + size_of_val(&*self.free)
            + size_of_val(&*self.asked)
            + size_of_val(&*self.coming)
            + self.faces.bytes();
        (tables + 4 * self.arena.held()) as u64
    }

    /// Takes what it has of its room from here on from this share.
    pub(crate) fn keep(self, share: Share) -> Self {
        Self {
            share: OnceLock::from(share),
            ..self
        }
    }

    /// Returns whether something found no room.
    pub(crate) fn is_full(&self) -> bool {
        self.is_full.load(Ordering::Relaxed)
    }

    /// Takes words, where there is room for them.
    fn take(&self, words: usize) -> Option<usize> {
        let bytes = Arena::bytes_of(words);
        let share = self.share.get().filter(|_| !self.arena.is_trimmed());
        let has_room = share.is_none_or(|share| share.grow(bytes));
        let place = has_room.then(|| self.arena.take(words)).flatten();
        if place.is_none() {
            self.is_full.store(true, Ordering::Relaxed);
            if let (Some(share), true) = (share, has_room) {
                share.give_back(bytes);
            }
        }
        place
    }

    fn surfaces_of(&self, tile: usize) -> &[u32] {
        &self.surfaces[self.first[tile] as usize..self.first[tile + 1] as usize]
    }

    /// Returns a map of which all tiles are made, for so many queries together, on all threads.
    pub(crate) fn whole(self, tables: &Tables<'_>, queries: f32) -> Self {
        self.make_all(tables, queries);
        Self {
            arena: self.arena.trimmed(),
            ..self
        }
    }

    /// Makes all tiles that are not made, for so many queries together, on all threads.
    pub(super) fn make_all(&self, tables: &Tables<'_>, queries: f32) {
        let is_made = |tile: usize| self.tiles[tile].load(Ordering::Acquire) != Word::UNASKED.0;
        if (0..self.tiles.len()).all(is_made) {
            return;
        }
        let weight = (queries / self.tiles.len() as f32).min(MOST_WEIGHT);
        let queries = Queries::of_tile(weight, WHOLE_RAY_NS);
        const RUN: usize = 32;
        const TOGETHER: usize = 16 * RUN;
        for first in (0..self.tiles.len()).step_by(TOGETHER) {
            let end = self.tiles.len().min(first + TOGETHER);
            let runs: Vec<Vec<(usize, Owned)>> = (0..(end - first).div_ceil(RUN))
                .into_par_iter()
                .map(|run| {
                    check();
                    let tiles = first + RUN * run..end.min(first + RUN * (run + 1));
                    let mut made = Vec::new();
                    dispatch!(Level::new(), simd => {
                        let mut builder = Builder::new(simd, *tables);
                        for tile in tiles {
                            if !is_made(tile) && !self.surfaces_of(tile).is_empty() {
                                self.take_up(&mut builder, tile);
                                made.push((tile, builder.make((0, 0), queries, true).to_owned()));
                            }
                        }
                    });
                    made
                })
                .collect();
            // One after another: where room ends does not depend on threads.
            for (tile, made) in runs.iter().flatten() {
                self.put((*tile, None), &made.borrow());
            }
        }
    }

    /// Notes that so many queries are coming at each of some places.
    pub(super) fn expect(&self, places: &[(u32, u32)], each: u32) {
        for &(tile, _) in places {
            let coming = &self.coming[tile as usize];
            let more = |coming: u32| Some(coming.saturating_add(each));
            let _ = coming.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        }
    }

    /// Notes that those have come.
    pub(super) fn expect_no_more(&self, places: &[(u32, u32)], each: u32) {
        for &(tile, _) in places {
            // Of another map, which was dropped meanwhile.
            let Some(coming) = self.coming.get(tile as usize) else {
                continue;
            };
            let less = |coming: u32| Some(coming.saturating_sub(each));
            let _ = coming.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        }
    }

    /// Makes tiles that it pays to know, of those that starts ask about which found nothing, each of which stands for so
    /// many queries that would take a ray of so many nanoseconds; cuts cells whose lists were asked too often; and makes
    /// tiles again that say too little of free starts ([`FREE`]). Returns whether any was made.
    pub(super) fn make_for(
        &self,
        tables: &Tables<'_>,
        asking: &[(u32, u32)],
        each: f32,
        ray_ns: f32,
    ) -> bool {
        // What would find no room is not worth making.
        if self.is_full() {
            return false;
        }
        let asking = &*self.sorted(asking);
        let mut is_any = false;
        dispatch!(Level::new(), simd => {
            let mut builder = Builder::new(simd, *tables);
            for group in asking.chunk_by(|a, b| a.0 == b.0) {
                let tile = group[0].0 as usize;
                let is_free = |&(_, code): &(u32, u32)| code & FREE != 0;
                if self.tiles[tile].load(Ordering::Acquire) == Word::UNASKED.0 {
                    let has_free = group.iter().any(is_free);
                    let asked = (group.len(), [each, ray_ns]);
                    is_any |= self.make_if_paid(&mut builder, tile, asked, has_free);
                    continue;
                }
                is_any |= self.cut_lists(&mut builder, tile, group, ray_ns);
                let is_wanting = |place: &&(u32, u32)| {
                    let (word, (_, slot)) = self.cell(tile, place.1);
                    let free = self.free(tile as u32, slot.unwrap_or(0) as u32);
                    let has_threshold = word.is_threshold() || word.is_slant();
                    let wants_list = !free.is_list() && free != Word::NEVER;
                    word == Word::UNASKED || has_threshold && is_free(place) && wants_list
                };
                let asked = (group.iter().filter(is_wanting).count(), [each, ray_ns]);
                if asked.0 > 0 {
                    is_any |= self.make_if_paid(&mut builder, tile, asked, true);
                }
            }
        });
        is_any
    }

    fn make_if_paid<S: Simd>(
        &self,
        builder: &mut Builder<'_, S>,
        tile: usize,
        (starts, [each, ray_ns]): (usize, [f32; 2]),
        has_free: bool,
    ) -> bool {
        let before = self.asked[tile].fetch_add(starts as u32, Ordering::Relaxed);
        let coming = self.coming[tile].load(Ordering::Relaxed);
        let queries = (before as f32 + starts as f32) * each + OF_COMING * coming as f32;
        let price = TILE_NS + IN_TILE_NS * self.surfaces_of(tile).len() as f32;
        if OF_RAYS * queries * ray_ns < price {
            return false;
        }
        let is_made = self.tiles[tile].load(Ordering::Acquire) != Word::UNASKED.0;
        if is_made && queries < WANTING {
            return false;
        }
        // So that it serves all as it did.
        let (queries, has_free) = match is_made {
            true => (queries.max(AGAIN), true),
            false => (queries, has_free),
        };
        let queries = Queries::of_tile(queries, ray_ns);
        self.asked[tile].store(0, Ordering::Relaxed);
        self.make_tile(builder, tile, queries, has_free)
    }

    /// Cuts those cells of a tile, which hold some places, whose lists were asked too often.
    fn cut_lists<S: Simd>(
        &self,
        builder: &mut Builder<'_, S>,
        tile: usize,
        places: &[(u32, u32)],
        ray_ns: f32,
    ) -> bool {
        let mut is_any = false;
        for &(_, code) in places {
            let (word, slot) = self.cell(tile, code);
            if word.is_list() && !self.arena.spend(word.place() + COUNTS, 0) {
                if !is_any {
                    self.take_up(builder, tile);
                }
                let queries = Queries::of_list(ray_ns);
                let has_free = code & FREE != 0;
                is_any |= self.make(builder, (tile, code), slot, queries, has_free);
            }
        }
        is_any
    }

    /// Sorts places by tiles, and in these.
    fn sorted(&self, asking: &[(u32, u32)]) -> Vec<(u32, u32)> {
        if asking.len() < self.tiles.len() / 8 {
            let mut sorted = asking.to_vec();
            sorted.sort_unstable();
            return sorted;
        }
        let mut ends = vec![0_u32; self.tiles.len() + 1];
        for &(tile, _) in asking {
            ends[tile as usize + 1] += 1;
        }
        for tile in 0..self.tiles.len() {
            ends[tile + 1] += ends[tile];
        }
        let mut sorted = vec![(0, 0); asking.len()];
        for &place in asking {
            let end = &mut ends[place.0 as usize];
            sorted[*end as usize] = place;
            *end += 1;
        }
        for group in sorted.chunk_by_mut(|a, b| a.0 == b.0) {
            group.sort_unstable();
        }
        sorted
    }

    fn take_up<S: Simd>(&self, builder: &mut Builder<'_, S>, tile: usize) {
        let views = &self.views.all;
        let number = views.partition_point(|view| view.first <= tile) - 1;
        let view = &views[number];
        let (row, column) = (
            (tile - view.first) / view.size[0],
            (tile - view.first) % view.size[0],
        );
        let middle = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        builder.take_up(view, middle, self.surfaces_of(tile));
    }

    fn make_tile<S: Simd>(
        &self,
        builder: &mut Builder<'_, S>,
        tile: usize,
        queries: Queries,
        has_free: bool,
    ) -> bool {
        if self.surfaces_of(tile).is_empty() {
            return false;
        }
        self.take_up(builder, tile);
        self.make(builder, (tile, 0), (0, None), queries, has_free)
    }

    /// Returns what is known of a place in a tile, the level of its cell, and where the word stands, `None` for the
    /// tile's.
    fn cell(&self, tile: usize, code: u32) -> (Word, (u32, Option<usize>)) {
        let mut word = Word(self.tiles[tile].load(Ordering::Acquire));
        let mut slot = (0, None);
        while word.is_node() {
            let levels = if word.is_wide() { 2 } else { 1 };
            let mut place = word.place() + digit(code, slot.0);
            if word.is_wide() {
                place = word.place() + digit(code, slot.0) * NODE_WORDS + digit(code, slot.0 + 1);
            }
            word = Word(self.arena.read(place));
            slot = (slot.0 + levels, Some(place));
        }
        (word, slot)
    }

    fn make<S: Simd>(
        &self,
        builder: &mut Builder<'_, S>,
        (tile, code): (usize, u32),
        (level, slot): (u32, Option<usize>),
        queries: Queries,
        has_free: bool,
    ) -> bool {
        let made = builder.make((level, code), queries, has_free);
        self.put((tile, slot), &made)
    }

    /// Writes what was made of a tile, or of a cell of it whose word stands at a place; returns whether there was room.
    fn put(&self, (tile, slot): (usize, Option<usize>), made: &Made<'_>) -> bool {
        let Some(place) = self.take(made.words.len()) else {
            return false;
        };
        let [word, free] = made.write(&self.arena, place);
        match slot {
            Some(slot) => self.arena.publish(slot, word, free),
            None => {
                self.free[tile].store(free.0, Ordering::Relaxed);
                // A tile that is made again tells nothing new. Two threads may make one at once.
                let is_first = |before: u32| before == Word::UNASKED.0 && word != Word::UNASKED;
                if is_first(self.tiles[tile].load(Ordering::Relaxed)) {
                    for &(surface, part) in made.parts {
                        self.faces.tell(surface, part);
                    }
                }
                if is_first(self.tiles[tile].swap(word.0, Ordering::AcqRel)) {
                    for &(surface, _) in made.parts {
                        self.faces.finish_tile(surface);
                    }
                }
            }
        }
        true
    }
}

/// In place of a tile.
pub(super) const NOWHERE: u32 = NO_TILE;
