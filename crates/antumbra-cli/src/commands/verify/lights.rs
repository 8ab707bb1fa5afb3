//! More lights at delicate places.
//!
//! In: a seed, a number. Out: a light, a pure function of these and the scene: in the middle of
//! things, touching surfaces, in the planes of faces, far away.

use antumbra_geometry::DVec3;
use antumbra_scene::model::{Color, Light, LightKind};

use super::random::Random;
use super::surfaces::{Surfaces, in_triangle};

/// Places of lights; they take turns.
const PLACE_COUNT: u64 = 12;

/// Returns so many lights.
pub(super) fn more(count: u32, seed: u64, surfaces: &Surfaces<'_>) -> Vec<Light> {
    (0..u64::from(count))
        .map(|number| {
            let mut random = Random::new(seed ^ 0x11_6874, number);
            let kind = kind(number % PLACE_COUNT, &mut random, surfaces)
                .filter(is_fine)
                .unwrap_or_else(|| LightKind::Point {
                    position: random.in_box(&surfaces.reach),
                });
            Light {
                name: format!("attack {number}"),
                kind,
                color: Color::ONE,
                falls_off: false,
            }
        })
        .collect()
}

fn is_fine(kind: &LightKind) -> bool {
    const LARGEST: f64 = 1e30;
    match *kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => {
            position.is_finite() && position.abs().max_element() < LARGEST
        }
        LightKind::Directional { towards_light } => {
            towards_light.is_finite()
                && towards_light != DVec3::ZERO
                && towards_light.abs().max_element() < LARGEST
        }
    }
}

fn kind(place: u64, random: &mut Random, surfaces: &Surfaces<'_>) -> Option<LightKind> {
    let at = |position| Some(LightKind::Point { position });
    let towards = |towards_light| Some(LightKind::Directional { towards_light });
    let size = surfaces.size;
    let corners = |random: &mut Random| surfaces.any_triangle(random).map(|(_, corners)| corners);
    match place {
        0 => at(random.in_box(&surfaces.reach)),
        // Near a surface.
        1 => {
            let surface = surfaces.by_area(random)?;
            let start = surfaces.point_on(random, surface)?;
            let height = size * random.power_of_ten(-15.0, -2.0);
            at(start.point + height * random.direction())
        }
        // At a vertex.
        2 => {
            let corners = corners(random)?;
            at(random.one_of(&corners))
        }
        // Over everything.
        3 => {
            let mut position = random.in_box(&surfaces.reach);
            let axis = random.below(3);
            position[axis] = surfaces.reach.max[axis] + size * random.draw();
            at(position)
        }
        // In the plane of a triangle, exactly where halves do not round.
        4 => {
            let [a, b, c] = corners(random)?;
            let share = |random: &mut Random| random.one_of(&[-8.0, -1.0, -0.5, 0.5, 2.0, 8.0]);
            at(a + share(random) * (b - a) + share(random) * (c - a))
        }
        5 => at(size * random.power_of_ten(1.0, 9.0) * random.direction()),
        // Along an axis.
        6 => {
            let mut direction = DVec3::ZERO;
            direction[random.below(3)] = random.one_of(&[-1.0, 1.0]);
            towards(direction)
        }
        7 => towards(random.direction()),
        // A hair from an edge or a vertex.
        8 => {
            let [a, b, _] = corners(random)?;
            let along = random.one_of(&[0.0, 0.5, 1.0]);
            let step = size * random.power_of_ten(-16.0, -3.0);
            at(a + along * (b - a) + step * random.direction())
        }
        // Along a triangle.
        9 => {
            let [a, b, c] = corners(random)?;
            let share = random.one_of(&[0.0, 0.0, 1.0, -0.5]);
            towards((b - a) + share * (c - a))
        }
        // On a triangle.
        10 => {
            let corners = corners(random)?;
            at(in_triangle(random, corners))
        }
        // Nearly along an axis.
        _ => {
            let mut direction = random.power_of_ten(-16.0, -1.0) * random.direction();
            direction[random.below(3)] = 1.0;
            towards(direction)
        }
    }
}
