//! Pairs of a start and a possible blocker, told together.
//!
//! In: starts, and surfaces that may block each. Out: which starts are in shadow, a bit each. Filters first, eight
//! or sixteen numbers at a time and without branches on what they tell; the exact rule last, for pairs in doubt.

use antumbra_geometry::{ReceiverPoint, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::balls::{self, Ball, EIGHT, Verdicts};
use super::forms::Verdict;
use super::lookup::Lookup;
use super::many::{MANY, Told};
use super::packed::STRIDE;
/// Pairs of a start and a possible blocker that are told together.
const PAIRS: usize = 192;
/// A list may be so much longer than there is room for.
const SPARE: usize = 64 + STRIDE;

/// Starts and possible blockers.
pub(super) struct Pairs {
    surfaces: [u32; PAIRS + SPARE],
    numbers: [u8; PAIRS + SPARE],
    count: usize,
}

impl Pairs {
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self {
            surfaces: [0; PAIRS + SPARE],
            numbers: [0; PAIRS + SPARE],
            count: 0,
        }
    }

    /// Pairs a start with a surface if that is wanted, without a branch. A list of so many as there is room for may
    /// follow [`Pairs::is_full`].
    #[inline(always)]
    pub(super) fn push_if(&mut self, surface: u32, number: usize, is_wanted: bool) {
        debug_assert!(
            self.count < PAIRS + SPARE,
            "a list is longer than there is room for"
        );
        let at = self.count.min(PAIRS + SPARE - 1);
        self.surfaces[at] = surface;
        self.numbers[at] = number as u8;
        self.count = at + usize::from(is_wanted);
    }

    /// Pairs a start with so many surfaces; behind them there are some more to be read.
    #[inline(always)]
    pub(super) fn add_list(&mut self, entries: &[u32], number: usize, count: usize) {
        for first in (0..count).step_by(STRIDE) {
            // What is beyond the list is written over by the next.
            let at = self.count + first;
            self.surfaces[at..at + STRIDE].copy_from_slice(&entries[first..first + STRIDE]);
            self.numbers[at..at + STRIDE].fill(number as u8);
        }
        self.count += count;
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.count > PAIRS
    }
}

/// The places of starts, each coordinate four times, and four times 1.
pub(super) type Wide = [[f32; 16]; MANY];

#[inline(always)]
pub(super) fn widened([x, y, z]: [f32; 3]) -> [f32; 16] {
    [x, x, x, x, y, y, y, y, z, z, z, z, 1.0, 1.0, 1.0, 1.0]
}

impl<S: Simd> Lookup<'_, S> {
    /// Finds which starts are blocked by the surfaces that they are paired with.
    #[inline(always)]
    pub(super) fn tell_pairs(
        &self,
        pairs: &Pairs,
        [starts, near]: [&[ReceiverPoint; MANY]; 2],
        wide: &Wide,
        told: &mut Told,
    ) {
        let forms = self.tables.all_umbra_forms();
        let mut left = [0_u16; PAIRS + SPARE];
        let mut curved = [0_u16; PAIRS + SPARE];
        let (mut left_count, mut curved_count) = (0, 0);
        let all = pairs.surfaces.iter().zip(&pairs.numbers).take(pairs.count);
        for (pair, (&surface, &number)) in all.enumerate() {
            let number = usize::from(number) % MANY;
            let Some(forms) = forms.get(surface as usize) else {
                curved[curved_count] = pair as u16;
                curved_count += 1;
                continue;
            };
            let may_block =
                !forms.is_outside(self.simd, f32x16::from_slice(self.simd, &wide[number]));
            left[left_count % (PAIRS + SPARE)] = pair as u16;
            left_count += usize::from(may_block);
        }
        let mut doubt_count = 0;
        for place in 0..left_count {
            let pair = usize::from(left[place]);
            let number = usize::from(pairs.numbers[pair]) % MANY;
            let (start, surface) = (&near[number], SurfaceId(pairs.surfaces[pair]));
            if told.shadowed >> number & 1 != 0 {
                continue;
            }
            let Some(forms) = forms.get(surface.0 as usize) else {
                continue;
            };
            let is_flat_with = |own| self.tables.are_in_one_plane(own, surface);
            if start.surface.is_some_and(is_flat_with) {
                continue;
            }
            let [x, y, z] = [wide[number][0], wide[number][4], wide[number][8]];
            let verdict = forms.wide_verdict(self.simd, [x, y, z]);
            let is_shadowed =
                verdict == Verdict::Inside && self.occluders.is_opaque_everywhere(surface);
            told.shadowed |= u64::from(is_shadowed) << number;
            left[doubt_count] = pair as u16;
            doubt_count += usize::from(!is_shadowed);
        }
        // What may block stays in its place, with what is known of it.
        let mut may_count = 0;
        for first in (0..curved_count).step_by(EIGHT) {
            let group = first..curved_count.min(first + EIGHT);
            let verdicts = self.curved_verdicts(pairs, &curved[group.clone()], near);
            for (lane, place) in group.enumerate() {
                let is_inside = (verdicts.inside >> lane & 1) as u16;
                curved[may_count] = curved[place] << 1 | is_inside;
                may_count += usize::from(verdicts.outside >> lane & 1 == 0);
            }
        }
        for &may_block in &curved[..may_count] {
            let (pair, is_inside) = (may_block >> 1, may_block & 1 != 0);
            let number = usize::from(pairs.numbers[usize::from(pair)]) % MANY;
            let surface = SurfaceId(pairs.surfaces[usize::from(pair)]);
            let own = near[number].surface;
            // Another one in the same place is its own, too.
            let is_own = |own| self.occluders.have_one_own_rule(own, surface);
            if told.shadowed >> number & 1 != 0
                || own == Some(surface)
                || is_inside && own.is_some_and(is_own)
            {
                continue;
            }
            let is_shadowed = is_inside && self.occluders.is_opaque_everywhere(surface);
            told.shadowed |= u64::from(is_shadowed) << number;
            left[doubt_count] = pair;
            doubt_count += usize::from(!is_shadowed);
        }
        if doubt_count > 0 {
            self.ask_exactly(pairs, &left[..doubt_count], starts, told);
        }
    }

    /// Tells whether surfaces block that are no triangles, but for the start's own.
    #[inline(always)]
    fn curved_verdicts(
        &self,
        pairs: &Pairs,
        group: &[u16],
        near: &[ReceiverPoint; MANY],
    ) -> Verdicts {
        let balls = &self.tables.scene.balls;
        let mut rows = [&Ball::NONE; EIGHT];
        let mut points = [&near[0].point; EIGHT];
        for ((row, point), &pair) in rows.iter_mut().zip(&mut points).zip(group) {
            let pair = usize::from(pair);
            let number = pairs.surfaces[pair] as usize - self.tables.triangle_count();
            *row = balls.get(number).unwrap_or(row);
            *point = &near[usize::from(pairs.numbers[pair]) % MANY].point;
        }
        balls::verdicts(self.simd, rows, points, self.light(), self.room())
    }

    /// Asks the exact rule about pairs in doubt.
    #[inline(never)]
    fn ask_exactly(
        &self,
        pairs: &Pairs,
        in_doubt: &[u16],
        starts: &[ReceiverPoint; MANY],
        told: &mut Told,
    ) {
        let mut last = None;
        for &pair in in_doubt {
            let number = usize::from(pairs.numbers[usize::from(pair)]) % MANY;
            if told.shadowed >> number & 1 != 0 {
                continue;
            }
            let segment = match last {
                Some((of, segment)) if of == number => segment,
                _ => self.occluders.segment(&starts[number], self.light()),
            };
            let surface = SurfaceId(pairs.surfaces[usize::from(pair)]);
            let is_blocked = self.occluders.blocks(surface, &segment);
            told.shadowed |= u64::from(is_blocked) << number;
            last = Some((number, segment));
        }
    }
}
