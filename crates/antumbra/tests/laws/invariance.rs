//! What an answer does not depend on: grid, method, order, threads, surfaces that block nothing.

use antumbra::{Counters, LightId, Method};
use antumbra_geometry::Opacity;

use crate::common::Random;
use crate::{Shape, World, seeds};

#[test]
fn grid_and_method_do_not_matter() {
    for seed in seeds(48) {
        let world = World::nasty(seed);
        let expected = world.answers_of(&world.index(Method::Naive, [1; 3]));
        for grid in [[1, 1, 1], [3, 5, 7], [13, 1, 9]] {
            for method in [Method::Grid, Method::Voxel1990] {
                let found = world.answers_of(&world.index(method, grid));
                world.assert_same(&format!("{method:?} on {grid:?}"), &expected, &found);
            }
        }
    }
    // Fine grids take long to build.
    for seed in seeds(12).step_by(if cfg!(debug_assertions) { 1 } else { 5 }) {
        let world = World::nasty(seed);
        let expected = world.answers_of(&world.index(Method::Naive, [1; 3]));
        for grid in [[64, 64, 64], [200, 3, 7]] {
            let found = world.answers_of(&world.index(Method::Voxel1990, grid));
            world.assert_same(&format!("voxels {grid:?}"), &expected, &found);
        }
    }
}

#[test]
fn the_order_of_surfaces_does_not_matter() {
    for seed in seeds(60) {
        let world = World::nasty(seed);
        let order = Random(seed).shuffled(world.elements.len());
        // Element `order[i]` is added as the `i`-th.
        let mut place = vec![0; order.len()];
        for (i, &old) in order.iter().enumerate() {
            place[old] = i;
        }
        let mut mixed = world.clone();
        mixed.elements = order.iter().map(|&old| world.elements[old]).collect();
        for (_, surface) in &mut mixed.starts {
            *surface = surface.map(|(element, part)| (place[element], part));
        }
        world.assert_same("order", &world.answers(), &mixed.answers());
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    use rayon::prelude::*;
    for seed in seeds(24) {
        let world = World::nasty(seed);
        // Enough voxels that blocks are marked in parallel.
        let work = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let index = world.index(Method::Voxel1990, [21, 20, 22]);
                let starts = world.starts(index.occluders());
                let answers: Vec<_> = starts
                    .par_iter()
                    .flat_map_iter(|start| {
                        let index = &index;
                        (0..world.lights.len()).map(move |light| {
                            let answer = index.shadow(
                                start,
                                LightId::from_index(light),
                                &mut Counters::default(),
                            );
                            answer.expect("a fine query")
                        })
                    })
                    .collect();
                answers
            })
        };
        // How each answer was decided as well: values depend on no order of work.
        let expected = work(1);
        for threads in [2, 7] {
            assert_eq!(
                work(threads),
                expected,
                "{}: {threads} threads",
                world.label
            );
        }
    }
}

#[test]
fn transparent_surfaces_change_nothing() {
    for seed in seeds(48) {
        let world = World::nasty(seed);
        let mut more = world.clone();
        // Every element of another scene and a twin of every own one, as glass: own rules of
        // twins must not wake up.
        let other = World::nasty(seed + 1000);
        more.elements.extend(other.elements);
        more.elements.extend(world.elements.iter().copied());
        for (_, opacity) in &mut more.elements[world.elements.len()..] {
            *opacity = Opacity::Transparent;
        }
        world.assert_same("glass", &world.answers(), &more.answers());
    }
}

#[test]
fn doubling_surfaces_changes_nothing() {
    // A twin of the start's planar surface has the start in its plane (rule 2) and a twin of a
    // curved one shares its own rule; for other starts two surfaces with the same numbers give the
    // same bit. Nor does it matter which twin a start names.
    for seed in seeds(48) {
        let world = World::nasty(seed);
        let expected = world.answers();
        let count = world.elements.len();
        let mut doubled = world.clone();
        doubled.elements.extend(world.elements.iter().copied());
        // The twins of triangles with their corners in another order.
        for (shape, _) in &mut doubled.elements[count..] {
            if let Shape::Triangle(corners) = shape {
                corners.rotate_left(1);
            }
        }
        world.assert_same("doubled", &expected, &doubled.answers());
        for (_, surface) in &mut doubled.starts {
            *surface = surface.map(|(element, part)| (element + count, part));
        }
        world.assert_same("on the twins", &expected, &doubled.answers());
    }
}

#[test]
fn removing_a_surface_that_blocks_nothing_changes_nothing() {
    // The answer is an "or" over surfaces: a start that is shadowed stays so when surfaces are
    // added, and one that is lit when surfaces are taken away, unless the start's own goes.
    for seed in seeds(48) {
        let world = World::nasty(seed);
        let before = world.answers();
        let mut more = world.clone();
        let other = World::nasty(seed + 12_000);
        more.elements.extend(other.elements);
        for (i, (before, after)) in before.iter().zip(more.answers()).enumerate() {
            assert!(
                after.0 || !before.0,
                "{}: answer {i} became lit by adding",
                world.label
            );
            assert_eq!(after.1, before.1, "{}: answer {i}", world.label);
        }
    }
}
