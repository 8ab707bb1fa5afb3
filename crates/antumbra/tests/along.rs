//! Lit intervals along segments: the oracle's, whatever the method, and those that a march finds step by step.

mod common;

use antumbra::{DVec3, LightShape, LitIntervalsError, Method, ShadowIndex};
use antumbra_geometry::{Coverage, Occluders};
use antumbra_testkit::fixtures;
use antumbra_testkit::nasty::{self, NastyScene};
use antumbra_testkit::oracle::{
    Oracle, OracleLight, OraclePlace, OracleShape, OracleShare, OracleSurface,
};
use common::{METHODS, Random};

type Ends = [[f64; 3]; 2];

/// Indices by all methods; values know of the lights.
fn indices(surfaces: &[OracleSurface], lights: &[OracleLight]) -> Vec<ShadowIndex> {
    let occluders = common::nasty::occluders(surfaces);
    let lights: Vec<LightShape> = lights
        .iter()
        .map(|&light| common::nasty::light(light))
        .collect();
    let build = |method| {
        common::builder_of(&occluders, &lights, method)
            .build()
            .unwrap()
    };
    METHODS.map(build).into()
}

fn ask(
    index: &ShadowIndex,
    ends: Ends,
    light: OracleLight,
) -> Result<Vec<[f64; 2]>, LitIntervalsError> {
    let [origin, end] = ends.map(DVec3::from_array);
    index.lit_intervals_along(origin, end, &common::nasty::light(light))
}

fn rounded(intervals: &[[OraclePlace; 2]]) -> Vec<[f64; 2]> {
    let rounded = intervals.iter();
    rounded
        .map(|interval| interval.each_ref().map(OraclePlace::nearest))
        .collect()
}

fn all_fixtures() -> impl Iterator<Item = fixtures::AlongFixture> {
    fixtures::along()
        .into_iter()
        .chain(fixtures::along_curved())
}

#[test]
fn fixtures_have_the_intervals_that_geometry_gives() {
    for fixture in all_fixtures() {
        for index in indices(&fixture.surfaces, &[fixture.light]) {
            let found = ask(&index, fixture.ends, fixture.light);
            let label = format!("{} {:?}", fixture.name, index.method());
            assert_eq!(found, Ok(fixture.expected.clone()), "{label}");
        }
    }
}

/// A point that a surface is made of, or one on its border or in its plane.
fn point_of(shape: &OracleShape, random: &mut Random) -> [f64; 3] {
    let plus = |center: [f64; 3], length: f64, random: &mut Random| {
        let mut point = center;
        point[random.below(3)] += random.pick(&[-1.0, 1.0]) * length;
        point
    };
    let length = random.pick(&[0.0, 1.0, 1.0, 2.0]);
    match *shape {
        OracleShape::Triangle([a, b, c]) => match random.below(4) {
            0 => [0, 1, 2].map(|axis| a[axis] + b[axis] - c[axis]),
            corner => [a, b, c][corner - 1],
        },
        OracleShape::Sphere { center, radius } | OracleShape::Disk { center, radius, .. } => {
            plus(center, length * radius, random)
        }
        OracleShape::Tube {
            base,
            base_radius,
            apex,
            apex_radius,
        } => match random.below(2) {
            0 => plus(base, length * base_radius, random),
            _ => plus(apex, length * apex_radius, random),
        },
        OracleShape::Cap {
            base, apex, radius, ..
        } => plus(random.pick(&[base, apex]), length * radius, random),
    }
}

/// Segments between points of a scene: on surfaces, at corners and middles, in planes, at lights, along edges.
fn segments(scene: &NastyScene, random: &mut Random) -> Vec<Ends> {
    let queries: Vec<[f64; 3]> = scene.queries.iter().map(|query| query.point).collect();
    let point = |random: &mut Random| match random.below(5) {
        0 | 1 => random.pick(&queries),
        2 | 3 => point_of(
            &scene.surfaces[random.below(scene.surfaces.len())].shape,
            random,
        ),
        _ => match random.pick(&scene.lights) {
            OracleLight::Point(position) => position,
            OracleLight::Direction(direction) => {
                let from = random.pick(&queries);
                [0, 1, 2].map(|axis| from[axis] + direction[axis])
            }
        },
    };
    (0..6).map(|_| [point(random), point(random)]).collect()
}

/// Nasty scenes; `ANTUMBRA_ALONG_SEEDS=0..3000` is the long run.
fn seeds(usual: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(given) = std::env::var("ANTUMBRA_ALONG_SEEDS") else {
        return usual;
    };
    let (from, to) = given.split_once("..").expect("FROM..TO");
    from.parse().expect("a number")..to.parse().expect("a number")
}

#[test]
fn nasty_scenes_have_the_oracles_intervals_for_every_method() {
    let mut counts = [0; 4];
    for seed in seeds(0..150) {
        let scene = nasty::scene(seed);
        let random = &mut Random(seed);
        let indices = indices(&scene.surfaces, &scene.lights);
        let oracle = Oracle::new(scene.surfaces.clone());
        for ends in segments(&scene, random) {
            for &light in &scene.lights {
                let expected = rounded(&oracle.lit_intervals_along(ends, light));
                counts[expected.len().min(3)] += 1;
                for index in &indices {
                    let found = ask(index, ends, light);
                    let label =
                        format!("{} {:?} {ends:?} {light:?}", scene.label(), index.method());
                    assert_eq!(found.as_ref(), Ok(&expected), "{label}");
                }
            }
        }
    }
    // The test has power: no, one, two and more intervals occur.
    assert!(counts.iter().all(|&count| count > 30), "{counts:?}");
}

/// `ANTUMBRA_ALONG_STEPS=16384` is the long run.
#[test]
fn a_march_of_exact_queries_agrees_at_every_step() {
    let steps = std::env::var("ANTUMBRA_ALONG_STEPS").ok();
    let steps: u32 = steps.map_or(512, |steps| steps.parse().expect("a number"));
    let (mut asked, mut alone, mut dark) = (0_u64, 0_u64, 0_u64);
    let mut check = |surfaces: &[OracleSurface], cases: &[(Ends, OracleLight)], label: &str| {
        let occluders = common::nasty::occluders(surfaces);
        let index = common::builder_of(&occluders, &[], Method::Bvh)
            .build()
            .unwrap();
        let oracle = Oracle::new(surfaces);
        for &(ends, light) in cases {
            let found = ask(&index, ends, light).unwrap();
            for step in 0..=steps {
                let place = f64::from(step) / f64::from(steps);
                let share = OracleShare::new(place);
                // At a rounded end itself the step may be on either side of the exact one.
                if found.as_flattened().contains(&place) {
                    continue;
                }
                let is_lit = found
                    .iter()
                    .any(|&[begin, end]| begin < place && place < end);
                asked += 1;
                dark += u64::from(!is_lit);
                if oracle.is_blocked_along(ends, &share, light) == is_lit {
                    // A single point, then: right beside it the march agrees.
                    alone += 1;
                    let neighbors = [place.next_down(), place.next_up()];
                    for neighbor in neighbors.into_iter().filter(|x| (0.0..=1.0).contains(x)) {
                        let between = share.between(&OracleShare::new(neighbor));
                        let is_blocked = oracle.is_blocked_along(ends, &between, light);
                        assert_ne!(is_blocked, is_lit, "{label} {ends:?} {light:?} {place}");
                    }
                }
            }
        }
    };
    for fixture in all_fixtures() {
        check(
            &fixture.surfaces,
            &[(fixture.ends, fixture.light)],
            fixture.name,
        );
    }
    for seed in seeds(0..24) {
        let scene = nasty::scene(seed);
        let random = &mut Random(seed);
        let ends = segments(&scene, random);
        let cases: Vec<_> = ends
            .into_iter()
            .map(|ends| (ends, random.pick(&scene.lights)))
            .collect();
        check(&scene.surfaces, &cases, &scene.label());
    }
    assert!(
        asked > 10 * alone && dark > asked / 16,
        "{asked} {alone} {dark}"
    );
}

#[test]
fn batches_have_the_intervals_of_their_segments() {
    let scene = nasty::scene(7);
    let occluders = common::nasty::occluders(&scene.surfaces);
    let index = common::builder_of(&occluders, &[], Method::Auto)
        .build()
        .unwrap();
    let random = &mut Random(7);
    let ends: Vec<Ends> = (0..200).flat_map(|_| segments(&scene, random)).collect();
    let (origins, lasts): (Vec<_>, Vec<_>) = ends.iter().map(|&[a, b]| (a, b)).unzip();
    let light = common::nasty::light(scene.lights[0]);
    let ask_all = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| index.lit_intervals_of_segments(&origins, &lasts, &light))
    };
    let found = ask_all(1).unwrap();
    assert_eq!(Ok(&found), ask_all(3).as_ref());
    assert_eq!(found.ends.len(), ends.len());
    for (number, &ends) in ends.iter().enumerate() {
        assert_eq!(
            Ok(found.of(number)),
            ask(&index, ends, scene.lights[0]).as_deref(),
            "{ends:?}"
        );
    }
    let lasts = &lasts[1..];
    let error = index.lit_intervals_of_segments(&origins, lasts, &light);
    assert_eq!(
        error,
        Err(LitIntervalsError::Length {
            expected: 1200,
            found: 1199
        })
    );
}

/// Solid at the places of a chessboard.
#[derive(Debug)]
struct Sieve;

impl Coverage for Sieve {
    fn is_solid_at(&self, [u, v]: [f64; 2]) -> bool {
        ((8.0 * u).floor() + (8.0 * v).floor()) % 2.0 == 0.0
    }
}

#[test]
fn what_has_no_answer_is_refused_by_name() {
    let mut builder = Occluders::builder();
    let plate = |from: f64, to: f64, z: f64| {
        [(from, -1.0), (to, -1.0), (to, 1.0), (from, 1.0)].map(|(x, y)| DVec3::new(x, y, z))
    };
    common::add_face(&mut builder, &plate(-1.0, 1.0, 1.0));
    let coverage = builder.add_coverage(std::sync::Arc::new(Sieve));
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (from, to) in [(-0.5, 0.5), (4.5, 5.5), (6.5, 7.5)] {
        builder
            .add_alpha_tested_face(&plate(from, to, 2.0), &uvs, coverage)
            .unwrap();
    }
    let occluders = std::sync::Arc::new(builder.build());
    let sun = LightShape::Direction(DVec3::Z);
    for method in METHODS {
        let index = common::builder_of(&occluders, &[], method).build().unwrap();
        let along = |from: f64, to: f64| {
            index.lit_intervals_along(DVec3::new(from, 0.0, 0.0), DVec3::new(to, 0.0, 0.0), &sun)
        };
        // The first sieve is above the plate's shadow, which is all there is to it.
        assert_eq!(along(-0.75, 0.75), Ok(vec![]));
        assert_eq!(along(1.0, 4.0), Ok(vec![[0.0, 1.0]]));
        let Err(LitIntervalsError::NoClosedForm {
            segment: 0,
            surface,
        }) = along(2.0, 8.0)
        else {
            panic!("a sieve is in the way");
        };
        assert_eq!(surface.0, 4);
        let bad = DVec3::new(0.0, f64::NAN, 0.0);
        let refused = index
            .lit_intervals_along(DVec3::ZERO, bad, &sun)
            .unwrap_err();
        assert!(refused.to_string().starts_with("end 0 is"), "{refused}");
        let refused = index
            .lit_intervals_along(DVec3::X * 1e31, DVec3::ZERO, &sun)
            .unwrap_err();
        assert!(refused.to_string().starts_with("origin 0 is"), "{refused}");
        for light in [
            LightShape::Direction(DVec3::ZERO),
            LightShape::Point(bad),
            LightShape::Direction(bad),
        ] {
            let refused = index.lit_intervals_along(DVec3::ZERO, DVec3::X, &light);
            assert!(
                matches!(refused, Err(LitIntervalsError::BadLight(_))),
                "{refused:?}"
            );
        }
    }
}
