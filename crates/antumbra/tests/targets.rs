//! Many targets of one start: every bit is the reference's for that start and that target.
//!
//! The reference tests every surface for one segment ([`ShadowIndex::shadow_by_reference`]) and shares
//! nothing with the walk of many targets but the rule itself.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchError, BatchKind, Counters, LightId, Method, QueryError, Shadow, ShadowIndex,
    Targets,
};
use antumbra_geometry::{
    Coverage, DVec3, LightShape, Occluders, Opacity, ReceiverPoint, SurfaceId,
};
use antumbra_testkit::fixtures;
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::{Oracle, OracleLight};
use common::nasty::{nasty_targets, samples};
use common::{METHODS, Random};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn index_of(occluders: &Arc<Occluders>, method: Method) -> ShadowIndex {
    ShadowIndex::builder(occluders.clone(), Vec::new())
        .method(method)
        .build()
        .expect("settings are in range")
}

/// Returns what the reference says of each target.
fn expected(occluders: &Arc<Occluders>, start: &ReceiverPoint, targets: &[LightShape]) -> Vec<u64> {
    // No light is a zero direction; towards nowhere nothing is met.
    let is_nowhere = |target: &LightShape| *target == LightShape::Direction(DVec3::ZERO);
    let lights = targets.iter().map(|&target| match is_nowhere(&target) {
        true => LightShape::Point(start.point),
        false => target,
    });
    let index = ShadowIndex::builder(occluders.clone(), lights.collect())
        .method(Method::Naive)
        .build()
        .expect("settings are in range");
    let mut words = vec![0; targets.len().div_ceil(64)];
    for target in 0..targets.len() {
        let answer = index.shadow_by_reference(start, LightId::from_index(target));
        if answer.expect("a fine query") == Shadow::Shadowed && !is_nowhere(&targets[target]) {
            words[target / 64] |= 1 << (target % 64);
        }
    }
    words
}

fn found(index: &ShadowIndex, start: &ReceiverPoint, targets: &[LightShape]) -> Vec<u64> {
    // What was there before is overwritten.
    let mut words = vec![u64::MAX; targets.len().div_ceil(64)];
    index
        .occluded_targets(start, targets, &mut words, &mut Counters::default())
        .expect("a fine query");
    words
}

/// Asks for one start's targets and explains the first difference.
fn check(
    label: &str,
    index: &ShadowIndex,
    occluders: &Arc<Occluders>,
    start: &ReceiverPoint,
    targets: &[LightShape],
) -> [u32; 2] {
    let (truth, found) = (
        expected(occluders, start, targets),
        found(index, start, targets),
    );
    for (number, target) in targets.iter().enumerate() {
        let bit = |words: &[u64]| words[number / 64] >> (number % 64) & 1;
        assert_eq!(
            bit(&found),
            bit(&truth),
            "{label}: target {number} of {}, {target:?} from {start:?}",
            targets.len()
        );
    }
    // Bits beyond the last target, too.
    assert_eq!(found, truth, "{label}");
    let occluded = truth.iter().map(|word| word.count_ones()).sum();
    [occluded, targets.len() as u32]
}

/// How many nasty scenes the suite asks; `ANTUMBRA_NASTY_SEEDS=from..to` asks others.
fn seeds() -> std::ops::Range<u64> {
    let Ok(text) = std::env::var("ANTUMBRA_NASTY_SEEDS") else {
        return 0..180;
    };
    let (from, to) = text
        .split_once("..")
        .expect("ANTUMBRA_NASTY_SEEDS is from..to");
    from.parse().expect("a number")..to.parse().expect("a number")
}

#[test]
fn targets_of_nasty_scenes_are_the_references() {
    let (mut occluded, mut asked) = (0, 0);
    for seed in seeds() {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let index = index_of(&occluders, Method::Bvh);
        let lights: Vec<LightShape> = scene
            .lights
            .iter()
            .map(|&l| common::nasty::light(l))
            .collect();
        for query in &scene.queries[..16] {
            let start = common::nasty::start(query.point, query.surface);
            let count = random.pick(&[0, 1, 2, 63, 64, 65, 200]);
            let targets = nasty_targets(&occluders, &lights, &start, count, random);
            let counts = check(&scene.label(), &index, &occluders, &start, &targets);
            occluded += counts[0];
            asked += counts[1];
        }
    }
    assert!(
        occluded * 10 > asked && occluded * 10 < asked * 9,
        "{occluded} of {asked} are occluded"
    );
}

/// A few against the oracle itself, so that the reference is not the only witness.
#[test]
fn lights_of_fixtures_asked_as_targets_agree_with_the_oracle() {
    for fixture in fixtures::all() {
        let oracle = Oracle::new(fixture.surfaces.clone());
        let occluders = common::nasty::occluders(&fixture.surfaces);
        let index = index_of(&occluders, Method::Bvh);
        // The lights, each once more between lights that are not theirs.
        let mut lights = fixture.lights.clone();
        lights.extend(fixture.lights.iter().rev());
        lights.push(OracleLight::Point([1e3, -2e3, 5e3]));
        let targets: Vec<LightShape> = lights.iter().map(|&l| common::nasty::light(l)).collect();
        for query in &fixture.queries {
            let start = common::nasty::start(query.point, query.surface);
            let words = found(&index, &start, &targets);
            for (number, &light) in lights.iter().enumerate() {
                let truth = oracle.is_blocked(query.point, query.surface, light);
                let bit = words[number / 64] >> (number % 64) & 1;
                assert_eq!(
                    bit,
                    u64::from(truth),
                    "{}: {query:?} {light:?}",
                    fixture.name
                );
            }
        }
    }
}

/// Solid in half of all cells of a chessboard.
#[derive(Debug)]
struct Chessboard;

impl Coverage for Chessboard {
    fn is_solid_at(&self, [u, w]: [f64; 2]) -> bool {
        ((u * 7.0).floor() + (w * 7.0).floor()).rem_euclid(2.0) == 0.0
    }
}

/// A floor with walls of every kind on it, and a heap of triangles above.
fn hall(random: &mut Random) -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    for x in 0..8 {
        for y in 0..8 {
            let corner = v(f64::from(x) - 4.0, f64::from(y) - 4.0, 0.0);
            let corners = [
                v(0.0, 0.0, 0.0),
                v(1.0, 0.0, 0.0),
                v(1.0, 1.0, 0.0),
                v(0.0, 1.0, 0.0),
            ];
            common::add_face(&mut builder, &corners.map(|c| corner + c));
        }
    }
    common::add_pane(&mut builder);
    common::add_cone_and_disk(&mut builder, 0.0);
    let board = builder.add_coverage(Arc::new(Chessboard));
    let corners = [
        v(-3.0, -2.0, 0.5),
        v(3.0, -2.0, 0.5),
        v(3.0, -1.0, 3.0),
        v(-3.0, -1.0, 3.0),
    ];
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    builder
        .add_alpha_tested_face(&corners, &uvs, board)
        .expect("a face");
    for _ in 0..400 {
        let middle = 3.0 * random.in_cube() + v(0.0, 0.0, 4.0);
        let reach = random.pick(&[0.02, 0.1, 0.4]);
        let corners = [0; 3].map(|_| middle + reach * random.in_cube());
        let opacity = random.pick(&[Opacity::Opaque, Opacity::Opaque, Opacity::Transparent]);
        builder.add_face(&corners, opacity).expect("a face");
    }
    Arc::new(builder.build())
}

/// A start on the hall's floor, on one of its other surfaces, or in its air.
fn start_in(occluders: &Occluders, random: &mut Random) -> ReceiverPoint {
    let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
    let on_triangle = |surface| {
        let [a, b, c] = occluders.triangle_positions(surface)?;
        Some((a, b, c))
    };
    match (random.below(4), on_triangle(surface)) {
        (0, _) => ReceiverPoint {
            point: 4.0 * random.in_cube() + v(0.0, 0.0, 3.0),
            surface: None,
        },
        (1, Some((a, b, c))) => {
            let (s, t) = (random.unit(), random.unit());
            ReceiverPoint {
                point: a + (b - a) * (s * 0.5) + (c - a) * (t * 0.5),
                surface: Some(surface),
            }
        }
        _ => {
            let floor = SurfaceId(random.below(128) as u32);
            let (a, b, c) = on_triangle(floor).unwrap_or_default();
            let (s, t) = (random.unit(), random.unit());
            ReceiverPoint {
                point: a + (b - a) * (s * 0.5) + (c - a) * (t * 0.5),
                surface: Some(floor),
            }
        }
    }
}

#[test]
fn lamps_of_every_size_over_a_hall_are_the_references() {
    let random = &mut Random(3);
    let (mut occluded, mut asked) = (0, 0);
    for _ in 0..6 {
        let occluders = hall(random);
        let index = index_of(&occluders, Method::Bvh);
        for _ in 0..60 {
            let start = start_in(&occluders, random);
            let middle = v(1.0, -2.0, random.pick(&[1.5, 4.0, 9.0, 1e4]));
            let size = middle.z * random.pick(&[0.0, 1e-3, 0.02, 0.1, 1.0]);
            let count = random.pick(&[1, 15, 16, 17, 64, 100]);
            let targets = if random.below(3) == 0 {
                // The sun, and the sky.
                let spread = random.pick(&[0.005, 0.1, 1.0]);
                let sun = v(0.3, 0.2, 1.0);
                let targets =
                    (0..count).map(|_| LightShape::Direction(sun + spread * random.in_cube()));
                targets.collect()
            } else {
                samples(middle, size, count, random)
            };
            let counts = check("hall", &index, &occluders, &start, &targets);
            occluded += counts[0];
            asked += counts[1];
        }
    }
    assert!(
        occluded * 10 > asked && occluded * 10 < asked * 9,
        "{occluded} of {asked} are occluded"
    );
}

#[test]
fn all_methods_answer_targets_alike() {
    let random = &mut Random(5);
    let occluders = hall(random);
    let starts: Vec<ReceiverPoint> = (0..40).map(|_| start_in(&occluders, random)).collect();
    let targets = samples(v(0.5, 0.3, 8.0), 1.0, 70, random);
    for method in METHODS {
        let index = index_of(&occluders, method);
        for start in &starts {
            assert_eq!(
                found(&index, start, &targets),
                expected(&occluders, start, &targets),
                "{method:?} {start:?}"
            );
        }
    }
}

#[test]
fn starts_far_from_most_surfaces_have_targets_like_others() {
    // Enough surfaces that those far out are held apart.
    let random = &mut Random(9);
    let mut builder = Occluders::builder();
    for number in 0..300 {
        let far = if number < 12 { 1e9 } else { 0.0 };
        let middle = v(far, 0.0, 0.0) + 3.0 * random.in_cube();
        let corners = [0; 3].map(|_| middle + 0.7 * random.in_cube());
        common::add_face(&mut builder, &corners);
    }
    let occluders = Arc::new(builder.build());
    let index = index_of(&occluders, Method::Bvh);
    for number in 0..60 {
        let surface = SurfaceId(random.below(300) as u32);
        let [a, b, c] = occluders.triangle_positions(surface).unwrap_or_default();
        let start = ReceiverPoint {
            point: (a + b + c) / 3.0,
            surface: (number % 3 > 0).then_some(surface),
        };
        let mut targets = samples(v(1e9, 0.0, 0.0), 3.0, 40, random);
        targets.extend(samples(DVec3::ZERO, 3.0, 30, random));
        targets.extend((0..9).map(|_| LightShape::Direction(random.in_cube())));
        check("far", &index, &occluders, &start, &targets);
    }
}

#[test]
fn scenes_of_nothing_occlude_nothing() {
    let occluders = Arc::new(Occluders::builder().build());
    let start = ReceiverPoint {
        point: DVec3::ZERO,
        surface: None,
    };
    let targets = samples(v(0.0, 0.0, 3.0), 1.0, 65, &mut Random(1));
    for method in METHODS {
        let index = index_of(&occluders, method);
        assert_eq!(found(&index, &start, &targets), [0, 0], "{method:?}");
        assert_eq!(found(&index, &start, &[]), [0; 0], "{method:?}");
    }
}

#[test]
fn what_has_no_answer_is_refused_by_its_number() {
    let random = &mut Random(2);
    let occluders = hall(random);
    let index = index_of(&occluders, Method::Bvh);
    let start = start_in(&occluders, random);
    let good = samples(v(0.0, 0.0, 8.0), 1.0, 70, random);
    let bad = [
        DVec3::NAN,
        v(0.0, f64::INFINITY, 0.0),
        v(0.0, 0.0, 1e300),
        v(1.27e30, 0.0, 0.0),
    ];
    for bad in bad {
        for light in [LightShape::Point(bad), LightShape::Direction(bad)] {
            let mut targets = good.clone();
            targets[67] = light;
            let mut words = [7, 7];
            let counters = &mut Counters::default();
            let error = index.occluded_targets(&start, &targets, &mut words, counters);
            let Err(QueryError::BadTarget { index: 67, target }) = error else {
                panic!("{bad}: {error:?}");
            };
            assert_eq!(
                target.to_array().map(f64::to_bits),
                bad.to_array().map(f64::to_bits)
            );
            // Nothing was written.
            assert_eq!((words, *counters), ([7, 7], Counters::default()));
            let points = [start.point];
            let batch = index.occluded_targets_batch(
                &Batch::free(&points.map(|p| p.to_array())),
                Targets::Shared(&targets),
                &mut words,
            );
            let Err(BatchError::BadTarget {
                what: "target",
                index: 67,
                ..
            }) = batch
            else {
                panic!("{bad}: {batch:?}");
            };
        }
        let lost = ReceiverPoint {
            point: bad,
            surface: None,
        };
        let error = index.occluded_targets(&lost, &good, &mut [0; 2], &mut Counters::default());
        let Err(QueryError::BadPoint(point)) = error else {
            panic!("{bad}: {error:?}");
        };
        assert_eq!(
            point.to_array().map(f64::to_bits),
            bad.to_array().map(f64::to_bits)
        );
        let batch = index.occluded_targets_batch(
            &Batch::free(&[[0.0; 3], bad.to_array()]),
            Targets::Shared(&good),
            &mut [0; 4],
        );
        let Err(BatchError::BadPoint { index: 1, .. }) = batch else {
            panic!("{bad}: {batch:?}");
        };
    }
    let unknown = ReceiverPoint {
        surface: Some(SurfaceId(1_000_000)),
        ..start
    };
    let error = index.occluded_targets(&unknown, &good, &mut [0; 2], &mut Counters::default());
    assert_eq!(error, Err(QueryError::UnknownSurface(1_000_000)));
    let short = index.occluded_targets_batch(
        &Batch::free(&[[0.0; 3]]),
        Targets::Each {
            targets: &good,
            per_start: 60,
        },
        &mut [0; 1],
    );
    let expected = BatchError::Length {
        what: "targets",
        expected: 60,
        found: 70,
    };
    assert_eq!(short, Err(expected));
}

/// The law of many threads: slices of starts, batches and single starts have the same bits.
#[test]
fn bits_do_not_depend_on_how_many_starts_or_threads_there_are() {
    let random = &mut Random(7);
    let occluders = hall(random);
    let index = index_of(&occluders, Method::Bvh);
    let starts: Vec<ReceiverPoint> = (0..700).map(|_| start_in(&occluders, random)).collect();
    let per_start = 70;
    let targets: Vec<LightShape> = (0..starts.len())
        .flat_map(|_| samples(v(0.5, 0.3, 8.0), 0.5, per_start, random))
        .collect();
    let each = Targets::Each {
        targets: &targets,
        per_start,
    };
    let points: Vec<[f64; 3]> = starts.iter().map(|start| start.point.to_array()).collect();
    let free: Vec<ReceiverPoint> = starts
        .iter()
        .map(|s| ReceiverPoint {
            surface: None,
            ..*s
        })
        .collect();
    let singly = |starts: &[ReceiverPoint], of: &dyn Fn(usize) -> Vec<LightShape>| -> Vec<u64> {
        let starts = starts.iter().enumerate();
        starts
            .flat_map(|(number, start)| found(&index, start, &of(number)))
            .collect()
    };
    let own = |number: usize| targets[number * per_start..][..per_start].to_vec();
    let by_one = singly(&starts, &own);
    let mut together = vec![0; by_one.len()];
    let counters = &mut Counters::default();
    index
        .occluded_targets_of(&starts, each, &mut together, counters)
        .expect("fine queries");
    assert_eq!(together, by_one);
    assert_eq!(counters.shadow.rays, targets.len() as u64);
    let occluded: u32 = by_one.iter().map(|word| word.count_ones()).sum();
    assert_eq!(counters.shadow.shadowed, u64::from(occluded));

    let shared = &targets[..65];
    let free_by_one = [singly(&free, &own), singly(&free, &|_| shared.to_vec())];
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        for (targets, expected) in [each, Targets::Shared(shared)]
            .into_iter()
            .zip(&free_by_one)
        {
            let mut words = vec![u64::MAX; expected.len()];
            pool.install(|| {
                index.occluded_targets_batch(&Batch::free(&points), targets, &mut words)
            })
            .expect("fine queries");
            assert!(words == *expected, "{threads} threads");
        }
    }
}

#[test]
fn targets_behind_the_normal_of_a_facing_point_are_occluded() {
    let random = &mut Random(8);
    let occluders = hall(random);
    let index = index_of(&occluders, Method::Bvh);
    let points: Vec<[f64; 3]> = (0..90)
        .map(|_| (4.0 * random.in_cube() + v(0.0, 0.0, 3.0)).to_array())
        .collect();
    let normals: Vec<[f64; 3]> = (0..90).map(|_| random.in_cube().to_array()).collect();
    let mut targets = samples(v(0.0, 0.0, 9.0), 9.0, 60, random);
    targets.extend((0..10).map(|_| LightShape::Direction(random.in_cube())));
    let kind = BatchKind::Facing { normals: &normals };
    let batch = Batch {
        points: &points,
        kind,
    };
    let mut words = vec![0; 2 * points.len()];
    let counted = index
        .occluded_targets_batch(&batch, Targets::Shared(&targets), &mut words)
        .expect("fine queries");
    let mut away_count = 0;
    for (number, (&point, &normal)) in points.iter().zip(&normals).enumerate() {
        let point = DVec3::from_array(point);
        let start = ReceiverPoint {
            point,
            surface: None,
        };
        let mut truth = expected(&occluders, &start, &targets);
        for (place, target) in targets.iter().enumerate() {
            if target.side_of(point, DVec3::from_array(normal)) <= 0 {
                truth[place / 64] |= 1 << (place % 64);
                away_count += 1;
            }
        }
        assert_eq!(words[2 * number..][..2], truth);
    }
    assert_eq!(counted.facing_away, away_count);
    assert!(away_count > 1_000, "{away_count}");
}
