//! Lit intervals along segments: the oracle's, whatever the method, and those that a march finds step by step.

mod common;

use antumbra::{DVec3, LightShape, LitIntervalsError, Method, ShadowIndex};
use antumbra_geometry::{Occluders, Opacity, Sphere};
use antumbra_testkit::fixtures;
use antumbra_testkit::nasty::{self, NastyScene};
use antumbra_testkit::oracle::{Oracle, OracleLight, OracleShape, OracleShare, OracleSurface};
use common::{METHODS, Random};

type Ends = [[f64; 3]; 2];

fn indices(surfaces: &[OracleSurface]) -> Vec<ShadowIndex> {
    let occluders = common::nasty::occluders(surfaces);
    let build = |method| common::builder_of(&occluders, &[], method).build().unwrap();
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

fn rounded(intervals: &[[OracleShare; 2]]) -> Vec<[f64; 2]> {
    let rounded = intervals.iter();
    rounded
        .map(|interval| interval.each_ref().map(OracleShare::nearest))
        .collect()
}

#[test]
fn fixtures_have_the_intervals_that_geometry_gives() {
    for fixture in fixtures::along() {
        for index in indices(&fixture.surfaces) {
            let found = ask(&index, fixture.ends, fixture.light);
            let label = format!("{} {:?}", fixture.name, index.method());
            assert_eq!(found, Ok(fixture.expected.clone()), "{label}");
        }
    }
}

/// Scenes of triangles alone: others are left out.
fn triangles(scene: &NastyScene) -> Vec<OracleSurface> {
    let surfaces = scene.surfaces.iter().copied();
    surfaces
        .filter(|surface| matches!(surface.shape, OracleShape::Triangle(_)))
        .collect()
}

/// Segments between points of a scene: on surfaces, at corners, in planes, at lights, along edges.
fn segments(scene: &NastyScene, surfaces: &[OracleSurface], random: &mut Random) -> Vec<Ends> {
    let queries: Vec<[f64; 3]> = scene.queries.iter().map(|query| query.point).collect();
    let point = |random: &mut Random| {
        let corners = match surfaces[random.below(surfaces.len())].shape {
            OracleShape::Triangle(corners) => corners,
            _ => unreachable!("triangles alone"),
        };
        match random.below(5) {
            0 | 1 => random.pick(&queries),
            2 => corners[random.below(3)],
            3 => {
                let [a, b, c] = corners;
                [0, 1, 2].map(|axis| a[axis] + b[axis] - c[axis])
            }
            _ => match random.pick(&scene.lights) {
                OracleLight::Point(position) => position,
                OracleLight::Direction(direction) => {
                    let from = random.pick(&queries);
                    [0, 1, 2].map(|axis| from[axis] + direction[axis])
                }
            },
        }
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
        let surfaces = triangles(&scene);
        if surfaces.is_empty() {
            continue;
        }
        let random = &mut Random(seed);
        let indices = indices(&surfaces);
        let oracle = Oracle::new(surfaces.clone());
        for ends in segments(&scene, &surfaces, random) {
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
    for fixture in fixtures::along() {
        check(
            &fixture.surfaces,
            &[(fixture.ends, fixture.light)],
            fixture.name,
        );
    }
    for seed in seeds(0..24) {
        let scene = nasty::scene(seed);
        let surfaces = triangles(&scene);
        if surfaces.is_empty() {
            continue;
        }
        let random = &mut Random(seed);
        let ends = segments(&scene, &surfaces, random);
        let cases: Vec<_> = ends
            .into_iter()
            .map(|ends| (ends, random.pick(&scene.lights)))
            .collect();
        check(&surfaces, &cases, &scene.label());
    }
    assert!(
        asked > 10 * alone && dark > asked / 16,
        "{asked} {alone} {dark}"
    );
}

#[test]
fn batches_have_the_intervals_of_their_segments() {
    let scene = nasty::scene(5);
    let surfaces = triangles(&scene);
    let occluders = common::nasty::occluders(&surfaces);
    let index = common::builder_of(&occluders, &[], Method::Auto)
        .build()
        .unwrap();
    let random = &mut Random(7);
    let ends: Vec<Ends> = (0..200)
        .flat_map(|_| segments(&scene, &surfaces, random))
        .collect();
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

#[test]
fn what_has_no_answer_is_refused_by_name() {
    let mut builder = Occluders::builder();
    common::add_face(
        &mut builder,
        &[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 1.0)),
    );
    let ball = |x: f64| Sphere {
        center: DVec3::new(x, 0.0, 2.0),
        radius: 0.5,
    };
    builder.add_sphere(ball(0.0), Opacity::Opaque).unwrap();
    builder.add_sphere(ball(5.0), Opacity::Opaque).unwrap();
    builder.add_sphere(ball(7.0), Opacity::Transparent).unwrap();
    let occluders = std::sync::Arc::new(builder.build());
    let sun = LightShape::Direction(DVec3::Z);
    for method in METHODS {
        let index = common::builder_of(&occluders, &[], method).build().unwrap();
        let along = |from: f64, to: f64| {
            index.lit_intervals_along(DVec3::new(from, 0.0, 0.0), DVec3::new(to, 0.0, 0.0), &sun)
        };
        // The first ball is above the plate's shadow, which is all there is to it; glass shades nothing.
        assert_eq!(along(-0.75, 0.75), Ok(vec![]));
        assert_eq!(along(6.0, 8.0), Ok(vec![[0.0, 1.0]]));
        let Err(LitIntervalsError::NoClosedForm {
            segment: 0,
            surface,
        }) = along(2.0, 8.0)
        else {
            panic!("a ball is in the way");
        };
        assert_eq!(surface.0, 3);
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
