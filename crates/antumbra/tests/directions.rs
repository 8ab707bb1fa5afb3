//! Directions that many points share: every bit is the reference's for that point and that direction.
//!
//! The reference tests every surface for one segment ([`ShadowIndex::shadow_by_reference`]); it knows neither tiles nor
//! cells.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchError, BatchKind, DirectionSet, LightId, Method, ReceiverSide, Shadow, ShadowIndex,
};
use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use antumbra_testkit::nasty;
use common::nasty::{nasty_targets, point_near};
use common::{METHODS, Random};

fn index_of(occluders: &Arc<Occluders>, method: Method) -> ShadowIndex {
    ShadowIndex::builder(occluders.clone(), Vec::new())
        .method(method)
        .build()
        .expect("settings are in range")
}

/// Points on one surface each, and what is asked of them.
struct Questions {
    points: Vec<[f64; 3]>,
    surfaces: Vec<u32>,
    directions: Vec<DVec3>,
}

impl Questions {
    fn batch(&self) -> Batch<'_> {
        Batch {
            points: &self.points,
            kind: BatchKind::OnSurfaces {
                surfaces: &self.surfaces,
                tolerance: Some(f64::INFINITY),
            },
        }
    }

    fn starts(&self) -> impl Iterator<Item = ReceiverPoint> {
        self.points
            .iter()
            .zip(&self.surfaces)
            .map(|(&point, &surface)| ReceiverPoint {
                point: point.into(),
                surface: Some(SurfaceId(surface)),
            })
    }
}

/// Returns the bits that the reference gives.
fn expected(
    occluders: &Arc<Occluders>,
    starts: impl Iterator<Item = ReceiverPoint>,
    directions: &[DVec3],
    is_asked: impl Fn(usize, &ReceiverPoint, &LightShape) -> bool,
) -> Vec<u64> {
    // No light is a zero direction; towards nowhere nothing is met.
    let is_nowhere = |direction: DVec3| direction == DVec3::ZERO;
    let lights = directions.iter().map(|&direction| {
        LightShape::Direction(if is_nowhere(direction) {
            DVec3::X
        } else {
            direction
        })
    });
    let index = ShadowIndex::builder(occluders.clone(), lights.collect())
        .method(Method::Naive)
        .build()
        .expect("settings are in range");
    let mut words = Vec::new();
    for (number, start) in starts.enumerate() {
        let first = words.len();
        words.resize(first + directions.len().div_ceil(64), 0);
        for (place, &direction) in directions.iter().enumerate() {
            let answer = index.shadow_by_reference(&start, LightId::from_index(place));
            let is_shadowed = answer.expect("a fine query") == Shadow::Shadowed;
            let light = LightShape::Direction(direction);
            if (!is_shadowed || is_nowhere(direction)) && is_asked(number, &start, &light) {
                words[first + place / 64] |= 1 << (place % 64);
            }
        }
    }
    words
}

fn found(
    index: &ShadowIndex,
    batch: &Batch<'_>,
    directions: &[DVec3],
    side: ReceiverSide,
) -> Vec<u64> {
    let set = DirectionSet::new(directions).expect("fine directions");
    // What was there before is overwritten.
    let mut words = vec![u64::MAX; set.word_count() * batch.points.len()];
    let counted = index
        .visible_directions(batch, &set, side, &mut words)
        .expect("fine queries");
    let shadow = counted.counters.shadow;
    let lit: u64 = words.iter().map(|word| u64::from(word.count_ones())).sum();
    assert_eq!(shadow.first_pass + shadow.rays, lit + shadow.shadowed);
    words
}

/// Explains the first difference.
fn assert_same(label: &str, questions: &Questions, found: &[u64], truth: &[u64]) {
    let stride = questions.directions.len().div_ceil(64);
    for (number, (found, truth)) in found.chunks(stride).zip(truth.chunks(stride)).enumerate() {
        for (place, direction) in questions.directions.iter().enumerate() {
            let bit = |words: &[u64]| words[place / 64] >> (place % 64) & 1;
            assert_eq!(
                bit(found),
                bit(truth),
                "{label}: {direction:?} from {:?} on {}",
                questions.points[number],
                questions.surfaces[number]
            );
        }
    }
    // Bits beyond the last direction, too.
    assert_eq!(found, truth, "{label}");
}

/// Many points on few surfaces, with directions that edges and vertices lie in.
fn questions(scene: &nasty::NastyScene, occluders: &Occluders, random: &mut Random) -> Questions {
    let mut questions = Questions {
        points: Vec::new(),
        surfaces: Vec::new(),
        directions: Vec::new(),
    };
    let lights: Vec<LightShape> = scene
        .lights
        .iter()
        .map(|&l| common::nasty::light(l))
        .collect();
    for query in &scene.queries[..4] {
        let Some(surface) = query.surface else {
            continue;
        };
        let many = random.pick(&[1, 20, 70]);
        for number in 0..many {
            let given = DVec3::from_array(query.point);
            let id = SurfaceId(surface as u32);
            let point = match occluders.triangle_positions(id) {
                Some(corners) if number > 0 => point_near(corners, given, random),
                _ => given,
            };
            questions.points.push(point.to_array());
            questions.surfaces.push(id.0);
        }
        let start = common::nasty::start(query.point, query.surface);
        for target in nasty_targets(occluders, &lights, &start, 40, random) {
            questions.directions.push(match target {
                LightShape::Direction(direction) => direction,
                LightShape::Point(point) => point - start.point,
            });
        }
        if let Some([a, b, c]) = occluders.triangle_positions(SurfaceId(surface as u32)) {
            questions
                .directions
                .extend([b - a, a - c, (b - a) + (c - a), (b - a).cross(c - a)]);
        }
    }
    questions
        .directions
        .retain(|d| d.abs().max_element() <= 1e30);
    questions.directions.extend([
        DVec3::ZERO,
        DVec3::Z,
        DVec3::NEG_X,
        DVec3::Z * 1e-300,
        DVec3::Y * 1e29,
    ]);
    questions
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

#[test]
#[expect(
    clippy::print_stdout,
    reason = "the raw output of a long run says how many pairs it asked"
)]
fn directions_of_nasty_scenes_are_the_references() {
    let (mut lit, mut asked, mut clear) = (0, 0, 0);
    for seed in seeds() {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let index = index_of(&occluders, Method::Bvh);
        let questions = questions(&scene, &occluders, random);
        let (batch, directions) = (questions.batch(), &questions.directions);
        for (side, sign) in [
            (ReceiverSide::Front, 1),
            (ReceiverSide::Back, -1),
            (ReceiverSide::Both, 0),
        ] {
            let is_asked = |_, start: &ReceiverPoint, light: &LightShape| {
                sign == 0 || occluders.light_side(start, light) == sign
            };
            let truth = expected(&occluders, questions.starts(), directions, is_asked);
            let found = found(&index, &batch, directions, side);
            assert_same(
                &format!("{} {side:?}", scene.label()),
                &questions,
                &found,
                &truth,
            );
            lit += truth
                .iter()
                .map(|word| u64::from(word.count_ones()))
                .sum::<u64>();
            asked += questions.points.len() * directions.len();
        }
        let set = DirectionSet::new(directions).expect("fine directions");
        let mut words = vec![0; set.word_count() * questions.points.len()];
        let counted = index.visible_directions(&batch, &set, ReceiverSide::Front, &mut words);
        clear += counted.expect("fine queries").counters.shadow.first_pass;
    }
    assert!(
        lit as usize * 20 > asked && lit as usize * 10 < asked * 9,
        "{lit} of {asked}"
    );
    assert!(clear > 1_000, "{clear} were answered for groups");
    println!("{asked} pairs, {lit} lit: no difference");
}

#[test]
fn all_methods_answer_directions_alike() {
    for seed in [3, 11, 40] {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let questions = questions(&scene, &occluders, random);
        let by_bvh = found(
            &index_of(&occluders, Method::Bvh),
            &questions.batch(),
            &questions.directions,
            ReceiverSide::Front,
        );
        for method in METHODS {
            let index = index_of(&occluders, method);
            let (batch, directions) = (questions.batch(), &questions.directions);
            assert_eq!(
                found(&index, &batch, directions, ReceiverSide::Front),
                by_bvh
            );
        }
    }
}

/// Walls that meet a roof exactly at its rim, under it and over it, seen along their planes.
#[test]
fn rims_of_a_roof_are_lit_over_its_own_walls() {
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let roof = [
        v(0.0, 0.0, 3.0),
        v(8.0, 0.0, 3.0),
        v(8.0, 8.0, 3.0),
        v(0.0, 8.0, 3.0),
    ];
    common::add_face(&mut builder, &roof);
    for i in 0..4 {
        let (a, b) = (roof[i], roof[(i + 1) % 4]);
        common::add_face(&mut builder, &[v(a.x, a.y, 0.0), v(b.x, b.y, 0.0), b, a]);
    }
    // A parapet on one side.
    let top = [v(0.0, 8.0, 4.0), v(8.0, 8.0, 4.0)];
    common::add_face(&mut builder, &[roof[3], roof[2], top[1], top[0]]);
    let occluders = Arc::new(builder.build());
    let mut questions = Questions {
        points: Vec::new(),
        surfaces: Vec::new(),
        directions: Vec::new(),
    };
    for i in 0..=8 {
        for j in 0..=8 {
            for surface in [0, 1] {
                questions.points.push([f64::from(i), f64::from(j), 3.0]);
                questions.surfaces.push(surface);
            }
        }
    }
    for x in -3..=3 {
        for y in -3..=3 {
            for z in [-1.0, 0.0, 0.25, 1.0] {
                questions.directions.push(v(f64::from(x), f64::from(y), z));
            }
        }
    }
    let is_front =
        |_, start: &ReceiverPoint, light: &LightShape| occluders.light_side(start, light) > 0;
    let truth = expected(
        &occluders,
        questions.starts(),
        &questions.directions,
        is_front,
    );
    let index = index_of(&occluders, Method::Bvh);
    let found = found(
        &index,
        &questions.batch(),
        &questions.directions,
        ReceiverSide::Front,
    );
    assert_same("roof", &questions, &found, &truth);
    let east = questions
        .directions
        .iter()
        .position(|&d| d == v(3.0, 0.0, 0.25));
    let east = east.expect("a direction");
    // On the eastern rim nothing of the house is in the way.
    let rim = questions
        .points
        .iter()
        .position(|&p| p == [8.0, 4.0, 3.0])
        .expect("a point");
    let stride = questions.directions.len().div_ceil(64);
    assert_eq!(found[rim * stride + east / 64] >> (east % 64) & 1, 1);
}

/// The law of many threads, of order, and of points that come with others.
#[test]
fn bits_do_not_depend_on_threads_or_on_what_else_is_asked() {
    let random = &mut Random(7);
    let scene = nasty::scene(12);
    let occluders = common::nasty::occluders(&scene.surfaces);
    let index = index_of(&occluders, Method::Bvh);
    let mut all = questions(&scene, &occluders, random);
    while all.points.len() < 1500 {
        let number = random.below(all.points.len());
        let (point, surface) = (all.points[number], all.surfaces[number]);
        all.points
            .push((DVec3::from_array(point) + 1e-3 * random.in_cube()).to_array());
        all.surfaces.push(surface);
    }
    let whole = found(&index, &all.batch(), &all.directions, ReceiverSide::Front);
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        let again =
            pool.install(|| found(&index, &all.batch(), &all.directions, ReceiverSide::Front));
        assert!(again == whole, "{threads} threads");
    }
    let stride = all.directions.len().div_ceil(64);
    for number in (0..all.points.len()).step_by(17) {
        let one = Questions {
            points: vec![all.points[number]],
            surfaces: vec![all.surfaces[number]],
            directions: all.directions.clone(),
        };
        let alone = found(&index, &one.batch(), &one.directions, ReceiverSide::Front);
        assert_eq!(alone, whole[number * stride..][..stride]);
    }
}

#[test]
fn points_that_face_see_what_is_on_the_side_of_their_normal() {
    let random = &mut Random(8);
    let scene = nasty::scene(5);
    let occluders = common::nasty::occluders(&scene.surfaces);
    let questions = questions(&scene, &occluders, random);
    let normals: Vec<[f64; 3]> = questions
        .points
        .iter()
        .map(|_| random.in_cube().to_array())
        .collect();
    let batch = Batch {
        points: &questions.points,
        kind: BatchKind::Facing { normals: &normals },
    };
    let free = questions.starts().map(|start| ReceiverPoint {
        surface: None,
        ..start
    });
    let truth = expected(
        &occluders,
        free,
        &questions.directions,
        |number, start, light| light.side_of(start.point, normals[number].into()) > 0,
    );
    let index = index_of(&occluders, Method::Bvh);
    let set = DirectionSet::new(&questions.directions).expect("fine directions");
    let mut words = vec![0; truth.len()];
    let counted = index
        .visible_directions(&batch, &set, ReceiverSide::Both, &mut words)
        .expect("fine queries");
    assert_same("facing", &questions, &words, &truth);
    let shadow = counted.counters.shadow;
    let pairs = (questions.points.len() * questions.directions.len()) as u64;
    assert_eq!(shadow.first_pass + shadow.rays + counted.facing_away, pairs);
}

#[test]
fn what_has_no_answer_is_refused_by_its_number() {
    let occluders = Arc::new(Occluders::builder().build());
    let index = index_of(&occluders, Method::Bvh);
    let error = DirectionSet::new(&[DVec3::X, DVec3::NAN]).expect_err("a bad direction");
    let BatchError::BadTarget {
        what: "direction",
        index: 1,
        ..
    } = error
    else {
        panic!("{error:?}");
    };
    let set = DirectionSet::new(&[DVec3::X; 65]).expect("fine directions");
    let points = [[0.0; 3], [f64::INFINITY, 0.0, 0.0]];
    let batch = Batch::free(&points);
    let error = index.visible_directions(&batch, &set, ReceiverSide::Both, &mut [0; 4]);
    let Err(BatchError::BadPoint { index: 1, .. }) = error else {
        panic!("{error:?}");
    };
    let error = index.visible_directions(&batch, &set, ReceiverSide::Both, &mut [0; 3]);
    let Err(BatchError::Length {
        what: "words of output",
        expected: 4,
        found: 3,
    }) = error
    else {
        panic!("{error:?}");
    };
    // Nothing is asked, or nothing is there.
    let none = DirectionSet::new::<DVec3>(&[]).expect("no directions");
    assert!(none.is_empty() && none.word_count() == 0);
    let good = Batch::free(&points[..1]);
    index
        .visible_directions(&good, &none, ReceiverSide::Both, &mut [])
        .expect("a fine query");
    let mut words = [0; 2];
    index
        .visible_directions(&good, &set, ReceiverSide::Both, &mut words)
        .expect("a fine query");
    assert_eq!(words, [u64::MAX, 1]);
}
