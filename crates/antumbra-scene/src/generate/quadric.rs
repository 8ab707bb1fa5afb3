//! Quadric: spheres, cones and cylinders on a globe, after the paper's picture of that name.
//!
//! In: nothing. Out: 15 objects, all quadrics, three lights. The ground is a sphere too, so that no polygon is
//! needed: all others stand on its top or hover over it. The paper gives counts and no data.

use antumbra_geometry::DVec3;

use crate::model::{Color, Scene};

use super::{
    parts::{ball, glossy, matt, set_look, tube},
    stage,
};

/// The globe's; its middle is the origin.
const GLOBE: f64 = 8.0;

/// Makes the quadrics.
pub fn quadric() -> Scene {
    let lights = [
        DVec3::new(-14.0, -9.0, 20.0),
        DVec3::new(13.0, -14.0, 17.0),
        DVec3::new(1.0, 12.0, 22.0),
    ];
    let mut scene = stage(
        DVec3::new(0.0, -14.0, 17.0),
        DVec3::new(0.0, -0.25, 8.125),
        DVec3::Z,
        &lights,
    );
    scene.background = Color::new(0.04, 0.06, 0.12);
    set_look(
        &mut scene,
        &[[0.45, 0.44, 0.42], [0.3, 0.3, 0.32], [0.2, 0.2, 0.2]],
        41.0,
    );
    let [meadow, red, gold, blue] = [
        [0.4, 0.55, 0.32],
        [0.7, 0.14, 0.1],
        [0.85, 0.6, 0.15],
        [0.15, 0.35, 0.7],
    ]
    .map(|color| matt(&mut scene, color));
    let mirror = glossy(&mut scene, [0.4, 0.4, 0.45], 0.5);
    let white = matt(&mut scene, [0.85, 0.85, 0.85]);
    ball(&mut scene, [0.0; 3], GLOBE, meadow);

    // Four towers: tubes with a cone for a roof. Their feet are below the ground.
    for ([x, y], top, radius) in [
        ([-2.75, 1.5], 10.5, 0.75),
        ([2.75, 1.75], 10.0, 0.875),
        ([-0.25, 2.75], 11.25, 0.625),
    ] {
        tube(
            &mut scene,
            ([x, y, 6.0], radius),
            ([x, y, top], radius),
            white,
        );
        let eaves = ([x, y, top - 0.125], 1.5 * radius);
        tube(&mut scene, eaves, ([x, y, top + 1.75], 0.0), red);
    }
    // A cone alone, two tilted cylinders, and balls.
    tube(
        &mut scene,
        ([3.5, -1.5, 6.25], 1.25),
        ([3.5, -1.5, 9.5], 0.0),
        gold,
    );
    tube(
        &mut scene,
        ([-4.5, -1.25, 6.0], 0.375),
        ([-2.0, -2.5, 9.0], 0.375),
        blue,
    );
    ball(&mut scene, [-2.0, -2.5, 9.0], 0.625, blue);
    ball(&mut scene, [0.0, -0.25, 9.25], 1.375, mirror);
    for ([x, y, z], radius, material) in [
        ([1.25, -2.5, 8.125], 0.75, red),
        ([-0.75, -3.25, 7.625], 0.5, gold),
        ([2.25, -3.75, 7.0], 0.625, blue),
        ([0.5, 0.5, 12.25], 0.5, gold),
    ] {
        ball(&mut scene, [x, y, z], radius, material);
    }
    scene
}
