use super::*;
use crate::Opacity;

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

fn plate(from: f64, to: f64, z: f64) -> [DVec3; 4] {
    [
        v(from, -1.0, z),
        v(to, -1.0, z),
        v(to, 1.0, z),
        v(from, 1.0, z),
    ]
}

fn lit(occluders: &Occluders, points: [DVec3; 2], light: LightShape) -> Vec<[f64; 2]> {
    let mut shadows = SegmentShadows::new(occluders, points, &light);
    for surface in occluders.surfaces() {
        shadows.meet(surface);
    }
    let mut intervals = Vec::new();
    assert_eq!(shadows.finish(&mut intervals), Ok(()));
    intervals
}

const UP: LightShape = LightShape::Direction(DVec3::Z);

#[test]
fn plates_under_the_sun_shade_what_is_below_them() {
    // Two that touch, two that overlap, one beside the segment and one below it.
    let plates = [
        plate(1.0, 2.0, 1.0),
        plate(2.0, 3.0, 1.0),
        plate(2.5, 4.0, 2.0),
        plate(6.0, 7.0, 9.0),
        plate(4.5, 5.0, -1.0),
    ];
    let faces: Vec<&[DVec3]> = plates.iter().map(|plate| &plate[..]).collect();
    let occluders = scene(&faces);
    let points = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0)];
    let expected = vec![[0.0, 0.125], [0.5, 0.75], [0.875, 1.0]];
    assert_eq!(lit(&occluders, points, UP), expected);
    let back = [points[1], points[0]];
    let expected = vec![[0.0, 0.125], [0.25, 0.5], [0.875, 1.0]];
    assert_eq!(lit(&occluders, back, UP), expected);
    // From below nothing but the lowest plate is in the way.
    let down = LightShape::Direction(-DVec3::Z);
    let expected = vec![[0.0, 0.5625], [0.625, 1.0]];
    assert_eq!(lit(&occluders, points, down), expected);
    // A lamp at height 2 doubles the shadows of plates at height 1, and the others are above it.
    let lamp = LightShape::Point(v(0.0, 0.0, 2.0));
    let expected = vec![[0.0, 0.25], [0.75, 1.0]];
    assert_eq!(lit(&occluders, points, lamp), expected);
}

#[test]
fn a_segment_through_a_plate_is_lit_on_one_side() {
    let occluders = scene(&[&plate(-1.0, 1.0, 1.0)]);
    let through = [v(0.25, 0.25, 4.0), v(0.25, 0.25, 0.0)];
    assert_eq!(lit(&occluders, through, UP), vec![[0.0, 0.75]]);
    // In the plate, all of it; along its edge; in its plane, outside.
    let within = [v(-0.5, 0.0, 1.0), v(0.5, 0.0, 1.0)];
    assert_eq!(lit(&occluders, within, UP), vec![[0.0, 1.0]]);
    // Edge-on faces shade nothing.
    let beside = LightShape::Direction(DVec3::X);
    assert_eq!(lit(&occluders, within, beside), vec![[0.0, 1.0]]);
    // Under an edge, all along it, and under a corner, at which the shadow has no length.
    let under_edge = [v(-2.0, 1.0, 0.0), v(2.0, 1.0, 0.0)];
    let expected = vec![[0.0, 0.25], [0.75, 1.0]];
    assert_eq!(lit(&occluders, under_edge, UP), expected);
    let under_corner = [v(0.0, 2.0, 0.0), v(2.0, 0.0, 0.0)];
    assert_eq!(lit(&occluders, under_corner, UP), vec![[0.0, 1.0]]);
}

#[test]
fn segments_that_hold_the_light_or_have_no_length() {
    let occluders = scene(&[&plate(-1.0, 1.0, 1.0)]);
    let lamp = v(0.0, 0.0, 2.0);
    let light = LightShape::Point(lamp);
    // Past the light, and down through the plate.
    let past = [v(0.0, 0.0, 4.0), v(0.0, 0.0, 0.0)];
    assert_eq!(lit(&occluders, past, light), vec![[0.0, 0.75]]);
    let beside = [v(0.25, 0.0, 4.0), v(-0.25, 0.0, 0.0)];
    assert_eq!(lit(&occluders, beside, light), vec![[0.0, 0.75]]);
    for (point, expected) in [
        (v(0.0, 0.0, 0.0), vec![]),
        (v(0.0, 0.0, 1.0), vec![[0.0, 1.0]]),
        (lamp, vec![[0.0, 1.0]]),
    ] {
        assert_eq!(lit(&occluders, [point; 2], light), expected, "{point}");
    }
    // A sun along the segment: all of it is behind the plate, or before it.
    let along = [v(0.5, 0.0, -3.0), v(0.5, 0.0, 3.0)];
    let expected = vec![[2.0 / 3.0, 1.0]];
    assert_eq!(lit(&occluders, along, UP), expected);
}

#[test]
fn ends_are_rounded_once() {
    // The shadow begins at a third of the way: the nearest number is asked for.
    let occluders = scene(&[&plate(1.0, 3.0, 1.0)]);
    let points = [v(0.0, 0.0, 0.0), v(3.0, 0.0, 0.0)];
    assert_eq!(lit(&occluders, points, UP), vec![[0.0, 1.0 / 3.0]]);
    let far = [v(0.0, 0.0, 0.0), v(7e9, 0.0, 0.0)];
    let expected = vec![[0.0, 1.0 / 7e9], [3.0 / 7e9, 1.0]];
    assert_eq!(lit(&occluders, far, UP), expected);
}

#[test]
fn gaps_of_one_rounding_are_there() {
    let mut second = plate(2.0, 3.0, 1.0);
    let points = [v(0.0, 0.0, 0.0), v(4.0, 0.0, 0.0)];
    for (edge, is_gap) in [
        (2.0_f64.next_up(), true),
        (2.0, false),
        (2.0_f64.next_down(), false),
    ] {
        second[0].x = edge;
        second[3].x = edge;
        let occluders = scene(&[&plate(1.0, 2.0, 1.5), &second]);
        let mut expected = vec![[0.0, 0.25], [0.75, 1.0]];
        if is_gap {
            expected.insert(1, [0.5, 0.5_f64.next_up()]);
        }
        assert_eq!(lit(&occluders, points, UP), expected, "{edge}");
    }
}

#[test]
fn a_ball_and_a_plate_shade_together() {
    let mut builder = Occluders::builder();
    builder
        .add_face(&plate(1.0, 2.0, 1.0), Opacity::Opaque)
        .unwrap();
    let ball = |x: f64, y: f64| crate::Sphere {
        center: v(x, y, 2.0),
        radius: 0.625,
    };
    // One touches the plate's shadow, one does not reach the segment, one shades less than it is wide.
    for sphere in [ball(2.625, 0.0), ball(4.0, 0.625), ball(6.0, 0.375)] {
        builder.add_sphere(sphere, Opacity::Opaque).unwrap();
    }
    let occluders = builder.build();
    let points = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0)];
    let expected = vec![[0.0, 0.125], [0.40625, 0.6875], [0.8125, 1.0]];
    assert_eq!(lit(&occluders, points, UP), expected);
    // Above the first ball nothing is in the way; in it all is dark.
    let down = [v(2.625, 0.0, 3.0), v(2.625, 0.0, 1.0)];
    assert_eq!(lit(&occluders, down, UP), vec![[0.0, 0.1875]]);
}

/// Numbers from -1 to 1 by a linear congruence: enough here.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn point(&mut self) -> DVec3 {
        v(self.next(), self.next(), self.next())
    }
}

#[test]
fn shadows_lie_where_the_fan_and_the_hull_say() {
    let numbers = &mut Numbers(1);
    let (mut shaded, mut narrowed, mut missed, mut sided) = (0, 0, 0, [0; 2]);
    for number in 0..30_000 {
        let size = [1.0, 0.1, 10.0][number % 3];
        let place = [0.0, 0.0, 1e6][number / 7 % 3] * v(1.0, -2.0, 0.5);
        let points = [(); 2].map(|()| place + numbers.point());
        let light = match number % 5 {
            0 | 1 => LightShape::Direction(numbers.point()),
            2 => LightShape::Point(place + 1e4 * numbers.point()),
            _ => LightShape::Point(place + 2.0 * numbers.point()),
        };
        // On the way from a point of the segment's line to the light, or anywhere.
        let on_line = points[0] + (points[1] - points[0]) * (0.5 + numbers.next());
        let towards = light.towards(on_line);
        let middle = on_line + towards.normalize() * numbers.next().abs();
        let corners = [(); 3].map(|()| middle + size * numbers.point());
        let occluders = scene(&[&corners]);
        let surface = SurfaceId(0);
        let shadows = SegmentShadows::new(&occluders, points, &light);
        let span = shadows.shaded_by(surface, &corners);
        let reach = shadows.fan().and_then(|fan| fan.reach(&corners));
        if shadows.hull.misses(&corners) {
            missed += 1;
            assert!(span.is_none(), "{corners:?} {points:?} {light:?}");
        }
        let Some(span) = span else { continue };
        shaded += 1;
        let Some([least, most]) = reach else { continue };
        narrowed += usize::from(least > 0.0 || most < 1.0);
        let is_inside =
            least < span.begin.place + span.begin.error && span.end.place - span.end.error < most;
        assert!(is_inside, "{corners:?} {points:?} {light:?}");
        // What is around the corners is on one side of planes that are far enough from the shadow, and on no other.
        let reaches = corners.map(|corner| (corner - middle).abs().max_element());
        let reach = reaches.into_iter().fold(0.0, f64::max);
        for is_beyond in [true, false] {
            let share = if is_beyond { least } else { most } + 0.1 * numbers.next();
            let fan = shadows.fan().expect("it has a reach");
            let Some((normal, height)) = fan.half_space(share, is_beyond, middle, reach) else {
                continue;
            };
            let is_below = |&corner: &DVec3| normal.dot(corner - middle) < height;
            if corners.iter().all(is_below) {
                sided[usize::from(is_beyond)] += 1;
                let is_there = if is_beyond {
                    share < span.begin.place + span.begin.error
                } else {
                    span.end.place - span.end.error < share
                };
                assert!(is_there, "{corners:?} {points:?} {light:?} {share}");
            }
        }
    }
    assert!(
        shaded > 5_000 && narrowed > 1_000 && missed > 1_000,
        "{shaded} {narrowed} {missed}"
    );
    assert!(sided.iter().all(|&count| count > 1_000), "{sided:?}");
}

/// A ball, a disk or a cone.
fn curved(number: usize, middle: DVec3, numbers: &mut Numbers) -> Occluders {
    let mut builder = Occluders::builder();
    let radius = numbers.next().abs();
    let added = match number % 3 {
        0 => builder.add_sphere(
            crate::Sphere {
                center: middle,
                radius,
            },
            Opacity::Opaque,
        ),
        1 => builder.add_disk(
            crate::Disk {
                center: middle,
                normal: numbers.point(),
                radius,
            },
            Opacity::Opaque,
        ),
        _ => builder.add_cone(
            crate::Cone {
                base: middle,
                base_radius: radius,
                apex: middle + numbers.point(),
                apex_radius: numbers.next().max(0.0),
                is_closed: false,
            },
            Opacity::Opaque,
        ),
    };
    added.unwrap();
    builder.build()
}

#[test]
fn curved_shadows_lie_where_the_fan_and_the_hull_say() {
    let numbers = &mut Numbers(2);
    let (mut shaded, mut missed) = (0, 0);
    for number in 0..20_000 {
        let place = [0.0, 0.0, 1e6][number / 15 % 3] * v(1.0, -2.0, 0.5);
        let points = [(); 2].map(|()| place + numbers.point());
        let light = match number / 3 % 5 {
            0 | 1 => LightShape::Direction(numbers.point()),
            2 => LightShape::Point(place + 1e4 * numbers.point()),
            _ => LightShape::Point(place + 2.0 * numbers.point()),
        };
        let on_line = points[0] + (points[1] - points[0]) * (0.5 + numbers.next());
        let towards = light.towards(on_line);
        let aside = [0.1, 1.0, 3.0][number % 7 % 3] * numbers.point();
        let middle = on_line + towards.normalize() * numbers.next().abs() + aside;
        let occluders = curved(number, middle, numbers);
        let surface = SurfaceId(0);
        let shadows = SegmentShadows::new(&occluders, points, &light);
        let bounds = occluders.surface_bounds(surface);
        let reach = shadows.fan().and_then(|fan| fan.reach(&bounds.corners()));
        let is_missed = shadows.misses_curved(surface);
        missed += usize::from(is_missed);
        let label = format!("{bounds:?} {points:?} {light:?}");
        for_each_shadow(&shadows.ends, &occluders, surface, |span| {
            shaded += 1;
            assert!(!is_missed, "{label}");
            if let Some([least, most]) = reach {
                assert!(least < span.begin.place + span.begin.error, "{label}");
                assert!(span.end.place - span.end.error < most, "{label}");
            }
        });
    }
    assert!(shaded > 5_000 && missed > 1_000, "{shaded} {missed}");
}
