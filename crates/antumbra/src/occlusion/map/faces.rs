//! What a map knows of whole faces: triangles of which all starts are lit, or all are in shadow.
//!
//! In: what tiles tell of the parts of triangles that they hold. Out: a value for each triangle. A start on a triangle
//! lies on the closed triangle, wherever its point is, so that such a value answers without a look at the point.
//! Invariant: a value is told once all tiles that list the triangle are made and agree. The proofs are in the note
//! beside this file.

use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use antumbra_geometry::SurfaceId;

/// What is known of a triangle's starts in some cells: nothing, or bits of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Part(pub(super) u8);

impl Part {
    pub(super) const LIT: Self = Self(0b001);
    pub(super) const SHADOWED: Self = Self(0b010);
    pub(super) const DOUBT: Self = Self(0b100);

    /// Returns whether nothing can be told of the whole any more.
    pub(super) fn is_mixed(self) -> bool {
        self.0 > Self::SHADOWED.0
    }

    pub(super) fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

/// Bits of a [`Part`] in a word, below the number of tiles that are not made.
const PART_BITS: u32 = 3;
const PARTS: u32 = (1 << PART_BITS) - 1;

/// Bits of a [`Part`] in files.
const SAVED_BITS: u32 = 4;
const SAVED: u32 = (1 << SAVED_BITS) - 1;
const IN_A_WORD: usize = (u32::BITS / SAVED_BITS) as usize;

/// The values of all triangles.
#[derive(Debug)]
pub(super) struct Faces {
    /// For each surface the tiles that list it and are not made, and what the others tell.
    due: Box<[AtomicU32]>,
    /// 0, or what all tiles tell.
    values: Box<[AtomicU8]>,
}

impl Faces {
    /// `surfaces` are those of all tiles that are not made, one tile after another.
    pub(super) fn new(surface_count: usize, surfaces: impl Iterator<Item = u32>) -> Self {
        let mut due = vec![0_u32; surface_count];
        for surface in surfaces {
            due[surface as usize] += 1 << PART_BITS;
        }
        Self {
            due: due.into_iter().map(AtomicU32::new).collect(),
            values: (0..surface_count).map(|_| AtomicU8::new(0)).collect(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.due) + size_of_val(&*self.values)
    }

    /// Takes what a tile tells of a surface that it lists, before the tile is published.
    pub(super) fn tell(&self, surface: u32, part: Part) {
        self.due[surface as usize].fetch_or(part.0.into(), Ordering::Relaxed);
    }

    /// Notes that a tile that lists a surface was published for the first time.
    pub(super) fn finish_tile(&self, surface: u32) {
        let before = self.due[surface as usize].fetch_sub(1 << PART_BITS, Ordering::AcqRel);
        if before >> PART_BITS == 1 {
            self.publish(surface as usize, before & PARTS);
        }
    }

    fn publish(&self, surface: usize, parts: u32) {
        let told = Part(parts as u8);
        if told == Part::LIT || told == Part::SHADOWED {
            self.values[surface].store(told.0, Ordering::Release);
        }
    }

    /// Returns what tiles that were published before this call tell of all surfaces, eight to a word.
    pub(super) fn packed(&self) -> Vec<u32> {
        let pack = |due: &[AtomicU32]| {
            let parts = due.iter().map(|due| due.load(Ordering::Acquire) & PARTS);
            parts.rev().fold(0, |word, part| word << SAVED_BITS | part)
        };
        self.due.chunks(IN_A_WORD).map(pack).collect()
    }

    /// Takes what was packed. `surfaces` are those of all tiles that are not made. `None` for other words.
    pub(super) fn of_packed(
        surface_count: usize,
        surfaces: impl Iterator<Item = u32>,
        packed: &[u32],
    ) -> Option<Self> {
        if packed.len() != surface_count.div_ceil(IN_A_WORD) {
            return None;
        }
        let faces = Self::new(surface_count, surfaces);
        let parts = packed.iter().flat_map(|word| {
            (0..IN_A_WORD).map(move |number| word >> (SAVED_BITS as usize * number) & SAVED)
        });
        for (surface, parts) in parts.enumerate() {
            match faces.due.get(surface) {
                Some(due) if parts <= PARTS => {
                    let before = due.fetch_or(parts, Ordering::Relaxed);
                    if before >> PART_BITS == 0 {
                        faces.publish(surface, parts);
                    }
                }
                // What is beyond the last is nothing.
                None if parts == 0 => {}
                _ => return None,
            }
        }
        Some(faces)
    }

    /// Returns a bit that says that all starts on a surface are lit, and one that all are in shadow.
    #[inline(always)]
    pub(super) fn value(&self, surface: Option<SurfaceId>) -> u8 {
        // Of none, a number that no surface has.
        let number = surface.map_or(usize::MAX, |SurfaceId(number)| number as usize);
        let value = self.values.get(number);
        value.map_or(0, |value| value.load(Ordering::Relaxed))
    }
}
