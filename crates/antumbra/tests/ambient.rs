//! Ambient occlusion and the sky view factor: closed forms, and the reference's bit for every direction.

mod common;

use std::sync::Arc;

use antumbra::{Batch, BatchKind, LightSampling, Method, ReceiverSide, ShadowIndex};
use antumbra_geometry::{DVec3, Occluders, Opacity, Sky, Sphere};
use common::{METHODS, Random};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A floor of 2 x 2 around the origin, far below a plate of 2 x 2 at height 1.
fn plates() -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    for z in [0.0, 1.0] {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| v(x, y, z));
        builder.add_face(&corners, Opacity::Opaque).unwrap();
    }
    Arc::new(builder.build())
}

fn index(occluders: &Arc<Occluders>, method: Method) -> ShadowIndex {
    common::builder_of(occluders, &[], method).build().unwrap()
}

fn up() -> Sky {
    Sky::new(DVec3::Z).unwrap()
}

#[test]
fn a_square_overhead_hides_its_form_factor() {
    // Of a small horizontal patch and a parallel square of half-width 1 at distance 1 above its middle (Howell, B-3).
    let edge = 1.0 / 2.0_f64.sqrt();
    let expected = 4.0 / std::f64::consts::PI * edge * edge.atan();
    let index = index(&plates(), Method::Auto);
    let points = [[0.0, 0.0, 0.0]];
    let sampling = LightSampling::new(65_536);
    let side = ReceiverSide::Front;
    let mut open = [0.0];
    for kind in [
        BatchKind::OnSurfaces {
            surfaces: &[0_u32],
            tolerance: None,
        },
        BatchKind::Facing {
            normals: &[[0.0, 0.0, 3.0]],
        },
    ] {
        let batch = Batch {
            points: &points,
            kind,
        };
        index
            .ambient_occlusion(&batch, side, None, &sampling, &mut open)
            .unwrap();
        assert!(
            (f64::from(open[0]) - (1.0 - expected)).abs() < 1e-3,
            "{open:?}"
        );
        index
            .sky_view_factor(&batch, side, &up(), &sampling, &mut open)
            .unwrap();
        assert!(
            (f64::from(open[0]) - (1.0 - expected)).abs() < 1e-3,
            "{open:?}"
        );
        // What is farther away than that does not count.
        index
            .ambient_occlusion(&batch, side, Some(0.99), &sampling, &mut open)
            .unwrap();
        assert_eq!(open, [1.0]);
    }
    // From the back of the floor, below the ground: all is open, and there is no sky.
    let batch = Batch::on_surfaces(&points, &[0_u32]);
    let side = ReceiverSide::Back;
    index
        .ambient_occlusion(&batch, side, None, &sampling, &mut open)
        .unwrap();
    assert_eq!(open, [1.0]);
    index
        .sky_view_factor(&batch, side, &up(), &sampling, &mut open)
        .unwrap();
    assert_eq!(open, [0.0]);
}

#[test]
fn points_of_space_look_all_around_and_their_ground_is_level() {
    let index = index(&plates(), Method::Auto);
    // Half way between the plates each hides a solid angle of a cube's face seen from a sixth... of 2 x 2 at 1 / 2.
    let half: f64 = 0.5;
    let solid = 4.0 * (1.0 / (half * (2.0 + half * half).sqrt())).atan();
    let expected = 1.0 - 2.0 * solid / (4.0 * std::f64::consts::PI);
    let points = [[0.0_f64, 0.0, 0.5], [0.0, 0.0, 1.5]];
    let sampling = LightSampling::new(65_536);
    let mut open = [0.0; 2];
    let side = ReceiverSide::Front;
    index
        .ambient_occlusion(&Batch::free(&points), side, None, &sampling, &mut open)
        .unwrap();
    assert!(
        (f64::from(open[0]) - expected).abs() < 1e-3,
        "{open:?} {expected}"
    );
    index
        .sky_view_factor(&Batch::free(&points), side, &up(), &sampling, &mut open)
        .unwrap();
    assert_eq!(open[1], 1.0, "nothing is above");
    assert!(open[0] < 0.3, "{open:?}");
    // A free wall sees half of the sky, and a zero normal nothing.
    let normals = [[1.0, 0.0, 0.0], [0.0; 3]];
    let far = [[50.0_f64, 0.0, 50.0], [50.0, 0.0, 50.0]];
    let kind = BatchKind::Facing { normals: &normals };
    let batch = Batch { points: &far, kind };
    index
        .sky_view_factor(&batch, side, &up(), &sampling, &mut open)
        .unwrap();
    assert!(
        (f64::from(open[0]) - 0.5).abs() < 1e-3 && open[1] == 0.0,
        "{open:?}"
    );
    index
        .ambient_occlusion(&batch, side, None, &sampling, &mut open)
        .unwrap();
    assert_eq!(open, [1.0, 0.0]);
}

#[test]
fn values_are_the_same_for_every_method_and_number_of_threads() {
    let mut random = Random(3);
    let mut builder = Occluders::builder();
    for _ in 0..40 {
        let center = 3.0 * random.in_cube();
        let corners = [(); 3].map(|()| center + random.in_cube());
        builder.add_face(&corners, Opacity::Opaque).unwrap();
    }
    let center = v(0.0, 0.0, 1.0);
    let ball = Sphere {
        center,
        radius: 0.8,
    };
    builder.add_sphere(ball, Opacity::Opaque).unwrap();
    let occluders = Arc::new(builder.build());
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for _ in 0..120 {
        let face = random.below(occluders.surface_count()) as u32;
        points.push(
            occluders
                .start_on(face.into(), 3.0 * random.in_cube())
                .point
                .to_array(),
        );
        faces.push(face);
    }
    let kind = BatchKind::OnSurfaces {
        surfaces: &faces,
        tolerance: Some(f64::INFINITY),
    };
    let batch = Batch {
        points: &points,
        kind,
    };
    let sampling = LightSampling::new(70);
    let values = |method, threads| {
        let index = index(&occluders, method);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (mut open, mut sky) = (vec![9.0; points.len()], vec![9.0; points.len()]);
        pool.install(|| {
            let side = ReceiverSide::Front;
            index
                .ambient_occlusion(&batch, side, Some(1.0), &sampling, &mut open)
                .unwrap();
            index
                .sky_view_factor(&batch, side, &up(), &sampling, &mut sky)
                .unwrap();
        });
        (open, sky)
    };
    let expected = values(Method::Naive, 1);
    assert!(expected.0.iter().any(|&open| open > 0.1 && open < 0.9));
    for method in METHODS {
        assert_eq!(values(method, 2), expected, "{method:?}");
    }
}
