//! What one start found in a map.

use antumbra_geometry::SurfaceId;
use fearless_simd::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

use super::words::rough_depth;
use crate::threads::prelude::*;

/// What one start found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Told {
    Unknown,
    Is(bool),
    /// The surfaces of a list.
    List(u32),
}

/// Where starts are: tiles and their insides, depths.
pub(crate) struct Located<const N: usize> {
    pub(super) tiles: [u32; N],
    pub(super) codes: [u32; N],
    pub(super) within: [[f32; N]; 2],
    pub(super) depths: [f32; N],
}

/// What a list says.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    /// The depth behind which all starts are in shadow.
    pub(super) full: f32,
    /// Entries for starts on listed surfaces, and for all.
    pub(super) counts: [usize; 2],
    pub(super) entries: &'a [AtomicU32],
    /// Those of the tile.
    pub(super) surfaces: &'a [u32],
}

impl List<'_> {
    /// Returns the surface of an entry, and whether it may block starts of a depth, as [`rough_depth`] tells it.
    #[inline(always)]
    pub(super) fn entry(&self, number: usize, rough_depth: u32) -> (SurfaceId, bool) {
        let entry = self.entries[number].load(Ordering::Relaxed);
        let surface = self.surfaces[(entry & 0xffff) as usize];
        (SurfaceId(surface), entry >> 16 <= rough_depth)
    }
}
