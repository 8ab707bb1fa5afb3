//! Holes in surfaces: where an alpha-tested face is there and where it is not.

use std::fmt::Debug;

/// Says where an alpha-tested face is solid.
///
/// Must be a pure function: the same coordinates always give the same answer, for any thread and
/// any time, because answers built on it are kept. Implemented by whoever owns the textures.
pub trait Coverage: Debug + Send + Sync {
    /// Returns whether the face is there, at texture coordinates interpolated between those given
    /// with the face's corners.
    fn is_solid_at(&self, uv: [f64; 2]) -> bool;

    /// Returns whether the face is there at *every* place of a box of texture coordinates (`Some(true)`), or at none
    /// (`Some(false)`); `None` if neither is known.
    ///
    /// `low` and `high` are the box's least and greatest coordinates. A triangle whose corners' box is solid counts
    /// as opaque, and one whose box is empty as not there: both are answered faster than holes. Asked once a triangle.
    fn is_solid_throughout(&self, low: [f64; 2], high: [f64; 2]) -> Option<bool> {
        let _ = (low, high);
        None
    }

    /// Says what the holes are, piece after piece: two coverages that say the same bytes are solid at the
    /// same places. Returns whether it did; answers about faces with holes that say nothing are not kept in
    /// files.
    fn identify(&self, write: &mut dyn FnMut(&[u8])) -> bool {
        let _ = write;
        false
    }
}

/// Names a [`Coverage`] of a collection of surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CoverageId(pub(crate) u32);
