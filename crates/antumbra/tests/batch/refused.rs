//! What a batch refuses, with the first bad point by its number.

use antumbra::{Batch, BatchError, BatchKind, LightId, Method, Nearness};
use antumbra_geometry::DVec3;

use crate::nearest::{SINGLE, within};
use crate::{hall, index_of, on_surfaces, on_threads};

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
                index.occluded(batch, &[LightId(0), LightId(1)], &mut out)
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
                    .occluded(&batch, &[LightId(0)], &mut out)
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
            .occluded(&batch, &[LightId(0)], &mut out)
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
        index.occluded(&free, &[LightId(0), LightId(1)], &mut out[..17]),
        Err(length("bytes of output", 18, 17))
    );
    assert_eq!(
        index.occluded_bits(&free, &[LightId(0), LightId(1)], &mut out),
        Err(length("bytes of output", 4, 18))
    );
    assert_eq!(
        index.occluded(&free, &[LightId(0), LightId(3)], &mut out),
        Err(BatchError::UnknownLight(LightId(3)))
    );
    let mut ask = |kind| {
        let batch = Batch {
            points: &points,
            kind,
        };
        index
            .occluded(&batch, &[LightId(0), LightId(1)], &mut out)
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
