//! What columns know of starts.
//!
//! In: starts. Out: a [`Found`] each, as from a list. Invariant: an answer that is found is the reference's.

use antumbra_geometry::{DVec3, Occluders, Start, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8, u32x8};

use super::adaptive::{AdaptiveValues, Lists};
use super::columns::{Columns, Located, NO_COLUMN, Told as ToldOfColumn};
use super::forms::Verdict;
use super::lookup::{Found, Lookup, Source};
use super::many::{FEW, MANY, Numbers, Places, Told, first_bits};
use super::pairs::{Pairs, Wide, widened};
use super::starts::{Asks, Entry, Moved};
use super::tables::NONE;

/// So many possible blockers of each start are told together, before others of those that are not blocked.
const ROUND: usize = Columns::SPARE;

/// Points whose coordinates are smaller are so near the scene that forms are known well there.
const NEAR: f32 = 1.25;

impl AdaptiveValues {
    /// Finds what columns tell of those of at most [`MANY`] starts that are asked, a bit each.
    #[inline]
    pub(crate) fn find_many_in_columns(
        &self,
        (lists, columns): (&Lists, &Columns),
        occluders: &Occluders,
        starts: &[Start],
        light: usize,
        asked: u64,
        way: Way,
    ) -> Told {
        let asked = asked & first_bits(starts.len());
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Told {
                unknown: asked,
                ..Told::default()
            };
        };
        dispatch!(self.level, simd => {
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, columns: None, source, occluders };
            lookup.find_many_in_columns(columns, starts, asked, way)
        })
    }

    /// Finds what columns tell of a start.
    #[inline]
    pub(crate) fn find_one_in_columns(
        &self,
        (lists, columns): (&Lists, &Columns),
        occluders: &Occluders,
        start: &Start,
        light: usize,
    ) -> Found {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Found::NOTHING;
        };
        dispatch!(self.level, simd => {
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, columns: None, source, occluders };
            lookup.find_one_in_columns(columns, start)
        })
    }
}

/// How the lists of many starts are asked. Answers are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Way {
    /// Some entries of all lists before the next: what they need is fetched together.
    #[default]
    Together,
    /// List after list: neighbours take the same path through them, and lists end early.
    Each,
}

impl Way {
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Together => Self::Each,
            Self::Each => Self::Together,
        }
    }
}

/// Those of some starts of which columns tell something.
struct Listed {
    /// The next entries to look at, and where the lists end.
    next: [u32; MANY],
    ends: [u32; MANY],
    /// Starts whose lists have more to tell, a bit each.
    active: u64,
}

impl<S: Simd> Lookup<'_, S> {
    #[inline(always)]
    fn find_many_in_columns(
        &self,
        columns: &Columns,
        starts: &[Start],
        asked: u64,
        way: Way,
    ) -> Told {
        let mut told = Told::default();
        if asked.count_ones() as usize <= FEW {
            self.find_each_in_columns(columns, starts, asked, &mut told);
            return told;
        }
        match <&[Start; MANY]>::try_from(starts) {
            Ok(starts) => self.find_block_in_columns(columns, starts, asked, way, &mut told),
            Err(_) => {
                let mut block = [starts[0]; MANY];
                block[..starts.len()].copy_from_slice(starts);
                self.find_block_in_columns(columns, &block, asked, way, &mut told);
            }
        }
        told
    }

    #[inline(never)]
    fn find_each_in_columns(
        &self,
        columns: &Columns,
        starts: &[Start],
        asked: u64,
        told: &mut Told,
    ) {
        for number in Numbers(asked) {
            told.add(number, self.find_one_in_columns(columns, &starts[number]));
        }
    }

    #[inline(always)]
    fn find_one_in_columns(&self, columns: &Columns, start: &Start) -> Found {
        let x = self.values.narrow(start.point);
        let surface = start.surface.map(|SurfaceId(surface)| surface as usize);
        let asks = match surface.and_then(|surface| self.tables.start_planes().get(surface)) {
            Some(plane) => match plane.tell_one(self.simd, x) {
                Some(_) => Asks::In(super::value::Audience::Front),
                None => Asks::Doubt,
            },
            None => self.audience(start, x),
        };
        match asks {
            Asks::In(_) => self.find_at_in_columns(columns, start, start.point, x),
            Asks::OwnShadow => Found::by_value(true),
            Asks::Doubt => self.find_off_surface_in_columns(columns, start),
        }
    }

    /// Answers those starts of a block that are asked. One step for all of them before the next, as in `many`.
    #[inline(always)]
    fn find_block_in_columns(
        &self,
        columns: &Columns,
        starts: &[Start; MANY],
        asked: u64,
        way: Way,
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
            return self.find_each_in_columns(columns, starts, asked, told);
        }
        let mut places = [[0.0; MANY]; 3];
        self.narrow_many(starts, &mut places);
        let mut known = asked & self.are_in_scene(&places);
        if is_free {
            for number in Numbers(asked & !known) {
                told.add(
                    number,
                    self.find_outside_in_columns(columns, &starts[number]),
                );
            }
        } else {
            let there = self.are_on_surfaces(starts, &surfaces, &places, asked, told);
            for number in Numbers(asked & !there) {
                told.add(
                    number,
                    self.find_off_surface_in_columns(columns, &starts[number]),
                );
            }
            told.unknown |= asked & there & !known & !told.shadowed;
            known &= there & !told.shadowed;
        }
        self.find_known_in_columns(columns, [starts, starts], &places, known, way, told);
    }

    /// Answers those starts that are known to be where their points are. They are given as they are asked, and as
    /// they are where they answer the same.
    #[inline(always)]
    pub(super) fn find_known_in_columns(
        &self,
        columns: &Columns,
        starts: [&[Start; MANY]; 2],
        places: &Places,
        mut known: u64,
        way: Way,
        told: &mut Told,
    ) {
        let located = columns.locate(self.simd, places);
        for (number, &column) in located.columns.iter().enumerate() {
            let is_nowhere = u64::from(column == NO_COLUMN) << number & known;
            told.unknown |= is_nowhere;
            known &= !is_nowhere;
        }
        told.listed |= known;
        match way {
            Way::Together => {
                self.find_together_in_columns(columns, starts, places, &located, known, told);
            }
            Way::Each => {
                for number in Numbers(known) {
                    let at = (located.columns[number], located.depths[number]);
                    let x = [places[0][number], places[1][number], places[2][number]];
                    let (start, point) = (&starts[0][number], starts[1][number].point);
                    let found = self.find_in_column(columns, at, start, point, x);
                    told.shadowed |= u64::from(found.is_shadowed()) << number;
                }
            }
        }
    }

    #[inline(always)]
    fn find_together_in_columns(
        &self,
        columns: &Columns,
        starts: [&[Start; MANY]; 2],
        places: &Places,
        located: &Located<MANY>,
        known: u64,
        told: &mut Told,
    ) {
        let mut listed = Listed {
            next: [0; MANY],
            ends: [0; MANY],
            active: known,
        };
        let mut wide = [[0.0; 16]; MANY];
        for number in Numbers(known) {
            let (full_from, first, end) = columns.list_of(located.columns[number]);
            let is_full = located.depths[number] > full_from;
            (listed.next[number], listed.ends[number]) = (first, end);
            told.shadowed |= u64::from(is_full) << number;
            listed.active &= !(u64::from(is_full || first == end) << number);
            let x = [places[0][number], places[1][number], places[2][number]];
            wide[number] = widened(x);
        }
        while listed.active != 0 {
            self.tell_round(columns, starts, &located.depths, &wide, &mut listed, told);
        }
    }

    /// Asks the next entries of all lists that are not at their ends.
    #[inline(always)]
    fn tell_round(
        &self,
        columns: &Columns,
        starts: [&[Start; MANY]; 2],
        depths: &[f32; MANY],
        wide: &Wide,
        listed: &mut Listed,
        told: &mut Told,
    ) {
        let mut pairs = Pairs::none();
        for number in Numbers(listed.active) {
            let (first, end) = (listed.next[number], listed.ends[number]);
            let own = starts[0][number].surface.map_or(NONE, |SurfaceId(own)| own);
            let left = (end - first).min(ROUND as u32);
            let (nearest, surfaces) = columns.entries_from(first);
            let is_near = f32x8::from_slice(self.simd, nearest).simd_le(depths[number]);
            let is_own = u32x8::from_slice(self.simd, surfaces).simd_eq(own);
            // A list is in order.
            let near = is_near.to_bitmask() as u32 & ((1 << left) - 1);
            pairs.add(
                surfaces,
                number,
                near.count_ones(),
                is_own.to_bitmask() as u32 & near,
            );
            listed.next[number] = first + ROUND as u32;
            let has_more = near.count_ones() as usize == ROUND && first + left < end;
            listed.active &= !(u64::from(!has_more) << number);
            if pairs.is_full() {
                self.tell_pairs(&pairs, starts, wide, told);
                pairs = Pairs::none();
            }
        }
        self.tell_pairs(&pairs, starts, wide, told);
        listed.active &= !told.shadowed;
    }

    /// Returns which starts are where their points are; or are in their own shadow, which is told.
    #[inline(always)]
    fn are_on_surfaces(
        &self,
        starts: &[Start; MANY],
        surfaces: &[u32; MANY],
        places: &Places,
        asked: u64,
        told: &mut Told,
    ) -> u64 {
        let others = self.not_on_triangles(surfaces);
        let (mut there, _) = self.tell_on_triangles(surfaces, places, others);
        let on_balls = self.tell_on_balls(starts, surfaces, others);
        told.shadowed |= on_balls.own_shadow & asked;
        there |= (on_balls.front | on_balls.own_shadow) & asked;
        there
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
    fn find_outside_in_columns(&self, columns: &Columns, start: &Start) -> Found {
        match self.entry(start.point) {
            Entry::Never => Found::by_value(false),
            Entry::Unknown => Found::NOTHING,
            Entry::At(point) => {
                self.find_at_in_columns(columns, start, point, self.values.narrow(point))
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn find_off_surface_in_columns(&self, columns: &Columns, start: &Start) -> Found {
        match self.move_onto_surface(start) {
            Moved::OwnShadow => Found::by_value(true),
            Moved::Unknown => Found::NOTHING,
            Moved::To(point, _) => {
                self.find_at_in_columns(columns, start, point, self.values.narrow(point))
            }
        }
    }

    /// Asks about a start near `point`, which is `x` in the frame.
    pub(super) fn find_at_in_columns(
        &self,
        columns: &Columns,
        start: &Start,
        point: DVec3,
        x: [f32; 3],
    ) -> Found {
        if !x.iter().all(|x| x.abs() < NEAR) {
            return Found::NOTHING;
        }
        let located = columns.locate(self.simd, &x.map(|x| [x; 8]));
        let at = (located.columns[0], located.depths[0]);
        self.find_in_column(columns, at, start, point, x)
    }

    /// Asks the blockers of a column about a start near `point`, which is `x` in the frame.
    #[inline(always)]
    fn find_in_column(
        &self,
        columns: &Columns,
        (column, depth): (u32, f32),
        start: &Start,
        point: DVec3,
        x: [f32; 3],
    ) -> Found {
        if column == NO_COLUMN {
            return Found::NOTHING;
        }
        let list = match columns.told(column, depth) {
            ToldOfColumn::Shadowed => return Found::by_list(true),
            ToldOfColumn::List(list) => list,
        };
        let mut is_in_doubt = false;
        for surface in list.near(depth) {
            let surface = SurfaceId(surface);
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
            is_in_doubt = true;
        }
        let is_blocked =
            is_in_doubt && self.is_blocked_exactly(list.all_near(depth), start, point, x);
        Found::by_list(is_blocked)
    }
}
