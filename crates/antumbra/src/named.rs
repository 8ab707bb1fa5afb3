//! Whether points are on the surfaces that they name.
//!
//! In: the points of a batch. Out: what is said where some are not. Invariant: what is asked of a point depends on
//! that point and its surface. Absent here: answers.

use antumbra_geometry::{DVec3, Occluders, Precision, SurfaceId};

use crate::batch::is_fine;
use crate::threads::prelude::*;
use crate::{Batch, BatchKind, Coordinates, ShadowIndex};

/// A point that is not on the surface that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffSurface {
    /// Which point.
    pub index: usize,
    /// Where it is.
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

/// What is wrong with the surfaces that points name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffSurfaces {
    /// How many points are not on theirs.
    pub count: usize,
    /// The first of them.
    pub first: OffSurface,
    /// The farthest of them, the first of these.
    pub worst: OffSurface,
}

impl ShadowIndex {
    /// Returns which points of a batch are not on the surfaces that they name: what
    /// [`crate::BatchError::OffSurface`] is about, of the whole batch. `None` if all are.
    ///
    /// Points that are not finite and surfaces that do not exist are left out. Runs on all threads.
    pub fn off_surfaces<P: Coordinates>(&self, batch: &Batch<P>) -> Option<OffSurfaces> {
        let BatchKind::OnSurfaces {
            surfaces,
            tolerance,
        } = batch.kind
        else {
            return None;
        };
        let occluders = self.occluders();
        let count = batch.points.len().min(surfaces.len());
        let off = (0..count).into_par_iter().filter_map(|index| {
            let point = batch.points[index].as_f64();
            let is_there = (surfaces[index] as usize) < occluders.surface_count();
            (is_there && is_fine(point))
                .then(|| off_surface(occluders, index, point, surfaces[index], tolerance))?
        });
        off.map(|first| OffSurfaces {
            count: 1,
            first,
            worst: first,
        })
        .reduce_with(|a, b| {
            let (first, second) = if a.first.index < b.first.index {
                (a, b)
            } else {
                (b, a)
            };
            let is_worse = second.worst.distance > first.worst.distance
                || second.worst.distance == first.worst.distance
                    && second.worst.index < first.worst.index;
            OffSurfaces {
                count: first.count + second.count,
                first: first.first,
                worst: if is_worse { second.worst } else { first.worst },
            }
        })
    }
}
