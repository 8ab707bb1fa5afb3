//! A map as words in a row, to be saved, and back.
//!
//! In: a map, or words from anywhere. Out: words, or a map. docs/formats.md says what the words mean; in short: a tile
//! is its word, then what that leads to, cell by cell, without places. So there are no places that could be wrong.
//! Invariant: whatever the words are, reading ends, takes no more memory than a small multiple of them, and leaves
//! a map that no query trips over. Absent here: files, checksums, whose words they are.

use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use antumbra_geometry::Occluders;
use antumbra_task::check;

use super::super::stream::Misfit;
use super::super::tables::Tables;
use super::super::views::Views;
use super::build::{LEVELS, LONGEST};
use super::faces::Faces;
use super::facet::Depths;
use super::made::Made;
use super::nodes::{Known, cells, tile_node, write_node};
pub(in super::super) use super::runs::MapRuns;
use super::words::{
    ALIGNED, Arena, COUNTS, HEAD, NODE_CELLS, NODE_WORDS, NOT_CUT, SLANT_WORDS, WIDE_WORDS, Word,
    entry_counts,
};
use super::{Map, TRIES, tile_count};

/// In place of words that lead somewhere.
const NODE: Word = Word::node(0);
const SLANT: Word = Word::slant(0);

/// Words of tiles.
struct Writer<'a> {
    map: &'a Map,
    words: Vec<u32>,
    /// Lists of the tile at hand that were written.
    lists: Vec<usize>,
}

impl Map {
    /// Returns what is known, as words, and how many tiles are not made. What is made meanwhile may or may not be among
    /// it.
    pub(in super::super) fn runs(&self) -> (MapRuns<'_>, u64) {
        let mut writer = Writer {
            map: self,
            words: Vec::with_capacity(self.arena.taken()),
            lists: Vec::new(),
        };
        let mut pending_count = 0;
        for (tile, free) in self.tiles.iter().zip(&self.free) {
            check();
            writer.lists.clear();
            // First the word: what is said of free starts is there with it.
            let word = Word(tile.load(Ordering::Acquire));
            pending_count += u64::from(word == Word::UNASKED);
            writer.write(word, Word(free.load(Ordering::Relaxed)));
        }
        let tables = [&self.first, &self.surfaces].map(|table| Cow::Borrowed(&**table));
        let [first, surfaces] = tables;
        // Last: of tiles that were written all is told.
        let faces = Cow::Owned(self.faces.packed());
        let tiles = Cow::Owned(writer.words);
        ([tiles, first, surfaces, faces], pending_count)
    }

    /// Takes words that were saved of a light's map, in an arena of at most so many bytes.
    ///
    /// # Errors
    /// The words are no map of this light over these surfaces, or there is no room.
    pub(in super::super) fn of_runs(
        runs: MapRuns<'_>,
        occluders: &Occluders,
        tables: &Tables<'_>,
        most_bytes: u64,
    ) -> Result<Self, Misfit> {
        let [tiles, first, surfaces, faces] = runs;
        let surface_count = occluders.surface_count() as u32;
        check_tables(&first, &surfaces, surface_count)
            .map_err(|misfit| misfit.after(tiles.len()))?;
        let count = first.len() - 1;
        let views = (0..TRIES)
            .filter_map(|tries| {
                let wanted = tile_count(occluders) / 16_f64.powi(tries as i32);
                Views::new(&occluders.bounds(), tables.frame, tables.light, wanted)
            })
            .find(|views| views.tile_count() == count)
            .ok_or(Misfit::At(tiles.len(), "tiles of another number"))?;
        let mut reader = Reader {
            words: &tiles,
            at: 0,
            surface_count: 0,
            made: Vec::new(),
            lists: Vec::new(),
            is_open: false,
        };
        let arena = Arena::new((most_bytes / 4) as usize);
        let mut made = Vec::with_capacity(count);
        for ends in first.windows(2) {
            check();
            reader.surface_count = ends[1] - ends[0];
            made.push(reader.tile(&arena)?);
        }
        if reader.at < tiles.len() {
            return Err(reader.bad("more words than cells"));
        }
        let is_open = reader.is_open;
        let of_each = |word: fn(&Known) -> Word| {
            let words = made.iter().map(word);
            words.map(|word| AtomicU32::new(word.0)).collect()
        };
        let not_made = made.iter().zip(first.windows(2));
        let not_made = not_made.filter(|(tile, _)| tile.word == Word::UNASKED);
        let faces = Faces::of_packed(
            occluders.surface_count(),
            not_made.flat_map(|(_, ends)| {
                let surfaces = &surfaces[ends[0] as usize..ends[1] as usize];
                surfaces.iter().copied()
            }),
            &faces,
        );
        let at = tiles.len() + first.len() + surfaces.len();
        let faces = faces.ok_or(Misfit::At(at, "faces of another number or kind"))?;
        let noughts = || (0..count).map(|_| AtomicU32::new(0)).collect();
        Ok(Self {
            tiles: of_each(|tile| tile.word),
            free: of_each(|tile| tile.free),
            asked: noughts(),
            coming: noughts(),
            arena: if is_open { arena } else { arena.trimmed() },
            share: OnceLock::new(),
            is_full: AtomicBool::new(false),
            faces,
            first: first.into(),
            surfaces: surfaces.into(),
            depths: Depths::of(&views.all[0]),
            views,
        })
    }
}

/// Checks where the surfaces of tiles begin, and that those of each are in ascending order.
fn check_tables(first: &[u32], surfaces: &[u32], surface_count: u32) -> Result<(), Misfit> {
    let ends = (first.first(), first.last().map(|&last| last as usize));
    if ends != (Some(&0), Some(surfaces.len())) || !first.is_sorted() {
        return Err(Misfit::At(0, "tiles that hold no such surfaces"));
    }
    let (mut tile, mut before) = (0, None);
    for (at, &surface) in surfaces.iter().enumerate() {
        while first[tile] as usize <= at {
            tile += 1;
            before = None;
        }
        if surface >= surface_count || before.is_some_and(|before| before >= surface) {
            let what = "a surface that is not there, or twice";
            return Err(Misfit::At(first.len() + at, what));
        }
        before = Some(surface);
    }
    Ok(())
}

impl Writer<'_> {
    /// Writes a cell of which these are known.
    fn write(&mut self, word: Word, free: Word) {
        if word.is_node() {
            self.words.push(NODE.0);
            for node in word.nodes() {
                if word.is_wide() {
                    self.write_part(node);
                } else {
                    self.write_cells(node);
                }
            }
        } else if word.is_list() {
            self.write_list(word);
        } else if word.is_slant() {
            self.words.push(SLANT.0);
            let words = self.map.arena.slice(word.place(), SLANT_WORDS);
            let words = words.iter().map(|word| word.load(Ordering::Relaxed));
            self.words.extend(words);
            self.write_free(free);
        } else {
            self.words.push(word.0);
            if word.is_threshold() {
                self.write_free(free);
            }
        }
    }

    fn write_cells(&mut self, node: usize) {
        for Known { word, free } in cells(&self.map.arena, node) {
            self.write(word, free);
        }
    }

    /// Writes a part of a wide node: one cell if it has never been cut.
    fn write_part(&mut self, node: usize) {
        let first = cells(&self.map.arena, node).next();
        match first.filter(|first| cells(&self.map.arena, node).all(|cell| cell == *first)) {
            Some(Known { word, free }) => self.write(word, free),
            None => {
                self.words.push(NODE.0);
                self.write_cells(node);
            }
        }
    }

    fn write_free(&mut self, free: Word) {
        if free.is_list() {
            self.write_list(free);
        } else {
            self.words.push(free.0);
        }
    }

    /// Writes the number that a list has in its tile, and the list where it is new.
    fn write_list(&mut self, list: Word) {
        let place = list.place();
        let known = self.lists.iter().position(|&known| known == place);
        let number = known.unwrap_or(self.lists.len());
        self.words.push(Word::list(number).0);
        if known.is_some() {
            return;
        }
        self.lists.push(place);
        let [_, count] = entry_counts(self.map.arena.read(place + COUNTS));
        let words = self.map.arena.slice(place, HEAD + count);
        let words = words.iter().map(|word| word.load(Ordering::Relaxed));
        self.words.extend(words);
    }
}

/// Reads the words of tiles.
struct Reader<'a> {
    words: &'a [u32],
    at: usize,
    /// Surfaces of the tile at hand.
    surface_count: u32,
    /// The words of the tile at hand.
    made: Vec<u32>,
    /// Lists of the tile at hand, by their numbers.
    lists: Vec<Word>,
    /// Whether more may be made.
    is_open: bool,
}

impl<'a> Reader<'a> {
    fn bad(&self, what: &'static str) -> Misfit {
        Misfit::At(self.at, what)
    }

    fn next(&mut self) -> Result<u32, Misfit> {
        self.take(1).map(|words| words[0])
    }

    fn take(&mut self, count: usize) -> Result<&'a [u32], Misfit> {
        let end = self.at.saturating_add(count);
        let words = self.words.get(self.at..end);
        let words = words.ok_or(Misfit::At(self.at, "an end too early"))?;
        self.at = end;
        Ok(words)
    }

    /// Reads a tile: its word, and what it says of free starts.
    fn tile(&mut self, arena: &Arena) -> Result<Known, Misfit> {
        self.lists.clear();
        self.made.clear();
        let (known, first) = match self.words.get(self.at) {
            Some(&word) if Word(word) == NODE => {
                self.at += 1;
                self.tile_of_cells()?
            }
            _ => (self.cell(0, None)?, 0),
        };
        let made = Made {
            parts: &[],
            words: &self.made[first..],
            first,
            own: known.word,
            free: known.free,
        };
        let place = arena.take(made.words.len()).ok_or(Misfit::NoRoom)?;
        let [word, free] = made.write(arena, place);
        Ok(Known { word, free })
    }

    /// Reads the cells of a tile that is cut; returns also the first of its words that are used.
    fn tile_of_cells(&mut self) -> Result<(Known, usize), Misfit> {
        self.made.resize(WIDE_WORDS, 0);
        let mut cells = [Known::NOTHING; NODE_CELLS];
        for (number, cell) in cells.iter_mut().enumerate() {
            *cell = self.cell(1, Some(number * NODE_WORDS))?;
        }
        Ok(tile_node(&mut self.made, cells))
    }

    /// Reads a cell of a level: its word, and what it says of free starts. Its node is written where there is room for
    /// it already.
    fn cell(&mut self, level: u32, room: Option<usize>) -> Result<Known, Misfit> {
        let word = Word(self.next()?);
        if word == NODE {
            if level == LEVELS {
                return Err(self.bad("a cell finer than any"));
            }
            let node = room.unwrap_or(self.made.len());
            if room.is_none() {
                self.made.resize(node + NODE_WORDS, 0);
            }
            let mut cells = [Known::NOTHING; NODE_CELLS];
            for cell in &mut cells {
                *cell = self.cell(level + 1, None)?;
            }
            write_node(&mut self.made, node, &cells);
            Ok(Known::alike(Word::node(node)))
        } else if word.is_list() {
            Ok(Known::alike(self.list(word)?))
        } else if word == SLANT {
            let words = self.take(SLANT_WORDS)?;
            let place = self.made.len().next_multiple_of(ALIGNED);
            self.made.resize(place, 0);
            self.made.extend(words);
            let word = Word::slant(place);
            Ok(Known {
                word,
                free: self.free()?,
            })
        } else if word.is_threshold() {
            Ok(Known {
                word,
                free: self.free()?,
            })
        } else if word == Word::UNASKED || word == Word::HOPELESS {
            self.is_open |= word == Word::UNASKED;
            Ok(Known {
                word,
                free: Word::LIT,
            })
        } else {
            Err(self.bad("a cell of no kind"))
        }
    }

    fn free(&mut self) -> Result<Word, Misfit> {
        let word = Word(self.next()?);
        if word.is_list() {
            self.list(word)
        } else if word.is_threshold() {
            Ok(word)
        } else {
            Err(self.bad("free starts of no kind"))
        }
    }

    /// Reads what a list's number stands for.
    fn list(&mut self, word: Word) -> Result<Word, Misfit> {
        let number = word.place();
        if let Some(&list) = self.lists.get(number) {
            return Ok(list);
        }
        if number > self.lists.len() {
            return Err(self.bad("a list that is not there"));
        }
        let place = self.made.len();
        let head = self.take(HEAD)?;
        let [asked, count] = entry_counts(head[COUNTS]);
        if asked > count || count > LONGEST {
            return Err(self.bad("a list of another length"));
        }
        self.is_open |= head[COUNTS] >> 16 != NOT_CUT;
        let entries = self.take(count)?;
        let surface_count = self.surface_count;
        if entries.iter().any(|entry| entry & 0xffff >= surface_count) {
            return Err(self.bad("a list of a surface that is not there"));
        }
        self.made.extend(head);
        self.made.extend(entries);
        self.lists.push(Word::list(place));
        Ok(Word::list(place))
    }
}
