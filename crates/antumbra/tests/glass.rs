//! Light through glass: the oracle's product, whatever the method; each sheet once.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, Counters, DVec3, Filter, LightId, LightShape, Occluders, OccludersBuilder, Opacity,
    ReceiverPoint, ShadowIndex, Sphere, SurfaceId, Tint,
};
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::{Oracle, OracleLight, OracleShape, OracleSurface};
use common::{METHODS, Random};

/// A tint of a surface's own, so that a product tells which surfaces are in it.
fn tint_of(surface: usize) -> [f64; 3] {
    let mut random = Random(surface as u64);
    std::array::from_fn(|_| random.real(0.25, 1.0))
}

fn product(filters: impl IntoIterator<Item = [f64; 3]>) -> [f64; 3] {
    let times = |all: [f64; 3], one: [f64; 3]| [0, 1, 2].map(|i: usize| all[i] * one[i]);
    filters.into_iter().fold([1.0; 3], times)
}

/// Returns the answer of EXACTNESS.md, by the oracle.
fn expected(
    oracle: &Oracle,
    occluders: &Occluders,
    (point, surface): ([f64; 3], Option<usize>),
    light: OracleLight,
) -> [f64; 3] {
    if oracle.is_blocked(point, surface, light) {
        return [0.0; 3];
    }
    let id = |surface: usize| SurfaceId(surface as u32);
    let mut found = oracle.filters(point, surface, light);
    // Of shapes that share the start's own rule, the first counts.
    if let Some(own) = surface.map(id) {
        let counts = |t: SurfaceId| occluders.own_parts(own).any(|part| part == t);
        found.retain(|&t| !occluders.have_one_own_rule(own, id(t)) || counts(id(t)));
    }
    // A closed cone filters once.
    let solid = |t: usize| oracle.surfaces()[t].solid;
    found.dedup_by(|next, last| solid(*next).is_some() && solid(*next) == solid(*last));
    product(found.into_iter().map(|t| tint_of(first_part(oracle, t))))
}

/// The first part of a closed cone, or the surface itself.
fn first_part(oracle: &Oracle, surface: usize) -> usize {
    let solid = oracle.surfaces()[surface].solid;
    let first = oracle
        .surfaces()
        .iter()
        .position(|other| other.solid == solid);
    solid.and(first).unwrap_or(surface)
}

fn filtering(builder: &mut OccludersBuilder, surface: usize) -> Opacity {
    Opacity::Filtering(builder.add_filter(Arc::new(Tint(tint_of(surface)))))
}

#[test]
fn nasty_scenes_have_the_oracles_product_for_every_method() {
    let (mut counts, mut many) = ([0; 3], 0);
    for seed in seeds(0..80) {
        let mut scene = nasty::scene(seed);
        let random = &mut Random(seed ^ 0x61);
        let mut solids = std::collections::HashMap::new();
        for surface in &mut scene.surfaces {
            let opaque = random.below(5) == 0;
            surface.opaque = match surface.solid {
                Some(solid) => *solids.entry(solid).or_insert(opaque),
                None => opaque,
            };
        }
        let occluders = common::nasty::occluders_with(&scene.surfaces, filtering);
        let lights: Vec<LightShape> = scene
            .lights
            .iter()
            .map(|&light| common::nasty::light(light))
            .collect();
        let build = |method| {
            common::builder_of(&occluders, &lights, method)
                .build()
                .unwrap()
        };
        let indices = METHODS.map(build);
        let oracle = Oracle::new(scene.surfaces.clone());
        for query in &scene.queries {
            for (number, &light) in (0..).zip(&scene.lights) {
                let asked = (query.point, query.surface);
                let expected = expected(&oracle, &occluders, asked, light);
                let start = common::nasty::start(query.point, query.surface);
                let is_mixed = expected != [0.0; 3] && expected != [1.0; 3];
                counts[if is_mixed {
                    1
                } else {
                    2 * expected[0] as usize
                }] += 1;
                many += u32::from(expected[0] > 0.0 && expected[0] < 0.2);
                let reference = indices[0].transmittance_by_reference(&start, LightId(number));
                assert_eq!(
                    reference,
                    Ok(expected),
                    "{} {query:?} {light:?}",
                    scene.label()
                );
                for index in &indices {
                    let counters = &mut Counters::default();
                    let found = index.transmittance_of(&start, LightId(number), counters);
                    let label =
                        format!("{} {:?} {query:?} {light:?}", scene.label(), index.method());
                    assert_eq!(found, Ok(expected), "{label}");
                }
            }
        }
    }
    // The test has power: nothing, all, and products of several filters occur.
    assert!(
        counts.iter().all(|&count| count > 300) && many > 30,
        "{counts:?} {many}"
    );
}

/// Nasty scenes; `ANTUMBRA_GLASS_SEEDS=0..3000` is the long run.
fn seeds(usual: std::ops::Range<u64>) -> std::ops::Range<u64> {
    let Ok(given) = std::env::var("ANTUMBRA_GLASS_SEEDS") else {
        return usual;
    };
    let (from, to) = given.split_once("..").expect("FROM..TO");
    from.parse().expect("a number")..to.parse().expect("a number")
}

/// A square of four triangles around its middle, at some height.
fn fan(half: f64, z: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| [x * half, y * half, z]);
    let vertices = std::iter::once([0.0, 0.0, z]).chain(corners).collect();
    (
        vertices,
        (0..4).map(|i| [0, 1 + i, 1 + (i + 1) % 4]).collect(),
    )
}

fn indices(occluders: &Arc<Occluders>, lights: &[LightShape]) -> Vec<ShadowIndex> {
    let build = |method| {
        common::builder_of(occluders, lights, method)
            .build()
            .unwrap()
    };
    METHODS.map(build).into()
}

#[test]
fn a_sheet_filters_once_where_its_triangles_share_edges_and_corners() {
    let mut surfaces = Occluders::builder();
    let red = surfaces.add_filter(Arc::new(Tint([0.5, 0.25, 0.125])));
    let (vertices, triangles) = fan(2.0, 1.0);
    surfaces
        .add_mesh(&vertices, &triangles, Opacity::Filtering(red))
        .unwrap();
    let lights = [
        LightShape::Direction(DVec3::Z),
        LightShape::Point(DVec3::new(0.0, 0.0, 9.0)),
        // In the plane of no triangle, but on the lines of edges seen from below.
        LightShape::Point(DVec3::new(0.5, 0.5, 3.0)),
        LightShape::Direction(DVec3::new(1.0, 1.0, 1.0)),
    ];
    for index in indices(&Arc::new(surfaces.build()), &lights) {
        for at in [
            [0.0, 0.0],
            [0.5, 0.5],
            [-0.5, 0.5],
            [0.25, 0.5],
            [0.75, -1.0],
        ] {
            for light in index.light_ids() {
                let found = index.transmittance_at([at[0], at[1], 0.0], light);
                assert_eq!(
                    found,
                    Ok([0.5, 0.25, 0.125]),
                    "{at:?} {light:?} {:?}",
                    index.method()
                );
            }
        }
        // Beside it, above it and in it.
        for at in [[3.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.5, 0.0, 1.0]] {
            assert_eq!(index.transmittance_at(at, 0), Ok([1.0; 3]), "{at:?}");
        }
    }
}

#[test]
fn panes_multiply_in_the_order_of_their_numbers_and_opaque_edges_hide_all() {
    let mut surfaces = Occluders::builder();
    let tints: Vec<[f64; 3]> = (0..100).map(tint_of).collect();
    // Upside down: the order along the ray is another one.
    for (number, &tint) in tints.iter().enumerate() {
        let filter = surfaces.add_filter(Arc::new(Tint(tint)));
        let (vertices, triangles) = fan(2.0, 101.0 - (number / 2) as f64);
        surfaces
            .add_mesh(&vertices, &triangles, Opacity::Filtering(filter))
            .unwrap();
    }
    let (vertices, _) = fan(1.0, 0.5);
    let half = [[0, 1, 2]];
    surfaces
        .add_mesh(&vertices, &half, Opacity::Opaque)
        .unwrap();
    let lights = [
        LightShape::Direction(DVec3::Z),
        LightShape::Point(DVec3::new(0.0, 0.0, 1e3)),
    ];
    for index in indices(&Arc::new(surfaces.build()), &lights) {
        for light in index.light_ids() {
            let below = |x: f64, y: f64| index.transmittance_at([x, y, 0.0], light).unwrap();
            assert_eq!(
                below(0.3, 0.4),
                product(tints.iter().copied()),
                "{:?}",
                index.method()
            );
            assert_eq!(below(0.0, 0.0), [0.0; 3], "{:?}", index.method());
            assert_eq!(below(0.0, -0.5), [0.0; 3], "{:?}", index.method());
        }
    }
}

/// Lets through as much as the texture's first coordinate says.
#[derive(Debug)]
struct Ramp;

impl Filter for Ramp {
    fn transmittance_at(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        [u, v, 1.0]
    }
}

#[test]
fn textures_balls_and_batches() {
    let mut surfaces = Occluders::builder();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let ramp = surfaces.add_filter(Arc::new(Ramp));
    let outline = corners.map(|(x, y)| DVec3::new(x, y, 2.0));
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    surfaces.add_filtering_face(&outline, &uvs, ramp).unwrap();
    assert!(
        surfaces
            .add_filtering_face(&outline, &uvs[..3], ramp)
            .is_err()
    );
    let half = surfaces.add_filter(Arc::new(Tint([0.5; 3])));
    let ball = Sphere {
        center: DVec3::new(8.0, 0.0, 4.0),
        radius: 1.0,
    };
    surfaces.add_sphere(ball, Opacity::Filtering(half)).unwrap();
    let floor = corners.map(|(x, y)| DVec3::new(20.0 * x, 20.0 * y, 0.0));
    surfaces.add_face(&floor, Opacity::Opaque).unwrap();
    let lights = [
        LightShape::Direction(DVec3::Z),
        LightShape::Direction(-DVec3::Z),
    ];
    let floor = 2;
    for mut index in indices(&Arc::new(surfaces.build()), &lights) {
        assert!(index.has_glass());
        let points = [
            [0.5_f32, -0.5, 0.0],
            [0.0, 0.0, 0.0],
            [8.0, 0.1, 0.0],
            [5.0, 5.0, 0.0],
        ];
        let expected = [[0.75, 0.25, 1.0], [0.5, 0.5, 1.0], [0.5; 3], [1.0; 3]];
        let ids = [LightId(0), LightId(1)];
        let mut found = vec![[9.0; 3]; 8];
        index
            .transmittances(&Batch::on_nearest(&points, None), &ids, &mut found)
            .unwrap();
        for (number, expected) in expected.into_iter().enumerate() {
            assert_eq!(found[2 * number], expected, "{number} {:?}", index.method());
            // The second sun is below: the floor is in the way of nothing, and the rest is above.
            assert_eq!(
                found[2 * number + 1],
                [1.0; 3],
                "{number} {:?}",
                index.method()
            );
            let start = ReceiverPoint {
                point: DVec3::from_array(points[number].map(f64::from)),
                surface: Some(SurfaceId(floor)),
            };
            let single = index.transmittance_of(&start, LightId(0), &mut Counters::default());
            assert_eq!(single, Ok(expected));
        }
        // A light that is added later is filtered, too.
        let later = index
            .add_light(LightShape::Point(DVec3::new(0.0, 0.0, 50.0)))
            .unwrap();
        assert_eq!(
            index.transmittance_at([0.0, 0.0, 1.0], later),
            Ok([0.5, 0.5, 1.0])
        );
        index
            .move_light(later, LightShape::Direction(DVec3::X))
            .unwrap();
        assert_eq!(index.transmittance_at([0.0, 0.0, 1.0], later), Ok([1.0; 3]));
        let refused =
            index.transmittances(&Batch::on_nearest(&points, None), &ids, &mut found[..7]);
        assert!(refused.is_err());
    }
}

#[test]
fn without_glass_a_light_reaches_points_wholly_or_not() {
    let triangle = OracleSurface::opaque(OracleShape::Triangle([
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [0.0, 1.0, 1.0],
    ]));
    let occluders = common::nasty::occluders(&[triangle]);
    for index in indices(&occluders, &[LightShape::Direction(DVec3::Z)]) {
        assert!(!index.has_glass());
        assert_eq!(index.transmittance_at([0.0, 0.0, 0.0], 0), Ok([0.0; 3]));
        assert_eq!(index.transmittance_at([2.0, 0.0, 0.0], 0), Ok([1.0; 3]));
        assert!(index.transmittance_at([f64::NAN, 0.0, 0.0], 0).is_err());
        assert!(index.transmittance_at([0.0, 0.0, 0.0], 1).is_err());
    }
}

/// Threads of a batch wait for what is known of glass; whoever makes it must not take up their work meanwhile.
#[test]
fn many_threads_may_be_the_first_to_ask() {
    let mut surfaces = Occluders::builder();
    let tint = surfaces.add_filter(Arc::new(Tint([0.5; 3])));
    for number in 0..400 {
        let (vertices, triangles) = fan(2.0, 1.0 + f64::from(number) / 64.0);
        surfaces
            .add_mesh(&vertices, &triangles, Opacity::Filtering(tint))
            .unwrap();
    }
    let surfaces = Arc::new(surfaces.build());
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(7)
        .build()
        .unwrap();
    for method in METHODS {
        let lights = [LightShape::Direction(DVec3::Z)];
        let index = common::builder_of(&surfaces, &lights, method)
            .build()
            .unwrap();
        pool.install(|| {
            rayon::scope(|scope| {
                for number in 0..64 {
                    let index = &index;
                    scope.spawn(move |_| {
                        let x = f64::from(number) / 64.0;
                        let found = index.transmittance_at([x, 0.25, 0.0], 0).unwrap();
                        assert_eq!(found, [0.5_f64.powi(400); 3]);
                    });
                }
            });
        });
    }
}
