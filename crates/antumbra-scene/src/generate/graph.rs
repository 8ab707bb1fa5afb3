//! Graph: a bar chart on a floor, after the paper's picture of that name.
//!
//! In: nothing. Out: 12 objects, two lights: a floor, a wall behind, and five bars, each a tube with a ball
//! of the same radius on top. The paper gives counts, a small picture and no data.

use antumbra_geometry::DVec3;

use crate::model::{Color, Scene};

use super::{
    parts::{ball, face, floor, matt, set_look, tube},
    stage,
};

/// Bars: height and color.
const BARS: [(f64, [f64; 3]); 5] = [
    (2.25, [0.6, 0.16, 0.1]),
    (3.5, [0.7, 0.45, 0.1]),
    (2.75, [0.22, 0.42, 0.18]),
    (5.0, [0.12, 0.3, 0.55]),
    (4.25, [0.35, 0.2, 0.45]),
];
const RADIUS: f64 = 0.75;
/// From the middle of a bar to the next.
const PITCH: f64 = 2.5;

/// Makes the bar chart.
pub fn graph() -> Scene {
    let lights = [DVec3::new(-8.0, -7.0, 11.0), DVec3::new(7.0, -9.0, 10.0)];
    let mut scene = stage(
        DVec3::new(-3.5, -15.0, 10.0),
        DVec3::new(0.25, 0.25, 1.625),
        DVec3::Z,
        &lights,
    );
    scene.background = Color::new(0.75, 0.8, 0.85);
    set_look(&mut scene, &[[0.65, 0.64, 0.6], [0.42, 0.43, 0.46]], 42.0);
    let ground = matt(&mut scene, [0.58, 0.57, 0.54]);
    floor(&mut scene, [-12.0, -8.0], [12.0, 4.0], 0.0, ground);
    let wall = [[-12.0, 0.0], [12.0, 0.0], [12.0, 9.0], [-12.0, 9.0]];
    face(&mut scene, &wall.map(|[x, z]| [x, 4.0, z]), ground);
    for (number, (height, color)) in BARS.into_iter().enumerate() {
        let x = PITCH * (number as f64 - 2.0);
        let paint = matt(&mut scene, color);
        let top = [x, 0.0, height - RADIUS];
        tube(&mut scene, ([x, 0.0, 0.0], RADIUS), (top, RADIUS), paint);
        ball(&mut scene, top, RADIUS, paint);
    }
    scene
}
