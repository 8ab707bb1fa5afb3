//! Values for whole lights: every sample is the reference's, whatever is known of the light.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchKind, Counters, LightSamples, LightSampling, Method, ReceiverSide, Refine,
    Refinement, ShadowIndex, Targets,
};
use antumbra_geometry::{
    AreaShape, DVec3, DiskLight, LightShape, MeshLight, Occluders, PolygonLight, ReceiverPoint,
    RectangleLight, SamplePattern, SegmentLight, SphereLight, SunDisc, SurfaceId, TriangleLight,
};
use antumbra_testkit::nasty;
use common::Random;

/// An index that makes values for whatever is asked, in cells of the scene halved so many times.
fn index_of(occluders: &Arc<Occluders>, resolution: u32, refine: Refine) -> ShadowIndex {
    let refinement = Refinement {
        resolution,
        refine,
        ..Refinement::default()
    };
    ShadowIndex::builder(occluders.clone(), Vec::new())
        .method(Method::Auto)
        .refinement(refinement)
        .build()
        .expect("settings are in range")
}

/// How many nasty scenes the suite asks; `ANTUMBRA_NASTY_SEEDS=from..to` asks others.
fn seeds() -> std::ops::Range<u64> {
    let Ok(text) = std::env::var("ANTUMBRA_NASTY_SEEDS") else {
        return 0..120;
    };
    let (from, to) = text
        .split_once("..")
        .expect("ANTUMBRA_NASTY_SEEDS is from..to");
    from.parse().expect("a number")..to.parse().expect("a number")
}

/// Lights of all kinds: about a point, on surfaces and through them, on corners, far off.
fn lights(occluders: &Occluders, own: &[LightShape], random: &mut Random) -> Vec<AreaShape> {
    let bounds = occluders.bounds();
    let extent = bounds.size().max_element();
    let mut made = Vec::new();
    while made.len() < 5 {
        let corner_of_surface = |random: &mut Random| {
            let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
            match occluders.triangle_positions(surface) {
                Some(corners) => corners[random.below(3)],
                None => occluders.surface_bounds(surface).center(),
            }
        };
        let about = match random.pick(own) {
            LightShape::Point(point) if random.below(2) == 0 => point,
            _ if random.below(2) == 0 => corner_of_surface(random),
            _ => bounds.center() + extent * random.in_cube(),
        };
        let size = extent * random.pick(&[1e-9, 0.01, 0.1, 0.5, 3.0]);
        let (u, w) = (size * random.in_cube(), size * random.in_cube());
        let is_two_sided = random.below(2) == 0;
        let on_surface = [(); 3].map(|()| corner_of_surface(random));
        let [a, b, c] = on_surface;
        let shape = match random.below(10) {
            0 => SegmentLight::new([about, about + u]).map(AreaShape::Segment),
            1 => SegmentLight::new([a, b]).map(AreaShape::Segment),
            2 => RectangleLight::new(about, [u, w], is_two_sided).map(AreaShape::Rectangle),
            // In planes of surfaces, through corners.
            3 => TriangleLight::new(on_surface, is_two_sided).map(AreaShape::Triangle),
            4 => RectangleLight::new(0.5 * (b + c), [b - a, c - a], true).map(AreaShape::Rectangle),
            5 => PolygonLight::new(vec![about, about + u, about + u + w, about + w], true)
                .map(|light| AreaShape::Polygon(Arc::new(light))),
            6 => DiskLight::new(about, u, size, is_two_sided).map(AreaShape::Disk),
            7 => SphereLight::new(about, size).map(AreaShape::Sphere),
            8 => MeshLight::new(
                vec![on_surface, [about, about + u, about + w]],
                is_two_sided,
            )
            .map(|light| AreaShape::Mesh(Arc::new(light))),
            _ => {
                let direction = match random.pick(own) {
                    LightShape::Direction(direction) => direction,
                    LightShape::Point(_) => random.in_cube(),
                };
                let degrees = random.pick(&[1e-3, 0.5, 6.0, 40.0, 85.0, 120.0]);
                SunDisc::new(direction, degrees).map(AreaShape::SunDisc)
            }
        };
        // Some have no size.
        made.extend(shape.ok());
    }
    made
}

/// Starts that share cells and triangles with some others: on corners, on edges, on planes between cells and a hair beside.
fn attackers(
    index: &ShadowIndex,
    starts: &[ReceiverPoint],
    random: &mut Random,
) -> Vec<ReceiverPoint> {
    let occluders = index.occluders();
    let mut found = starts.to_vec();
    let planes = index.whole_light_planes();
    for start in starts {
        let corners = start
            .surface
            .and_then(|surface| occluders.triangle_positions(surface));
        let Some([a, b, c]) = corners else { continue };
        for _ in 0..8 {
            let mut point = common::nasty::point_near([a, b, c], start.point, random);
            if let (Some((min, edge)), true) = (planes, random.below(2) == 0) {
                let axis = random.below(3);
                let plane = ((point[axis] - min[axis]) / edge).round();
                let on_plane = min[axis] + plane * edge;
                point[axis] = random.pick(&[on_plane, on_plane.next_up(), on_plane.next_down()]);
            }
            if point.is_finite() && point.abs().max_element() < 1e30 {
                let surface = random.pick(&[start.surface, start.surface, start.surface, None]);
                found.push(ReceiverPoint { point, surface });
            }
        }
    }
    found
}

/// Samples of a light, those at its corners among them.
fn samples(
    light: &AreaShape,
    start: &ReceiverPoint,
    count: usize,
    random: &mut Random,
) -> Vec<LightShape> {
    let most = 1.0 - f64::EPSILON / 2.0;
    let scramble = SamplePattern { seed: 4 }.scramble(random.below(1000) as u64, 0);
    let nowhere = LightShape::Direction(DVec3::ZERO);
    (0..count as u32)
        .map(|number| {
            let place = match number {
                0 => [0.0, 0.0],
                1 => [most, 0.0],
                2 => [0.0, most],
                3 => [most, most],
                _ => SamplePattern::place(scramble, number),
            };
            let sample = light.sample(start.point, place);
            sample.map_or(nowhere, |sample| sample.target)
        })
        .collect()
}

/// Returns whether the reference says that a target is blocked.
fn is_blocked(occluders: &Occluders, start: &ReceiverPoint, target: &LightShape) -> bool {
    if *target == LightShape::Direction(DVec3::ZERO) {
        return false;
    }
    let segment = occluders.segment(start, target);
    occluders.own_rule_blocks(&segment)
        || occluders
            .surfaces()
            .any(|surface| occluders.blocks(surface, &segment))
}

#[test]
fn samples_of_nasty_scenes_are_the_references() {
    let (mut by_value, mut by_list, mut by_walk, mut shadowed) = (0, 0, 0, 0);
    for seed in seeds() {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let (own, starts) = common::nasty::questions(&scene);
        let index = index_of(
            &occluders,
            random.pick(&[4, 16, 256, 2048]),
            Refine::Queried,
        );
        let starts = attackers(&index, &starts, random);
        for light in lights(&occluders, &own, random) {
            let per_start = random.pick(&[5, 16, 64, 70]);
            let all: Vec<LightShape> = starts
                .iter()
                .flat_map(|start| samples(&light, start, per_start, random))
                .collect();
            let stride = per_start.div_ceil(64);
            // What was there before is overwritten.
            let mut words = vec![u64::MAX; stride * starts.len()];
            let mut counters = Counters::default();
            let targets = Targets::Each {
                targets: &all,
                per_start,
            };
            index
                .occluded_samples_of(&starts, &light, targets, &mut words, &mut counters)
                .expect("fine samples");
            for (number, start) in starts.iter().enumerate() {
                for sample in 0..stride * 64 {
                    let target = all[number * per_start..][..per_start].get(sample);
                    let truth = target.is_some_and(|target| is_blocked(&occluders, start, target));
                    let bit = words[number * stride + sample / 64] >> (sample % 64) & 1 != 0;
                    assert_eq!(
                        bit,
                        truth,
                        "{}: {light:?}, sample {sample} {target:?} from {start:?}",
                        scene.label()
                    );
                }
            }
            by_value += counters.shadow.first_pass;
            by_list += counters.shadow.blocker_list;
            by_walk += counters.shadow.rays;
            shadowed += counters.shadow.shadowed;
        }
        assert!(index.whole_light_bytes() <= index.knowledge_bytes());
    }
    let all = by_value + by_list + by_walk;
    // The test has power: 4.5 % and more are by value, as the seeds fall.
    assert!(
        25 * by_value > all && 20 * by_list > all && 10 * shadowed > all && 10 * shadowed < 9 * all,
        "{by_value} by value, {by_list} by list, {by_walk} by walk, {shadowed} shadowed"
    );
}

/// Fractions of a batch, those of single calls, and those of an index that knows nothing are one.
/// The corners of a wide lamp lie off the scene's sides, low; what is between them goes on to the scene's top.
#[test]
fn what_is_between_far_corners_may_be_blocked_higher_than_they_leave_the_scene() {
    let mut builder = Occluders::builder();
    let square = |half: f64, z: f64| {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| DVec3::new(x, y, z))
    };
    for (half, z) in [(0.99, -0.99), (0.3, 0.6)] {
        let opaque = antumbra_geometry::Opacity::Opaque;
        builder
            .add_face(&square(half, z), opaque)
            .expect("a square");
    }
    let occluders = Arc::new(builder.build());
    let ends = [-8.1, 8.5].map(|x| DVec3::new(x, -0.2, 3.4));
    let lamp = AreaShape::Segment(SegmentLight::new(ends).expect("a lamp"));
    let index = index_of(&occluders, 1024, Refine::Lazy);
    let start = ReceiverPoint {
        point: DVec3::new(0.2, -0.2, -0.99),
        surface: Some(SurfaceId(0)),
    };
    let samples: Vec<LightShape> = (0..64)
        .map(|number| LightShape::Point(ends[0].lerp(ends[1], (f64::from(number) + 0.5) / 64.0)))
        .collect();
    let mut words = [0];
    let counters = &mut Counters::default();
    index
        .occluded_samples_of(
            &[start],
            &lamp,
            Targets::Shared(&samples),
            &mut words,
            counters,
        )
        .expect("fine samples");
    let truth = (0..64).fold(0, |bits, number| {
        bits | u64::from(is_blocked(&occluders, &start, &samples[number])) << number
    });
    assert_eq!(words, [truth]);
    assert!(truth != 0 && truth != u64::MAX);
}

#[test]
fn fractions_do_not_depend_on_what_is_known_or_on_threads() {
    for seed in 0..36 {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let (own, starts) = common::nasty::questions(&scene);
        let [asked, lazy] =
            [Refine::Queried, Refine::Lazy].map(|refine| index_of(&occluders, 64, refine));
        let nothing = ShadowIndex::builder(occluders.clone(), Vec::new())
            .method(Method::Bvh)
            .build()
            .expect("settings are in range");
        let mut starts = attackers(&asked, &starts, random);
        starts.retain(|start| start.surface.is_some());
        let points: Vec<[f64; 3]> = starts.iter().map(|start| start.point.to_array()).collect();
        let faces: Vec<u32> = starts.iter().filter_map(|s| Some(s.surface?.0)).collect();
        let normals: Vec<[f64; 3]> = points.iter().map(|_| random.in_cube().to_array()).collect();
        let kinds = [
            BatchKind::OnSurfaces {
                surfaces: &faces,
                tolerance: Some(f64::INFINITY),
            },
            BatchKind::Facing { normals: &normals },
        ];
        for (number, light) in lights(&occluders, &own, random).iter().enumerate() {
            let sampling = LightSampling {
                light: number as u64,
                ..LightSampling::new(random.pick(&[1, 16, 65]))
            };
            let side = random.pick(&[ReceiverSide::Front, ReceiverSide::Back, ReceiverSide::Both]);
            for kind in kinds {
                let batch = Batch {
                    points: &points,
                    kind,
                };
                let fractions = |index: &ShadowIndex, threads| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                    let pool = pool.build().expect("threads");
                    let mut fractions = vec![9.0; points.len()];
                    let counted = pool.install(|| {
                        index.visible_fractions(&batch, side, light, &sampling, &mut fractions)
                    });
                    (fractions, counted.expect("fine points").facing_away)
                };
                let expected = fractions(&nothing, 1);
                for index in [&asked, &lazy] {
                    for threads in [1, 3] {
                        let found = fractions(index, threads);
                        assert_eq!(found, expected, "{} {light:?} {side:?}", scene.label());
                    }
                }
            }
            let mut samples = [LightSamples::default(), LightSamples::default()];
            for (row, start) in starts.iter().enumerate() {
                for (index, samples) in [&asked, &nothing].into_iter().zip(&mut samples) {
                    let mut counters = Counters::default();
                    index
                        .sample_light(
                            start,
                            side,
                            light,
                            row as u64,
                            &sampling,
                            samples,
                            &mut counters,
                        )
                        .expect("a fine start");
                }
                let [found, expected] = &samples;
                assert_eq!(found.queried(), expected.queried());
                assert!(
                    found.lit().eq(expected.lit()),
                    "{} {light:?} {start:?}",
                    scene.label()
                );
            }
        }
    }
}

/// A floor under plates: asked again and again, values are made by themselves, and no more than there is room for.
#[test]
fn values_are_made_where_they_pay_and_never_beyond_the_room() {
    let mut builder = Occluders::builder();
    let square = |half: f64, x: f64, y: f64, z: f64| {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(u, w)| DVec3::new(x + u, y + w, z))
    };
    common::add_face(&mut builder, &square(8.0, 0.0, 0.0, 0.0));
    for i in 0..5 {
        for j in 0..5 {
            let (x, y) = (3.0 * f64::from(i) - 6.0, 3.0 * f64::from(j) - 6.0);
            common::add_face(&mut builder, &square(0.8, x, y, 2.0 + 0.01 * x));
        }
    }
    let occluders = Arc::new(builder.build());
    let lamp = RectangleLight::new(DVec3::new(1.0, 2.0, 9.0), [DVec3::X, DVec3::Y], true);
    let lamp = AreaShape::Rectangle(lamp.expect("a light"));
    let random = &mut Random(8);
    let points: Vec<[f64; 3]> = (0..4_000)
        .map(|_| [random.real(-7.9, 7.9), random.real(-7.9, 7.9), 0.0])
        .collect();
    // The floor is two triangles.
    let faces: Vec<u32> = points.iter().map(|[x, y, _]| u32::from(y > x)).collect();
    let kind = BatchKind::OnSurfaces {
        surfaces: &faces,
        tolerance: Some(1e-3),
    };
    let batch = Batch {
        points: &points,
        kind,
    };
    for (memory, least, most) in [(512 << 20, 1, u64::MAX), (60_000, 0, 60_000), (0, 0, 0)] {
        let refinement = Refinement {
            resolution: 64,
            memory,
            ..Refinement::default()
        };
        let index = ShadowIndex::builder(occluders.clone(), Vec::new())
            .method(Method::Auto)
            .refinement(refinement)
            .build()
            .expect("settings are in range");
        let sampling = LightSampling::new(64);
        let mut fractions = vec![0.0; points.len()];
        let mut first: Option<Vec<f32>> = None;
        let (mut by_value, mut all) = (0, 0);
        for _ in 0..30 {
            let side = ReceiverSide::Both;
            let counted = index
                .visible_fractions(&batch, side, &lamp, &sampling, &mut fractions)
                .expect("fine points");
            let shadow = counted.counters.shadow;
            (by_value, all) = (
                shadow.first_pass,
                shadow.first_pass + shadow.blocker_list + shadow.rays,
            );
            assert_eq!(*first.get_or_insert_with(|| fractions.clone()), fractions);
            assert!(index.knowledge_bytes() <= memory);
        }
        assert_eq!(all, 64 * points.len() as u64);
        let bytes = index.whole_light_bytes();
        assert!((least..=most).contains(&bytes), "{bytes} of {memory}");
        if least > 0 {
            assert!(3 * by_value > all, "{by_value} of {all}");
        }
    }
}
