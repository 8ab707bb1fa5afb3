//! What a query comes to.

use antumbra_geometry::{DVec3, LightId, Short};

/// Whether a light reaches a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadow {
    /// Nothing opaque is between.
    Lit,
    /// Something is.
    Shadowed,
}

/// How a query was decided; for statistics, never part of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decided {
    /// By the value of the receiver point's voxel.
    FirstPass,
    /// By the value of a voxel on the way.
    Intermediate,
    /// By a blocker list.
    BlockerList,
    /// By a full walk.
    Ray,
}

/// The answer to a shadow query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The bit.
    pub shadow: Shadow,
    /// How it was found.
    pub decided: Decided,
}

/// Why a query has no answer.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QueryError {
    /// The receiver point is NaN, infinite or beyond 2^100.
    #[error("receiver point {}: coordinates must be finite and at most 2^100 in magnitude", Short(*.0))]
    BadPoint(DVec3),
    /// The receiver point names a surface that is not there.
    #[error("surface {0} does not exist")]
    UnknownSurface(u32),
    /// The query names a light that is not there.
    #[error("light {0} does not exist")]
    UnknownLight(LightId),
    /// The point is not on the surface that it names, by more than rounding to `f32` explains.
    #[error(
        "{} is {distance:.6} away from surface {surface}, more than the {allowed:.3e} that rounding explains: is it on another \
         triangle of the mesh?",
        Short(*point)
    )]
    OffSurface {
        /// Position.
        point: DVec3,
        /// Which surface it names.
        surface: u32,
        /// How far that is, world units.
        distance: f64,
        /// How far it might have been.
        allowed: f64,
    },
    /// A target is NaN, infinite or beyond 2^100.
    #[error("target {index} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*target))]
    BadTarget {
        /// Which target.
        index: usize,
        /// What it is.
        target: DVec3,
    },
}
