//! What is known of one light, cell by cell and surface by surface.
//!
//! In: keys and their values. Out: a table that is only read: whoever makes more makes a new one.

use antumbra_geometry::SurfaceId;

use super::super::room::Share;

/// A cell, and a surface that meets it and the side of it that is asked about, or the space in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Key(u64);

/// In place of a surface.
const SPACE: u32 = u32::MAX >> 1;

impl Key {
    /// In place of a key.
    const NONE: Self = Self(u64::MAX);

    #[inline(always)]
    pub(super) fn new(cell: u64, surface: Option<SurfaceId>, is_behind: bool) -> Self {
        let surface = surface.map_or(SPACE, |surface| surface.0);
        Self(cell << 32 | u64::from(surface << 1 | u32::from(is_behind)))
    }

    /// Returns the surface; `None` for space.
    pub(super) fn surface(self) -> Option<SurfaceId> {
        let surface = self.0 as u32 >> 1;
        (surface != SPACE).then_some(SurfaceId(surface))
    }

    /// Returns the side of the surface: 1 in front, -1 behind.
    pub(super) fn side(self) -> i8 {
        if self.0 & 1 == 0 { 1 } else { -1 }
    }

    /// Returns the number of the cell among those of its level.
    #[inline(always)]
    pub(super) fn cell_number(self) -> u64 {
        self.0 >> 32
    }

    /// Multiplicative hashing (Knuth): the top bits depend on all.
    #[inline(always)]
    fn slot(self, shift: u32) -> usize {
        let mixed = (self.0 ^ self.0 >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> shift) as usize
    }
}

/// What is known of all starts of a key and the whole light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    /// All of the light reaches every start (*null*).
    Lit,
    /// Nothing of the light reaches any start (*full*).
    Dark,
    /// Nothing (*complicated*).
    Open,
    /// What may block is listed (*complicated*): where the list starts.
    Listed(u64),
}

/// A value in a word: the kind, whether all samples are asked about, where the list starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Known(u64);

impl Known {
    const ALL: u64 = 4;

    pub(super) fn new(value: Value, are_all_asked: bool) -> Self {
        let word = match value {
            Value::Lit => 0,
            Value::Dark => 1,
            Value::Open => 2,
            Value::Listed(first) => 3 | first << 3,
        };
        Self(word | if are_all_asked { Self::ALL } else { 0 })
    }

    #[inline(always)]
    pub(super) fn value(self) -> Value {
        match self.0 & 3 {
            0 => Value::Lit,
            1 => Value::Dark,
            2 => Value::Open,
            _ => Value::Listed(self.0 >> 3),
        }
    }

    /// Returns whether every sample of the light is asked about from every start.
    #[inline(always)]
    pub(super) fn are_all_asked(self) -> bool {
        self.0 & Self::ALL != 0
    }

    /// The same with a list that starts so much later.
    fn moved(self, by: u64) -> Self {
        match self.value() {
            Value::Listed(first) => Self::new(Value::Listed(first + by), self.are_all_asked()),
            _ => self,
        }
    }
}

/// New entries, their lists one after the other: each its length and as many leaves of the tree.
#[derive(Debug, Default)]
pub(super) struct Entries {
    pub(super) known: Vec<(Key, Known)>,
    pub(super) lists: Vec<u32>,
}

impl Entries {
    /// Adds a list and returns where it starts.
    pub(super) fn push_list(&mut self, list: impl ExactSizeIterator<Item = u32>) -> u64 {
        let first = self.lists.len() as u64;
        self.lists.push(list.len() as u32);
        self.lists.extend(list);
        first
    }

    pub(super) fn add(&mut self, others: Self) {
        let by = self.lists.len() as u64;
        self.lists.extend(others.lists);
        let moved = others.known.into_iter();
        self.known
            .extend(moved.map(|(key, known)| (key, known.moved(by))));
    }

    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(self.known.as_slice()) + size_of_val(self.lists.as_slice())) as u64
    }
}

/// All that is known of a light, each value found by its key.
#[derive(Debug)]
pub(crate) struct Table {
    /// A power of two of places, at most half of them taken; a key lies at its place or behind.
    slots: Vec<(Key, Known)>,
    lists: Vec<u32>,
    count: usize,
    shift: u32,
    _share: Share,
}

impl Table {
    /// Returns the bytes that a table of some entries and those of another takes.
    pub(super) fn bytes_for(before: Option<&Self>, more: &Entries) -> u64 {
        let old = before.map_or((0, 0), |table| (table.count, table.lists.len()));
        let slots = slot_count(old.0 + more.known.len()) * size_of::<(Key, Known)>();
        (slots + (old.1 + more.lists.len()) * size_of::<u32>()) as u64
    }

    /// Makes a table of the entries of another, if there is one, and of others, whose keys it does not have.
    pub(super) fn new(before: Option<&Self>, more: &Entries, share: Share) -> Self {
        let old = before.map_or(0, |table| table.count);
        let slots = slot_count(old + more.known.len());
        let old_lists = before.map_or(0, |table| table.lists.len());
        let mut lists = Vec::with_capacity(old_lists + more.lists.len());
        if let Some(before) = before {
            lists.extend_from_slice(&before.lists);
        }
        lists.extend_from_slice(&more.lists);
        let mut table = Self {
            slots: vec![(Key::NONE, Known(0)); slots],
            lists,
            count: 0,
            shift: u64::BITS - slots.ilog2(),
            _share: share,
        };
        if let Some(before) = before {
            for &(key, known) in before.slots.iter().filter(|slot| slot.0 != Key::NONE) {
                table.put(key, known);
            }
        }
        for &(key, known) in &more.known {
            table.put(key, known.moved(old_lists as u64));
        }
        table
    }

    fn put(&mut self, key: Key, known: Known) {
        let mask = self.slots.len() - 1;
        let mut slot = key.slot(self.shift) & mask;
        while self.slots[slot].0 != Key::NONE {
            if self.slots[slot].0 == key {
                return;
            }
            slot = (slot + 1) & mask;
        }
        self.slots[slot] = (key, known);
        self.count += 1;
    }

    /// Returns what is known of a key, if it was looked at.
    #[inline(always)]
    pub(super) fn get(&self, key: Key) -> Option<Known> {
        let mask = self.slots.len() - 1;
        let mut slot = key.slot(self.shift) & mask;
        loop {
            let (found, known) = self.slots[slot];
            if found == key {
                return Some(known);
            }
            if found == Key::NONE {
                return None;
            }
            slot = (slot + 1) & mask;
        }
    }

    /// Returns the leaves of a list.
    #[inline(always)]
    pub(super) fn list(&self, first: u64) -> &[u32] {
        let lists = &self.lists[first as usize..];
        &lists[1..][..lists[0] as usize]
    }

    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(self.slots.as_slice()) + size_of_val(self.lists.as_slice())) as u64
    }
}

fn slot_count(key_count: usize) -> usize {
    (2 * key_count).next_power_of_two().max(2)
}
