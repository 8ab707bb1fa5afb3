//! Samples of lights with size: what one is, how likely, and what is refused.

use glam::DVec3;

use crate::light::LightShape;

/// Largest coordinate of a light.
pub(super) const LARGEST: f64 = (1_u128 << 100) as f64;

/// Why a light with size is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AreaError {
    /// A number is NaN, infinite or too large.
    #[error("{what} is not finite, or beyond 2^100")]
    BadNumber {
        /// Part that has the number, such as `a corner`.
        what: &'static str,
    },
    /// The light has no length, no area or no direction.
    #[error("{what}: use a point or directional light for a light without size")]
    NoSize {
        /// Reason, such as `its radius is zero`.
        what: &'static str,
    },
    /// A direction is zero.
    #[error("{what} is zero; expected a direction")]
    BadDirection {
        /// Vector that is zero, such as `the normal`.
        what: &'static str,
    },
    /// A radius is negative.
    #[error("the radius is {0}; expected above 0")]
    BadRadius(f64),
    /// An angular diameter is out of range.
    #[error("the angular diameter is {0} degrees; expected above 0, below 180")]
    BadDiameter(f64),
    /// A polygon has fewer than three corners.
    #[error("a polygon needs at least 3 corners, found {0}")]
    TooFewCorners(usize),
    /// A polygon is not convex, or goes around more than once.
    #[error(
        "the polygon is not convex at corner {corner}; cut it into convex ones, or into triangles"
    )]
    NotConvex {
        /// The corner's number, from 0.
        corner: usize,
    },
    /// The corners of a polygon are not in one plane.
    #[error("corner {corner} lies off the polygon's plane; cut the polygon into triangles")]
    NotFlat {
        /// The corner's number, from 0.
        corner: usize,
    },
}

/// One sample of a light, for one receiver point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSample {
    /// Point or direction that the shadow query asks about.
    pub target: LightShape,
    /// Cosine (sine, for segments) of the angle at which the light is left: 0 to 1. It is 1 for spheres, sun discs
    /// and the sky.
    pub emitted: f64,
    /// Steradians that the whole light would fill for the receiver if all of it were like this sample: its
    /// area times `emitted` over the square of the distance. For segments length stands for area. The
    /// mean over all samples is the light's solid angle.
    pub solid_angle: f64,
}

/// A plane that shines: what flat lights share.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Emitter {
    /// A point of the plane.
    pub(super) origin: DVec3,
    /// Unit length, up to rounding.
    pub(super) normal: DVec3,
    /// In square units.
    pub(super) area: f64,
    pub(super) is_two_sided: bool,
}

impl Emitter {
    /// Makes a plane from a normal of any length; the light's area is given apart.
    pub(super) fn new(
        origin: DVec3,
        normal: DVec3,
        area: f64,
        is_two_sided: bool,
    ) -> Result<Self, AreaError> {
        let none = AreaError::NoSize {
            what: "it has no area",
        };
        let length = normal.length();
        if !(length > 0.0 && length.is_finite() && area > 0.0 && area.is_finite()) {
            return Err(none);
        }
        let normal = normal / length;
        if !normal.is_normalized() {
            return Err(none);
        }
        Ok(Self {
            origin,
            normal,
            area,
            is_two_sided,
        })
    }

    /// Returns a point of the light as a sample, if the light shines towards the receiver.
    pub(super) fn sample(&self, receiver: DVec3, point: DVec3) -> Option<AreaSample> {
        let side = LightShape::Point(receiver).side_of(self.origin, self.normal);
        if side == 0 || (side < 0 && !self.is_two_sided) {
            return None;
        }
        Some(from_plane(receiver, point, self.normal, self.area))
    }
}

/// Returns a point of a plane that shines towards the receiver.
pub(super) fn from_plane(
    receiver: DVec3,
    point: DVec3,
    unit_normal: DVec3,
    area: f64,
) -> AreaSample {
    let back = receiver - point;
    let square = back.length_squared();
    let emitted = if square > 0.0 {
        (unit_normal.dot(back).abs() / square.sqrt()).min(1.0)
    } else {
        0.0
    };
    AreaSample {
        target: LightShape::Point(point),
        emitted,
        solid_angle: solid_angle(area, emitted, square),
    }
}

/// Returns the steradians of a light of some area that is seen everywhere as at this distance and angle; 0 at the
/// light itself. For a near and large light single samples may be of more than a half sphere; their mean is not.
pub(super) fn solid_angle(area: f64, emitted: f64, square_of_distance: f64) -> f64 {
    let angle = area * emitted / square_of_distance;
    if angle.is_finite() { angle } else { 0.0 }
}

/// Refuses points that queries refuse.
pub(super) fn check_point(point: DVec3, what: &'static str) -> Result<(), AreaError> {
    // Not for NaN.
    if point.abs().cmple(DVec3::splat(LARGEST)).all() {
        Ok(())
    } else {
        Err(AreaError::BadNumber { what })
    }
}

pub(super) fn check_radius(radius: f64) -> Result<(), AreaError> {
    if radius.is_nan() || radius > LARGEST {
        return Err(AreaError::BadNumber { what: "the radius" });
    }
    if radius == 0.0 {
        return Err(AreaError::NoSize {
            what: "its radius is zero",
        });
    }
    if radius < 0.0 {
        return Err(AreaError::BadRadius(radius));
    }
    Ok(())
}

/// Returns a direction at length one.
pub(super) fn unit_of(direction: DVec3, what: &'static str) -> Result<DVec3, AreaError> {
    check_point(direction, what)?;
    let largest = direction.abs().max_element();
    if largest == 0.0 {
        return Err(AreaError::BadDirection { what });
    }
    // Short ones would lose bits in squares.
    let scaled = direction / largest;
    Ok(scaled / scaled.length())
}

/// Returns two unit vectors that are perpendicular to a unit vector and to each other (Duff and others 2017).
pub(super) fn frame_of(axis: DVec3) -> [DVec3; 2] {
    let sign = 1.0_f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    [
        DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
        DVec3::new(b, sign + axis.y * axis.y * a, -axis.y),
    ]
}
