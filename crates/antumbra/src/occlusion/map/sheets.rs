//! Finds sheets of a cell: triangles that cover it once, planes that part others from them, and triangles that lie apart.
//!
//! In: the facets of a cell. Out: the nearest sheet, and what lies behind it. The proofs are in the note beside this file.

use antumbra_geometry::{DVec3, SurfaceId};
use fearless_simd::Simd;

use super::super::forms::BOUND;
use super::super::tables::NONE;
use super::build::{Builder, Cell, Entry};
use super::sheet::{MOST_APART, MOST_IN_SHEET, Sheet, Slant};
use super::words::{ALIGNED, Word};

/// Slanted thresholds are made for nothing that is so near a light: a depth changes so little with its key.
const LEAST_SLANTED: f64 = 1.0 / (1u64 << 20) as f64;
/// Rounding of a key less a linear function in `f32`, as a share of the size of both.
const KEY_ROUNDING: f32 = 1.0 / (1u32 << 20) as f32;

impl<S: Simd> Builder<'_, S> {
    /// Returns the nearest sheet of a list: triangles that cover each place of the inflated cell exactly once.
    /// `over` are those over one place of it.
    pub(super) fn sheet(&mut self, list: &[Entry], cell: &Cell, full: f32, over: u64) -> Sheet {
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
    pub(super) fn slant(
        &self,
        list: &[Entry],
        cell: &Cell,
        sheet: &Sheet,
        nearest: f32,
    ) -> Option<Slant> {
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
        let is_known = steepness > LEAST_SLANTED && self.depths.weight(least) > 0.0;
        if !is_known {
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

    pub(super) fn write_slant(&mut self, slant: &Slant, full: f32) -> Word {
        let place = self.words.len().next_multiple_of(ALIGNED);
        self.words.resize(place, 0);
        let [x, y] = slant.slope;
        self.words.extend([x, y, slant.key, full].map(f32::to_bits));
        Word::slant(place)
    }

    /// Returns those of a list that hold a place of a cell to which no side comes near, a bit each, if there is one.
    pub(super) fn over_a_place(&self, list: &[Entry], cell: &Cell) -> Option<u64> {
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
    pub(super) fn are_apart(&self, list: &[Entry]) -> bool {
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
