//! How many tiles and words a map has, and what it is said to cost.

use antumbra_geometry::Occluders;

/// Tiles for a surface, and the fewest and most of them.
const TILES_EACH: f64 = 1.0 / 8.0;
const TILE_COUNT: [f64; 2] = [64.0, 65_536.0];

/// Entries of tiles at most, for each surface and for each tile: more than that tiles are made wider, so often.
const MOST_ENTRIES: [usize; 2] = [16, 16];

/// Words at most, for each surface; and so many more for each of the first, as scenes of few are seen as finely.
const WORDS_EACH: u64 = 128;
const WORDS_OF_FEW: u64 = 128;
const FEW: u64 = 4_096;

/// Prices of a map for each surface, in nanoseconds: of its tables, and about as much again for tiles; of the scene's
/// mesh.
const SURFACE_NS: u64 = 900;
const JOINED_NS: u64 = 430;

/// Returns about what making one costs, without its tiles, in nanoseconds.
pub(crate) fn price(occluders: &Occluders, is_joined: bool) -> u64 {
    let each = SURFACE_NS + if is_joined { 0 } else { JOINED_NS };
    each * occluders.surface_count() as u64
}

/// Bytes for each surface of what is known of whole faces.
const FACE_BYTES: usize = 5;

/// Returns the most bytes that [`Map::new`](super::Map::new) takes at its height but for its arena.
pub(crate) fn height_bytes(occluders: &Occluders) -> u64 {
    // As many again by rounding and borders.
    let tiles = 2 * tile_count(occluders) as usize;
    let entries = most_entries(occluders.surface_count(), tiles);
    let of_tiles = 24 * tiles + (size_of::<(u32, u32)>() + size_of::<u32>()) * entries;
    (of_tiles + FACE_BYTES * occluders.surface_count()) as u64
}

/// Returns the most bytes of its words.
pub(crate) fn most_words(occluders: &Occluders) -> u64 {
    let surfaces = occluders.surface_count() as u64;
    let words = WORDS_EACH * surfaces
        + WORDS_OF_FEW * surfaces.min(FEW)
        + 64 * tile_count(occluders) as u64;
    4 * words
}

/// Returns about how many tiles there are.
pub(super) fn tile_count(occluders: &Occluders) -> f64 {
    let count = TILES_EACH * occluders.surface_count() as f64;
    count.clamp(TILE_COUNT[0], TILE_COUNT[1])
}

pub(super) fn most_entries(surface_count: usize, tile_count: usize) -> usize {
    MOST_ENTRIES[0] * surface_count + MOST_ENTRIES[1] * tile_count
}
