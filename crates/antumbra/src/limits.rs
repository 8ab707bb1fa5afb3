//! How large numbers may be.

use antumbra_geometry::DVec3;

/// 2^100, as for geometry.
pub(crate) const LARGEST: f64 = 1.2676506002282294e30;

/// Not for NaN.
#[inline]
pub(crate) fn is_fine(v: DVec3) -> bool {
    v.abs().cmple(DVec3::splat(LARGEST)).all()
}
