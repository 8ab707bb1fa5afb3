//! A renderer's own rays in place of ours, alone and in batches.

use std::sync::atomic::{AtomicU64, Ordering};

use antumbra::{
    AnyHit, Batch, BatchKind, Counters, Decided, GridResolution, LightId, Method, RayBatch,
    RayMethod, Refine, Refinement, ShadowIndex, Towards,
};
use antumbra_geometry::{DVec3, LightShape, Occluders, Ray, ReceiverPoint, SurfaceId};

use crate::common::{METHODS, Random, builder_of, lamps};
use crate::{answers, hall, index_of, on_surfaces};

/// The reference as somebody else's rays, counting what it is asked.
struct Counting<'a> {
    occluders: &'a Occluders,
    asked: AtomicU64,
    /// What it says instead, if anything.
    lie: Option<bool>,
}

impl AnyHit for Counting<'_> {
    fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
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
                let counters = bare.with_rays(&rays).occluded(
                    &batch,
                    &lights.map(LightId::from_index),
                    &mut out,
                );
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
            let start = ReceiverPoint {
                point: DVec3::from_array(point),
                surface: Some(SurfaceId(surface)),
            };
            let before = rays.asked.load(Ordering::Relaxed);
            let answer =
                index
                    .with_rays(&rays)
                    .shadow(&start, LightId(1), &mut Counters::default());
            let answer = answer.expect("a fine query");
            let expected = index
                .shadow_by_reference(&start, LightId(1))
                .expect("a fine query");
            let plain = index
                .shadow(&start, LightId(1), &mut Counters::default())
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
    let bad = ReceiverPoint {
        point: DVec3::NAN,
        surface: None,
    };
    let index = index_of(&occluders, Method::Voxel);
    let answer = index
        .with_rays(&rays)
        .shadow(&bad, LightId(0), &mut Counters::default());
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
