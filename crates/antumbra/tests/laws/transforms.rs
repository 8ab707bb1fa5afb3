//! Changes of the numbers that keep every sign: scales, translations, mirrors, axes, winding.

use antumbra_geometry::{DVec3, LightShape, Opacity};

use crate::common::Random;
use crate::{Change, Shape, World, seeds};

#[test]
fn scaling_by_powers_of_two_changes_nothing() {
    // All signs are those of polynomials that are homogeneous in lengths.
    let mut checked = 0;
    let mut tried = 0;
    for seed in seeds(60) {
        let world = World::nasty(seed);
        let before = world.answers();
        let random = &mut Random(seed);
        // Where products lose bits to underflow, far below, and as large as is taken.
        for exponent in [
            random.pick(&[-1, 1, 3, 50, -60]),
            -350 - random.below(12) as i32,
            random.pick(&[-175, -180, -265, -270, -500, -900, 85]),
        ] {
            tried += before.len();
            let (scale, inverse) = (2f64.powi(exponent), 2f64.powi(-exponent));
            let by = |factor: f64| move |p: DVec3| p * factor;
            let (there, back) = (by(scale), by(inverse));
            let [there, back] = [(&there, scale), (&back, inverse)].map(|(by, length)| Change {
                point: by as &dyn Fn(DVec3) -> DVec3,
                vector: by,
                length,
            });
            let Some(kept) = world.exact_under(&there, &back) else {
                continue;
            };
            let expected = if kept.numbers().len() == world.numbers().len() {
                before.clone()
            } else {
                kept.answers()
            };
            kept.assert_same(
                &format!("times 2^{exponent}"),
                &expected,
                &kept.changed(&there).answers(),
            );
            checked += expected.len();
        }
    }
    assert!(
        checked * 2 > tried && checked > 10_000,
        "only {checked} of {tried} answers were checked"
    );
}

#[test]
fn the_length_of_a_direction_does_not_matter() {
    let mut checked = 0;
    for seed in seeds(60) {
        let mut world = World::nasty(seed);
        world
            .lights
            .retain(|light| matches!(light, LightShape::Direction(_)));
        if world.lights.is_empty() {
            continue;
        }
        for exponent in [-25 - (seed % 30) as i32, 9, -300, -1000] {
            // Where no bit is lost.
            let longer = |direction: DVec3| direction * 2f64.powi(exponent);
            let is_exact = |light: &LightShape| {
                let direction = light.homogeneous().0;
                let longer = longer(direction);
                longer.abs().max_element() <= 2f64.powi(100)
                    && longer * 2f64.powi(-exponent) == direction
            };
            let mut kept = world.clone();
            kept.lights.retain(is_exact);
            let mut other = kept.clone();
            for light in &mut other.lights {
                if let LightShape::Direction(direction) = light {
                    *direction = longer(*direction);
                }
            }
            if kept.lights.is_empty() {
                continue;
            }
            let expected = kept.answers();
            kept.assert_same("length", &expected, &other.answers());
            checked += expected.len();
        }
    }
    assert!(checked > 10_000, "{checked}");
}

#[test]
fn dyadic_translations_change_nothing() {
    // All signs are those of polynomials in differences of positions; a plane's dominant axis and
    // the start that is moved along it go with the plane.
    let mut checked = 0;
    let mut tried = 0;
    for seed in seeds(96) {
        let world = World::nasty(seed);
        let size = world.occluders().bounds().size().max_element();
        let step = 2f64.powi(size.log2().ceil() as i32);
        // Rounded to the last bits that leave room to move, and no further off a surface than a
        // start may be.
        let last = step * 2f64.powi(-42);
        let world = world.changed(&Change {
            point: &|p| (p / last).round() * last,
            vector: &|v| v,
            length: 1.0,
        });
        for by in [
            DVec3::new(1.0, -2.0, 0.5) * step,
            DVec3::new(-16.0, 64.0, 256.0) * step,
        ] {
            tried += world.starts.len() * world.lights.len();
            let (there, back) = (move |p: DVec3| p + by, move |p: DVec3| p - by);
            let [there, back] = [
                &there as &dyn Fn(DVec3) -> DVec3,
                &back as &dyn Fn(DVec3) -> DVec3,
            ]
            .map(|point| Change {
                point,
                vector: &|v| v,
                length: 1.0,
            });
            // Drop the elements that would be rounded, with the starts on them.
            let mut rest = world.clone();
            let is_exact = |element: &(Shape, Opacity)| {
                let alone = World {
                    elements: vec![*element],
                    lights: Vec::new(),
                    starts: Vec::new(),
                    label: String::new(),
                };
                alone.changed(&there).changed(&back).numbers() == alone.numbers()
            };
            let mut place = vec![None; world.elements.len()];
            rest.elements.clear();
            for (i, element) in world.elements.iter().enumerate() {
                if is_exact(element) {
                    place[i] = Some(rest.elements.len());
                    rest.elements.push(*element);
                }
            }
            rest.starts.retain_mut(|(_, surface)| match surface {
                None => true,
                Some((element, _)) => match place[*element] {
                    None => false,
                    Some(new) => {
                        *element = new;
                        true
                    }
                },
            });
            if rest.elements.is_empty() {
                continue;
            }
            let Some(kept) = rest.exact_under(&there, &back) else {
                continue;
            };
            let expected = kept.answers();
            kept.assert_same(
                &format!("moved by {by}"),
                &expected,
                &kept.changed(&there).answers(),
            );
            checked += expected.len();
        }
    }
    assert!(
        checked * 3 > tried * 2 && checked > 20_000,
        "only {checked} of {tried} answers were checked"
    );
}

/// A start on a plane moves along the axis of the normal's largest component, and of equal ones
/// along the lowest. Mirrors keep the components' magnitudes and so the axis. Swapped axes keep it
/// as well unless the largest is not single; then another axis is the lowest, and a start that is
/// rounded off the plane goes to another point of it. Such starts are left out: if the two largest
/// components differ by less than the rounding of their computation, they may be equal.
fn may_tie(shape: &Shape) -> bool {
    let (normal, room) = match *shape {
        Shape::Sphere(_) => return false,
        Shape::Triangle([a, b, c]) => {
            let (u, v) = (b - a, c - a);
            let room = 1e-14 * u.abs().max_element() * v.abs().max_element();
            (u.cross(v).abs(), room)
        }
        // The caps' normals.
        Shape::Cone(cone) => ((cone.apex - cone.base).abs(), 0.0),
        Shape::Disk(disk) => (disk.normal.abs(), 0.0),
    };
    let mut sizes = normal.to_array();
    sizes.sort_by(f64::total_cmp);
    sizes[2] - sizes[1] <= room + 1e-14 * sizes[2]
}

#[test]
fn mirrors_change_nothing_but_the_winding() {
    for seed in seeds(60) {
        let world = World::nasty(seed);
        let expected = world.answers();
        let mirror = [
            DVec3::new(-1.0, 1.0, 1.0),
            DVec3::new(1.0, -1.0, 1.0),
            DVec3::new(1.0, 1.0, -1.0),
        ][seed as usize % 3];
        let turn = move |p: DVec3| p * mirror;
        let mirrored = world.changed(&Change {
            point: &turn,
            vector: &turn,
            length: 1.0,
        });
        world.assert_same(
            "mirror",
            &with_flipped_triangles(&world, &expected),
            &mirrored.answers(),
        );
    }
}

#[test]
fn swapping_axes_changes_nothing_but_the_winding() {
    let (mut checked, mut tried) = (0, 0);
    for seed in seeds(60) {
        let mut world = World::nasty(seed);
        tried += world.starts.len();
        let elements = world.elements.clone();
        world.starts.retain(|&(_, surface)| {
            surface.is_none_or(|(element, _)| !may_tie(&elements[element].0))
        });
        checked += world.starts.len();
        let expected = world.answers();
        type Swap = (fn(DVec3) -> DVec3, bool);
        let swaps: [Swap; 3] = [
            (|p| DVec3::new(p.y, p.z, p.x), false),
            (|p| DVec3::new(p.y, p.x, p.z), true),
            (|p| DVec3::new(p.z, p.y, p.x), true),
        ];
        let (swap, is_odd) = swaps[seed as usize % 3];
        let swapped = world.changed(&Change {
            point: &swap,
            vector: &swap,
            length: 1.0,
        });
        let expected = if is_odd {
            with_flipped_triangles(&world, &expected)
        } else {
            expected
        };
        world.assert_same("swapped axes", &expected, &swapped.answers());
    }
    assert!(checked * 2 > tried, "only {checked} of {tried} starts");
}

/// The side of the light flips for starts on triangles; nothing else changes.
fn with_flipped_triangles(world: &World, answers: &[(bool, i8)]) -> Vec<(bool, i8)> {
    let is_on_triangle = |start: usize| {
        world.starts[start]
            .1
            .is_some_and(|(element, _)| matches!(world.elements[element].0, Shape::Triangle(_)))
    };
    answers
        .iter()
        .enumerate()
        .map(|(i, &(blocked, side))| {
            let flips = is_on_triangle(i / world.lights.len());
            (blocked, if flips { -side } else { side })
        })
        .collect()
}

#[test]
fn winding_decides_the_side_and_nothing_else() {
    for seed in seeds(60) {
        let world = World::nasty(seed);
        let mut turned = world.clone();
        for (shape, _) in &mut turned.elements {
            if let Shape::Triangle(corners) = shape {
                // Any odd permutation.
                corners.swap(seed as usize % 3, (seed as usize + 1) % 3);
            }
        }
        let expected = with_flipped_triangles(&world, &world.answers());
        world.assert_same("winding", &expected, &turned.answers());
    }
}
