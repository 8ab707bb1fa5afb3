//! Batches, the surfaces that points are on, and rays that are not ours, through the front door.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use antumbra::{
    AnyHit, Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, Decided,
    GridResolution, Method, Nearness, RayBatch, RayMethod, Refine, Refinement, Shadow, ShadowIndex,
    Towards,
};
use antumbra_geometry::{
    DVec3, LightShape, Occluders, Opacity, Precision, Ray, Sphere, Start, SurfaceId,
};

use common::{
    METHODS, Random, add_cone_and_disk, add_face, add_pane, builder_of, is_shadowed, lamps,
};

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
    let count = batch.points.len();
    let ask = || {
        // Full of something else.
        let mut bytes = vec![7; count * lights.len()];
        let counters = index
            .occluded(batch, lights, &mut bytes)
            .expect("fine points");
        let mut bits = vec![255; count.div_ceil(8) * lights.len()];
        let again = index
            .occluded_bits(batch, lights, &mut bits)
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
    starts: &[Start],
    lights: &[usize],
    is_asked: impl Fn(usize, usize) -> bool,
) -> (Vec<u8>, BatchCounters) {
    let mut counters = BatchCounters::default();
    let mut bytes = Vec::new();
    for (number, start) in starts.iter().enumerate() {
        for &light in lights {
            if is_asked(number, light) {
                let answer = index.shadow(start, light, &mut counters.counters);
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
    let starts = |surface: fn(u32) -> Option<SurfaceId>| -> Vec<Start> {
        let all = made.points.iter().zip(&made.surfaces);
        all.map(|(&point, &on)| Start {
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

fn surface_near(
    index: &ShadowIndex,
    point: DVec3,
    normal: Option<DVec3>,
    nearness: Nearness,
) -> Option<SurfaceId> {
    index.start_near(point, normal, nearness)?.surface
}

/// As far as `f32` rounds.
const SINGLE: Nearness = Nearness {
    precision: Precision::Single,
    tolerance: None,
};

/// As far as `f64` rounds.
const DOUBLE: Nearness = Nearness {
    precision: Precision::Double,
    tolerance: None,
};

fn within(tolerance: f64) -> Nearness {
    Nearness {
        precision: Precision::Single,
        tolerance: Some(tolerance),
    }
}

/// With tree and without, whatever the grid, for points in `f64` and in `f32`.
#[test]
fn surfaces_of_points_are_found() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2000);
    let with_tree = index_of(&occluders, Method::Bvh);
    let mut indices = vec![with_tree];
    for resolution in [1, 40] {
        let index = builder_of(&occluders, &lamps(), Method::Grid)
            .rays(RayMethod::Grid)
            .grid(GridResolution::Fixed([resolution; 3]))
            .build();
        indices.push(index.expect("an index"));
    }
    let mut rounded_count = 0;
    for (number, &point) in made.points.iter().enumerate() {
        let given = DVec3::from_array(point);
        let narrow = DVec3::from_array(point.map(|x| f64::from(x as f32)));
        let normal = Some(DVec3::from_array(made.normals[number]));
        for (point, nearness) in [(given, DOUBLE), (given, SINGLE), (narrow, SINGLE)] {
            // The definition, surface by surface.
            let expected = occluders
                .surfaces()
                .filter_map(|surface| Some((occluders.distance(surface, point)?, surface)))
                .filter(|&(_, surface)| occluders.is_on(surface, point, nearness.precision))
                .min_by(|a, b| a.partial_cmp(b).expect("numbers"))
                .map(|(_, surface)| surface);
            let own = SurfaceId(made.surfaces[number]);
            for index in &indices {
                assert_eq!(
                    surface_near(index, point, None, nearness),
                    expected,
                    "{point}"
                );
                assert!(
                    index
                        .start_near(point, None, within(f64::INFINITY))
                        .is_some()
                );
                if occluders.triangle_positions(own).is_some() {
                    // No other is as near, so that normals change nothing.
                    assert_eq!(expected, Some(own), "{point}");
                    assert_eq!(surface_near(index, point, normal, nearness), expected);
                    rounded_count += usize::from(point != given);
                }
                let lifted = point + DVec3::new(0.0, 0.0, 20.0);
                assert_eq!(surface_near(index, lifted, normal, nearness), None);
            }
        }
    }
    assert!(rounded_count > 1000);
    for nowhere in [DVec3::NAN, DVec3::INFINITY] {
        let found = indices[0].start_near(nowhere, None, within(f64::INFINITY));
        assert_eq!(found, None);
    }
}

#[test]
fn normals_choose_among_surfaces_that_tie() {
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let floor = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 8.0, 0.0)];
    let wall = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 0.0, 8.0)];
    let ceiling = [v(0.0, 8.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 0.0, 0.0)];
    for face in [floor, wall, ceiling] {
        builder.add_face(&face, Opacity::Opaque).expect("a face");
    }
    let occluders = Arc::new(builder.build());
    let [floor, wall, ceiling] = [0, 1, 2].map(SurfaceId);
    let (with_tree, without) = (
        index_of(&occluders, Method::Bvh),
        builder_of(&occluders, &lamps(), Method::Bvh).without_tree(),
    );
    for index in [with_tree, without.build().expect("an index")] {
        // The faces reach to 8.
        let rounding = 8.0 * Precision::Single.share();
        let near = 0.5 * rounding;
        let at = |point, normal| surface_near(&index, point, normal, SINGLE);
        let edge = v(3.0, 0.0, 0.0);
        // Exactly on the edge all three are as near.
        assert_eq!(at(edge, None), Some(floor));
        assert_eq!(at(edge, Some(v(0.0, 0.0, 1e-200))), Some(floor));
        assert_eq!(at(edge, Some(v(0.1, 0.2, -1.0))), Some(ceiling));
        assert_eq!(at(edge, Some(v(0.0, -1.0, 0.3))), Some(wall));
        assert_eq!(at(edge, Some(v(0.0, 1.0, 0.3))), Some(wall));
        assert_eq!(at(edge, Some(DVec3::ZERO)), Some(floor));
        // Nearer to the wall by rounding.
        assert_eq!(at(edge + v(0.0, 0.0, near), None), Some(wall));
        assert_eq!(
            at(edge + v(0.0, 0.0, near), Some(v(0.0, 0.0, 1.0))),
            Some(floor)
        );
        // Farther than rounding nothing ties, though both are within a larger tolerance.
        let off = edge + v(0.0, 0.0, 3.0 * rounding);
        let found = surface_near(&index, off, Some(v(0.0, 0.0, 1.0)), within(10.0 * rounding));
        assert_eq!(found, Some(wall));
    }
}

#[test]
fn points_find_their_surfaces_in_batches() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 3000);
    let points = narrow(&made.points);
    let normals = narrow(&made.normals);
    for method in [Method::Voxel, Method::Bvh] {
        let index = index_of(&occluders, method);
        let nearness = within(0.5);
        let starts: Vec<Start> = points
            .iter()
            .zip(&normals)
            .map(|(&point, &normal)| {
                let point = point.as_f64();
                let start = index.start_near(point, Some(normal.as_f64()), nearness);
                start.expect("a surface")
            })
            .collect();
        let batch = Batch {
            points: &points,
            kind: BatchKind::OnNearest {
                normals: Some(&normals),
                nearness,
            },
        };
        let expected = one_by_one(&index, &starts, &[2, 1], |_, _| true);
        assert_eq!(
            decided(answers(&index, &batch, &[2, 1])),
            expected,
            "{method:?}"
        );
        for (number, start) in starts.iter().enumerate().step_by(7) {
            let reference = index.shadow_by_reference(start, 1).expect("a fine query");
            assert_eq!(
                expected.0[2 * number + 1] == 1,
                reference == Shadow::Shadowed
            );
        }
    }
}

/// Rays know where the rule moves a start: only where they do not, every surface is tested.
#[test]
fn points_in_f32_walk_the_tree() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2000);
    let is_flat = |&(_, &surface): &(&[f64; 3], &u32)| surface < occluders.triangle_count() as u32;
    let flat = made.points.iter().zip(&made.surfaces).filter(is_flat);
    let (points, surfaces): (Vec<[f64; 3]>, Vec<u32>) = flat.unzip();
    let (narrow, index) = (narrow(&points), index_of(&occluders, Method::Bvh));
    let batch = Batch::on_surfaces(&narrow, &surfaces);
    let (_, counted) = answers(&index, &batch, &[0]);
    let tests = counted.counters.intersections as usize / points.len();
    assert!(tests < occluders.surface_count() / 4, "{tests} a query");
    for (point, &surface) in narrow.iter().zip(&surfaces) {
        let start = Start {
            point: point.as_f64(),
            surface: Some(SurfaceId(surface)),
        };
        let expected = index.shadow_by_reference(&start, 0).expect("a fine query");
        assert_eq!(is_shadowed(&index, &start, 0), expected == Shadow::Shadowed);
    }
}

#[test]
fn the_first_bad_point_is_named() {
    let occluders = hall();
    let index = index_of(&occluders, Method::Bvh);
    let good = on_surfaces(&occluders, 5000);
    let places = [4999, 4100, 2500, 2499];
    let ask = |batch: &Batch| {
        let errors = [1, 2, 5].map(|threads| {
            on_threads(threads, || {
                let mut out = vec![0; 2 * batch.points.len()];
                index.occluded(batch, &[0, 1], &mut out)
            })
        });
        assert_eq!(errors[0], errors[1]);
        assert_eq!(errors[0], errors[2]);
        errors[0].expect_err("a bad point")
    };
    for (bad, other) in [
        (f64::NAN, f64::INFINITY),
        (-f64::INFINITY, 2e30),
        (-2e30, f64::NAN),
    ] {
        let (mut points, mut normals) = (good.points.clone(), good.normals.clone());
        for place in places {
            points[place] = [0.0, other, 0.0];
            normals[place] = [0.0, 0.0, other];
        }
        points[2499] = [1.0, bad, 2.0];
        normals[2499] = [bad, 0.0, 1.0];
        let kinds = [
            BatchKind::Free,
            BatchKind::Facing {
                normals: &good.normals,
            },
            BatchKind::OnSurfaces {
                surfaces: &good.surfaces,
                tolerance: None,
            },
            BatchKind::OnNearest {
                normals: None,
                nearness: within(f64::INFINITY),
            },
        ];
        for kind in kinds {
            let batch = Batch {
                points: &points,
                kind,
            };
            // NaN is not equal to itself.
            let error = format!("{:?}", {
                let mut out = vec![0; points.len()];
                index
                    .occluded(&batch, &[0], &mut out)
                    .expect_err("a bad point")
            });
            assert!(error.starts_with("BadPoint { index: 2499"), "{error}");
        }
        let batch = Batch {
            points: &good.points,
            kind: BatchKind::Facing { normals: &normals },
        };
        let mut out = vec![0; points.len()];
        let error = index
            .occluded(&batch, &[0], &mut out)
            .expect_err("a bad normal");
        assert!(error.to_string().starts_with("normal 2499 is"), "{error}");
    }

    let mut surfaces = good.surfaces.clone();
    for (number, place) in places.into_iter().enumerate() {
        surfaces[place] = u32::MAX - number as u32;
    }
    let batch = Batch {
        points: &good.points,
        kind: BatchKind::OnSurfaces {
            surfaces: &surfaces,
            tolerance: None,
        },
    };
    let expected = BatchError::UnknownSurface {
        index: 2499,
        surface: u32::MAX - 3,
    };
    assert_eq!(ask(&batch), expected);

    let mut points = good.points.clone();
    for place in places {
        points[place][2] = 100.0 + place as f64;
    }
    let kind = BatchKind::OnNearest {
        normals: None,
        nearness: within(2.0),
    };
    let batch = Batch {
        points: &points,
        kind,
    };
    let point = DVec3::from_array(points[2499]);
    let distances = occluders.surfaces().filter_map(|surface| {
        let distance = occluders.distance(surface, point)?;
        Some((distance, surface))
    });
    let nearest = distances.min_by(|a, b| a.partial_cmp(b).expect("numbers"));
    let expected = BatchError::NoSurface {
        index: 2499,
        point,
        nearest: nearest.map(|(distance, surface)| (surface, distance)),
        allowed: 2.0,
    };
    assert_eq!(ask(&batch), expected);
}

#[test]
fn what_does_not_fit_is_refused() {
    let occluders = hall();
    let index = index_of(&occluders, Method::Bvh);
    let points = [[0.0, 0.0, 5.0]; 9];
    let length = |what, expected, found| BatchError::Length {
        what,
        expected,
        found,
    };
    let mut out = [0; 18];
    let free = Batch {
        points: &points,
        kind: BatchKind::Free,
    };
    assert_eq!(
        index.occluded(&free, &[0, 1], &mut out[..17]),
        Err(length("bytes of output", 18, 17))
    );
    assert_eq!(
        index.occluded_bits(&free, &[0, 1], &mut out),
        Err(length("bytes of output", 4, 18))
    );
    assert_eq!(
        index.occluded(&free, &[0, 3], &mut out),
        Err(BatchError::UnknownLight(3))
    );
    let mut ask = |kind| {
        let batch = Batch {
            points: &points,
            kind,
        };
        index
            .occluded(&batch, &[0, 1], &mut out)
            .expect_err("no fit")
    };
    let (normals, surfaces) = (&points[..8], &[0; 10][..]);
    assert_eq!(ask(BatchKind::Facing { normals }), length("normals", 9, 8));
    assert_eq!(
        ask(BatchKind::OnSurfaces {
            surfaces,
            tolerance: None
        }),
        length("surfaces", 9, 10)
    );
    let on_nearest = |normals, tolerance| BatchKind::OnNearest {
        normals,
        nearness: Nearness {
            tolerance,
            ..SINGLE
        },
    };
    assert_eq!(
        ask(on_nearest(Some(normals), None)),
        length("normals", 9, 8)
    );
    assert_eq!(
        ask(on_nearest(None, Some(-1.0))),
        BatchError::BadTolerance(-1.0)
    );
    let error = ask(on_nearest(None, Some(f64::NAN)));
    assert!(matches!(error, BatchError::BadTolerance(_)));
}

/// The reference as somebody else's rays, counting what it is asked.
struct Counting<'a> {
    occluders: &'a Occluders,
    asked: AtomicU64,
    /// What it says instead, if anything.
    lie: Option<bool>,
}

impl AnyHit for Counting<'_> {
    fn is_blocked(&self, start: &Start, light: &LightShape) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let segment = self.occluders.segment(start, light);
        let blocks = |surface| self.occluders.blocks(surface, &segment);
        self.lie
            .unwrap_or_else(|| self.occluders.surfaces().any(blocks))
    }
}

/// Rays that are right change nothing; rays that lie change only what they were asked.
#[test]
fn own_rays_answer_what_values_do_not_know() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2000);
    let lights = [0, 1, 2];
    for method in METHODS {
        let plain = index_of(&occluders, method);
        // Lists would know the rest.
        let refinement = Refinement {
            resolution: 64,
            space_resolution: 32,
            short_list: 0,
            space_list: 0,
            long_list: 0,
            refine: Refine::Eager,
            ..Refinement::default()
        };
        let bare = builder_of(&occluders, &lamps(), method).refinement(refinement);
        let bare = bare.without_tree().build();
        let bare = bare.expect("an index");
        for kind in [
            BatchKind::Free,
            BatchKind::OnSurfaces {
                surfaces: &made.surfaces,
                tolerance: None,
            },
        ] {
            let batch = Batch {
                points: &made.points,
                kind,
            };
            let (expected, _) = answers(&plain, &batch, &lights);
            let ask = |lie| {
                let rays = Counting {
                    occluders: &occluders,
                    asked: AtomicU64::new(0),
                    lie,
                };
                let mut out = vec![7; expected.len()];
                let counters = bare.with_rays(&rays).occluded(&batch, &lights, &mut out);
                let counters = counters.expect("fine points").counters.shadow;
                (out, counters, rays.asked.into_inner())
            };
            let (found, counters, asked) = ask(None);
            assert!(found == expected, "{method:?}");
            let has_values = matches!(method, Method::Voxel | Method::Voxel1990);
            let query_count = expected.len() as u64;
            let decided = counters.first_pass + counters.blocker_list + counters.rays;
            assert_eq!(decided, query_count);
            assert!(asked <= counters.rays && asked > 0, "{method:?}");
            assert_eq!(
                counters.first_pass > query_count / 10,
                has_values,
                "{method:?}"
            );

            let (all_lit, _, _) = ask(Some(false));
            let (all_shadowed, _, _) = ask(Some(true));
            let differing = all_lit.iter().zip(&all_shadowed).filter(|(a, b)| a != b);
            assert_eq!(differing.count() as u64, asked, "{method:?}");
            for ((lit, shadowed), expected) in all_lit.iter().zip(&all_shadowed).zip(&expected) {
                assert!(lit != shadowed || lit == expected);
            }
        }
    }
}

#[test]
fn an_index_without_a_tree_answers_the_same() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 1000);
    for method in METHODS {
        let plain = index_of(&occluders, method);
        let bare = builder_of(&occluders, &lamps(), method)
            .without_tree()
            .build();
        let bare = bare.expect("an index");
        for kind in [
            BatchKind::Free,
            BatchKind::OnSurfaces {
                surfaces: &made.surfaces,
                tolerance: None,
            },
        ] {
            let batch = Batch {
                points: &made.points,
                kind,
            };
            let (expected, _) = answers(&plain, &batch, &[0, 1, 2]);
            assert_eq!(answers(&bare, &batch, &[0, 1, 2]).0, expected, "{method:?}");
        }
        for &[x, y, z] in &made.points {
            let ray = Ray {
                origin: DVec3::new(z, x, 5.0),
                direction: DVec3::new(0.1 * y, 0.1, -1.0),
                leaves: None,
            };
            let nearest = |index: &ShadowIndex| index.nearest(&ray, &mut Counters::default());
            assert_eq!(nearest(&bare), nearest(&plain));
        }
    }
    // Less memory is asked for, where there is a grid besides.
    let predicted = ShadowIndex::predict(
        &occluders,
        3,
        GridResolution::Automatic,
        (Method::Bvh, RayMethod::Grid),
        Refinement::default(),
        None,
    );
    let limit = predicted.expect("fine settings").needed() - 1;
    let limited = |builder: antumbra::Builder| builder.rays(RayMethod::Grid).memory_limit(limit);
    assert!(
        limited(builder_of(&occluders, &lamps(), Method::Bvh))
            .build()
            .is_err()
    );
    let bare = limited(builder_of(&occluders, &lamps(), Method::Bvh).without_tree());
    assert!(bare.build().is_ok());
}

#[test]
fn single_queries_with_own_rays_say_how_they_were_decided() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 500);
    let rays = Counting {
        occluders: &occluders,
        asked: AtomicU64::new(0),
        lie: None,
    };
    for method in METHODS {
        let index = index_of(&occluders, method);
        for (&point, &surface) in made.points.iter().zip(&made.surfaces) {
            let start = Start {
                point: DVec3::from_array(point),
                surface: Some(SurfaceId(surface)),
            };
            let before = rays.asked.load(Ordering::Relaxed);
            let answer = index
                .with_rays(&rays)
                .shadow(&start, 1, &mut Counters::default());
            let answer = answer.expect("a fine query");
            let expected = index.shadow_by_reference(&start, 1).expect("a fine query");
            let plain = index
                .shadow(&start, 1, &mut Counters::default())
                .expect("a fine query");
            assert_eq!(
                plain.shadow, expected,
                "plain {plain:?} {method:?} {start:?}"
            );
            assert_eq!(answer.shadow, expected, "{method:?} {start:?} {answer:?}");
            let is_asked = rays.asked.load(Ordering::Relaxed) > before;
            assert!(!is_asked || answer.decided == Decided::Ray);
        }
    }
    let bad = Start {
        point: DVec3::NAN,
        surface: None,
    };
    let index = index_of(&occluders, Method::Voxel);
    let answer = index
        .with_rays(&rays)
        .shadow(&bad, 0, &mut Counters::default());
    assert!(answer.is_err());
}

#[test]
fn rays_of_many_do_not_depend_on_threads_and_refuse_by_number() {
    let occluders = hall();
    let index = index_of(&occluders, Method::Voxel);
    let random = &mut Random(11);
    let mut point = || (4.0 * random.in_cube()).to_array();
    let origins: Vec<[f64; 3]> = (0..5000).map(|_| point()).collect();
    let mut directions: Vec<[f64; 3]> = (0..5000).map(|_| point()).collect();
    directions[7] = [0.0; 3];
    // Products of such a direction vanish.
    directions[8] = directions[9].map(|x| x * 1e-200);
    let rays = RayBatch {
        origins: &origins,
        directions: &directions,
        leaves: None,
    };
    let batch = Batch::free(&origins);
    let on_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        pool.expect("threads").install(|| {
            let mut hits = vec![None; origins.len()];
            index.nearest_hits(&rays, &mut hits).expect("hits");
            let mut blocked = vec![2; origins.len()];
            index
                .occluded_towards(&batch, Towards::Directions(&directions), &mut blocked)
                .expect("answers");
            let all = index.all_hits(&rays).expect("hits");
            (hits, blocked, all.hits, all.ends)
        })
    };
    let one = on_threads(1);
    assert_eq!(one, on_threads(3));
    assert_eq!((one.0[7], one.1[7]), (None, 0));
    let hit_count = one.0.iter().flatten().count();
    assert!(hit_count > 1000, "{hit_count}");
    for (number, hit) in one.0.iter().enumerate() {
        let first = one.3[number.max(1) - 1] * usize::from(number > 0);
        assert_eq!(*hit, one.2[first..one.3[number]].first().copied());
    }

    let refused = |number: usize, x: f64| {
        let mut bad = directions.clone();
        bad[number] = [1.0, x, 0.0];
        index.occluded_towards(&batch, Towards::Points(&bad), &mut vec![0; 5000])
    };
    for (number, x) in [(4999, f64::NAN), (3, f64::INFINITY), (2500, 1e31)] {
        let error = refused(number, x).expect_err("no number for a point");
        let text = error.to_string();
        assert!(text.starts_with(&format!("end {number} is ")), "{text}");
    }
    let short = RayBatch {
        directions: &directions[1..],
        ..rays
    };
    let error = index.all_hits(&short).expect_err("a direction is missing");
    assert_eq!(error.to_string(), "directions: expected 5000, found 4999");
    let beyond = vec![u32::MAX; 5000];
    let leaving = RayBatch {
        leaves: Some(&beyond),
        ..rays
    };
    let error = index.nearest_hits(&leaving, &mut vec![None; 5000]);
    let expected = "point 0: surface 4294967295 does not exist";
    assert_eq!(error.expect_err("no such surface").to_string(), expected);
}
