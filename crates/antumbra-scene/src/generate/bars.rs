//! Bars: a lattice of bars over a floor, after the paper's picture of that name.
//!
//! In: nothing. Out: 88 objects, one light: 14 bars of six faces each in two layers that cross, a floor, two
//! walls, and a ball on which the lattice's shadow bends. The paper gives counts, a small picture and no data.

use antumbra_geometry::DVec3;

use crate::model::{Color, Scene};

use super::{
    parts::{ball, closed_box, face, floor, matt, set_look},
    stage,
};

const BARS_EACH_WAY: u32 = 7;
/// From the middle of a bar to the next, and half a bar's thickness.
const PITCH: f64 = 1.5;
const HALF: f64 = 0.3125;
/// Half a bar's length.
const REACH: f64 = 5.75;
/// Where the lower layer begins.
const HEIGHT: f64 = 4.0;

/// Makes the lattice.
pub fn bars() -> Scene {
    let mut scene = stage(
        DVec3::new(-7.5, -17.5, 12.0),
        DVec3::new(0.5, 0.25, 1.25),
        DVec3::Z,
        &[DVec3::new(-5.0, -6.0, 15.0)],
    );
    scene.background = Color::new(0.75, 0.8, 0.85);
    set_look(&mut scene, &[[0.8, 0.78, 0.74]], 42.0);
    let ground = matt(&mut scene, [0.52, 0.5, 0.46]);
    let wood = matt(&mut scene, [0.42, 0.24, 0.12]);
    let red = matt(&mut scene, [0.55, 0.1, 0.07]);
    let side = 8.0;
    floor(&mut scene, [-side, -side], [side, side], 0.0, ground);
    let wall = [[-side, 0.0], [side, 0.0], [side, 7.0], [-side, 7.0]];
    face(&mut scene, &wall.map(|[x, z]| [x, side, z]), ground);
    face(&mut scene, &wall.map(|[y, z]| [side, -y, z]), ground);
    ball(&mut scene, [-1.0, -2.0, 1.5], 1.5, red);
    for number in 0..BARS_EACH_WAY {
        let middle = PITCH * (f64::from(number) - 3.0);
        let (from, to) = (middle - HALF, middle + HALF);
        let top = HEIGHT + 2.0 * HALF;
        closed_box(&mut scene, [from, -REACH, HEIGHT], [to, REACH, top], wood);
        closed_box(
            &mut scene,
            [-REACH, from, top],
            [REACH, to, top + 2.0 * HALF],
            wood,
        );
    }
    scene
}
