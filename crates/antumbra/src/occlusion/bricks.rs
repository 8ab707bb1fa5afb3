//! Values in bricks of 4^3 cells, finer bricks under cells that need them.
//!
//! In: octrees of decided cells. Out: a [`Leaf`] for a finest cell. A brick keeps two bits a cell, and says
//! where the finer bricks of its complicated cells and the lists of its listed cells lie, in the order of
//! the cells. Bricks of one level lie together.

use std::collections::HashMap;

use super::lattice::{Cell, Code, Lattice};
use super::value::{Occlusion, Values64};

/// What is known at a cell: an answer, a list of blockers, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaf(u32);

impl Leaf {
    /// All starts are lit.
    pub(crate) const LIT: Self = Self(0);
    /// All starts are in shadow.
    pub(crate) const SHADOWED: Self = Self(1);
    /// Ask a ray.
    pub(crate) const UNKNOWN: Self = Self(u32::MAX);
    const FIRST_LIST: u32 = 2;

    fn of_list(list: u32) -> Self {
        Self(Self::FIRST_LIST + list)
    }

    /// Returns the one answer of all starts.
    #[inline(always)]
    pub(crate) fn known(self) -> Option<bool> {
        (self.0 < Self::FIRST_LIST).then_some(self == Self::SHADOWED)
    }

    /// Returns where the list starts, in a cell without one answer.
    #[inline(always)]
    pub(crate) fn list(self) -> Option<usize> {
        (self != Self::UNKNOWN).then(|| self.0.wrapping_sub(Self::FIRST_LIST) as usize)
    }
}

/// A decided octree of one audience.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Decisions {
    Known(bool),
    /// There are no such starts.
    Nobody,
    /// The entries of a list.
    List(Box<[u32]>),
    Unknown,
    Split(Box<[Self; 8]>),
}

impl Decisions {
    /// Returns a cell of eight; one that needs no eight where they agree.
    pub(crate) fn of_children(children: Box<[Self; 8]>) -> Self {
        let mut agreed = Self::Nobody;
        for child in children.iter() {
            match (&agreed, child) {
                (_, Self::Nobody) => {}
                (Self::Nobody, Self::Known(_)) => agreed = child.clone(),
                (Self::Known(one), Self::Known(other)) if one == other => {}
                _ => return Self::Split(children),
            }
        }
        agreed
    }
}

/// Sixty-four cells.
#[derive(Clone, Copy, Debug, Default)]
struct Brick {
    values: Values64,
    /// The first brick under its complicated cells.
    finer: u32,
    /// The place of its first list.
    leaves: u32,
}

impl Brick {
    fn of_one_value(value: Occlusion) -> Self {
        let mut brick = Self::default();
        (0..64).for_each(|place| brick.values.set(place, value));
        brick
    }
}

/// The values of one audience for one light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bricks {
    /// The coarsest bricks by their place; those of one answer are shared.
    root: Vec<u16>,
    bricks: Vec<Brick>,
    leaves: Vec<Leaf>,
}

impl Bricks {
    /// Returns what finds leaves.
    #[inline(always)]
    pub(crate) fn finder(&self, lattice: &Lattice) -> Finder<'_> {
        Finder {
            root: &self.root,
            bricks: &self.bricks,
            leaves: &self.leaves,
            root_shift: lattice.root_shift(),
            brick_shift: lattice.coarsest_shift(),
        }
    }

    /// Returns the bytes of values and the index to lists.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = size_of_val(self.root.as_slice())
            + size_of_val(self.bricks.as_slice())
            + size_of_val(self.leaves.as_slice());
        bytes as u64
    }
}

/// Bricks at hand.
#[derive(Clone, Copy)]
pub(crate) struct Finder<'a> {
    root: &'a [u16],
    bricks: &'a [Brick],
    leaves: &'a [Leaf],
    root_shift: u32,
    brick_shift: u32,
}

impl Finder<'_> {
    /// Returns what is known where a code says.
    #[inline(always)]
    pub(crate) fn find(&self, code: Code) -> Leaf {
        let Some(&root) = self.root.get(code.place_in_root(self.root_shift)) else {
            return Leaf::UNKNOWN;
        };
        let mut brick = &self.bricks[usize::from(root)];
        let mut shift = self.brick_shift;
        loop {
            let place = code.place_in_brick(shift);
            match brick.values.get(place) {
                Occlusion::Null => return Leaf::LIT,
                Occlusion::Full => return Leaf::SHADOWED,
                Occlusion::Complicated => {
                    let finer = brick.finer + brick.values.complicated_before(place);
                    brick = &self.bricks[finer as usize];
                    shift -= 6;
                }
                Occlusion::Listed => {
                    let leaf = brick.leaves + brick.values.listed_before(place);
                    return self.leaves[leaf as usize];
                }
            }
        }
    }
}

/// The lists of all audiences of a light, each kept once.
#[derive(Debug, Default)]
pub(crate) struct ListPool {
    numbers: HashMap<Box<[u32]>, u32>,
    /// Each list: its length, then its entries.
    pub(crate) words: Vec<u32>,
}

impl ListPool {
    fn add(&mut self, list: Box<[u32]>) -> Leaf {
        let words = &mut self.words;
        let number = self.numbers.entry(list).or_insert_with_key(|list| {
            let number = words.len() as u32;
            words.push(list.len() as u32);
            words.extend_from_slice(list);
            number
        });
        Leaf::of_list(*number)
    }
}

/// The bricks that every audience has: everybody lit, everybody in shadow, nothing known.
const LIT_BRICK: u16 = 0;
const SHADOWED_BRICK: u16 = 1;
const UNKNOWN_BRICK: u16 = 2;

/// Packs the octrees under the coarsest bricks.
pub(crate) fn pack(
    lattice: &Lattice,
    octrees: impl Iterator<Item = (Cell, Decisions)>,
    lists: &mut ListPool,
) -> Bricks {
    let mut all = Bricks {
        root: vec![UNKNOWN_BRICK; lattice.root_places()],
        bricks: [Occlusion::Null, Occlusion::Full, Occlusion::Listed]
            .map(Brick::of_one_value)
            .into(),
        leaves: vec![Leaf::UNKNOWN; 64],
    };
    // Level after level: coarse bricks stay together, and so do those under one brick.
    let mut level: Vec<(usize, Decisions)> = Vec::new();
    for (cell, octree) in octrees {
        all.root[Code::place_of(cell.at)] = match octree {
            Decisions::Nobody | Decisions::Known(false) => LIT_BRICK,
            Decisions::Known(true) => SHADOWED_BRICK,
            Decisions::Unknown => UNKNOWN_BRICK,
            octree => {
                let number = all.bricks.len();
                level.push((number, octree));
                all.bricks.push(Brick::default());
                // 32^3 at most.
                number as u16
            }
        };
    }
    while !level.is_empty() {
        let mut next = Vec::new();
        for (number, octree) in level {
            let mut brick = Brick {
                finer: all.bricks.len() as u32,
                leaves: all.leaves.len() as u32,
                ..Brick::default()
            };
            let mut cells: [Decisions; 64] = [const { Decisions::Nobody }; 64];
            spread(octree, 4, [0; 3], &mut cells);
            for (place, cell) in (0..).zip(cells) {
                let value = match cell {
                    Decisions::Known(is_shadowed) => Occlusion::known(is_shadowed),
                    Decisions::Nobody => Occlusion::Null,
                    Decisions::Unknown => {
                        all.leaves.push(Leaf::UNKNOWN);
                        Occlusion::Listed
                    }
                    Decisions::List(list) => {
                        all.leaves.push(lists.add(list));
                        Occlusion::Listed
                    }
                    split @ Decisions::Split(_) => {
                        next.push((all.bricks.len(), split));
                        all.bricks.push(Brick::default());
                        Occlusion::Complicated
                    }
                };
                brick.values.set(place, value);
            }
            all.bricks[number] = brick;
        }
        level = next;
    }
    all.bricks.shrink_to_fit();
    all.leaves.shrink_to_fit();
    all
}

/// Spreads an octree over a cube of cells of a brick, `edge` of them along an axis.
fn spread(octree: Decisions, edge: usize, at: [usize; 3], cells: &mut [Decisions; 64]) {
    match octree {
        Decisions::Split(children) if edge > 1 => {
            let half = edge / 2;
            for (place, child) in children.into_iter().enumerate() {
                let at = std::array::from_fn(|axis| at[axis] + half * (place >> axis & 1));
                spread(child, half, at, cells);
            }
        }
        octree => {
            for z in at[2]..at[2] + edge {
                for y in at[1]..at[1] + edge {
                    for x in at[0]..at[0] + edge {
                        let place = Code::place_of([x, y, z].map(|at| at as u32));
                        cells[place] = octree.clone();
                    }
                }
            }
        }
    }
}
