//! What is asked of points that are meant to lie on surfaces: tolerances, ties, named surfaces, starts off them.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchError, BatchKind, Coordinates, Counters, GridResolution, Method, Nearness,
    OffSurface, RayMethod, Refine, Refinement, Shadow, ShadowIndex, Towards,
};
use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, Opacity, Precision, Sphere, Start, SurfaceId,
};
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::{Oracle, OraclePoint, OracleShape, OracleSurface};

use common::{METHODS, Random};

const UP: LightShape = LightShape::Direction(DVec3::Z);

/// Map coordinates of Munich.
const MUNICH: [f64; 3] = [691_000.0, 5_334_000.0, 520.0];

fn scene(faces: &[&[[f64; 3]]]) -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    for face in faces {
        let corners: Vec<DVec3> = face.iter().map(|&x| DVec3::from_array(x)).collect();
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    Arc::new(builder.build())
}

fn index_of(occluders: &Arc<Occluders>, lights: &[LightShape], method: Method) -> ShadowIndex {
    ShadowIndex::builder(Arc::clone(occluders), lights.to_vec())
        .method(method)
        .grid(GridResolution::Fixed([8; 3]))
        .build()
        .expect("an index")
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn narrow(point: [f64; 3]) -> [f32; 3] {
    point.map(|x| x as f32)
}

fn ask<P: Coordinates>(index: &ShadowIndex, batch: &Batch<P>) -> Result<Vec<bool>, BatchError> {
    let mut out = vec![7; batch.points.len()];
    index.occluded(batch, &[0], &mut out)?;
    Ok(out.iter().map(|&byte| byte == 1).collect())
}

fn on_nearest<P: Coordinates>(
    index: &ShadowIndex,
    point: P,
    normal: Option<P>,
) -> Result<bool, BatchError> {
    let (points, normals) = ([point], normal.map(|normal| [normal]));
    let normals = normals.as_ref().map(|normals| &normals[..]);
    ask(index, &Batch::on_nearest(&points, normals)).map(|answers| answers[0])
}

/// A floor, and a slanted slab one unit over it, both moved: surfaces 0, 1 and 2, 3.
fn floor_and_slab(offset: [f64; 3]) -> Arc<Occluders> {
    let at = |corners: [[f64; 3]; 4]| corners.map(|x| plus(x, offset));
    let floor = at([
        [-5.0, -5.0, 0.0],
        [5.0, -5.0, 0.0],
        [5.0, 5.0, 0.0],
        [-5.0, 5.0, 0.0],
    ]);
    let slab = at([
        [-1.0, -1.0, 1.1],
        [1.0, -1.0, 0.9],
        [1.0, 1.0, 0.9],
        [-1.0, 1.0, 1.1],
    ]);
    let halves = |q: [[f64; 3]; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]];
    let ([a, b], [c, d]) = (halves(floor), halves(slab));
    scene(&[&a, &b, &c, &d])
}

#[test]
fn a_point_of_a_floor_in_map_coordinates_is_not_put_on_the_slab_over_it() {
    let normal = [0.1, 0.0, 1.0];
    for offset in [
        [0.0; 3],
        MUNICH,
        MUNICH.map(|x| -x),
        [5e6, 0.0, 0.0],
        [1e9, -1e9, 1e9],
    ] {
        let occluders = floor_and_slab(offset);
        let point = plus([0.2, 0.1, 0.0], offset);
        for method in METHODS {
            let index = index_of(&occluders, &[UP], method);
            let named = ask(&index, &Batch::on_surfaces(&[point], &[0])).expect("on the floor");
            assert_eq!(named, [true]);
            assert_eq!(
                on_nearest(&index, point, Some(normal)),
                Ok(true),
                "{method:?} {offset:?}"
            );
            assert_eq!(
                on_nearest(&index, point, None),
                Ok(true),
                "{method:?} {offset:?}"
            );
            // Widening the reach does not let the normal take the slab.
            for tolerance in [2.0, 1e4, f64::INFINITY] {
                let nearness = Nearness {
                    precision: Precision::Double,
                    tolerance: Some(tolerance),
                };
                let start = index
                    .start_near(
                        DVec3::from_array(point),
                        Some(DVec3::from_array(normal)),
                        nearness,
                    )
                    .expect("within the tolerance");
                assert!(
                    start.surface < Some(SurfaceId(2)),
                    "{method:?} {offset:?} {tolerance}"
                );
            }
        }
    }
    // In f32 the point moves by centimetres along the floor, and is still on it.
    for offset in [[0.0; 3], MUNICH] {
        let index = index_of(&floor_and_slab(offset), &[UP], Method::Bvh);
        let point = narrow(plus([0.2, 0.1, 0.0], offset));
        assert_eq!(
            on_nearest(&index, point, Some(narrow(normal))),
            Ok(true),
            "{offset:?}"
        );
    }
}

#[test]
fn a_point_one_metre_off_every_surface_is_refused_wherever_the_scene_lies() {
    for offset in [[0.0; 3], MUNICH, [1e9, 1e9, 1e9]] {
        let index = index_of(&floor_and_slab(offset), &[UP], Method::Bvh);
        let point = plus([4.0, 0.0, 1.0], offset);
        let error = on_nearest(&index, point, None).expect_err("off every surface");
        let BatchError::NoSurface {
            index: number,
            nearest: Some((surface, distance)),
            allowed,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!((number, surface), (0, SurfaceId(0)));
        assert!((distance - 1.0).abs() < 1e-6 && allowed < 1e-2, "{error}");
        let text = error.to_string();
        assert!(
            text.contains("nearest surface, 0, is 1 away") || offset != [0.0; 3],
            "{text}"
        );
        let single = on_nearest(&index, narrow(point), None);
        assert!(
            single.is_err() || offset == [1e9; 3],
            "{offset:?}: {single:?}"
        );
    }
}

#[test]
fn a_huge_surface_far_off_grants_nothing_to_the_small_one_nearby() {
    // A ground plane that reaches a million away, tilted a little; a small slab just over it.
    let big = 1e6;
    let ground = |x: f64, y: f64| [x, y, 1e-3 * x];
    let slab = [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [0.0, 1.0, 0.5]];
    let corners = [ground(-big, -big), ground(big, -big), ground(0.0, big)];
    let far = [
        [1e8, 1e8, 1e8],
        [1e8 + 1.0, 1e8, 1e8],
        [1e8, 1e8 + 1.0, 1e8],
    ];
    let index = index_of(&scene(&[&corners, &slab, &far]), &[UP], Method::Bvh);
    let nearest = |point: [f64; 3], precision| {
        let nearness = Nearness {
            precision,
            tolerance: None,
        };
        let normal = DVec3::new(-1e-3, 0.0, 1.0);
        let start = index.start_near(DVec3::from_array(point), Some(normal), nearness);
        start.and_then(|start| start.surface)
    };
    for precision in [Precision::Single, Precision::Double] {
        // The ground's normal is given, and the ground is within its own rounding as f32; the slab is nearer.
        assert_eq!(nearest([0.1, 0.1, 0.5], precision), Some(SurfaceId(1)));
    }
    // A point between: the ground reaches far enough for rounding to f32 to explain it, not for that to f64.
    assert_eq!(
        nearest([0.1, 0.1, 0.25], Precision::Single),
        Some(SurfaceId(0))
    );
    assert_eq!(nearest([0.1, 0.1, 0.25], Precision::Double), None);
    // Level ground whose height is exact is no nearer for being large.
    let level = corners.map(|[x, y, _]| [x, y, 0.0]);
    let index = index_of(&scene(&[&level, &slab]), &[UP], Method::Bvh);
    let point = [0.1, 0.1, 0.125];
    assert!(on_nearest(&index, point, None).is_err());
}

#[test]
fn a_slab_thinner_than_rounding_is_told_by_its_normal_alone() {
    // Both sides tie; the normal points out of one.
    let side = |z: f64| [[-1.0, -1.0, z], [1.0, -1.0, z], [0.0, 1.0, z]];
    let (top, mut bottom) = (side(1e-15), side(0.0));
    bottom.swap(1, 2);
    let index = index_of(&scene(&[&bottom, &top]), &[UP], Method::Bvh);
    for z in [0.0, 5e-16, 1e-15] {
        assert_eq!(
            on_nearest(&index, [0.1, 0.1, z], Some([0.0, 0.0, 1.0])),
            Ok(false),
            "{z}"
        );
        assert_eq!(
            on_nearest(&index, [0.1, 0.1, z], Some([0.0, 0.0, -1.0])),
            Ok(true),
            "{z}"
        );
    }
    // One that f64 resolves is told by distance.
    let index = index_of(&scene(&[&bottom, &side(1e-6)]), &[UP], Method::Bvh);
    assert_eq!(
        on_nearest(&index, [0.1, 0.1, 0.0], Some([0.0, 0.0, 1.0])),
        Ok(true)
    );
    assert_eq!(
        on_nearest(&index, [0.1, 0.1, 1e-6], Some([0.0, 0.0, -1.0])),
        Ok(false)
    );
}

#[test]
fn points_that_are_rounded_lie_on_their_surfaces_at_every_scale_and_place() {
    let random = &mut Random(3);
    for scale in [1e-30, 1e-3, 1.0, 1e6] {
        for place in [0.0, 1.0, 1e3, 1e6] {
            let at = |x: DVec3| (x + place) * scale;
            let corners = [(); 3].map(|()| at(random.in_cube()));
            let occluders = scene(&[&corners.map(|x| x.to_array())]);
            let index = index_of(&occluders, &[UP], Method::Bvh);
            for _ in 0..200 {
                let weights = [(); 3].map(|()| random.real(0.0, 1.0));
                let sum: f64 = weights.iter().sum();
                let double = corners[0] * (weights[0] / sum)
                    + corners[1] * (weights[1] / sum)
                    + corners[2] * (weights[2] / sum);
                // Computed in f32 throughout, as a renderer does.
                let [u, v] = [0, 1].map(|i: usize| (weights[i] / sum) as f32);
                let w = 1.0 - u - v;
                let [a, b, c] = corners.map(|x| narrow(x.to_array()));
                let single: [f32; 3] = std::array::from_fn(|i| a[i] * u + b[i] * v + c[i] * w);
                let label = format!("{scale} {place} {double}");
                assert!(
                    on_nearest(&index, double.to_array(), None).is_ok(),
                    "{label}"
                );
                assert!(on_nearest(&index, single, None).is_ok(), "{label}");
                assert!(
                    ask(&index, &Batch::on_surfaces(&[single], &[0])).is_ok(),
                    "{label}"
                );
            }
        }
    }
}

#[test]
fn points_named_to_be_on_faces_far_from_them_are_refused() {
    let occluders = floor_and_slab(MUNICH);
    let point = |x, z| plus([x, 0.0, z], MUNICH);
    let points = [
        point(0.2, 0.0),
        point(0.3, 0.0),
        point(0.4, 0.0),
        point(0.5, 0.0),
    ];
    let surfaces = [0, 2, 3, 0];
    for method in METHODS {
        let index = index_of(&occluders, &[UP], method);
        let batch = Batch::on_surfaces(&points, &surfaces);
        let error = ask(&index, &batch).expect_err("two are far off");
        let BatchError::OffSurface { first } = error else {
            panic!("{error}");
        };
        assert_eq!((first.index, first.surface), (1, 2));
        assert!(
            (0.9..1.0).contains(&first.distance) && first.allowed < 0.5,
            "{error}"
        );
        let off = index.off_surfaces(&batch).expect("two are far off");
        assert_eq!((off.count, off.first), (2, first));
        assert!(off.worst.distance >= first.distance, "{off:?}");

        let within = |tolerance| {
            let kind = BatchKind::OnSurfaces {
                surfaces: &surfaces,
                tolerance: Some(tolerance),
            };
            Batch {
                points: &points,
                kind,
            }
        };
        assert!(matches!(
            ask(&index, &within(0.5)),
            Err(BatchError::OffSurface { .. })
        ));
        for tolerance in [1.5, f64::INFINITY] {
            assert_eq!(
                ask(&index, &within(tolerance)),
                Ok(vec![true, false, false, true])
            );
            assert_eq!(index.off_surfaces(&within(tolerance)), None);
        }
        assert_eq!(
            ask(&index, &within(-1.0)),
            Err(BatchError::BadTolerance(-1.0))
        );
        // Segments name surfaces, too.
        let ends = points.map(|x| plus(x, [0.0, 0.0, 9.0]));
        let mut out = [0; 4];
        let found = index.occluded_towards(&batch, Towards::Points(&ends), &mut out);
        assert!(matches!(
            found,
            Err(BatchError::OffSurface {
                first: OffSurface { index: 1, .. }
            })
        ));
    }
}

#[test]
fn many_points_of_surfaces_among_points_of_space_are_noticed() {
    let occluders = floor_and_slab(MUNICH);
    let random = &mut Random(5);
    let mut points = |lowest: f64, highest: f64| -> Vec<[f64; 3]> {
        let all = (0..5000).map(|_| {
            let [x, y, _] = random.in_cube().to_array();
            plus([4.0 * x, 4.0 * y, random.real(lowest, highest)], MUNICH)
        });
        all.collect()
    };
    let (on, above) = (points(0.0, 0.0), points(2.0, 9.0));
    for method in METHODS {
        let index = index_of(&occluders, &[UP], method);
        let sample = index.sample_on_surfaces(&on);
        assert!(sample.is_suspicious() && sample.on_surface == sample.looked_at);
        assert!(sample.looked_at <= 1000 && sample.looked_at > 100);
        assert!(!index.sample_on_surfaces(&above).is_suspicious());
        let mixed: Vec<[f64; 3]> = on.iter().chain(&above).copied().collect();
        let sample = index.sample_on_surfaces(&mixed);
        assert!(sample.is_suspicious() && sample.on_surface < sample.looked_at);
        assert_eq!(index.sample_on_surfaces::<[f64; 3]>(&[]).looked_at, 0);
    }
}

/// All methods, that of the paper and the one of today with several sizes of voxels.
fn all_indices(occluders: &Arc<Occluders>, lights: &[LightShape]) -> Vec<(String, ShadowIndex)> {
    let mut indices = Vec::new();
    let builder =
        |method| ShadowIndex::builder(Arc::clone(occluders), lights.to_vec()).method(method);
    for method in [Method::Voxel1990, Method::Grid, Method::Bvh] {
        for resolution in [1, 8, 23] {
            let index = builder(method)
                .grid(GridResolution::Fixed([resolution; 3]))
                .build();
            indices.push((format!("{method:?} {resolution}"), index.expect("an index")));
        }
    }
    for refine in [Refine::Eager, Refine::Asked, Refine::Lazy] {
        for resolution in [16, 256] {
            let refinement = Refinement {
                resolution,
                space_resolution: resolution,
                refine,
                ..Refinement::default()
            };
            let index = builder(Method::Voxel).refinement(refinement).build();
            indices.push((
                format!("Voxel {refine:?} {resolution}"),
                index.expect("an index"),
            ));
        }
    }
    indices
}

/// Compares all methods with the reference, one by one and together.
fn agree(occluders: &Arc<Occluders>, lights: &[LightShape], starts: &[Start], label: &str) {
    let indices = all_indices(occluders, lights);
    for light in 0..lights.len() {
        let expected: Vec<bool> = starts
            .iter()
            .map(|start| {
                let answer = indices[0].1.shadow_by_reference(start, light);
                answer.expect("a fine query") == Shadow::Shadowed
            })
            .collect();
        for (name, index) in &indices {
            let mut together = vec![false; starts.len()];
            index
                .shadows(starts, light, &mut together, &mut Counters::default())
                .expect("fine queries");
            for (number, start) in starts.iter().enumerate() {
                let answer = index.shadow(start, light, &mut Counters::default());
                let alone = answer.expect("a fine query").shadow == Shadow::Shadowed;
                assert_eq!(
                    [alone, together[number]],
                    [expected[number]; 2],
                    "{label}: {name}, {:?}, {start:?}",
                    lights[light]
                );
            }
        }
    }
}

/// A sphere, an open tube, a closed cone, a closed cylinder and a disk, with a floor, at a place.
fn curved_shapes(place: DVec3) -> Arc<Occluders> {
    let v = |x, y, z| place + DVec3::new(x, y, z);
    let mut builder = Occluders::builder();
    let floor = [
        v(-4.0, -4.0, -1.5),
        v(9.0, -4.0, -1.5),
        v(9.0, 9.0, -1.5),
        v(-4.0, 9.0, -1.5),
    ];
    builder.add_face(&floor, Opacity::Opaque).expect("a face");
    let sphere = |center, radius| Sphere { center, radius };
    builder
        .add_sphere(sphere(v(0.0, 0.0, 0.0), 1.0), Opacity::Opaque)
        .expect("a sphere");
    builder
        .add_sphere(sphere(v(0.5, 0.5, 3.0), 0.5), Opacity::Opaque)
        .expect("a sphere");
    let cone = |base, base_radius, apex, apex_radius, is_closed| Cone {
        base,
        base_radius,
        apex,
        apex_radius,
        is_closed,
    };
    for cone in [
        cone(v(4.0, 0.0, -1.0), 1.0, v(4.2, 0.1, 1.0), 0.5, false),
        cone(v(0.0, 4.0, -1.0), 1.0, v(0.1, 4.2, 1.0), 0.0, true),
        cone(v(4.0, 4.0, -1.0), 0.75, v(4.0, 4.0, 1.0), 0.75, true),
    ] {
        builder.add_cone(cone, Opacity::Opaque).expect("a cone");
    }
    let disk = Disk {
        center: v(7.0, 7.0, 0.5),
        normal: DVec3::new(0.2, 0.1, 1.0),
        radius: 1.0,
    };
    builder.add_disk(disk, Opacity::Opaque).expect("a disk");
    Arc::new(builder.build())
}

fn lamps(place: DVec3) -> [LightShape; 4] {
    [
        LightShape::Direction(DVec3::new(0.3, 0.2, 1.0)),
        LightShape::Direction(DVec3::X),
        LightShape::Point(place + DVec3::new(2.0, 2.0, 6.0)),
        // Inside the cylinder.
        LightShape::Point(place + DVec3::new(4.0, 4.0, 0.25)),
    ]
}

#[test]
fn starts_rounded_to_f32_off_curved_surfaces_answer_alike_by_all_methods() {
    let random = &mut Random(11);
    for place in [0.0, 1e3, 1e4, 1e5, 1e6, 5e6, 1e7] {
        let place = DVec3::new(place, 0.7 * place, -0.3 * place);
        let occluders = curved_shapes(place);
        let mut starts = Vec::new();
        for number in 0..400 {
            let surface = SurfaceId(number % occluders.surface_count() as u32);
            let beside = occluders.surface_bounds(surface).center() + 1.3 * random.in_cube();
            let on = occluders.start_on(surface, beside).point;
            let rounded = DVec3::from_array(on.to_array().map(|x| f64::from(x as f32)));
            for point in [rounded, on] {
                starts.push(Start {
                    point,
                    surface: Some(surface),
                });
            }
        }
        agree(&occluders, &lamps(place), &starts, &format!("{place}"));
    }
}

#[test]
fn starts_anywhere_answer_alike_by_all_methods() {
    let random = &mut Random(13);
    for place in [DVec3::ZERO, DVec3::new(5e5, 5e6, 100.0)] {
        let occluders = curved_shapes(place);
        let mut starts = Vec::new();
        for number in 0..400 {
            let surface = SurfaceId(number % occluders.surface_count() as u32);
            let reach = [1e-9, 1e-3, 0.1, 1.0, 8.0, 1e3, 1e9, 1e30][number as usize % 8];
            let near = [occluders.surface_bounds(surface).center(), place][number as usize % 2];
            starts.push(Start {
                point: near + reach * random.in_cube(),
                surface: Some(surface),
            });
        }
        agree(&occluders, &lamps(place), &starts, &format!("{place}"));
    }
}

#[test]
fn a_start_inside_its_own_sphere_is_not_shadowed_by_what_covers_the_voxel() {
    let mut builder = Occluders::builder();
    let sphere = Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
    };
    builder
        .add_sphere(sphere, Opacity::Opaque)
        .expect("a sphere");
    let occluders = Arc::new(builder.build());
    let lights = [LightShape::Point(DVec3::X), LightShape::Direction(DVec3::X)];
    let start = Start {
        point: DVec3::new(0.125, 0.125, 0.625),
        surface: Some(SurfaceId(0)),
    };
    for method in METHODS {
        let index = index_of(&occluders, &lights, method);
        for light in 0..2 {
            let answer = index.shadow(&start, light, &mut Counters::default());
            assert_eq!(
                answer.map(|answer| answer.shadow),
                Ok(Shadow::Lit),
                "{method:?}"
            );
        }
    }
    agree(&occluders, &lights, &[start], "smallest");
}

/// The library's surfaces with the same numbers as the oracle's.
fn same_surfaces(surfaces: &[OracleSurface]) -> Option<Arc<Occluders>> {
    let v = DVec3::from_array;
    let mut builder = Occluders::builder();
    for surface in surfaces {
        let added = match surface.shape {
            OracleShape::Triangle(corners) => builder.add_face(&corners.map(v), Opacity::Opaque),
            OracleShape::Sphere { center, radius } => {
                let center = v(center);
                builder.add_sphere(Sphere { center, radius }, Opacity::Opaque)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let (center, normal) = (v(center), v(normal));
                let disk = Disk {
                    center,
                    normal,
                    radius,
                };
                builder.add_disk(disk, Opacity::Opaque)
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let cone = Cone {
                    base: v(base),
                    base_radius,
                    apex: v(apex),
                    apex_radius,
                    is_closed: surface.solid.is_some(),
                };
                builder.add_cone(cone, Opacity::Opaque)
            }
            OracleShape::Cap { .. } => continue,
        };
        added.ok()?;
    }
    let occluders = builder.build();
    (occluders.surface_count() == surfaces.len()).then(|| Arc::new(occluders))
}

/// The tree, the grid and the oracle, which measures every surface by the page.
#[test]
fn surfaces_of_points_are_those_of_the_page() {
    let (mut asked, mut named, mut chosen) = (0, 0, 0);
    for seed in 0..120 {
        let scene = nasty::scene(seed);
        let largest = scene
            .queries
            .iter()
            .flat_map(|query| query.point)
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        // The oracle squares plain numbers.
        if !(1e-60..1e60).contains(&largest) {
            continue;
        }
        let Some(occluders) = same_surfaces(&scene.surfaces) else {
            continue;
        };
        let oracle = Oracle::new(scene.surfaces.clone());
        let by_tree = index_of(&occluders, &[UP], Method::Bvh);
        let by_grid = ShadowIndex::builder(Arc::clone(&occluders), vec![UP])
            .method(Method::Grid)
            .rays(RayMethod::Grid)
            .grid(GridResolution::Fixed([7; 3]))
            .build()
            .expect("an index");
        let random = &mut Random(seed);
        for query in &scene.queries {
            // Whether what is hardly a number becomes zero is not the page's matter.
            let is_tiny = |x: f64| x != 0.0 && x.abs() < 1e-150;
            if query.point.into_iter().any(is_tiny) {
                continue;
            }
            let normals = [
                None,
                Some([0.0, 0.0, 1.0]),
                Some(random.in_cube().to_array()),
            ];
            for normal in normals {
                for (is_single, tolerance) in [
                    (false, None),
                    (true, None),
                    (false, Some(0.0)),
                    (true, Some(0.3 * largest)),
                    (false, Some(f64::INFINITY)),
                ] {
                    let point = match is_single {
                        true => query.point.map(|x| f64::from(x as f32)),
                        false => query.point,
                    };
                    let expected = oracle.surface_of(&OraclePoint {
                        point,
                        normal,
                        is_single,
                        tolerance,
                    });
                    let nearness = Nearness {
                        precision: match is_single {
                            true => Precision::Single,
                            false => Precision::Double,
                        },
                        tolerance,
                    };
                    asked += 1;
                    named += usize::from(expected.is_some());
                    for index in [&by_tree, &by_grid] {
                        let normal = normal.map(DVec3::from_array);
                        let found = index.start_near(DVec3::from_array(point), normal, nearness);
                        let found = found.and_then(|start| start.surface);
                        chosen += usize::from(found.is_some() && normal.is_some());
                        assert_eq!(
                            found,
                            expected.map(|surface| SurfaceId(surface as u32)),
                            "{}: {point:?} {normal:?} {nearness:?}",
                            scene.label()
                        );
                    }
                }
            }
        }
    }
    assert!(
        asked > 10_000 && named > asked / 3 && chosen > 5_000,
        "{asked} {named} {chosen}"
    );
}
