//! Values in bricks of 4^3 cells, finer bricks under cells that need them.
//!
//! In: what was decided for the 64 cells of a brick. Out: what is known where a [`Code`] says. A brick keeps two
//! bits a cell in two planes, then a [`Link`] for each cell that has no answer, in the order of the cells. A
//! root table of links finds the coarsest bricks. All lies in one [`Arena`].

use std::sync::atomic::AtomicU64;

use super::arena::Arena;
use super::forms::EightForms;
use super::lattice::{Cell, Code, Lattice};
use super::links::{Link, read};
use super::sync::{AtomicU32, Ordering};
use super::value::{Audience, Occlusion, Values64};

/// What was decided for a cell and an audience.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    Known(bool),
    /// There are no such starts.
    Nobody,
    /// The entries of a list, and whether finer cells may take its place.
    List(Box<[u32]>, Finer),
    /// Rays answer.
    Ray,
    /// Finer cells may say more.
    Pending,
}

/// Whether finer cells may take the place of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finer {
    Perhaps,
    Never,
}

/// The cells of a brick.
pub(crate) type Decisions = [Decision; 64];

/// Words of a brick before its links.
pub(super) const PLANES: usize = 4;
/// Words of a list before its entries: their number, what its use has cost, and where their forms are.
const LIST_HEAD: usize = 3;
/// In place of a number of forms.
const NO_FORMS: u32 = u32::MAX;

/// The values and lists of all lights, as far as they are made.
#[derive(Debug)]
pub(crate) struct Store {
    arena: Arena,
    /// Where the root tables lie, for each light and audience.
    roots: Vec<[u32; 3]>,
    /// The forms of lists that want them side by side.
    forms: boxcar::Vec<Box<[EightForms]>>,
    list_words: AtomicU64,
}

/// A list at hand.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    /// The surfaces that may block.
    pub(crate) surfaces: &'a [AtomicU32],
    /// Their forms, eight at a time, if they are kept with the list.
    pub(crate) forms: Option<&'a [EightForms]>,
}

impl List<'_> {
    /// Returns the surfaces.
    pub(crate) fn surfaces(&self) -> Box<[u32]> {
        let surfaces = self.surfaces.iter();
        surfaces
            .map(|surface| surface.load(Ordering::Relaxed))
            .collect()
    }
}

impl Store {
    /// Makes a store in which nothing is known, of at most so many bytes; `None` if these do not hold the
    /// root tables. Refining a cell at the root has a price.
    pub(crate) fn new(
        bytes: u64,
        lattices: &[Lattice; 3],
        light_count: usize,
        price: u32,
    ) -> Option<Self> {
        let arena = Arena::new(bytes);
        let roots = (0..light_count)
            .map(|_| {
                let mut places = [0; 3];
                for (place, lattice) in places.iter_mut().zip(lattices) {
                    let count = lattice.root_places();
                    *place = arena.take(count)?;
                    // Some lie beside a flat scene.
                    arena.write(*place, std::iter::repeat_n(Link::OUTSIDE.0, count));
                    for brick in lattice.root_bricks() {
                        let at = *place + Code::place_of(brick.at) as u32;
                        arena.publish(at, Link::pending(price));
                    }
                }
                Some(places)
            })
            .collect::<Option<_>>()?;
        Some(Self {
            arena,
            roots,
            forms: boxcar::Vec::new(),
            list_words: AtomicU64::new(0),
        })
    }

    /// Returns what finds links.
    #[inline(always)]
    pub(crate) fn finder(&self, light: usize, audience: Audience, lattice: &Lattice) -> Finder<'_> {
        Finder {
            words: self.arena.words(),
            root: self.roots[light][audience as usize] as usize,
            root_places: lattice.root_places(),
            root_shift: lattice.root_shift(),
            brick_shift: lattice.coarsest_shift(),
        }
    }

    /// Returns where a root table starts.
    pub(crate) fn root(&self, light: usize, audience: Audience) -> u32 {
        self.roots[light][audience as usize]
    }

    /// Returns what is known at a link.
    pub(crate) fn link(&self, place: u32) -> Link {
        read(self.word(place))
    }

    /// Returns what is known of the 64 cells of a brick.
    pub(crate) fn cells(&self, brick: usize) -> [Link; 64] {
        let words = &self.arena.words()[brick..];
        std::array::from_fn(|number| {
            let (value, before) = value_of(words, number as u32);
            match value.of_surface_point() {
                Some(is_shadowed) => Link::known(is_shadowed),
                None => read(&words[PLANES + before]),
            }
        })
    }

    pub(crate) fn word(&self, place: u32) -> &AtomicU32 {
        &self.arena.words()[place as usize]
    }

    /// Returns a list.
    #[inline(always)]
    pub(crate) fn list(&self, place: usize) -> List<'_> {
        let words = &self.arena.words()[place..];
        let word = |at: usize| words[at].load(Ordering::Relaxed);
        let length = word(0) as usize;
        List {
            surfaces: &words[LIST_HEAD..LIST_HEAD + length],
            forms: match word(2) {
                NO_FORMS => None,
                number => self.forms.get(number as usize).map(|forms| &**forms),
            },
        }
    }

    /// Returns the place of the word that counts what using a list has cost.
    pub(crate) fn list_counter(place: usize) -> u32 {
        place as u32 + 1
    }

    /// Writes the cells of a brick; finer cells of each have a price, and `forms_of` may want the forms of a
    /// list's surfaces beside it. Returns the link to it, `None` if there is no more room.
    pub(crate) fn write(
        &self,
        cells: &Decisions,
        price: u32,
        forms_of: impl Fn(&[u32]) -> Option<Box<[EightForms]>>,
    ) -> Option<Link> {
        if let Some(link) = agreed(cells) {
            return Some(link);
        }
        let mut values = Values64::default();
        let mut links = Vec::with_capacity(64);
        let mut lists: Vec<(&[u32], Finer, u32)> = Vec::new();
        for (place, cell) in cells.iter().enumerate() {
            let (value, link) = match cell {
                Decision::Nobody => (Occlusion::Null, None),
                Decision::Known(is_shadowed) => (Occlusion::known(*is_shadowed), None),
                Decision::Ray => (Occlusion::Listed, Some(Link::RAY)),
                Decision::Pending => (Occlusion::Complicated, Some(Link::pending(price))),
                Decision::List(entries, finer) => {
                    let is_same =
                        |list: &&(&[u32], Finer, u32)| (list.0, list.1) == (entries, *finer);
                    let at = match lists.iter().find(is_same) {
                        Some(&(_, _, at)) => at,
                        None => {
                            let at = self.write_list(entries, *finer, price, &forms_of)?;
                            lists.push((entries, *finer, at));
                            at
                        }
                    };
                    let value = match finer {
                        Finer::Perhaps => Occlusion::Complicated,
                        Finer::Never => Occlusion::Listed,
                    };
                    (value, Some(Link::to_list(at)))
                }
            };
            values.set(place as u32, value);
            links.extend(link.map(|link| link.0));
        }
        let place = self.arena.take(PLANES + links.len())?;
        self.arena
            .write(place, values.words().into_iter().chain(links));
        Some(Link::to_brick(place))
    }

    /// Writes what was decided for one cell; finer cells have a price. `None` if there is no more room.
    pub(crate) fn write_one(
        &self,
        decision: &Decision,
        price: u32,
        forms_of: impl Fn(&[u32]) -> Option<Box<[EightForms]>>,
    ) -> Option<Link> {
        Some(match decision {
            Decision::Nobody => Link::LIT,
            Decision::Known(is_shadowed) => Link::known(*is_shadowed),
            Decision::Ray => Link::RAY,
            Decision::Pending => Link::pending(price),
            Decision::List(entries, finer) => {
                Link::to_list(self.write_list(entries, *finer, price, forms_of)?)
            }
        })
    }

    fn write_list(
        &self,
        entries: &[u32],
        finer: Finer,
        price: u32,
        forms_of: impl Fn(&[u32]) -> Option<Box<[EightForms]>>,
    ) -> Option<u32> {
        let counter = match finer {
            Finer::Perhaps => Link::pending(price),
            Finer::Never => Link::RAY,
        };
        self.put_list(entries, counter, forms_of(entries))
    }

    /// Writes a list as it is; returns its place, `None` if there is no more room.
    pub(super) fn put_list(
        &self,
        entries: &[u32],
        counter: Link,
        forms: Option<Box<[EightForms]>>,
    ) -> Option<u32> {
        let count = LIST_HEAD + entries.len();
        let place = self.arena.take(count)?;
        let mut taken = count.next_multiple_of(4);
        let number = match forms {
            Some(forms) => {
                // They lie elsewhere, and count here.
                let words = size_of_val(&*forms) / 4;
                self.arena.take(words)?;
                taken += words;
                self.forms.push(forms) as u32
            }
            None => NO_FORMS,
        };
        let head = [entries.len() as u32, counter.0, number];
        self.arena
            .write(place, head.into_iter().chain(entries.iter().copied()));
        self.list_words.fetch_add(taken as u64, Ordering::Relaxed);
        Some(place)
    }

    pub(crate) fn publish(&self, place: u32, known: Link) {
        self.arena.publish(place, known);
    }

    /// Takes room for a brick of so many links; `None` if there is no more.
    pub(super) fn take_brick(&self, link_count: usize) -> Option<u32> {
        self.arena.take(PLANES + link_count)
    }

    /// Writes a brick as it is, where room was taken and no link leads to yet.
    pub(super) fn put_brick(&self, place: u32, planes: [u32; PLANES], links: &[Link]) {
        let links = links.iter().map(|link| link.0);
        self.arena.write(place, planes.into_iter().chain(links));
    }

    /// Returns a brick's planes and what its links say.
    pub(super) fn brick(&self, place: usize) -> ([u32; PLANES], impl Iterator<Item = Link>) {
        let words = &self.arena.words()[place..];
        let planes = std::array::from_fn(|word| words[word].load(Ordering::Relaxed));
        let links = &words[PLANES..PLANES + Values64::undecided(&planes)];
        (planes, links.iter().map(read))
    }

    /// Returns the places and numbers of a brick's links whose cells may have finer ones.
    pub(crate) fn unfinished(&self, brick: usize) -> Vec<(u32, u32)> {
        let mut links = Vec::new();
        for number in 0..64 {
            let (value, before) = value_of(&self.arena.words()[brick..], number);
            if value == Occlusion::Complicated {
                links.push(((brick + PLANES + before) as u32, number));
            }
        }
        links
    }

    /// Returns the bytes of values and links, and those of lists.
    pub(crate) fn bytes(&self) -> (u64, u64) {
        let lists = 4 * self.list_words.load(Ordering::Relaxed);
        (self.arena.bytes().saturating_sub(lists), lists)
    }
}

/// Returns the one link that does for all cells of a brick, if they agree.
fn agreed(cells: &Decisions) -> Option<Link> {
    let mut agreed = None;
    for cell in cells {
        let link = match cell {
            Decision::Nobody => continue,
            Decision::Known(is_shadowed) => Link::known(*is_shadowed),
            Decision::Ray => Link::RAY,
            Decision::List(..) | Decision::Pending => return None,
        };
        if *agreed.get_or_insert(link) != link {
            return None;
        }
    }
    Some(agreed.unwrap_or(Link::LIT))
}

/// A store's bricks for one light and audience, at hand.
#[derive(Clone, Copy)]
pub(crate) struct Finder<'a> {
    words: &'a [AtomicU32],
    root: usize,
    root_places: usize,
    root_shift: u32,
    brick_shift: u32,
}

/// What is known at a start's cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaf {
    pub(crate) link: Link,
    /// Where the link stands; 0 where its brick has the answer itself.
    pub(crate) place: u32,
}

impl Leaf {
    pub(crate) const OUTSIDE: Self = Self {
        link: Link::OUTSIDE,
        place: 0,
    };

    #[inline(always)]
    pub(crate) fn of(is_shadowed: bool) -> Self {
        Self {
            link: Link::known(is_shadowed),
            place: 0,
        }
    }
}

impl Finder<'_> {
    /// Returns what is known where a code says.
    #[inline(always)]
    pub(crate) fn find(&self, code: Code) -> Leaf {
        let place = code.place_in_root(self.root_shift);
        if place >= self.root_places {
            return Leaf::OUTSIDE;
        }
        let mut place = self.root + place;
        let mut link = read(&self.words[place]);
        let mut shift = self.brick_shift;
        while let Some(brick) = link.brick() {
            let number = code.place_in_brick(shift);
            let (value, before) = value_of(&self.words[brick..], number);
            if let Some(is_shadowed) = value.of_surface_point() {
                return Leaf::of(is_shadowed);
            }
            place = brick + PLANES + before;
            link = read(&self.words[place]);
            shift = shift.wrapping_sub(6);
        }
        Leaf {
            link,
            place: place as u32,
        }
    }

    /// Returns where the link of one of the coarsest bricks stands.
    pub(crate) fn place_in_root(&self, brick: Cell) -> u32 {
        (self.root + Code::place_of(brick.at)) as u32
    }

    /// Returns the level of the cell that a leaf is for, of a start that a code tells.
    pub(crate) fn level_of(&self, code: Code, lattice: &Lattice) -> u32 {
        let place = self.root + code.place_in_root(self.root_shift);
        let mut level = lattice.root_level;
        let mut link = read(&self.words[place]);
        let mut shift = self.brick_shift;
        while let Some(brick) = link.brick() {
            level += 2;
            let number = code.place_in_brick(shift);
            let (value, before) = value_of(&self.words[brick..], number);
            if value.of_surface_point().is_some() {
                break;
            }
            link = read(&self.words[brick + PLANES + before]);
            shift = shift.wrapping_sub(6);
        }
        level
    }
}

/// Returns the value of a cell of the brick whose words these are, and how many links there are before its.
#[inline(always)]
fn value_of(brick: &[AtomicU32], number: u32) -> (Occlusion, usize) {
    let planes = &brick[..PLANES];
    Values64::read(number, |word| planes[word].load(Ordering::Relaxed))
}

/// Returns a cell of a brick's from its number.
pub(crate) fn cell_in_brick(brick: Cell, number: u32) -> Cell {
    Cell {
        level: brick.level + 2,
        at: std::array::from_fn(|axis| {
            let low = number >> axis & 1;
            let high = number >> (3 + axis) & 1;
            4 * brick.at[axis] + 2 * high + low
        }),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use fearless_simd::{Level, dispatch};

    use super::super::testing::Random;
    use super::*;
    use crate::frame::Frame;

    const ROOT_PRICE: u32 = 3;
    const PRICE: u32 = 5;
    const ROOM: u64 = 32 << 20;

    /// What was written in place of cells.
    type Written = HashMap<(u32, [u32; 3]), Box<Decisions>>;

    fn list(random: &mut Random) -> Decision {
        let first = random.below(3) as u32;
        let entries = (first..first + 1 + random.below(4) as u32).collect();
        Decision::List(entries, random.pick(&[Finer::Perhaps, Finer::Never]))
    }

    /// A brick's cells: of every kind, or of so few that they may agree.
    fn decisions(random: &mut Random) -> Box<Decisions> {
        let known = Decision::Known(random.below(2) == 0);
        let kinds = match random.below(8) {
            0 => vec![Decision::Nobody, known],
            1 => vec![Decision::Nobody, Decision::Ray],
            2 => vec![Decision::Nobody],
            3 => vec![known, Decision::Ray],
            _ => vec![
                Decision::Nobody,
                Decision::Known(false),
                Decision::Known(true),
                Decision::Ray,
                Decision::Pending,
                Decision::Pending,
                list(random),
                list(random),
                list(random),
            ],
        };
        Box::new(std::array::from_fn(|_| {
            kinds[random.below(kinds.len())].clone()
        }))
    }

    fn may_be_finer(decision: &Decision) -> bool {
        matches!(
            decision,
            Decision::Pending | Decision::List(_, Finer::Perhaps)
        )
    }

    /// Writes bricks in place of a cell and of some that are finer.
    fn write_below(
        store: &Store,
        random: &mut Random,
        finest: u32,
        (cell, place): (Cell, u32),
        written: &mut Written,
    ) {
        let decisions = decisions(random);
        let link = store.write(&decisions, PRICE, |_| None).expect("room");
        store.publish(place, link);
        if let Some(brick) = link.brick() {
            let unfinished = store.unfinished(brick);
            let numbers: Vec<u32> = unfinished.iter().map(|&(_, number)| number).collect();
            let expected: Vec<u32> = (0..64)
                .filter(|&number| may_be_finer(&decisions[number as usize]))
                .collect();
            assert_eq!(numbers, expected);
            for (place, number) in unfinished {
                let finer = cell_in_brick(cell, number);
                if finer.level < finest && random.below(12) == 0 {
                    write_below(store, random, finest, (finer, place), written);
                }
            }
        }
        written.insert((cell.level, cell.at), decisions);
    }

    /// Goes down what was written to a code; returns what must be found and the level of its cell.
    fn expected(written: &Written, lattice: &Lattice, code: Code) -> (Decision, u32) {
        let mut cell = code.cell(lattice.root_level);
        let mut found = None;
        while let Some(cells) = written.get(&(cell.level, cell.at)) {
            if let Some(link) = agreed(cells) {
                let decision = match link.answer() {
                    Some(is_shadowed) => Decision::Known(is_shadowed),
                    None => Decision::Ray,
                };
                return (decision, cell.level);
            }
            cell = code.cell(cell.level + 2);
            let number = Code::place_of(cell.at.map(|at| at & 3));
            found = Some(cells[number].clone());
        }
        // Nothing was written.
        (found.unwrap_or(Decision::Pending), cell.level)
    }

    fn assert_says(store: &Store, link: Link, expected: &Decision, price: u32) {
        match expected {
            Decision::Nobody => assert_eq!(link, Link::LIT),
            Decision::Known(is_shadowed) => assert_eq!(link, Link::known(*is_shadowed)),
            Decision::Ray => assert_eq!(link, Link::RAY),
            Decision::Pending => assert_eq!(link, Link::pending(price)),
            Decision::List(entries, finer) => {
                let place = link.list().expect("a list");
                let words = store.list(place).surfaces.iter();
                let found: Vec<u32> = words.map(|word| word.load(Ordering::Relaxed)).collect();
                assert_eq!(found[..], entries[..]);
                let counter = read(store.word(Store::list_counter(place)));
                assert_eq!(counter.is_pending(), *finer == Finer::Perhaps);
            }
        }
    }

    fn assert_found(store: &Store, leaf: Leaf, expected: &Decision, price: u32) {
        let link = leaf.link;
        assert_says(store, link, expected, price);
        if leaf.place == 0 {
            assert!(link.answer().is_some(), "{leaf:?}");
        } else {
            assert_eq!(read(store.word(leaf.place)), link);
        }
    }

    #[test]
    fn what_is_written_is_found() {
        let random = &mut Random(1);
        let (mut found_count, mut deepest, mut kinds) = (0, 0, [0; 5]);
        for _ in 0..40 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let finest: [u32; 3] = std::array::from_fn(|_| 2 + random.below(11) as u32);
            let lattices = finest.map(|finest| Lattice::new(&scene, &frame, finest));
            let store = Store::new(ROOM, &lattices, 2, ROOT_PRICE).expect("room");
            // Light and audience by light and audience, all in one arena.
            let mut all = Vec::new();
            for light in 0..2 {
                for audience in Audience::ALL {
                    let lattice = &lattices[audience as usize];
                    let finder = store.finder(light, audience, lattice);
                    let mut written = Written::new();
                    let roots: Vec<Cell> = lattice.root_bricks().collect();
                    for _ in 0..random.below(6) {
                        let cell = random.pick(&roots);
                        let target = (cell, finder.place_in_root(cell));
                        if !written.contains_key(&(cell.level, cell.at)) {
                            let finest = finest[audience as usize];
                            write_below(&store, random, finest, target, &mut written);
                        }
                    }
                    all.push((light, audience, roots, written));
                }
            }
            for (light, audience, roots, written) in &all {
                let lattice = &lattices[*audience as usize];
                let finder = store.finder(*light, *audience, lattice);
                let mut near: Vec<Cell> = written
                    .keys()
                    .map(|&(level, at)| Cell { level, at })
                    .collect();
                near.sort_unstable_by_key(|cell| (cell.level, cell.at));
                near.push(random.pick(roots));
                for _ in 0..300 {
                    let cell = random.pick(&near);
                    let point = random.in_box(&lattice.inflated(cell));
                    let x = frame.point_in_frame(point).to_array().map(|x| x as f32);
                    let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
                    let leaf = finder.find(code);
                    let root = code.place_in_root(lattice.root_shift());
                    if root >= lattice.root_places() {
                        assert_eq!(leaf, Leaf::OUTSIDE);
                        continue;
                    }
                    if !lattice.is_inside(code.cell(lattice.root_level)) {
                        assert_eq!(leaf.link, Link::OUTSIDE);
                        continue;
                    }
                    let (decision, level) = expected(written, lattice, code);
                    let is_root = level == lattice.root_level;
                    let price = if is_root { ROOT_PRICE } else { PRICE };
                    assert_found(&store, leaf, &decision, price);
                    assert_eq!(finder.level_of(code, lattice), level);
                    found_count += 1;
                    deepest = deepest.max(level);
                    kinds[match decision {
                        Decision::Nobody => 0,
                        Decision::Known(_) => 1,
                        Decision::Ray => 2,
                        Decision::Pending => 3,
                        Decision::List(..) => 4,
                    }] += 1;
                }
            }
        }
        assert!(found_count > 20_000 && deepest >= 10, "{deepest}");
        assert!(kinds.iter().all(|&count| count > 500), "{kinds:?}");
    }

    #[test]
    fn cells_of_a_brick_are_those_of_codes() {
        let random = &mut Random(2);
        let scene = random.scene();
        let frame = Frame::new(scene);
        for finest in 2..=12 {
            let lattice = Lattice::new(&scene, &frame, finest);
            for _ in 0..200 {
                let point = random.in_box(&scene);
                let x = frame.point_in_frame(point).to_array().map(|x| x as f32);
                let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
                let (mut level, mut shift) = (lattice.root_level, lattice.coarsest_shift());
                while level < finest {
                    let number = code.place_in_brick(shift);
                    let cell = cell_in_brick(code.cell(level), number);
                    assert_eq!(cell, code.cell(level + 2));
                    level += 2;
                    shift = shift.wrapping_sub(6);
                }
            }
        }
    }

    fn small_store(room_beside_roots: u64) -> (Store, Lattice) {
        let scene = Random(3).scene();
        let lattices = [2; 3].map(|finest| Lattice::new(&scene, &Frame::new(scene), finest));
        let all = Store::new(ROOM, &lattices, 1, ROOT_PRICE).expect("room");
        // The first words of an arena are no one's.
        let roots = all.bytes().0 + 64;
        assert!(Store::new(roots - 1, &lattices, 1, ROOT_PRICE).is_none());
        let store = Store::new(roots + room_beside_roots, &lattices, 1, ROOT_PRICE);
        (store.expect("room"), lattices[0])
    }

    #[test]
    fn a_brick_keeps_a_list_once() {
        let list = |entries: &[u32], finer| Decision::List(entries.into(), finer);
        let mut cells: Box<Decisions> = Box::new([const { Decision::Nobody }; 64]);
        for (number, cell) in cells.iter_mut().enumerate() {
            *cell = match number % 4 {
                0 => list(&[7, 9], Finer::Never),
                1 => list(&[7, 9], Finer::Perhaps),
                2 => list(&[7, 9, 11], Finer::Never),
                _ => Decision::Ray,
            };
        }
        let (store, _) = small_store(ROOM);
        let before = store.bytes();
        let brick = |store: &Store| {
            let link = store.write(&cells, PRICE, |_| None).expect("room");
            link.brick().expect("a brick")
        };
        let first = brick(&store);
        let after = store.bytes();
        // Two lists of two entries and one of three, in words by fours.
        assert_eq!(after.1 - before.1, 4 * (8 + 8 + 8));
        assert_eq!(after.0 - before.0, 4 * (PLANES as u64 + 64));
        let lists = |brick: usize| -> Vec<Option<usize>> {
            let word = |number| store.word((brick + PLANES + number) as u32);
            (0..64).map(|number| read(word(number)).list()).collect()
        };
        let places = lists(first);
        for (number, place) in places.iter().enumerate() {
            assert_eq!(place.is_some(), number % 4 != 3);
            assert_eq!(*place, places[number % 4]);
        }
        assert!(places[0] != places[1] && places[1] != places[2]);
        // Another brick has lists of its own: what they cost is counted for each.
        let others = lists(brick(&store));
        assert!(others[..3].iter().all(|other| !places.contains(other)));
    }

    #[test]
    fn cells_that_agree_need_no_brick() {
        use Decision::{Known, Nobody, Pending, Ray};
        let of = |kinds: &[Decision]| {
            let cell = |number: usize| kinds[number % kinds.len()].clone();
            agreed(&std::array::from_fn(cell))
        };
        let list = Decision::List([1].into(), Finer::Never);
        assert_eq!(of(&[Nobody]), Some(Link::LIT));
        assert_eq!(of(&[Known(true)]), Some(Link::SHADOWED));
        assert_eq!(of(&[Nobody, Known(true)]), Some(Link::SHADOWED));
        assert_eq!(of(&[Known(false), Nobody]), Some(Link::LIT));
        assert_eq!(of(&[Nobody, Nobody, Ray]), Some(Link::RAY));
        for kinds in [
            [Known(true), Known(false)],
            [Known(true), Ray],
            [Nobody, Pending],
            [Pending, Pending],
            [list.clone(), list],
        ] {
            assert_eq!(of(&kinds), None, "{kinds:?}");
        }
        // One cell of 64 is enough.
        for odd in 0..64 {
            let mut cells = [const { Known(true) }; 64];
            cells[odd] = Known(false);
            assert_eq!(agreed(&cells), None, "{odd}");
        }
    }

    #[test]
    fn a_full_store_keeps_what_it_has() {
        let random = &mut Random(4);
        let (store, lattice) = small_store(40_000);
        let finder = store.finder(0, Audience::Front, &lattice);
        let roots: Vec<Cell> = lattice.root_bricks().collect();
        let place = finder.place_in_root(roots[0]);
        let pending: Box<Decisions> = Box::new(std::array::from_fn(|number| match number {
            0 => Decision::Known(true),
            _ => Decision::Pending,
        }));
        let link = store.write(&pending, PRICE, |_| None).expect("room");
        store.publish(place, link);
        let links = store.unfinished(link.brick().expect("a brick"));
        // Until there is no room for the least brick, list or link.
        let mut refused_count = 0;
        let mut kept = Vec::new();
        for _ in 0..2_000 {
            let decisions = decisions(random);
            match store.write(&decisions, PRICE, |_| None) {
                Some(link) => kept.push((link, decisions)),
                None => refused_count += 1,
            }
        }
        assert!(refused_count > 100 && kept.len() > 100);
        let long = Decision::List((0..10_000).collect(), Finer::Never);
        assert_eq!(store.write_one(&long, PRICE, |_| None), None);
        assert_eq!(store.write(&pending, PRICE, |_| None), None);
        // Answers need no room.
        assert_eq!(
            store.write_one(&Decision::Ray, PRICE, |_| None),
            Some(Link::RAY)
        );
        assert_eq!(store.unfinished(link.brick().expect("a brick")), links);
        for (link, decisions) in kept {
            let Some(brick) = link.brick() else {
                assert_eq!(Some(link), agreed(&decisions));
                continue;
            };
            store.publish(place, link);
            for (number, decision) in decisions.iter().enumerate() {
                let number = number as u32;
                let (value, before) = value_of(&store.arena.words()[brick..], number);
                let leaf = match value.of_surface_point() {
                    Some(is_shadowed) => Leaf::of(is_shadowed),
                    None => {
                        let place = brick + PLANES + before;
                        Leaf {
                            link: read(store.word(place as u32)),
                            place: place as u32,
                        }
                    }
                };
                assert_found(&store, leaf, decision, PRICE);
            }
        }
    }

    #[test]
    fn one_cell_is_written_as_it_is() {
        let random = &mut Random(5);
        let (store, _) = small_store(ROOM);
        let mut all = vec![
            Decision::Nobody,
            Decision::Known(true),
            Decision::Known(false),
            Decision::Ray,
            Decision::Pending,
        ];
        all.extend((0..20).map(|_| list(random)));
        for decision in all {
            let link = store.write_one(&decision, PRICE, |_| None).expect("room");
            assert_says(&store, link, &decision, PRICE);
        }
    }
}
