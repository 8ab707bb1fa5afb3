//! Values in bricks of 4^3 cells, finer bricks under cells that need them.
//!
//! In: one octree of decided cells. Out: [`Leaf`] for a finest cell. A brick keeps two bits a cell, and
//! a link only for cells that have one. Bricks of one level lie together.

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

/// A decided octree of one audience.
#[derive(Clone, Debug)]
pub(crate) enum Decisions {
    Known(bool),
    /// The entries of a list.
    List(Box<[u32]>),
    Unknown,
    Split(Box<[Self; 8]>),
}

/// Sixty-four cells.
#[derive(Clone, Copy, Debug, Default)]
struct Brick {
    values: Values64,
    /// Where its links start.
    links: u32,
}

/// A finer brick or a list.
#[derive(Clone, Copy, Debug)]
struct Link(u32);

impl Link {
    const LIST: u32 = 1 << 31;
}

/// The values of one audience for one light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bricks {
    bricks: Vec<Brick>,
    links: Vec<Link>,
}

impl Bricks {
    /// Returns what is known at a finest cell of the lattice.
    #[inline]
    pub(crate) fn find(&self, lattice: &Lattice, finest: [u32; 3]) -> Leaf {
        let mut brick = lattice.root_brick(finest);
        let mut level = 0;
        loop {
            let place = lattice.place_in_brick(finest, level);
            let here = &self.bricks[brick];
            match here.values.get(place) {
                Occlusion::Null => return Leaf::Known(false),
                Occlusion::Full => return Leaf::Known(true),
                Occlusion::Complicated => return Leaf::Unknown,
                Occlusion::Linked => {
                    let link = self.links[(here.links + here.values.links_before(place)) as usize];
                    if link.0 & Link::LIST != 0 {
                        return Leaf::List(ListId(link.0 & !Link::LIST));
                    }
                    brick = link.0 as usize;
                    level += 1;
                }
            }
        }
    }

    /// Returns the bytes of values and links.
    pub(crate) fn bytes(&self) -> u64 {
        (size_of_val(self.bricks.as_slice()) + size_of_val(self.links.as_slice())) as u64
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
    fn add(&mut self, list: Box<[u32]>) -> u32 {
        let words = &mut self.words;
        *self.numbers.entry(list).or_insert_with_key(|list| {
            let number = words.len() as u32;
            words.push(list.len() as u32);
            words.extend_from_slice(list);
            number
        })
    }
}

/// Packs the octrees under the coarsest bricks, one after the other.
pub(crate) fn pack(octrees: Vec<Decisions>, lists: &mut ListPool) -> Bricks {
    let mut all = Bricks {
        bricks: vec![Brick::default(); octrees.len()],
        links: Vec::new(),
    };
    // Level after level, so that the coarse bricks stay together.
    let mut level: Vec<(usize, Decisions)> = octrees.into_iter().enumerate().collect();
    while !level.is_empty() {
        let mut next = Vec::new();
        for (number, octree) in level {
            let links = all.links.len() as u32;
            let mut values = Values64::default();
            let mut cells: [Option<Decisions>; 64] = [const { None }; 64];
            spread(octree, 4, [0; 3], &mut cells);
            for (place, cell) in (0..).zip(cells) {
                let (value, link) = match cell {
                    Some(Decisions::Known(is_shadowed)) => (Occlusion::known(is_shadowed), None),
                    None | Some(Decisions::Unknown) => (Occlusion::Complicated, None),
                    Some(Decisions::List(list)) => {
                        (Occlusion::Linked, Some(Link(lists.add(list) | Link::LIST)))
                    }
                    Some(split @ Decisions::Split(_)) => {
                        let finer = all.bricks.len();
                        all.bricks.push(Brick::default());
                        next.push((finer, split));
                        (Occlusion::Linked, Some(Link(finer as u32)))
                    }
                };
                values.set(place, value);
                all.links.extend(link);
            }
            all.bricks[number] = Brick { values, links };
        }
        level = next;
    }
    all.bricks.shrink_to_fit();
    all.links.shrink_to_fit();
    all
}

/// Spreads an octree over a cube of cells of a brick, `edge` of them along an axis.
fn spread(octree: Decisions, edge: usize, at: [usize; 3], cells: &mut [Option<Decisions>; 64]) {
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
                        cells[z << 4 | y << 2 | x] = Some(octree.clone());
                    }
                }
            }
        }
    }
}
