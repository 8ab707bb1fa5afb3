//! The places where the paper (voxel occlusion testing, 1990) needs care: one small scene for each.

use std::sync::Arc;

use antumbra::{
    Answer, BuildError, Counters, Decided, GridResolution, LightId, Method, Prediction, QuickCheck,
    RayMethod, Refinement, Shadow, ShadowIndex,
};
use antumbra_geometry::{
    Cone, DVec3, LightShape, Occluders, OccludersBuilder, Opacity, Ray, ReceiverPoint, Sphere,
    SurfaceId,
};

const METHODS: [Method; 3] = [Method::Voxel1990, Method::Grid, Method::Naive];

/// A square floor at height 0 is surfaces 0 and 1.
fn floor() -> OccludersBuilder {
    let mut builder = Occluders::builder();
    let corners = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    builder
        .add_face(
            &corners.map(|(x, y)| DVec3::new(x, y, 0.0)),
            Opacity::Opaque,
        )
        .unwrap();
    builder
}

fn with_ball(mut builder: OccludersBuilder, center: DVec3, radius: f64) -> OccludersBuilder {
    builder
        .add_sphere(Sphere { center, radius }, Opacity::Opaque)
        .unwrap();
    builder
}

fn point_light(x: f64, y: f64, z: f64) -> LightShape {
    LightShape::Point(DVec3::new(x, y, z))
}

fn index_of(
    occluders: &Arc<Occluders>,
    lights: &[LightShape],
    method: Method,
    grid: [u32; 3],
) -> ShadowIndex {
    ShadowIndex::builder(occluders.clone(), lights.to_vec())
        .method(method)
        .grid(GridResolution::Fixed(grid))
        .build()
        .unwrap()
}

fn on(surface: u32, x: f64, y: f64, z: f64) -> ReceiverPoint {
    ReceiverPoint {
        point: DVec3::new(x, y, z),
        surface: Some(SurfaceId(surface)),
    }
}

fn ask(index: &ShadowIndex, start: &ReceiverPoint, light: usize) -> Answer {
    index
        .shadow(start, LightId::from_index(light), &mut Counters::default())
        .expect("a fine query")
}

/// Points spread over the unit sphere.
fn sphere_points(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sine, cosine) = (i as f64 * 2.399_963).sin_cos();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * cosine, across * sine, z)
    })
}

#[test]
fn the_walk_ends_at_the_light_and_not_outside_the_grid() {
    let occluders = Arc::new(with_ball(floor(), DVec3::new(0.0, 0.0, 8.0), 1.0).build());
    let lights = [point_light(0.0, 0.0, 4.0), point_light(0.0, 0.0, 12.0)];
    for method in METHODS {
        for grid in [[1; 3], [4, 4, 9], [20; 3]] {
            let index = index_of(&occluders, &lights, method, grid);
            for x in [-0.25, 0.0, 0.125] {
                let start = on(0, x, -0.25, 0.0);
                let before = ask(&index, &start, 0).shadow;
                assert_eq!(before, Shadow::Lit, "{method:?} {grid:?}: beyond the light");
                let behind = ask(&index, &start, 1).shadow;
                assert_eq!(behind, Shadow::Shadowed, "{method:?} {grid:?}");
            }
        }
    }
}

#[test]
fn objects_of_the_first_voxel_are_tested_too() {
    // Ball and floor share the one voxel, or the low ball the start's voxel.
    let occluders = Arc::new(with_ball(floor(), DVec3::new(0.0, 0.0, 0.3), 0.2).build());
    let lights = [LightShape::Direction(DVec3::Z)];
    for method in METHODS {
        for grid in [[1; 3], [2, 2, 1], [5; 3]] {
            let index = index_of(&occluders, &lights, method, grid);
            let under = ask(&index, &on(0, 0.05, -0.06, 0.0), 0);
            assert_eq!(under.shadow, Shadow::Shadowed, "{method:?} {grid:?}");
            assert_eq!(under.decided, Decided::Ray, "{method:?} {grid:?}");
            let beside = ask(&index, &on(0, 0.3, -0.3, 0.0), 0).shadow;
            assert_eq!(beside, Shadow::Lit, "{method:?} {grid:?}");
        }
    }
}

#[test]
fn null_one_holds_for_the_side_that_faces_the_light_only() {
    let occluders = Arc::new(with_ball(Occluders::builder(), DVec3::ZERO, 1.0).build());
    let outside = DVec3::new(3.0, 1.0, 2.0);
    let lights = [
        LightShape::Point(outside),
        LightShape::Direction(DVec3::new(0.0, 0.6, 0.8)),
    ];
    let index = index_of(&occluders, &lights, Method::Voxel1990, [16; 3]);
    for (light, shape) in lights.iter().enumerate() {
        let mut counts = [0; 2];
        for p in sphere_points(500) {
            let is_facing = match *shape {
                LightShape::Point(position) => p.dot(position - p) > 0.0,
                LightShape::Direction(direction) => p.dot(direction) > 0.0,
            };
            counts[usize::from(is_facing)] += 1;
            let answer = ask(&index, &on(0, p.x, p.y, p.z), light);
            let expected = if is_facing {
                Shadow::Lit
            } else {
                Shadow::Shadowed
            };
            assert_eq!(answer.shadow, expected, "{p}");
            // The voxels around hold this one convex object: no ray is needed on either side.
            assert_eq!(answer.decided, Decided::FirstPass, "{p}");
        }
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    }
}

#[test]
fn light_inside_a_sphere_lights_its_inside_alone() {
    let ball = DVec3::new(0.0, 0.0, 2.0);
    let occluders = Arc::new(with_ball(floor(), ball, 1.0).build());
    let lights = [point_light(0.2, 0.0, 2.3)];
    for method in METHODS {
        let index = index_of(&occluders, &lights, method, [12; 3]);
        for p in sphere_points(200) {
            // Queries do not depend on the side that is looked at.
            let at = p + ball;
            let wall = ask(&index, &on(2, at.x, at.y, at.z), 0).shadow;
            assert_eq!(wall, Shadow::Lit, "{method:?} {at}");
            let free = |point: DVec3| {
                let start = ReceiverPoint {
                    point,
                    surface: None,
                };
                ask(&index, &start, 0).shadow
            };
            assert_eq!(free(ball + p * 0.9), Shadow::Lit, "{method:?} {at}");
            assert_eq!(free(ball + p * 1.1), Shadow::Shadowed, "{method:?} {at}");
        }
        for x in [-3.0, 0.0, 2.5] {
            let on_floor = ask(&index, &on(0, x, -3.5, 0.0), 0).shadow;
            assert_eq!(on_floor, Shadow::Shadowed, "{method:?}");
        }
    }
}

#[test]
fn an_open_tube_is_never_null_one() {
    // Seen through its open end the far wall's inside is lit, and the near wall shadows it from the
    // side: voxels that hold an open tube alone know nothing, those of a closed one do.
    let tube = |is_closed| {
        let mut builder = Occluders::builder();
        let cone = Cone {
            base: DVec3::ZERO,
            base_radius: 1.0,
            apex: DVec3::new(0.0, 0.0, 3.0),
            apex_radius: 1.0,
            is_closed,
        };
        builder.add_cone(cone, Opacity::Opaque).unwrap();
        Arc::new(builder.build())
    };
    let lights = [point_light(6.0, 0.5, 2.0), point_light(1.0, 0.3, 7.0)];
    let mut lit = [0; 2];
    for is_closed in [false, true] {
        let index = index_of(&tube(is_closed), &lights, Method::Voxel1990, [14; 3]);
        for step in 0..400 {
            let (sine, cosine) = f64::from(step).sin_cos();
            let start = on(0, cosine, sine, f64::from(step % 37) * 0.08);
            for light in 0..2 {
                let answer = ask(&index, &start, light);
                assert_eq!(
                    Ok(answer.shadow),
                    index.shadow_by_reference(&start, LightId::from_index(light))
                );
                if answer.shadow == Shadow::Lit && answer.decided == Decided::FirstPass {
                    lit[usize::from(is_closed)] += 1;
                }
            }
        }
    }
    assert_eq!(lit[0], 0, "the open tube was taken for a convex object");
    assert!(lit[1] > 100, "{lit:?}");
}

#[test]
fn values_take_two_bits_a_voxel_and_light() {
    let occluders = Arc::new(with_ball(floor(), DVec3::Z, 0.5).build());
    let lamps = [
        point_light(1.0, 2.0, 8.0),
        point_light(-3.0, 2.0, 8.0),
        LightShape::Direction(DVec3::Z),
    ];
    for (grid, bits) in [([40; 3], 2 * 40 * 40 * 40), ([8, 4, 2], 2 * 8 * 4 * 2)] {
        for lights in 1..=3 {
            let index = index_of(&occluders, &lamps[..lights], Method::Voxel1990, grid);
            assert_eq!(index.occlusion_bytes() * 8, bits * lights as u64);
            let grid_only = index_of(&occluders, &lamps[..lights], Method::Grid, grid);
            assert_eq!(grid_only.occlusion_bytes(), 0);
        }
    }
}

/// 4096 small triangles, spread like the paper's Tetra.
fn tetra_like() -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    for i in 0..4096u32 {
        let at = |shift: u32| f64::from((i >> shift) & 15);
        let corner = DVec3::new(at(0), at(4), at(8));
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|edge| corner + 0.3 * edge);
        builder.add_face(&face, Opacity::Opaque).unwrap();
    }
    Arc::new(builder.build())
}

#[test]
fn quick_check_reports_or_is_obeyed() {
    let lights = [point_light(7.0, 8.0, 30.0)];
    let big = Arc::new(floor().build());
    let ball = Arc::new(with_ball(floor(), DVec3::Z, 0.5).build());
    for (occluders, is_advised) in [(tetra_like(), false), (big, true), (ball, true)] {
        let build = |check: QuickCheck| {
            ShadowIndex::builder(occluders.clone(), lights.to_vec())
                .method(Method::Voxel1990)
                .grid(GridResolution::Fixed([40; 3]))
                .quick_check(check)
                .build()
                .unwrap()
        };
        let (off, report, obey) = (
            build(QuickCheck::Off),
            build(QuickCheck::Report),
            build(QuickCheck::Obey),
        );
        assert_eq!(off.quick_check(), None);
        let verdict = report.quick_check().unwrap();
        assert_eq!(obey.quick_check(), Some(verdict));
        assert_eq!(verdict.is_advised, is_advised, "{verdict:?}");
        assert_eq!(
            verdict.is_advised,
            verdict.occupied_share >= verdict.threshold
        );
        // A share of the volume: only divided by n N^3, not by the printed n N^2.
        assert!(
            0.0 < verdict.occupied_share && verdict.occupied_share <= 1.0,
            "{verdict:?}"
        );
        assert_eq!(
            report.method(),
            Method::Voxel1990,
            "a report changes nothing"
        );
        let obeyed = if is_advised {
            Method::Voxel1990
        } else {
            Method::Grid
        };
        assert_eq!(obey.method(), obeyed);
        assert_eq!(obey.occlusion_bytes() > 0, is_advised);
        for i in 0..200 {
            let p = f64::from(i);
            let start = ReceiverPoint {
                point: DVec3::new(p * 0.07, p * 0.11 % 15.0, p * 0.013),
                surface: None,
            };
            assert_eq!(ask(&report, &start, 0).shadow, ask(&obey, &start, 0).shadow);
        }
    }
    // One element in one voxel fills all of it.
    let one = Arc::new(floor().build());
    let index = ShadowIndex::builder(one, lights.to_vec())
        .method(Method::Voxel1990)
        .grid(GridResolution::Fixed([1; 3]))
        .quick_check(QuickCheck::Report)
        .build()
        .unwrap();
    assert_eq!(index.quick_check().unwrap().occupied_share, 1.0);
}

#[test]
fn values_survive_moves_of_the_camera() {
    let occluders = Arc::new(with_ball(floor(), DVec3::new(0.3, 0.2, 1.5), 0.7).build());
    let lights = [point_light(2.0, 1.0, 6.0)];
    let index = index_of(&occluders, &lights, Method::Voxel1990, [24; 3]);
    let starts: Vec<ReceiverPoint> = (0..400)
        .map(|i| {
            on(
                0,
                f64::from(i % 20) * 0.19 - 0.2,
                f64::from(i / 20) * 0.19 - 3.9,
                0.0,
            )
        })
        .collect();
    let answers = || -> Vec<Answer> { starts.iter().map(|start| ask(&index, start, 0)).collect() };
    // The index is not changed by anything that is asked of it: nothing is there to rebuild.
    let (before, bytes) = (answers(), index.occlusion_bytes());
    assert!(before.iter().any(|answer| answer.decided != Decided::Ray));
    let mut hits = 0;
    for eye in sphere_points(50) {
        for target in sphere_points(30) {
            let ray = Ray {
                origin: eye * 9.0,
                direction: target * 2.0 - eye * 9.0,
                leaves: None,
            };
            hits += usize::from(index.nearest(&ray, &mut Counters::default()).is_some());
        }
    }
    assert!(hits > 500, "{hits}");
    assert_eq!(answers(), before);
    assert_eq!(index.occlusion_bytes(), bytes);
}

#[test]
fn several_lights_do_not_know_of_each_other() {
    let occluders = Arc::new(with_ball(floor(), DVec3::new(0.3, 0.2, 1.5), 0.7).build());
    let lights = [
        point_light(2.0, 1.0, 6.0),
        LightShape::Direction(DVec3::new(-0.5, 0.2, 1.0)),
        point_light(0.3, 0.2, 1.4),
    ];
    let all = index_of(&occluders, &lights, Method::Voxel1990, [17, 15, 9]);
    let mut differing = 0;
    for (light, shape) in lights.iter().enumerate() {
        let alone = index_of(&occluders, &[*shape], Method::Voxel1990, [17, 15, 9]);
        for i in 0..900 {
            let (x, y) = (
                f64::from(i % 30) * 0.27 - 3.9,
                f64::from(i / 30) * 0.27 - 3.9,
            );
            let start = on(u32::from(y > x), x, y, 0.0);
            let answer = ask(&all, &start, light);
            assert_eq!(answer, ask(&alone, &start, 0), "light {light} {start:?}");
            differing += usize::from(answer.shadow != ask(&all, &start, 0).shadow);
        }
    }
    assert!(differing > 10, "the lights cast the same shadows");
}

#[test]
fn lights_without_a_place_or_direction_are_refused() {
    let occluders = Arc::new(floor().build());
    let fine = point_light(0.0, 0.0, 9.0);
    for bad in [
        LightShape::Direction(DVec3::ZERO),
        LightShape::Direction(DVec3::new(0.0, -0.0, 0.0)),
        LightShape::Direction(DVec3::new(0.0, f64::NAN, 1.0)),
        LightShape::Point(DVec3::new(f64::INFINITY, 0.0, 1.0)),
        LightShape::Point(DVec3::new(0.0, 0.0, 2f64.powi(101))),
    ] {
        for method in METHODS {
            let refused = ShadowIndex::builder(occluders.clone(), vec![fine, bad])
                .method(method)
                .build()
                .err();
            assert_eq!(
                refused,
                Some(BuildError::BadLight { light: LightId(1) }),
                "{bad:?}"
            );
        }
    }
    // A point may stand at the origin, and a direction be of any length.
    let unusual = vec![
        LightShape::Point(DVec3::ZERO),
        LightShape::Direction(DVec3::new(0.0, 0.0, 5e-324)),
    ];
    let occluders = Arc::new(with_ball(floor(), DVec3::new(0.0, 0.0, 3.0), 1.0).build());
    for method in METHODS {
        let index = index_of(&occluders, &unusual, method, [9; 3]);
        let shadow_at = |x: f64| ask(&index, &on(0, x, -0.5, 0.0), 1).shadow;
        assert_eq!(
            [shadow_at(0.1), shadow_at(2.0)],
            [Shadow::Shadowed, Shadow::Lit],
            "{method:?}"
        );
    }
}

fn predicted_of(occluders: &Occluders, grid: GridResolution) -> Prediction {
    let how = (Method::Voxel1990, RayMethod::Bvh);
    ShadowIndex::predict(occluders, 1, grid, how, Refinement::default(), None).unwrap()
}

#[test]
fn too_little_memory_is_refused_with_figures_before_any_is_taken() {
    let occluders = Arc::new(floor().build());
    let lights = vec![point_light(0.0, 0.0, 9.0)];
    // 4 10^9 voxels: taking what this needs would be noticed.
    let grid = GridResolution::Fixed([1600; 3]);
    let limit = 1 << 30;
    let refused = ShadowIndex::builder(occluders.clone(), lights.clone())
        .method(Method::Voxel1990)
        .grid(grid)
        .memory_limit(limit)
        .build()
        .expect_err("more than a gibibyte");
    let predicted = predicted_of(&occluders, grid);
    let needed = predicted.needed();
    assert!(needed > 2 * 1600 * 1600 * 1600 / 8 && needed > limit);
    assert_eq!(refused, BuildError::Memory { predicted, limit });
    let text = refused.to_string();
    for figure in [needed, limit] {
        assert!(text.contains(&figure.to_string()), "{text}");
    }

    // The limit is kept to the byte of the prediction.
    let grid = GridResolution::Fixed([30; 3]);
    let needed = predicted_of(&occluders, grid).needed();
    let build = |limit| {
        ShadowIndex::builder(occluders.clone(), lights.clone())
            .method(Method::Voxel1990)
            .grid(grid)
            .memory_limit(limit)
            .build()
    };
    assert!(build(needed).is_ok());
    assert!(build(needed - 1).is_err());
}

#[test]
fn resolutions_out_of_range_are_refused_and_the_reason_is_clear() {
    let occluders = Arc::new(floor().build());
    for grid in [[2048; 3], [0, 4, 4], [4, 2049, 4], [1626; 3], [u32::MAX; 3]] {
        let refused = ShadowIndex::builder(occluders.clone(), Vec::new())
            .grid(GridResolution::Fixed(grid))
            .build()
            .expect_err("out of range");
        assert_eq!(refused, BuildError::BadResolution(grid));
        let text = refused.to_string();
        for part in [&format!("{grid:?}"), "1 to 2048", "2^32"] {
            assert!(text.contains(part), "{text}");
        }
    }
    // Long grids are fine as long as they are thin.
    let thin = GridResolution::Fixed([2048, 3, 1]);
    let index = ShadowIndex::builder(occluders, Vec::new())
        .grid(thin)
        .build()
        .unwrap();
    assert_eq!(index.grid_resolution(), [2048, 3, 1]);
}
