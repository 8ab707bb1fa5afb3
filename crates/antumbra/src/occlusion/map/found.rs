//! What one start found in a map.

use std::sync::atomic::{AtomicU32, Ordering};

use antumbra_geometry::SurfaceId;

/// What one start found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Told {
    Unknown,
    Is(bool),
    /// The surfaces of a list.
    List(u32),
}

/// Where starts are: tiles and their insides, depths.
pub(in super::super) struct Located<const N: usize> {
    pub(in super::super) tiles: [u32; N],
    pub(in super::super) codes: [u32; N],
    pub(in super::super) within: [[f32; N]; 2],
    pub(in super::super) depths: [f32; N],
}

/// What a list says.
#[derive(Clone, Copy)]
pub(in super::super) struct List<'a> {
    /// The depth behind which all starts are in shadow.
    pub(in super::super) full: f32,
    /// Entries for starts on listed surfaces, and for all.
    pub(in super::super) counts: [usize; 2],
    pub(in super::super) entries: &'a [AtomicU32],
    /// Those of the tile.
    pub(in super::super) surfaces: &'a [u32],
}

impl List<'_> {
    /// Returns the surface of an entry, and whether it may block starts of a depth, as [`super::rough_depth`] tells it.
    #[inline(always)]
    pub(in super::super) fn entry(&self, number: usize, rough_depth: u32) -> (SurfaceId, bool) {
        let entry = self.entries[number].load(Ordering::Relaxed);
        let surface = self.surfaces[(entry & 0xffff) as usize];
        (SurfaceId(surface), entry >> 16 <= rough_depth)
    }
}
