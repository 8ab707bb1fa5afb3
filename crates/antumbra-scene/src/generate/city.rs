//! City: boxes of many sizes on a ground, with streets; the case of axis-aligned walls that meet
//! the ground exactly.
//!
//! In: the number of boxes. Out: a ground and five or six faces a box (every fourth box has a
//! bottom, which lies in the ground's plane). Invariant: coordinates are whole eighths, so every
//! face is exactly planar, and up to 10,000 boxes six digits say them exactly. One light: a sun,
//! as a far point because NFF knows no other.

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_material,
    model::{Object, Scene},
};

use super::{GenerateError, check_size, polygon, random::Random, stage};

/// The largest size.
const LARGEST: u32 = 1_000_000;

/// Coordinates are counted in eighths of a unit.
const EIGHTHS: f64 = 8.0;
/// From a lot to the next: eight units.
const LOT: i32 = 64;
/// A block is four lots wide; a street as wide as a lot comes after it.
const BLOCK: i32 = 4;
/// Half the longest side of a footprint. Turned, it still stays within its lot: `22 sqrt(2) < 32`.
const LARGEST_HALF: i32 = 22;

const SEED: u64 = 0xC17;
/// Footprints may be turned by these, as sine and cosine times 65: right triangles with whole
/// sides.
const TURNS: [(i32, i32); 4] = [(16, 63), (33, 56), (39, 52), (25, 60)];

/// Makes a city of `size` boxes.
///
/// # Errors
/// The size is not from 1 to 1,000,000.
pub fn city(size: u32) -> Result<Scene, GenerateError> {
    check_size("city", size, 1..=LARGEST)?;
    let lots = size.isqrt() + u32::from(size.isqrt().pow(2) < size);
    let lots = lots as i32;
    let extent = lot_at(lots);
    let half = f64::from(extent) / (2.0 * EIGHTHS);
    // From above the roofs, the sun to the left.
    let mut scene = stage(
        DVec3::new(-0.25 * half, -0.5 * half, 0.0625 * half + 56.0),
        DVec3::new(0.0625 * half, 0.0, 0.0),
        DVec3::Z,
        &[DVec3::new(-8.0, 3.0, 7.0) * (half + 100.0).round()],
    );
    scene
        .materials
        .push(nff_material([0.6, 0.6, 0.55, 1.0, 0.0, 1.0, 0.0, 1.0]));
    scene
        .materials
        .push(nff_material([0.8, 0.75, 0.7, 1.0, 0.0, 1.0, 0.0, 1.0]));

    let rim = half + 8.0;
    let ground = [(-rim, -rim), (rim, -rim), (rim, rim), (-rim, rim)];
    scene.objects.push(polygon(
        ground.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        0,
    ));
    let mut random = Random::new(SEED);
    for number in 0..size as i32 {
        let middle = [number % lots, number / lots].map(|i| lot_at(i) + LOT / 2 - extent / 2);
        add_box(&mut scene.objects, number, middle, &mut random);
    }
    Ok(scene)
}

/// Returns where a lot begins, counted from the first, in eighths.
fn lot_at(lot: i32) -> i32 {
    (lot + lot / BLOCK) * LOT
}

fn add_box(objects: &mut Vec<Object>, number: i32, middle: [i32; 2], random: &mut Random) {
    // Most houses are low; one in sixteen is a tower.
    let storeys = if random.below(16) == 0 { 320 } else { 80 };
    let height = random.between(8, storeys);
    let [a, b] = [(); 2].map(|()| random.between(6, LARGEST_HALF));
    let turn = random.below(3 * TURNS.len() as u32) as usize;
    let outline = [(-a, -b), (a, -b), (a, b), (-a, b)].map(|(x, y)| {
        let (x, y) = match TURNS.get(turn) {
            // Rounding moves corners, but walls stay vertical, hence planar.
            Some(&(sine, cosine)) => (
                (cosine * x - sine * y).div_euclid(65),
                (sine * x + cosine * y).div_euclid(65),
            ),
            None => (x, y),
        };
        [middle[0] + x, middle[1] + y].map(|c| f64::from(c) / EIGHTHS)
    });
    let at = |corner: usize, z: f64| DVec3::new(outline[corner][0], outline[corner][1], z);
    let top = f64::from(height) / EIGHTHS;
    for i in 0..4 {
        let j = (i + 1) % 4;
        objects.push(polygon(
            vec![at(i, 0.0), at(j, 0.0), at(j, top), at(i, top)],
            1,
        ));
    }
    objects.push(polygon((0..4).map(|i| at(i, top)).collect(), 1));
    if number % 4 == 0 {
        objects.push(polygon((0..4).rev().map(|i| at(i, 0.0)).collect(), 1));
    }
}
