//! The values of [`Method::Voxel`], and queries by the slice, through the front door.

mod common;

use std::sync::Arc;

use antumbra::{
    Counters, LightId, Method, QueryError, Refine, Refinement, Shadow, ShadowCounters, ShadowIndex,
};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId};

use common::{
    METHODS, Random, add_cone_and_disk, add_face, add_pane, builder_of, is_shadowed, lamps,
};

/// A hall with a floor, boxes on it, a pane of glass, loose triangles, balls, a closed cone and a disk.
fn hall() -> Arc<Occluders> {
    let random = &mut Random(7);
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    add_face(&mut builder, &floor.map(|(x, y)| v(x, y, 0.0)));
    for _ in 0..6 {
        let low = v(random.real(-3.0, 2.0), random.real(-3.0, 2.0), 0.0);
        let size = v(
            random.real(0.2, 0.9),
            random.real(0.2, 0.9),
            random.real(0.2, 2.0),
        );
        let corner =
            |at: usize| low + size * v((at & 1) as f64, (at >> 1 & 1) as f64, (at >> 2) as f64);
        for outline in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [4, 5, 7, 6],
        ] {
            add_face(&mut builder, &outline.map(corner));
        }
    }
    add_pane(&mut builder);
    for _ in 0..20 {
        let middle = v(0.0, 0.0, 2.0) + v(3.5, 3.5, 1.8) * random.in_cube();
        let size = random.pick(&[0.02, 0.2, 0.6]);
        let corners = [(); 3].map(|()| middle + size * random.in_cube());
        add_face(&mut builder, &corners);
    }
    for radius in [0.4, 0.7, 0.05, 0.3] {
        let center = v(0.0, 0.0, 1.5) + v(3.0, 3.0, 1.0) * random.in_cube();
        let sphere = Sphere { center, radius };
        let opacity = random.pick(&[Opacity::Opaque, Opacity::Opaque, Opacity::Transparent]);
        builder.add_sphere(sphere, opacity).expect("a sphere");
    }
    add_cone_and_disk(&mut builder, 0.0);
    Arc::new(builder.build())
}

fn index_of(occluders: &Arc<Occluders>, lights: &[LightShape], method: Method) -> ShadowIndex {
    builder_of(occluders, lights, method)
        .build()
        .expect("an index")
}

/// Starts of all kinds in a random order: free ones in and around the scene, on surfaces of all kinds,
/// off them, beside them.
fn starts(occluders: &Occluders, count: usize, random: &mut Random) -> Vec<ReceiverPoint> {
    let bounds = occluders.bounds();
    let in_scene = |random: &mut Random| bounds.center() + 0.5 * bounds.size() * random.in_cube();
    let one = |_| {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        let around = occluders.surface_bounds(surface);
        let point = match occluders.triangle_positions(surface) {
            Some([a, b, c]) => {
                let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                let (s, t) = if s + t > 1.0 {
                    (1.0 - s, 1.0 - t)
                } else {
                    (s, t)
                };
                a + s * (b - a) + t * (c - a)
            }
            None => match occluders.sphere(surface) {
                Some(Sphere { center, radius }) => center + radius * random.in_cube().normalize(),
                None => around.center() + 0.5 * around.size() * random.in_cube(),
            },
        };
        let on = |point| ReceiverPoint {
            point,
            surface: Some(surface),
        };
        let free = |point| ReceiverPoint {
            point,
            surface: None,
        };
        match random.below(10) {
            0 => free(in_scene(random)),
            1 => free(bounds.center() + 40.0 * random.in_cube()),
            // On a surface and free all the same.
            2 => free(point),
            // A bad offset: the rule moves it onto the surface.
            3 => on(point + 0.01 * random.in_cube()),
            // Far from it.
            4 => on(in_scene(random)),
            _ => on(point),
        }
    };
    (0..count).map(one).collect()
}

/// Blocks of starts are looked up together: what one start is must not touch what its neighbours get,
/// nor may the end of a slice.
#[test]
fn slices_are_answered_as_one_by_one() {
    let occluders = hall();
    let starts = starts(&occluders, 300, &mut Random(1));
    let reference = index_of(&occluders, &lamps(), Method::Naive);
    for method in METHODS {
        let index = index_of(&occluders, &lamps(), method);
        for light in 0..index.lights().len() {
            let mut one_by_one = Counters::default();
            let expected: Vec<bool> = starts
                .iter()
                .map(|start| {
                    let answer = index.shadow(start, LightId::from_index(light), &mut one_by_one);
                    answer.expect("a fine query").shadow == Shadow::Shadowed
                })
                .collect();
            for (start, expected) in starts.iter().zip(&expected) {
                assert_eq!(
                    is_shadowed(&reference, start, light),
                    *expected,
                    "{start:?}"
                );
            }
            for length in [0, 1, 2, 7, 8, 31, 32, 33, 63, 64, 65, 300] {
                let mut found = vec![true; length];
                let mut counters = Counters::default();
                index
                    .shadows(
                        &starts[..length],
                        LightId::from_index(light),
                        &mut found,
                        &mut counters,
                    )
                    .expect("fine queries");
                assert_eq!(found, expected[..length], "{method:?}, {length} starts");
                let counted = found.iter().filter(|&&is_shadowed| is_shadowed).count();
                assert_eq!(counters.shadow.shadowed, counted as u64);
                if length == starts.len() {
                    // Rays of a slice walk together and share steps and tests.
                    assert_eq!(counters.shadow, one_by_one.shadow, "{method:?}");
                }
            }
        }
    }
}

/// Values that are made before look 64 starts of a kind up at once; by whom a start was decided does not depend
/// on its company.
#[test]
fn slices_of_one_kind_are_answered_as_one_by_one() {
    let occluders = hall();
    let all = starts(&occluders, 3000, &mut Random(7));
    let index = index_of(&occluders, &lamps(), Method::Voxel);
    for is_free in [true, false] {
        let of_kind = all
            .iter()
            .filter(|start| start.surface.is_none() == is_free);
        let starts: Vec<ReceiverPoint> = of_kind.copied().collect();
        assert!(starts.len() > 500, "{}", starts.len());
        for light in 0..index.lights().len() {
            let mut one_by_one = Counters::default();
            let expected: Vec<bool> = starts
                .iter()
                .map(|start| {
                    let answer = index.shadow(start, LightId::from_index(light), &mut one_by_one);
                    answer.expect("a fine query").shadow == Shadow::Shadowed
                })
                .collect();
            for length in [1, 16, 17, 63, 64, 65, 333, starts.len()] {
                let mut found = vec![true; length];
                let mut counters = Counters::default();
                index
                    .shadows(
                        &starts[..length],
                        LightId::from_index(light),
                        &mut found,
                        &mut counters,
                    )
                    .expect("fine queries");
                assert_eq!(found, expected[..length], "{length} starts");
                if length == starts.len() {
                    assert_eq!(counters, one_by_one);
                }
            }
        }
    }
}

#[test]
fn slices_do_not_care_for_the_order_of_starts() {
    let occluders = hall();
    let random = &mut Random(2);
    let starts = starts(&occluders, 333, random);
    let index = index_of(&occluders, &lamps(), Method::Voxel);
    let ask = |starts: &[ReceiverPoint]| {
        let mut found = vec![false; starts.len()];
        let mut counters = Counters::default();
        index
            .shadows(starts, LightId(0), &mut found, &mut counters)
            .expect("fine queries");
        (found, counters)
    };
    let (expected, expected_counters) = ask(&starts);
    let mut order: Vec<usize> = (0..starts.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let mixed: Vec<ReceiverPoint> = order.iter().map(|&i| starts[i]).collect();
    let (found, counters) = ask(&mixed);
    assert!(
        order
            .iter()
            .zip(found)
            .all(|(&i, found)| expected[i] == found)
    );
    assert_eq!(counters, expected_counters);
}

/// Large batches whose neighbours lie apart are put in order; nobody must see it.
#[test]
fn scattered_batches_are_answered_in_the_callers_order() {
    let occluders = hall();
    let lights = lamps();
    let mut starts = starts(&occluders, 70_000, &mut Random(9));
    let reference = index_of(&occluders, &lights, Method::Bvh);
    for refine in [Refine::Eager, Refine::Queried, Refine::Lazy] {
        let refinement = Refinement {
            resolution: 64,
            space_resolution: 32,
            refine,
            ..Refinement::default()
        };
        let index = ShadowIndex::builder(Arc::clone(&occluders), lights.clone())
            .method(Method::Voxel)
            .refinement(refinement)
            .build()
            .expect("an index");
        let mut expected = vec![false; starts.len()];
        let mut found = expected.clone();
        let counters = &mut Counters::default();
        reference
            .shadows(&starts, LightId(0), &mut expected, counters)
            .expect("fine queries");
        for _ in 0..3 {
            found.fill(false);
            index
                .shadows(&starts, LightId(0), &mut found, counters)
                .expect("fine queries");
            assert!(found == expected, "{refine:?}");
        }
        // The first of the bad ones is named.
        let good = [starts[40_000], starts[60_000]];
        let bad = [DVec3::NAN, DVec3::splat(f64::INFINITY)];
        starts[40_000].point = bad[1];
        starts[60_000].point = bad[0];
        let error = index.shadows(&starts, LightId(0), &mut found, counters);
        assert_eq!(error, Err(QueryError::BadPoint(bad[1])));
        [starts[40_000], starts[60_000]] = good;
    }
}

/// Nothing that is no start gets an answer, wherever it stands in a slice; the error says which it is.
#[test]
fn errors_name_the_start_that_is_none() {
    let occluders = hall();
    let random = &mut Random(3);
    let good = starts(&occluders, 70, random);
    let count = occluders.surface_count() as u32;
    let (last, far) = (Some(SurfaceId(count - 1)), 2f64.powi(101));
    let bad_points = [
        DVec3::NAN,
        DVec3::new(0.1, f64::NAN, 0.2),
        DVec3::new(f64::INFINITY, 0.0, 0.0),
        DVec3::new(0.0, 0.0, f64::NEG_INFINITY),
        DVec3::new(0.0, -far, 0.0),
    ];
    for method in METHODS {
        let index = index_of(&occluders, &lamps(), method);
        let refused = |start: ReceiverPoint, place: usize| {
            let mut starts = good.clone();
            starts[place] = start;
            let (mut found, mut counters) = (vec![false; starts.len()], Counters::default());
            let error = index
                .shadow(&start, LightId(0), &mut counters)
                .expect_err("no start");
            let same = index.shadows(&starts, LightId(0), &mut found, &mut counters);
            assert_eq!(
                format!("{:?}", same.expect_err("no start")),
                format!("{error:?}")
            );
            error
        };
        for place in [0, 1, 31, 32, 69] {
            for point in bad_points {
                for surface in [None, Some(SurfaceId(0)), last] {
                    let error = refused(ReceiverPoint { point, surface }, place);
                    let QueryError::BadPoint(named) = error else {
                        panic!("{method:?}: {error:?}");
                    };
                    assert_eq!(format!("{named:?}"), format!("{point:?}"));
                }
            }
            for surface in [count, count + 1, u32::MAX] {
                let start = ReceiverPoint {
                    point: DVec3::new(0.1, 0.2, 0.3),
                    surface: Some(SurfaceId(surface)),
                };
                assert_eq!(refused(start, place), QueryError::UnknownSurface(surface));
            }
        }
        // The first one is named.
        let mut starts = good.clone();
        starts[40].surface = Some(SurfaceId(count + 40));
        starts[41].surface = Some(SurfaceId(count + 41));
        let (mut found, mut counters) = (vec![false; starts.len()], Counters::default());
        let error = index.shadows(&starts, LightId(0), &mut found, &mut counters);
        assert_eq!(error, Err(QueryError::UnknownSurface(count + 40)));
        // No light, not even for no starts.
        for starts in [&good[..], &[]] {
            let (mut found, mut counters) = (vec![false; starts.len()], Counters::default());
            let error = index.shadows(starts, LightId(3), &mut found, &mut counters);
            assert_eq!(error, Err(QueryError::UnknownLight(LightId(3))));
        }
    }
}

/// Values, lists and their numbers are a function of scene and lights; tasks end in any order.
#[test]
fn threads_change_neither_values_nor_how_queries_are_decided() {
    let occluders = hall();
    let starts = starts(&occluders, 1_000, &mut Random(4));
    let work = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let index = pool.install(|| index_of(&occluders, &lamps(), Method::Voxel));
        let mut found = vec![false; starts.len()];
        let asked: Vec<(Vec<bool>, ShadowCounters)> = (0..lamps().len())
            .map(|light| {
                let mut counters = Counters::default();
                index
                    .shadows(
                        &starts,
                        LightId::from_index(light),
                        &mut found,
                        &mut counters,
                    )
                    .expect("fine queries");
                (found.clone(), counters.shadow)
            })
            .collect();
        (index.occlusion_bytes(), index.table_bytes(), asked)
    };
    let expected = work(1);
    for threads in [2, 7] {
        assert_eq!(work(threads), expected, "{threads} threads");
    }
    // By values, by lists and by rays, or it says little.
    for (_, counters) in &expected.2 {
        let ShadowCounters {
            first_pass,
            blocker_list,
            rays,
            ..
        } = *counters;
        assert!(
            first_pass > 200 && blocker_list > 25 && rays > 5,
            "{counters:?}"
        );
    }
}

/// Lights do not know of each other, surfaces not of their numbers.
#[test]
fn values_do_not_depend_on_the_order_of_lights() {
    let occluders = hall();
    let starts = starts(&occluders, 500, &mut Random(5));
    let lamps = lamps();
    let together = index_of(&occluders, &lamps, Method::Voxel);
    let (mut value_bytes, mut found) = (0, vec![false; starts.len()]);
    for (light, &lamp) in lamps.iter().enumerate() {
        let alone = index_of(&occluders, &[lamp], Method::Voxel);
        value_bytes += alone.occlusion_bytes();
        let mut ask = |index: &ShadowIndex, light: usize| {
            let mut counters = Counters::default();
            index
                .shadows(
                    &starts,
                    LightId::from_index(light),
                    &mut found,
                    &mut counters,
                )
                .expect("fine queries");
            (found.clone(), counters)
        };
        assert_eq!(ask(&alone, 0), ask(&together, light));
    }
    assert_eq!(value_bytes, together.occlusion_bytes());
}

/// Free starts outside answer as the point where they come in; from far away that point is not told.
#[test]
fn free_starts_outside_the_scene_are_answered_as_the_reference_does() {
    let occluders = hall();
    let random = &mut Random(6);
    let bounds = occluders.bounds();
    let size = bounds.size().max_element();
    let mut lights = lamps();
    lights.extend([
        LightShape::Point(DVec3::new(30.0, -20.0, 5.0)),
        // Along an axis, in the plane of a side of the box.
        LightShape::Direction(DVec3::X),
        LightShape::Point(DVec3::new(bounds.max.x, 9.0, bounds.max.z)),
    ]);
    let index = index_of(&occluders, &lights, Method::Voxel);
    let mut decided = ShadowCounters::default();
    for (light, lamp) in lights.iter().enumerate() {
        for _ in 0..1_500 {
            let mut through = bounds.center() + 0.55 * bounds.size() * random.in_cube();
            if random.below(4) == 0 {
                // Along a side, at an edge or in a corner of the box.
                for axis in 0..=random.below(3) {
                    through[axis] = random.pick(&[bounds.min, bounds.max])[axis];
                }
            }
            let far = random.pick(&[1e-9, 1e-6, 0.1, 1.0, 10.0, 1e6, 1e12]) * size;
            let away = lamp.towards(through).normalize();
            let point = match random.below(3) {
                0 => through - far * away,
                1 => through + far * random.in_cube(),
                // Next to the box.
                _ => {
                    let axis = random.below(3);
                    let off = far.min(size) * random.real(0.0, 1.0);
                    let mut point = through;
                    point[axis] = random.pick(&[bounds.min[axis] - off, bounds.max[axis] + off]);
                    point
                }
            };
            let start = ReceiverPoint {
                point,
                surface: None,
            };
            let mut counters = Counters::default();
            let answer = index
                .shadow(&start, LightId::from_index(light), &mut counters)
                .expect("a fine query");
            let expected = index
                .shadow_by_reference(&start, LightId::from_index(light))
                .expect("a fine query");
            assert_eq!(answer.shadow, expected, "{answer:?} {start:?} {lamp:?}");
            if !bounds.contains(point) {
                decided.add(&counters.shadow);
            }
        }
    }
    let ShadowCounters {
        first_pass,
        blocker_list,
        rays,
        shadowed,
        ..
    } = decided;
    assert!(
        first_pass > 3_000 && blocker_list > 100 && shadowed > 500,
        "{decided:?}"
    );
    // Mostly without a ray.
    assert!(rays * 2 < first_pass, "{decided:?}");
}

/// A direction has no length: squares of short ones lose bits, and then vanish. The first start was once
/// lit for `2^-537`: the ball's list said that the light's ray passes beside it.
#[test]
fn short_directions_are_those_of_any_length() {
    let ball = |x, radius| Sphere {
        center: DVec3::new(x, 0.0, 0.0),
        radius,
    };
    let mut builder = Occluders::builder();
    for (x, radius) in [(-2.0, 0.5), (0.0, 1.0), (2.0, 0.7)] {
        builder
            .add_sphere(ball(x, radius), Opacity::Opaque)
            .expect("a sphere");
    }
    let corners = [(-3.0, -3.0), (3.0, -3.0), (0.0, 3.0)].map(|(x, y)| DVec3::new(x, y, -1.0));
    builder.add_face(&corners, Opacity::Opaque).expect("a face");
    let occluders = Arc::new(builder.build());
    let mut starts = starts(&occluders, 1_500, &mut Random(8));
    let behind_the_last_ball = ReceiverPoint {
        point: DVec3::new(1.6799375195161808, -1.149680221965362, -0.8467473389055755),
        surface: None,
    };
    starts.insert(0, behind_the_last_ball);
    let powers = [0, 90, -30, -300, -530, -537, -538, -539, -540, -1060];
    // The smallest keeps all its bits.
    let direction = DVec3::new(0.25, 0.5, 1.0);
    let lights = powers.map(|power| LightShape::Direction(direction * 2f64.powi(power)));
    let index = index_of(&occluders, &lights, Method::Voxel);
    for start in &starts {
        let expected = index
            .shadow_by_reference(start, LightId(0))
            .expect("a fine query");
        let (mut first, mut counters) = (None, Counters::default());
        for (light, power) in powers.iter().enumerate() {
            let answer = index
                .shadow(start, LightId::from_index(light), &mut counters)
                .expect("a fine query");
            assert_eq!(answer.shadow, expected, "{start:?}, 2^{power}");
            // Nor are they left to rays.
            let first = *first.get_or_insert(answer.decided);
            assert_eq!(answer.decided, first, "{start:?}, 2^{power}");
        }
    }
}
