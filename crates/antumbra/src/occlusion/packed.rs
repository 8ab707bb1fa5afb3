//! Values and lists that are all made, packed for reading.
//!
//! In: a [`Store`] that nothing is added to any more. Out: what is known at a cell of one light. A brick is 24
//! bytes: the two planes of its 64 values, where its finer bricks start, and where the leaves of its
//! listed cells do; both lie in the order of the cells. Bricks under one brick lie together, followed by what
//! is below them; a list is kept once. All places are numbers within this light's own tables.

use std::collections::HashMap;

use super::bricks::Store;
use super::lattice::{Code, Lattice};
use super::links::Link;
use super::value::{Audience, Occlusion};

/// What is known of one light.
#[derive(Debug)]
pub(crate) struct Packed {
    /// For each place of each audience's root table a brick, then one for all points outside; after those of
    /// all audiences those of `BEYOND`.
    roots: Box<[u32]>,
    areas: [Area; 3],
    bricks: Box<[Brick]>,
    leaves: Box<[Leaf]>,
    /// The surfaces of all lists, and some more words to be read in vain.
    entries: Box<[u32]>,
}

/// Where an audience's bricks are found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    /// The first place of its root table.
    pub(super) first: u32,
    /// How many places that has, without the one for points outside.
    pub(super) place_count: u32,
    pub(super) root_shift: u32,
    pub(super) brick_shift: u32,
}

/// Sixty-four cells.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
struct Brick {
    low: u64,
    high: u64,
    /// The first finer brick, and the first leaf.
    next: [u32; 2],
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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

    /// Packs what a store knows of a light; `None` if it has longer or more lists than can be told.
    pub(super) fn new(store: &Store, light: usize, lattices: &[Lattice; 3]) -> Option<Self> {
        let mut packer = Packer::new();
        let mut roots = Vec::new();
        let areas = Audience::ALL.map(|audience| {
            let lattice = &lattices[audience as usize];
            let area = Area {
                first: roots.len() as u32,
                place_count: lattice.root_places() as u32,
                root_shift: lattice.root_shift(),
                brick_shift: lattice.coarsest_shift(),
            };
            let first = store.root(light, audience);
            packer.add_table(store, first, lattice.root_places(), &mut roots);
            area
        });
        roots.extend(Self::BEYOND.map(|whole| whole as u32));
        packer.entries.extend([0; STRIDE]);
        packer.is_told().then(|| Self {
            roots: roots.into(),
            areas,
            bricks: packer.bricks.into(),
            leaves: packer.leaves.into(),
            entries: packer.entries.into(),
        })
    }

    #[inline(always)]
    pub(super) fn area(&self, audience: Audience) -> Area {
        self.areas[audience as usize]
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
    pub(super) fn find(&self, audience: Audience, code: Code) -> Result<bool, Leaf> {
        let area = self.area(audience);
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

    /// Returns what is known of the coarsest bricks that hold a part of the scene's box, with numbers of
    /// bricks and leaves in place of places.
    pub(super) fn roots(&self, lattice: &Lattice, audience: Audience) -> Vec<Link> {
        let (area, reader) = (self.area(audience), self.reader());
        let link = |brick: u32| match brick {
            lit if lit == Whole::Lit as u32 => Link::LIT,
            dark if dark == Whole::Shadowed as u32 => Link::SHADOWED,
            other if other <= Whole::Doubt as u32 => Link::RAY,
            brick => Link::to_brick(brick),
        };
        let bricks = lattice.root_bricks();
        bricks
            .map(|brick| link(reader.root(area.first + Code::place_of(brick.at) as u32)))
            .collect()
    }

    /// Returns the planes of a brick in words, and what is known of its cells that have no answer.
    pub(super) fn brick(&self, number: usize) -> ([u32; 4], Vec<Link>) {
        let reader = self.reader();
        let Brick { mut low, high, .. } = self.bricks[number];
        let listed = low;
        let mut links: Vec<Link> = Vec::with_capacity(high.count_ones() as usize);
        for place in (0..64).filter(|place| high >> place & 1 != 0) {
            let next = reader.next(number as u32, place);
            if listed >> place & 1 == 0 {
                links.push(Link::to_brick(next));
                continue;
            }
            let leaf = self.leaf(next);
            // A list that cells share is told once.
            let same = |link: &Link| link.list().filter(|&known| self.leaves[known] == leaf);
            let known = links.iter().find_map(same);
            let unlisted = leaf.unlisted();
            if leaf.count() == 0 && unlisted.is_pending() {
                // As a store says it: finer cells may come here.
                low &= !(1 << place);
            }
            links.push(match leaf.count() {
                0 => unlisted,
                _ => Link::to_list(known.map_or(next, |known| known as u32)),
            });
        }
        let halves = |plane: u64| [plane as u32, (plane >> 32) as u32];
        let ([a, b], [c, d]) = (halves(low), halves(high));
        ([a, b, c, d], links)
    }

    /// Returns the surfaces of the list of a leaf, by its number.
    pub(super) fn list_of(&self, leaf: usize) -> &[u32] {
        self.list(self.leaves[leaf])
    }

    /// Returns the bytes of values and of the index to lists.
    pub(crate) fn value_bytes(&self) -> u64 {
        (size_of_val(&*self.roots) + size_of_val(&*self.bricks) + size_of_val(&*self.leaves)) as u64
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
        let Brick { low, high, .. } = &self.bricks[brick as usize];
        Cell {
            low: low >> (number & 63) & 1,
            high: high >> (number & 63) & 1,
        }
    }

    /// Returns the finer brick of a complicated cell, or the leaf of a listed one.
    #[inline(always)]
    pub(super) fn next(self, brick: u32, number: u32) -> u32 {
        let Brick { low, high, next } = &self.bricks[brick as usize];
        let is_listed = low >> (number & 63) & 1;
        // Those of its kind before it.
        let same = high & (low ^ is_listed.wrapping_sub(1)) & !(u64::MAX << (number & 63));
        next[is_listed as usize].wrapping_add(same.count_ones())
    }
}

struct Packer {
    bricks: Vec<Brick>,
    leaves: Vec<Leaf>,
    entries: Vec<u32>,
    lists: HashMap<Box<[u32]>, Leaf>,
    /// The bricks of roots that found no room.
    pending: HashMap<Leaf, u32>,
    /// A list is too long to be told, or empty.
    is_odd: bool,
}

impl Packer {
    fn new() -> Self {
        let mut packer = Self {
            bricks: Vec::new(),
            leaves: Vec::new(),
            entries: Vec::new(),
            lists: HashMap::new(),
            pending: HashMap::new(),
            is_odd: false,
        };
        for whole in [
            Whole::Lit,
            Whole::Shadowed,
            Whole::Ray,
            Whole::Outside,
            Whole::Doubt,
        ] {
            match whole {
                Whole::Lit => packer.bricks.push(Brick::default()),
                Whole::Shadowed => packer.bricks.push(Brick {
                    low: u64::MAX,
                    ..Brick::default()
                }),
                Whole::Ray => packer.add_listed(Leaf::RAY),
                Whole::Outside => packer.add_listed(Leaf::OUTSIDE),
                Whole::Doubt => packer.add_listed(Leaf::DOUBT),
            }
        }
        packer
    }

    /// Returns whether all numbers fit.
    fn is_told(&self) -> bool {
        let most = (u32::MAX >> COUNT_BITS) as usize;
        !self.is_odd
            && self.entries.len() <= most
            && self.leaves.len() < u32::MAX as usize
            && self.bricks.len() < u32::MAX as usize
    }

    /// Adds a brick all of whose cells have one leaf.
    fn add_listed(&mut self, leaf: Leaf) {
        self.bricks.push(Brick {
            low: u64::MAX,
            high: u64::MAX,
            next: [0, self.leaves.len() as u32],
        });
        self.leaves.extend([leaf; 64]);
    }

    /// Adds a root table, and the bricks below it.
    fn add_table(&mut self, store: &Store, first: u32, place_count: usize, roots: &mut Vec<u32>) {
        let mut coarsest = Vec::new();
        for place in first..first + place_count as u32 {
            let link = store.link(place);
            let brick = match link.answer() {
                Some(false) => Whole::Lit as u32,
                Some(true) => Whole::Shadowed as u32,
                None if link == Link::OUTSIDE => Whole::Outside as u32,
                None => {
                    let number = self.bricks.len() as u32;
                    match (link.brick(), self.leaf_of(store, link)) {
                        (Some(brick), _) => {
                            coarsest.push((number, brick));
                            self.bricks.push(Brick::default());
                            number
                        }
                        (None, Leaf::RAY) => Whole::Ray as u32,
                        // One for all roots of a price, of which there may be many.
                        (None, leaf) if leaf.is_unknown() => {
                            let known = self.pending.get(&leaf).copied();
                            known.unwrap_or_else(|| {
                                self.pending.insert(leaf, number);
                                self.add_listed(leaf);
                                number
                            })
                        }
                        (None, leaf) => {
                            self.add_listed(leaf);
                            number
                        }
                    }
                }
            };
            roots.push(brick);
        }
        roots.push(Whole::Outside as u32);
        for (number, brick) in coarsest {
            self.fill(store, number, brick);
        }
    }

    /// Writes a brick that has its number, and adds all below it.
    fn fill(&mut self, store: &Store, number: u32, from: usize) {
        let mut brick = Brick {
            next: [self.bricks.len() as u32, self.leaves.len() as u32],
            ..Brick::default()
        };
        let mut finer = Vec::new();
        for (place, link) in store.cells(from).into_iter().enumerate() {
            let value = match (link.answer(), link.brick()) {
                (Some(is_shadowed), _) => Occlusion::known(is_shadowed),
                (None, Some(below)) => {
                    finer.push((self.bricks.len() as u32, below));
                    self.bricks.push(Brick::default());
                    Occlusion::Complicated
                }
                (None, None) => {
                    let leaf = self.leaf_of(store, link);
                    self.leaves.push(leaf);
                    Occlusion::Listed
                }
            };
            let bits = u64::from(value.bits());
            brick.low |= (bits & 1) << place;
            brick.high |= (bits >> 1) << place;
        }
        self.bricks[number as usize] = brick;
        for (number, below) in finer {
            self.fill(store, number, below);
        }
    }

    /// Returns what is told of a cell without an answer and without a brick.
    fn leaf_of(&mut self, store: &Store, link: Link) -> Leaf {
        let Some(list) = link.list() else {
            return match link.is_pending() {
                true => Leaf::pending(link.price()),
                false => Leaf::RAY,
            };
        };
        let surfaces = store.list(list).surfaces();
        let count = surfaces.len() as u32;
        self.is_odd |= !(1..=LONGEST).contains(&count);
        let entries = &mut self.entries;
        *self.lists.entry(surfaces).or_insert_with_key(|surfaces| {
            let first = entries.len() as u32;
            entries.extend_from_slice(surfaces);
            Leaf(first << COUNT_BITS | count.min(LONGEST))
        })
    }
}
