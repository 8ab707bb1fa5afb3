//! Whether a point is on the surface that it names.

use antumbra_geometry::{DVec3, Occluders, Precision, ReceiverPoint, SurfaceId};

use crate::QueryError;

/// A point that is not on the surface that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffSurface {
    /// Which point.
    pub index: usize,
    /// Position.
    pub point: DVec3,
    /// Which surface it names.
    pub surface: u32,
    /// How far that is, world units.
    pub distance: f64,
    /// How far it might have been.
    pub allowed: f64,
}

/// Returns how a point is off the surface that it names, if it is.
#[inline]
pub(crate) fn off_surface(
    occluders: &Occluders,
    index: usize,
    point: DVec3,
    surface: u32,
    tolerance: Option<f64>,
) -> Option<OffSurface> {
    let id = SurfaceId(surface);
    let is_on = match tolerance {
        Some(f64::INFINITY) => true,
        Some(tolerance) => occluders.distance(id, point).is_none_or(|d| d <= tolerance),
        None => occluders.is_on(id, point, Precision::Single),
    };
    if is_on {
        return None;
    }
    Some(OffSurface {
        index,
        point,
        surface,
        distance: occluders.distance(id, point)?,
        allowed: tolerance.unwrap_or_else(|| occluders.allowed(id, point, Precision::Single)),
    })
}

/// Checks that a start is on the surface that it names, as batches do.
pub(crate) fn check_surface(
    occluders: &Occluders,
    start: &ReceiverPoint,
) -> Result<(), QueryError> {
    let Some(SurfaceId(surface)) = start.surface else {
        return Ok(());
    };
    match off_surface(occluders, 0, start.point, surface, None) {
        None => Ok(()),
        Some(OffSurface {
            point,
            surface,
            distance,
            allowed,
            ..
        }) => Err(QueryError::OffSurface {
            point,
            surface,
            distance,
            allowed,
        }),
    }
}
