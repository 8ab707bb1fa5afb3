//! The exact visible fraction: what samples converge to, whatever the method and the scene.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchKind, Counters, FractionBy, LightSamples, LightSampling, Method, ReceiverSide,
    SegmentLight, ShadowIndex, VisibleFraction,
};
use antumbra_geometry::{
    AreaShape, DVec3, DiskLight, LightShape, MeshLight, Occluders, Opacity, PolygonLight,
    ReceiverPoint, RectangleLight, SunDisc, SurfaceId, TriangleLight,
};
use common::{METHODS, Random};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// How the numbers of a scene are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Numbers {
    /// Any: nothing touches anything.
    Real,
    /// Small integers: shared edges, faces in one plane or twice the same, edge-on faces, points on edges and in the
    /// planes of lights.
    Whole,
    /// The same at map coordinates, where thirds round.
    Far,
}

struct Drawn {
    random: Random,
    numbers: Numbers,
}

impl Drawn {
    fn point(&mut self, reach: f64) -> DVec3 {
        let point = reach * self.random.in_cube();
        match self.numbers {
            Numbers::Real => point,
            Numbers::Whole => point.round(),
            Numbers::Far => point.round() / 3.0 + v(5e6, -4e5, 100.0),
        }
    }

    fn vector(&mut self, reach: f64) -> DVec3 {
        let vector = reach * self.random.in_cube();
        match self.numbers {
            Numbers::Real => vector,
            _ => vector.round() / 3.0,
        }
    }

    fn scene(&mut self) -> Arc<Occluders> {
        let mut builder = Occluders::builder();
        let count = 1 + self.random.below(60);
        let mut last = [(); 3].map(|()| self.point(3.0));
        for _ in 0..count {
            // Many share an edge with the one before, or all of it.
            last[self.random.below(3)] = self.point(3.0);
            let corners = match self.random.below(4) {
                0 => [(); 3].map(|()| self.point(3.0)),
                _ => last,
            };
            builder.add_face(&corners, Opacity::Opaque).unwrap();
            if self.random.below(8) == 0 {
                builder.add_face(&corners, Opacity::Opaque).unwrap();
            }
        }
        Arc::new(builder.build())
    }

    fn light(&mut self) -> AreaShape {
        loop {
            let center = self.point(4.0);
            let (first, second) = (self.vector(4.0), self.vector(4.0));
            let is_two_sided = self.random.below(2) == 0;
            let degrees = self.random.pick(&[0.53, 6.0, 40.0]);
            let corners = [center, center + first, center + second];
            let light = match self.random.below(7) {
                0 => RectangleLight::new(center, [first, second], is_two_sided)
                    .map(AreaShape::Rectangle),
                1 => TriangleLight::new(corners, is_two_sided).map(AreaShape::Triangle),
                2 => DiskLight::new(center, first, 1.5, is_two_sided).map(AreaShape::Disk),
                3 => SunDisc::new(first, degrees).map(AreaShape::SunDisc),
                4 => SegmentLight::new([center, center + first]).map(AreaShape::Segment),
                5 => {
                    let others = corners.map(|corner| corner + v(1.0, 0.0, 1.0));
                    MeshLight::new(vec![corners, others], is_two_sided)
                        .map(|mesh| AreaShape::Mesh(Arc::new(mesh)))
                }
                _ => {
                    let corners = vec![center, center + first, center + first + second, corners[2]];
                    PolygonLight::new(corners, is_two_sided)
                        .map(|polygon| AreaShape::Polygon(Arc::new(polygon)))
                }
            };
            if let Ok(light) = light {
                return light;
            }
        }
    }

    fn start(&mut self, occluders: &Occluders) -> ReceiverPoint {
        let point = self.point(4.0);
        if self.random.below(4) == 0 {
            return ReceiverPoint {
                point,
                surface: None,
            };
        }
        let surface = SurfaceId(self.random.below(occluders.surface_count()) as u32);
        occluders.start_on(surface, point)
    }

    fn side(&mut self) -> ReceiverSide {
        let normal = ReceiverSide::Normal(self.vector(3.0));
        let sides = [
            ReceiverSide::Front,
            ReceiverSide::Back,
            ReceiverSide::Both,
            normal,
        ];
        self.random.pick(&sides)
    }
}

fn index(occluders: &Arc<Occluders>, method: Method) -> ShadowIndex {
    common::builder_of(occluders, &[], method).build().unwrap()
}

fn exact(
    index: &ShadowIndex,
    start: &ReceiverPoint,
    side: ReceiverSide,
    light: &AreaShape,
) -> Option<VisibleFraction> {
    let mut counters = Counters::default();
    index
        .exact_fraction(start, side, light, &mut counters)
        .unwrap()
}

#[test]
fn fractions_are_the_same_bits_for_every_method() {
    let mut kinds = [0; 3];
    for (number, numbers) in [Numbers::Real, Numbers::Whole, Numbers::Far]
        .into_iter()
        .enumerate()
    {
        for seed in 0..12 {
            let random = Random(100 * number as u64 + seed);
            let mut drawn = Drawn { random, numbers };
            let occluders = drawn.scene();
            let indices = METHODS.map(|method| index(&occluders, method));
            for _ in 0..40 {
                let (light, side) = (drawn.light(), drawn.side());
                let start = drawn.start(&occluders);
                let expected = exact(&indices[0], &start, side, &light);
                for index in &indices[1..] {
                    let found = exact(index, &start, side, &light);
                    assert_eq!(
                        found,
                        expected,
                        "{:?} {start:?} {}",
                        index.method(),
                        light.kind()
                    );
                }
                let Some(found) = expected else { continue };
                assert!((0.0..=1.0).contains(&found.fraction) && found.fraction <= found.queried);
                kinds[0] += usize::from(found.queried > 0.0 && found.fraction == 0.0);
                kinds[1] += usize::from(found.fraction > 0.0 && found.fraction < found.queried);
                kinds[2] += usize::from(found.fraction > 0.0 && found.fraction == found.queried);
            }
        }
    }
    // The test has power: umbra, penumbra and light occur.
    assert!(kinds.iter().all(|&kind| kind > 50), "{kinds:?}");
}

/// Samples of nasty scenes. `ANTUMBRA_EXACT_POINTS=10000 ANTUMBRA_EXACT_SAMPLES=65536` is the long run; it prints what
/// it found. `ANTUMBRA_EXACT_SEED=607` begins with that scene.
#[test]
#[expect(
    clippy::print_stdout,
    reason = "the long run says what it found, for bench/runs"
)]
fn samples_converge_to_the_exact_fraction() {
    let number = |name: &str, usual: u32| {
        let given = std::env::var(name).ok();
        given.map_or(usual, |given| given.parse().expect("a number"))
    };
    let wanted = number("ANTUMBRA_EXACT_POINTS", 240);
    let sampling = LightSampling::new(number("ANTUMBRA_EXACT_SAMPLES", 1024));
    let count = f64::from(sampling.count());
    let (mut penumbra, mut all) = (0, 0_u64);
    let mut seed = u64::from(number("ANTUMBRA_EXACT_SEED", 1)) - 1;
    let (mut largest, mut largest_share, mut squares) = (0.0_f64, 0.0_f64, 0.0);
    let mut samples = LightSamples::default();
    while penumbra < wanted {
        seed += 1;
        let numbers = [Numbers::Real, Numbers::Whole, Numbers::Far][seed as usize % 3];
        let random = Random(seed);
        let mut drawn = Drawn { random, numbers };
        let occluders = drawn.scene();
        let index = index(&occluders, Method::Bvh);
        for _ in 0..40 {
            let (light, side) = (drawn.light(), drawn.side());
            let start = drawn.start(&occluders);
            all += 1;
            let Some(found) = exact(&index, &start, side, &light) else {
                continue;
            };
            let is_penumbra = found.fraction > 0.0 && found.fraction < found.queried;
            // Of the others fewer will do.
            if !is_penumbra && all % 16 != 0 {
                continue;
            }
            // Samples of a segment are rounded off it: where it lies in a plane with the start and an edge, as lattices
            // have it, they are on both sides of what is a border for all of it.
            if matches!(light, AreaShape::Segment(_)) && numbers != Numbers::Real {
                continue;
            }
            let mut counters = Counters::default();
            index
                .sample_light(
                    &start,
                    side,
                    &light,
                    all,
                    &sampling,
                    &mut samples,
                    &mut counters,
                )
                .unwrap();
            let label = || format!("{seed} {start:?} {side:?} {light:?}");
            // The same of flat lights that are seen from their own plane, up to rounding.
            if samples.queried().iter().any(|sample| sample.emitted < 1e-6) {
                continue;
            }
            let asked = samples.queried().len() as f64 / count;
            if is_penumbra {
                penumbra += 1;
                let p = found.fraction;
                let off = (samples.visible_fraction() - p).abs();
                // Even samples without any order would be off by more than six of these once in 10^9 times.
                let sigma = (p * (1.0 - p) / count).sqrt() + 1.0 / count;
                assert!(off <= 6.0 * sigma, "{off} {sigma} {found:?} {}", label());
                largest = largest.max(off);
                largest_share = largest_share.max(off / sigma);
                squares += off * off;
            } else if found.fraction == 0.0 && found.queried > 0.0 {
                assert_eq!(samples.lit_count(), 0, "{}", label());
            } else {
                assert_eq!(
                    samples.lit_count() as usize,
                    samples.queried().len(),
                    "{}",
                    label()
                );
            }
            let p = found.queried;
            let sigma = (p * (1.0 - p) / count).sqrt() + 1.0 / count;
            assert!(
                (asked - p).abs() <= 6.0 * sigma,
                "{asked} {found:?} {}",
                label()
            );
        }
    }
    if count > 2000.0 {
        let rms = (squares / f64::from(penumbra)).sqrt();
        println!(
            "{penumbra} penumbra points of {all}, {count} samples: largest difference {largest:.2e}"
        );
        println!(
            "largest in standard deviations {largest_share:.2}; root of the mean square {rms:.2e}"
        );
    }
}

#[test]
fn intervals_are_lit_and_gaps_are_not() {
    let (mut lit, mut gaps) = (0, 0);
    for seed in 0..60 {
        let numbers = [Numbers::Real, Numbers::Whole, Numbers::Far][seed as usize % 3];
        let random = Random(900 + seed);
        let mut drawn = Drawn { random, numbers };
        let occluders = drawn.scene();
        let index = index(&occluders, Method::Bvh);
        for _ in 0..10 {
            let (center, along) = (drawn.point(4.0), drawn.vector(4.0));
            let Ok(light) = SegmentLight::new([center, center + along]) else {
                continue;
            };
            let start = drawn.start(&occluders);
            let (side, mut counters) = (ReceiverSide::Both, Counters::default());
            let found = index
                .lit_intervals(&start, side, &light, &mut counters)
                .unwrap();
            let found = found.expect("triangles alone");
            let shape = AreaShape::Segment(light);
            let share = exact(&index, &start, side, &shape).unwrap().fraction;
            let length: f64 = found.iter().map(|[begin, end]| end - begin).sum();
            assert!((share - length).abs() < 1e-14, "{share} {found:?}");
            let mut is_occluded = |share: f64| {
                let [first, second] = light.ends();
                let target = [LightShape::Point(first + (second - first) * share)];
                let mut bits = [0];
                index
                    .occluded_targets(&start, &target, &mut bits, &mut counters)
                    .unwrap();
                bits[0] != 0
            };
            let mut before = 0.0;
            for [begin, end] in found.into_iter().chain([[1.0, 1.0]]) {
                // Too short ones are decided by the rounding of the middle.
                if begin - before > 1e-8 {
                    assert!(
                        is_occluded(0.5 * (before + begin)),
                        "{seed} {start:?} {light:?}"
                    );
                    gaps += 1;
                }
                if end - begin > 1e-8 {
                    assert!(
                        !is_occluded(0.5 * (begin + end)),
                        "{seed} {start:?} {light:?}"
                    );
                    lit += 1;
                }
                before = end;
            }
        }
    }
    assert!(lit > 200 && gaps > 200, "{lit} {gaps}");
}

#[test]
fn a_batch_has_the_fractions_of_its_points_for_any_number_of_threads() {
    let random = Random(4);
    let mut drawn = Drawn {
        random,
        numbers: Numbers::Real,
    };
    let occluders = drawn.scene();
    let index = index(&occluders, Method::Auto);
    let points: Vec<[f64; 3]> = (0..300).map(|_| drawn.point(4.0).to_array()).collect();
    let normals: Vec<[f64; 3]> = (0..300).map(|_| drawn.vector(1.0).to_array()).collect();
    let kind = BatchKind::Facing { normals: &normals };
    let batch = Batch {
        points: &points,
        kind,
    };
    let light = drawn.light();
    let sampling = LightSampling::new(16);
    let fractions = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut fractions = vec![VisibleFraction::default(); points.len()];
        let side = ReceiverSide::Front;
        let asked = pool.install(|| {
            index.exact_visible_fractions(&batch, side, &light, &sampling, &mut fractions)
        });
        asked.unwrap();
        fractions
    };
    let found = fractions(1);
    assert_eq!(found, fractions(3));
    for (row, found) in found.iter().enumerate() {
        let start = ReceiverPoint {
            point: points[row].into(),
            surface: None,
        };
        let side = ReceiverSide::Normal(normals[row].into());
        assert_eq!(Some(*found), exact(&index, &start, side, &light));
        assert_eq!(found.by, FractionBy::Exact);
    }
}

#[test]
fn more_blockers_than_stated_are_left_to_samples_for_every_method() {
    let mut builder = Occluders::builder();
    let strip = |number: usize| {
        let x = number as f64 / 300.0 - 0.5;
        [v(x, -1.0, 1.0), v(x + 0.001, -1.0, 1.0), v(x, 1.0, 1.0)]
    };
    for number in 0..=antumbra::MOST_BLOCKERS {
        builder.add_face(&strip(number), Opacity::Opaque).unwrap();
    }
    let many = Arc::new(builder.build());
    let mut builder = Occluders::builder();
    for number in 0..antumbra::MOST_BLOCKERS {
        builder.add_face(&strip(number), Opacity::Opaque).unwrap();
    }
    let few = Arc::new(builder.build());
    let edges = [v(0.0, 3.0, 0.0), v(3.0, 0.0, 0.0)];
    let lamp = AreaShape::Rectangle(RectangleLight::new(v(0.0, 0.0, 2.0), edges, true).unwrap());
    let start = ReceiverPoint {
        point: DVec3::ZERO,
        surface: None,
    };
    for method in METHODS {
        let (few, many) = (index(&few, method), index(&many, method));
        let found = exact(&few, &start, ReceiverSide::Both, &lamp).unwrap();
        // Each hides 0.003 of the lamp's 9: what is within it of a triangle of 0.002 x 4.
        let expected = 1.0 - 0.003 * antumbra::MOST_BLOCKERS as f64 / 9.0;
        assert!((found.fraction - expected).abs() < 1e-13, "{found:?}");
        assert_eq!(exact(&many, &start, ReceiverSide::Both, &lamp), None);
        let mut samples = LightSamples::default();
        let sampling = LightSampling::new(64);
        let mut counters = Counters::default();
        let found = many
            .visible_fraction(
                &start,
                ReceiverSide::Both,
                &lamp,
                0,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        assert_eq!(found.by, FractionBy::Samples);
        assert_eq!(found.fraction, samples.visible_fraction());
    }
}

/// Found by 10^4 points of 65 536 samples: scene 607.
#[test]
fn a_triangle_in_the_lights_plane_hides_nothing_of_it() {
    let corners = [v(0.0, -3.0, 0.0), v(0.0, 0.0, 3.0), v(0.0, -2.0, 2.0)];
    let mut builder = Occluders::builder();
    builder.add_face(&corners, Opacity::Opaque).unwrap();
    let occluders = Arc::new(builder.build());
    let (center, edges) = (v(0.0, -2.0, 2.0), [v(0.0, 0.0, 2.0), v(0.0, -2.0, 0.0)]);
    let ends = [center, center + edges[0], center + edges[1]];
    let quad = vec![ends[0], ends[1], ends[1] + edges[1], ends[2]];
    let lights = [
        AreaShape::Disk(DiskLight::new(center, v(1.0, 0.0, 0.0), 1.5, true).unwrap()),
        AreaShape::Rectangle(RectangleLight::new(center, edges, true).unwrap()),
        AreaShape::Triangle(TriangleLight::new(ends, true).unwrap()),
        AreaShape::Polygon(Arc::new(PolygonLight::new(quad, true).unwrap())),
        AreaShape::Mesh(Arc::new(MeshLight::new(vec![ends], true).unwrap())),
        AreaShape::Segment(SegmentLight::new([ends[1], ends[2]]).unwrap()),
    ];
    let start = ReceiverPoint {
        point: v(2.0, -2.0, -3.0),
        surface: None,
    };
    let mut samples = LightSamples::default();
    let mut counters = Counters::default();
    for light in lights {
        for method in METHODS {
            let index = index(&occluders, method);
            let found = exact(&index, &start, ReceiverSide::Both, &light).unwrap();
            assert_eq!(
                (found.fraction, found.queried),
                (1.0, 1.0),
                "{method:?} {light:?}"
            );
        }
        let sampling = LightSampling::new(64);
        index(&occluders, Method::Bvh)
            .sample_light(
                &start,
                ReceiverSide::Both,
                &light,
                1,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        assert_eq!(samples.lit_count(), 64, "{light:?}");
    }
}
