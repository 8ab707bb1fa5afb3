//! Sheets of a cell, triangles that cover it once, and slants over them.

use super::faces::Part;

/// Sheets are looked for among so many surfaces, and disjoint ones among so many.
pub(super) const MOST_IN_SHEET: usize = 48;

/// Triangles are compared in pairs, whether they lie apart, if they are so few.
pub(super) const MOST_APART: usize = 6;

/// Starts whose key less a linear function is more than this lie behind a sheet, and so do some of a list.
pub(super) struct Slant {
    pub(super) slope: [f32; 2],
    pub(super) key: f32,
    pub(super) hidden: u64,
}

/// Members of a list, a bit each, and between which depths they are.
#[derive(Clone, Copy)]
pub(super) struct Sheet {
    pub(super) members: u64,
    pub(super) near: f32,
    pub(super) far: f32,
}

impl Sheet {
    pub(super) const NONE: Self = Self {
        members: 0,
        near: f32::INFINITY,
        far: f32::INFINITY,
    };

    pub(super) fn is_none(&self) -> bool {
        self.members == 0
    }

    /// Returns what a threshold behind the sheet tells of an entry of its cell: it is a member, or all behind.
    pub(super) fn part_of(&self, number: usize) -> Part {
        match self.holds(number) {
            true => Part::LIT,
            false => Part::SHADOWED,
        }
    }

    pub(super) fn holds(&self, number: usize) -> bool {
        number < MOST_IN_SHEET && self.members >> number & 1 != 0
    }
}
