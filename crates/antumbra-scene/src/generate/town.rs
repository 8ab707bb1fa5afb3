//! Town: gabled houses around courtyards, as city models of level of detail 2 have them; the case of sun studies.
//!
//! In: the number of houses. Out: a ground, and seven faces a house: four walls, of which two end in gables, two
//! slopes of a roof, and for every fourth house a floor in the plane of the ground. Eight houses stand around a
//! courtyard, and streets run between such blocks. Units are metres, z is up. Invariant: coordinates are whole
//! eighths, so every face is exactly planar. One light: a sun, as a far point because NFF knows no other.

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_material,
    model::{Object, Scene},
};

use super::{GenerateError, check_size, polygon, random::Random, stage};

/// The largest size.
const LARGEST: u32 = 1_000_000;

/// Coordinates are counted in eighths of a metre.
const EIGHTHS: f64 = 8.0;
/// From the corner of a house to its neighbour's: 18.5 m.
const LOT: i32 = 148;
/// From a block to the next: 70 m.
const BLOCK: i32 = 560;
/// The lots of a block, without the courtyard in the middle.
const LOTS: [[i32; 2]; 8] = [
    [0, 0],
    [1, 0],
    [2, 0],
    [2, 1],
    [2, 2],
    [1, 2],
    [0, 2],
    [0, 1],
];

const SEED: u64 = 0x70_3717;

/// Makes a town of `size` houses.
///
/// # Errors
/// The size is not from 1 to 1,000,000.
pub fn town(size: u32) -> Result<Scene, GenerateError> {
    check_size("town", size, 1..=LARGEST)?;
    let blocks = size.div_ceil(LOTS.len() as u32);
    let across = (blocks.isqrt() + u32::from(blocks.isqrt().pow(2) < blocks)) as i32;
    let half = f64::from(across * BLOCK) / (2.0 * EIGHTHS);
    // From above the roofs, the sun to the left.
    let mut scene = stage(
        DVec3::new(-0.3 * half, -0.5 * half, 0.125 * half + 60.0),
        DVec3::new(0.0625 * half, 0.0, 8.0),
        DVec3::Z,
        &[DVec3::new(-8.0, -3.0, 7.0) * (half + 100.0).round()],
    );
    for color in [[0.6, 0.6, 0.55], [0.85, 0.8, 0.72], [0.7, 0.35, 0.25]] {
        let [r, g, b] = color;
        let material = nff_material([r, g, b, 1.0, 0.0, 1.0, 0.0, 1.0]);
        scene.materials.push(material);
    }
    let rim = half + 20.0;
    let ground = [(-rim, -rim), (rim, -rim), (rim, rim), (-rim, rim)];
    let ground = ground.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    scene.objects.push(polygon(ground, 0));
    let mut random = Random::new(SEED);
    for number in 0..size as i32 {
        let block = number / LOTS.len() as i32;
        let lot = LOTS[number as usize % LOTS.len()];
        let corner = [block % across, block / across].map(|i| i * BLOCK - across * BLOCK / 2);
        let corner = [0, 1].map(|axis: usize| corner[axis] + 56 + lot[axis] * LOT);
        add_house(&mut scene.objects, number, corner, &mut random);
    }
    Ok(scene)
}

/// Adds a house whose lot begins at a corner, in eighths.
fn add_house(objects: &mut Vec<Object>, number: i32, corner: [i32; 2], random: &mut Random) {
    let least = corner.map(|c| c + random.between(0, 8));
    // Even, for the ridge lies in the middle.
    let most = [
        least[0] + 2 * random.between(60, 68),
        least[1] + 2 * random.between(52, 64),
    ];
    // Most houses are low.
    let (first, second) = (random.between(0, 128), random.between(0, 128));
    let eaves = 72 + first * second / 128;
    let ridge = eaves + random.between(20, 36);
    let is_along_x = random.below(2) == 0;
    let at = |x: i32, y: i32, z: i32| {
        // Turned by a right angle, the ridge runs along y.
        let [x, y] = if is_along_x { [x, y] } else { [y, x] };
        DVec3::new(x.into(), y.into(), z.into()) / EIGHTHS
    };
    let ([a, b], [c, d]) = match is_along_x {
        true => (least, most),
        false => ([least[1], least[0]], [most[1], most[0]]),
    };
    let middle = (b + d) / 2;
    let mut add = |mut corners: Vec<DVec3>, material| {
        if !is_along_x {
            // A mirror image turns the other way round.
            corners.reverse();
        }
        objects.push(polygon(corners, material));
    };
    let wall = |from: [i32; 2], to: [i32; 2]| {
        vec![
            at(from[0], from[1], 0),
            at(to[0], to[1], 0),
            at(to[0], to[1], eaves),
            at(from[0], from[1], eaves),
        ]
    };
    add(wall([a, b], [c, b]), 1);
    add(wall([c, d], [a, d]), 1);
    let mut east = wall([c, b], [c, d]);
    east.insert(3, at(c, middle, ridge));
    add(east, 1);
    let mut west = wall([a, d], [a, b]);
    west.insert(3, at(a, middle, ridge));
    add(west, 1);
    let ridge_ends = [at(a, middle, ridge), at(c, middle, ridge)];
    add(
        vec![
            at(a, b, eaves),
            at(c, b, eaves),
            ridge_ends[1],
            ridge_ends[0],
        ],
        2,
    );
    add(
        vec![
            at(c, d, eaves),
            at(a, d, eaves),
            ridge_ends[0],
            ridge_ends[1],
        ],
        2,
    );
    if number % 4 == 0 {
        add(vec![at(a, d, 0), at(c, d, 0), at(c, b, 0), at(a, b, 0)], 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Shape;

    fn corners(object: &Object) -> &[DVec3] {
        match &object.shape {
            Shape::Polygon(polygon) => &polygon.vertices,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn houses_are_planar_and_look_outwards() {
        let scene = town(64).unwrap();
        assert_eq!(scene.objects.len(), 1 + 64 * 6 + 16);
        let mut rest = &scene.objects[1..];
        for number in 0..64 {
            let (house, others) = rest.split_at(6 + usize::from(number % 4 == 0));
            rest = others;
            let all: Vec<DVec3> = house.iter().flat_map(corners).copied().collect();
            let middle = all.iter().sum::<DVec3>() / all.len() as f64;
            for face in house {
                let corners = corners(face);
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                assert!(normal.dot(corners[0] - middle) > 0.0, "house {number}");
                // Whole eighths: no rounding.
                assert!(
                    corners
                        .iter()
                        .all(|&corner| normal.dot(corner - corners[0]) == 0.0)
                );
            }
        }
    }
}
