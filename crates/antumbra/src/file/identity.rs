//! Whose values they are: hashes of what values depend on, and nothing else.
//!
//! In: surfaces, cells, a light. Out: 32 bytes (BLAKE3) that differ if anything differs. A light is its kind and
//! pose; its power, its color and the cone of a spot are no part of it, and neither is a camera.

use antumbra_geometry::{LightShape, Occluders, UnidentifiedCoverage};

use crate::occlusion::AdaptiveValues;

/// 256 bits of BLAKE3.
pub(super) type Hash = [u8; 32];

/// So that no two kinds of hash are of the same bytes.
const SCENE: &[u8] = b"antumbra scene";
const CELLS: &[u8] = b"antumbra cells";
const LIGHT: &[u8] = b"antumbra light";

pub(super) fn of_scene(occluders: &Occluders) -> Result<Hash, UnidentifiedCoverage> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(SCENE);
    occluders.identify(&mut |bytes| {
        hasher.update(bytes);
    })?;
    Ok(*hasher.finalize().as_bytes())
}

/// Where the cells are that values speak of, and how near starts are taken to be.
pub(super) fn of_cells(values: &AdaptiveValues) -> Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(CELLS);
    for word in values.identity() {
        hasher.update(&word.to_le_bytes());
    }
    *hasher.finalize().as_bytes()
}

pub(super) fn of_light(light: &LightShape) -> Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(LIGHT);
    hasher.update(&light.identity());
    *hasher.finalize().as_bytes()
}
