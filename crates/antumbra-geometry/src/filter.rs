//! Filters: the colors that transparent surfaces give to light that goes straight on.

use std::fmt::Debug;

/// Says what share of the light of each color passes a transparent surface, where a shadow ray crosses it.
///
/// Must be a pure function, as [`Coverage`](crate::Coverage) must be. Implemented by whoever owns materials and textures;
/// [`Tint`] is the same everywhere.
pub trait Filter: Debug + Send + Sync {
    /// Returns shares of red, green and blue, each from 0 to 1, at texture coordinates interpolated between those given with
    /// the face's corners; at `[0, 0]` for faces without, and for spheres, cones and disks.
    fn transmittance_at(&self, uv: [f64; 2]) -> [f64; 3];
}

/// A filter that is the same everywhere: shares of red, green and blue that pass, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tint(pub [f64; 3]);

impl Filter for Tint {
    fn transmittance_at(&self, _: [f64; 2]) -> [f64; 3] {
        self.0
    }
}

/// Names a [`Filter`] of a collection of surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FilterId(pub(crate) u32);
