//! Spheres as starts and as blockers, filtered in `f64`.
//!
//! Lights are those that [`LightShape::without_underflow`] gives: lengths are squared here.

use antumbra_geometry::{DVec3, LightShape, Sphere};

use super::forms::Verdict;

/// A sphere that queries start from.
#[derive(Clone, Copy, Debug)]
pub(super) struct BallStart {
    center: DVec3,
    radius: f64,
}

/// What a point says of a start on a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OnBall {
    /// On the sphere, surely on the side of the light.
    Front,
    /// Surely behind, and the light surely outside: its own rule shadows it.
    OwnShadow,
    /// For the exact rule to tell.
    Doubt,
}

/// More than any relative error of the few operations here.
const ERROR: f64 = 64.0 * f64::EPSILON;

impl BallStart {
    /// For a surface that is no sphere, or blocks nothing: always in doubt.
    pub(super) const NONE: Self = Self {
        center: DVec3::ZERO,
        radius: f64::NAN,
    };

    pub(super) fn new(Sphere { center, radius }: Sphere) -> Self {
        Self { center, radius }
    }

    /// Tells where a point is, that may be off the sphere by less than `room`.
    #[inline(always)]
    pub(super) fn tell(&self, point: DVec3, light: &LightShape, room: f64) -> OnBall {
        let seen = point - self.center;
        let square = self.radius * self.radius;
        // Off by less than half the room: |d|^2 - r^2 = (|d| - r) (|d| + r).
        let is_near = (seen.length_squared() - square).abs() < 0.5 * room * self.radius;
        let (towards, weight) = match *light {
            LightShape::Point(light) => (light - self.center, 1.0),
            LightShape::Direction(direction) => (direction, 0.0),
        };
        let side = seen.dot(towards) - weight * square;
        let size = |v: DVec3| v.abs().element_sum();
        // The coordinates' own rounding was there before.
        let error = ERROR * (size(seen) * size(towards) + square)
            + 4.0 * f64::EPSILON * (size(point) + size(self.center)) * size(towards);
        if !is_near {
            OnBall::Doubt
        } else if side > error {
            OnBall::Front
        } else if -side > error && towards.length_squared() > weight * square * (1.0 + ERROR) {
            OnBall::OwnShadow
        } else {
            OnBall::Doubt
        }
    }
}

/// A sphere that may block, for starts known up to a room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    pub(super) fn new(Sphere { center, radius }: Sphere) -> Self {
        Self { center, radius }
    }

    /// Tells whether the sphere blocks a start within `room` of a point, in every coordinate.
    #[inline(always)]
    pub(super) fn verdict(&self, point: DVec3, light: &LightShape, room: f64) -> Verdict {
        // Twice the room for the start's place, more than the rounding of coordinates besides.
        let room = 4.0 * room;
        let seen = self.center - point;
        let (wide, narrow) = (self.radius + room, self.radius - room);
        let distance = seen.length_squared();
        let (towards, is_finite) = match *light {
            LightShape::Point(light) => (light - point, true),
            LightShape::Direction(direction) => (direction, false),
        };
        let length = towards.length_squared();
        let along = seen.dot(towards);
        // The line's distance from the centre, times its direction's length.
        let across = seen.cross(towards).length_squared();
        let slack = room * length.sqrt();
        let is_outside = distance > wide * wide;
        // From a start outside, a sphere behind it, beside the line or beyond the light is missed.
        let is_beyond = is_finite && {
            let from_light = seen - towards;
            from_light.length_squared() > wide * wide && along - length > slack
        };
        if is_outside && (along < -slack || across > wide * wide * length || is_beyond) {
            return Verdict::Outside;
        }
        let is_met = narrow > 0.0 && across < narrow * narrow * length;
        let is_between = along > slack && (!is_finite || along - length < -slack);
        if is_outside && is_met && is_between {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, Occluders, Opacity, Start, SurfaceId};

    use super::super::forms::START_ROOM;
    use super::super::testing::Random;
    use super::*;
    use crate::frame::Frame;

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
                let start = Start {
                    point: point + move_by,
                    surface,
                };
                let expected = occluders.blocks(SurfaceId(1), &occluders.segment(&start, &light));
                let is_wrong = match ball.verdict(point, &light, room) {
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
                let start = Start {
                    point: own.center + (own.radius + off) * way,
                    surface: Some(SurfaceId(0)),
                };
                let side = BallStart::new(own).tell(start.point, &light, room);
                let is_own = occluders.own_rule_blocks(&occluders.segment(&start, &light));
                match side {
                    OnBall::Doubt => continue,
                    OnBall::Front => assert!(!is_own, "{own:?} {light:?} {start:?}"),
                    OnBall::OwnShadow => assert!(is_own, "{own:?} {light:?} {start:?}"),
                }
                told[usize::from(is_own)] += 1;
                moved += usize::from(off > 0.0);
                let distance = (start.point - own.center).length();
                assert!((distance - own.radius).abs() < room, "{own:?} {start:?}");
            }
        }
        assert!(told.iter().all(|&count| count > 3_000), "{told:?}");
        assert!(moved > 300, "{moved}");
        let nowhere = BallStart::NONE.tell(DVec3::ZERO, &LightShape::Direction(DVec3::X), 1.0);
        assert_eq!(nowhere, OnBall::Doubt);
    }
}
