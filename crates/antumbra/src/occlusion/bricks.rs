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

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use antumbra_geometry::{Bounds, DVec3};
    use fearless_simd::{Level, dispatch};

    use super::super::refine::cut_out;
    use super::super::testing::Random;
    use super::*;
    use crate::frame::Frame;

    /// An octree that is halved `deepest` times at most, at any level.
    fn octree(deepest: u32, random: &mut Random) -> Decisions {
        let is_split = deepest > 0 && random.below(100) < if deepest > 5 { 70 } else { 30 };
        if is_split {
            let children = std::array::from_fn(|_| octree(deepest - 1, random));
            return Decisions::Split(Box::new(children));
        }
        match random.below(5) {
            0 => Decisions::Known(false),
            1 => Decisions::Known(true),
            2 => Decisions::Nobody,
            3 => Decisions::Unknown,
            _ => {
                // Few enough that lists meet again.
                let length = 1 + random.below(3);
                Decisions::List((0..length).map(|_| random.below(4) as u32).collect())
            }
        }
    }

    fn lists_in(octree: &Decisions, found: &mut HashSet<Box<[u32]>>) {
        match octree {
            Decisions::Split(children) => children.iter().for_each(|c| lists_in(c, found)),
            Decisions::List(list) => {
                found.insert(list.clone());
            }
            _ => {}
        }
    }

    /// What the octree says of the cell of a level whose number along an axis is `at`.
    fn decision(octree: &Decisions, at: [u32; 3], level: u32) -> &Decisions {
        let mut here = octree;
        for bit in (0..level).rev() {
            let Decisions::Split(children) = here else {
                break;
            };
            let place = (0..3).fold(0, |place, axis| place | (at[axis] >> bit & 1) << axis);
            here = &children[place as usize];
        }
        here
    }

    #[test]
    fn bricks_give_back_what_octrees_say() {
        let random = &mut Random(1);
        let mut asked = [0; 5];
        for round in 0..60 {
            // A cube, and boxes that fill their octree only partly; cells of one, two and three bricks.
            let finest = [2, 3, 4, 5, 6, 8][round % 6];
            let half = DVec3::new(
                1.0,
                random.pick(&[1.0, 0.4, 0.01]),
                random.pick(&[1.0, 0.7]),
            );
            let scene = Bounds {
                min: -half,
                max: half,
            };
            let frame = Frame::new(scene);
            let lattice = Lattice::new(&scene, &frame, finest);
            // Two audiences share their lists.
            let octrees = [(); 2].map(|()| octree(finest, random));
            let mut pool = ListPool::default();
            let stores = octrees
                .each_ref()
                .map(|octree| pack(&lattice, cut_out(octree, &lattice), &mut pool));
            for (octree, bricks) in octrees.iter().zip(&stores) {
                let finder = bricks.finder(&lattice);
                for _ in 0..400 {
                    let x = frame.point_in_frame(random.in_box(&scene)).to_array();
                    let x = x.map(|x| x as f32);
                    let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
                    let at = cell_at(code, finest);
                    let leaf = finder.find(code);
                    match decision(octree, at, finest) {
                        Decisions::Known(is_shadowed) => {
                            assert_eq!(leaf.known(), Some(*is_shadowed));
                            asked[usize::from(*is_shadowed)] += 1;
                        }
                        Decisions::Nobody => {
                            // Any answer will do, but no ray.
                            assert!(leaf.known().is_some());
                            asked[2] += 1;
                        }
                        Decisions::Unknown => {
                            assert_eq!((leaf.known(), leaf.list()), (None, None));
                            asked[3] += 1;
                        }
                        Decisions::List(list) => {
                            assert_eq!(leaf.known(), None);
                            let at = leaf.list().expect("a list");
                            let length = pool.words[at] as usize;
                            assert_eq!(pool.words[at + 1..][..length], list[..]);
                            asked[4] += 1;
                        }
                        Decisions::Split(_) => panic!("finer than the finest"),
                    }
                }
            }
            // Each list once; none of parts that no point of the scene is in.
            let mut expected = HashSet::new();
            octrees
                .iter()
                .for_each(|octree| lists_in(octree, &mut expected));
            let words: usize = expected.iter().map(|list| 1 + list.len()).sum();
            let is_whole = half == DVec3::ONE;
            assert!(pool.words.len() <= words);
            assert!(!is_whole || pool.words.len() == words);
        }
        assert!(asked.iter().all(|&count| count > 1000), "{asked:?}");
    }

    /// The cell of a level that a code names, which the tests of `lattice` check.
    fn cell_at(code: Code, level: u32) -> [u32; 3] {
        // Sixteen halvings: 48 bits.
        let bit = |axis: usize, bit: u32| {
            let shift = 3 * (15 - bit);
            (code.place_in_brick(shift) >> axis & 1) << (level - 1 - bit)
        };
        std::array::from_fn(|axis| (0..level).fold(0, |at, b| at | bit(axis, b)))
    }

    #[test]
    fn cells_that_agree_are_one() {
        let eight = |some: fn(usize) -> Decisions| {
            Decisions::of_children(Box::new(std::array::from_fn(some)))
        };
        let known = Decisions::Known;
        let nobody = Decisions::Nobody;
        assert_eq!(eight(|_| Decisions::Nobody), nobody);
        assert_eq!(eight(|_| Decisions::Known(true)), known(true));
        // Nobody asks in the others.
        let mixed = eight(|place| match place {
            2 | 5 => Decisions::Known(true),
            _ => Decisions::Nobody,
        });
        assert_eq!(mixed, known(true));
        for differing in [
            eight(|place| Decisions::Known(place == 7)),
            eight(|place| match place {
                0 => Decisions::Unknown,
                _ => Decisions::Known(false),
            }),
            // Lists stay with the cells that they were made for.
            eight(|_| Decisions::List(Box::new([3]))),
        ] {
            assert!(matches!(differing, Decisions::Split(_)), "{differing:?}");
        }
    }

    #[test]
    fn what_is_not_packed_is_unknown() {
        let scene = Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        };
        let frame = Frame::new(scene);
        let lattice = Lattice::new(&scene, &frame, 5);
        let bricks = pack(&lattice, std::iter::empty(), &mut ListPool::default());
        for x in [[0.0; 3], [0.4; 3], [-3.0; 3], [f32::NAN; 3]] {
            let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
            assert_eq!(bricks.finder(&lattice).find(code), Leaf::UNKNOWN);
        }
    }
}
