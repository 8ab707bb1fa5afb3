//! Spheres as starts and as blockers, filtered in `f64`, eight at a time.
//!
//! Lights are those that [`LightShape::without_underflow`] gives: lengths are squared here.

use antumbra_geometry::{DVec3, LightShape, Sphere};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, f64x8};

use super::forms::Verdict;
use super::vectors::{Vectors, turned};

/// A sphere.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Ball {
    /// The centre, world space, and the radius.
    numbers: [f64; 4],
}

/// What is told at once.
pub(super) const EIGHT: usize = 8;

/// What points say of starts on spheres, a bit each; the exact rule tells where neither is set.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnBalls {
    /// On the sphere, surely on the side of the light.
    pub(super) front: u64,
    /// Surely behind, and the light surely outside: its own rule shadows it.
    pub(super) own_shadow: u64,
}

/// Which spheres surely block a start and which surely do not, a bit each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdicts {
    pub(super) inside: u64,
    pub(super) outside: u64,
}

/// More than any relative error of the few operations here.
const ERROR: f64 = 64.0 * f64::EPSILON;

impl Ball {
    /// For a surface that is no sphere, or from which nothing starts: always in doubt.
    pub(super) const NONE: Self = Self {
        numbers: [0.0, 0.0, 0.0, f64::NAN],
    };

    pub(super) fn new(Sphere { center, radius }: Sphere) -> Self {
        Self {
            numbers: [center.x, center.y, center.z, radius],
        }
    }
}

/// The centres and radii of eight spheres.
#[inline(always)]
fn numbers<S: Simd>(simd: S, balls: [&Ball; EIGHT]) -> (Vectors<S>, f64x8<S>) {
    let [a, b, c, d, e, f, g, h] = balls;
    let low = four_numbers(simd, [a, b, c, d]);
    let high = four_numbers(simd, [e, f, g, h]);
    let center = Vectors([
        low[0].combine(high[0]),
        low[1].combine(high[1]),
        low[2].combine(high[2]),
    ]);
    (center, low[3].combine(high[3]))
}

#[inline(always)]
fn four_numbers<S: Simd>(simd: S, [a, b, c, d]: [&Ball; 4]) -> [f64x4<S>; 4] {
    turned([
        f64x4::from_slice(simd, &a.numbers),
        f64x4::from_slice(simd, &b.numbers),
        f64x4::from_slice(simd, &c.numbers),
        f64x4::from_slice(simd, &d.numbers),
    ])
}

/// Tells where eight points are, that may be off their spheres by less than `room`.
#[inline(always)]
pub(super) fn tell<S: Simd>(
    simd: S,
    balls: [&Ball; EIGHT],
    points: [&DVec3; EIGHT],
    light: &LightShape,
    room: f64,
) -> OnBalls {
    let point = Vectors::new(simd, points);
    tell_points(simd, numbers(simd, balls), point, light, room)
}

#[inline(always)]
fn tell_points<S: Simd>(
    simd: S,
    (center, radius): (Vectors<S>, f64x8<S>),
    point: Vectors<S>,
    light: &LightShape,
    room: f64,
) -> OnBalls {
    let seen = point.minus(center);
    let square = radius * radius;
    // Off by less than half the room: |d|^2 - r^2 = (|d| - r) (|d| + r).
    let is_near = (seen.length_squared() - square)
        .abs()
        .simd_lt(radius * (0.5 * room));
    let (towards, weight) = match *light {
        LightShape::Point(light) => (Vectors::splat(simd, light).minus(center), 1.0),
        LightShape::Direction(direction) => (Vectors::splat(simd, direction), 0.0),
    };
    let side = seen.dot(towards) - square * weight;
    // The coordinates' own rounding was there before.
    let error = (seen.size() * towards.size() + square) * ERROR
        + (point.size() + center.size()) * towards.size() * (4.0 * f64::EPSILON);
    let is_light_outside = towards
        .length_squared()
        .simd_gt(square * (weight * (1.0 + ERROR)));
    OnBalls {
        front: (is_near & side.simd_gt(error)).to_bitmask(),
        own_shadow: (is_near & (-side).simd_gt(error) & is_light_outside).to_bitmask(),
    }
}

/// Tells whether spheres block starts within `room` of eight points, in every coordinate.
#[inline(always)]
pub(super) fn verdicts<S: Simd>(
    simd: S,
    balls: [&Ball; EIGHT],
    points: [&DVec3; EIGHT],
    light: &LightShape,
    room: f64,
) -> Verdicts {
    let point = Vectors::new(simd, points);
    verdicts_of_points(simd, numbers(simd, balls), point, light, room)
}

#[inline(always)]
fn verdicts_of_points<S: Simd>(
    simd: S,
    (center, radius): (Vectors<S>, f64x8<S>),
    point: Vectors<S>,
    light: &LightShape,
    room: f64,
) -> Verdicts {
    // Twice the room for the start's place, more than the rounding of coordinates besides.
    let room = 4.0 * room;
    let seen = center.minus(point);
    let (wide, narrow) = (radius + room, radius - room);
    let wide_square = wide * wide;
    let distance = seen.length_squared();
    let (towards, is_finite) = match *light {
        LightShape::Point(light) => (Vectors::splat(simd, light).minus(point), true),
        LightShape::Direction(direction) => (Vectors::splat(simd, direction), false),
    };
    let length = towards.length_squared();
    let along = seen.dot(towards);
    // The line's distance from the centre, times its direction's length.
    let across = seen.cross(towards).length_squared();
    // A number is beyond the slack that is the room times the direction's length.
    let slack_square = length * (room * room);
    let is_beyond = (along * along).simd_gt(slack_square);
    let from_light = seen.minus(towards);
    let is_outside = distance.simd_gt(wide_square);
    // From a start outside, a sphere behind it, beside the line or beyond the light is missed.
    let mut is_missed = along.simd_lt(0.0) & is_beyond | across.simd_gt(wide_square * length);
    let mut is_met = along.simd_gt(0.0)
        & is_beyond
        & narrow.simd_gt(0.0)
        & across.simd_lt(narrow * narrow * length);
    if is_finite {
        let is_light_outside = from_light.length_squared().simd_gt(wide_square);
        let past = along - length;
        let is_past = (past * past).simd_gt(slack_square);
        is_missed |= is_light_outside & past.simd_gt(0.0) & is_past;
        is_met &= past.simd_lt(0.0) & is_past;
    }
    Verdicts {
        outside: (is_outside & is_missed).to_bitmask(),
        inside: (is_outside & is_met).to_bitmask(),
    }
}

impl Ball {
    #[inline(always)]
    fn parts(&self) -> (DVec3, f64) {
        let [x, y, z, radius] = self.numbers;
        (DVec3::new(x, y, z), radius)
    }

    /// Tells where a point is as [`tell`] does, in the same operations.
    #[inline(always)]
    pub(super) fn tell(&self, point: DVec3, light: &LightShape, room: f64) -> OnBalls {
        let (center, radius) = self.parts();
        let seen = point - center;
        let square = radius * radius;
        let is_near = (seen.length_squared() - square).abs() < radius * (0.5 * room);
        let (towards, weight) = match *light {
            LightShape::Point(light) => (light - center, 1.0),
            LightShape::Direction(direction) => (direction, 0.0),
        };
        let side = seen.dot(towards) - square * weight;
        let error = (size(seen) * size(towards) + square) * ERROR
            + (size(point) + size(center)) * size(towards) * (4.0 * f64::EPSILON);
        let is_light_outside = towards.length_squared() > square * (weight * (1.0 + ERROR));
        OnBalls {
            front: u64::from(is_near && side > error),
            own_shadow: u64::from(is_near && -side > error && is_light_outside),
        }
    }

    /// Tells whether the sphere blocks a start as [`verdicts`] does, in the same operations.
    #[inline(always)]
    pub(super) fn verdict(&self, point: DVec3, light: &LightShape, room: f64) -> Verdict {
        let room = 4.0 * room;
        let (center, radius) = self.parts();
        let seen = center - point;
        let (wide, narrow) = (radius + room, radius - room);
        let wide_square = wide * wide;
        // What holds the start may block it.
        let is_outside = seen.length_squared() > wide_square;
        if !is_outside {
            return Verdict::Doubt;
        }
        let (towards, is_finite) = match *light {
            LightShape::Point(light) => (light - point, true),
            LightShape::Direction(direction) => (direction, false),
        };
        let length = towards.length_squared();
        let along = seen.dot(towards);
        let across = seen.cross(towards).length_squared();
        let slack_square = length * (room * room);
        let is_beyond = along * along > slack_square;
        if along < 0.0 && is_beyond || across > wide_square * length {
            return Verdict::Outside;
        }
        let past = along - length;
        let is_past = past * past > slack_square;
        if is_finite && past > 0.0 && is_past && (seen - towards).length_squared() > wide_square {
            return Verdict::Outside;
        }
        let is_met = narrow > 0.0 && across < narrow * narrow * length;
        let is_between = along > 0.0 && is_beyond && (!is_finite || past < 0.0 && is_past);
        if is_met && is_between {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }
}

/// The sum of a vector's absolute coordinates.
#[inline(always)]
fn size(v: DVec3) -> f64 {
    let v = v.abs();
    v.x + v.y + v.z
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, Occluders, Opacity, ReceiverPoint, SurfaceId};
    use fearless_simd::{Level, dispatch};

    use super::super::forms::START_ROOM;
    use super::super::testing::Random;
    use super::*;
    use crate::accel::frame::Frame;

    /// A scene of two spheres: one is started from, one blocks. They are apart, touch, meet or are one
    /// in the other.
    fn two_spheres(scene: &Bounds, random: &mut Random) -> [Sphere; 2] {
        let size = scene.size().max_element();
        let radius = |random: &mut Random| {
            let share = 2f64.powf(-random.real(2.0, 6.0));
            size * random.pick(&[share, share, 1e-4, 1e-6, 1e-7])
        };
        let own = Sphere {
            center: random.in_box(scene),
            radius: radius(random),
        };
        let radius = radius(random);
        let way = random.in_cube().normalize();
        let distance = match random.below(4) {
            0 => own.radius + radius,
            1 => random.real(0.0, own.radius),
            _ => size * random.real(0.0, 0.7),
        };
        let center = own.center + distance * way;
        [own, Sphere { center, radius }]
    }

    fn occluders_of(spheres: [Sphere; 2]) -> Occluders {
        let mut builder = Occluders::builder();
        for sphere in spheres {
            builder
                .add_sphere(sphere, Opacity::Opaque)
                .expect("a sphere");
        }
        builder.build()
    }

    /// A light around, in or close to a sphere.
    fn light(scene: &Bounds, sphere: &Sphere, random: &mut Random) -> LightShape {
        match random.below(4) {
            0 => {
                let reach = random.pick(&[0.5, 1.0, 1.0 + 1e-7, 2.0]);
                let way = random.in_cube().normalize();
                LightShape::Point(sphere.center + reach * sphere.radius * way)
            }
            _ => random.light(scene),
        }
    }

    #[test]
    fn verdicts_are_those_of_the_exact_rule_for_all_starts_in_the_room() {
        let random = &mut Random(1);
        let mut told = [0; 2];
        for _ in 0..3_000 {
            let scene = random.scene();
            let room = START_ROOM / Frame::new(scene).scale;
            let spheres = two_spheres(&scene, random);
            let [own, other] = spheres;
            let occluders = occluders_of(spheres);
            let light = light(&scene, &random.pick(&spheres), random);
            let ball = Ball::new(other);
            for _ in 0..20 {
                let way = random.in_cube().normalize();
                let (point, surface) = match random.below(3) {
                    0 => (random.in_box(&scene), None),
                    // About the blocker's outline as the light sees it, beyond it.
                    1 => {
                        let edge = other.center + other.radius * way;
                        let away = -light.towards(edge).normalize();
                        let far = scene.size().max_element() * random.real(0.0, 0.5);
                        (edge + far * away, None)
                    }
                    _ => (own.center + own.radius * way, Some(SurfaceId(0))),
                };
                let move_by = match surface {
                    None => room * random.of_cube(),
                    Some(_) => DVec3::ZERO,
                };
                let start = ReceiverPoint {
                    point: point + move_by,
                    surface,
                };
                let expected = occluders.blocks(SurfaceId(1), &occluders.segment(&start, &light));
                let verdict = ball.verdict(point, &light, room);
                let is_wrong = match verdict {
                    Verdict::Outside => expected,
                    Verdict::Inside => !expected,
                    Verdict::Doubt => continue,
                };
                assert!(!is_wrong, "{spheres:?} {light:?} {point:?} {start:?}");
                told[usize::from(expected)] += 1;
            }
        }
        assert!(told.iter().all(|&count| count > 3_000), "{told:?}");
    }

    #[test]
    fn sides_of_starts_are_those_of_the_own_rule() {
        let random = &mut Random(2);
        let (mut told, mut moved) = ([0; 2], 0);
        for _ in 0..3_000 {
            let scene = random.scene();
            let room = START_ROOM / Frame::new(scene).scale;
            let spheres = two_spheres(&scene, random);
            let own = spheres[0];
            let occluders = occluders_of(spheres);
            let light = light(&scene, &own, random);
            for _ in 0..20 {
                let way = random.in_cube().normalize();
                // Off the sphere, too: the rule has an answer there, but values have none.
                let off = random.pick(&[0.0, 0.0, 0.1, 0.6, 2.0, 10.0]) * room;
                let start = ReceiverPoint {
                    point: own.center + (own.radius + off) * way,
                    surface: Some(SurfaceId(0)),
                };
                let ball = Ball::new(own);
                let side = ball.tell(start.point, &light, room);
                let is_own = occluders.own_rule_blocks(&occluders.segment(&start, &light));
                match (side.front & 1, side.own_shadow & 1) {
                    (0, 0) => continue,
                    (1, 0) => assert!(!is_own, "{own:?} {light:?} {start:?}"),
                    _ => assert!(is_own, "{own:?} {light:?} {start:?}"),
                }
                told[usize::from(is_own)] += 1;
                moved += usize::from(off > 0.0);
                let distance = (start.point - own.center).length();
                assert!((distance - own.radius).abs() < room, "{own:?} {start:?}");
            }
        }
        assert!(told.iter().all(|&count| count > 3_000), "{told:?}");
        assert!(moved > 300, "{moved}");
        let sun = LightShape::Direction(DVec3::X);
        let nowhere = Ball::NONE.tell(DVec3::ZERO, &sun, 1.0);
        assert_eq!((nowhere.front, nowhere.own_shadow), (0, 0));
    }

    #[test]
    fn eight_at_a_time_are_told_as_each_alone() {
        let random = &mut Random(3);
        let mut told = [0; 4];
        for _ in 0..1_000 {
            let scene = random.scene();
            let room = START_ROOM / Frame::new(scene).scale;
            let [own, other] = two_spheres(&scene, random);
            let light = light(&scene, &own, random);
            let all = [Ball::new(own), Ball::new(other), Ball::NONE];
            let balls: [Ball; EIGHT] = std::array::from_fn(|_| random.pick(&all));
            let points: [DVec3; EIGHT] = std::array::from_fn(|_| match random.below(2) {
                0 => random.in_box(&scene),
                _ => own.center + own.radius * random.in_cube().normalize(),
            });
            dispatch!(Level::new(), simd => {
                let rows = balls.each_ref();
                let blocked = verdicts(simd, rows, points.each_ref(), &light, room);
                let on_balls = tell(simd, rows, points.each_ref(), &light, room);
                for lane in 0..EIGHT {
                    let point = points[lane];
                    let bit = |bits: u64| bits >> lane & 1;
                    let expected = balls[lane].tell(point, &light, room);
                    assert_eq!(bit(on_balls.front), expected.front & 1);
                    assert_eq!(bit(on_balls.own_shadow), expected.own_shadow & 1);
                    let verdict = match (bit(blocked.inside), bit(blocked.outside)) {
                        (1, _) => Verdict::Inside,
                        (_, 1) => Verdict::Outside,
                        _ => Verdict::Doubt,
                    };
                    assert_eq!(verdict, balls[lane].verdict(point, &light, room));
                    told[0] += bit(on_balls.front);
                    told[1] += bit(on_balls.own_shadow);
                    told[2] += bit(blocked.inside);
                    told[3] += bit(blocked.outside);
                }
            });
        }
        assert!(told.iter().all(|&count| count > 100), "{told:?}");
    }
}
