//! Points near surfaces: which surface they are put on, and how far off is too far.

use std::sync::Arc;

use antumbra::{Batch, BatchError, BatchKind, Method, Nearness, OffSurface, Towards};
use antumbra_geometry::{DVec3, Occluders, Precision, SurfaceId};

use crate::common::{METHODS, Random};
use crate::{MUNICH, UP, ask, index_of, narrow, on_nearest, plus, scene};

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
