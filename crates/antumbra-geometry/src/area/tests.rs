//! Laws of samples: where they lie, how evenly, and what is refused.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::light::LightShape;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Lights of all shapes, about the same place, and a receiver that all of them shine to.
fn all_shapes() -> (Vec<AreaShape>, DVec3) {
    let corners = [v(0.0, 0.0, 0.1), v(2.0, 0.0, 0.1), v(0.5, 1.5, 0.1)];
    let five = [
        v(0.0, 0.0, 0.0),
        v(1.0, 0.0, 0.0),
        v(1.5, 0.5, 0.0),
        v(1.0, 1.0, 0.0),
        v(0.0, 1.0, 0.0),
    ];
    let shapes = vec![
        AreaShape::Segment(SegmentLight::new([v(0.0, 1.0, 2.0), v(3.0, -1.0, 1.0)]).unwrap()),
        AreaShape::Rectangle(
            RectangleLight::new(
                v(0.1, 0.2, 0.3),
                [v(2.0, 0.0, 0.1), v(0.3, 1.0, 0.0)],
                false,
            )
            .unwrap(),
        ),
        AreaShape::Triangle(TriangleLight::new(corners, false).unwrap()),
        AreaShape::Polygon(Arc::new(PolygonLight::new(five.to_vec(), false).unwrap())),
        AreaShape::Disk(DiskLight::new(v(0.0, 0.0, 1.0), v(0.2, -0.1, 3.0), 0.7, false).unwrap()),
        AreaShape::Sphere(SphereLight::new(v(1.0, 2.0, 3.0), 0.5).unwrap()),
        AreaShape::SunDisc(SunDisc::new(v(1.0, 2.0, 3.0), 6.0).unwrap()),
        AreaShape::Sky(Sky::new(v(0.0, 0.1, 2.0)).unwrap()),
        AreaShape::Mesh(Arc::new(
            MeshLight::new(vec![corners, corners.map(|c| c - v(5.0, 0.0, 0.3))], false).unwrap(),
        )),
    ];
    (shapes, v(0.3, 0.4, 50.0))
}

fn samples(shape: &AreaShape, receiver: DVec3, count: u32) -> Vec<AreaSample> {
    let scramble = SamplePattern { seed: 1 }.scramble(2, 3);
    (0..count)
        .filter_map(|i| shape.sample(receiver, SamplePattern::place(scramble, i)))
        .collect()
}

fn point(sample: &AreaSample) -> DVec3 {
    match sample.target {
        LightShape::Point(point) => point,
        LightShape::Direction(direction) => direction,
    }
}

/// Returns how far a sample is off its shape.
fn off(shape: &AreaShape, at: DVec3) -> f64 {
    let in_plane = |normal: DVec3, origin: DVec3| normal.dot(at - origin).abs();
    match shape {
        AreaShape::Segment(light) => {
            let [a, b] = light.ends();
            ((at - a).length() + (at - b).length() - light.length()).abs()
        }
        AreaShape::Rectangle(light) => {
            let [e, f] = light.edges();
            let from = at - light.center();
            // Coordinates along the edges, by their reciprocal vectors.
            let n = e.cross(f);
            let along = [f.cross(n), n.cross(e)].map(|r| from.dot(r) / n.length_squared());
            let beyond = along.map(|x| (x.abs() - 0.5).max(0.0));
            in_plane(light.normal(), light.center()) + beyond[0] + beyond[1]
        }
        AreaShape::Triangle(light) => {
            in_plane(light.normal(), light.corners()[0]) + outside(&light.corners(), at)
        }
        AreaShape::Polygon(light) => {
            in_plane(light.normal(), light.corners()[0]) + outside(light.corners(), at)
        }
        AreaShape::Disk(light) => {
            let beyond = ((at - light.center()).length() - light.radius()).max(0.0);
            in_plane(light.normal(), light.center()) + beyond
        }
        AreaShape::Sphere(light) => ((at - light.center()).length() - light.radius()).abs(),
        AreaShape::SunDisc(light) => {
            let angle = at.angle_between(light.towards_light()).to_degrees();
            (angle - 0.5 * light.diameter_degrees()).max(0.0) + (at.length() - 1.0).abs()
        }
        AreaShape::Sky(light) => (-at.dot(light.up())).max(0.0) + (at.length() - 1.0).abs(),
        AreaShape::Mesh(light) => light
            .triangles()
            .iter()
            .map(|t| {
                let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
                in_plane(n, t[0]) + outside(t, at)
            })
            .fold(f64::INFINITY, f64::min),
    }
}

/// Returns how far a point is beyond an edge of a convex outline, at most.
fn outside(corners: &[DVec3], at: DVec3) -> f64 {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[1]);
    (0..corners.len())
        .map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
            let inwards = normal.cross(b - a).normalize();
            -(at - a).dot(inwards)
        })
        .fold(0.0, f64::max)
}

#[test]
fn samples_lie_on_their_light() {
    let (shapes, receiver) = all_shapes();
    for shape in &shapes {
        let samples = samples(shape, receiver, 1024);
        assert_eq!(samples.len(), 1024, "{}", shape.kind());
        for sample in &samples {
            let at = point(sample);
            // 6 ulps of the receiver's distance: a sphere's samples are found from there.
            assert!(off(shape, at) < 1e-13, "{} {at}", shape.kind());
            assert!((0.0..=1.0).contains(&sample.emitted), "{}", shape.kind());
            assert!(sample.solid_angle > 0.0, "{}", shape.kind());
        }
    }
}

#[test]
fn samples_are_uniform_by_area() {
    // Moments of a uniform square come back, and each quarter of an area has a quarter of the samples.
    let count = 4096;
    let (shapes, receiver) = all_shapes();
    let share = |shape: &AreaShape, is_in: &dyn Fn(DVec3) -> bool| {
        let samples = samples(shape, receiver, count);
        samples.iter().filter(|s| is_in(point(s))).count() as f64 / f64::from(count)
    };
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 0.01, "{found} for {expected}");
    };
    for shape in &shapes {
        match shape {
            AreaShape::Segment(light) => {
                let [a, _] = light.ends();
                close(share(shape, &|p| p.distance(a) < 0.3 * light.length()), 0.3);
            }
            AreaShape::Rectangle(light) => {
                close(share(shape, &|p| p.y < light.center().y - 0.25), 0.25);
            }
            AreaShape::Triangle(light) => {
                // The part near a corner, cut at half the height, has a quarter of the area.
                let [.., top] = light.corners();
                close(share(shape, &|p| p.y > 0.5 * top.y), 0.25);
            }
            AreaShape::Polygon(_) => {
                close(share(shape, &|p| p.x > 1.0), 0.25 / 1.25);
                close(share(shape, &|p| p.x < 0.5 && p.y < 0.5), 0.25 / 1.25);
            }
            AreaShape::Disk(light) => {
                let inner = 0.6 * light.radius();
                close(share(shape, &|p| p.distance(light.center()) < inner), 0.36);
            }
            AreaShape::Sphere(light) => {
                // The inner half of the cone's solid angle; small cones are flat.
                let axis = light.center() - receiver;
                let most = (light.radius() / axis.length()).asin();
                let inner = 0.5_f64.sqrt() * most;
                close(
                    share(shape, &|p| (p - receiver).angle_between(axis) < inner),
                    0.5,
                );
            }
            AreaShape::SunDisc(light) => {
                let inner = (0.5 * 3.0_f64).to_radians();
                close(
                    share(shape, &|p| p.angle_between(light.towards_light()) < inner),
                    0.25,
                );
            }
            AreaShape::Sky(light) => {
                // By Archimedes heights are uniform.
                close(share(shape, &|p| p.dot(light.up()) < 0.3), 0.3);
            }
            AreaShape::Mesh(_) => close(share(shape, &|p| p.x < -3.0), 0.5),
        }
    }
}

#[test]
fn every_power_of_two_is_stratified_in_each_coordinate() {
    for point in 0..50 {
        let scramble = SamplePattern { seed: 9 }.scramble(point, 0);
        for count in [4_u32, 16, 64, 256] {
            for axis in 0..2 {
                let mut strata: Vec<u32> = (0..count)
                    .map(|i| (SamplePattern::place(scramble, i)[axis] * f64::from(count)) as u32)
                    .collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..count).collect::<Vec<_>>());
            }
        }
    }
}

#[test]
fn samples_are_the_same_bits_on_every_machine() {
    // Found once; a change of these changes every picture.
    let pattern = SamplePattern { seed: 7 };
    assert_ne!(pattern.scramble(0, 0), pattern.scramble(0, 1));
    assert_ne!(pattern.scramble(0, 0), pattern.scramble(1, 0));
    assert_ne!(
        pattern.scramble(1, 0),
        SamplePattern { seed: 8 }.scramble(1, 0)
    );
    let (shapes, receiver) = all_shapes();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for shape in &shapes {
        for sample in samples(shape, receiver, 64) {
            for number in point(&sample).to_array() {
                hash = (hash ^ number.to_bits()).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    assert_eq!(format!("{hash:016x}"), "ef0ba8e0e5e7f266");
}

#[test]
fn the_mean_solid_angle_is_that_of_the_light() {
    // A square of edge 2 over its centre at distance 1 is a face of a cube seen from the middle: 4 pi / 6.
    let square = RectangleLight::new(
        v(0.0, 0.0, 1.0),
        [v(2.0, 0.0, 0.0), v(0.0, -2.0, 0.0)],
        false,
    );
    let shape = AreaShape::Rectangle(square.unwrap());
    let found = samples(&shape, DVec3::ZERO, 4096);
    let mean: f64 = found.iter().map(|s| s.solid_angle).sum::<f64>() / 4096.0;
    assert!((mean - 4.0 * PI / 6.0).abs() < 1e-3, "{mean}");
    // A ball at twice its radius: 2 pi (1 - cos 30).
    let ball = AreaShape::Sphere(SphereLight::new(v(0.0, 0.0, 2.0), 1.0).unwrap());
    let one = samples(&ball, DVec3::ZERO, 1)[0];
    assert!((one.solid_angle - 2.0 * PI * (1.0 - 0.75_f64.sqrt())).abs() < 1e-12);
}

#[test]
fn flat_lights_shine_to_their_front_only_unless_they_are_two_sided() {
    let edges = [v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let make = |both| AreaShape::Rectangle(RectangleLight::new(DVec3::ZERO, edges, both).unwrap());
    let (front, back, level) = (v(0.1, 0.2, 1.0), v(0.1, 0.2, -1.0), v(3.0, 0.2, 0.0));
    let at = [0.25, 0.75];
    assert!(make(false).sample(front, at).is_some());
    assert!(make(false).sample(back, at).is_none());
    assert!(make(false).sample(level, at).is_none());
    assert!(make(true).sample(back, at).is_some());
    assert!(make(true).sample(level, at).is_none());
    let tiny = v(0.0, 0.0, 1e-300);
    assert!(make(false).sample(tiny, at).is_some());
    assert!(make(false).sample(-tiny, at).is_none());

    let inside_out = AreaShape::Rectangle(
        RectangleLight::new(DVec3::ZERO, [edges[1], edges[0]], false).unwrap(),
    );
    assert!(inside_out.sample(front, at).is_none());
    assert!(inside_out.sample(back, at).is_some());
}

#[test]
fn a_ball_gives_nothing_inside_and_at_its_surface() {
    let ball = AreaShape::Sphere(SphereLight::new(DVec3::ONE, 1.0).unwrap());
    for inside in [DVec3::ONE, v(1.5, 1.0, 1.0), v(2.0, 1.0, 1.0)] {
        assert_eq!(ball.sample(inside, [0.5, 0.5]), None);
    }
    assert!(
        ball.sample(v(2.0_f64.next_up(), 1.0, 1.0), [0.5, 0.5])
            .is_some()
    );
}

#[test]
fn samples_of_a_mesh_are_never_behind_their_own_triangle() {
    let mut state = 1_u64;
    let mut number = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut moved = 0;
    for round in 0..20_000 {
        let mut corner =
            || v(number(), number(), number()) + if round % 2 == 0 { 0.0 } else { 1e6 };
        let triangle = [corner(), corner(), corner()];
        let receiver = corner();
        let Ok(light) = MeshLight::new(vec![triangle], true) else {
            continue;
        };
        let (u, w) = (number() + 0.5, number() + 0.5);
        let Some(sample) = light.sample(receiver, u, w) else {
            continue;
        };
        let side = super::mesh::side_of(&triangle, receiver);
        assert_ne!(super::mesh::side_of(&triangle, point(&sample)), -side);
        let plain = super::triangle::point_of(&triangle, u, w);
        moved += u32::from(plain != point(&sample));
        assert!(plain.distance(point(&sample)) < 1e-8);
    }
    assert!(moved > 1000, "{moved}");
}

#[test]
fn what_is_no_light_is_refused_with_a_reason() {
    let edges = [v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let nan = v(0.0, f64::NAN, 0.0);
    let far = v(1e31, 0.0, 0.0);
    let text = |error: AreaError| error.to_string();
    let point_light = ": use a point or directional light for a light without size";
    let cases = [
        (
            RectangleLight::new(nan, edges, false).err().map(text),
            "the centre is not finite, or beyond 2^100".into(),
        ),
        (
            RectangleLight::new(DVec3::ZERO, [edges[0]; 2], false)
                .err()
                .map(text),
            format!("it has no area{point_light}"),
        ),
        (
            RectangleLight::new(DVec3::ZERO, [far, edges[1]], false)
                .err()
                .map(text),
            "an edge is not finite, or beyond 2^100".into(),
        ),
        (
            SegmentLight::new([DVec3::ONE; 2]).err().map(text),
            format!("its ends are the same point{point_light}"),
        ),
        (
            SegmentLight::new([DVec3::ONE, DVec3::INFINITY])
                .err()
                .map(text),
            "an end is not finite, or beyond 2^100".into(),
        ),
        (
            TriangleLight::new(
                [v(0.0, 0.0, 0.0), v(1.0, 1.0, 1.0), v(2.0, 2.0, 2.0)],
                false,
            )
            .err()
            .map(text),
            format!("it has no area{point_light}"),
        ),
        (
            DiskLight::new(DVec3::ZERO, DVec3::ZERO, 1.0, false)
                .err()
                .map(text),
            "the normal is zero; expected a direction".into(),
        ),
        (
            DiskLight::new(DVec3::ZERO, DVec3::Z, 0.0, false)
                .err()
                .map(text),
            format!("its radius is zero{point_light}"),
        ),
        (
            SphereLight::new(DVec3::ZERO, -2.0).err().map(text),
            "the radius is -2; expected above 0".into(),
        ),
        (
            SphereLight::new(DVec3::ZERO, f64::NAN).err().map(text),
            "the radius is not finite, or beyond 2^100".into(),
        ),
        (
            SphereLight::new(v(1e30, 0.0, 0.0), 1e30).err().map(text),
            "the surface is not finite, or beyond 2^100".into(),
        ),
        (
            SunDisc::new(DVec3::Z, 180.0).err().map(text),
            "the angular diameter is 180 degrees; expected above 0, below 180".into(),
        ),
        (
            SunDisc::new(DVec3::Z, 0.0).err().map(text),
            format!("its diameter is zero{point_light}"),
        ),
        (
            SunDisc::new(DVec3::ZERO, 1.0).err().map(text),
            "the direction towards the light is zero; expected a direction".into(),
        ),
        (
            Sky::new(nan).err().map(text),
            "up is not finite, or beyond 2^100".into(),
        ),
        (
            MeshLight::new(vec![], false).err().map(text),
            format!("it has no area{point_light}"),
        ),
        (
            PolygonLight::new(vec![DVec3::ZERO, DVec3::X], false)
                .err()
                .map(text),
            "a polygon needs at least 3 corners, found 2".into(),
        ),
    ];
    for (found, expected) in cases {
        assert_eq!(found, Some(expected));
    }
}

#[test]
fn polygons_that_are_not_convex_or_not_flat_are_refused() {
    let make = |corners: &[[f64; 3]]| {
        let corners = corners.iter().map(|&c| DVec3::from_array(c)).collect();
        PolygonLight::new(corners, false).map(|light| light.area())
    };
    let dart = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 2.0, 0.0],
    ];
    assert_eq!(make(&dart), Err(AreaError::NotConvex { corner: 2 }));
    let star: Vec<[f64; 3]> = (0..5)
        .map(|i| (f64::from(i) * 0.8 * PI).sin_cos())
        .map(|(y, x)| [x, y, 0.0])
        .collect();
    assert!(matches!(make(&star), Err(AreaError::NotConvex { .. })));
    let twisted = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.2],
        [0.0, 1.0, 0.0],
    ];
    assert!(matches!(make(&twisted), Err(AreaError::NotFlat { .. })));
    // A corner on a straight edge is fine, and so is a corner that is there twice.
    let straight = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    assert_eq!(make(&straight), Ok(2.0));
}
