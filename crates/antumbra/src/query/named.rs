//! Whether points are on the surfaces that they name.
//!
//! In: the points of a batch. Out: what is said where some are not. Invariant: what is asked of a point depends on
//! that point and its surface. Absent here: answers.

use super::off_surface::OffSurface;
pub(crate) use super::off_surface::off_surface;
use crate::limits::is_fine;
use crate::threads::prelude::*;
use crate::{Batch, BatchKind, Coordinates, ShadowIndex};

/// Points that are not on the surfaces that they name.
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
