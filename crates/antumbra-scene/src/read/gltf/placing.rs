//! Where a texture lies on a surface.
//!
//! In: a use of a texture. Out: which coordinates it takes, and how it moves them.

use super::document::{TextureTransform, TextureUse};

/// Returns whether two textures lie in the same place everywhere.
pub(super) fn lie_alike(one: &TextureUse, other: &TextureUse) -> bool {
    texture_set(one) == texture_set(other) && placing(one) == placing(other)
}

/// Returns what moves coordinates.
fn placing(texture: &TextureUse) -> Option<&TextureTransform> {
    texture.extensions.transform.as_ref()
}

/// Returns which set of coordinates a texture uses.
pub(super) fn texture_set(texture: &TextureUse) -> u32 {
    let transform = placing(texture);
    transform
        .and_then(|transform| transform.tex_coord)
        .unwrap_or(texture.tex_coord)
}

/// Returns what KHR_texture_transform does to coordinates: scale, turn counter-clockwise as seen
/// in the picture (v points down), move.
pub(super) fn texture_transform(texture: &TextureUse) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
    let transform = placing(texture);
    let parts = transform.map(|transform| {
        let angle = transform.rotation.unwrap_or(0.0);
        (
            transform.offset.unwrap_or([0.0; 2]),
            (libm::sin(angle), libm::cos(angle)),
            transform.scale.unwrap_or([1.0; 2]),
        )
    });
    move |[u, v]| match parts {
        None => [u, v],
        Some((offset, (sine, cosine), scale)) => {
            let [u, v] = [scale[0] * u, scale[1] * v];
            [
                cosine * u + sine * v + offset[0],
                cosine * v - sine * u + offset[1],
            ]
        }
    }
}
