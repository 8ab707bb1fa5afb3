//! The rivals against the reference: all fixtures, and generated nasty scenes.
//!
//! The reference is compared with the oracle in `antumbra`'s own tests. `ANTUMBRA_NASTY_SEEDS=from..to` asks
//! other scenes.

use std::sync::Arc;

use antumbra::{GridResolution, LightId, Method, ShadowIndex};
use antumbra_baselines::rival::ShadowVolumes;
use antumbra_baselines::{RivalError, RivalKind, RivalOptions, Work};
use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId,
};
use antumbra_testkit::oracle::{OracleLight, OracleShape, OracleSurface};
use antumbra_testkit::{fixtures, nasty};

/// Builds the library's surfaces with the same numbers as the oracle's.
fn occluders(surfaces: &[OracleSurface]) -> Arc<Occluders> {
    let v = DVec3::from_array;
    let mut builder = Occluders::builder();
    for (i, surface) in surfaces.iter().enumerate() {
        let opacity = if surface.opaque {
            Opacity::Opaque
        } else {
            Opacity::Transparent
        };
        let added = match surface.shape {
            OracleShape::Triangle(corners) => builder.add_face(&corners.map(v), opacity),
            OracleShape::Sphere { center, radius } => {
                let center = v(center);
                builder.add_sphere(Sphere { center, radius }, opacity)
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let next = surfaces.get(i + 1).map(|next| next.shape);
                let cone = Cone {
                    base: v(base),
                    base_radius,
                    apex: v(apex),
                    apex_radius,
                    is_closed: matches!(next, Some(OracleShape::Cap { .. })),
                };
                builder.add_cone(cone, opacity)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let (center, normal) = (v(center), v(normal));
                let disk = Disk {
                    center,
                    normal,
                    radius,
                };
                builder.add_disk(disk, opacity)
            }
            // Added with its tube.
            OracleShape::Cap { .. } => continue,
        };
        added.expect("numbers are in range");
    }
    Arc::new(builder.build())
}

/// A scene and what is asked in it.
struct Questions {
    label: String,
    occluders: Arc<Occluders>,
    lights: Vec<LightShape>,
    /// Starts, each with a light.
    queries: Vec<(ReceiverPoint, usize)>,
}

impl Questions {
    fn new(label: String, surfaces: &[OracleSurface], lights: &[OracleLight]) -> Self {
        let lights = lights.iter().map(|light| match *light {
            OracleLight::Point(position) => LightShape::Point(DVec3::from_array(position)),
            OracleLight::Direction(to) => LightShape::Direction(DVec3::from_array(to)),
        });
        Self {
            label,
            occluders: occluders(surfaces),
            lights: lights.collect(),
            queries: Vec::new(),
        }
    }

    fn ask(&mut self, point: [f64; 3], surface: Option<usize>, light: usize) {
        let start = ReceiverPoint {
            point: DVec3::from_array(point),
            surface: surface.map(|surface| SurfaceId(surface as u32)),
        };
        self.queries.push((start, light));
    }

    fn of_fixtures() -> Vec<Self> {
        let all = fixtures::all().into_iter().map(|fixture| {
            let mut questions =
                Self::new(fixture.name.to_owned(), &fixture.surfaces, &fixture.lights);
            for query in &fixture.queries {
                questions.ask(query.point, query.surface, query.light);
            }
            questions
        });
        all.collect()
    }

    fn of_nasty(seed: u64) -> Self {
        let scene = nasty::scene(seed);
        let mut questions = Self::new(scene.label(), &scene.surfaces, &scene.lights);
        for query in &scene.queries {
            for light in 0..scene.lights.len() {
                questions.ask(query.point, query.surface, light);
            }
        }
        questions
    }

    fn index(&self, grid: [u32; 3]) -> ShadowIndex {
        ShadowIndex::builder(Arc::clone(&self.occluders), self.lights.clone())
            .method(Method::Grid)
            .grid(GridResolution::Fixed(grid))
            .build()
            .expect("settings are in range")
    }

    /// Asks one rival everything; returns its wrong answers, for people, and what it did.
    fn wrong(
        &self,
        kind: RivalKind,
        grid: [u32; 3],
        options: &RivalOptions,
    ) -> (Vec<String>, Work) {
        let index = self.index(grid);
        let rival = kind.build(&index, options).expect("enough memory");
        let (mut wrong, mut work) = (Vec::new(), Work::default());
        for &(start, light) in &self.queries {
            let truth = index.shadow_by_reference(&start, LightId::from_index(light));
            let answer = rival.shadow(&index, &start, light, &mut work);
            let found = answer.map(|answer| answer.shadow);
            if found != truth {
                wrong.push(format!(
                    "{}: {} on {grid:?} with {options:?} says {answer:?}, the reference {truth:?}: {start:?} {:?}",
                    self.label,
                    kind.name(),
                    self.lights[light]
                ));
            }
        }
        let shadow = work.counters.shadow;
        let decided = shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays;
        assert_eq!(decided, self.queries.len() as u64, "all are counted");
        (wrong, work)
    }
}

/// Coarse, fine, and seen from somewhere.
fn settings() -> [([u32; 3], RivalOptions); 3] {
    let options = |buffer_resolution, most_polygons, viewpoint| RivalOptions {
        most_polygons,
        buffer_resolution: Some(buffer_resolution),
        viewpoint,
        map_resolution: 64,
        ..RivalOptions::default()
    };
    [
        ([1; 3], options(1, None, None)),
        ([5, 3, 4], options(8, Some(u64::MAX), None)),
        (
            [11, 7, 13],
            options(64, Some(u64::MAX), Some(DVec3::new(3.3, 2.1, 1.7))),
        ),
    ]
}

/// Asks the exact rivals; returns how many decided without a shadow ray.
fn check(all: impl Iterator<Item = Questions>) {
    let exact = RivalKind::ALL.into_iter().filter(|kind| kind.is_exact());
    let exact: Vec<_> = exact.collect();
    let (mut known, mut asked) = (vec![0; exact.len()], 0);
    for questions in all {
        asked += settings().len() as u64 * questions.queries.len() as u64;
        for (number, &kind) in exact.iter().enumerate() {
            for (grid, options) in settings() {
                let (wrong, work) = questions.wrong(kind, grid, &options);
                assert!(wrong.is_empty(), "{}", wrong.join("\n"));
                let shadow = work.counters.shadow;
                known[number] += shadow.first_pass + shadow.blocker_list;
            }
        }
    }
    // A rival that leaves everything to shadow rays would be exact and no rival. Many of these starts lie where
    // everything is in doubt.
    for (kind, known) in exact.iter().zip(known) {
        let name = kind.name();
        assert!(
            40 * known > asked,
            "{name} decides {known} of {asked} by itself"
        );
    }
}

#[test]
fn exact_rivals_answer_all_fixtures_as_the_reference_does() {
    check(Questions::of_fixtures().into_iter());
}

#[test]
fn exact_rivals_answer_nasty_scenes_as_the_reference_does() {
    let seeds = match std::env::var("ANTUMBRA_NASTY_SEEDS") {
        Ok(text) => {
            let (from, to) = text.split_once("..").expect("from..to");
            from.parse().expect("a number")..to.parse().expect("a number")
        }
        Err(_) => 0..240,
    };
    check(seeds.map(Questions::of_nasty));
}

/// Not only whether there is one.
#[test]
fn shadow_volumes_are_counted_right() {
    let (mut most, mut asked) = (0, 0);
    for questions in Questions::of_fixtures()
        .into_iter()
        .chain((0..60).map(Questions::of_nasty))
    {
        let index = questions.index([1; 3]);
        let volumes = ShadowVolumes::new(&index, &RivalOptions::default()).unwrap();
        for (start, light) in &questions.queries {
            let occluders = index.occluders();
            let segment = occluders.segment(start, &index.lights()[*light]);
            if occluders.own_rule_blocks(&segment) {
                continue;
            }
            let blocking = occluders
                .surfaces()
                .filter(|&surface| occluders.blocks(surface, &segment));
            let expected = blocking.count() as u64;
            let found = volumes.volumes_holding(&index, start, *light);
            assert_eq!(found, Ok(expected), "{}: {start:?}", questions.label);
            most = most.max(expected);
            asked += 1;
        }
    }
    assert!(most > 3 && asked > 1000, "{most} in {asked}");
}

/// An inexact rival says so, and is wrong somewhere: a test that compares it with the reference can fail.
#[test]
fn shadow_maps_are_wrong_in_some_places_and_right_in_most() {
    let (mut asked, mut wrong, mut worst) = (0, 0, 0.0_f64);
    for questions in Questions::of_fixtures() {
        let (grid, options) = settings()[2];
        let (of_fixture, _) = questions.wrong(RivalKind::ShadowMap, grid, &options);
        let count = questions.queries.len();
        worst = worst.max(of_fixture.len() as f64 / count as f64);
        asked += count;
        wrong += of_fixture.len();
    }
    assert!(!RivalKind::ShadowMap.is_exact());
    assert!(worst > 0.0 && worst <= 1.0, "{worst}");
    assert!(0 < wrong && 2 * wrong < asked, "{wrong} of {asked}");
}

#[test]
fn memory_beyond_the_limit_is_refused() {
    let questions = Questions::of_nasty(3);
    let index = questions.index([8; 3]);
    for kind in RivalKind::ALL {
        let rival = kind.build(&index, &RivalOptions::default()).unwrap();
        let lights = 0..questions.lights.len();
        let bytes: u64 = lights.map(|light| rival.bytes(light)).sum();
        assert!(bytes > 0, "{}", kind.name());
        let options = RivalOptions {
            memory_limit: bytes / 2,
            ..RivalOptions::default()
        };
        let refused = kind.build(&index, &options).map(|rival| rival.kind());
        let limit = options.memory_limit;
        assert_eq!(refused, Err(RivalError::Memory { kind, limit }));
    }
}
