//! What the paper says in words (Paper 8.2): how times change with the grid, the picture's size, and the lights.
//!
//! Grid and lights are varied at half the picture's size. Lights are those of the scene's first, carried around
//! the vertical through the point that the camera looks at, a fifth of a turn each.

use std::f64::consts::PI;

use antumbra_geometry::DVec3;
use antumbra_scene::model::{Light, LightKind, Scene};
use antumbra_task::Steps;

use super::figures::{Sweep, SweepPoint};
use super::race;
use super::scenes::PaperScene;
use super::shot::Subject;
use super::{GRID, VOXEL, VOXEL_1990};
use crate::contender::Contender;
use crate::measure::Stopwatch;
use crate::typed::Paper;
use antumbra_cli::failure::Failure;
use antumbra_cli::scene_source;
use antumbra_cli::values::MAX_SIDE;

/// Rivals are left out: they are measured at the paper's settings only.
const METHODS: [Contender; 3] = [GRID, VOXEL_1990, VOXEL];
const GRIDS: [u32; 8] = [10, 20, 30, 40, 50, 60, 80, 100];
/// Sizes of the picture: halvings of twice the usual one.
const HALVINGS: [u32; 5] = [4, 3, 2, 1, 0];
const MOST_LIGHTS: u32 = 5;
const ROOM_LIGHTS: [u32; 3] = [1, 10, 100];
/// As fine as the grids of the paper's scenes.
const ROOM_GRID: u32 = 40;

/// Returns how many pictures all sweeps take.
pub(super) fn picture_count(typed: &Paper, scene_count: usize) -> u64 {
    let of_scene = GRIDS.len() + widths(typed.size).len() + MOST_LIGHTS as usize;
    let points = scene_count * of_scene + ROOM_LIGHTS.len();
    points as u64 * METHODS.len() as u64 * u64::from(typed.sweep_rounds)
}

/// Returns the widths of the pictures whose size is varied: from an eighth of the usual one to twice it.
fn widths(usual: [u32; 2]) -> Vec<u32> {
    let widths = HALVINGS.map(|halvings| ((2 * usual[0]) >> halvings).max(1));
    let mut widths: Vec<u32> = widths
        .into_iter()
        .filter(|&width| width.max(height(usual, width)) <= MAX_SIDE)
        .collect();
    widths.dedup();
    widths
}

/// Returns the height of a picture of the usual shape.
fn height([usual_width, usual_height]: [u32; 2], width: u32) -> u32 {
    let height = u64::from(width) * u64::from(usual_height) / u64::from(usual_width);
    height.max(1) as u32
}

/// Measures the three sweeps of one scene.
pub(super) fn run(
    paper_scene: &PaperScene,
    typed: &Paper,
    stopwatch: Stopwatch,
    steps: &Steps,
) -> Result<[Sweep; 3], Failure> {
    let usual = paper_scene.paper.grid;
    let half = typed.size.map(|side| side.div_ceil(2));
    let sweep = |of, values: &[u32], subject: &dyn Fn(u32) -> Result<Subject, Failure>| {
        let points = values.iter().map(|&at| {
            let rounds = typed.sweep_rounds;
            let total_s = race::totals(&subject(at)?, &METHODS, rounds, stopwatch, steps)?;
            Ok(SweepPoint { at, total_s })
        });
        Ok::<Sweep, Failure>(Sweep {
            of,
            scene: paper_scene.name.to_owned(),
            points: points.collect::<Result<_, Failure>>()?,
        })
    };
    let lights: Vec<u32> = (1..=MOST_LIGHTS).collect();
    Ok([
        sweep("grid", &GRIDS, &|grid| {
            Subject::new(paper_scene.make()?, half, grid)
        })?,
        sweep("size", &widths(typed.size), &|width| {
            let height = height(typed.size, width);
            Subject::new(paper_scene.make()?, [width, height], usual)
        })?,
        sweep("lights", &lights, &|count| {
            Subject::new(with_lights(paper_scene.make()?, count), half, usual)
        })?,
    ])
}

/// Measures rooms with few and with many lights.
pub(super) fn rooms(typed: &Paper, stopwatch: Stopwatch, steps: &Steps) -> Result<Sweep, Failure> {
    let half = typed.size.map(|side| side.div_ceil(2));
    let points = ROOM_LIGHTS.iter().map(|&at| {
        let scene = scene_source::generate("rooms", None, Some(at))?;
        let subject = Subject::new(scene, half, ROOM_GRID)?;
        let rounds = typed.sweep_rounds;
        let total_s = race::totals(&subject, &METHODS, rounds, stopwatch, steps)?;
        Ok(SweepPoint { at, total_s })
    });
    Ok(Sweep {
        of: "rooms",
        scene: "rooms".to_owned(),
        points: points.collect::<Result<_, Failure>>()?,
    })
}

/// Returns the scene with `count` lights.
fn with_lights(mut scene: Scene, count: u32) -> Scene {
    let (Some(first), Some(camera)) = (scene.lights.first().cloned(), scene.camera) else {
        return scene;
    };
    let axis = scene.up.normalize_or(DVec3::Z);
    scene.lights = (0..count)
        .map(|number| {
            let angle = 2.0 * PI * f64::from(number) / f64::from(MOST_LIGHTS);
            let kind = match first.kind {
                LightKind::Point { position } => LightKind::Point {
                    position: camera.at + turned(position - camera.at, axis, angle),
                },
                other => other,
            };
            Light {
                name: format!("light {}", number + 1),
                kind,
                ..first.clone()
            }
        })
        .collect();
    scene
}

/// Returns a vector turned about a unit axis (Rodrigues' formula).
fn turned(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_varied_around_the_one_that_was_typed() {
        assert_eq!(widths([512, 512]), [64, 128, 256, 512, 1024]);
        assert_eq!(widths([80, 60]), [10, 20, 40, 80, 160]);
        assert_eq!(height([80, 60], 10), 7);
        // Each once, and none that no picture can have.
        assert_eq!(widths([1, 4]), [1, 2]);
        assert_eq!(widths([16_384, 2]), [2_048, 4_096, 8_192, 16_384]);
    }

    #[test]
    fn lights_stand_around_what_the_camera_looks_at() {
        let scene = antumbra_cli::scene_source::generate("graph", None, None).unwrap();
        let at = scene.camera.unwrap().at;
        let place = |light: &Light| match light.kind {
            LightKind::Point { position } => position - at,
            other => panic!("{other:?}"),
        };
        let first = place(&scene.lights[0]);
        let five = with_lights(scene, 5);
        assert_eq!(five.lights.len(), 5);
        assert_eq!(place(&five.lights[0]), first);
        for light in &five.lights {
            let place = place(light);
            assert!((place.z - first.z).abs() < 1e-9, "{place}");
            assert!((place.length() - first.length()).abs() < 1e-9, "{place}");
        }
    }
}
