//! From a store to tables for reading.
//!
//! In: a [`Store`] that nothing is added to any more. Out: a [`Packed`].

use std::collections::HashMap;

use hashbrown::HashTable;
use twox_hash::XxHash3_64;

use super::super::bricks::Store;
use super::super::lattice::Lattice;
use super::super::links::Link;
use super::super::value::{Occlusion, ReceiverClass};
use super::{Brick, COUNT_BITS, LONGEST, Leaf, Packed, STRIDE, Whole};

impl Packed {
    /// Packs what a store knows of a light; `None` if it has longer or more lists than can be told.
    pub(in super::super) fn new(store: &Store, lattices: &[Lattice; 3]) -> Option<Self> {
        let mut packer = Packer::new(store);
        let (areas, _) = Self::areas(lattices);
        let mut roots = Vec::new();
        for class in ReceiverClass::ALL {
            let place_count = lattices[class as usize].root_places();
            roots.reserve_exact(place_count + 1);
            let first = store.root(class);
            packer.add_table(store, first, place_count, &mut roots);
        }
        roots.extend(Self::BEYOND.map(|whole| whole as u32));
        packer.entries.extend([0; STRIDE]);
        packer.is_known().then(|| Self {
            roots: roots.into(),
            areas,
            bricks: packer.bricks.into(),
            leaves: packer.leaves.into(),
            entries: packer.entries.into(),
        })
    }
}

impl Packed {
    /// Returns about the most bytes that [`Packed::new`] takes at its height: the tables, all lists as if none were
    /// there twice, and a table of hashes that is no larger.
    pub(in super::super) fn height_bytes(store: &Store) -> u64 {
        let [brick_count, link_count, list_words] = store.counts();
        let bricks = (brick_count + SPARE) * size_of::<Brick>();
        let leaves = (link_count + 64 * SPARE) * size_of::<Leaf>();
        let lists = 2 * size_of::<u32>() * (list_words + STRIDE);
        (bricks + leaves + lists) as u64 + store.root_bytes()
    }
}

/// What is packed so far. Equal lists are found by their hashes, whose table is made again as it grows.
struct Packer {
    bricks: Vec<Brick>,
    leaves: Vec<Leaf>,
    entries: Vec<u32>,
    lists: HashTable<Leaf>,
    /// The bricks of roots that found no room.
    pending: HashMap<Leaf, u32>,
    /// A list is too long to be told, or empty.
    is_odd: bool,
}

impl Packer {
    fn new(store: &Store) -> Self {
        let [brick_count, link_count, list_words] = store.counts();
        let mut packer = Self {
            bricks: Vec::with_capacity(brick_count + SPARE),
            leaves: Vec::with_capacity(link_count + 64 * SPARE),
            entries: Vec::with_capacity(list_words + STRIDE),
            lists: HashTable::new(),
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
                    planes: [u32::MAX, u32::MAX, 0, 0],
                    next: [0; 2],
                }),
                Whole::Ray => packer.add_listed(Leaf::RAY),
                Whole::Outside => packer.add_listed(Leaf::OUTSIDE),
                Whole::Doubt => packer.add_listed(Leaf::DOUBT),
            }
        }
        packer
    }

    /// Returns whether all numbers fit.
    fn is_known(&self) -> bool {
        let most = (u32::MAX >> COUNT_BITS) as usize;
        !self.is_odd
            && self.entries.len() <= most
            && self.leaves.len() < u32::MAX as usize
            && self.bricks.len() < u32::MAX as usize
    }

    /// Adds a brick all of whose cells have one leaf.
    fn add_listed(&mut self, leaf: Leaf) {
        self.bricks.push(Brick {
            planes: [u32::MAX; 4],
            next: [0, self.leaves.len() as u32],
        });
        self.leaves.extend([leaf; 64]);
    }

    /// Adds a root table, and the bricks below it.
    fn add_table(&mut self, store: &Store, first: u32, place_count: usize, roots: &mut Vec<u32>) {
        let mut coarsest = Vec::new();
        for place in antumbra_task::checked(first..first + place_count as u32) {
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
        antumbra_task::check();
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
            let (bits, half) = (u32::from(value.bits()), place / 32);
            brick.planes[half] |= (bits & 1) << (place % 32);
            brick.planes[2 + half] |= (bits >> 1) << (place % 32);
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
        let surfaces = store.surfaces(list);
        let count = surfaces.len() as u32;
        self.is_odd |= !(1..=LONGEST).contains(&count);
        let Self { lists, entries, .. } = self;
        let hash = |list: &[u32]| XxHash3_64::oneshot(bytemuck::cast_slice(list));
        let list_of = |leaf: Leaf, entries: &[u32]| {
            let first = leaf.first();
            hash(&entries[first..first + leaf.count()])
        };
        let is_same = |leaf: &Leaf| entries[leaf.first()..].starts_with(&surfaces);
        let known = lists.find(hash(&surfaces), |leaf| {
            leaf.count() == surfaces.len() && is_same(leaf)
        });
        if let Some(&leaf) = known {
            return leaf;
        }
        let first = entries.len() as u32;
        entries.extend_from_slice(&surfaces);
        let leaf = Leaf(first << COUNT_BITS | count.min(LONGEST));
        lists.insert_unique(hash(&surfaces), leaf, |&leaf| list_of(leaf, entries));
        leaf
    }
}

/// Bricks that stand for all of their kind, and some more.
const SPARE: usize = 64;
