//! What is known of up to 64 starts, a bit for each.

use super::lookup::Found;

/// Starts that are looked up together; a bit each.
pub(crate) const MANY: usize = 64;

/// So few starts are answered one after the other.
pub(super) const FEW: usize = 16;

/// What is known of some starts, a bit for each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Told {
    pub(crate) shadowed: u64,
    /// What a list said.
    pub(crate) listed: u64,
    /// Of which nothing is known.
    pub(crate) unknown: u64,
}

impl Told {
    pub(super) fn nothing(count: usize) -> Self {
        Self {
            unknown: first_bits(count),
            ..Self::default()
        }
    }

    pub(super) fn add(&mut self, number: usize, found: Found) {
        self.shadowed |= u64::from(found.is_shadowed() & !found.is_nothing()) << number;
        self.listed |= u64::from(found.is_by_list() & !found.is_nothing()) << number;
        self.unknown |= u64::from(found.is_nothing()) << number;
    }
}

/// As many bits as there are starts, at most [`MANY`].
pub(super) fn first_bits(count: usize) -> u64 {
    let spare = MANY.saturating_sub(count) as u32;
    u64::MAX.checked_shr(spare).unwrap_or(0)
}

/// The numbers of the bits that are set.
#[derive(Clone, Copy)]
pub(super) struct Numbers(pub(super) u64);

impl Iterator for Numbers {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let number = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(number % MANY)
    }
}

/// Where starts are, coordinate by coordinate.
pub(super) type Places = [[f32; MANY]; 3];
