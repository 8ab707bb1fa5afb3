//! Values in bricks of 4^3 cells, finer bricks under cells that need them.
//!
//! In: what was decided for the 64 cells of a brick. Out: what is known where a [`Code`] says. A brick keeps two
//! bits a cell in two planes, then a [`Link`] for each cell that has no answer, in the order of the cells. A
//! root table of links finds the coarsest bricks. All lies in one [`Arena`].

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

use super::arena::Arena;
use super::lattice::{Cell, Code, Lattice};
use super::links::{Link, read};
use super::room::Room;
use super::sync::{AtomicU32, Ordering};
use super::value::{Occlusion, ReceiverClass, Values64};

/// Decision for a cell and a receiver class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Decision {
    Known(bool),
    /// There are no such starts.
    Nobody,
    /// The entries of a list.
    List(Box<[u32]>),
    /// Rays answer.
    Ray,
    /// Finer cells may say more.
    Pending,
    /// They do: what leads to them.
    Finer(Link),
}

/// The cells of a brick.
pub(crate) type Decisions = [Decision; 64];

/// Words of a brick before its links.
pub(super) const PLANES: usize = 4;
/// Words of a list before its entries: their number.
const LIST_HEAD: usize = 1;

/// The values and lists of a light, as far as they are made.
#[derive(Debug)]
pub(crate) struct Store {
    arena: Arena,
    /// Where the root tables lie, for each receiver class.
    roots: [u32; 3],
    list_bytes: AtomicU64,
    brick_count: AtomicU64,
    /// Links of all bricks.
    link_count: AtomicU64,
    /// Bytes that were handed out for the root tables.
    root_bytes: u64,
    /// Whether something found no room.
    is_full: AtomicBool,
}

impl Store {
    /// Makes a store in which nothing is known, of at most so many bytes; `None` if these, or what the room has left,
    /// do not hold the root tables. Refining a cell at the root has a price.
    pub(crate) fn new(
        room: &Arc<Room>,
        bytes: u64,
        lattices: &[Lattice; 3],
        price: u32,
    ) -> Option<Self> {
        let places = lattices
            .iter()
            .map(|lattice| lattice.root_places().next_multiple_of(4));
        let arena = Arena::new(room, bytes, places.sum())?;
        let mut roots = [0; 3];
        for (place, lattice) in roots.iter_mut().zip(lattices) {
            let count = lattice.root_places();
            *place = arena.take(count)?;
            // Some lie beside a flat scene.
            arena.write(*place, std::iter::repeat_n(Link::OUTSIDE.0, count));
            for brick in lattice.root_bricks() {
                let at = *place + Code::place_of(brick.at) as u32;
                arena.publish(at, Link::pending(price));
            }
        }
        Some(Self {
            root_bytes: arena.bytes(),
            arena,
            roots,
            list_bytes: AtomicU64::new(0),
            brick_count: AtomicU64::new(0),
            link_count: AtomicU64::new(0),
            is_full: AtomicBool::new(false),
        })
    }

    /// Returns the bytes that a store takes in which nothing is known, of at most so many.
    pub(crate) fn bare_bytes(lattices: &[Lattice; 3], most_bytes: u64) -> u64 {
        let places: usize = lattices.iter().map(Lattice::root_places).sum();
        Arena::bytes_for(places, most_bytes)
    }

    /// Returns whether nothing but the root tables was written.
    pub(crate) fn is_bare(&self) -> bool {
        self.arena.bytes() == self.root_bytes
    }

    /// Returns what finds links.
    #[inline(always)]
    pub(crate) fn finder(&self, class: ReceiverClass, lattice: &Lattice) -> Finder<'_> {
        Finder {
            arena: &self.arena,
            root: self.roots[class as usize] as usize,
            root_places: lattice.root_places(),
            root_shift: lattice.root_shift(),
            brick_shift: lattice.coarsest_shift(),
        }
    }

    /// Returns where a root table starts.
    pub(crate) fn root(&self, class: ReceiverClass) -> u32 {
        self.roots[class as usize]
    }

    /// Returns what is known at a link.
    pub(crate) fn link(&self, place: u32) -> Link {
        read(self.word(place))
    }

    /// Returns what is known of the 64 cells of a brick.
    pub(crate) fn cells(&self, brick: usize) -> [Link; 64] {
        let words = self.arena.words_from(brick);
        std::array::from_fn(|number| {
            let (value, before) = value_of(words, number as u32);
            match value.of_surface_point() {
                Some(is_shadowed) => Link::known(is_shadowed),
                None => read(&words[PLANES + before]),
            }
        })
    }

    pub(crate) fn word(&self, place: u32) -> &AtomicU32 {
        self.arena.word(place as usize)
    }

    /// Returns the surfaces of a list.
    #[inline(always)]
    pub(crate) fn list(&self, place: usize) -> &[AtomicU32] {
        let words = self.arena.words_from(place);
        let length = words[0].load(Ordering::Relaxed) as usize;
        &words[LIST_HEAD..LIST_HEAD + length]
    }

    /// Returns a copy of them.
    pub(super) fn surfaces(&self, list: usize) -> Box<[u32]> {
        let surfaces = self.list(list).iter();
        surfaces
            .map(|surface| surface.load(Ordering::Relaxed))
            .collect()
    }

    /// Writes the cells of a brick; finer cells of each have a price. Returns the link to it, `None` if there is no
    /// more room.
    pub(crate) fn write(&self, cells: &Decisions, price: u32) -> Option<Link> {
        if let Some(link) = agreed(cells) {
            return Some(link);
        }
        let mut values = Values64::default();
        let mut links = Vec::with_capacity(64);
        let mut lists: Vec<(&[u32], u32)> = Vec::new();
        for (place, cell) in cells.iter().enumerate() {
            let (value, link) = match cell {
                Decision::Nobody => (Occlusion::Null, None),
                Decision::Known(is_shadowed) => (Occlusion::known(*is_shadowed), None),
                Decision::Ray => (Occlusion::Listed, Some(Link::RAY)),
                Decision::Pending => (Occlusion::Complicated, Some(Link::pending(price))),
                Decision::Finer(link) => match link.answer() {
                    Some(is_shadowed) => (Occlusion::known(is_shadowed), None),
                    None if link.brick().is_some() => (Occlusion::Complicated, Some(*link)),
                    None => (Occlusion::Listed, Some(*link)),
                },
                Decision::List(entries) => {
                    let at = match lists.iter().find(|(list, _)| *list == &**entries) {
                        Some(&(_, at)) => at,
                        None => {
                            let at = self.put_list(entries)?;
                            lists.push((entries, at));
                            at
                        }
                    };
                    (Occlusion::Listed, Some(Link::to_list(at)))
                }
            };
            values.set(place as u32, value);
            links.extend(link.map(|link| link.0));
        }
        let place = self.take_brick(links.len())?;
        self.arena
            .write(place, values.words().into_iter().chain(links));
        Some(Link::to_brick(place))
    }

    /// Writes a list; returns its place, `None` if there is no more room.
    pub(super) fn put_list(&self, entries: &[u32]) -> Option<u32> {
        let count = LIST_HEAD + entries.len();
        let place = self.take(count)?;
        let words = std::iter::once(entries.len() as u32).chain(entries.iter().copied());
        self.arena.write(place, words);
        let taken = 4 * count.next_multiple_of(4) as u64;
        self.list_bytes.fetch_add(taken, Ordering::Relaxed);
        Some(place)
    }

    pub(crate) fn publish(&self, place: u32, known: Link) {
        self.arena.publish(place, known);
    }

    /// Takes room for a brick of so many links; `None` if there is no more.
    pub(super) fn take_brick(&self, link_count: usize) -> Option<u32> {
        let place = self.take(PLANES + link_count)?;
        self.brick_count.fetch_add(1, Ordering::Relaxed);
        self.link_count
            .fetch_add(link_count as u64, Ordering::Relaxed);
        Some(place)
    }

    fn take(&self, word_count: usize) -> Option<u32> {
        let place = self.arena.take(word_count);
        if place.is_none() {
            self.is_full.store(true, Ordering::Relaxed);
        }
        place
    }

    /// Returns whether something found no room.
    pub(crate) fn is_full(&self) -> bool {
        self.is_full.load(Ordering::Relaxed)
    }

    /// Returns how many bricks there are, how many links they have, and about the words of all lists.
    pub(super) fn counts(&self) -> [usize; 3] {
        let [bricks, links, bytes] = [&self.brick_count, &self.link_count, &self.list_bytes]
            .map(|count| count.load(Ordering::Relaxed));
        [bricks, links, bytes / 4].map(|count| count as usize)
    }

    /// Returns the bytes of the root tables.
    pub(super) fn root_bytes(&self) -> u64 {
        self.root_bytes
    }

    /// Writes a brick as it is, where room was taken and no link leads to yet.
    pub(super) fn put_brick(&self, place: u32, planes: [u32; PLANES], links: &[Link]) {
        let links = links.iter().map(|link| link.0);
        self.arena.write(place, planes.into_iter().chain(links));
    }

    /// Returns a brick's planes and what its links say.
    pub(super) fn brick(&self, place: usize) -> ([u32; PLANES], impl Iterator<Item = Link>) {
        let words = self.arena.words_from(place);
        let planes = std::array::from_fn(|word| words[word].load(Ordering::Relaxed));
        let links = &words[PLANES..PLANES + Values64::undecided(&planes)];
        (planes, links.iter().map(read))
    }

    /// Returns the places and numbers of a brick's links whose cells may have finer ones.
    pub(crate) fn unfinished(&self, brick: usize) -> Vec<(u32, u32)> {
        let mut links = Vec::new();
        for number in 0..64 {
            let (value, before) = value_of(self.arena.words_from(brick), number);
            if value == Occlusion::Complicated {
                links.push(((brick + PLANES + before) as u32, number));
            }
        }
        links
    }

    /// Returns the bytes of values and links, and those of lists.
    pub(crate) fn bytes(&self) -> (u64, u64) {
        let lists = self.list_bytes.load(Ordering::Relaxed);
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
            Decision::Finer(link) if link.brick().is_none() => *link,
            Decision::Finer(_) | Decision::List(_) | Decision::Pending => return None,
        };
        if *agreed.get_or_insert(link) != link {
            return None;
        }
    }
    Some(agreed.unwrap_or(Link::LIT))
}

/// A store's bricks for one light and receiver class, at hand.
#[derive(Clone, Copy)]
pub(crate) struct Finder<'a> {
    arena: &'a Arena,
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
        let mut link = read(self.arena.word(place));
        let mut shift = self.brick_shift;
        while let Some(brick) = link.brick() {
            let number = code.place_in_brick(shift);
            let words = self.arena.words_from(brick);
            let (value, before) = value_of(words, number);
            if let Some(is_shadowed) = value.of_surface_point() {
                return Leaf::of(is_shadowed);
            }
            place = brick + PLANES + before;
            link = read(&words[PLANES + before]);
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
        let mut link = read(self.arena.word(place));
        let mut shift = self.brick_shift;
        while let Some(brick) = link.brick() {
            level += 2;
            let number = code.place_in_brick(shift);
            let words = self.arena.words_from(brick);
            let (value, before) = value_of(words, number);
            if value.of_surface_point().is_some() {
                break;
            }
            link = read(&words[PLANES + before]);
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
mod tests;
