//! One light's values as words in a row, to be kept, and back.
//!
//! In: a store, or words from anywhere. Out: words, or the values in a store. What the words mean is in
//! docs/formats.md; in short: the links of a table or brick in order, each as it is in memory but without a
//! place, then in the same order what they lead to. So there are no places that could be wrong, and a brick lies
//! near those above and below it. Invariant: whatever the words are, reading ends, takes no more than the store
//! has room for, and leaves a store that no query trips over. Absent here: files, checksums, whose words they
//! are.

use super::bricks::{PLANES, Store};
use super::lattice::Lattice;
use super::links::{Link, read};
pub(crate) use super::misfit::Misfit;
use super::packed::Packed;
use super::value::{ReceiverClass, Values64};

/// In place of a link to a brick.
const BRICK: u32 = 1 << 30;
/// In place of a link to a list: with its number among the lists of the brick or table, the next number for a
/// list that was not there yet.
const LIST: u32 = 2 << 30;

/// As many lists are looked through for one that is there already: those of a brick.
const SHARED: usize = 64;

/// One light's values in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Section {
    pub(super) words: Vec<u32>,
    /// Links in whose place finer cells may be made.
    pub(super) pending_count: u64,
}

/// What is known of one light, cell by cell.
pub(super) trait Known {
    /// Returns what is known of a receiver class's coarsest bricks that hold a part of the scene's box, in order.
    fn roots(&self, class: ReceiverClass) -> Vec<Link>;

    /// Returns the planes of the brick that a link leads to, and what its links say.
    fn brick(&self, place: usize) -> ([u32; PLANES], Vec<Link>);

    /// Returns the surfaces of the list that a link leads to.
    fn list(&self, place: usize) -> Box<[u32]>;
}

/// What a store knows of a light.
pub(super) struct Stored<'a> {
    pub(super) store: &'a Store,
    pub(super) lattices: &'a [Lattice; 3],
}

impl Known for Stored<'_> {
    fn roots(&self, class: ReceiverClass) -> Vec<Link> {
        let lattice = &self.lattices[class as usize];
        let finder = self.store.finder(class, lattice);
        let bricks = lattice.root_bricks();
        bricks
            .map(|brick| read(self.store.word(finder.place_in_root(brick))))
            .collect()
    }

    fn brick(&self, place: usize) -> ([u32; PLANES], Vec<Link>) {
        let (planes, links) = self.store.brick(place);
        (planes, links.collect())
    }

    fn list(&self, place: usize) -> Box<[u32]> {
        self.store.surfaces(place)
    }
}

/// What was packed of a light: nothing more is made.
pub(super) struct Told<'a> {
    pub(super) packed: &'a Packed,
    pub(super) lattices: &'a [Lattice; 3],
}

impl Known for Told<'_> {
    fn roots(&self, class: ReceiverClass) -> Vec<Link> {
        self.packed.roots(&self.lattices[class as usize], class)
    }

    fn brick(&self, place: usize) -> ([u32; PLANES], Vec<Link>) {
        self.packed.brick(place)
    }

    fn list(&self, place: usize) -> Box<[u32]> {
        self.packed.list_of(place).into()
    }
}

/// Writes what is known of a light. Values that are made meanwhile may or may not be among it.
pub(super) fn write(known: &impl Known) -> Section {
    let mut section = Section::default();
    for class in ReceiverClass::ALL {
        let links = known.roots(class);
        section.words.push(links.len() as u32);
        section.write_cells(known, &links);
    }
    section
}

impl Section {
    /// Writes the links of a brick or a table, then what they lead to.
    fn write_cells(&mut self, known: &impl Known, links: &[Link]) {
        let mut lists: Vec<usize> = Vec::new();
        let mut is_new = vec![false; links.len()];
        for (link, is_new) in links.iter().zip(&mut is_new) {
            self.words.push(if link.brick().is_some() {
                BRICK
            } else if let Some(list) = link.list() {
                let first = lists.len().saturating_sub(SHARED);
                let known = lists[first..].iter().position(|&known| known == list);
                *is_new = known.is_none();
                let number = known.map_or(lists.len(), |known| first + known);
                if *is_new {
                    lists.push(list);
                }
                LIST | number as u32
            } else {
                self.pending_count += u64::from(link.is_pending());
                link.at_rest().0
            });
        }
        for (link, is_new) in links.iter().zip(is_new) {
            if let Some(brick) = link.brick() {
                let (planes, links) = known.brick(brick);
                self.words.extend(planes);
                self.write_cells(known, &links);
            } else if let (Some(list), true) = (link.list(), is_new) {
                self.write_list(&known.list(list));
            }
        }
    }

    fn write_list(&mut self, surfaces: &[u32]) {
        self.words.push(surfaces.len() as u32);
        self.words.extend(surfaces);
    }
}

/// Takes words for the values of a light that a store knows nothing of yet. Returns how many links are pending.
///
/// # Errors
/// The words are no values, or the store has no room; the store then knows nothing more than before.
pub(crate) fn take(
    words: &[u32],
    store: &Store,
    lattices: &[Lattice; 3],
    surface_count: usize,
) -> Result<u64, Misfit> {
    let mut reader = Reader {
        words,
        at: 0,
        store,
        surface_count,
        pending_count: 0,
    };
    let mut tables = Vec::with_capacity(ReceiverClass::ALL.len());
    for class in ReceiverClass::ALL {
        let lattice = &lattices[class as usize];
        let finder = store.finder(class, lattice);
        let places: Vec<u32> = lattice
            .root_bricks()
            .map(|brick| finder.place_in_root(brick))
            .collect();
        let at = reader.at;
        if reader.word()? as usize != places.len() {
            return Err(Misfit::At(at, "a table of another size"));
        }
        let mut links = vec![Link::OUTSIDE; places.len()];
        reader.cells(&mut links, lattice.most_bricks())?;
        tables.push((places, links));
    }
    if reader.at != words.len() {
        return Err(Misfit::At(reader.at, "words after the end"));
    }
    let pending_count = reader.pending_count;
    // All is there; now it may be found.
    for (places, links) in tables {
        for (place, link) in places.into_iter().zip(links) {
            store.publish(place, link);
        }
    }
    Ok(pending_count)
}

struct Reader<'a> {
    words: &'a [u32],
    at: usize,
    store: &'a Store,
    surface_count: usize,
    pending_count: u64,
}

impl<'a> Reader<'a> {
    fn some_words(&mut self, count: usize) -> Result<&'a [u32], Misfit> {
        let words = self.words[self.at..]
            .get(..count)
            .ok_or(Misfit::At(self.at, "an end too early"))?;
        self.at += count;
        Ok(words)
    }

    fn word(&mut self) -> Result<u32, Misfit> {
        self.some_words(1).map(|words| words[0])
    }

    /// Reads the links of cells and what they lead to, with so many levels of bricks below.
    fn cells(&mut self, links: &mut [Link], levels: u32) -> Result<(), Misfit> {
        let first = self.at;
        let words = self.some_words(links.len())?;
        let mut lists = Vec::new();
        for (number, (&word, link)) in words.iter().zip(links).enumerate() {
            let bad = |what| Misfit::At(first + number, what);
            let said = Link(word);
            *link = if word == BRICK {
                let levels = levels.checked_sub(1);
                self.brick(levels.ok_or(bad("a brick too fine"))?)?
            } else if let Some(number) = said.list() {
                if number == lists.len() {
                    lists.push(self.list()?);
                }
                *lists.get(number).ok_or(bad("a list that is not there"))?
            } else if said.is_pending() && said == said.at_rest() {
                self.pending_count += 1;
                said
            } else if said.answer().is_some() || said == Link::RAY {
                said
            } else {
                return Err(bad("a link of no kind"));
            };
        }
        Ok(())
    }

    fn brick(&mut self, levels: u32) -> Result<Link, Misfit> {
        let words = self.some_words(PLANES)?;
        let planes = std::array::from_fn(|word| words[word]);
        let count = Values64::undecided(&planes);
        // Before those below, as a query reads them.
        let place = self.store.take_brick(count).ok_or(Misfit::NoRoom)?;
        let mut links = [Link::OUTSIDE; 64];
        let links = &mut links[..count];
        self.cells(links, levels)?;
        self.store.put_brick(place, planes, links);
        Ok(Link::to_brick(place))
    }

    fn list(&mut self) -> Result<Link, Misfit> {
        let at = self.at;
        let length = self.word()?;
        if length == 0 {
            return Err(Misfit::At(at, "an empty list"));
        }
        let surfaces = self.some_words(length as usize)?;
        let is_bad = |&surface: &u32| surface as usize >= self.surface_count;
        if let Some(number) = surfaces.iter().position(is_bad) {
            return Err(Misfit::At(at + 1 + number, "a surface that is not there"));
        }
        let place = self.store.put_list(surfaces);
        place.map(Link::to_list).ok_or(Misfit::NoRoom)
    }
}
