//! Tests of the module above.

use antumbra_geometry::{Bounds, Occluders, Opacity, ReceiverPoint, SurfaceId};
use fearless_simd::{Level, dispatch};

use super::super::testing::Random;
use super::*;

const ONE: SurfaceId = SurfaceId(0);

fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

fn occluders_of(corners: [DVec3; 3]) -> Occluders {
    let mut builder = Occluders::builder();
    builder.add_face(&corners, Opacity::Opaque).expect("a face");
    builder.build()
}

fn is_blocked(occluders: &Occluders, point: DVec3, light: &LightShape) -> bool {
    let start = ReceiverPoint {
        point,
        surface: None,
    };
    occluders.blocks(ONE, &occluders.segment(&start, light))
}

/// A triangle somewhere in a scene: as large as that, small, or a sliver.
fn triangle(scene: &Bounds, random: &mut Random) -> [DVec3; 3] {
    let a = random.in_box(scene);
    let towards = |random: &mut Random, share: f64| a + share * (random.in_box(scene) - a);
    let share = random.pick(&[1.0, 1.0, 0.1, 1e-3, 1e-6]);
    let b = towards(random, share);
    let share = share * random.pick(&[1.0, 1.0, 0.1, 1e-4]);
    let mut c = towards(random, share);
    if random.below(4) == 0 {
        c = a + 0.5 * (b - a) + 1e-5 * (c - a);
    }
    [a, b, c]
}

/// A point on the border of what a triangle blocks, moved by little.
fn near_border(
    corners: [DVec3; 3],
    light: &LightShape,
    frame: &Frame,
    random: &mut Random,
) -> DVec3 {
    let first = random.below(3);
    let (a, b) = (corners[first], corners[(first + 1) % 3]);
    let through = a + random.real(0.0, 1.0) * (b - a);
    let away = match *light {
        LightShape::Point(light) => through - light,
        LightShape::Direction(direction) => -direction,
    };
    let reach = 1.0 / (frame.scale * away.abs().max_element());
    let far = random.pick(&[0.0, 1.0]) * random.real(0.0, reach);
    let nudge = random.pick(&[0.25, 1.0, 2.0, 8.0]) * f64::from(BOUND) / frame.scale;
    through + far * away + nudge * random.in_cube()
}

#[test]
fn verdicts_hold_for_all_starts_in_their_room() {
    let random = &mut Random(1);
    let mut told = [0; 2];
    for _ in 0..4_000 {
        let scene = random.scene();
        let frame = Frame::new(scene);
        let light = random.light(&scene);
        let corners = triangle(&scene, random);
        let occluders = occluders_of(corners);
        let forms = Forms::of_umbra(&frame, corners, &light);
        for _ in 0..20 {
            let point = if random.below(4) == 0 {
                random.in_box(&scene)
            } else {
                near_border(corners, &light, &frame, random)
            };
            let x = frame.point_in_frame(point);
            if x.abs().max_element() > 1.0 {
                continue;
            }
            let x = narrow(x);
            let wide = dispatch!(Level::new(), simd => forms.wide_verdict(simd, x));
            let start = point + START_ROOM / frame.scale * random.of_cube();
            let expected = is_blocked(&occluders, start, &light);
            for verdict in [wide, forms.verdict(x)] {
                let is_wrong = match verdict {
                    Verdict::Outside => expected,
                    Verdict::Inside => !expected,
                    Verdict::Doubt => false,
                };
                assert!(
                    !is_wrong,
                    "{verdict:?}: {corners:?}, {light:?}, {point:?}, {start:?}"
                );
                told[usize::from(expected)] += usize::from(verdict != Verdict::Doubt);
            }
            if forms.outside(x) != 0 {
                assert!(!expected, "{corners:?}, {light:?}, {point:?}, {start:?}");
            }
        }
    }
    // Not by doubting everything.
    assert!(told.iter().all(|&count| count > 5_000), "{told:?}");
}

#[test]
fn triangles_without_area_or_seen_edge_on_are_always_in_doubt() {
    let v = DVec3::new;
    let (a, b) = (v(0.1, 0.2, 0.3), v(0.7, -0.4, 0.5));
    let along = |t: f64| a + t * (b - a);
    let point = LightShape::Point(v(0.3, 0.9, 2.0));
    let direction = LightShape::Direction(v(0.1, 0.3, 1.0));
    let flat = [v(0.1, 0.2, 0.25), v(0.7, -0.4, 0.25), v(-0.5, 0.1, 0.25)];
    let in_plane = LightShape::Point(v(0.9, 0.9, 0.25));
    let along_plane = LightShape::Direction(v(0.2, -1.0, 0.0));
    let random = &mut Random(2);
    for (corners, light) in [
        ([a, a, a], point),
        ([a, a, b], point),
        ([a, b, a], direction),
        ([a, b, along(0.3)], point),
        ([a, b, along(1.7)], direction),
        (flat, in_plane),
        (flat, along_plane),
    ] {
        let frame = Frame::new(Bounds {
            min: DVec3::splat(-1.0),
            max: DVec3::ONE,
        });
        let forms = Forms::of_umbra(&frame, corners, &light);
        for _ in 0..200 {
            let x = narrow(random.in_cube());
            assert_eq!(forms.verdict(x), Verdict::Doubt, "{corners:?} {light:?}");
            let wide = dispatch!(Level::new(), simd => forms.wide_verdict(simd, x));
            assert_eq!(wide, Verdict::Doubt, "{corners:?} {light:?}");
        }
    }
}

#[test]
fn verdicts_of_boxes_hold_everywhere_in_them() {
    let random = &mut Random(3);
    let mut told = [0; 2];
    for _ in 0..20_000 {
        let scene = random.scene();
        let frame = Frame::new(scene);
        let light = random.light(&scene);
        let corners = triangle(&scene, random);
        let occluders = occluders_of(corners);
        let forms = Forms::of_umbra(&frame, corners, &light);
        // Anywhere, about the border, about the middle of the umbra.
        let mut center = random.in_box(&scene);
        let place = random.below(3);
        if place > 0 {
            center = near_border(corners, &light, &frame, random);
        }
        if place > 1 {
            let [a, b, c] = corners;
            center += random.pick(&[0.1, 0.5, 1.0]) * ((a + b + c) / 3.0 - center);
            center -= random.real(0.0, 0.3) * light.towards(center).normalize() / frame.scale;
        }
        let half = 2f64.powf(random.real(-18.0, -1.0)) / frame.scale;
        let bounds = Bounds {
            min: center - half,
            max: center + half,
        };
        let reach = |point| frame.point_in_frame(point).abs().max_element();
        if reach(bounds.min).max(reach(bounds.max)) > 1.0 {
            continue;
        }
        // As cells are asked about.
        let center = narrow(frame.point_in_frame(bounds.center()));
        let half = narrow(bounds.size() * (0.5 * frame.scale)).map(|x| x + 0.25 * BOUND);
        let verdict = forms.verdict_of_box(center, half);
        if verdict == Verdict::Doubt {
            continue;
        }
        told[usize::from(verdict == Verdict::Inside)] += 1;
        let inside: Vec<DVec3> = (0..4).map(|_| random.in_box(&bounds)).collect();
        for point in bounds.corners().into_iter().chain(inside) {
            assert_eq!(
                is_blocked(&occluders, point, &light),
                verdict == Verdict::Inside,
                "{corners:?} {light:?} {bounds:?} {point:?}"
            );
        }
    }
    assert!(told.iter().all(|&count| count > 500), "{told:?}");
}

#[test]
fn boxes_that_straddle_not_lie_on_one_side_of_an_edge() {
    let random = &mut Random(4);
    let mut told = 0;
    for _ in 0..20_000 {
        let scene = random.scene();
        let frame = Frame::new(scene);
        let light = random.light(&scene);
        let [from, to, _] = triangle(&scene, random);
        let forms = Forms::through_light(&frame, [from, to], &light);
        let center = from + random.real(0.0, 2.0) * (random.in_box(&scene) - from);
        let half = 2f64.powf(random.real(-16.0, -3.0)) / frame.scale;
        let bounds = Bounds {
            min: center - half,
            max: center + half,
        };
        let x = frame.point_in_frame(center);
        if x.abs().max_element() > 0.8 {
            continue;
        }
        let size = bounds.size() * (0.5 * frame.scale);
        if !forms.straddles_not(narrow(x), narrow(size).map(|x| x + 0.25 * BOUND)) {
            continue;
        }
        told += 1;
        let ray = match light {
            LightShape::Point(light) => from - light,
            LightShape::Direction(direction) => direction,
        };
        let normal = ray.cross(to - from);
        let sides = bounds.corners().map(|x| normal.dot(x - from) > 0.0);
        assert_eq!(sides, [sides[0]; 8], "{from} {to} {light:?} {bounds:?}");
    }
    assert!(told > 2_000, "{told}");
}

#[test]
fn starts_are_where_their_points_are() {
    let random = &mut Random(5);
    let light = LightShape::Direction(DVec3::Z);
    let (mut told, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let scene = random.scene();
        let frame = Frame::new(scene);
        let corners = triangle(&scene, random);
        let occluders = occluders_of(corners);
        let Some(axis) = occluders.dominant_axis(ONE) else {
            continue;
        };
        let forms = Forms::of_starts(&frame, corners, axis);
        let [s, t] = [random.real(-0.1, 1.1), random.real(-0.1, 1.1)];
        let [a, b, c] = corners;
        let mut point = a + s * (b - a) + t * (c - a);
        let nudge = random.pick(&[0.0, 0.2, 0.45, 0.55, 1.0, 2.0, 5.0]);
        point[axis] += nudge * START_ROOM / frame.scale;
        let x = frame.point_in_frame(point);
        if x.abs().max_element() > 1.0 {
            continue;
        }
        let x = narrow(x);
        let is_known = dispatch!(Level::new(), simd => forms.is_start(simd, x));
        if !is_known {
            refused += 1;
            continue;
        }
        told += 1;
        let start = ReceiverPoint {
            point,
            surface: Some(ONE),
        };
        let segment = occluders.segment(&start, &light);
        let offset = (segment.origin() - point).abs().max_element() + segment.origin_error();
        assert!(
            offset * frame.scale <= START_ROOM,
            "{corners:?} {point:?}: {}",
            offset * frame.scale / START_ROOM
        );
        // Seen along the axis it is over the triangle.
        assert!(s > 0.0 && t > 0.0 && s + t < 1.0, "{corners:?} {s} {t}");
    }
    assert!(told > 1_000 && refused > 1_000, "{told} {refused}");
}

#[test]
fn nothing_starts_nowhere() {
    for x in [[0.0; 3], [1.0; 3], [f32::NAN; 3], [f32::INFINITY; 3]] {
        let is_known = dispatch!(Level::new(), simd => Forms::NOWHERE.is_start(simd, x));
        assert!(!is_known, "{x:?}");
    }
}
