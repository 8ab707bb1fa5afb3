//! Many starts looked up together in values that are packed.
//!
//! In: starts. Out: their answers. One step for all starts before the next, and no step branches on what
//! it reads: which starts go on is written down by moving the end of a list of their numbers. So the memory that
//! they need is fetched together. Invariant: an answer is the reference's; see `lookup`, which answers
//! single starts, and those that are not where their points are.

use antumbra_geometry::{DVec3, Start, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f64x4, u32x8};

use super::forms::Verdict;
use super::lattice::Codes;
use super::lookup::{Asks, Entry, Found, Lookup};
use super::packed::{Leaf, Packed, STRIDE};
use super::planes::{StartPlane, tell};
use super::value::Audience;

/// Starts that are looked up together; a bit each.
pub(crate) const MANY: usize = 64;

/// Pairs of a start and a possible blocker that are told together.
const PAIRS: usize = 256;
/// A list may be so much longer than there is room for.
const SPARE: usize = 64 + STRIDE;

/// How many starts were told, and by what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Told {
    pub(crate) list_count: u64,
    /// A bit for each start of which nothing is known.
    pub(crate) unknown: u64,
}

impl Told {
    /// Nothing is known of so many.
    pub(super) fn nothing(count: usize) -> Self {
        Self {
            list_count: 0,
            unknown: u64::MAX.checked_shr(MANY as u32 - count as u32).unwrap_or(0),
        }
    }

    fn add(&mut self, number: usize, found: Found, is_shadowed: &mut bool) {
        *is_shadowed = found.is_shadowed();
        self.list_count += u64::from(found.is_by_list());
        self.unknown |= u64::from(found.is_nothing()) << number;
    }
}

/// Where starts are, coordinate by coordinate.
type Places = [[f32; MANY]; 3];

/// Where in the root tables starts are looked up, and in which cell of the brick there.
struct Roots {
    places: [u32; MANY],
    cells: [u32; MANY],
    brick_shift: u32,
}

/// Free starts, those outside all cells where their segments come in.
struct Entered {
    starts: [Start; MANY],
    count: usize,
    /// Those whose segments never come in, a bit each.
    lit: u64,
    /// Those too far away to tell well.
    unknown: u64,
}

impl Entered {
    fn new(starts: &[Start]) -> Self {
        let nowhere = Start {
            point: DVec3::ZERO,
            surface: None,
        };
        let mut all = [nowhere; MANY];
        all[..starts.len()].copy_from_slice(starts);
        Self {
            starts: all,
            count: starts.len(),
            lit: 0,
            unknown: 0,
        }
    }

    fn tell(&self, packed: &Packed, roots: &mut Roots) {
        for (number, place) in roots.places.iter_mut().enumerate() {
            if self.lit >> number & 1 != 0 {
                *place = packed.beyond() + Packed::LIT;
            }
            if self.unknown >> number & 1 != 0 {
                *place = packed.beyond() + Packed::UNKNOWN;
            }
        }
    }
}

/// Numbers of starts that go on.
struct Numbers {
    all: [u8; MANY],
    count: usize,
}

impl Numbers {
    const NONE: Self = Self {
        all: [0; MANY],
        count: 0,
    };

    /// Adds a number if it goes on.
    #[inline(always)]
    fn add(&mut self, number: usize, goes_on: bool) {
        // Never more than there are starts.
        self.all[self.count % MANY] = number as u8;
        self.count += usize::from(goes_on);
    }

    #[inline(always)]
    fn get(&self, place: usize) -> usize {
        usize::from(self.all[place % MANY]) % MANY
    }
}

/// Starts and possible blockers.
struct Pairs {
    surfaces: [u32; PAIRS + SPARE],
    numbers: [u8; PAIRS + SPARE],
    count: usize,
}

impl<S: Simd> Lookup<'_, S> {
    /// Answers at most [`MANY`] starts.
    #[inline(always)]
    pub(super) fn find_many(
        &self,
        packed: &Packed,
        starts: &[Start],
        is_shadowed: &mut [bool],
    ) -> Told {
        let count = starts.len().min(MANY);
        let (starts, is_shadowed) = (&starts[..count], &mut is_shadowed[..count]);
        let mut surfaces = [0; MANY];
        let mut on_surface_count = 0;
        for (surface, start) in surfaces.iter_mut().zip(starts) {
            on_surface_count += usize::from(start.surface.is_some());
            *surface = start.surface.map_or(0, |SurfaceId(surface)| surface);
        }
        let audience = match on_surface_count {
            0 => Audience::Free,
            all if all == count => Audience::Front,
            _ => return self.find_each(packed, starts, is_shadowed),
        };
        let mut places = self.narrow_many(starts);
        let lattice = &self.values.lattices[audience as usize];
        let mut codes = lattice.codes(self.simd, &places);
        let entered;
        let mut near = starts;
        let roots = match audience {
            Audience::Free if codes.high()[..count].contains(&u32::MAX) => {
                let mut all = Entered::new(starts);
                self.enter_many(&mut all, &mut places, &codes);
                entered = all;
                near = &entered.starts[..count];
                codes = lattice.codes(self.simd, &places);
                let mut roots = self.roots_of_space(packed, &codes);
                entered.tell(packed, &mut roots);
                roots
            }
            Audience::Free => self.roots_of_space(packed, &codes),
            _ => self.roots_on_surfaces(packed, starts, &surfaces, &places, &codes),
        };
        let mut next = [0; MANY];
        let (mut deeper, mut listed) = (Numbers::NONE, Numbers::NONE);
        for (number, is_shadowed) in is_shadowed.iter_mut().enumerate() {
            let cell = packed.cell(packed.root(roots.places[number]), roots.cells[number]);
            *is_shadowed = cell.low;
            next[number] = cell.next;
            deeper.add(number, cell.is_undecided & !cell.low);
            listed.add(number, cell.is_undecided & cell.low);
        }
        let mut shift = roots.brick_shift;
        while deeper.count > 0 {
            shift = shift.wrapping_sub(6);
            let count = std::mem::take(&mut deeper.count);
            for place in 0..count {
                let number = deeper.get(place);
                let in_brick = codes.get(number).place_in_brick(shift);
                let cell = packed.cell(next[number], in_brick);
                is_shadowed[number] = cell.low;
                next[number] = cell.next;
                deeper.add(number, cell.is_undecided & !cell.low);
                listed.add(number, cell.is_undecided & cell.low);
            }
        }
        let mut told = Told {
            list_count: 0,
            unknown: 0,
        };
        if listed.count > 0 {
            self.find_in_lists(
                packed,
                [starts, near],
                &places,
                &next,
                &listed,
                is_shadowed,
                &mut told,
            );
        }
        told
    }

    /// Answers starts one after the other.
    #[cold]
    #[inline(never)]
    fn find_each(&self, packed: &Packed, starts: &[Start], is_shadowed: &mut [bool]) -> Told {
        let mut told = Told {
            list_count: 0,
            unknown: 0,
        };
        for (number, (start, is_shadowed)) in starts.iter().zip(is_shadowed).enumerate() {
            told.add(number, self.find_packed(packed, start), is_shadowed);
        }
        told
    }

    /// Brings points into the frame.
    #[inline(always)]
    fn narrow_many(&self, starts: &[Start]) -> Places {
        let frame = &self.values.frame;
        let mut places = [[0.0; MANY]; 3];
        for (first, starts) in (0..MANY).step_by(8).zip(starts.chunks(8)) {
            let mut wide = [[0.0; 8]; 3];
            for (lane, start) in starts.iter().enumerate() {
                wide[0][lane] = start.point.x;
                wide[1][lane] = start.point.y;
                wide[2][lane] = start.point.z;
            }
            for (axis, wide) in wide.iter().enumerate() {
                let low = f64x4::from_slice(self.simd, &wide[..4]);
                let high = f64x4::from_slice(self.simd, &wide[4..]);
                let low = (low - frame.center[axis]) * frame.scale;
                let high = (high - frame.center[axis]) * frame.scale;
                let narrow: f32x8<S> = low.narrow(high);
                places[axis][first..first + 8].copy_from_slice(narrow.as_slice());
            }
        }
        places
    }

    #[inline(always)]
    fn roots_of_space(&self, packed: &Packed, codes: &Codes<MANY>) -> Roots {
        let area = packed.area(Audience::Free);
        let mut roots = Roots::new(area.brick_shift);
        for first in (0..MANY).step_by(8) {
            let high = u32x8::from_slice(self.simd, &codes.high()[first..first + 8]);
            let place = (high >> (area.root_shift - 24)).min(area.place_count);
            roots.set(first, place + area.first, high);
        }
        roots
    }

    #[inline(always)]
    fn roots_on_surfaces(
        &self,
        packed: &Packed,
        starts: &[Start],
        surfaces: &[u32; MANY],
        places: &Places,
        codes: &Codes<MANY>,
    ) -> Roots {
        let (front, back) = (packed.area(Audience::Front), packed.area(Audience::Back));
        let doubt = packed.beyond() + Packed::DOUBT;
        let planes = packed.planes();
        let mut roots = Roots::new(front.brick_shift);
        let mut others = Numbers::NONE;
        let front_first = u32x8::splat(self.simd, front.first);
        let back_first = u32x8::splat(self.simd, back.first);
        let doubt_place = u32x8::splat(self.simd, doubt);
        for first in (0..MANY).step_by(8) {
            if first >= starts.len() {
                break;
            }
            let mut rows = [&StartPlane::NOWHERE; 8];
            for (row, &surface) in rows.iter_mut().zip(&surfaces[first..first + 8]) {
                *row = planes.get(surface as usize).unwrap_or(row);
            }
            let x = [
                f32x8::from_slice(self.simd, &places[0][first..first + 8]),
                f32x8::from_slice(self.simd, &places[1][first..first + 8]),
                f32x8::from_slice(self.simd, &places[2][first..first + 8]),
            ];
            let (are_starts, are_behind) = tell(self.simd, rows, x);
            let high = u32x8::from_slice(self.simd, &codes.high()[first..first + 8]);
            let place = (high >> (front.root_shift - 24)).min(front.place_count);
            let table = are_behind.select(back_first, front_first);
            let place = are_starts.select(place + table, doubt_place);
            roots.set(first, place, high);
        }
        for (number, &surface) in surfaces.iter().enumerate().take(starts.len()) {
            others.add(number, surface as usize >= planes.len());
        }
        for place in 0..others.count {
            let number = others.get(place);
            let surface = surfaces[number] as usize;
            roots.places[number] = match self.audience_on_ball(surface, starts[number].point) {
                Asks::In(_) => {
                    let place = codes.get(number).place_in_root(front.root_shift);
                    front.first + place.min(front.place_count as usize) as u32
                }
                Asks::OwnShadow => packed.beyond() + Packed::OWN_SHADOW,
                Asks::Doubt => doubt,
            };
        }
        roots
    }

    /// Takes free starts outside all cells to where their segments come in.
    #[inline(never)]
    fn enter_many(&self, entered: &mut Entered, places: &mut Places, codes: &Codes<MANY>) {
        for number in 0..entered.count {
            if codes.high()[number] != u32::MAX {
                continue;
            }
            let start = &mut entered.starts[number];
            match self.entry(start.point) {
                Entry::Never => entered.lit |= 1 << number,
                Entry::Unknown => entered.unknown |= 1 << number,
                Entry::At(point) => {
                    start.point = point;
                    let x = self.values.narrow(point);
                    for (places, x) in places.iter_mut().zip(x) {
                        places[number] = x;
                    }
                }
            }
        }
    }

    /// Asks the blockers of lists, or says why there are none. Starts are given as they are asked, and as they
    /// are where they answer the same.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "one step of several, on their state")]
    fn find_in_lists(
        &self,
        packed: &Packed,
        [starts, near]: [&[Start]; 2],
        places: &Places,
        next: &[u32; MANY],
        listed: &Numbers,
        is_shadowed: &mut [bool],
        told: &mut Told,
    ) {
        let mut pairs = Pairs {
            surfaces: [0; PAIRS + SPARE],
            numbers: [0; PAIRS + SPARE],
            count: 0,
        };
        for place in 0..listed.count {
            let number = listed.get(place);
            let leaf = packed.leaf(next[number]);
            let count = leaf.count();
            if count == 0 {
                let found = match leaf {
                    Leaf::DOUBT => self.find_off_surface(&starts[number]),
                    Leaf::OUTSIDE => self.find_from_outside(&starts[number]),
                    _ => Found::NOTHING,
                };
                told.add(number, found, &mut is_shadowed[number]);
                continue;
            }
            told.list_count += 1;
            is_shadowed[number] = false;
            let entries = packed.entries_from(leaf);
            for first in (0..count).step_by(STRIDE) {
                // What is beyond the list is written over by the next.
                let at = pairs.count + first;
                pairs.surfaces[at..at + STRIDE].copy_from_slice(&entries[first..first + STRIDE]);
                pairs.numbers[at..at + STRIDE].fill(number as u8);
            }
            pairs.count += count;
            if pairs.count > PAIRS {
                self.tell_pairs(&pairs, [starts, near], places, is_shadowed);
                pairs.count = 0;
            }
        }
        self.tell_pairs(&pairs, [starts, near], places, is_shadowed);
    }

    /// Finds which starts are blocked by the surfaces that they are paired with.
    #[inline(always)]
    fn tell_pairs(
        &self,
        pairs: &Pairs,
        [starts, near]: [&[Start]; 2],
        places: &Places,
        is_shadowed: &mut [bool],
    ) {
        let forms = self.tables.all_umbra_forms();
        let mut left = [0_u16; PAIRS + SPARE];
        let mut left_count = 0;
        let all = pairs.surfaces.iter().zip(&pairs.numbers).take(pairs.count);
        for (pair, (&surface, &number)) in all.enumerate() {
            let number = usize::from(number) % MANY;
            let may_block = match forms.get(surface as usize) {
                Some(forms) => !forms.is_outside(self.simd, place_of(places, number)),
                None => {
                    let start = &near[number];
                    let verdict = self.curved_verdict(SurfaceId(surface), start, start.point);
                    verdict != Verdict::Outside
                }
            };
            left[left_count] = pair as u16;
            left_count += usize::from(may_block);
        }
        let mut doubt_count = 0;
        for place_left in 0..left_count {
            let pair = usize::from(left[place_left]);
            let number = usize::from(pairs.numbers[pair]);
            let (start, surface) = (&near[number], SurfaceId(pairs.surfaces[pair]));
            if is_shadowed[number] {
                continue;
            }
            let (verdict, may_hide) = match forms.get(surface.0 as usize) {
                Some(forms) => {
                    let is_flat_with = |own| self.tables.are_in_one_plane(own, surface);
                    if start.surface.is_some_and(is_flat_with) {
                        continue;
                    }
                    let verdict = forms.wide_verdict(self.simd, place_of(places, number));
                    (verdict, self.occluders.is_opaque_everywhere(surface))
                }
                None => (self.curved_verdict(surface, start, start.point), true),
            };
            is_shadowed[number] = verdict == Verdict::Inside && may_hide;
            left[doubt_count] = pair as u16;
            doubt_count += usize::from(!is_shadowed[number]);
        }
        if doubt_count > 0 {
            self.ask_exactly(pairs, &left[..doubt_count], starts, is_shadowed);
        }
    }

    /// Asks the exact rule about pairs in doubt.
    #[inline(never)]
    fn ask_exactly(
        &self,
        pairs: &Pairs,
        in_doubt: &[u16],
        starts: &[Start],
        is_shadowed: &mut [bool],
    ) {
        let mut last = None;
        for &pair in in_doubt {
            let number = usize::from(pairs.numbers[usize::from(pair)]);
            if is_shadowed[number] {
                continue;
            }
            let segment = match last {
                Some((of, segment)) if of == number => segment,
                _ => self.occluders.segment(&starts[number], self.light()),
            };
            let surface = SurfaceId(pairs.surfaces[usize::from(pair)]);
            is_shadowed[number] = self.occluders.blocks(surface, &segment);
            last = Some((number, segment));
        }
    }
}

#[inline(always)]
fn place_of([x, y, z]: &Places, number: usize) -> [f32; 3] {
    [x[number], y[number], z[number]]
}

impl Roots {
    #[inline(always)]
    fn new(brick_shift: u32) -> Self {
        Self {
            places: [0; MANY],
            cells: [0; MANY],
            brick_shift,
        }
    }

    /// Says where eight starts are looked up; the coarsest bricks' places are in the upper half of a code.
    #[inline(always)]
    fn set<S: Simd>(&mut self, first: usize, places: u32x8<S>, high: u32x8<S>) {
        let cells = high >> (self.brick_shift - 24) & 63;
        self.places[first..first + 8].copy_from_slice(places.as_slice());
        self.cells[first..first + 8].copy_from_slice(cells.as_slice());
    }
}
