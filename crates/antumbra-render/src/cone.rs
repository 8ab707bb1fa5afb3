//! The cone of a spot: how much of its light it sends, by the cosine to its middle.

/// Returns the share of a spot's light in a direction: 1 inside of the inner cone, 0 outside of the outer one, smooth between.
pub(crate) fn share_at(cosine: f64, inner_cosine: f64, outer_cosine: f64) -> f64 {
    if cosine >= inner_cosine {
        1.0
    } else if cosine <= outer_cosine {
        0.0
    } else {
        let t = (cosine - outer_cosine) / (inner_cosine - outer_cosine);
        t * t * (3.0 - 2.0 * t)
    }
}
