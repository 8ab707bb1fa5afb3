//! Implicit surfaces on a floor: a knot of rings, metaballs, a gyroid.
//!
//! In: how many. Out: one object each, or one in all, over a floor. Invariant: integers and exact fractions, sines by `libm`: the same bits
//! on every platform.

use std::f64::consts::TAU;

use antumbra_geometry::{Ball, DVec3, Field, Implicit};

use crate::defaults::nff_material;
use crate::model::{Object, Scene, Shape};

use super::random::Random;
use super::{GenerateError, check_size, polygon, stage};

/// A floor under what is above z = 0, seen from above, with two lights.
fn floor() -> Scene {
    let mut scene = stage(
        DVec3::new(4.5, 7.0, 5.0),
        DVec3::new(0.0, 0.0, 1.25),
        DVec3::Z,
        &[DVec3::new(-3.0, 8.0, 12.0), DVec3::new(9.0, 4.0, 9.0)],
    );
    scene.materials = vec![
        nff_material([1.0, 0.75, 0.33, 0.8, 0.0, 1.0, 0.0, 1.0]),
        nff_material([0.55, 0.75, 0.9, 0.9, 0.1, 30.0, 0.0, 1.0]),
    ];
    let corners = [(-8.0, -8.0), (8.0, -8.0), (8.0, 8.0), (-8.0, 8.0)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    scene.objects.push(polygon(corners, 0));
    scene
}

fn object(implicit: Implicit) -> Object {
    Object {
        name: String::new(),
        shape: Shape::Implicit(Box::new(implicit)),
        material: 1,
    }
}

/// Makes a trefoil knot of `size` linked rings.
///
/// # Errors
/// The size is not from 3 to 4096.
pub fn knot(size: u32) -> Result<Scene, GenerateError> {
    check_size("knot", size, 3..=4096)?;
    let mut scene = floor();
    let place = |number: u32| {
        let angle = TAU * f64::from(number % size) / f64::from(size);
        let (s1, c1) = libm::sincos(angle);
        let (s2, c2) = libm::sincos(2.0 * angle);
        let s3 = libm::sin(3.0 * angle);
        DVec3::new(s1 + 2.0 * s2, c1 - 2.0 * c2, -s3) * 0.75 + DVec3::Z * 1.5
    };
    for number in 0..size {
        let (before, at, after) = (place(number + size - 1), place(number), place(number + 1));
        let along = (after - before).normalize();
        let step = 0.5 * (after - before).length();
        // Neighbours are turned by a quarter, as links of a chain.
        let up = along.cross(DVec3::new(0.25, 0.5, 1.0)).normalize();
        let axis = if number % 2 == 0 { up } else { up.cross(along) };
        let major = (0.8 * step).min(0.6);
        scene
            .objects
            .push(object(Implicit::torus(at, axis, major, 0.25 * major)));
    }
    Ok(scene)
}

/// Makes `size` balls that melt together.
///
/// # Errors
/// The size is not from 1 to 256.
pub fn metaballs(size: u32) -> Result<Scene, GenerateError> {
    check_size("metaballs", size, 1..=256)?;
    let mut scene = floor();
    let random = &mut Random::new(size.into());
    let balls: Vec<Ball> = (0..size)
        .map(|_| {
            let mut number = |least, most| f64::from(random.between(least, most)) / 64.0;
            Ball {
                center: DVec3::new(number(-96, 96), number(-96, 96), number(56, 152)),
                radius: number(40, 80),
                strength: 1.0,
            }
        })
        .collect();
    let field = Field::Metaballs {
        balls,
        threshold: 0.25,
    };
    // A ball reaches 80 / 64 beyond its centre.
    scene.objects.push(object(Implicit {
        field,
        low: DVec3::new(-2.75, -2.75, -0.375),
        high: DVec3::new(2.75, 2.75, 3.625),
    }));
    Ok(scene)
}

/// Makes a cube of a gyroid with `size` periods a side.
///
/// # Errors
/// The size is not from 1 to 64.
pub fn gyroid(size: u32) -> Result<Scene, GenerateError> {
    check_size("gyroid", size, 1..=64)?;
    let mut scene = floor();
    let field = Field::Gyroid {
        center: DVec3::ZERO,
        period: 3.0 / f64::from(size),
        level: 0.0,
    };
    scene.objects.push(object(Implicit {
        field,
        low: DVec3::new(-1.5, -1.5, 0.125),
        high: DVec3::new(1.5, 1.5, 3.125),
    }));
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_fine_and_within_their_boxes() {
        for scene in [knot(60), metaballs(12), gyroid(2)] {
            let scene = scene.unwrap();
            for object in &scene.objects[1..] {
                let Shape::Implicit(implicit) = &object.shape else {
                    panic!("{object:?}");
                };
                assert_eq!(implicit.check(), Ok(()));
                assert!(implicit.low.z > -0.5);
            }
        }
        let scene = metaballs(256).unwrap();
        let Shape::Implicit(implicit) = &scene.objects[1].shape else {
            panic!("{scene:?}");
        };
        let Field::Metaballs { balls, .. } = &implicit.field else {
            panic!("{implicit:?}");
        };
        for ball in balls {
            let reach = DVec3::splat(ball.radius);
            assert!((ball.center - reach).cmpge(implicit.low).all());
            assert!((ball.center + reach).cmple(implicit.high).all());
        }
    }
}
