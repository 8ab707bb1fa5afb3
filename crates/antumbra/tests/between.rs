//! What is known of all points between two: the reference's answer at each of them.

mod common;

use antumbra::{
    Counters, DVec3, LightId, LightShape, Method, ReceiverPoint, Refine, Refinement, Shadow,
    ShadowIndex,
};
use antumbra_testkit::nasty;
use common::{METHODS, Random};

fn space(point: DVec3) -> ReceiverPoint {
    ReceiverPoint {
        point,
        surface: None,
    }
}

#[test]
fn what_is_known_between_two_points_is_the_references_answer_all_along() {
    // Of each method: how often it knew that points are lit, and that they are in shadow.
    let mut known = METHODS.map(|method| (method, [0_u32; 2]));
    for seed in seeds(0..60) {
        let scene = nasty::scene(seed);
        let random = &mut Random(seed ^ 0xb5);
        let occluders = common::nasty::occluders(&scene.surfaces);
        let lights: Vec<LightShape> = scene
            .lights
            .iter()
            .map(|&light| common::nasty::light(light))
            .collect();
        let size = occluders.bounds().size().max_element();
        let refinement = Refinement {
            resolution: 64,
            space_resolution: 64,
            refine: Refine::Queried,
            ..Refinement::default()
        };
        let indices = METHODS.map(|method| {
            let builder = common::builder_of(&occluders, &lights, method);
            builder.refinement(refinement).build().expect("an index")
        });
        for query in &scene.queries {
            let start = common::nasty::start(query.point, query.surface);
            let up = match start.surface {
                Some(surface) if random.below(4) > 0 => occluders.normal_at(surface, start.point),
                _ => random.in_cube(),
            };
            let up = if random.below(2) == 0 { up } else { -up };
            let height = size * random.pick(&[1e-7, 1e-4, 1e-3, 1e-2, 0.1, 0.6]);
            let lifted = |height: f64| start.point + height * up;
            let ends = [height / 64.0, height].map(lifted);
            for (number, _) in (0..).zip(&scene.lights) {
                let light = LightId(number);
                for (index, (method, counts)) in indices.iter().zip(&mut known) {
                    // So that values and maps are there which grow as they are asked.
                    for end in ends {
                        let counters = &mut Counters::default();
                        index.shadow(&space(end), light, counters).expect("a point");
                    }
                    let told = index.known_between(ends[0], ends[1], light);
                    let Some(told) = told.expect("fine points") else {
                        continue;
                    };
                    counts[usize::from(told == Shadow::Shadowed)] += 1;
                    for step in 0..8 {
                        let share = match step {
                            0 => 1.0 / 64.0,
                            1 => 1.0,
                            _ => random.real(1.0 / 64.0, 1.0),
                        };
                        let point = lifted(height * share);
                        let reference = index.shadow_by_reference(&space(point), light);
                        let label = scene.label();
                        assert_eq!(
                            reference,
                            Ok(told),
                            "{label} {method:?} {point:?} {light:?}"
                        );
                    }
                }
            }
        }
    }
    for (method, [lit, shadowed]) in known {
        let knows = matches!(method, Method::Auto | Method::Voxel | Method::Voxel1990);
        match knows {
            true => assert!(lit > 300 && shadowed > 100, "{method:?} {lit} {shadowed}"),
            false => assert_eq!([lit, shadowed], [0; 2], "{method:?}"),
        }
    }
}

#[test]
fn odd_points_and_lights_are_refused() {
    let mut builder = antumbra::Occluders::builder();
    common::add_face(&mut builder, &[DVec3::ZERO, DVec3::X, DVec3::Y]);
    let lights = vec![LightShape::Direction(DVec3::Z)];
    let index = ShadowIndex::builder(builder.build().into(), lights)
        .build()
        .expect("an index");
    let between = |to: DVec3, light| index.known_between(DVec3::ONE, to, LightId(light));
    assert_eq!(between(DVec3::ONE, 0), Ok(None));
    for odd in [f64::NAN, f64::INFINITY, 1e31] {
        assert!(between(DVec3::new(0.0, odd, 0.0), 0).is_err(), "{odd}");
    }
    assert!(between(DVec3::ZERO, 1).is_err());
}

/// Nasty scenes; `ANTUMBRA_BETWEEN_SEEDS=0..3000` is the long run.
fn seeds(usual: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(given) = std::env::var("ANTUMBRA_BETWEEN_SEEDS") else {
        return usual;
    };
    let (from, to) = given.split_once("..").expect("FROM..TO");
    from.parse().expect("a number")..to.parse().expect("a number")
}
