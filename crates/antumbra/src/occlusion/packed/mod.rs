//! Values and lists of one light that are all there, packed for reading.
//!
//! In: a store that nothing is added to any more (`packer`), or words that were kept (`keeping`). Out: what is known
//! at a cell. A brick is 24 bytes: the two planes of its 64 values, where its finer bricks start, and where the
//! leaves of its listed cells do; both lie in the order of the cells. Bricks under one brick lie together,
//! behind it; a list is kept once. All places are numbers within this light's own tables. Invariants: all numbers
//! lead into the tables, and a brick's to bricks behind it, no deeper than codes tell.

mod keeping;
mod packer;
mod runs;

pub(crate) use runs::{RUNS, Runs};

use bytemuck::{Pod, Zeroable};

use super::lattice::{Code, Lattice};
use super::links::Link;
use super::value::ReceiverClass;

/// What is known of one light.
#[derive(Debug)]
pub(crate) struct Packed {
    /// For each place of each receiver class's root table a brick, then one for all points outside; after those of
    /// all receiver classes those of `BEYOND`.
    roots: Box<[u32]>,
    areas: [Area; 3],
    bricks: Box<[Brick]>,
    leaves: Box<[Leaf]>,
    /// The surfaces of all lists, and some more words to be read in vain.
    entries: Box<[u32]>,
}

/// Where a receiver class's bricks are found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    /// The first place of its root table.
    pub(super) first: u32,
    /// How many places that has, without the one for points outside.
    pub(super) place_count: u32,
    pub(super) root_shift: u32,
    pub(super) brick_shift: u32,
}

/// Sixty-four cells, in words as they are kept.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Brick {
    /// The low bits of the values, then the high ones.
    planes: [u32; 4],
    /// The first finer brick, and the first leaf.
    next: [u32; 2],
}

impl Brick {
    #[inline(always)]
    fn low(&self) -> u64 {
        u64::from(self.planes[0]) | u64::from(self.planes[1]) << 32
    }

    #[inline(always)]
    fn high(&self) -> u64 {
        u64::from(self.planes[2]) | u64::from(self.planes[3]) << 32
    }
}

/// What is read of a cell: the bits of its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// The answer, if it is decided; else whether there is a leaf and not a brick.
    pub(super) low: u64,
    /// Whether it is not decided.
    pub(super) high: u64,
}

/// Tables at hand.
#[derive(Clone, Copy)]
pub(super) struct Reader<'a> {
    roots: &'a [u32],
    bricks: &'a [Brick],
}

/// The list of a cell: where it starts and how long it is, six bits; or why there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Leaf(u32);

impl Leaf {
    /// Ask a ray.
    pub(super) const RAY: Self = Self(0);
    /// There is no cell.
    pub(super) const OUTSIDE: Self = Self(1 << COUNT_BITS);
    /// The start may not be where its point is.
    pub(super) const DOUBT: Self = Self(2 << COUNT_BITS);

    /// Ask a ray; there was no room to know more, for a price.
    fn pending(price: u32) -> Self {
        Self((FIRST_PENDING + price) << COUNT_BITS)
    }

    /// Returns what is said in place of the list where there is none.
    fn unlisted(self) -> Link {
        match self.first().checked_sub(FIRST_PENDING as usize) {
            Some(price) => Link::pending(price as u32),
            None => Link::RAY,
        }
    }

    /// Returns whether there is neither a list nor another way to an answer than to ask a ray.
    #[inline(always)]
    pub(super) fn is_unknown(self) -> bool {
        let is_known = self == Self::OUTSIDE || self == Self::DOUBT;
        self.count() == 0 && !is_known
    }

    /// Returns how many surfaces are listed; 0 if there is no list.
    #[inline(always)]
    pub(super) fn count(self) -> usize {
        (self.0 & LONGEST) as usize
    }

    #[inline(always)]
    fn first(self) -> usize {
        (self.0 >> COUNT_BITS) as usize
    }
}

const COUNT_BITS: u32 = 6;
/// Numbers from here on, where nothing is listed, are prices.
const FIRST_PENDING: u32 = 3;
const LONGEST: u32 = (1 << COUNT_BITS) - 1;

/// So many entries may be read at once from where a list starts, and from every so many of it on.
pub(super) const STRIDE: usize = 16;

/// Bricks that are always there.
#[derive(Clone, Copy)]
enum Whole {
    Lit,
    Shadowed,
    Ray,
    Outside,
    Doubt,
}

impl Packed {
    /// Beyond the root tables: all starts are in shadow.
    pub(super) const OWN_SHADOW: u32 = 0;
    /// Beyond the root tables: nothing is told here.
    pub(super) const DOUBT: u32 = 1;
    /// Beyond the root tables: all starts are lit.
    pub(super) const LIT: u32 = 2;
    /// Beyond the root tables: ask rays.
    pub(super) const UNKNOWN: u32 = 3;
    const BEYOND: [Whole; 4] = [Whole::Shadowed, Whole::Doubt, Whole::Lit, Whole::Ray];

    /// Returns where the root tables lie, one behind the other, and how many places they have in all.
    fn areas(lattices: &[Lattice; 3]) -> ([Area; 3], usize) {
        let mut place_count = 0;
        let areas = lattices.each_ref().map(|lattice| {
            let first = place_count as u32;
            place_count += lattice.root_places() + 1;
            Area {
                first,
                place_count: lattice.root_places() as u32,
                root_shift: lattice.root_shift(),
                brick_shift: lattice.coarsest_shift(),
            }
        });
        (areas, place_count)
    }

    #[inline(always)]
    pub(super) fn area(&self, class: ReceiverClass) -> Area {
        self.areas[class as usize]
    }

    /// Returns the place beyond all root tables.
    #[inline(always)]
    pub(super) fn beyond(&self) -> u32 {
        (self.roots.len() - Self::BEYOND.len()) as u32
    }

    #[inline(always)]
    pub(super) fn reader(&self) -> Reader<'_> {
        Reader {
            roots: &self.roots,
            bricks: &self.bricks,
        }
    }

    #[inline(always)]
    pub(super) fn leaf(&self, number: u32) -> Leaf {
        self.leaves[number as usize]
    }

    /// Returns all entries from a list's first on.
    #[inline(always)]
    pub(super) fn entries_from(&self, leaf: Leaf) -> &[u32] {
        &self.entries[leaf.first()..]
    }

    /// Returns the surfaces of a list.
    pub(super) fn list(&self, leaf: Leaf) -> &[u32] {
        &self.entries_from(leaf)[..leaf.count()]
    }

    /// Returns what is known where a code says: an answer, or a leaf.
    pub(super) fn find(&self, class: ReceiverClass, code: Code) -> Result<bool, Leaf> {
        let area = self.area(class);
        let place = code
            .place_in_root(area.root_shift)
            .min(area.place_count as usize);
        let reader = self.reader();
        let mut brick = reader.root(area.first + place as u32);
        let mut shift = area.brick_shift;
        loop {
            let number = code.place_in_brick(shift);
            let Cell { low, high } = reader.cell(brick, number);
            match (high, low) {
                (0, is_shadowed) => return Ok(is_shadowed != 0),
                (_, 0) => brick = reader.next(brick, number),
                _ => return Err(self.leaf(reader.next(brick, number))),
            }
            shift = shift.wrapping_sub(6);
        }
    }

    /// Returns the bytes of values and of the index to lists.
    pub(crate) fn value_bytes(&self) -> u64 {
        (size_of_val(&*self.roots) + size_of_val(&*self.bricks) + size_of_val(&*self.leaves)) as u64
    }

    /// Returns the bytes of all.
    pub(crate) fn bytes(&self) -> u64 {
        self.value_bytes() + self.list_bytes()
    }

    /// Returns the bytes of lists.
    pub(crate) fn list_bytes(&self) -> u64 {
        size_of_val(&*self.entries) as u64
    }
}

impl Reader<'_> {
    /// Returns the brick at a place in the root tables.
    #[inline(always)]
    pub(super) fn root(self, place: u32) -> u32 {
        self.roots[place as usize]
    }

    /// Reads a cell of a brick, of whose number six bits are taken.
    #[inline(always)]
    pub(super) fn cell(self, brick: u32, number: u32) -> Cell {
        let brick = &self.bricks[brick as usize];
        Cell {
            low: brick.low() >> (number & 63) & 1,
            high: brick.high() >> (number & 63) & 1,
        }
    }

    /// Returns the finer brick of a complicated cell, or the leaf of a listed one.
    #[inline(always)]
    pub(super) fn next(self, brick: u32, number: u32) -> u32 {
        let brick = &self.bricks[brick as usize];
        let is_listed = brick.low() >> (number & 63) & 1;
        // Those of its kind before it.
        let is_same = brick.high() & (brick.low() ^ is_listed.wrapping_sub(1));
        let same = is_same & !(u64::MAX << (number & 63));
        brick.next[is_listed as usize].wrapping_add(same.count_ones())
    }
}
