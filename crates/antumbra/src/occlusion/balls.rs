//! Spheres as starts and as blockers, filtered in `f64`.

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
