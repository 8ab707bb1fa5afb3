//! Patches and implicit surfaces: all methods answer as every triangle and every sample does.

mod common;

use std::sync::Arc;

use antumbra::{Counters, LightId, Method, Ray, ShadowIndex};
use antumbra_geometry::{
    Ball, BezierPatch, DVec3, Field, Implicit, LightShape, Occluders, Opacity, ReceiverPoint,
    Sphere, SurfaceId, Term,
};
use antumbra_testkit::freeform::{TestField, TestImplicit, patch_triangles};
use antumbra_testkit::oracle::{Oracle, OracleLight, OracleShape, OracleSurface};
use common::{METHODS, Random, is_shadowed};

/// A patch in the library and the numbers of its triangles in the oracle.
struct Patch {
    triangles: std::ops::Range<usize>,
    parts: std::ops::Range<u32>,
}

struct Scene {
    occluders: Arc<Occluders>,
    oracle: Oracle,
    /// What both number alike.
    flat_count: usize,
    patches: Vec<Patch>,
    implicits: Vec<(SurfaceId, TestImplicit)>,
}

/// A number of a kind that has many ties, or of one that has none.
fn number(random: &mut Random, is_lattice: bool) -> f64 {
    let real = random.real(-1.0, 1.0);
    if is_lattice {
        (real * 3.0).round() * 0.5
    } else {
        real * 1.5
    }
}

fn point(random: &mut Random, is_lattice: bool) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| number(random, is_lattice)))
}

fn patch(random: &mut Random, is_lattice: bool) -> BezierPatch {
    let (origin, height) = (point(random, is_lattice), random.real(0.0, 1.5));
    let kind = random.below(5);
    let control = std::array::from_fn(|j| {
        std::array::from_fn(|i| {
            let lifted = height * number(random, is_lattice);
            let flat = DVec3::new(i as f64 - 1.5, j as f64 - 1.5, 0.0) * 0.75;
            match kind {
                // Anything at all.
                0 => point(random, is_lattice),
                // A side of one point.
                1 if j == 0 => origin,
                // Flat.
                2 => origin + flat,
                _ => origin + flat + DVec3::Z * lifted,
            }
        })
    });
    BezierPatch {
        control,
        level: random.below(5) as u32,
    }
}

fn implicit(random: &mut Random, is_lattice: bool) -> Implicit {
    let center = point(random, is_lattice);
    let low = center - DVec3::splat(random.real(0.5, 1.2));
    let high = center + DVec3::splat(random.real(0.5, 1.2));
    let field = match random.below(5) {
        0 | 1 => {
            let axis = match random.below(2) {
                0 => DVec3::Z,
                _ => random.in_cube() + DVec3::splat(1e-3),
            };
            let (major, minor) = (random.real(0.3, 0.9), random.real(0.05, 0.5));
            return Implicit::torus(center, axis, major, minor);
        }
        2 => {
            let balls = (0..1 + random.below(4)).map(|_| Ball {
                center: center + random.in_cube() * 0.5,
                radius: random.real(0.3, 0.8),
                strength: random.real(0.5, 2.0),
            });
            Field::Metaballs {
                balls: balls.collect(),
                threshold: random.real(0.1, 0.6),
            }
        }
        3 => Field::Gyroid {
            center,
            period: random.real(0.5, 2.0),
            level: random.real(-0.5, 0.5),
        },
        _ => {
            // A quartic that is positive far out, bent by some terms of lower degree.
            let mut terms: Vec<Term> = [[4, 0, 0], [0, 4, 0], [0, 0, 4]]
                .map(|exponents| Term {
                    factor: 1.0,
                    exponents,
                })
                .to_vec();
            for exponents in [[1, 1, 0], [0, 2, 1], [2, 0, 0], [0, 0, 0], [3, 0, 0]] {
                let factor = random.real(-0.5, 0.3);
                terms.push(Term { factor, exponents });
            }
            Field::Polynomial {
                center,
                unit: random.real(0.4, 1.0),
                terms,
            }
        }
    };
    Implicit { field, low, high }
}

fn tested(implicit: &Implicit) -> TestImplicit {
    let field = match &implicit.field {
        Field::Torus {
            center,
            axis,
            major,
            minor,
        } => TestField::Torus(center.to_array(), axis.to_array(), *major, *minor),
        Field::Metaballs { balls, threshold } => {
            let balls = balls
                .iter()
                .map(|ball| (ball.center.to_array(), ball.radius, ball.strength));
            TestField::Metaballs(balls.collect(), *threshold)
        }
        Field::Gyroid {
            center,
            period,
            level,
        } => TestField::Gyroid(center.to_array(), *period, *level),
        Field::Polynomial {
            center,
            unit,
            terms,
        } => {
            let terms = terms.iter().map(|term| (term.factor, term.exponents));
            TestField::Polynomial(center.to_array(), *unit, terms.collect())
        }
    };
    TestImplicit {
        field,
        low: implicit.low.to_array(),
        high: implicit.high.to_array(),
    }
}

fn scene(seed: u64) -> Scene {
    let random = &mut Random(seed);
    let is_lattice = seed.is_multiple_of(2);
    let mut builder = Occluders::builder();
    let mut surfaces = Vec::new();
    for _ in 0..4 {
        let corners = [0; 3].map(|_| point(random, is_lattice));
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
        surfaces.push(OracleSurface::triangle(corners.map(|x| x.to_array())));
    }
    let sphere = Sphere {
        center: point(random, is_lattice),
        radius: 0.25,
    };
    builder
        .add_sphere(sphere, Opacity::Opaque)
        .expect("a sphere");
    surfaces.push(OracleSurface::sphere(
        sphere.center.to_array(),
        sphere.radius,
    ));
    let flat_count = surfaces.len();
    let (mut patch_elements, mut implicit_elements) = (Vec::new(), Vec::new());
    for _ in 0..1 + random.below(2) {
        let patch = patch(random, is_lattice);
        let first = surfaces.len();
        let control = patch.control.map(|row| row.map(|x| x.to_array()));
        let triangles = patch_triangles(&control, patch.level).into_iter();
        surfaces.extend(triangles.map(OracleSurface::triangle));
        let element = builder.add_patch(&patch, Opacity::Opaque).expect("a patch");
        patch_elements.push((element, first..surfaces.len()));
    }
    for _ in 0..1 + random.below(2) {
        let implicit = implicit(random, is_lattice);
        let element = builder
            .add_implicit(&implicit, Opacity::Opaque)
            .expect("an implicit surface");
        implicit_elements.push((element, tested(&implicit)));
    }
    let occluders = Arc::new(builder.build());
    let surfaces_of = |element| {
        let mut all = occluders.surfaces_of(element).map(|surface| surface.0);
        let first = all.next().expect("a surface");
        first..all.last().unwrap_or(first) + 1
    };
    let patches = patch_elements
        .into_iter()
        .map(|(element, triangles)| Patch {
            triangles,
            parts: surfaces_of(element),
        });
    let implicits = implicit_elements
        .into_iter()
        .map(|(element, test)| (SurfaceId(surfaces_of(element).start), test));
    Scene {
        patches: patches.collect(),
        implicits: implicits.collect(),
        oracle: Oracle::new(surfaces),
        flat_count,
        occluders: Arc::clone(&occluders),
    }
}

/// A start, and what it is on in the oracle.
struct Start {
    start: ReceiverPoint,
    own: Option<usize>,
    on_implicit: bool,
}

impl Scene {
    fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        match self.oracle.surfaces()[triangle].shape {
            OracleShape::Triangle(corners) => corners,
            ref other => unreachable!("{other:?}"),
        }
    }

    fn free(point: DVec3) -> Start {
        Start {
            start: ReceiverPoint {
                point,
                surface: None,
            },
            own: None,
            on_implicit: false,
        }
    }

    /// A start on a triangle, on a triangle of a patch, on an implicit surface, or in space. `None` where it is not
    /// clear which triangle it is on.
    fn start(&self, random: &mut Random, is_lattice: bool) -> Option<Start> {
        let kind = random.below(5);
        let of_triangle = |random: &mut Random, number: usize| {
            let corners = self.corners(number);
            let [a, b, c] = corners.map(DVec3::from_array);
            let (v, w) = (random.real(0.1, 0.4), random.real(0.1, 0.4));
            a + (b - a) * v + (c - a) * w
        };
        match kind {
            0 => Some(Self::free(point(random, is_lattice))),
            1 => {
                let own = random.below(4);
                let point = of_triangle(random, own);
                let surface = Some(SurfaceId(own as u32));
                Some(Start {
                    start: ReceiverPoint { point, surface },
                    own: Some(own),
                    on_implicit: false,
                })
            }
            2 | 3 => {
                let patch = &self.patches[random.below(self.patches.len())];
                let own = patch.triangles.start + random.below(patch.triangles.len());
                let mut point = of_triangle(random, own);
                if random.below(3) == 0 {
                    point = point.as_vec3().as_dvec3();
                }
                let at_least = |range: std::ops::Range<u32>| {
                    let parts = range.map(SurfaceId);
                    parts.min_by(|&one, &other| {
                        let distance = |part| self.occluders.distance(part, point).unwrap();
                        distance(one).total_cmp(&distance(other))
                    })
                };
                // Points near several triangles are on either.
                let near = |number: &usize| {
                    let lone = &mut Occluders::builder();
                    let corners = self.corners(*number);
                    let corners = corners.map(DVec3::from_array);
                    lone.add_face(&corners, Opacity::Opaque).unwrap();
                    let lone = std::mem::take(lone).build();
                    lone.surface_count() == 1
                        && lone
                            .distance(SurfaceId(0), point)
                            .is_none_or(|distance| distance < 1e-5)
                };
                if patch.triangles.clone().filter(near).count() != 1 {
                    return None;
                }
                Some(Start {
                    start: ReceiverPoint {
                        point,
                        surface: at_least(patch.parts.clone()),
                    },
                    own: Some(own),
                    on_implicit: false,
                })
            }
            _ => {
                let &(surface, _) = &self.implicits[random.below(self.implicits.len())];
                let bounds = self.occluders.surface_bounds(surface);
                let target = bounds.min + bounds.size() * random.in_unit_cube();
                let origin = point(random, false) * 2.0;
                let ray = Ray {
                    origin,
                    direction: target - origin,
                    leaves: None,
                };
                let segment = self.occluders.ray_segment(&ray);
                if !self.occluders.crosses(surface, &segment) {
                    return None;
                }
                let mut point = self.occluders.hit(surface, &segment).point;
                if random.below(3) == 0 {
                    point = point.as_vec3().as_dvec3();
                }
                Some(Start {
                    start: ReceiverPoint {
                        point,
                        surface: Some(surface),
                    },
                    own: None,
                    on_implicit: true,
                })
            }
        }
    }

    fn is_blocked(&self, asked: &Start, light: &LightShape) -> bool {
        let oracle_light = match *light {
            LightShape::Point(place) => OracleLight::Point(place.to_array()),
            LightShape::Direction(direction) => OracleLight::Direction(direction.to_array()),
        };
        let start = asked.start.point.to_array();
        if self.oracle.is_blocked(start, asked.own, oracle_light) {
            return true;
        }
        let segment = self.occluders.segment(&asked.start, light);
        let (origin, direction) = (segment.origin(), segment.direction());
        self.implicits.iter().any(|(surface, implicit)| {
            let is_own = asked.on_implicit && asked.start.surface == Some(*surface);
            let side = || f64::from(self.occluders.light_side(&asked.start, light));
            implicit.is_blocked(
                origin.to_array(),
                direction.to_array(),
                segment.is_finite(),
                is_own.then(side),
            )
        })
    }

    /// Lights that make ties: through a vertex of a patch or past the outline of an implicit surface; and any.
    fn light(&self, random: &mut Random, start: DVec3, is_lattice: bool) -> LightShape {
        let place = match random.below(4) {
            0 => {
                let patch = &self.patches[random.below(self.patches.len())];
                let number = patch.triangles.start + random.below(patch.triangles.len());
                let corners = self.corners(number);
                let through = DVec3::from_array(corners[random.below(3)]);
                start + (through - start) * random.pick(&[1.0, 2.0, 4.0])
            }
            1 => {
                // Where the surface is seen from its edge.
                let &(surface, _) = &self.implicits[random.below(self.implicits.len())];
                let mut place = point(random, false);
                for _ in 0..40 {
                    let normal = self.occluders.normal_at(surface, place);
                    let towards = (place - start).normalize_or_zero();
                    let on = self.occluders.start_on(surface, place).point;
                    place = on - normal * towards.dot(normal) * 0.05;
                    if !place.is_finite() || place.abs().max_element() > 10.0 {
                        place = point(random, false);
                    }
                }
                start + (place - start) * 2.0
            }
            _ => point(random, is_lattice) * 2.0,
        };
        let direction = place - start;
        if random.below(3) == 0 && direction != DVec3::ZERO {
            LightShape::Direction(direction)
        } else {
            LightShape::Point(place)
        }
    }
}

/// `ANTUMBRA_FREEFORM_SEEDS=0..3000` is the long run.
fn seeds(usual: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(given) = std::env::var("ANTUMBRA_FREEFORM_SEEDS") else {
        return usual;
    };
    let (from, to) = given.split_once("..").expect("FROM..TO");
    from.parse().expect("a number")..to.parse().expect("a number")
}

#[test]
fn every_method_answers_as_every_triangle_and_every_sample() {
    let mut counts = [[0; 2]; 3];
    for seed in seeds(0..10) {
        let scene = scene(seed);
        let random = &mut Random(seed ^ 0xf3ee);
        let is_lattice = seed.is_multiple_of(2);
        let mut asked = Vec::new();
        let mut lights = Vec::new();
        for _ in 0..4 {
            let at = point(random, is_lattice);
            lights.push(scene.light(random, at, is_lattice));
        }
        while asked.len() < 60 {
            if let Some(start) = scene.start(random, is_lattice) {
                // Some lights are odd for one of the starts.
                if lights.len() < 10 {
                    lights.push(scene.light(random, start.start.point, is_lattice));
                }
                asked.push(start);
            }
        }
        let build = |method| {
            common::builder_of(&scene.occluders, &lights, method)
                .build()
                .unwrap()
        };
        let indices: [ShadowIndex; 6] = METHODS.map(build);
        for start in &asked {
            let kind = if start.on_implicit {
                2
            } else {
                usize::from(start.own.is_some_and(|own| own >= scene.flat_count))
            };
            for (number, light) in lights.iter().enumerate() {
                let expected = scene.is_blocked(start, light);
                counts[kind][usize::from(expected)] += 1;
                for index in &indices {
                    let found = is_shadowed(index, &start.start, number);
                    let label = || {
                        let segment = scene.occluders.segment(&start.start, light);
                        let surfaces = scene.occluders.surfaces();
                        let blockers =
                            surfaces.filter(|&surface| scene.occluders.blocks(surface, &segment));
                        let blockers: Vec<SurfaceId> = blockers.collect();
                        let (method, start) = (index.method(), &start.start);
                        format!("{seed} {method:?} {start:?} {light:?}: {blockers:?}")
                    };
                    assert_eq!(found, expected, "{}", label());
                }
            }
        }
    }
    // The test has power: each kind of start is in light and in shadow.
    let is_enough = |count: &usize| *count > 30;
    assert!(counts.as_flattened().iter().all(is_enough), "{counts:?}");
}

#[test]
fn nearest_hits_are_those_of_all_triangles() {
    let mut hits = 0;
    for seed in 0..12 {
        let scene = scene(seed);
        let random = &mut Random(seed ^ 0x417);
        let [first, second] = [Method::Naive, Method::Auto].map(|method| {
            common::builder_of(&scene.occluders, &common::lamps(), method)
                .build()
                .unwrap()
        });
        for _ in 0..200 {
            let origin = random.in_cube() * 3.0;
            let ray = Ray {
                origin,
                direction: random.in_cube() - origin,
                leaves: None,
            };
            let [one, other] =
                [&first, &second].map(|index| index.nearest(&ray, &mut Counters::default()));
            assert_eq!(one, other, "{seed} {ray:?}");
            let Some(hit) = one else { continue };
            hits += 1;
            // Nothing is in the way up to a little before, and something a little beyond.
            let free = Scene::free(ray.origin);
            for (share, is_blocked) in [(0.9997, false), (1.0003, true)] {
                let end = ray.origin + ray.direction * (hit.distance * share);
                let found = scene.is_blocked(&free, &LightShape::Point(end));
                assert_eq!(found, is_blocked, "{seed} {ray:?} {hit:?}");
            }
            let normal = scene.occluders.normal_at(hit.surface, hit.point);
            assert!((normal.length() - 1.0).abs() < 1e-9, "{seed} {ray:?}");
        }
    }
    assert!(hits > 500, "{hits}");
}

#[test]
fn values_of_the_first_method_know_what_is_behind_a_solid_field() {
    let mut builder = Occluders::builder();
    let ball = Ball {
        center: DVec3::ZERO,
        radius: 1.0,
        strength: 4.0,
    };
    let field = Field::Metaballs {
        balls: vec![ball],
        threshold: 0.5,
    };
    let (low, high) = (DVec3::splat(-1.1), DVec3::splat(1.1));
    let implicit = Implicit { field, low, high };
    builder
        .add_implicit(&implicit, Opacity::Opaque)
        .expect("a ball");
    let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    let floor = floor.map(|(x, y)| DVec3::new(x, y, -2.0));
    builder.add_face(&floor, Opacity::Opaque).expect("a floor");
    let occluders = Arc::new(builder.build());
    let lights = vec![LightShape::Direction(DVec3::new(0.1, 0.2, 1.0))];
    let index = ShadowIndex::builder(occluders, lights)
        .method(Method::Voxel1990)
        .grid(antumbra::GridResolution::Fixed([64; 3]))
        .build()
        .expect("an index");
    let mut known = 0;
    for number in 0..100 {
        let start = ReceiverPoint {
            point: DVec3::new(
                f64::from(number % 10) * 0.05 - 0.25,
                f64::from(number / 10) * 0.05 - 0.4,
                -2.0,
            ),
            surface: Some(SurfaceId(0)),
        };
        let answer = index.shadow(&start, LightId::from_index(0), &mut Counters::default());
        let answer = answer.expect("a fine query");
        if answer.decided == antumbra::Decided::FirstPass {
            known += 1;
            assert_eq!(answer.shadow, antumbra::Shadow::Shadowed);
        }
    }
    assert!(known > 20, "{known}");
}

#[test]
fn starts_very_far_away_are_answered_and_look_at_few_triangles() {
    let control = std::array::from_fn(|j| {
        std::array::from_fn(|i| DVec3::new(i as f64, j as f64, ((i * j) % 3) as f64 * 0.5))
    });
    let mut builder = Occluders::builder();
    // Level 12 has 33 million triangles: a search that entered all of them would not end here.
    for level in [4, 12] {
        let patch = BezierPatch { control, level };
        builder.add_patch(&patch, Opacity::Opaque).expect("a patch");
    }
    let occluders = builder.build();
    let triangles = patch_triangles(&control.map(|row| row.map(|x: DVec3| x.to_array())), 4);
    let oracle = Oracle::new(
        triangles
            .into_iter()
            .map(OracleSurface::triangle)
            .collect::<Vec<_>>(),
    );
    let half = occluders.surface_count() / 2;
    let mut counts = [0; 2];
    for number in 0..60 {
        let target = DVec3::new(f64::from(number % 10), f64::from(number / 10), 0.5) * 0.5;
        let direction = DVec3::new(0.25, -0.125, -1.0);
        let far = 2.0_f64.powi([20, 50, 80][number as usize % 3]);
        let point = target - direction * far;
        let start = ReceiverPoint {
            point,
            surface: None,
        };
        for light in [
            LightShape::Direction(direction),
            LightShape::Point(target + direction * 8.0),
        ] {
            let oracle_light = match light {
                LightShape::Point(place) => OracleLight::Point(place.to_array()),
                LightShape::Direction(direction) => OracleLight::Direction(direction.to_array()),
            };
            let segment = occluders.segment(&start, &light);
            let mut parts = occluders.surfaces();
            let coarse = parts
                .by_ref()
                .take(half)
                .any(|part| occluders.blocks(part, &segment));
            let expected = oracle.is_blocked(point.to_array(), None, oracle_light);
            assert_eq!(coarse, expected, "{number} {light:?}");
            counts[usize::from(expected)] += 1;
            // The fine patch is asked for an answer, whatever it is.
            let _ = parts
                .filter(|&part| occluders.blocks(part, &segment))
                .count();
        }
    }
    assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
}
