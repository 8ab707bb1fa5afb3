//! Nearest hits against brute force, and meshes that let no ray through.

use std::sync::Arc;

use antumbra::{Counters, GridResolution, Method, ShadowIndex};
use antumbra_geometry::{Cone, DVec3, LightShape, Occluders, Opacity, Ray, SurfaceId};

use crate::common::Random;
use crate::values::point_of;
use crate::{World, seeds};

/// Rays that a mesh must not let through, and rays that tie.
fn nearest_everywhere(label: &str, occluders: &Arc<Occluders>, rays: &[Ray]) -> Vec<bool> {
    let grids = [[1, 1, 1], [2, 3, 5], [16, 16, 16], [40, 7, 33]];
    let indices = grids.map(|grid| {
        ShadowIndex::builder(occluders.clone(), Vec::new())
            .method(Method::Grid)
            .grid(GridResolution::Fixed(grid))
            .build()
            .expect("settings are in range")
    });
    rays.iter()
        .map(|ray| {
            let bits = |index: &ShadowIndex| {
                index.nearest(ray, &mut Counters::default()).map(|hit| {
                    let numbers = [hit.distance, hit.barycentric[0], hit.barycentric[1]];
                    let point = hit.point.to_array();
                    (
                        hit.surface,
                        numbers.map(f64::to_bits),
                        point.map(f64::to_bits),
                    )
                })
            };
            // One voxel: every surface is tested.
            let expected = bits(&indices[0]);
            for (grid, index) in grids.iter().zip(&indices).skip(1) {
                let found = bits(index);
                assert_eq!(
                    found,
                    expected,
                    "{label}: grid {grid:?}: {:?}, by brute force {:?}: {ray:?}",
                    index.nearest(ray, &mut Counters::default()),
                    indices[0].nearest(ray, &mut Counters::default()),
                );
            }
            expected.is_some()
        })
        .collect()
}

#[test]
fn nearest_hits_are_those_of_brute_force() {
    let (mut hit, mut asked) = (0, 0);
    let rays_per_scene = if cfg!(debug_assertions) { 150 } else { 600 };
    for seed in seeds(60) {
        let world = World::nasty(seed);
        let occluders = world.occluders();
        let bounds = occluders.bounds();
        let random = &mut Random(seed ^ 0x0ea7);
        let any = LightShape::Direction(DVec3::Z);
        let rays: Vec<Ray> = (0..rays_per_scene)
            .map(|_| {
                let element = random.below(world.elements.len());
                let on = point_of(&world.elements[element].0, &any, random);
                let other = random.below(world.elements.len());
                let target = point_of(&world.elements[other].0, &any, random);
                let outside = bounds.center() + bounds.size() * (random.in_unit_cube() * 4.0 - 2.0);
                let start = SurfaceId(occluders.elements()[element].surfaces.start);
                match random.below(5) {
                    // From anywhere at something, its corners and edges often.
                    0 | 1 => Ray {
                        origin: outside,
                        direction: target - outside,
                        leaves: None,
                    },
                    // From surface to surface, also along them.
                    2 => Ray {
                        origin: on,
                        direction: target - on,
                        leaves: Some(start),
                    },
                    3 => Ray {
                        origin: on,
                        direction: outside - on,
                        leaves: Some(start),
                    },
                    _ => Ray {
                        origin: outside,
                        direction: random.pick(&[DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z]),
                        leaves: None,
                    },
                }
            })
            .filter(|ray| ray.direction != DVec3::ZERO && ray.direction.is_finite())
            .collect();
        let hits = nearest_everywhere(&world.label, &occluders, &rays);
        asked += hits.len();
        hit += hits.iter().filter(|&&hit| hit).count();
    }
    assert!(hit * 3 > asked && hit * 20 < asked * 19, "{hit} of {asked}");
}

/// A ray that enters a closed cone from one of its own points (refraction in a solid) crosses all of its
/// parts by the own rule; the hit is the one it leaves through.
#[test]
fn rays_leave_a_closed_cone_where_they_leave_it() {
    let mut left_through = [0; 3];
    for seed in 0..300 {
        let random = &mut Random(seed ^ 0xc0_4e);
        let cone = Cone {
            base: DVec3::ZERO,
            base_radius: random.pick(&[1.0, 0.5, 2.0]),
            apex: DVec3::new(0.0, 0.0, random.pick(&[0.5, 2.0, 4.0])),
            apex_radius: random.pick(&[1.0, 0.25, 0.0]),
            is_closed: true,
        };
        let mut builder = Occluders::builder();
        builder.add_cone(cone, Opacity::Transparent).unwrap();
        let occluders = Arc::new(builder.build());
        let height = cone.apex.z;
        let radius_at =
            |z: f64| cone.base_radius + (cone.apex_radius - cone.base_radius) * z / height;
        // How far outside the solid a point is; negative inside.
        let outside = |p: DVec3| {
            (p.x.hypot(p.y) - radius_at(p.z))
                .max(-p.z)
                .max(p.z - height)
        };
        let part = random.below(occluders.surface_count());
        let (sine, cosine) = random.real(0.0, 6.3).sin_cos();
        let (r, z) = match part {
            0 => {
                let z = height * random.real(0.05, 0.95);
                (radius_at(z), z)
            }
            1 => (0.9 * cone.base_radius * random.unit(), 0.0),
            _ => (0.9 * cone.apex_radius * random.unit(), height),
        };
        let origin = DVec3::new(r * cosine, r * sine, z);
        // Towards some point well inside.
        let z = height * random.real(0.1, 0.9);
        let inner = random.in_unit_cube() - 0.5;
        let target = DVec3::new(inner.x * radius_at(z), inner.y * radius_at(z), z);
        let ray = Ray {
            origin,
            direction: target - origin,
            leaves: Some(SurfaceId(part as u32)),
        };
        nearest_everywhere(&format!("seed {seed} {cone:?}"), &occluders, &[ray]);
        let index = ShadowIndex::builder(occluders, Vec::new()).build().unwrap();
        let hit = index.nearest(&ray, &mut Counters::default()).unwrap();
        let at = |t: f64| outside(origin + ray.direction * t);
        assert!(
            hit.distance >= 1.0
                && at(hit.distance).abs() < 1e-9
                && at(0.5 * hit.distance) < 0.0
                && at(hit.distance * 1.001) > 0.0,
            "seed {seed}: {cone:?} {ray:?} {hit:?}"
        );
        let is_on_wall = (hit.point.x.hypot(hit.point.y) - radius_at(hit.point.z)).abs() < 1e-9;
        assert!(is_on_wall || hit.surface.0 > 0, "seed {seed}: {hit:?}");
        left_through[hit.surface.0 as usize] += 1;
    }
    assert!(left_through.iter().all(|&n| n > 20), "{left_through:?}");
}

/// Every vertex, edge midpoint and diagonal midpoint of a mesh, and random points of its edges.
fn delicate_points(triangles: &[[DVec3; 3]], random: &mut Random) -> Vec<DVec3> {
    let mut points = Vec::new();
    for corners in triangles {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            points.extend([a, (a + b) * 0.5, a + (b - a) * random.unit()]);
        }
    }
    points
}

#[test]
fn a_height_field_lets_nothing_through() {
    let random = &mut Random(7);
    for (name, step, offset) in [
        ("on lattice", 1.0, DVec3::ZERO),
        ("rounded", 0.1, DVec3::ZERO),
        ("far", 0.1, DVec3::new(5e5, 5e6, 100.0)),
    ] {
        let n = 9;
        let heights: Vec<f64> = (0..n * n).map(|_| random.real(0.0, 2.0)).collect();
        let vertex = |i: usize, j: usize| {
            let z = heights[i * n + j];
            DVec3::new(i as f64 * step, j as f64 * step, z * step) + offset
        };
        let mut triangles = Vec::new();
        for i in 0..n - 1 {
            for j in 0..n - 1 {
                let [a, b, c, d] = [
                    vertex(i, j),
                    vertex(i + 1, j),
                    vertex(i + 1, j + 1),
                    vertex(i, j + 1),
                ];
                // Both ways to cut a quad.
                triangles.extend(if (i + j) % 2 == 0 {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                });
            }
        }
        let mut builder = Occluders::builder();
        for triangle in &triangles {
            builder.add_face(triangle, Opacity::Opaque).unwrap();
        }
        let occluders = Arc::new(builder.build());
        let bounds = occluders.bounds();
        // Points of the outline may pass by when rounded outwards.
        let is_inner = |p: &DVec3| {
            let room = 1e-6 * step;
            (0..2).all(|i| p[i] > bounds.min[i] + room && p[i] < bounds.max[i] - room)
        };
        let targets: Vec<DVec3> = delicate_points(&triangles, random)
            .into_iter()
            .filter(is_inner)
            .collect();
        let rays: Vec<Ray> = targets
            .iter()
            .flat_map(|&target| {
                let middle = bounds.center();
                let eye = middle + DVec3::new(0.3, -0.2, 9.0) * step;
                let straight = DVec3::new(target.x, target.y, bounds.max.z + 5.0 * step);
                [(eye, target - eye), (straight, -DVec3::Z)]
            })
            .map(|(origin, direction)| Ray {
                origin,
                direction,
                leaves: None,
            })
            .collect();
        let hits = nearest_everywhere(name, &occluders, &rays);
        assert!(rays.len() > 1500);
        for (ray, hit) in rays.iter().zip(hits) {
            assert!(hit, "{name}: leaks: {ray:?}");
        }
    }
}

#[test]
fn a_closed_mesh_lets_nothing_out_and_ties_go_to_the_lowest_id() {
    let random = &mut Random(8);
    // A sphere of rings; its vertices are rounded. Poles and the seam are shared exactly.
    let (rings, sides) = (9usize, 14usize);
    let vertex = |ring: usize, side: usize| {
        let polar = std::f64::consts::PI * ring as f64 / rings as f64;
        let around = std::f64::consts::TAU * (side % sides) as f64 / sides as f64;
        let (radius, z) = match ring {
            0 => (0.0, 1.0),
            ring if ring == rings => (0.0, -1.0),
            _ => polar.sin_cos(),
        };
        DVec3::new(radius * around.cos(), radius * around.sin(), z) * 1.7
            + DVec3::new(0.1, 0.2, 0.3)
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for side in 0..sides {
            let [a, b] = [vertex(ring, side), vertex(ring, side + 1)];
            let [c, d] = [vertex(ring + 1, side + 1), vertex(ring + 1, side)];
            if a != b {
                triangles.push([a, b, c]);
            }
            if c != d {
                triangles.push([a, c, d]);
            }
        }
    }
    let mut builder = Occluders::builder();
    for triangle in &triangles {
        builder.add_face(triangle, Opacity::Opaque).unwrap();
    }
    let occluders = Arc::new(builder.build());
    let targets = delicate_points(&triangles, random);
    let from = |origin: DVec3| {
        targets.iter().map(move |&target| Ray {
            origin,
            direction: target - origin,
            leaves: None,
        })
    };
    let rays: Vec<Ray> = from(DVec3::new(0.1, 0.2, 0.3))
        .chain(from(DVec3::new(0.7, -0.5, 0.4)))
        .collect();
    let hits = nearest_everywhere("sphere", &occluders, &rays);
    for (ray, hit) in rays.iter().zip(hits) {
        assert!(hit, "leaks: {ray:?}");
    }

    // A ray exactly through a vertex that stands on the lattice meets all its triangles at one
    // distance: of exact ties the lowest id wins, in whatever order they were added.
    let fan: Vec<[DVec3; 3]> = [
        (DVec3::X, DVec3::Y),
        (DVec3::Y, -DVec3::X),
        (-DVec3::X, -DVec3::Y),
        (-DVec3::Y, DVec3::X),
    ]
    .map(|(a, b)| [DVec3::Z, a + DVec3::Z, b + DVec3::Z])
    .to_vec();
    for first in 0..4 {
        let mut builder = Occluders::builder();
        for i in 0..4 {
            builder
                .add_face(&fan[(first + i) % 4], Opacity::Opaque)
                .unwrap();
        }
        let occluders = Arc::new(builder.build());
        for grid in [[1; 3], [2; 3], [5; 3], [8, 8, 1]] {
            let index = ShadowIndex::builder(occluders.clone(), Vec::new())
                .grid(GridResolution::Fixed(grid))
                .build()
                .unwrap();
            // Face `i` of the fan has become surface `i - first`; on the positive y axis
            // faces 0 and 1 meet, at the middle all.
            let id = |i: usize| (i + 4 - first) % 4;
            for (y, lowest) in [(0.0, 0), (0.5, id(0).min(id(1)))] {
                let ray = Ray {
                    origin: DVec3::new(0.0, y, 4.0),
                    direction: -DVec3::Z,
                    leaves: None,
                };
                let hit = index.nearest(&ray, &mut Counters::default()).unwrap();
                let expected = SurfaceId(lowest as u32);
                assert_eq!(hit.surface, expected, "{first} {grid:?} {ray:?}");
                assert_eq!(hit.distance, 3.0);
            }
        }
    }
}
