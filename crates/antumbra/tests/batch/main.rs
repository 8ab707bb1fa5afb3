//! Batches, the surfaces that points are on, and rays that are not ours, through the front door.

#[path = "../common/mod.rs"]
mod common;
mod nearest;
mod own_rays;
mod refused;

use std::sync::Arc;

use antumbra::{
    Batch, BatchCounters, BatchKind, Coordinates, LightId, Method, Shadow, ShadowIndex,
};
use antumbra_geometry::{DVec3, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId};

use common::{METHODS, Random, add_cone_and_disk, add_face, add_pane, builder_of, lamps};

/// A tilted floor of 32 triangles under loose triangles, a pane, two balls, a closed cone and a disk.
fn hall() -> Arc<Occluders> {
    let random = &mut Random(7);
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let height = |x: f64, y: f64| 0.1 * x + 0.03 * y;
    for i in 0..16 {
        let (x, y) = (f64::from(i % 4) * 2.0 - 4.0, f64::from(i / 4) * 2.0 - 4.0);
        let corner = |dx: f64, dy: f64| v(x + dx, y + dy, height(x + dx, y + dy));
        let [a, b, c, d] =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| corner(x, y));
        add_face(&mut builder, &[a, b, c]);
        add_face(&mut builder, &[a, c, d]);
    }
    add_pane(&mut builder);
    for number in 0..20 {
        let middle = v(0.0, 0.0, 2.0) + v(3.5, 3.5, 1.0) * random.in_cube();
        let size = [0.05, 0.2, 0.6][number % 3];
        add_face(
            &mut builder,
            &[(); 3].map(|()| middle + size * random.in_cube()),
        );
    }
    for radius in [0.4, 0.7] {
        let center = v(0.0, 0.0, 1.5) + v(3.0, 3.0, 0.5) * random.in_cube();
        let sphere = Sphere { center, radius };
        builder
            .add_sphere(sphere, Opacity::Opaque)
            .expect("a sphere");
    }
    add_cone_and_disk(&mut builder, 0.5);
    Arc::new(builder.build())
}

fn index_of(occluders: &Arc<Occluders>, method: Method) -> ShadowIndex {
    builder_of(occluders, &lamps(), method)
        .build()
        .expect("an index")
}

/// Points on surfaces, by rounding; the surfaces; normals of which every third is turned around.
struct OnSurfaces {
    points: Vec<[f64; 3]>,
    surfaces: Vec<u32>,
    normals: Vec<[f64; 3]>,
}

fn on_surfaces(occluders: &Occluders, count: usize) -> OnSurfaces {
    let random = &mut Random(11);
    let mut made = OnSurfaces {
        points: Vec::new(),
        surfaces: Vec::new(),
        normals: Vec::new(),
    };
    for number in 0..count {
        let surface = SurfaceId((number % occluders.surface_count()) as u32);
        let point = match occluders.triangle_positions(surface) {
            Some([a, b, c]) => {
                // Off the edges by a share that no tie reaches.
                let [s, t, u] = [(); 3].map(|()| random.real(0.1, 1.0));
                (a * s + b * t + c * u) / (s + t + u)
            }
            None => match occluders.sphere(surface) {
                Some(Sphere { center, radius }) => center + radius * random.in_cube().normalize(),
                None => {
                    // Cone and disk: from a point beside it.
                    let beside = occluders.surface_bounds(surface).center() + random.in_cube();
                    let wall = occluders.start_on(surface, beside).point;
                    let normal = occluders.normal_at(surface, wall);
                    let height = occluders.distance(surface, wall).expect("a surface");
                    [wall, wall - height * normal, wall + height * normal]
                        .into_iter()
                        .find(|&x| occluders.distance(surface, x).is_some_and(|d| d < 1e-14))
                        .unwrap_or(occluders.surface_bounds(surface).center())
                }
            },
        };
        let normal = occluders.normal_at(surface, point);
        let turn = if number % 3 == 0 { -2.0 } else { 0.3 };
        made.points.push(point.to_array());
        made.surfaces.push(surface.0);
        made.normals.push((normal * turn).to_array());
    }
    made
}

fn narrow(all: &[[f64; 3]]) -> Vec<[f32; 3]> {
    all.iter().map(|v| v.map(|x| x as f32)).collect()
}

fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.expect("threads").install(work)
}

/// What a batch answers, as bytes, after its bits were compared with them, on one thread and on three.
fn answers<P: Coordinates>(
    index: &ShadowIndex,
    batch: &Batch<P>,
    lights: &[usize],
) -> (Vec<u8>, BatchCounters) {
    let ids: Vec<LightId> = lights.iter().copied().map(LightId::from_index).collect();
    let count = batch.points.len();
    let ask = || {
        // Full of something else.
        let mut bytes = vec![7; count * lights.len()];
        let counters = index
            .occluded(batch, &ids, &mut bytes)
            .expect("fine points");
        let mut bits = vec![255; count.div_ceil(8) * lights.len()];
        let again = index
            .occluded_bits(batch, &ids, &mut bits)
            .expect("fine points");
        assert_eq!(counters, again);
        let mut expected = vec![0; bits.len()];
        for (number, &byte) in bytes.iter().enumerate() {
            let (point, light) = (number / lights.len(), number % lights.len());
            expected[light * count.div_ceil(8) + point / 8] |= byte << (point % 8);
        }
        assert_eq!(bits, expected);
        (bytes, counters)
    };
    let found = on_threads(1, ask);
    assert_eq!(decided(on_threads(3, ask)), decided(found.clone()));
    found
}

/// Without the work of rays: those of a batch walk together, so it depends on who is together.
fn decided((bytes, mut counted): (Vec<u8>, BatchCounters)) -> (Vec<u8>, BatchCounters) {
    counted.counters.steps = 0;
    counted.counters.intersections = 0;
    (bytes, counted)
}

/// The same one by one; `None` for what is not asked and shadowed.
fn one_by_one(
    index: &ShadowIndex,
    starts: &[ReceiverPoint],
    lights: &[usize],
    is_asked: impl Fn(usize, usize) -> bool,
) -> (Vec<u8>, BatchCounters) {
    let mut counters = BatchCounters::default();
    let mut bytes = Vec::new();
    for (number, start) in starts.iter().enumerate() {
        for &light in lights {
            if is_asked(number, light) {
                let answer =
                    index.shadow(start, LightId::from_index(light), &mut counters.counters);
                bytes.push(u8::from(
                    answer.expect("a fine query").shadow == Shadow::Shadowed,
                ));
            } else {
                counters.facing_away += 1;
                bytes.push(1);
            }
        }
    }
    decided((bytes, counters))
}

#[test]
fn batches_answer_as_single_queries_do() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2500);
    let starts = |surface: fn(u32) -> Option<SurfaceId>| -> Vec<ReceiverPoint> {
        let all = made.points.iter().zip(&made.surfaces);
        all.map(|(&point, &on)| ReceiverPoint {
            point: DVec3::from_array(point),
            surface: surface(on),
        })
        .collect()
    };
    let (free, on) = (starts(|_| None), starts(|on| Some(SurfaceId(on))));
    for method in METHODS {
        let index = index_of(&occluders, method);
        for lights in [&[0, 1, 2][..], &[1], &[2, 0, 2], &[]] {
            for count in [0, 1, 7, 8, 9, 1023, 1025, 2500] {
                let points = &made.points[..count];
                let always = |_, _| true;
                assert_eq!(
                    decided(answers(&index, &Batch::free(points), lights)),
                    one_by_one(&index, &free[..count], lights, always),
                    "{method:?}, {lights:?}, {count} free"
                );
                let surfaces = &made.surfaces[..count];
                assert_eq!(
                    decided(answers(
                        &index,
                        &Batch::on_surfaces(points, surfaces),
                        lights
                    )),
                    one_by_one(&index, &on[..count], lights, always),
                    "{method:?}, {lights:?}, {count} on surfaces"
                );
                let normals = &made.normals[..count];
                let faces = |number: usize, light: usize| {
                    let normal = DVec3::from_array(normals[number]);
                    lamps()[light].side_of(free[number].point, normal) > 0
                };
                let found = decided(answers(&index, &Batch::facing(points, normals), lights));
                assert_eq!(
                    found,
                    one_by_one(&index, &free[..count], lights, faces),
                    "{method:?}, {lights:?}, {count} facing"
                );
                let is_mixed = found.1.facing_away > 0 && found.0.contains(&0);
                assert!(is_mixed || count < 100 || lights.is_empty());
            }
        }
    }
}

#[test]
fn facing_away_is_exact() {
    let occluders = hall();
    let index = index_of(&occluders, Method::Bvh);
    // High above everything, lit unless they face away.
    let point = [0.5, -0.7, 3.75];
    let cases = [
        ([0.0, 0.0, -1.0], 0),
        ([0.0, 0.0, 1.0], 1),
        // The light is in the plane.
        ([1.0, 0.0, 0.0], 1),
        ([1.0, 0.0, -f64::MIN_POSITIVE], 0),
        ([0.0, 0.0, 0.0], 1),
    ];
    let points = vec![point; cases.len()];
    let normals = cases.map(|(normal, _)| normal);
    let batch = Batch {
        points: &points,
        kind: BatchKind::Facing { normals: &normals },
    };
    let (found, counters) = answers(&index, &batch, &[0]);
    assert_eq!(found, cases.map(|(_, byte)| byte));
    assert_eq!(counters.facing_away, 3);
}
