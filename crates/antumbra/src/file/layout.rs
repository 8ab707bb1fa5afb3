//! The head of a file: what it is about, where what is, and checksums.
//!
//! In: bytes of any content. Out: a [`Head`], or why there is none. Invariant: of a head that was read, the parts
//! that it names lie one after the other from its end to the end of the file, so that its checksum and theirs
//! cover every byte.

use std::io;
use std::path::Path;

use super::checksum::{self, Checksum};
use super::identity::Hash;
use super::words::Parts;
use super::{Change, Part, Refusal};
use crate::Method;
use crate::occlusion::{AdaptiveValues, RUNS};

/// The first byte is no text, and line ends are changed where files are taken for text (as PNG has it).
const MAGIC: [u8; 8] = *b"\x89ANT\r\n\x1a\n";

/// Raised with every change of what the bytes mean, of what a value says, or of how values are made.
const VERSION: u32 = 6;

/// Bytes before the entries of lights, of an entry, and of the checksum behind them.
const FIXED: usize = 136;
const ENTRY: usize = 56 + 8 * RUNS;
const CHECKSUM: usize = size_of::<Checksum>();
/// Bytes that say how long the head is: magic, version, number of lights.
const START: u64 = 16;

/// What a file is about, and its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) kind: Kind,
    pub(super) settings: Settings,
    pub(super) scene: Hash,
    pub(super) cells: Hash,
    /// The first part: the tree over the surfaces.
    pub(super) tree: TreeEntry,
    /// In the order of their parts.
    pub(super) lights: Vec<LightEntry>,
}

/// The tree over the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TreeEntry {
    pub(super) checksum: Checksum,
    pub(super) word_count: u64,
}

/// Where the values of a light are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LightEntry {
    pub(super) key: Hash,
    pub(super) checksum: Checksum,
    pub(super) word_counts: [u64; RUNS],
    pub(super) pending_count: u64,
}

impl LightEntry {
    fn word_count(&self) -> u64 {
        self.word_counts.iter().sum()
    }
}

/// What the file has of each light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Values,
    Map,
}

impl Kind {
    pub(super) fn of(values: &AdaptiveValues) -> Self {
        match values.has_maps() {
            true => Self::Map,
            false => Self::Values,
        }
    }

    /// Returns the method that knows such.
    pub(super) fn method(self) -> Method {
        match self {
            Self::Values => Method::Voxel,
            Self::Map => Method::Auto,
        }
    }
}

/// Settings that values depend on; maps depend on none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Settings([u32; 5]);

impl Settings {
    const NAMES: [&str; 5] = [
        "resolution",
        "resolution for points of space",
        "short list",
        "list for points of space",
        "long list",
    ];

    pub(super) fn of(values: &AdaptiveValues) -> Self {
        if values.has_maps() {
            return Self([0; 5]);
        }
        let depth = values.depth();
        let length = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
        Self([
            1 << depth.surfaces,
            1 << depth.space,
            length(depth.short_list),
            length(depth.space_list),
            length(depth.long_list),
        ])
    }

    /// Refuses other settings than those wanted.
    pub(super) fn check(&self, wanted: &Self) -> Result<(), Refusal> {
        for (number, name) in Self::NAMES.into_iter().enumerate() {
            let (found, expected) = (self.0[number], wanted.0[number]);
            if found != expected {
                return Err(Refusal::Stale(Change::Setting {
                    name,
                    found,
                    expected,
                }));
            }
        }
        Ok(())
    }
}

impl Head {
    /// Returns how long the head of so many lights is.
    pub(super) fn bytes_for(light_count: usize) -> u64 {
        (FIXED + ENTRY * light_count + CHECKSUM) as u64
    }

    /// Returns how long the file is.
    pub(super) fn file_bytes(&self) -> u64 {
        let words: u64 = self.lights.iter().map(LightEntry::word_count).sum();
        Self::bytes_for(self.lights.len()) + 4 * (self.tree.word_count + words)
    }

    /// Returns where the tree begins.
    pub(super) fn tree_at(&self) -> u64 {
        Self::bytes_for(self.lights.len())
    }

    /// Returns the first entry of a light, and where its part begins.
    pub(super) fn find(&self, key: &Hash) -> Option<(&LightEntry, u64)> {
        let mut at = self.tree_at() + 4 * self.tree.word_count;
        for entry in &self.lights {
            if entry.key == *key {
                return Some((entry, at));
            }
            at += 4 * entry.word_count();
        }
        None
    }

    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let Self {
            kind,
            settings,
            scene,
            cells,
            tree,
            lights,
        } = self;
        let mut bytes = Vec::with_capacity(FIXED + ENTRY * lights.len() + CHECKSUM);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((lights.len() as u32).to_le_bytes());
        bytes.extend(self.file_bytes().to_le_bytes());
        bytes.extend((*kind as u32).to_le_bytes());
        for setting in settings.0 {
            bytes.extend(setting.to_le_bytes());
        }
        bytes.extend(scene);
        bytes.extend(cells);
        bytes.extend(tree.checksum);
        bytes.extend(tree.word_count.to_le_bytes());
        debug_assert_eq!(bytes.len(), FIXED);
        for entry in lights {
            let LightEntry {
                key,
                checksum,
                word_counts,
                pending_count,
            } = entry;
            bytes.extend(key);
            bytes.extend(checksum);
            for count in word_counts {
                bytes.extend(count.to_le_bytes());
            }
            bytes.extend(pending_count.to_le_bytes());
        }
        bytes.extend(checksum::of_bytes(&bytes));
        bytes
    }

    /// Returns whether a file is one of occlusion values by its first bytes, or holds nothing.
    pub(super) fn begins(path: &Path) -> io::Result<bool> {
        let parts = Parts::open(path)?;
        let start = parts.bytes(0, parts.length().min(MAGIC.len() as u64))?;
        Ok(MAGIC.starts_with(&start))
    }

    /// Reads the head of a file, and checks that the file is as long as that says.
    pub(super) fn read(parts: &Parts) -> Result<Self, Refusal> {
        let read = |count: u64| {
            let bytes = parts.bytes(0, count);
            bytes.map_err(|error| Refusal::Unreadable(error.to_string()))
        };
        let length = parts.length();
        let due = |expected: u64| Refusal::Length {
            found: length,
            expected,
        };
        let start = read(length.min(START))?;
        let mut fields = Fields(&start);
        match fields.take() {
            Some(MAGIC) => {}
            // The beginning of one is one that was cut off.
            None if !start.is_empty() && MAGIC.starts_with(&start) => return Err(due(START)),
            _ => return Err(Refusal::Foreign),
        }
        let (Some(version), Some(light_count)) = (fields.word(), fields.word()) else {
            return Err(due(START));
        };
        if version != VERSION {
            return Err(Refusal::Version {
                found: version,
                expected: VERSION,
            });
        }
        let head_bytes = Self::bytes_for(light_count as usize);
        if length < head_bytes {
            return Err(due(head_bytes));
        }
        let bytes = read(head_bytes)?;
        let (said, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        if checksum::of_bytes(said) != checksum {
            return Err(Refusal::Damaged(Part::Head));
        }
        let (head, file_bytes) = Self::parse(said, light_count).ok_or(Refusal::Malformed {
            part: Part::Head,
            word: 0,
            what: "parts that are longer than the file, or of no kind",
        })?;
        if length != file_bytes {
            return Err(due(file_bytes));
        }
        Ok(head)
    }

    /// Returns what is said of so many lights, and how long the file should be.
    fn parse(said: &[u8], light_count: u32) -> Option<(Self, u64)> {
        let mut fields = Fields(&said[START as usize..]);
        let file_bytes = u64::from_le_bytes(fields.take()?);
        let kind = match fields.word()? {
            0 => Kind::Values,
            1 => Kind::Map,
            _ => return None,
        };
        let mut settings = Settings([0; 5]);
        for setting in &mut settings.0 {
            *setting = fields.word()?;
        }
        let mut head = Self {
            kind,
            settings,
            scene: fields.take()?,
            cells: fields.take()?,
            tree: TreeEntry {
                checksum: fields.take()?,
                word_count: u64::from_le_bytes(fields.take()?),
            },
            lights: Vec::new(),
        };
        let tree_bytes = head.tree.word_count.checked_mul(4)?;
        let mut sum = Self::bytes_for(light_count as usize).checked_add(tree_bytes)?;
        for _ in 0..light_count {
            let (key, checksum) = (fields.take()?, fields.take()?);
            let mut word_counts = [0; RUNS];
            for count in &mut word_counts {
                *count = u64::from_le_bytes(fields.take()?);
                sum = sum.checked_add(count.checked_mul(4)?)?;
            }
            let entry = LightEntry {
                key,
                checksum,
                word_counts,
                pending_count: u64::from_le_bytes(fields.take()?),
            };
            head.lights.push(entry);
        }
        // What it says itself and what its parts come to.
        (sum == file_bytes && fields.0.is_empty()).then_some((head, sum))
    }
}

/// What is left of some bytes.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (&taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(taken)
    }

    fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
}
