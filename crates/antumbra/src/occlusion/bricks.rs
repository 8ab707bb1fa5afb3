//! Values in bricks of 4^3 cells, finer bricks under cells that need them.
//!
//! In: octrees of decided cells. Out: [`Leaf`] for a finest cell. A brick keeps two bits a cell, and says
//! where the finer bricks of its complicated cells and the lists of its listed cells lie, in the order of
//! the cells. Bricks of one level lie together.

use std::collections::HashMap;

use super::lattice::Lattice;
use super::value::{Occlusion, Values64};

/// What is known at a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leaf {
    /// All starts have this answer.
    Known(bool),
    /// Only the blockers of a list matter.
    List(ListId),
    /// Ask a ray.
    Unknown,
}

/// Names a list of blockers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ListId(pub(crate) u32);

impl ListId {
    /// No list: too many surfaces may block.
    const NONE: Self = Self(u32::MAX);
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
    lists: u32,
}

/// The values of one audience for one light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bricks {
    bricks: Vec<Brick>,
    lists: Vec<ListId>,
}

impl Bricks {
    /// Returns what is known at a finest cell of the lattice.
    #[inline(always)]
    pub(crate) fn find(&self, lattice: &Lattice, finest: [u32; 3]) -> Leaf {
        let mut brick = &self.bricks[lattice.root_brick(finest)];
        let mut level = 0;
        loop {
            let place = lattice.place_in_brick(finest, level);
            match brick.values.get(place) {
                Occlusion::Null => return Leaf::Known(false),
                Occlusion::Full => return Leaf::Known(true),
                Occlusion::Complicated => {
                    let finer = brick.finer + brick.values.complicated_before(place);
                    brick = &self.bricks[finer as usize];
                    level += 1;
                }
                Occlusion::Listed => {
                    let list = brick.lists + brick.values.listed_before(place);
                    return match self.lists[list as usize] {
                        ListId::NONE => Leaf::Unknown,
                        list => Leaf::List(list),
                    };
                }
            }
        }
    }

    /// Returns the bytes of values and the index to lists.
    pub(crate) fn bytes(&self) -> u64 {
        (size_of_val(self.bricks.as_slice()) + size_of_val(self.lists.as_slice())) as u64
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
    fn add(&mut self, list: Box<[u32]>) -> ListId {
        let words = &mut self.words;
        let number = self.numbers.entry(list).or_insert_with_key(|list| {
            let number = words.len() as u32;
            words.push(list.len() as u32);
            words.extend_from_slice(list);
            number
        });
        ListId(*number)
    }
}

/// Packs the octrees under the coarsest bricks, one after the other.
pub(crate) fn pack(octrees: Vec<Decisions>, lists: &mut ListPool) -> Bricks {
    let mut all = Bricks {
        bricks: vec![Brick::default(); octrees.len()],
        lists: Vec::new(),
    };
    // Level after level: coarse bricks stay together, and so do those under one brick.
    let mut level: Vec<(usize, Decisions)> = octrees.into_iter().enumerate().collect();
    while !level.is_empty() {
        let mut next = Vec::new();
        for (number, octree) in level {
            let mut brick = Brick {
                finer: all.bricks.len() as u32,
                lists: all.lists.len() as u32,
                ..Brick::default()
            };
            let mut cells: [Decisions; 64] = [const { Decisions::Nobody }; 64];
            spread(octree, 4, [0; 3], &mut cells);
            for (place, cell) in (0..).zip(cells) {
                let value = match cell {
                    Decisions::Known(is_shadowed) => Occlusion::known(is_shadowed),
                    Decisions::Nobody => Occlusion::Null,
                    Decisions::Unknown => {
                        all.lists.push(ListId::NONE);
                        Occlusion::Listed
                    }
                    Decisions::List(list) => {
                        all.lists.push(lists.add(list));
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
    all.lists.shrink_to_fit();
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
                        cells[z << 4 | y << 2 | x] = octree.clone();
                    }
                }
            }
        }
    }
}
