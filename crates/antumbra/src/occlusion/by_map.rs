//! Lookups of starts in a map.
//!
//! In: starts. Out: a [`Found`] each, as from a list. Invariant: an answer that is found is the reference's.

use std::hint::black_box;

use antumbra_geometry::{DVec3, Occluders, ReceiverPoint, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8, u32x8};

use super::adaptive::{AdaptiveValues, Lists};
use super::forms::Verdict;
use super::lookup::{BLOCK, Found, Lookup, Source};
use super::many::{FEW, MANY, Numbers, Places, Told, first_bits};
use super::map::{BIAS, FREE, Located, Map, NOWHERE, Told as ToldOfCell, Word, rough_depth};
use super::pairs::{Pairs, widened};
use super::planes::ReceiverPlane;
use super::receivers::{Asks, Entry, Moved};
use super::tables::{NONE, Tables};
use crate::draw::draw;

/// Points whose coordinates are smaller are so near the scene that forms are known well there.
const NEAR: f32 = 1.25;

impl AdaptiveValues {
    /// Finds what a map tells of those of at most [`MANY`] starts a bit each.
    #[inline]
    pub(crate) fn find_many_in_map(
        &self,
        (lists, map): (&Lists, &Map),
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: usize,
    ) -> Told {
        let asked = first_bits(starts.len());
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Told {
                unknown: asked,
                ..Told::default()
            };
        };
        dispatch!(self.level, simd => {
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find_many_in_map(map, starts, asked)
        })
    }

    /// Finds what a map tells of a start.
    #[inline]
    pub(crate) fn find_one_in_map(
        &self,
        (lists, map): (&Lists, &Map),
        occluders: &Occluders,
        start: &ReceiverPoint,
        light: usize,
    ) -> Found {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Found::NOTHING;
        };
        dispatch!(self.level, simd => {
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find_one_in_map(map, start)
        })
    }
}

impl AdaptiveValues {
    /// Returns the tiles of starts, as far as they have any, and where in them they are; with [`FREE`].
    pub(super) fn places_in_map(
        &self,
        map: &Map,
        tables: &Tables<'_>,
        starts: &[ReceiverPoint],
    ) -> Vec<(u32, u32)> {
        let mut all = Vec::with_capacity(starts.len());
        dispatch!(self.level, simd => {
            for starts in starts.chunks(BLOCK) {
                let located = map.locate(simd, &self.places(starts));
                let places = located.tiles.iter().zip(&located.codes).zip(starts);
                let places = places.filter(|((tile, _), _)| **tile != NOWHERE);
                all.extend(places.map(|((&tile, &code), start)| {
                    let free = if is_listed(tables, start) { 0 } else { FREE };
                    (tile, code | free)
                }));
            }
        });
        all
    }
}

/// Returns whether a start that is where its point is lies on a triangle that the tiles list.
#[inline(always)]
fn is_listed(tables: &Tables<'_>, start: &ReceiverPoint) -> bool {
    start.surface.is_some_and(|surface| {
        let side = tables.side(surface.0 as usize);
        side.is_some_and(|side| side != 0) && tables.occluders.is_opaque(surface)
    })
}

/// Lists of one block in so many are counted, for all.
const COUNTED: u64 = 8;

/// Kinds of words, a bit each: thresholds, those that their starts are past, lists, slanted thresholds.
struct Kinds {
    thresholds: u64,
    shadowed: u64,
    lists: u64,
    slants: u64,
}

impl<S: Simd> Lookup<'_, S> {
    #[inline(always)]
    fn find_many_in_map(&self, map: &Map, starts: &[ReceiverPoint], asked: u64) -> Told {
        let mut told = Told::default();
        if asked.count_ones() as usize <= FEW {
            self.find_each_in_map(map, starts, asked, &mut told);
            return told;
        }
        match <&[ReceiverPoint; MANY]>::try_from(starts) {
            Ok(starts) => self.find_block_in_map(map, starts, asked, &mut told),
            Err(_) => {
                let mut block = [starts[0]; MANY];
                block[..starts.len()].copy_from_slice(starts);
                self.find_block_in_map(map, &block, asked, &mut told);
            }
        }
        told
    }

    #[inline(never)]
    fn find_each_in_map(&self, map: &Map, starts: &[ReceiverPoint], asked: u64, told: &mut Told) {
        self.simd.vectorize(
            #[inline(always)]
            || {
                for number in Numbers(asked) {
                    told.add(number, self.find_one_in_map(map, &starts[number]));
                }
            },
        );
    }

    #[inline(always)]
    fn find_one_in_map(&self, map: &Map, start: &ReceiverPoint) -> Found {
        let x = self.values.narrow(start.point);
        let surface = start.surface.map(|SurfaceId(surface)| surface as usize);
        let asks = match surface.and_then(|surface| self.tables.start_planes().get(surface)) {
            Some(plane) => match plane.tell_one(self.simd, x) {
                Some(_) => Asks::In(super::value::ReceiverClass::Front),
                None => Asks::Doubt,
            },
            None => self.class(start, x),
        };
        match asks {
            Asks::In(_) => {
                self.find_at_in_map(map, start, start.point, x, is_listed(&self.tables, start))
            }
            Asks::OwnShadow => Found::by_value(true),
            Asks::Doubt => self.find_off_surface_in_map(map, start),
        }
    }

    /// Answers those starts of a block that are asked. One step for all of them before the next, as in `many`.
    #[inline(always)]
    fn find_block_in_map(
        &self,
        map: &Map,
        starts: &[ReceiverPoint; MANY],
        asked: u64,
        told: &mut Told,
    ) {
        let mut surfaces = [0; MANY];
        let mut on_surface_count = 0;
        for (surface, start) in surfaces.iter_mut().zip(starts) {
            on_surface_count += u32::from(start.surface.is_some());
            *surface = start.surface.map_or(0, |SurfaceId(surface)| surface);
        }
        let is_free = on_surface_count == 0;
        if !is_free && on_surface_count != MANY as u32 {
            return self.find_each_in_map(map, starts, asked, told);
        }
        let mut places = [[0.0; MANY]; 3];
        self.narrow_many(starts, &mut places);
        let mut known = asked & self.are_in_scene(&places);
        let mut listed = 0;
        if is_free {
            for number in Numbers(asked & !known) {
                told.add(number, self.find_outside_in_map(map, &starts[number]));
            }
        } else {
            let there;
            (there, listed) = self.are_on_surfaces(starts, &surfaces, &places, asked, told);
            for number in Numbers(asked & !there) {
                told.add(number, self.find_off_surface_in_map(map, &starts[number]));
            }
            told.unknown |= asked & there & !known & !told.shadowed;
            known &= there & !told.shadowed;
        }
        self.find_known_in_map(map, [starts, starts], &places, known, listed, told);
    }

    /// Answers those starts that are known to be where their points are. They are given as they are asked, and as
    /// they are where they answer the same.
    #[inline(always)]
    pub(super) fn find_known_in_map(
        &self,
        map: &Map,
        starts: [&[ReceiverPoint; MANY]; 2],
        places: &Places,
        known: u64,
        listed: u64,
        told: &mut Told,
    ) {
        let located = map.locate(self.simd, places);
        let (mut words, cells) = map.words(self.simd, &located);
        let Kinds {
            thresholds,
            mut shadowed,
            mut lists,
            slants,
        } = self.kinds(&words, &located.depths);
        lists &= known;
        let slants = slants & known;
        self.fetch(map, &words, slants);
        for number in Numbers(slants) {
            let is_past = map.is_past_slant((&located, number), words[number]);
            shadowed |= u64::from(is_past) << number;
        }
        let thresholds = thresholds & known | slants;
        told.shadowed |= shadowed & known;
        told.unknown |= known & !thresholds & !lists;
        for number in Numbers(thresholds & !shadowed & !listed) {
            let free = map.free(located.tiles[number], cells[number]);
            if free.is_list() {
                words[number] = free.0;
                lists |= 1 << number;
            } else {
                let is_lit = located.depths[number] + BIAS < f32::from_bits(free.0);
                told.unknown |= u64::from(!is_lit) << number;
            }
        }
        self.fetch(map, &words, lists);
        if lists != 0 {
            self.find_in_lists_of_map(
                map,
                starts,
                places,
                (&located, &words),
                [lists, listed],
                told,
            );
        }
    }

    /// Reads together what words lead to: what is done with one waits for the next else.
    #[inline(always)]
    fn fetch(&self, map: &Map, words: &[u32; MANY], which: u64) {
        black_box(Numbers(which).fold(0, |read, number| read | map.any_word(words[number])));
    }

    /// Sorts words of starts of some depths, as `Map::told` does.
    #[inline(always)]
    fn kinds(&self, words: &[u32; MANY], depths: &[f32; MANY]) -> Kinds {
        let mut kinds = Kinds {
            thresholds: 0,
            shadowed: 0,
            lists: 0,
            slants: 0,
        };
        for first in (0..MANY).step_by(8) {
            let word = u32x8::from_slice(self.simd, &words[first..first + 8]);
            let depth = f32x8::from_slice(self.simd, &depths[first..first + 8]) + BIAS;
            let is_threshold = word.simd_lt(1 << 31);
            let is_past = depth.simd_gt(f32x8::from_bits(word)) & is_threshold;
            let is_list = word.simd_ge(Word::LIST) & word.simd_lt(Word::SLANT);
            let is_slant = word.simd_ge(Word::SLANT) & word.simd_lt(Word::HOPELESS.0);
            kinds.thresholds |= is_threshold.to_bitmask() << first;
            kinds.shadowed |= is_past.to_bitmask() << first;
            kinds.lists |= is_list.to_bitmask() << first;
            kinds.slants |= is_slant.to_bitmask() << first;
        }
        kinds
    }

    #[inline(always)]
    fn find_in_lists_of_map(
        &self,
        map: &Map,
        starts: [&[ReceiverPoint; MANY]; 2],
        places: &Places,
        (located, words): (&Located<MANY>, &[u32; MANY]),
        [lists, listed]: [u64; 2],
        told: &mut Told,
    ) {
        let is_sampled = self.values.is_refining() && draw().is_multiple_of(COUNTED);
        told.listed |= lists;
        let mut pairs = Pairs::none();
        let mut wide = [[0.0; 16]; MANY];
        for number in Numbers(lists) {
            let list = map.list(located.tiles[number], words[number]);
            let depth = located.depths[number];
            if depth > list.full {
                told.shadowed |= 1 << number;
                continue;
            }
            let count = list.counts[usize::from(listed >> number & 1 == 0)];
            if is_sampled && !map.test(words[number], COUNTED as u32 * count as u32) {
                // It pays to cut the cell.
                told.unknown |= 1 << number;
                told.listed &= !(1 << number);
                continue;
            }
            wide[number] = widened([places[0][number], places[1][number], places[2][number]]);
            let own = starts[0][number].surface.map_or(NONE, |SurfaceId(own)| own);
            let depth = rough_depth(depth);
            for place in 0..count {
                let (SurfaceId(surface), may_block) = list.entry(place, depth);
                pairs.push_if(surface, number, may_block & (surface != own));
            }
            if pairs.is_full() {
                self.tell_pairs(&pairs, starts, &wide, told);
                pairs.clear();
            }
        }
        self.tell_pairs(&pairs, starts, &wide, told);
    }

    /// Returns which starts are where their points are; or are in their own shadow, which is told.
    #[inline(always)]
    fn are_on_surfaces(
        &self,
        starts: &[ReceiverPoint; MANY],
        surfaces: &[u32; MANY],
        places: &Places,
        asked: u64,
        told: &mut Told,
    ) -> (u64, u64) {
        let others = self.not_on_triangles(surfaces);
        let (mut there, _) = self.tell_on_triangles(surfaces, places, others);
        let mut listed = there;
        if !self.tables.are_all_opaque() {
            let planes = self.tables.start_planes();
            for (number, &surface) in surfaces.iter().enumerate() {
                let clear = planes
                    .get(surface as usize)
                    .map_or(0, ReceiverPlane::clear_bit);
                listed &= !(u64::from(clear) << number);
            }
        }
        let on_balls = self.tell_on_balls(starts, surfaces, others);
        told.shadowed |= on_balls.own_shadow & asked;
        there |= (on_balls.front | on_balls.own_shadow) & asked;
        (there, listed)
    }

    /// Returns which points are so near the scene that forms are known well there.
    #[inline(always)]
    fn are_in_scene(&self, places: &Places) -> u64 {
        let mut near = 0;
        for first in (0..MANY).step_by(8) {
            let x = f32x8::from_slice(self.simd, &places[0][first..first + 8]);
            let y = f32x8::from_slice(self.simd, &places[1][first..first + 8]);
            let z = f32x8::from_slice(self.simd, &places[2][first..first + 8]);
            let is_near = x.abs().simd_lt(NEAR) & y.abs().simd_lt(NEAR) & z.abs().simd_lt(NEAR);
            near |= is_near.to_bitmask() << first;
        }
        near
    }

    #[cold]
    #[inline(never)]
    fn find_outside_in_map(&self, map: &Map, start: &ReceiverPoint) -> Found {
        match self.entry(start.point) {
            Entry::Never => Found::by_value(false),
            Entry::Unknown => Found::NOTHING,
            Entry::At(point) => {
                self.find_at_in_map(map, start, point, self.values.narrow(point), false)
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn find_off_surface_in_map(&self, map: &Map, start: &ReceiverPoint) -> Found {
        match self.move_onto_surface(start) {
            Moved::OwnShadow => Found::by_value(true),
            Moved::Unknown => Found::NOTHING,
            Moved::To(point, _) => self.find_at_in_map(
                map,
                start,
                point,
                self.values.narrow(point),
                is_listed(&self.tables, start),
            ),
        }
    }

    /// Asks about a start near `point`, which is `x` in the frame.
    #[inline(never)]
    pub(super) fn find_at_in_map(
        &self,
        map: &Map,
        start: &ReceiverPoint,
        point: DVec3,
        x: [f32; 3],
        is_listed: bool,
    ) -> Found {
        // What is not inlined has no wide registers of its own.
        self.simd.vectorize(
            #[inline(always)]
            || {
                if !x.iter().all(|x| x.abs() < NEAR) {
                    return Found::NOTHING;
                }
                let located = map.locate(self.simd, &x.map(|x| [x; 8]));
                if located.tiles[0] == NOWHERE {
                    return Found::NOTHING;
                }
                let (words, cells) = map.words(self.simd, &located);
                let depth = located.depths[0];
                let word = match map.told((&located, 0), (words[0], cells[0]), is_listed) {
                    ToldOfCell::Is(is_shadowed) => return Found::by_value(is_shadowed),
                    ToldOfCell::Unknown => return Found::NOTHING,
                    ToldOfCell::List(word) => word,
                };
                let list = map.list(located.tiles[0], word);
                if depth > list.full {
                    return Found::by_list(true);
                }
                let depth = rough_depth(depth);
                let mut in_doubt = Vec::new();
                for place in 0..list.counts[usize::from(!is_listed)] {
                    let (surface, may_block) = list.entry(place, depth);
                    if !may_block {
                        continue;
                    }
                    let verdict = match self.tables.umbra_forms(surface.0 as usize) {
                        Some(_) if start.surface == Some(surface) => continue,
                        Some(forms) => forms.wide_verdict(self.simd, x),
                        None => self.curved_verdict(surface, start, point),
                    };
                    if verdict == Verdict::Outside {
                        continue;
                    }
                    let is_triangle = (surface.0 as usize) < self.tables.triangle_count();
                    let is_own_plane = |own| self.tables.are_in_one_plane(own, surface);
                    if is_triangle && start.surface.is_some_and(is_own_plane) {
                        continue;
                    }
                    if verdict == Verdict::Inside && self.occluders.is_opaque_everywhere(surface) {
                        return Found::by_list(true);
                    }
                    in_doubt.push(surface.0);
                }
                let is_blocked =
                    !in_doubt.is_empty() && self.is_blocked_exactly(&in_doubt, start, point, x);
                Found::by_list(is_blocked)
            },
        )
    }
}
