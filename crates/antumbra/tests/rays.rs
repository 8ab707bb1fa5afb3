//! Rays through the tree against rays through the grid and against the reference, bit for bit: on
//! scenes of all shapes, along random rays and along rays aimed at what is delicate.

use std::sync::Arc;

use antumbra::{
    Counters, GridResolution, LightId, Method, RayBatch, RayMethod, Shadow, ShadowIndex,
};
use antumbra_geometry::{
    Cone, DVec3, Disk, Hit, LightShape, Occluders, Opacity, Ray, ReceiverPoint, Sphere, SurfaceId,
};

/// A small generator of numbers; quality does not matter here, repeatability does.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn within(&mut self, reach: f64) -> DVec3 {
        let mut one = || (2.0 * self.next() - 1.0) * reach;
        DVec3::new(one(), one(), one())
    }
}

/// A height field of `n` by `n` cells over the square of edge 2 around `origin`.
fn height_field(n: u32, origin: DVec3) -> (Occluders, Vec<DVec3>) {
    let at = |i: u32, j: u32| {
        let (x, y) = (
            f64::from(i) / f64::from(n) * 2.0 - 1.0,
            f64::from(j) / f64::from(n) * 2.0 - 1.0,
        );
        // No platform's sine: the bits must not differ.
        let z = 0.2 * (x * y - x * x * x) + 0.01 * f64::from((i * 7 + j * 13) % 5);
        origin + DVec3::new(x, y, z)
    };
    let mut builder = Occluders::builder();
    let mut vertices = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let [a, b, c, d] = corners;
            for face in [[a, b, c], [a, c, d]] {
                builder
                    .add_face(&face, Opacity::Opaque)
                    .expect("fine numbers");
            }
            vertices.extend(corners);
        }
    }
    (builder.build(), vertices)
}

/// Some of everything, some of it transparent, degenerate or doubled.
fn mixture(seed: u64, origin: DVec3, size: f64) -> Occluders {
    let mut random = Random(seed);
    let mut builder = Occluders::builder();
    for i in 0..300 {
        let opacity = if i % 7 == 0 {
            Opacity::Transparent
        } else {
            Opacity::Opaque
        };
        let center = origin + random.within(size);
        let radius = 0.1 * size * random.next();
        let added = match i % 6 {
            0 => builder.add_sphere(Sphere { center, radius }, opacity),
            1 => builder.add_disk(
                Disk {
                    center,
                    normal: random.within(1.0),
                    radius,
                },
                opacity,
            ),
            2 => builder.add_cone(
                Cone {
                    base: center,
                    base_radius: radius,
                    apex: center + random.within(0.2 * size),
                    apex_radius: if i % 4 == 0 {
                        0.0
                    } else {
                        radius * random.next()
                    },
                    is_closed: i % 3 == 0,
                },
                opacity,
            ),
            _ => {
                let corners: [DVec3; 3] =
                    std::array::from_fn(|_| center + random.within(0.2 * size));
                if i % 50 == 3 {
                    // A double and a needle.
                    builder
                        .add_face(&corners, Opacity::Opaque)
                        .expect("fine numbers");
                    let needle = [corners[0], corners[1], corners[0].lerp(corners[1], 0.3)];
                    builder
                        .add_face(&needle, Opacity::Opaque)
                        .expect("fine numbers");
                }
                builder.add_face(&corners, opacity)
            }
        };
        added.expect("fine numbers");
    }
    builder.build()
}

fn index(occluders: &Arc<Occluders>, lights: &[LightShape], rays: RayMethod) -> ShadowIndex {
    ShadowIndex::builder(occluders.clone(), lights.to_vec())
        .method(match rays {
            RayMethod::Bvh => Method::Bvh,
            _ => Method::Grid,
        })
        .rays(rays)
        .grid(GridResolution::Fixed([9, 10, 8]))
        .build()
        .expect("settings are in range")
}

/// Compares nearest hits of all rays, and how many there are.
fn check_nearest(name: &str, occluders: &Arc<Occluders>, rays: &[Ray]) -> Vec<Option<Hit>> {
    let (by_tree, by_grid) = (
        index(occluders, &[], RayMethod::Bvh),
        index(occluders, &[], RayMethod::Grid),
    );
    let mut counters = Counters::default();
    let hits: Vec<Option<Hit>> = rays
        .iter()
        .map(|ray| {
            let hit = by_tree.nearest(ray, &mut counters);
            assert_eq!(
                hit,
                by_grid.nearest(ray, &mut Counters::default()),
                "{name}: {ray:?}"
            );
            hit
        })
        .collect();
    assert!(counters.steps > 0, "{name}: the tree was not walked");
    let count = hits.iter().flatten().count();
    assert!(count * 20 > rays.len(), "{name}: {count} of {}", rays.len());
    hits
}

/// Compares shadows of all hits with the reference's, from each light.
fn check_shadows(name: &str, occluders: &Arc<Occluders>, lights: &[LightShape], hits: &[Hit]) {
    let by_tree = index(occluders, lights, RayMethod::Bvh);
    let mut shadowed = 0;
    for hit in hits {
        for (light, shape) in lights.iter().enumerate() {
            for surface in [Some(hit.surface), None] {
                let point = hit.point;
                let start = ReceiverPoint { point, surface };
                let answer = by_tree
                    .shadow(&start, LightId::from_index(light), &mut Counters::default())
                    .expect("a fine query")
                    .shadow;
                let truth = by_tree
                    .shadow_by_reference(&start, LightId::from_index(light))
                    .expect("a fine query");
                assert_eq!(answer, truth, "{name}: {start:?} {shape:?}");
                shadowed += usize::from(answer == Shadow::Shadowed);
            }
        }
    }
    let asked = hits.len() * lights.len() * 2;
    assert!(
        shadowed > 0 && shadowed < asked,
        "{name}: {shadowed} of {asked}"
    );
}

fn towards(origin: DVec3, target: DVec3) -> Ray {
    Ray {
        origin,
        direction: target - origin,
        leaves: None,
    }
}

#[test]
fn mixtures_of_all_shapes() {
    let frames = [
        (DVec3::ZERO, 1.0),
        (DVec3::new(5e6, -3e5, 40.0), 50.0),
        (DVec3::ZERO, 2.0_f64.powi(-300)),
        (DVec3::new(1e20, 0.0, 0.0), 1e19),
    ];
    for (seed, &(origin, size)) in frames.iter().enumerate() {
        let occluders = Arc::new(mixture(seed as u64, origin, size));
        let mut random = Random(99 + seed as u64);
        let mut rays = Vec::new();
        for i in 0..4000 {
            // From inside, from around, and from far away.
            let from = origin + random.within([0.8, 3.0, 3e3, 1e5][i % 4] * size);
            let mut ray = towards(from, origin + random.within(size));
            if i % 9 == 0 {
                // Along an axis, to the last bit.
                let axis = i / 9 % 3;
                let mut direction = DVec3::ZERO;
                direction[axis] = if ray.direction[axis] < 0.0 {
                    -size
                } else {
                    size
                };
                let mut target = origin + random.within(size);
                target[axis] = from[axis];
                ray = Ray {
                    origin: target - direction * 3.0,
                    direction,
                    leaves: None,
                };
            }
            rays.push(ray);
        }
        let name = format!("mixture {seed}");
        let hits = check_nearest(&name, &occluders, &rays);
        let hits: Vec<Hit> = hits.into_iter().flatten().step_by(9).collect();
        let lights = [
            LightShape::Point(origin + DVec3::new(0.3, 0.2, 1.5) * size),
            LightShape::Point(origin + DVec3::new(0.1, -0.2, 0.05) * size),
            LightShape::Point(origin + DVec3::new(2e7, 3e7, 5e7) * size),
            LightShape::Direction(DVec3::new(0.3, -0.4, 1.0)),
            LightShape::Direction(DVec3::Z),
        ];
        check_shadows(&name, &occluders, &lights, &hits);
    }
}

#[test]
fn vertices_and_edges_of_a_height_field() {
    for origin in [DVec3::ZERO, DVec3::new(4.2e6, 7.1e5, 300.0)] {
        let (occluders, vertices) = height_field(24, origin);
        let occluders = Arc::new(occluders);
        let from = origin + DVec3::new(0.37, -0.21, 3.0);
        let mut rays: Vec<Ray> = vertices
            .iter()
            .map(|&vertex| towards(from, vertex))
            .collect();
        // Along edges, where the rounded target lies a hair beside them.
        for corners in vertices.chunks(4) {
            for (i, share) in [0.5, 0.25, 0.7].into_iter().enumerate() {
                rays.push(towards(from, corners[i].lerp(corners[i + 1], share)));
                rays.push(towards(from, corners[0].lerp(corners[2], share)));
            }
        }
        let hits = check_nearest("height field", &occluders, &rays);
        // Nothing leaks: all targets but those of the outline are inside.
        let missed: Vec<&Ray> = rays
            .iter()
            .zip(&hits)
            .filter(|(ray, hit)| {
                let target = ray.origin + ray.direction - origin;
                hit.is_none() && target.x.abs().max(target.y.abs()) < 0.99
            })
            .map(|(ray, _)| ray)
            .collect();
        assert!(missed.is_empty(), "{missed:?}");

        let lights = [
            LightShape::Point(origin + DVec3::new(0.9, 0.8, 0.25)),
            LightShape::Direction(DVec3::new(1.0, 0.2, 0.1)),
            LightShape::Point(vertices[40] + DVec3::new(0.0, 0.0, 0.1)),
        ];
        let hits: Vec<Hit> = hits.into_iter().flatten().step_by(3).collect();
        check_shadows("height field", &occluders, &lights, &hits);
    }
}

/// Shadow rays from below a height field to lights over it, through its very vertices: all blocked.
#[test]
fn nothing_leaks_through_vertices() {
    let (occluders, vertices) = height_field(24, DVec3::ZERO);
    let lamp = DVec3::new(0.3, 0.1, 2.0);
    let by_tree = index(
        &Arc::new(occluders),
        &[LightShape::Point(lamp)],
        RayMethod::Bvh,
    );
    for vertex in vertices {
        if vertex.x.abs().max(vertex.y.abs()) > 0.99 {
            continue;
        }
        let point = lamp + (vertex - lamp) * 2.0;
        let start = ReceiverPoint {
            point,
            surface: None,
        };
        let answer = by_tree.shadow(&start, LightId(0), &mut Counters::default());
        assert_eq!(
            answer.expect("a fine query").shadow,
            Shadow::Shadowed,
            "{vertex}"
        );
    }
}

#[test]
fn small_scenes_and_none() {
    let ray = towards(DVec3::new(0.1, 0.2, 3.0), DVec3::new(0.1, 0.2, 0.0));
    let none = index(&Arc::new(Occluders::default()), &[], RayMethod::Bvh);
    assert_eq!(none.nearest(&ray, &mut Counters::default()), None);

    for count in 1..12 {
        let mut builder = Occluders::builder();
        for i in 0..count {
            let z = -f64::from(i % 5);
            let corners = [(-1.0, -1.0), (2.0, -1.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, z));
            builder
                .add_face(&corners, Opacity::Opaque)
                .expect("fine numbers");
        }
        let occluders = Arc::new(builder.build());
        let hits = check_nearest("a few", &occluders, &[ray]);
        assert_eq!(hits[0].map(|hit| hit.surface), Some(SurfaceId(0)));
    }
}

#[test]
fn ten_thousand_in_one_place() {
    let mut builder = Occluders::builder();
    for _ in 0..10_000 {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        builder
            .add_face(&corners, Opacity::Opaque)
            .expect("fine numbers");
    }
    let occluders = Arc::new(builder.build());
    let ray = towards(DVec3::new(0.2, 0.3, 1.0), DVec3::new(0.2, 0.3, 0.0));
    let hits = check_nearest("coincident", &occluders, &[ray]);
    assert_eq!(hits[0].map(|hit| hit.surface), Some(SurfaceId(0)));
}

/// A ray that leaves a solid from a point far off it: the own rule says whether it meets the solid, though it passes
/// it by. The walks of tree and grid once said that nothing is there.
#[test]
fn a_ray_that_leaves_a_solid_from_far_off_meets_it_by_its_own_rule() {
    let v = DVec3::new;
    for scale in [1.0, 2.0_f64.powi(-400), 2.0_f64.powi(60)] {
        let mut builder = Occluders::builder();
        let sphere = Sphere {
            center: v(0.0, 0.0, 0.0),
            radius: scale,
        };
        let cone = Cone {
            base: scale * v(4.0, 0.0, 0.0),
            base_radius: scale,
            apex: scale * v(4.0, 0.0, 2.0),
            apex_radius: 0.5 * scale,
            is_closed: true,
        };
        // Each twice: of equal ones the first is met. And something else that rays pass by.
        for _ in 0..2 {
            builder
                .add_sphere(sphere, Opacity::Opaque)
                .expect("a sphere");
            builder
                .add_cone(cone, Opacity::Transparent)
                .expect("a cone");
        }
        for number in 0..80 {
            let at = scale * v(-8.0, 0.1 * f64::from(number), 0.0);
            let face = [
                at,
                at + scale * v(0.05, 0.0, 0.0),
                at + scale * v(0.0, 0.0, 0.05),
            ];
            builder.add_face(&face, Opacity::Opaque).expect("a face");
        }
        let occluders = Arc::new(builder.build());
        let curved: Vec<SurfaceId> = occluders
            .surfaces()
            .filter(|&surface| occluders.triangle_positions(surface).is_none())
            .collect();
        assert_eq!(curved.len(), 8);
        let (mut met_count, mut passed_by_count) = (0, 0);
        for &own in &curved {
            for direction in [v(1.0, 0.0, -0.1), v(-0.2, 1.0, -0.3), v(0.0, 0.0, 1.0)] {
                let origin = scale * v(0.5, -3.0, 5.0);
                let ray = Ray {
                    origin,
                    direction: scale * direction,
                    leaves: Some(own),
                };
                let segment = occluders.ray_segment(&ray);
                let mut crossed: Vec<Hit> = occluders
                    .surfaces()
                    .filter(|&surface| occluders.crosses(surface, &segment))
                    .map(|surface| occluders.hit(surface, &segment))
                    .collect();
                crossed.sort_by(|a, b| {
                    a.distance
                        .total_cmp(&b.distance)
                        .then(a.surface.cmp(&b.surface))
                });
                // The solid itself is left once.
                let is_own = |hit: &Hit| occluders.have_one_own_rule(own, hit.surface);
                let exit = crossed
                    .iter()
                    .find(|hit| is_own(hit))
                    .map(|hit| hit.surface);
                crossed.retain(|hit| !is_own(hit) || Some(hit.surface) == exit);
                let expected = crossed.first().copied();
                met_count += u32::from(exit.is_some());
                passed_by_count += u32::from(exit.is_none());
                for rays in [RayMethod::Bvh, RayMethod::Grid] {
                    let index = ShadowIndex::builder(occluders.clone(), Vec::new());
                    let index = index
                        .method(Method::Grid)
                        .rays(rays)
                        .grid(GridResolution::Fixed([16; 3]))
                        .build()
                        .expect("an index");
                    let found = index.nearest(&ray, &mut Counters::default());
                    let surface = |hit: &Option<Hit>| hit.as_ref().map(|hit| hit.surface);
                    assert_eq!(surface(&found), surface(&expected), "{rays:?} {ray:?}");
                    let batch = RayBatch {
                        origins: &[ray.origin.to_array()],
                        directions: &[ray.direction.to_array()],
                        leaves: Some(&[own.0]),
                    };
                    let all = index.all_hits(&batch).expect("hits").hits;
                    let all: Vec<SurfaceId> = all.iter().map(|hit| hit.surface).collect();
                    let expected: Vec<SurfaceId> = crossed.iter().map(|hit| hit.surface).collect();
                    assert_eq!(all, expected, "{rays:?} {ray:?}");
                }
            }
        }
        assert!(
            met_count > 4 && passed_by_count > 4,
            "{met_count} {passed_by_count}"
        );
    }
}
