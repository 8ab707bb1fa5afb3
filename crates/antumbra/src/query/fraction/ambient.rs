//! Ambient occlusion and the sky view factor: how much of what is around a point is open.
//!
//! In: receiver points, how many directions. Out: shares, 0 to 1. Invariant: the bit of a direction is that of
//! [`ShadowIndex::shadow`] for light from there (EXACTNESS.md, "Ambient occlusion and the sky view factor"), for any
//! method and any number of threads.

use antumbra_geometry::{AreaSample, Directions, ReceiverPoint, Sky};

use super::LightSampling;
use crate::query::points::ReceiverSide;
use crate::{Batch, BatchCounters, BatchError, BatchKind, Coordinates, ShadowIndex};

impl ShadowIndex {
    /// Writes the ambient occlusion of every point of a batch: the share of directions in which nothing opaque is
    /// nearer than `distance`, or nothing at all where that is `None`. 1 is open, 0 is closed all around, as in
    /// occlusion textures of glTF.
    ///
    /// * *Points on surfaces* look into the half sphere on the wanted side, *points with normals* into the one
    ///   around the normal: directions count by their cosine to the normal. Of a point with a zero normal nothing is open.
    /// * *Points of space*, and points on surfaces with [`ReceiverSide::Both`], look into all directions; these count alike.
    ///
    /// `sampling.samples` well spread directions for each point; the number of the point is its row. The error is that
    /// of samples, about `0.5 / samples^0.75` for large occluders. Costs about as much as a shadow query for each direction,
    /// less where directions share occluders; needs no values. A `distance` that is not above 0 leaves all open.
    ///
    /// Runs on all threads of the current rayon pool. Values and errors do not depend on them.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Batch, LightSampling, ReceiverSide, ShadowIndex};
    /// # use antumbra_geometry::{DVec3, Occluders, Opacity};
    /// # let mut builder = Occluders::builder();
    /// # let face = |corners: [(f64, f64, f64); 4]| corners.map(|(x, y, z)| DVec3::new(x, y, z));
    /// # let floor = face([(-9.0, -9.0, 0.0), (9.0, -9.0, 0.0), (9.0, 9.0, 0.0), (-9.0, 9.0, 0.0)]);
    /// # builder.add_face(&floor, Opacity::Opaque)?;
    /// # let wall = face([(0.0, -9.0, 0.0), (0.0, 9.0, 0.0), (0.0, 9.0, 9.0), (0.0, -9.0, 9.0)]);
    /// # builder.add_face(&wall, Opacity::Opaque)?;
    /// // A floor, and a wall that stands on it.
    /// let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new()).build()?;
    /// let points = [[0.001, 0.0, 0.0], [5.0, 0.0, 0.0]];
    /// let batch = Batch::on_surfaces(&points, &[0_u32, 0]);
    /// let (side, sampling) = (ReceiverSide::Front, LightSampling::new(1024));
    /// let mut open = [0.0; 2];
    /// index.ambient_occlusion(&batch, side, Some(2.0), &sampling, &mut open)?;
    /// // At its foot the wall hides half, and 5 away it is too far.
    /// assert!((open[0] - 0.5).abs() < 0.01 && open[1] == 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Lengths do not fit, or a point has no answer; of several the first is named. `open` may be written in parts then.
    pub fn ambient_occlusion<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        distance: Option<f64>,
        sampling: &LightSampling,
        open: &mut [f32],
    ) -> Result<BatchCounters, BatchError> {
        let sampler = |row: usize, start: &ReceiverPoint| {
            let directions = self.directions(batch, row, start, side);
            let point = start.point;
            move |place| Some(directions?.sample(point, place, distance))
        };
        self.lit_shares(batch, side, sampling, sampler, open)
    }

    /// Writes the sky view factor of every point of a batch: the share of what a flat receiver there would get from a
    /// sky that is equally bright all over, if nothing stood around. 1 is open ground, 0 sees no sky.
    ///
    /// Directions count by their cosine to the receiver's normal; below the horizon of the sky there is none.
    /// The receiver is the surface, on the wanted side, or what has the normal; *points of space* are level ground: their
    /// normal is the sky's up. So a free wall has 0.5.
    ///
    /// Samples, cost and threads as for [`ShadowIndex::ambient_occlusion`].
    ///
    /// # Errors
    /// As [`ShadowIndex::ambient_occlusion`].
    pub fn sky_view_factor<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        sky: &Sky,
        sampling: &LightSampling,
        factors: &mut [f32],
    ) -> Result<BatchCounters, BatchError> {
        let up = sky.up();
        let level = Directions::around(up).ok();
        let sampler = |row: usize, start: &ReceiverPoint| {
            let directions = match (batch.kind, start.surface) {
                (BatchKind::Free, _) => level,
                _ => self.directions(batch, row, start, side),
            };
            let point = start.point;
            move |place| {
                let sample: AreaSample = directions?.sample(point, place, None);
                let (direction, _) = sample.target.homogeneous();
                (direction.dot(up) > 0.0).then_some(sample)
            }
        };
        self.lit_shares(batch, side, sampling, sampler, factors)
    }

    /// Returns the directions that a start looks into; `None` where it has no normal and should have.
    fn directions<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        row: usize,
        start: &ReceiverPoint,
        side: ReceiverSide,
    ) -> Option<Directions> {
        let on_surface = |surface| self.occluders().normal_at(surface, start.point);
        match (batch.kind, start.surface, side) {
            (BatchKind::Facing { normals }, ..) => Directions::around(normals[row].as_f64()).ok(),
            (_, Some(_), ReceiverSide::Both) | (_, None, _) => Some(Directions::all()),
            (_, _, ReceiverSide::Normal(normal)) => Directions::around(normal).ok(),
            (_, Some(surface), ReceiverSide::Front) => Directions::around(on_surface(surface)).ok(),
            (_, Some(surface), ReceiverSide::Back) => Directions::around(-on_surface(surface)).ok(),
        }
    }
}
