//! Teapot: Newell's of 1975, by its published control points, on a floor.
//!
//! In: the level of its patches. Out: 32 bicubic patches and a floor of one polygon. The points are those of a quarter of the body and the lid and
//! of half of the handle and the spout; mirrored they give the rest.

use antumbra_geometry::{BezierPatch, DVec3, MAX_PATCH_LEVEL};

use crate::defaults::nff_material;
use crate::model::{Object, Scene, Shape};

use super::{GenerateError, check_size, polygon, stage};

/// Control points: x, y, z.
const POINTS: [[f64; 3]; 127] = [
    [0.2, 0.0, 2.7],
    [0.2, -0.112, 2.7],
    [0.112, -0.2, 2.7],
    [0.0, -0.2, 2.7],
    [1.3375, 0.0, 2.53125],
    [1.3375, -0.749, 2.53125],
    [0.749, -1.3375, 2.53125],
    [0.0, -1.3375, 2.53125],
    [1.4375, 0.0, 2.53125],
    [1.4375, -0.805, 2.53125],
    [0.805, -1.4375, 2.53125],
    [0.0, -1.4375, 2.53125],
    [1.5, 0.0, 2.4],
    [1.5, -0.84, 2.4],
    [0.84, -1.5, 2.4],
    [0.0, -1.5, 2.4],
    [1.75, 0.0, 1.875],
    [1.75, -0.98, 1.875],
    [0.98, -1.75, 1.875],
    [0.0, -1.75, 1.875],
    [2.0, 0.0, 1.35],
    [2.0, -1.12, 1.35],
    [1.12, -2.0, 1.35],
    [0.0, -2.0, 1.35],
    [2.0, 0.0, 0.9],
    [2.0, -1.12, 0.9],
    [1.12, -2.0, 0.9],
    [0.0, -2.0, 0.9],
    [-2.0, 0.0, 0.9],
    [2.0, 0.0, 0.45],
    [2.0, -1.12, 0.45],
    [1.12, -2.0, 0.45],
    [0.0, -2.0, 0.45],
    [1.5, 0.0, 0.225],
    [1.5, -0.84, 0.225],
    [0.84, -1.5, 0.225],
    [0.0, -1.5, 0.225],
    [1.5, 0.0, 0.15],
    [1.5, -0.84, 0.15],
    [0.84, -1.5, 0.15],
    [0.0, -1.5, 0.15],
    [-1.6, 0.0, 2.025],
    [-1.6, -0.3, 2.025],
    [-1.5, -0.3, 2.25],
    [-1.5, 0.0, 2.25],
    [-2.3, 0.0, 2.025],
    [-2.3, -0.3, 2.025],
    [-2.5, -0.3, 2.25],
    [-2.5, 0.0, 2.25],
    [-2.7, 0.0, 2.025],
    [-2.7, -0.3, 2.025],
    [-3.0, -0.3, 2.25],
    [-3.0, 0.0, 2.25],
    [-2.7, 0.0, 1.8],
    [-2.7, -0.3, 1.8],
    [-3.0, -0.3, 1.8],
    [-3.0, 0.0, 1.8],
    [-2.7, 0.0, 1.575],
    [-2.7, -0.3, 1.575],
    [-3.0, -0.3, 1.35],
    [-3.0, 0.0, 1.35],
    [-2.5, 0.0, 1.125],
    [-2.5, -0.3, 1.125],
    [-2.65, -0.3, 0.9375],
    [-2.65, 0.0, 0.9375],
    [-2.0, -0.3, 0.9],
    [-1.9, -0.3, 0.6],
    [-1.9, 0.0, 0.6],
    [1.7, 0.0, 1.425],
    [1.7, -0.66, 1.425],
    [1.7, -0.66, 0.6],
    [1.7, 0.0, 0.6],
    [2.6, 0.0, 1.425],
    [2.6, -0.66, 1.425],
    [3.1, -0.66, 0.825],
    [3.1, 0.0, 0.825],
    [2.3, 0.0, 2.1],
    [2.3, -0.25, 2.1],
    [2.4, -0.25, 2.025],
    [2.4, 0.0, 2.025],
    [2.7, 0.0, 2.4],
    [2.7, -0.25, 2.4],
    [3.3, -0.25, 2.4],
    [3.3, 0.0, 2.4],
    [2.8, 0.0, 2.475],
    [2.8, -0.25, 2.475],
    [3.525, -0.25, 2.49375],
    [3.525, 0.0, 2.49375],
    [2.9, 0.0, 2.475],
    [2.9, -0.15, 2.475],
    [3.45, -0.15, 2.5125],
    [3.45, 0.0, 2.5125],
    [2.8, 0.0, 2.4],
    [2.8, -0.15, 2.4],
    [3.2, -0.15, 2.4],
    [3.2, 0.0, 2.4],
    [0.0, 0.0, 3.15],
    [0.8, 0.0, 3.15],
    [0.8, -0.45, 3.15],
    [0.45, -0.8, 3.15],
    [0.0, -0.8, 3.15],
    [0.0, 0.0, 2.85],
    [1.4, 0.0, 2.4],
    [1.4, -0.784, 2.4],
    [0.784, -1.4, 2.4],
    [0.0, -1.4, 2.4],
    [0.4, 0.0, 2.55],
    [0.4, -0.224, 2.55],
    [0.224, -0.4, 2.55],
    [0.0, -0.4, 2.55],
    [1.3, 0.0, 2.55],
    [1.3, -0.728, 2.55],
    [0.728, -1.3, 2.55],
    [0.0, -1.3, 2.55],
    [1.3, 0.0, 2.4],
    [1.3, -0.728, 2.4],
    [0.728, -1.3, 2.4],
    [0.0, -1.3, 2.4],
    [0.0, 0.0, 0.0],
    [1.425, -0.798, 0.0],
    [1.5, 0.0, 0.075],
    [1.425, 0.0, 0.0],
    [0.798, -1.425, 0.0],
    [0.0, -1.5, 0.075],
    [0.0, -1.425, 0.0],
    [1.5, -0.84, 0.075],
    [0.84, -1.5, 0.075],
];

/// Numbers of the control points of each patch, row by row.
const PATCHES: [[usize; 16]; 10] = [
    [102, 103, 104, 105, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
    [
        12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27,
    ],
    [
        24, 25, 26, 27, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40,
    ],
    [
        96, 96, 96, 96, 97, 98, 99, 100, 101, 101, 101, 101, 0, 1, 2, 3,
    ],
    [
        0, 1, 2, 3, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 116, 117,
    ],
    [
        118, 118, 118, 118, 124, 122, 119, 121, 123, 126, 125, 120, 40, 39, 38, 37,
    ],
    [
        41, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56,
    ],
    [
        53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 64, 28, 65, 66, 67,
    ],
    [
        68, 69, 70, 71, 72, 73, 74, 75, 76, 77, 78, 79, 80, 81, 82, 83,
    ],
    [
        80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92, 93, 94, 95,
    ],
];

/// So many of the first patches are a quarter of what they are part of; the others are half of it.
const QUARTERS: usize = 6;

/// Makes a teapot of patches of level `size`.
///
/// # Errors
/// The size is not from 1 to 12.
pub fn teapot(size: u32) -> Result<Scene, GenerateError> {
    check_size("teapot", size, 1..=MAX_PATCH_LEVEL)?;
    let mut scene = stage(
        DVec3::new(4.86, 7.2, 5.4),
        DVec3::new(0.3, 0.0, 1.2),
        DVec3::Z,
        &[DVec3::new(-3.1, 9.8, 12.1), DVec3::new(11.3, 5.1, 8.8)],
    );
    scene.materials = vec![
        nff_material([1.0, 0.75, 0.33, 0.8, 0.0, 1.0, 0.0, 1.0]),
        nff_material([0.9, 0.9, 0.95, 0.9, 0.1, 30.0, 0.0, 1.0]),
    ];
    let floor = [(-8.0, -8.0), (8.0, -8.0), (8.0, 8.0), (-8.0, 8.0)];
    let floor = floor.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    scene.objects.push(polygon(floor, 0));
    for (number, patch) in PATCHES.iter().enumerate() {
        for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            if x < 0.0 && number >= QUARTERS {
                continue;
            }
            let mirror = DVec3::new(x, y, 1.0);
            let point = |row: usize, place: usize| {
                // Mirrored once, a patch is run through the other way, so that its front stays outside.
                let place = if x * y > 0.0 { place } else { 3 - place };
                DVec3::from_array(POINTS[patch[4 * row + place]]) * mirror
            };
            let control = std::array::from_fn(|j| std::array::from_fn(|i| point(j, i)));
            let patch = BezierPatch {
                control,
                level: size,
            };
            scene.objects.push(Object {
                name: String::new(),
                shape: Shape::Patch(Box::new(patch)),
                material: 1,
            });
        }
    }
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_are_outside_and_neighbours_share_sides() {
        let scene = teapot(4).unwrap();
        assert_eq!(scene.objects.len(), 33);
        let patches: Vec<&BezierPatch> = scene
            .objects
            .iter()
            .filter_map(|object| match &object.shape {
                Shape::Patch(patch) => Some(&**patch),
                _ => None,
            })
            .collect();
        // The sides of the body look away from its axis.
        for patch in &patches[4..8] {
            let (place, normal) = (patch.vertex(8, 8), patch.normal(8, 8));
            assert!(
                normal.dot(place * DVec3::new(1.0, 1.0, 0.0)) > 0.0,
                "{place} {normal}"
            );
        }
        // Every side of a patch of the body is a side of another one, but for the rim's.
        let side = |patch: &BezierPatch, number: usize| {
            let mut points: Vec<[u64; 3]> = (0..4)
                .map(|i| {
                    let point = match number {
                        0 => patch.control[0][i],
                        1 => patch.control[3][i],
                        2 => patch.control[i][0],
                        _ => patch.control[i][3],
                    };
                    // Minus zero is zero.
                    point.to_array().map(|x| (x + 0.0).to_bits())
                })
                .collect();
            points.sort_unstable();
            points
        };
        for one in 4..8 {
            for number in 0..4 {
                let wanted = side(patches[one], number);
                let mut others = (0..12).filter(|&other| other != one);
                assert!(others.any(|other| (0..4).any(|k| side(patches[other], k) == wanted)));
            }
        }
    }
}
