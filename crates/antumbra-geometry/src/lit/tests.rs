use super::*;
use crate::{
    DiskLight, MeshLight, Opacity, RectangleLight, SegmentLight, Sphere, SphereLight, SunDisc,
    TriangleLight,
};
use std::sync::Arc;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn scene(faces: &[&[DVec3]]) -> Occluders {
    let mut builder = Occluders::builder();
    for face in faces {
        builder.add_face(face, Opacity::Opaque).unwrap();
    }
    builder.build()
}

/// Shows all surfaces to a light and returns what is left.
fn shares(
    occluders: &Occluders,
    start: &ReceiverPoint,
    horizon: Horizon,
    light: &AreaShape,
) -> Option<Shares> {
    let mut view = LightView::new(occluders, start, horizon, light)?;
    for part in 0..view.part_count() {
        for surface in occluders.surfaces() {
            if view.meet(part, surface) == Meeting::Unclear {
                return None;
            }
        }
    }
    view.shares()
}

fn free(point: DVec3) -> ReceiverPoint {
    ReceiverPoint {
        point,
        surface: None,
    }
}

fn square(half: f64, z: f64) -> [DVec3; 4] {
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| v(x, y, z))
}

/// A lamp of 2 x 2 at height 4 that shines down.
fn lamp() -> AreaShape {
    let edges = [v(0.0, 2.0, 0.0), v(2.0, 0.0, 0.0)];
    AreaShape::Rectangle(RectangleLight::new(v(0.0, 0.0, 4.0), edges, false).unwrap())
}

#[test]
fn a_light_behind_triangles_that_share_an_edge_is_wholly_hidden() {
    // No f64 meets the diagonal or its projections; a sliver would be left of any rounded cut.
    for tilt in [0.0, 0.1, 1.0 / 3.0] {
        let plate = square(1.1, 2.0).map(|p| p + v(0.0, 0.0, tilt * p.x));
        let scene = scene(&[&plate]);
        for offset in [0.0, 0.017, -0.1] {
            let start = free(v(offset, 0.3 * offset, 0.1));
            let found = shares(&scene, &start, Horizon::Open, &lamp()).unwrap();
            assert_eq!((found.asked, found.lit), (1.0, 0.0), "{tilt} {offset}");
        }
    }
}

#[test]
fn a_light_that_nothing_hides_is_wholly_visible() {
    // The plate's shadow touches the lamp's border from outside.
    let plate = [
        v(0.5, -1.0, 2.0),
        v(2.0, -1.0, 2.0),
        v(2.0, 1.0, 2.0),
        v(0.5, 1.0, 2.0),
    ];
    let touching = scene(&[&plate]);
    let start = free(DVec3::ZERO);
    let found = shares(&touching, &start, Horizon::Open, &lamp()).unwrap();
    assert_eq!((found.asked, found.lit), (1.0, 1.0));
    // A hair further in, and less than everything is seen.
    let nearer = plate.map(|p| {
        if p.x == 0.5 {
            v(0.5_f64.next_down(), p.y, p.z)
        } else {
            p
        }
    });
    let found = shares(&scene(&[&nearer]), &start, Horizon::Open, &lamp()).unwrap();
    assert!(found.lit < 1.0 && found.lit > 1.0 - 1e-15, "{found:?}");
}

#[test]
fn what_hides_a_hair_of_a_light_at_map_coordinates_is_not_overlooked() {
    // Corners of the light are rounded there by more than what is hidden.
    let far = v(5_432_101.3, -412_345.7, 77.1);
    let edges = [v(0.1, 0.3, 0.01), v(0.3, -0.1, 0.02)];
    let light = RectangleLight::new(far + v(0.0, 0.0, 2.0), edges, true).unwrap();
    let light = AreaShape::Rectangle(light);
    let start = free(far);
    let mut hidden = 0;
    for step in -40..40 {
        // A plate at height 1 whose edge passes before the light's corner that is farthest along x.
        let corner = v(0.0, 0.0, 2.0) + 0.5 * (edges[0] + edges[1]);
        let reach = corner.x / corner.z + f64::from(step) * 2e-10;
        let plate = [
            far + v(reach, -9.0, 1.0),
            far + v(9.0, -9.0, 1.0),
            far + v(9.0, 9.0, 1.0),
            far + v(reach, 9.0, 1.0),
        ];
        let scene = scene(&[&plate]);
        let found = shares(&scene, &start, Horizon::Open, &light).unwrap();
        hidden += usize::from(found.lit < 1.0);
        if found.lit < 1.0 {
            assert!(found.lit > 1.0 - 1e-8, "{found:?}");
        }
    }
    // Coordinates are rounded to 1e-9: it begins about in the middle of the steps.
    assert!(hidden > 20 && hidden < 60, "{hidden}");
}

#[test]
fn halves_and_quarters_of_lights_of_all_shapes() {
    // A large plate that ends on the x axis, between the point and the lights.
    let plate = [
        v(-9.0, 0.0, 2.0),
        v(9.0, 0.0, 2.0),
        v(9.0, 9.0, 2.0),
        v(-9.0, 9.0, 2.0),
    ];
    let wall = [
        v(0.0, -9.0, 1.0),
        v(9.0, -9.0, 1.0),
        v(9.0, 9.0, 1.0),
        v(0.0, 9.0, 1.0),
    ];
    let start = free(DVec3::ZERO);
    let triangle = [v(-1.0, -1.0, 4.0), v(0.0, 1.0, 4.0), v(1.0, -1.0, 4.0)];
    let lights = [
        (lamp(), 0.5, 0.25),
        (
            AreaShape::Disk(DiskLight::new(v(0.0, 0.0, 4.0), -DVec3::Z, 0.7, false).unwrap()),
            0.5,
            0.25,
        ),
        (
            AreaShape::SunDisc(SunDisc::new(DVec3::Z, 0.53).unwrap()),
            0.5,
            0.25,
        ),
        (
            AreaShape::SunDisc(SunDisc::new(DVec3::Z, 60.0).unwrap()),
            0.5,
            0.25,
        ),
        // Below the axis is a trapezoid of 1.5 out of 2.
        (
            AreaShape::Triangle(TriangleLight::new(triangle, false).unwrap()),
            0.75,
            0.375,
        ),
        (
            AreaShape::Mesh(Arc::new(
                MeshLight::new(vec![triangle, triangle], true).unwrap(),
            )),
            0.75,
            0.375,
        ),
        (
            AreaShape::Segment(SegmentLight::new([v(0.0, -1.0, 4.0), v(0.0, 3.0, 4.0)]).unwrap()),
            0.25,
            0.0,
        ),
    ];
    for (light, half, quarter) in lights {
        for (faces, expected) in [
            (vec![&plate[..]], half),
            (vec![&plate[..], &wall[..]], quarter),
            // Twice in the way is no more than once.
            (vec![&plate[..], &plate[..], &wall[..], &plate[..]], quarter),
        ] {
            // The segment's own plane is the wall's end: there it decides nothing.
            if matches!(light, AreaShape::Segment(_)) && faces.len() > 1 {
                continue;
            }
            let found = shares(&scene(&faces), &start, Horizon::Open, &light).unwrap();
            assert_eq!(found.asked, 1.0);
            assert!(
                (found.lit - expected).abs() < 1e-14,
                "{} {found:?} {expected}",
                light.kind()
            );
        }
    }
}

#[test]
fn the_receivers_plane_cuts_the_light() {
    let floor = square(9.0, 0.0);
    let scene = scene(&[&floor]);
    let edges = [v(0.0, 0.0, 3.0), v(0.0, 2.0, 0.0)];
    let upright = RectangleLight::new(v(5.0, 0.0, 0.5), edges, true).unwrap();
    let upright = AreaShape::Rectangle(upright);
    let start = ReceiverPoint {
        point: v(0.1, 0.2, 0.0),
        surface: Some(SurfaceId(0)),
    };
    let ask = |horizon| shares(&scene, &start, horizon, &upright).unwrap();
    let close = |found: Shares, expected: f64| {
        assert!(
            (found.asked - expected).abs() < 1e-15 && found.lit == found.asked,
            "{found:?}"
        );
    };
    close(ask(Horizon::Front), 2.0 / 3.0);
    close(ask(Horizon::Back), 1.0 / 3.0);
    assert_eq!(
        ask(Horizon::Open),
        Shares {
            asked: 1.0,
            lit: 1.0
        }
    );
    close(ask(Horizon::Normal(v(0.0, 1.0, 0.0))), 0.4);
    // In the light's plane, and behind a light that shines to one side.
    let dark = Shares::default();
    assert_eq!(ask(Horizon::Normal(DVec3::ZERO)), dark);
    let beside = free(v(5.0, 9.0, 0.5));
    assert_eq!(shares(&scene, &beside, Horizon::Open, &upright), Some(dark));
    assert_eq!(
        shares(&scene, &free(v(0.0, 0.0, 9.0)), Horizon::Open, &lamp()),
        Some(dark)
    );
}

#[test]
fn what_has_no_closed_form_is_left_to_samples() {
    let mut builder = Occluders::builder();
    let ball = Sphere {
        center: v(0.0, 0.0, 2.0),
        radius: 0.5,
    };
    builder.add_sphere(ball, Opacity::Opaque).unwrap();
    let occluders = builder.build();
    assert_eq!(
        shares(&occluders, &free(DVec3::ZERO), Horizon::Open, &lamp()),
        None
    );
    // Far beside it the ball is in no one's way.
    let beside = shares(&occluders, &free(v(9.0, 0.0, 0.0)), Horizon::Open, &lamp());
    assert_eq!(
        beside,
        Some(Shares {
            asked: 1.0,
            lit: 1.0
        })
    );
    // From its own front a ball hides nothing; from its back only the own rule knows.
    let on_ball = ReceiverPoint {
        point: v(0.0, 0.0, 2.5),
        surface: Some(SurfaceId(0)),
    };
    let front = shares(&occluders, &on_ball, Horizon::Front, &lamp());
    assert_eq!(
        front,
        Some(Shares {
            asked: 1.0,
            lit: 1.0
        })
    );
    assert_eq!(shares(&occluders, &on_ball, Horizon::Open, &lamp()), None);
    let light = AreaShape::Sphere(SphereLight::new(v(0.0, 0.0, 9.0), 1.0).unwrap());
    assert_eq!(shares(&occluders, &on_ball, Horizon::Front, &light), None);
}

#[test]
fn lit_intervals_of_a_segment_are_those_between_shadows() {
    // Bars across a tube lamp: shadows of 1/4 each, two of which touch and two overlap.
    let bar = |from: f64, to: f64| {
        [
            v(from, -1.0, 2.0),
            v(to, -1.0, 2.0),
            v(to, 1.0, 2.0),
            v(from, 1.0, 2.0),
        ]
    };
    let bars = [
        bar(0.5, 1.0),
        bar(1.0, 1.5),
        bar(1.25, 1.75),
        bar(3.0, 3.25),
    ];
    let faces: Vec<&[DVec3]> = bars.iter().map(|bar| &bar[..]).collect();
    let occluders = scene(&faces);
    let light = SegmentLight::new([v(0.0, 0.0, 4.0), v(8.0, 0.0, 4.0)]).unwrap();
    let start = free(DVec3::ZERO);
    let mut view = LightView::new(
        &occluders,
        &start,
        Horizon::Open,
        &AreaShape::Segment(light),
    )
    .unwrap();
    for surface in occluders.surfaces() {
        assert_ne!(view.meet(0, surface), Meeting::Unclear);
    }
    let expected = vec![[0.0, 0.125], [0.4375, 0.75], [0.8125, 1.0]];
    assert_eq!(view.intervals(), Some(expected));
    let found = view.shares().unwrap();
    assert_eq!((found.asked, found.lit), (1.0, 0.625));
}
