//! What columns know of starts.
//!
//! In: starts. Out: a [`Found`] each, as from a list. Invariant: an answer that is found is the reference's.

use antumbra_geometry::{DVec3, Occluders, Start, SurfaceId};
use fearless_simd::{Simd, dispatch};

use super::adaptive::AdaptiveValues;
use super::bricks::Store;
use super::columns::{Columns, Entry, Told};
use super::forms::Verdict;
use super::lookup::{Asks, BLOCK, Found, Lookup, Moved, Source};
use super::views::NO_COLUMN;

impl AdaptiveValues {
    /// Finds what columns tell of those of at most [`BLOCK`] starts that nothing was found of.
    #[inline]
    pub(crate) fn find_in_columns(
        &self,
        columns: &Columns,
        store: &Store,
        occluders: &Occluders,
        starts: &[Start],
        light: usize,
        found: &mut [Found; BLOCK],
    ) {
        let Some(tables) = self.tables(occluders, light) else {
            return;
        };
        dispatch!(self.level, simd => {
            Lookup { simd, values: self, number: light, tables, source: Source::Growing(store), occluders }
                .fill(columns, starts, found);
        });
    }
}

impl<S: Simd> Lookup<'_, S> {
    #[inline(always)]
    fn fill(&self, columns: &Columns, starts: &[Start], found: &mut [Found; BLOCK]) {
        let places = self.values.places(starts);
        let located = columns.views.locate(self.simd, &places);
        for (number, start) in starts.iter().enumerate() {
            if !found[number].is_nothing() {
                continue;
            }
            let x = [0, 1, 2].map(|axis: usize| places[axis][number]);
            found[number] = match self.audience(start, x) {
                Asks::In(_) if self.is_in_scene(x) => {
                    let at = (located.columns[number], located.depths[number]);
                    self.find_in_column(columns, at, start, start.point, x)
                }
                Asks::In(_) => Found::NOTHING,
                Asks::OwnShadow => Found::by_value(true),
                Asks::Doubt => self.find_off_surface_in_columns(columns, start),
            };
        }
    }

    /// Returns whether a point is so near the scene that forms are known well there.
    #[inline(always)]
    fn is_in_scene(&self, x: [f32; 3]) -> bool {
        x.iter().all(|x| x.abs() < 1.25)
    }

    #[cold]
    #[inline(never)]
    fn find_off_surface_in_columns(&self, columns: &Columns, start: &Start) -> Found {
        match self.move_onto_surface(start) {
            Moved::OwnShadow => Found::by_value(true),
            Moved::Unknown => Found::NOTHING,
            Moved::To(point, _) => {
                let x = self.values.narrow(point);
                if !self.is_in_scene(x) {
                    return Found::NOTHING;
                }
                let located = columns.views.locate(self.simd, &x.map(|x| [x; 8]));
                let at = (located.columns[0], located.depths[0]);
                self.find_in_column(columns, at, start, point, x)
            }
        }
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
        let entries = match columns.told(column, depth) {
            Told::Shadowed => return Found::by_list(true),
            Told::List(entries) => entries,
        };
        let mut is_in_doubt = false;
        for &Entry { nearest, surface } in entries {
            if nearest > depth {
                break;
            }
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
        Found::by_list(is_in_doubt && self.is_blocked_in_column(entries, depth, start, point, x))
    }

    /// Asks the exact rule about what is in doubt.
    #[cold]
    #[inline(never)]
    fn is_blocked_in_column(
        &self,
        entries: &[Entry],
        depth: f32,
        start: &Start,
        point: DVec3,
        x: [f32; 3],
    ) -> bool {
        let segment = self.occluders.segment(start, self.light());
        let near = entries.iter().take_while(|entry| entry.nearest <= depth);
        near.map(|entry| SurfaceId(entry.surface)).any(|surface| {
            let verdict = match self.tables.umbra_forms(surface.0 as usize) {
                Some(forms) => forms.wide_verdict(self.simd, x),
                None => self.curved_verdict(surface, start, point),
            };
            verdict != Verdict::Outside && self.occluders.blocks(surface, &segment)
        })
    }
}
