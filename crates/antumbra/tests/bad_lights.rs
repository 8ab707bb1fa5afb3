//! Odd lights: of almost no size, beyond the scene, around it, in surfaces, through receivers, turned away, very many. What is
//! no light at all is refused where it is made (`what_is_no_light_is_refused_with_a_reason` of `antumbra-geometry`,
//! `bad_lights_are_refused_and_change_nothing` here).

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, Counters, LightId, LightSamples, LightSampling, Method, ReceiverSide, Refine,
    Refinement, Shadow, ShadowIndex, VisibleFraction,
};
use antumbra_geometry::{
    AreaShape, DVec3, DiskLight, LightShape, MeshLight, Occluders, PolygonLight, ReceiverPoint,
    RectangleLight, SegmentLight, SphereLight, SunDisc, SurfaceId, TriangleLight,
};
use common::{Random, add_face};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A floor, a wall on it and a plate over it.
fn room() -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    let square = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    add_face(&mut builder, &square.map(|(x, y)| v(x, y, 0.0)));
    add_face(&mut builder, &square.map(|(x, z)| v(x, 1.0, z + 4.0)));
    add_face(
        &mut builder,
        &square.map(|(x, y)| v(0.3 * x, 0.3 * y - 2.0, 1.5)),
    );
    Arc::new(builder.build())
}

/// Corners and edges of surfaces, points on them, points of space.
fn starts(occluders: &Occluders) -> Vec<ReceiverPoint> {
    let mut random = Random(3);
    let mut starts = Vec::new();
    for surface in occluders.surfaces() {
        let corners = occluders.triangle_positions(surface).expect("triangles");
        let [a, b, c] = corners;
        let points = [a, 0.5 * (a + b), (a + b + c) / 3.0, b + 0.25 * (c - b)];
        starts.extend(points.map(|point| ReceiverPoint {
            point,
            surface: Some(surface),
        }));
        starts.push(ReceiverPoint {
            point: 3.0 * random.in_cube(),
            surface: None,
        });
    }
    starts
}

/// Lights that are lights, but only just.
fn odd_lights() -> Vec<(&'static str, AreaShape)> {
    let rectangle = |center, edges: [DVec3; 2]| {
        RectangleLight::new(center, edges, true).map(AreaShape::Rectangle)
    };
    let lights = [
        (
            "smaller than rounding",
            rectangle(v(0.3, 0.2, 3.0), [1e-30 * DVec3::X, 1e-30 * DVec3::Y]),
        ),
        (
            "smallest ball",
            SphereLight::new(v(0.3, 0.2, 3.0), f64::MIN_POSITIVE).map(AreaShape::Sphere),
        ),
        (
            "smallest sun",
            SunDisc::new(v(0.1, 0.2, 1.0), 1e-10).map(AreaShape::SunDisc),
        ),
        (
            "widest sun",
            SunDisc::new(v(0.1, 0.2, 1.0), 179.9).map(AreaShape::SunDisc),
        ),
        (
            "in the floor",
            rectangle(v(0.5, 0.5, 0.0), [DVec3::X, DVec3::Y]),
        ),
        (
            "is the plate",
            rectangle(v(0.0, -2.0, 1.5), [2.4 * DVec3::X, 2.4 * DVec3::Y]),
        ),
        (
            "through wall and floor",
            rectangle(v(0.0, 1.0, 0.0), [v(0.5, 2.0, 2.0), v(-2.0, 1.0, 1.0)]),
        ),
        (
            "line on an edge",
            SegmentLight::new([v(-4.0, 1.0, 0.0), v(4.0, 1.0, 0.0)]).map(AreaShape::Segment),
        ),
        (
            "line through a corner",
            SegmentLight::new([v(-4.0, -4.0, -1.0), v(-4.0, -4.0, 1.0)]).map(AreaShape::Segment),
        ),
        (
            "ball around all",
            SphereLight::new(DVec3::ZERO, 1e3).map(AreaShape::Sphere),
        ),
        (
            "ball through the floor",
            SphereLight::new(v(1.0, -1.0, 0.0), 0.5).map(AreaShape::Sphere),
        ),
        (
            "turned away",
            TriangleLight::new(
                [v(0.0, 0.0, 5.0), v(1.0, 0.0, 5.0), v(0.0, 1.0, 5.0)],
                false,
            )
            .map(AreaShape::Triangle),
        ),
        (
            "larger than the scene",
            rectangle(v(0.0, 0.0, 50.0), [9e5 * DVec3::Y, 9e5 * DVec3::X]),
        ),
        (
            "as far as numbers go",
            DiskLight::new(v(0.0, 0.0, 1e29), DVec3::NEG_Z, 1e30, false).map(AreaShape::Disk),
        ),
        (
            "line as long as numbers go",
            SegmentLight::new([v(0.0, 0.0, -1e30), v(0.0, 1.0, 1e30)]).map(AreaShape::Segment),
        ),
        (
            "sliver",
            PolygonLight::new(
                vec![v(0.0, 0.0, 3.0), v(5.0, 0.0, 3.0), v(5.0, 1e-13, 3.0)],
                true,
            )
            .map(|polygon| AreaShape::Polygon(Arc::new(polygon))),
        ),
        (
            "faces inside out, one twice, one without area",
            MeshLight::new(
                vec![
                    [v(0.0, 0.0, 3.0), v(1.0, 0.0, 3.0), v(0.0, 1.0, 3.0)],
                    [v(0.0, 0.0, 3.0), v(0.0, 1.0, 3.0), v(1.0, 0.0, 3.0)],
                    [v(0.0, 0.0, 3.0), v(0.0, 1.0, 3.0), v(1.0, 0.0, 3.0)],
                    [v(0.0, 0.0, 3.0), v(0.0, 0.0, 3.0), v(1.0, 0.0, 3.0)],
                ],
                false,
            )
            .map(|mesh| AreaShape::Mesh(Arc::new(mesh))),
        ),
    ];
    lights
        .into_iter()
        .map(|(name, made)| (name, made.unwrap_or_else(|error| panic!("{name}: {error}"))))
        .collect()
}

fn index_that_learns_at_once(occluders: &Arc<Occluders>) -> ShadowIndex {
    let refinement = Refinement {
        refine: Refine::Queried,
        ..Refinement::default()
    };
    let builder = common::builder_of(occluders, &[], Method::Auto);
    builder.refinement(refinement).build().unwrap()
}

const SIDES: [ReceiverSide; 3] = [ReceiverSide::Both, ReceiverSide::Front, ReceiverSide::Back];

#[test]
fn samples_of_odd_lights_are_the_references_whatever_is_known() {
    let occluders = room();
    let index = index_that_learns_at_once(&occluders);
    let sampling = LightSampling::new(16);
    let (mut lit, mut dark) = (0, 0);
    for (name, light) in odd_lights() {
        for (number, start) in starts(&occluders).iter().enumerate() {
            for side in SIDES {
                let mut samples = LightSamples::default();
                let mut counters = Counters::default();
                index
                    .sample_light(
                        start,
                        side,
                        &light,
                        number as u64,
                        &sampling,
                        &mut samples,
                        &mut counters,
                    )
                    .unwrap();
                let expected: Vec<_> = samples
                    .queried()
                    .iter()
                    .filter(|sample| {
                        let segment = occluders.segment(start, &sample.target);
                        occluders.surfaces().all(|s| !occluders.blocks(s, &segment))
                    })
                    .collect();
                let found: Vec<_> = samples.lit().collect();
                assert_eq!(found, expected, "{name} {side:?} {start:?}");
                assert!(
                    found.iter().all(|sample| sample.solid_angle >= 0.0),
                    "{name}"
                );
                lit += found.len();
                dark += samples.queried().len() - found.len();
            }
        }
    }
    assert!(lit > 1000 && dark > 1000, "{lit} {dark}");
}

#[test]
fn exact_fractions_of_odd_lights_are_shares_and_the_same_for_every_method() {
    let occluders = room();
    let [by_tree, by_all, by_values] = [Method::Bvh, Method::Naive, Method::Auto]
        .map(|method| common::builder_of(&occluders, &[], method).build().unwrap());
    let mut exact = 0;
    for (name, light) in odd_lights() {
        for start in &starts(&occluders) {
            for side in SIDES {
                let ask = |index: &ShadowIndex| -> Option<VisibleFraction> {
                    let counters = &mut Counters::default();
                    index.exact_fraction(start, side, &light, counters).unwrap()
                };
                let expected = ask(&by_all);
                assert_eq!(ask(&by_tree), expected, "{name} {side:?} {start:?}");
                assert_eq!(ask(&by_values), expected, "{name} {side:?} {start:?}");
                let Some(found) = expected else { continue };
                exact += 1;
                assert!(
                    0.0 <= found.fraction
                        && found.fraction <= found.queried
                        && found.queried <= 1.0,
                    "{name} {side:?} {start:?} {found:?}"
                );
            }
        }
    }
    assert!(exact > 500, "{exact}");
}

/// Lamps all over, some of them twice, in the floor, far away, and suns.
fn very_many(random: &mut Random) -> Vec<LightShape> {
    (0..100_000)
        .map(|number| match number % 7 {
            0 => LightShape::Point(v(0.5, 0.5, 2.0)),
            1 => LightShape::Direction(random.in_cube() + v(0.0, 0.0, 1.5)),
            2 => LightShape::Point(3.0 * random.in_cube() * v(1.0, 1.0, 0.0)),
            3 => LightShape::Point(1e29 * random.in_cube()),
            _ => LightShape::Point(4.0 * random.in_cube() + v(0.0, 0.0, 3.0)),
        })
        .collect()
}

#[test]
fn a_hundred_thousand_lights_are_asked_at_once_and_one_by_one() {
    let occluders = room();
    let random = &mut Random(17);
    let lights = very_many(random);
    for memory in [1 << 20, Refinement::default().memory] {
        let refinement = Refinement {
            memory,
            ..Refinement::default()
        };
        let index = common::builder_of(&occluders, &lights, Method::Auto)
            .refinement(refinement)
            .build()
            .unwrap();
        let starts = starts(&occluders);
        let stride = lights.len().div_ceil(64);
        let mut words = vec![0; stride * starts.len()];
        let (side, mut counters) = (ReceiverSide::Both, Counters::default());
        index
            .lights_visible_of(&starts, side, &mut words, &mut counters)
            .unwrap();
        let mut in_turn = index.lights_in_turn();
        for (start, words) in starts.iter().zip(words.chunks(stride)) {
            in_turn.ask(start, side, &[], &mut counters).unwrap();
            assert!(in_turn.visible() == words);
            for light in (random.below(997)..lights.len()).step_by(997) {
                let truth = index
                    .shadow_by_reference(start, LightId::from_index(light))
                    .unwrap()
                    == Shadow::Lit;
                assert_eq!(words[light / 64] >> (light % 64) & 1 != 0, truth, "{light}");
                let alone = index
                    .shadow(start, LightId::from_index(light), &mut counters)
                    .unwrap();
                assert_eq!(alone.shadow == Shadow::Lit, truth, "{light}");
            }
        }
        let points: Vec<[f64; 3]> = starts.iter().map(|s| s.point.to_array()).collect();
        let mut of_batch = vec![0; words.len()];
        index
            .lights_visible_batch(&Batch::free(&points), side, &mut of_batch)
            .unwrap();
        assert!(index.knowledge_bytes() <= memory, "{memory}");
        assert!(index.row_bytes() <= index.knowledge_bytes());
    }
}

#[test]
fn very_many_lights_with_size_are_asked_and_only_some_are_known() {
    let occluders = room();
    let index = index_that_learns_at_once(&occluders);
    let start = ReceiverPoint {
        point: v(0.5, -1.5, 0.0),
        surface: Some(SurfaceId(0)),
    };
    let sampling = LightSampling::new(1);
    let mut samples = LightSamples::default();
    let mut counters = Counters::default();
    for number in 0..100_000 {
        let center = v(0.0, 0.0, 2.0 + 1e-4 * f64::from(number));
        let light = AreaShape::Sphere(SphereLight::new(center, 0.1).unwrap());
        index
            .sample_light(
                &start,
                ReceiverSide::Front,
                &light,
                0,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        assert!(samples.lit_count() <= 1);
    }
    assert!(index.knowledge_bytes() <= Refinement::default().memory);
}
