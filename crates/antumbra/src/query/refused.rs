//! Why a batch has no answers.

use antumbra_geometry::{DVec3, LightId, Short, SurfaceId};

use super::off_surface::OffSurface;

/// Why a batch has no answers. Where several points are at fault the first is named.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// A slice does not fit the points and lights.
    #[error("{what}: expected {expected}, found {found}")]
    Length {
        /// Which slice.
        what: &'static str,
        /// Items due.
        expected: usize,
        /// Items there.
        found: usize,
    },
    /// A light does not exist.
    #[error("light {0} does not exist")]
    UnknownLight(LightId),
    /// A tolerance is NaN or negative.
    #[error("tolerance {}: expected zero or more, or infinity for any distance", Short(*.0))]
    BadTolerance(f64),
    /// A point is NaN, infinite or beyond 2^100.
    #[error("point {index} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*point))]
    BadPoint {
        /// Which point.
        index: usize,
        /// What it is.
        point: DVec3,
    },
    /// A normal is NaN, infinite or beyond 2^100.
    #[error("normal {index} is {}: components must be finite and at most 2^100 in magnitude", Short(*normal))]
    BadNormal {
        /// Which point's.
        index: usize,
        /// What it is.
        normal: DVec3,
    },
    /// What a point looks at, or the direction of a ray, is NaN, infinite or beyond 2^100.
    #[error("{what} {index} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*found))]
    BadTarget {
        /// An end or a direction.
        what: &'static str,
        /// Which point's.
        index: usize,
        /// What it is.
        found: DVec3,
    },
    /// A point names a surface that is not there.
    #[error("point {index}: surface {surface} does not exist")]
    UnknownSurface {
        /// Which point.
        index: usize,
        /// What it names.
        surface: u32,
    },
    /// No surface is near a point that is meant to lie on one.
    #[error("point {index} is {}: {}", Short(*point), said(nearest, *allowed))]
    NoSurface {
        /// Which point.
        index: usize,
        /// Where it is.
        point: DVec3,
        /// The nearest surface and its distance, world units; none in an empty scene.
        nearest: Option<(SurfaceId, f64)>,
        /// How far the surface might have been, world units.
        allowed: f64,
    },
    /// A point is not on the surface that it names.
    #[error(
        "point {} is {}: surface {} is {} away, more than the {} that rounding explains",
        first.index, first.point, first.surface, Short(first.distance), Short(first.allowed)
    )]
    OffSurface {
        /// The first such point.
        first: OffSurface,
    },
}

pub(super) fn said(nearest: &Option<(SurfaceId, f64)>, allowed: f64) -> String {
    match nearest {
        Some((SurfaceId(surface), distance)) => format!(
            "the nearest surface, {surface}, is {} away, more than {}",
            Short(*distance),
            Short(allowed)
        ),
        None => "there is no surface".to_owned(),
    }
}
