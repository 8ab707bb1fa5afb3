//! All lights of a point at once: every bit is the reference's for that start and that light, whatever rows know.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, Counters, LightId, Method, QueryError, ReceiverSide, Refine, Refinement, Shadow,
    ShadowIndex,
};
use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use antumbra_testkit::fixtures;
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::Oracle;
use common::nasty::nasty_targets;
use common::{METHODS, Random};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// An index with rows as soon as they are asked, in cells of the scene halved so many times.
fn index_of(
    occluders: &Arc<Occluders>,
    lights: &[LightShape],
    method: Method,
    (resolution, refine): (u32, Refine),
) -> ShadowIndex {
    let refinement = Refinement {
        resolution,
        refine,
        ..Refinement::default()
    };
    ShadowIndex::builder(occluders.clone(), lights.to_vec())
        .method(method)
        .refinement(refinement)
        .build()
        .expect("settings are in range")
}

/// Returns whether the reference says that a light reaches a start.
fn is_lit(index: &ShadowIndex, start: &ReceiverPoint, light: usize) -> bool {
    index
        .shadow_by_reference(start, LightId::from_index(light))
        .expect("a fine query")
        == Shadow::Lit
}

fn is_asked(index: &ShadowIndex, start: &ReceiverPoint, side: ReceiverSide, light: usize) -> bool {
    let shape = &index.lights()[light];
    let sign = index.occluders().light_side(start, shape);
    match side {
        ReceiverSide::Normal(normal) => shape.side_of(start.point, normal) > 0,
        ReceiverSide::Front => start.surface.is_none() || sign > 0,
        ReceiverSide::Back => start.surface.is_none() || sign < 0,
        ReceiverSide::Both => true,
    }
}

/// Asks for all lights of some starts and compares each bit. Returns how many lights reach a start, and the counters.
fn check(
    label: &str,
    index: &ShadowIndex,
    starts: &[ReceiverPoint],
    side: ReceiverSide,
) -> (u64, Counters) {
    let stride = index.lights().len().div_ceil(64);
    // What was there before is overwritten.
    let mut words = vec![u64::MAX; stride * starts.len()];
    let mut counters = Counters::default();
    index
        .lights_visible_of(starts, side, &mut words, &mut counters)
        .expect("fine queries");
    let mut lit = 0;
    for (start, words) in starts.iter().zip(words.chunks(stride.max(1))) {
        for light in 0..stride * 64 {
            let truth = light < index.lights().len()
                && is_asked(index, start, side, light)
                && is_lit(index, start, light);
            assert_eq!(
                words[light / 64] >> (light % 64) & 1 != 0,
                truth,
                "{label}, {:?}, {side:?}: light {light} {:?} from {start:?}",
                index.method(),
                index.lights().get(light)
            );
            lit += u64::from(truth);
        }
    }
    check_in_turn(index, starts, side, &words);
    (lit, counters)
}

/// Asks the same of one start after the other, some lights left out, and compares bits, sides and counts.
fn check_in_turn(index: &ShadowIndex, starts: &[ReceiverPoint], side: ReceiverSide, words: &[u64]) {
    let count = index.lights().len();
    let stride = count.div_ceil(64);
    let mut lights = index.lights_in_turn();
    for (number, (start, words)) in starts.iter().zip(words.chunks(stride.max(1))).enumerate() {
        let left_out: Vec<u64> = match number % 3 {
            0 => Vec::new(),
            of => (0..stride)
                .map(|word| 0x9e37_79b9_7f4a_7c15 << (of * word))
                .collect(),
        };
        let mut counters = Counters::default();
        lights
            .ask(start, side, &left_out, &mut counters)
            .expect("a fine query");
        let (mut asked, mut shadowed) = (0, 0);
        for light in 0..count {
            let (word, bit) = (light / 64, light % 64);
            let is = |words: &[u64]| words.get(word).is_some_and(|word| word >> bit & 1 != 0);
            let is_on_side = is_asked(index, start, side, light);
            assert_eq!(is(lights.on_side()), is_on_side, "{light} {start:?}");
            let is_left_out = is(&left_out);
            let is_lit = is(words) && !is_left_out;
            assert_eq!(is(lights.visible()), is_lit, "{light} {start:?}");
            if is_on_side && !is_left_out {
                asked += 1;
                shadowed += u64::from(!is_lit);
                let answer = lights.answer_of(LightId::from_index(light));
                assert_eq!(answer.shadow == Shadow::Lit, is_lit);
            }
        }
        let shadow = counters.shadow;
        assert_eq!(shadow.shadowed, shadowed, "{start:?}");
        let sum = shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays;
        assert_eq!(sum, asked, "{start:?} {shadow:?}");
    }
}

/// Starts that share cells and triangles with some others: on the same triangles, on planes between cells, beside them.
fn attackers(
    index: &ShadowIndex,
    starts: &[ReceiverPoint],
    random: &mut Random,
) -> Vec<ReceiverPoint> {
    let occluders = index.occluders();
    let mut found = starts.to_vec();
    let planes = index.row_planes();
    for start in starts {
        let Some([a, b, c]) = start
            .surface
            .and_then(|surface| occluders.triangle_positions(surface))
        else {
            continue;
        };
        for _ in 0..6 {
            let mut point = common::nasty::point_near([a, b, c], start.point, random);
            if let (Some((min, edge)), true) = (planes, random.below(3) == 0) {
                // To a plane between cells, or a hair beside it.
                let axis = random.below(3);
                let plane = ((point[axis] - min[axis]) / edge).round();
                point[axis] = min[axis] + plane * edge * (1.0 + random.pick(&[0.0, 1e-15, -1e-7]));
            }
            if point.is_finite() && point.abs().max_element() < 1e30 {
                let surface = random.pick(&[start.surface, start.surface, None]);
                found.push(ReceiverPoint { point, surface });
            }
        }
    }
    found
}

/// How many nasty scenes the suite asks; `ANTUMBRA_NASTY_SEEDS=from..to` asks others.
fn seeds() -> std::ops::Range<u64> {
    let Ok(text) = std::env::var("ANTUMBRA_NASTY_SEEDS") else {
        return 0..160;
    };
    let (from, to) = text
        .split_once("..")
        .expect("ANTUMBRA_NASTY_SEEDS is from..to");
    from.parse().expect("a number")..to.parse().expect("a number")
}

const SIDES: [ReceiverSide; 3] = [ReceiverSide::Both, ReceiverSide::Front, ReceiverSide::Back];

#[test]
fn lights_of_nasty_scenes_are_the_references() {
    let (mut lit, mut known, mut asked) = (0, 0, 0);
    for seed in seeds() {
        let random = &mut Random(seed);
        let scene = nasty::scene(seed);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let own: Vec<LightShape> = scene
            .lights
            .iter()
            .map(|&l| common::nasty::light(l))
            .collect();
        let starts: Vec<ReceiverPoint> = scene.queries[..12]
            .iter()
            .map(|query| common::nasty::start(query.point, query.surface))
            .collect();
        let count = random.pick(&[0, 1, 3, 30, 64, 65, 130]);
        let mut lights = own.clone();
        lights.extend(nasty_targets(&occluders, &own, &starts[0], count, random));
        // No light is a zero direction.
        lights.retain(|light| *light != LightShape::Direction(DVec3::ZERO));
        let resolution = random.pick(&[4, 8, 64, 2048]);
        let method = random.pick(&[Method::Auto, Method::Voxel]);
        let index = index_of(&occluders, &lights, method, (resolution, Refine::Queried));
        let starts = attackers(&index, &starts, random);
        let normal = random.in_cube().round();
        let side = random.pick(&[
            ReceiverSide::Both,
            ReceiverSide::Front,
            ReceiverSide::Back,
            ReceiverSide::Normal(normal),
        ]);
        let (reached, counters) = check(&scene.label(), &index, &starts, side);
        lit += reached;
        known += counters.shadow.first_pass;
        asked += counters.shadow.first_pass + counters.shadow.rays;
        assert!(index.row_bytes() <= index.knowledge_bytes());
    }
    assert!(
        10 * lit > asked && 10 * lit < 9 * asked && 8 * known > asked,
        "{lit} lit, {known} known of {asked}"
    );
}

/// A few against the oracle itself, so that the reference is not the only witness.
#[test]
fn lights_of_fixtures_agree_with_the_oracle() {
    for fixture in fixtures::all() {
        let oracle = Oracle::new(fixture.surfaces.clone());
        let occluders = common::nasty::occluders(&fixture.surfaces);
        let lights: Vec<LightShape> = fixture
            .lights
            .iter()
            .map(|&l| common::nasty::light(l))
            .collect();
        for resolution in [4, 128] {
            let index = index_of(
                &occluders,
                &lights,
                Method::Auto,
                (resolution, Refine::Queried),
            );
            for query in &fixture.queries {
                let start = common::nasty::start(query.point, query.surface);
                let words = match start.surface {
                    Some(surface) => index.lights_visible(start.point, surface),
                    None => index.lights_visible_at(start.point),
                };
                // A point off its surface is refused one by one, and answered where starts are given.
                let words = match words {
                    Err(QueryError::OffSurface { .. }) => {
                        let mut words = vec![0; fixture.lights.len().div_ceil(64)];
                        let (all, mut counters) = (ReceiverSide::Both, Counters::default());
                        index
                            .lights_visible_of(&[start], all, &mut words, &mut counters)
                            .expect("a fine query");
                        words
                    }
                    words => words.expect("a fine query"),
                };
                for (number, &light) in fixture.lights.iter().enumerate() {
                    let truth = oracle.is_blocked(query.point, query.surface, light);
                    let bit = words[number / 64] >> (number % 64) & 1;
                    assert_eq!(bit == 0, truth, "{}: {query:?} {light:?}", fixture.name);
                }
            }
        }
    }
}

/// Rooms with walls, a pane, a cone and a disk, and lamps all over.
fn flat(random: &mut Random, light_count: usize) -> (Arc<Occluders>, Vec<LightShape>) {
    let mut builder = Occluders::builder();
    let floor = [
        v(-4.0, -4.0, 0.0),
        v(4.0, -4.0, 0.0),
        v(4.0, 4.0, 0.0),
        v(-4.0, 4.0, 0.0),
    ];
    common::add_face(&mut builder, &floor);
    for number in 0..3 {
        let x = f64::from(number) * 2.5 - 2.5;
        for (from, to) in [(-4.0, -0.5), (0.5, 4.0)] {
            let wall = [
                v(x, from, 0.0),
                v(x, to, 0.0),
                v(x, to, 3.0),
                v(x, from, 3.0),
            ];
            common::add_face(&mut builder, &wall);
        }
    }
    common::add_pane(&mut builder);
    common::add_cone_and_disk(&mut builder, 0.0);
    for _ in 0..30 {
        let middle = 3.5 * random.in_cube() + v(0.0, 0.0, 1.5);
        let corners = [0; 3].map(|_| middle + 0.4 * random.in_cube());
        common::add_face(&mut builder, &corners);
    }
    let lights = (0..light_count).map(|number| match number % 9 {
        8 => LightShape::Direction(random.in_cube() + v(0.0, 0.0, 1.0)),
        _ => LightShape::Point(v(4.0, 4.0, 1.0) * random.in_cube() + v(0.0, 0.0, 2.0)),
    });
    let lights = lights.collect();
    (Arc::new(builder.build()), lights)
}

/// Starts on surfaces and in the air.
fn starts_in(occluders: &Occluders, count: usize, random: &mut Random) -> Vec<ReceiverPoint> {
    let start = |_| {
        let surface = match random.below(3) {
            0 => SurfaceId(random.below(2) as u32),
            _ => SurfaceId(random.below(occluders.surface_count()) as u32),
        };
        let bounds = occluders.surface_bounds(surface);
        let (point, surface) = match occluders.triangle_positions(surface) {
            _ if random.below(5) == 0 => (4.0 * random.in_cube() + v(0.0, 0.0, 2.0), None),
            Some([a, b, c]) => {
                let [s, t] = [random.unit(), random.unit()];
                let [s, t] = if s + t > 1.0 {
                    [1.0 - s, 1.0 - t]
                } else {
                    [s, t]
                };
                (a + (b - a) * s + (c - a) * t, Some(surface))
            }
            None => (
                bounds.center() + 0.5 * bounds.size() * random.in_cube(),
                Some(surface),
            ),
        };
        ReceiverPoint { point, surface }
    };
    (0..count).map(start).collect()
}

#[test]
fn all_methods_answer_all_lights_alike() {
    let random = &mut Random(5);
    let (occluders, lights) = flat(random, 70);
    let starts = starts_in(&occluders, 60, random);
    for method in METHODS {
        for refine in [Refine::Lazy, Refine::Queried] {
            let index = index_of(&occluders, &lights, method, (64, refine));
            for side in SIDES {
                check("flat", &index, &starts, side);
            }
        }
    }
}

#[test]
fn rows_know_most_lights_of_rooms_and_are_right() {
    let random = &mut Random(8);
    for light_count in [1, 10, 64, 100] {
        let (occluders, lights) = flat(random, light_count);
        let index = index_of(&occluders, &lights, Method::Auto, (128, Refine::Lazy));
        let starts = starts_in(&occluders, 3000, random);
        let surfaces: Vec<&ReceiverPoint> = starts.iter().filter(|s| s.surface.is_some()).collect();
        let points: Vec<[f64; 3]> = surfaces.iter().map(|s| s.point.to_array()).collect();
        let named: Vec<SurfaceId> = surfaces.iter().filter_map(|s| s.surface).collect();
        let mut batch = Batch::on_surfaces(&points, &named);
        if let antumbra::BatchKind::OnSurfaces { tolerance, .. } = &mut batch.kind {
            *tolerance = Some(f64::INFINITY);
        }
        let made = index.prepare_lights_visible(&batch).expect("a fine batch");
        assert!(made > 100 && index.row_bytes() > 0, "{made}");
        assert_eq!(index.prepare_lights_visible(&batch), Ok(0), "all is there");
        let (_, counters) = check("rooms", &index, &starts, ReceiverSide::Both);
        let shadow = counters.shadow;
        assert!(shadow.first_pass > shadow.rays, "{shadow:?}");
    }
}

/// The law of many threads: slices of starts, batches and single starts have the same bits, before rows and after.
#[test]
fn bits_do_not_depend_on_how_many_starts_or_threads_there_are() {
    let random = &mut Random(7);
    let (occluders, lights) = flat(random, 100);
    let starts = starts_in(&occluders, 700, random);
    let free: Vec<ReceiverPoint> = starts
        .iter()
        .map(|start| ReceiverPoint {
            surface: None,
            ..*start
        })
        .collect();
    let points: Vec<[f64; 3]> = free.iter().map(|start| start.point.to_array()).collect();
    let normals: Vec<[f64; 3]> = free.iter().map(|_| random.in_cube().to_array()).collect();
    let reference = index_of(&occluders, &lights, Method::Naive, (64, Refine::Lazy));
    let mut alone = vec![0; 2 * free.len()];
    for (start, words) in free.iter().zip(alone.chunks_mut(2)) {
        words.copy_from_slice(
            &reference
                .lights_visible_at(start.point)
                .expect("a fine query"),
        );
    }
    let away = |number: usize, light: usize| {
        lights[light].side_of(free[number].point, normals[number].into()) <= 0
    };
    for thread_count in [1, 4] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(thread_count)
            .build()
            .expect("threads");
        let index = index_of(&occluders, &lights, Method::Auto, (64, Refine::Lazy));
        pool.install(|| {
            for round in 0..3 {
                let mut words = vec![u64::MAX; alone.len()];
                let batch = Batch::free(&points);
                let counted = index
                    .lights_visible_batch(&batch, ReceiverSide::Front, &mut words)
                    .expect("a fine batch");
                assert_eq!(words, alone, "{thread_count} threads, round {round}");
                assert_eq!(counted.facing_away, 0);
                let batch = Batch::facing(&points, &normals);
                let counted = index
                    .lights_visible_batch(&batch, ReceiverSide::Both, &mut words)
                    .expect("a fine batch");
                let mut facing_away = 0;
                for (number, words) in words.chunks(2).enumerate() {
                    for light in 0..lights.len() {
                        let is_lit = alone[2 * number + light / 64] >> (light % 64) & 1 != 0;
                        let is_away = away(number, light);
                        facing_away += u64::from(is_away);
                        assert_eq!(
                            words[light / 64] >> (light % 64) & 1 != 0,
                            is_lit && !is_away
                        );
                    }
                }
                assert_eq!(counted.facing_away, facing_away);
                index.prepare_lights_visible(&batch).expect("a fine batch");
            }
            assert!(index.row_bytes() > 0);
        });
    }
}

#[test]
fn rows_keep_within_the_memory_that_was_set() {
    let random = &mut Random(11);
    let (occluders, lights) = flat(random, 100);
    let starts = starts_in(&occluders, 400, random);
    for memory in [0, 1, 10_000, 60_000, 200_000, 1 << 20, 1 << 23] {
        let refinement = Refinement {
            memory,
            refine: Refine::Queried,
            ..Refinement::default()
        };
        let index = ShadowIndex::builder(occluders.clone(), lights.clone())
            .refinement(refinement)
            .build()
            .expect("settings are in range");
        check("little memory", &index, &starts, ReceiverSide::Both);
        assert!(index.knowledge_bytes() <= memory);
        assert!(index.row_bytes() <= index.knowledge_bytes());
    }
}

#[test]
fn lights_that_come_move_and_go_have_no_old_rows() {
    let random = &mut Random(13);
    let (occluders, lights) = flat(random, 66);
    let starts = starts_in(&occluders, 80, random);
    let mut index = index_of(&occluders, &lights, Method::Auto, (64, Refine::Queried));
    check("at first", &index, &starts, ReceiverSide::Both);
    index
        .move_light(LightId(3), LightShape::Point(v(-1.0, 0.2, 2.0)))
        .expect("a light");
    check("moved", &index, &starts, ReceiverSide::Both);
    index
        .add_light(LightShape::Direction(v(0.1, 0.2, 1.0)))
        .expect("a light");
    check("added", &index, &starts, ReceiverSide::Both);
    index.remove_light(LightId(0)).expect("a light");
    check("removed", &index, &starts, ReceiverSide::Both);
    while !index.lights().is_empty() {
        index.remove_light(LightId(0)).expect("a light");
    }
    check("none left", &index, &starts, ReceiverSide::Both);
    assert_eq!(index.lights_visible_at([0.0; 3]), Ok(Vec::new()));
}

#[test]
fn what_has_no_answer_is_refused_and_nothing_is_written() {
    let random = &mut Random(2);
    let (occluders, lights) = flat(random, 3);
    let index = index_of(&occluders, &lights, Method::Auto, (64, Refine::Queried));
    let far = index.lights_visible([0.0, 0.0, 1e6], SurfaceId(0));
    assert!(matches!(far, Err(QueryError::OffSurface { .. })), "{far:?}");
    let fine = ReceiverPoint {
        point: DVec3::ZERO,
        surface: None,
    };
    let lost = ReceiverPoint {
        surface: Some(SurfaceId(1_000_000)),
        ..fine
    };
    let mut words = [7, 7];
    let counters = &mut Counters::default();
    let error = index.lights_visible_of(&[fine, lost], ReceiverSide::Both, &mut words, counters);
    assert_eq!(error, Err(QueryError::UnknownSurface(1_000_000)));
    assert_eq!((words, *counters), ([7, 7], Counters::default()));
    for bad in [f64::NAN, f64::INFINITY, 1e31] {
        assert!(index.lights_visible_at([0.0, bad, 0.0]).is_err());
        assert!(index.lights_visible([0.0, bad, 0.0], SurfaceId(0)).is_err());
        let points = [[0.0; 3], [bad, 0.0, 0.0]];
        let batch = Batch::free(&points);
        assert!(index.prepare_lights_visible(&batch).is_err());
        let found = index.lights_visible_batch(&batch, ReceiverSide::Both, &mut [0; 2]);
        assert!(matches!(
            found,
            Err(antumbra::BatchError::BadPoint { index: 1, .. })
        ));
    }
    let found = index.lights_visible_batch(&Batch::free(&[[0.0; 3]]), ReceiverSide::Both, &mut []);
    assert!(matches!(
        found,
        Err(antumbra::BatchError::Length {
            expected: 1,
            found: 0,
            ..
        })
    ));
}
