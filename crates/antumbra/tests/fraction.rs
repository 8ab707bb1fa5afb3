//! Lights with size: every sample is the reference's, whoever answers.

mod common;

use std::sync::Arc;

use antumbra::{
    Batch, BatchError, BatchKind, Counters, LightId, LightSamples, LightSampling, Method,
    QueryError, ReceiverSide, Shadow, ShadowIndex,
};
use antumbra_geometry::{
    AreaSample, AreaShape, DVec3, DiskLight, MeshLight, Occluders, Opacity, ReceiverPoint,
    RectangleLight, SegmentLight, Sky, Sphere, SphereLight, SunDisc, SurfaceId, TriangleLight,
};
use common::{Random, add_cone_and_disk, add_face, add_pane};

const METHODS: [Method; 6] = [
    Method::Naive,
    Method::Grid,
    Method::Bvh,
    Method::Voxel1990,
    Method::Voxel,
    Method::Auto,
];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A floor, a wall, a ball, a cone, a disk, a pane of glass, and a tilted plate.
fn occluders() -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    add_face(&mut builder, &floor.map(|(x, y)| v(x, y, 0.0)));
    let wall = [
        v(-4.0, 2.0, 0.0),
        v(1.0, 2.0, 0.0),
        v(1.0, 2.0, 3.0),
        v(-4.0, 2.0, 3.0),
    ];
    add_face(&mut builder, &wall);
    let plate = [v(1.0, -1.0, 1.1), v(2.1, -0.9, 1.4), v(2.0, 0.3, 1.9)];
    add_face(&mut builder, &plate);
    let ball = Sphere {
        center: v(-0.3, 0.2, 1.0),
        radius: 0.7,
    };
    builder.add_sphere(ball, Opacity::Opaque).unwrap();
    add_cone_and_disk(&mut builder, 0.0);
    add_pane(&mut builder);
    Arc::new(builder.build())
}

fn lights() -> Vec<AreaShape> {
    let rectangle = |center, edges, both| {
        AreaShape::Rectangle(RectangleLight::new(center, edges, both).unwrap())
    };
    let corners = [v(0.0, 0.0, 5.0), v(0.3, 2.0, 5.0), v(2.0, 0.0, 4.7)];
    vec![
        rectangle(
            v(0.0, 0.0, 4.0),
            [v(0.0, 2.0, 0.0), v(3.0, 0.0, 0.0)],
            false,
        ),
        // Through the floor, the wall and the ball.
        rectangle(v(0.5, 1.0, 0.3), [v(3.0, 0.5, 0.1), v(0.0, 2.5, 1.5)], true),
        // In the plane of the floor.
        rectangle(
            v(0.0, -3.0, 0.0),
            [v(2.0, 0.0, 0.0), v(0.0, 1.0, 0.0)],
            true,
        ),
        // Far larger than the scene.
        rectangle(
            v(0.0, 0.0, 50.0),
            [v(0.0, 900.0, 0.0), v(900.0, 0.0, 0.0)],
            false,
        ),
        AreaShape::Segment(SegmentLight::new([v(-3.0, -3.0, 2.0), v(3.0, 1.0, 3.0)]).unwrap()),
        AreaShape::Triangle(TriangleLight::new(corners, true).unwrap()),
        AreaShape::Disk(DiskLight::new(v(2.0, 2.0, 3.0), v(-1.0, -1.0, -2.0), 0.8, false).unwrap()),
        AreaShape::Sphere(SphereLight::new(v(2.0, -2.0, 3.0), 0.6).unwrap()),
        // Around the scene's ball.
        AreaShape::Sphere(SphereLight::new(v(-0.3, 0.2, 1.0), 0.8).unwrap()),
        AreaShape::SunDisc(SunDisc::new(v(1.0, -1.0, 1.5), 5.0).unwrap()),
        AreaShape::SunDisc(SunDisc::new(v(1.0, -1.0, 0.0), 0.53).unwrap()),
        AreaShape::Sky(Sky::new(DVec3::Z).unwrap()),
        AreaShape::Mesh(Arc::new(
            MeshLight::new(vec![corners, corners.map(|c| -c)], true).unwrap(),
        )),
    ]
}

fn index(method: Method) -> ShadowIndex {
    common::builder_of(&occluders(), &[], method)
        .build()
        .unwrap()
}

/// Points on surfaces, on edges, in space and in lights.
fn starts(count: usize) -> Vec<ReceiverPoint> {
    let occluders = occluders();
    let mut random = Random(5);
    let surfaces: Vec<SurfaceId> = occluders.surfaces().collect();
    (0..count)
        .map(|number| {
            let point = 4.0 * random.in_cube();
            match number % 4 {
                0 => ReceiverPoint {
                    point,
                    surface: None,
                },
                _ => {
                    let surface = random.pick(&surfaces);
                    occluders.start_on(surface, point)
                }
            }
        })
        .collect()
}

#[test]
fn every_sample_is_the_references_for_every_method_and_light() {
    let starts = starts(60);
    let indices = METHODS.map(index);
    let occluders = occluders();
    let mut asked_count = 0;
    let mut lit_count = 0;
    for (number, light) in lights().iter().enumerate() {
        let sampling = LightSampling {
            samples: 37,
            seed: 3,
            light: number as u64,
        };
        for (row, start) in starts.iter().enumerate() {
            for side in [ReceiverSide::Front, ReceiverSide::Back, ReceiverSide::Both] {
                let mut expected: Option<Vec<AreaSample>> = None;
                for index in &indices {
                    let mut samples = LightSamples::default();
                    let mut counters = Counters::default();
                    let row = row as u64;
                    index
                        .sample_light(
                            start,
                            side,
                            light,
                            row,
                            &sampling,
                            &mut samples,
                            &mut counters,
                        )
                        .unwrap();
                    let lit: Vec<_> = samples.lit().copied().collect();
                    assert_eq!(samples.lit_count() as usize, lit.len());
                    let expected = expected.get_or_insert_with(|| {
                        let bits = by_reference(&occluders, start, samples.queried());
                        let both = samples.queried().iter().zip(bits);
                        both.filter(|&(_, is_lit)| is_lit)
                            .map(|(s, _)| *s)
                            .collect()
                    });
                    assert_eq!(
                        &lit,
                        expected,
                        "{:?} {start:?} {}",
                        index.method(),
                        light.kind()
                    );
                    asked_count += samples.queried().len();
                    lit_count += lit.len();
                }
            }
        }
    }
    // The test has power: many are asked, and both answers occur.
    assert!(asked_count > 100_000, "{asked_count}");
    assert!(lit_count > asked_count / 10 && lit_count < asked_count * 9 / 10);
}

#[test]
fn a_batch_has_the_fractions_of_its_points_for_any_number_of_threads() {
    let index = index(Method::Bvh);
    let occluders = occluders();
    let surfaces: Vec<u32> = (0..occluders.surface_count() as u32).collect();
    let mut random = Random(9);
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for _ in 0..300 {
        let face = random.pick(&surfaces);
        let start = occluders.start_on(SurfaceId(face), 4.0 * random.in_cube());
        points.push(start.point.to_array());
        faces.push(face);
    }
    // Curved surfaces keep points that are far off.
    let kind = BatchKind::OnSurfaces {
        surfaces: &faces,
        tolerance: Some(f64::INFINITY),
    };
    let batch = Batch {
        points: &points,
        kind,
    };
    for (number, light) in lights().iter().enumerate() {
        let sampling = LightSampling {
            light: number as u64,
            ..LightSampling::new(65)
        };
        let fractions = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let mut fractions = vec![9.0; points.len()];
            let asked = pool.install(|| {
                index.visible_fractions(
                    &batch,
                    ReceiverSide::Front,
                    light,
                    &sampling,
                    &mut fractions,
                )
            });
            asked.unwrap();
            fractions
        };
        let found = fractions(1);
        assert_eq!(found, fractions(3));
        let mut samples = LightSamples::default();
        for (row, &fraction) in found.iter().enumerate() {
            let start = ReceiverPoint {
                point: points[row].into(),
                surface: Some(SurfaceId(faces[row])),
            };
            let mut counters = Counters::default();
            let (side, row) = (ReceiverSide::Front, row as u64);
            index
                .sample_light(
                    &start,
                    side,
                    light,
                    row,
                    &sampling,
                    &mut samples,
                    &mut counters,
                )
                .unwrap();
            assert_eq!(fraction, samples.visible_fraction() as f32);
        }
    }
}

#[test]
fn samples_behind_the_receivers_plane_are_dark_and_not_asked() {
    let index = index(Method::Bvh);
    // A lamp that stands upright, half of it below the floor, far from everything.
    let edges = [v(0.0, 0.0, 2.0), v(0.0, 2.0, 0.0)];
    let lamp = AreaShape::Rectangle(RectangleLight::new(v(-3.9, -3.0, 0.0), edges, true).unwrap());
    let start = ReceiverPoint {
        point: v(3.0, -3.0, 0.0),
        surface: Some(SurfaceId(0)),
    };
    let mut samples = LightSamples::default();
    let mut ask = |side| {
        let sampling = LightSampling::new(64);
        let mut counters = Counters::default();
        index
            .sample_light(
                &start,
                side,
                &lamp,
                0,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        (samples.queried().len(), samples.visible_fraction())
    };
    assert_eq!(ask(ReceiverSide::Front), (32, 0.5));
    assert_eq!(ask(ReceiverSide::Back), (32, 0.5));
    assert_eq!(ask(ReceiverSide::Both), (64, 1.0));
    assert_eq!(ask(ReceiverSide::Normal(v(0.0, 0.0, -1.0))), (32, 0.5));
    assert_eq!(ask(ReceiverSide::Normal(DVec3::ZERO)), (0, 0.0));
}

#[test]
fn a_mesh_never_blocks_its_own_light_but_blocks_what_is_behind_it() {
    // Tilted lamps, far from the origin, so that samples are rounded off their planes.
    let mut random = Random(11);
    let mut partly = 0;
    for round in 0..200 {
        let far = if round % 2 == 0 { 0.0 } else { 1e5 };
        let offset = v(far, -far, far);
        let corner = |random: &mut Random| offset + random.in_cube();
        let lamp = [
            corner(&mut random),
            corner(&mut random),
            corner(&mut random),
        ];
        let mut builder = Occluders::builder();
        builder.add_face(&lamp, Opacity::Opaque).unwrap();
        let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new())
            .build()
            .unwrap();
        let Ok(light) = MeshLight::new(vec![lamp], true) else {
            continue;
        };
        let light = AreaShape::Mesh(Arc::new(light));
        let start = ReceiverPoint {
            point: offset + 3.0 * random.in_cube(),
            surface: None,
        };
        let mut samples = LightSamples::default();
        let mut counters = Counters::default();
        let sampling = LightSampling::new(64);
        let side = ReceiverSide::Both;
        index
            .sample_light(
                &start,
                side,
                &light,
                round,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        assert_eq!(
            samples.lit_count(),
            samples.queried().len() as u32,
            "{lamp:?} {start:?}"
        );
        // Without the care for the own face, rounding hides some.
        let plain = AreaShape::Triangle(TriangleLight::new(lamp, true).unwrap());
        index
            .sample_light(
                &start,
                side,
                &plain,
                round,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
        partly += u32::from(samples.lit_count() < samples.queried().len() as u32);
    }
    assert!(partly > 10, "{partly}");
}

#[test]
fn what_has_no_answer_is_refused() {
    let index = index(Method::Auto);
    let light = &lights()[0];
    let mut samples = LightSamples::default();
    let mut ask = |point, surface| {
        let start = ReceiverPoint { point, surface };
        let sampling = LightSampling::new(4);
        let (side, mut counters) = (ReceiverSide::Front, Counters::default());
        index.sample_light(
            &start,
            side,
            light,
            0,
            &sampling,
            &mut samples,
            &mut counters,
        )
    };
    assert!(matches!(
        ask(DVec3::NAN, None),
        Err(QueryError::BadPoint(_))
    ));
    let missing = ask(DVec3::ZERO, Some(SurfaceId(99_999)));
    assert_eq!(missing, Err(QueryError::UnknownSurface(99_999)));
    assert_eq!(ask(DVec3::ZERO, None), Ok(()));

    let points = [[0.0, 0.0, 1.0], [0.0, f64::NAN, 0.0]];
    let batch = Batch::free(&points);
    let sampling = LightSampling::new(4);
    let fractions = |out: &mut [f32]| {
        index.visible_fractions(&batch, ReceiverSide::Front, light, &sampling, out)
    };
    assert!(matches!(
        fractions(&mut [0.0]),
        Err(BatchError::Length { .. })
    ));
    assert!(fractions(&mut [0.0; 2]).is_err());
}

#[test]
fn sample_counts_out_of_range_are_taken_as_the_nearest() {
    assert_eq!(LightSampling::new(0).count(), 1);
    assert_eq!(LightSampling::new(u32::MAX).count(), 65_536);
    // The reference's answer for a lone sample.
    let index = index(Method::Naive);
    let light = &lights()[0];
    let mut samples = LightSamples::default();
    let start = starts(2)[0];
    let (side, mut counters) = (ReceiverSide::Both, Counters::default());
    index
        .sample_light(
            &start,
            side,
            light,
            0,
            &LightSampling::new(0),
            &mut samples,
            &mut counters,
        )
        .unwrap();
    assert_eq!(samples.total(), 1);
    let expected = by_reference(&occluders(), &start, samples.queried());
    assert_eq!(samples.lit_count() == 1, expected == [true]);
}

/// Returns for each sample whether the reference finds a light in its place lit.
fn by_reference(
    occluders: &Arc<Occluders>,
    start: &ReceiverPoint,
    samples: &[AreaSample],
) -> Vec<bool> {
    let targets = samples.iter().map(|sample| sample.target).collect();
    let index = ShadowIndex::builder(Arc::clone(occluders), targets)
        .method(Method::Naive)
        .build()
        .unwrap();
    (0..samples.len())
        .map(|light| {
            index.shadow_by_reference(start, LightId::from_index(light)) == Ok(Shadow::Lit)
        })
        .collect()
}
