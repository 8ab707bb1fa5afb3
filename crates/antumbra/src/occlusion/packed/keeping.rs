//! What is packed as words to be kept, and taken again; cell by cell for those who tell it otherwise.
//!
//! In: a [`Packed`], or words from anywhere. Out: runs of words, or a [`Packed`]. What the words mean is in
//! docs/formats.md: they are the tables as they are in memory. Invariant: whatever the words are, what comes of
//! them is as safe to read as what was packed here.

use std::borrow::Cow;

use super::super::lattice::{Code, Lattice};
use super::super::links::Link;
use super::super::stream::Misfit;
use super::super::value::ReceiverClass;
pub(crate) use super::runs::{RUNS, Runs};
use super::{Brick, Leaf, Packed, STRIDE, Whole};

const BRICK_WORDS: usize = size_of::<Brick>() / 4;

impl Packed {
    /// Returns the tables as words; none if more may still be made where there was no room, which is told cell
    /// by cell.
    pub(in super::super) fn runs(&self) -> Option<Runs<'_>> {
        let is_pending = |leaf: &Leaf| leaf.count() == 0 && leaf.unlisted().is_pending();
        (!self.leaves.iter().any(is_pending)).then(|| {
            let words = [
                &self.roots,
                bytemuck::cast_slice(&self.bricks),
                bytemuck::cast_slice(&self.leaves),
                &self.entries,
            ];
            words.map(Cow::Borrowed)
        })
    }

    /// Takes tables that were kept, of so many surfaces.
    ///
    /// # Errors
    /// The words are no such tables.
    pub(in super::super) fn of_runs(
        runs: Runs<'_>,
        lattices: &[Lattice; 3],
        surface_count: usize,
    ) -> Result<Self, Misfit> {
        let mut firsts = [0; RUNS];
        for number in 1..RUNS {
            firsts[number] = firsts[number - 1] + runs[number - 1].len();
        }
        let bad = |run: usize, word, what| Misfit::At(firsts[run] + word, what);
        let [roots, bricks, leaves, entries] = runs.map(Cow::into_owned);
        let (areas, place_count) = Self::areas(lattices);
        if roots.len() != place_count + Self::BEYOND.len() {
            return Err(bad(0, 0, "tables of another size"));
        }
        let packed = Self {
            roots: roots.into(),
            areas,
            bricks: cast(bricks).ok_or(bad(1, 0, "half a brick"))?,
            leaves: cast(leaves).ok_or(bad(2, 0, "half a leaf"))?,
            entries: entries.into(),
        };
        let is_bad = |&surface: &u32| surface as usize >= surface_count;
        if let Some(word) = packed.entries.iter().position(is_bad) {
            return Err(bad(3, word, "a surface that is not there"));
        }
        let is_bad = |&leaf: &Leaf| !packed.is_leaf(leaf);
        if let Some(word) = packed.leaves.iter().position(is_bad) {
            return Err(bad(2, word, "a list that is not there"));
        }
        let is_bad = |&root: &u32| root as usize >= packed.bricks.len();
        if let Some(word) = packed.roots.iter().position(is_bad) {
            return Err(bad(0, word, "a brick that is not there"));
        }
        match packed.bad_brick() {
            Some((brick, what)) => Err(bad(1, brick * BRICK_WORDS, what)),
            None => Ok(packed),
        }
    }

    /// Returns whether a leaf says something, and its list, if it has one, can be read in strides.
    fn is_leaf(&self, leaf: Leaf) -> bool {
        match leaf.count() {
            0 => [Leaf::RAY, Leaf::OUTSIDE, Leaf::DOUBT].contains(&leaf),
            count => leaf.first() + count.next_multiple_of(STRIDE) <= self.entries.len(),
        }
    }

    /// Returns the first brick that leads to none behind it or to no leaf, or deeper than codes tell.
    fn bad_brick(&self) -> Option<(usize, &'static str)> {
        // How many levels of bricks may lie below.
        let mut room = vec![u8::MAX; self.bricks.len()];
        let levels = self.areas.iter().map(|area| (area.brick_shift / 6) as u8);
        let fewest = levels.clone().min().unwrap_or(0);
        let mut first = 0;
        for (area, levels) in self.areas.iter().zip(levels) {
            let end = first + area.place_count as usize + 1;
            for &root in &self.roots[first..end] {
                room[root as usize] = levels.min(room[root as usize]);
            }
            first = end;
        }
        for &root in &self.roots[first..] {
            room[root as usize] = fewest.min(room[root as usize]);
        }
        for (number, brick) in self.bricks.iter().enumerate() {
            let (listed, finer) = (brick.high() & brick.low(), brick.high() & !brick.low());
            let [below, leaves] = [(0, finer), (1, listed)].map(|(kind, cells)| {
                let first = brick.next[kind] as usize;
                first..first.saturating_add(cells.count_ones() as usize)
            });
            if leaves.end > self.leaves.len() && !leaves.is_empty() {
                return Some((number, "a leaf that is not there"));
            }
            if below.is_empty() {
                continue;
            }
            if below.start <= number || below.end > self.bricks.len() {
                return Some((number, "a brick that is not there"));
            }
            let Some(left) = room[number].checked_sub(1) else {
                return Some((number, "a brick too fine"));
            };
            for room in &mut room[below] {
                *room = left.min(*room);
            }
        }
        None
    }

    /// Returns what is known of the coarsest bricks that hold a part of the scene's box, with numbers of
    /// bricks and leaves in place of places.
    pub(in super::super) fn roots(&self, lattice: &Lattice, class: ReceiverClass) -> Vec<Link> {
        let (area, reader) = (self.area(class), self.reader());
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
    pub(in super::super) fn brick(&self, number: usize) -> ([u32; 4], Vec<Link>) {
        let reader = self.reader();
        let brick = self.bricks[number];
        let (mut low, high) = (brick.low(), brick.high());
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
    pub(in super::super) fn list_of(&self, leaf: usize) -> &[u32] {
        self.list(self.leaves[leaf])
    }
}

/// Takes words as what they make; none if some are left.
fn cast<T: bytemuck::Pod>(words: Vec<u32>) -> Option<Box<[T]>> {
    bytemuck::allocation::try_cast_slice_box(words.into_boxed_slice()).ok()
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, DVec3};

    use super::*;
    use crate::accel::frame::Frame;

    fn lattices() -> [Lattice; 3] {
        let bounds = Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        };
        ReceiverClass::ALL.map(|_| Lattice::new(&bounds, &Frame::new(bounds), 11))
    }

    fn root_count() -> usize {
        Packed::areas(&lattices()).1 + Packed::BEYOND.len()
    }

    fn of_runs(runs: [Vec<u32>; RUNS]) -> Result<Packed, Misfit> {
        Packed::of_runs(runs.map(Cow::Owned), &lattices(), 2)
    }

    /// Takes bricks, leaves and entries over two surfaces; all roots lead to the first brick.
    fn take(bricks: &[[u32; 6]], leaves: &[u32], entries: &[u32]) -> Result<Packed, Misfit> {
        let roots = vec![0; root_count()];
        let bricks = bricks.as_flattened().to_vec();
        of_runs([roots, bricks, leaves.to_vec(), entries.to_vec()])
    }

    fn what(taken: Result<Packed, Misfit>) -> &'static str {
        match taken {
            Err(Misfit::At(_, what)) => what,
            other => panic!("{other:?}"),
        }
    }

    /// A brick one cell of which leads to another brick.
    fn over(next: u32) -> [u32; 6] {
        [0, 0, 0, 1 << 31, next, 0]
    }

    /// A brick two cells of which have leaves.
    fn listed(first: u32) -> [u32; 6] {
        [3, 0, 3, 0, 0, first]
    }

    const LIT: [u32; 6] = [0; 6];

    #[test]
    fn tables_that_lead_nowhere_are_refused() {
        let entries = [1; STRIDE];
        let lists = [1, STRIDE as u32];
        assert!(take(&[LIT], &[], &[]).is_ok());
        assert!(take(&[over(1), LIT], &[], &[]).is_ok());
        assert!(take(&[listed(0)], &lists, &entries).is_ok());
        assert_eq!(what(take(&[], &[], &[])), "a brick that is not there");
        for next in [0, 2, u32::MAX] {
            let taken = take(&[over(next), LIT], &[], &[]);
            assert_eq!(what(taken), "a brick that is not there");
        }
        for first in [1, 2, u32::MAX] {
            let taken = take(&[listed(first)], &lists, &entries);
            assert_eq!(what(taken), "a leaf that is not there");
        }
        for leaf in [1 << 6 | 1, STRIDE as u32 + 1, 3 << 6, u32::MAX] {
            let taken = take(&[listed(0)], &[leaf, 1], &entries);
            assert_eq!(what(taken), "a list that is not there");
        }
        let taken = take(&[LIT], &[], &[0, 2]);
        assert_eq!(what(taken), "a surface that is not there");
        let roots = || vec![0; root_count()];
        let taken = of_runs([roots()[1..].to_vec(), LIT.to_vec(), vec![], vec![]]);
        assert_eq!(what(taken), "tables of another size");
        let taken = of_runs([roots(), vec![0; 7], vec![], vec![]]);
        assert_eq!(what(taken), "half a brick");
    }

    #[test]
    fn bricks_go_no_deeper_than_codes_tell() {
        let chain = |length: u32| {
            let bricks = (1..length).map(over).chain([LIT]);
            take(&bricks.collect::<Vec<_>>(), &[], &[])
        };
        let levels = lattices()[0].coarsest_shift() / 6;
        assert!((1..=levels + 1).all(|length| chain(length).is_ok()));
        assert_eq!(what(chain(levels + 2)), "a brick too fine");
    }
}
