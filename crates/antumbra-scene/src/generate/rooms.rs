//! Rooms: a flat without a roof, doors between its rooms; the case of very many lights, few of which reach a
//! point.
//!
//! In: the number of rooms along a side, the number of lights. Out: a floor, walls with doors, a table, a
//! column and a ball in each room; lights hang below the walls' upper edge, room after room. Invariant:
//! coordinates are whole sixteenths, which six digits say exactly up to the largest size.

use antumbra_geometry::DVec3;

use crate::model::{Color, Light, LightKind, Scene};

use super::{
    GenerateError, check_lights, check_size,
    parts::{ball, closed_box, floor, matt, tube},
    random::Random,
    stage,
};

/// The largest size.
const LARGEST: u32 = 12;
/// The most lights.
const MOST_LIGHTS: u32 = 10_000;

/// Of the furniture, which is the same for any number of lights.
const SEED: u64 = 0x2005;
const LAMP_SEED: u64 = 0x1A3B;
/// Coordinates below are in sixteenths of a unit.
const SIXTEENTHS: f64 = 16.0;
/// From the middle of a wall to the next, half a wall's thickness, and its height.
const PITCH: i32 = 96;
const HALF_WALL: i32 = 2;
const HEIGHT: i32 = 44;
/// Half the width of a door, and its height.
const HALF_DOOR: i32 = 12;
const DOOR: i32 = 34;
/// How high lights hang.
const LAMP: i32 = 38;
/// How far furniture stays from the middle of a wall.
const AISLE: i32 = 16;

/// Makes `size` times `size` rooms with so many lights.
///
/// # Errors
/// The size is not from 1 to 12, or the lights not from 1 to 10,000.
pub fn rooms(size: u32, lights: u32) -> Result<Scene, GenerateError> {
    check_size("rooms", size, 1..=LARGEST)?;
    check_lights(lights, 1..=MOST_LIGHTS)?;
    let rooms = size as i32;
    let half = f64::from(rooms * PITCH) / (2.0 * SIXTEENTHS);
    let mut lamp_place = Random::new(LAMP_SEED);
    let lamps: Vec<_> = (0..lights)
        .map(|number| {
            let room = lamp_room(number, size);
            let [x, y] = [room % size, room / size]
                .map(|i| i as i32 * PITCH + PITCH / 2 + lamp_place.between(-20, 20));
            at(rooms, [x, y, LAMP])
        })
        .collect();
    let mut scene = stage(
        DVec3::new(0.0, -half, 2.75 * half),
        DVec3::new(0.0, -0.0625 * half, 0.0),
        DVec3::Z,
        &[],
    );
    scene.background = Color::new(0.04, 0.06, 0.12);
    let strength = 0.5 * (f64::from(size * size) / f64::from(lights)).min(1.0);
    scene.lights = lamps
        .into_iter()
        .enumerate()
        .map(|(number, position)| Light {
            name: format!("light {}", number + 1),
            kind: LightKind::Point { position },
            color: Color::splat(strength),
            falls_off: false,
        })
        .collect();
    scene.ambient = Color::splat(crate::defaults::nff_intensity(scene.lights.len()));

    let ground = matt(&mut scene, [0.45, 0.36, 0.27]);
    let plaster = matt(&mut scene, [0.6, 0.58, 0.53]);
    let wood = matt(&mut scene, [0.42, 0.24, 0.12]);
    let colors = [[0.6, 0.14, 0.1], [0.15, 0.35, 0.65], [0.25, 0.45, 0.18]]
        .map(|color| matt(&mut scene, color));
    let rim = half + f64::from(HALF_WALL) / SIXTEENTHS;
    floor(&mut scene, [-rim, -rim], [rim, rim], 0.0, ground);
    let mut block = |low, high, material| {
        let [low, high] = [low, high].map(|corner| at(rooms, corner).to_array());
        closed_box(&mut scene, low, high, material);
    };
    for line in 0..=rooms {
        for cell in 0..rooms {
            // Along x, then along y.
            for is_along_y in [false, true] {
                let across = [line * PITCH - HALF_WALL, line * PITCH + HALF_WALL];
                let is_outer = line == 0 || line == rooms;
                let mut piece = |from: i32, to: i32, low: i32| {
                    let (low, high) = match is_along_y {
                        false => ([from, across[0], low], [to, across[1], HEIGHT]),
                        true => ([across[0], from, low], [across[1], to, HEIGHT]),
                    };
                    block(low, high, plaster);
                };
                // Walls meet without lying in each other: those along y stop short.
                let gap = if is_along_y { HALF_WALL } else { 0 };
                let mut reach = [cell * PITCH + gap, (cell + 1) * PITCH - gap];
                if !is_along_y && cell == 0 {
                    reach[0] -= HALF_WALL;
                }
                if !is_along_y && cell == rooms - 1 {
                    reach[1] += HALF_WALL;
                }
                if is_outer {
                    piece(reach[0], reach[1], 0);
                } else {
                    let middle = cell * PITCH + PITCH / 2;
                    piece(reach[0], middle - HALF_DOOR, 0);
                    piece(middle + HALF_DOOR, reach[1], 0);
                    piece(middle - HALF_DOOR, middle + HALF_DOOR, DOOR);
                }
            }
        }
    }
    let mut random = Random::new(SEED);
    for room in 0..rooms * rooms {
        let corner = [room % rooms * PITCH, room / rooms * PITCH];
        furnish(&mut scene, rooms, corner, wood, colors, &mut random);
    }
    Ok(scene)
}

/// Returns the room of a light: the middle one first, then one after the other.
fn lamp_room(number: u32, size: u32) -> u32 {
    let count = size * size;
    (count / 2 + number) % count
}

/// A table with four legs, a column and a ball, each in its own part of the room.
fn furnish(
    scene: &mut Scene,
    rooms: i32,
    corner: [i32; 2],
    wood: usize,
    colors: [usize; 3],
    random: &mut Random,
) {
    let mut inside = |least: i32, most: i32| random.between(least, most);
    let [x, y] = [
        corner[0] + inside(AISLE + 8, 26),
        corner[1] + inside(AISLE + 8, 26),
    ];
    let [wide, deep] = [inside(9, 13), inside(6, 9)];
    let box_at = |scene: &mut Scene, low: [i32; 3], high: [i32; 3], material| {
        let [low, high] = [low, high].map(|corner| at(rooms, corner).to_array());
        closed_box(scene, low, high, material);
    };
    box_at(
        scene,
        [x - wide, y - deep, 13],
        [x + wide, y + deep, 15],
        wood,
    );
    for [left, front] in [[-1, -1], [1, -1], [-1, 1], [1, 1]] {
        let leg = [x + left * (wide - 2), y + front * (deep - 2)];
        let foot = [leg[0] - 1, leg[1] - 1, 0];
        box_at(scene, foot, [leg[0] + 1, leg[1] + 1, 13], wood);
    }
    let far = PITCH - AISLE;
    let column = [
        corner[0] + inside(far - 14, far - 6),
        corner[1] + inside(far - 14, far - 6),
    ];
    let color = colors[inside(0, 2) as usize];
    let [foot, top] = [0, 26].map(|z| at(rooms, [column[0], column[1], z]).to_array());
    tube(scene, (foot, 0.25), (top, 0.25), color);
    ball(scene, top, 0.4375, color);
    let radius = inside(5, 9);
    let middle = [
        corner[0] + inside(far - 14, far - 6),
        corner[1] + inside(AISLE + 8, 30),
        radius,
    ];
    let color = colors[inside(0, 2) as usize];
    ball(
        scene,
        at(rooms, middle).to_array(),
        f64::from(radius) / SIXTEENTHS,
        color,
    );
}

/// Returns a place, the middle of the flat being the origin.
fn at(rooms: i32, [x, y, z]: [i32; 3]) -> DVec3 {
    let shift = rooms * PITCH / 2;
    DVec3::from_array([x - shift, y - shift, z].map(f64::from)) / SIXTEENTHS
}
