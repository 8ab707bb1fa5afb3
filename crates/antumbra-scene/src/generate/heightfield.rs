//! Height field: hills over a square; the case of one large mesh that shadows itself.
//!
//! In: the number of vertices along a side. Out: two triangles a cell, fronts upwards. Invariant:
//! heights are whole eighths and the others whole numbers, exact in `f32` and in six digits too,
//! so that rays can be aimed at vertices and edges without rounding. One light: a low sun, as a
//! far point because NFF knows no other.

use antumbra_geometry::DVec3;

use crate::{defaults::nff_material, model::Scene};

use super::{GenerateError, check_size, polygon, random::Random, stage};

/// The largest size.
const LARGEST: u32 = 2048;

const SEED: u64 = 0x1EE7;
/// Distance between neighbours, units.
const SPACING: i32 = 2;
/// The widest hills, cells from top to top, and their height in eighths. Each finer octave has
/// half of both.
const WIDEST: usize = 64;
const HIGHEST: i32 = 384;
const OCTAVES: usize = 6;

/// Makes a height field of `size` times `size` vertices.
///
/// # Errors
/// The size is not from 2 to 2048.
pub fn heightfield(size: u32) -> Result<Scene, GenerateError> {
    check_size("heightfield", size, 2..=LARGEST)?;
    let cells = size as i32 - 1;
    let half = f64::from(cells * SPACING) / 2.0;
    let mut scene = stage(
        DVec3::new(-half, -1.25 * half, 0.75 * half + 40.0),
        DVec3::new(0.0, 0.0, 20.0),
        DVec3::Z,
        &[DVec3::new(-8.0, -5.0, 3.0) * (half + 100.0).round()],
    );
    scene
        .materials
        .push(nff_material([0.5, 0.55, 0.35, 1.0, 0.0, 1.0, 0.0, 1.0]));

    let heights = heights(size as usize);
    let vertex = |x: i32, y: i32| {
        let height = heights[y as usize * size as usize + x as usize];
        DVec3::new(
            f64::from(SPACING * x) - half,
            f64::from(SPACING * y) - half,
            f64::from(height) / 8.0,
        )
    };
    scene.objects.reserve_exact(2 * (cells * cells) as usize);
    for y in 0..cells {
        for x in 0..cells {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| vertex(x + i, y + j));
            scene.objects.push(polygon(vec![a, b, c], 0));
            scene.objects.push(polygon(vec![a, c, d], 0));
        }
    }
    Ok(scene)
}

/// Returns the heights in eighths, row after row: octaves of noise, each linear between the points
/// of its own grid.
fn heights(size: usize) -> Vec<i32> {
    let mut random = Random::new(SEED);
    let mut heights = vec![0; size * size];
    for octave in 0..OCTAVES {
        let width = WIDEST >> octave;
        let side = size.div_ceil(width) + 1;
        let peaks: Vec<i32> = (0..side * side)
            .map(|_| random.between(0, HIGHEST >> octave))
            .collect();
        for (i, height) in heights.iter_mut().enumerate() {
            let [x, y] = [i % size, i / size];
            let (column, row) = (x / width, y / width);
            let [u, v] = [x % width, y % width].map(|c| c as i32);
            let w = width as i32;
            let row_at = |row: usize| {
                peaks[row * side + column] * (w - u) + peaks[row * side + column + 1] * u
            };
            *height += (row_at(row) * (w - v) + row_at(row + 1) * v) / (w * w);
        }
    }
    heights
}
