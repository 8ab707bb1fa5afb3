//! Many starts looked up together in values that are packed.
//!
//! In: starts. Out: their answers, a bit each. One step for all starts before the next, and no step branches
//! on what it reads: which starts go on is a word of bits. So the memory that they need is fetched together.
//! Invariant: an answer is the reference's; see `lookup`, which answers single starts, and those that are not
//! where their points are.

use std::hint::black_box;

use antumbra_geometry::{ReceiverPoint, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, u32x8};

use super::balls::{self, Ball, EIGHT, OnBalls};
use super::lattice::Codes;
use super::lookup::{Found, Lookup};
use super::packed::{Leaf, Packed};
use super::pairs::{Pairs, widened};
use super::planes::{ReceiverPlane, tell};
use super::receivers::Entry;
pub(super) use super::told::{FEW, Numbers, Places, first_bits};
pub(crate) use super::told::{MANY, Told};
use super::value::ReceiverClass;
use super::vectors::four_points;

/// So many planes are not in the near caches: all that a block needs are fetched at once.
pub(super) const FAR_PLANES: usize = 1 << 13;

/// Where in the root tables starts are looked up.
type Roots = [u32; MANY];

/// Free starts, those outside all cells where their segments come in.
struct Entered {
    starts: [ReceiverPoint; MANY],
    /// Those whose segments never come in, a bit each.
    lit: u64,
    /// Those too far away to tell well.
    unknown: u64,
}

impl<S: Simd> Lookup<'_, S> {
    /// Answers at most [`MANY`] starts.
    #[inline(always)]
    pub(super) fn find_many(
        &self,
        packed: &Packed,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
    ) -> Told {
        let mut told = Told::default();
        match <&[ReceiverPoint; MANY]>::try_from(starts) {
            Ok(starts) => self.find_block(packed, starts, u64::MAX, &mut told),
            Err(_) => self.find_fewer(packed, starts, &mut told),
        }
        for (number, is_shadowed) in is_shadowed.iter_mut().take(MANY).enumerate() {
            *is_shadowed = told.shadowed >> number & 1 != 0;
        }
        told
    }

    #[inline(never)]
    fn find_fewer(&self, packed: &Packed, starts: &[ReceiverPoint], told: &mut Told) {
        let count = starts.len().min(MANY);
        if count <= FEW {
            return self.find_each(packed, &starts[..count], told);
        }
        let mut block = [starts[0]; MANY];
        block[..count].copy_from_slice(&starts[..count]);
        // What is not inlined has no wide registers of its own.
        self.simd.vectorize(
            #[inline(always)]
            || self.find_block(packed, &block, first_bits(count), told),
        );
    }

    /// Answers starts one after the other.
    #[inline(never)]
    fn find_each(&self, packed: &Packed, starts: &[ReceiverPoint], told: &mut Told) {
        self.simd.vectorize(
            #[inline(always)]
            || {
                for (number, start) in starts.iter().enumerate() {
                    told.add(number, self.find_packed(packed, start));
                }
            },
        );
    }

    /// Answers those starts of a block that are asked.
    #[inline(always)]
    fn find_block(
        &self,
        packed: &Packed,
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
        if on_surface_count != 0 && on_surface_count != MANY as u32 {
            let count = asked.count_ones() as usize;
            return self.find_each(packed, &starts[..count], told);
        }
        let is_free = on_surface_count == 0;
        let class = if is_free {
            ReceiverClass::Free
        } else {
            ReceiverClass::Front
        };
        let area = packed.area(class);
        let lattice = &self.values.lattices[class as usize];
        let mut places = [[0.0; MANY]; 3];
        self.narrow_many(starts, &mut places);
        let mut codes = lattice.codes(self.simd, &places);
        let mut roots = [0; MANY];
        let entered;
        let mut near = starts;
        if !is_free {
            self.roots_on_surfaces(packed, starts, &surfaces, &places, &codes, &mut roots);
        } else if codes.high().contains(&u32::MAX) {
            entered = self.enter_many(starts, &mut places, &codes);
            near = &entered.starts;
            codes = lattice.codes(self.simd, &places);
            self.roots_of_space(packed, &codes, &mut roots);
            for number in Numbers(entered.lit) {
                roots[number] = packed.beyond() + Packed::LIT;
            }
            for number in Numbers(entered.unknown) {
                roots[number] = packed.beyond() + Packed::UNKNOWN;
            }
        } else {
            self.roots_of_space(packed, &codes, &mut roots);
        }

        // The coarsest bricks, whose cells the upper halves of the codes tell.
        let reader = packed.reader();
        let mut shift = area.brick_shift;
        let mut next = [0; MANY];
        for (next, root) in next.iter_mut().zip(roots) {
            *next = reader.root(root);
        }
        let (mut undecided, mut low) = (0, 0);
        for number in 0..MANY {
            let cell = reader.cell(next[number], codes.high()[number] >> (shift - 24));
            low |= cell.low << number;
            undecided |= cell.high << number;
        }
        undecided &= asked;
        told.shadowed = low & !undecided & asked;
        told.listed = low & undecided;
        for number in Numbers(undecided) {
            next[number] = reader.next(next[number], codes.high()[number] >> (shift - 24));
        }
        let mut deeper = undecided & !low;
        while deeper != 0 {
            shift = shift.wrapping_sub(6);
            (undecided, low) = (0, 0);
            for number in Numbers(deeper) {
                let (brick, in_brick) = (next[number], codes.get(number).place_in_brick(shift));
                let cell = reader.cell(brick, in_brick);
                low |= cell.low << number;
                undecided |= cell.high << number;
                next[number] = reader.next(brick, in_brick);
            }
            told.shadowed |= low & !undecided;
            told.listed |= low & undecided;
            deeper = undecided & !low;
        }
        if told.listed != 0 {
            let starts = [starts, near];
            self.find_in_lists(packed, starts, &places, &next, told);
        }
    }

    /// Brings points into the frame.
    #[inline(always)]
    pub(super) fn narrow_many(&self, starts: &[ReceiverPoint; MANY], places: &mut Places) {
        let frame = &self.values.frame;
        for (group, starts) in starts.as_chunks::<8>().0.iter().enumerate() {
            let [a, b, c, d, e, f, g, h] = starts.each_ref();
            let low = four_points(self.simd, [&a.point, &b.point, &c.point, &d.point]);
            let high = four_points(self.simd, [&e.point, &f.point, &g.point, &h.point]);
            for axis in 0..3 {
                let low = (low[axis] - frame.center[axis]) * frame.scale;
                let high = (high[axis] - frame.center[axis]) * frame.scale;
                let narrow: f32x8<S> = low.narrow(high);
                places[axis][8 * group..8 * group + 8].copy_from_slice(narrow.as_slice());
            }
        }
    }

    #[inline(always)]
    fn roots_of_space(&self, packed: &Packed, codes: &Codes<MANY>, roots: &mut Roots) {
        let area = packed.area(ReceiverClass::Free);
        for first in (0..MANY).step_by(8) {
            let high = u32x8::from_slice(self.simd, &codes.high()[first..first + 8]);
            let place = (high >> (area.root_shift - 24)).min(area.place_count);
            roots[first..first + 8].copy_from_slice((place + area.first).as_slice());
        }
    }

    #[inline(always)]
    fn roots_on_surfaces(
        &self,
        packed: &Packed,
        starts: &[ReceiverPoint; MANY],
        surfaces: &[u32; MANY],
        places: &Places,
        codes: &Codes<MANY>,
        roots: &mut Roots,
    ) {
        let (front, back) = (
            packed.area(ReceiverClass::Front),
            packed.area(ReceiverClass::Back),
        );
        let doubt = packed.beyond() + Packed::DOUBT;
        let front_first = u32x8::splat(self.simd, front.first);
        let back_first = u32x8::splat(self.simd, back.first);
        let doubt_place = u32x8::splat(self.simd, doubt);
        let others = self.not_on_triangles(surfaces);
        let on_balls = self.tell_on_balls(starts, surfaces, others);
        let (on_triangles, behind) = self.tell_on_triangles(surfaces, places, others);
        for first in (0..MANY).step_by(8) {
            let there = (on_triangles | on_balls.front) >> first & 0xff;
            let are_there = mask32x8::from_bitmask(self.simd, there);
            let are_behind = mask32x8::from_bitmask(self.simd, behind >> first & 0xff);
            let high = u32x8::from_slice(self.simd, &codes.high()[first..first + 8]);
            let place = (high >> (front.root_shift - 24)).min(front.place_count);
            let table = are_behind.select(back_first, front_first);
            let place = are_there.select(place + table, doubt_place);
            roots[first..first + 8].copy_from_slice(place.as_slice());
        }
        for number in Numbers(on_balls.own_shadow) {
            roots[number] = packed.beyond() + Packed::OWN_SHADOW;
        }
    }

    /// Tells of those starts that are on triangles which are where their points are, and for which of these the
    /// light is behind.
    #[inline(always)]
    pub(super) fn tell_on_triangles(
        &self,
        surfaces: &[u32; MANY],
        places: &Places,
        others: u64,
    ) -> (u64, u64) {
        let planes = self.tables.start_planes();
        if planes.len() >= FAR_PLANES {
            let mut read = 0;
            for &surface in surfaces {
                read |= planes
                    .get(surface as usize)
                    .map_or(0, ReceiverPlane::any_word);
            }
            black_box(read);
        }
        let (mut there, mut behind) = (0, 0);
        for first in (0..MANY).step_by(8) {
            if others >> first & 0xff == 0xff {
                continue;
            }
            let mut rows = [&ReceiverPlane::NOWHERE; 8];
            for (row, &surface) in rows.iter_mut().zip(&surfaces[first..first + 8]) {
                *row = planes.get(surface as usize).unwrap_or(row);
            }
            let x = [
                f32x8::from_slice(self.simd, &places[0][first..first + 8]),
                f32x8::from_slice(self.simd, &places[1][first..first + 8]),
                f32x8::from_slice(self.simd, &places[2][first..first + 8]),
            ];
            let (are_starts, are_behind) = tell(self.simd, rows, x);
            there |= are_starts.to_bitmask() << first;
            behind |= are_behind.to_bitmask() << first;
        }
        (there, behind)
    }

    /// Returns which of some surfaces are no triangles.
    #[inline(always)]
    pub(super) fn not_on_triangles(&self, surfaces: &[u32; MANY]) -> u64 {
        let count = self.tables.start_planes().len() as u32;
        let mut others = 0;
        for first in (0..MANY).step_by(8) {
            let surface = u32x8::from_slice(self.simd, &surfaces[first..first + 8]);
            others |= surface.simd_ge(count).to_bitmask() << first;
        }
        others
    }

    /// Tells of those starts that are on no triangles.
    #[inline(always)]
    pub(super) fn tell_on_balls(
        &self,
        starts: &[ReceiverPoint; MANY],
        surfaces: &[u32; MANY],
        others: u64,
    ) -> OnBalls {
        let balls = &self.tables.scene.ball_starts;
        let mut all = OnBalls {
            front: 0,
            own_shadow: 0,
        };
        for first in (0..MANY).step_by(EIGHT) {
            if others >> first & 0xff == 0 {
                continue;
            }
            let mut rows = [&Ball::NONE; EIGHT];
            let mut points = [&starts[first].point; EIGHT];
            for (lane, (row, point)) in rows.iter_mut().zip(&mut points).enumerate() {
                let number = surfaces[first + lane] as usize;
                let number = number.wrapping_sub(self.tables.triangle_count());
                *row = balls.get(number).unwrap_or(row);
                *point = &starts[first + lane].point;
            }
            let told = balls::tell(self.simd, rows, points, self.light(), self.room());
            all.front |= told.front << first;
            all.own_shadow |= told.own_shadow << first;
        }
        all
    }

    /// Takes free starts outside all cells to where their segments come in.
    #[inline(never)]
    fn enter_many(
        &self,
        starts: &[ReceiverPoint; MANY],
        places: &mut Places,
        codes: &Codes<MANY>,
    ) -> Entered {
        let mut entered = Entered {
            starts: *starts,
            lit: 0,
            unknown: 0,
        };
        for (number, start) in entered.starts.iter_mut().enumerate() {
            if codes.high()[number] != u32::MAX {
                continue;
            }
            match self.entry(start.point) {
                Entry::Never => entered.lit |= 1 << number,
                Entry::Unknown => entered.unknown |= 1 << number,
                Entry::At(point) => {
                    start.point = point;
                    let [x, y, z] = self.values.narrow(point);
                    places[0][number] = x;
                    places[1][number] = y;
                    places[2][number] = z;
                }
            }
        }
        entered
    }

    /// Asks the blockers of lists, or says why there are none. Starts are given as they are asked, and as they
    /// are where they answer the same.
    #[inline(always)]
    fn find_in_lists(
        &self,
        packed: &Packed,
        starts: [&[ReceiverPoint; MANY]; 2],
        places: &Places,
        leaves: &[u32; MANY],
        told: &mut Told,
    ) {
        let mut pairs = Pairs::none();
        let mut wide = [[0.0; 16]; MANY];
        for number in Numbers(told.listed) {
            let leaf = packed.leaf(leaves[number]);
            let count = leaf.count();
            if count == 0 {
                told.listed &= !(1 << number);
                self.find_elsewhere(leaf, number, &starts[0][number], told);
                continue;
            }
            wide[number] = widened([places[0][number], places[1][number], places[2][number]]);
            pairs.add_list(packed.entries_from(leaf), number, count);
            if pairs.is_full() {
                self.tell_pairs(&pairs, starts, &wide, told);
                pairs.clear();
            }
        }
        self.tell_pairs(&pairs, starts, &wide, told);
    }

    /// Answers a start whose cell has no list, or that has no cell.
    #[cold]
    #[inline(never)]
    fn find_elsewhere(&self, leaf: Leaf, number: usize, start: &ReceiverPoint, told: &mut Told) {
        let found = match leaf {
            Leaf::DOUBT => self.find_off_surface(start),
            Leaf::OUTSIDE => self.find_from_outside(start),
            _ => Found::NOTHING,
        };
        told.add(number, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_stand_for_starts() {
        assert_eq!(
            [0, 1, 63, 64, 65].map(first_bits),
            [0, 1, u64::MAX >> 1, u64::MAX, u64::MAX]
        );
        for bits in [0, 1, 1 << 63, 0x8000_0000_0001_0010, u64::MAX] {
            let numbers: Vec<usize> = Numbers(bits).collect();
            assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
            let back = numbers.iter().fold(0, |bits, number| bits | 1 << number);
            assert_eq!(back, bits);
        }
    }

    #[test]
    fn what_is_found_is_noted() {
        let mut told = Told::default();
        told.add(3, Found::NOTHING);
        let Told {
            shadowed,
            listed,
            unknown,
        } = told;
        assert_eq!((shadowed, listed, unknown), (0, 0, 8));
    }
}
