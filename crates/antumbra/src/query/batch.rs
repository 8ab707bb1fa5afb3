//! Many points at once: slices in, bytes or bits out, on all threads.
//!
//! In: [`Batch`], points that may lie on surfaces or have normals. Out: an answer a point and light in the
//! caller's memory, the same for any number of threads. Invariant: an answer is that of
//! [`ShadowIndex::shadow`] for the start that the point means (EXACTNESS.md, "Points of a batch"). Absent
//! here: how a query is answered; files.

use antumbra_geometry::LightId;

use super::points::{Batch, Coordinates};
use super::refused::BatchError;
use super::run::{into_bits, into_bytes};
use crate::{BatchCounters, ShadowIndex};

impl ShadowIndex {
    /// Answers every point of a batch for every light of `lights` (any of
    /// [`ShadowIndex::light_ids`], in any order), and writes a byte each: 1 where the light is blocked, 0 where not. The lights of a point lie
    /// together, point after point: NumPy's shape `(points, lights)` in C order.
    ///
    /// Runs on all threads of the current rayon pool; answers, errors and how queries were decided do not depend
    /// on them. How many nodes rays visit and surfaces they test does: rays of a chunk walk together.
    /// Takes memory for the work of each thread, some two mebibytes at most, and nothing for each query.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Batch, LightId, ShadowIndex};
    /// # use antumbra::{DVec3, LightShape, Occluders, Opacity, Sphere};
    /// # let mut builder = Occluders::builder();
    /// # let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    /// # builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
    /// # let ball = Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 1.0 };
    /// # builder.add_sphere(ball, Opacity::Opaque)?;
    /// # let lamp = LightShape::Point(DVec3::new(0.0, 0.0, 9.0));
    /// # let index = ShadowIndex::builder(Arc::new(builder.build()), vec![lamp]).build()?;
    /// // A ball over a floor, lit from above.
    /// let points = [[0.0_f32, 0.1, 0.0], [3.0, 0.1, 0.0], [0.0, 0.0, 3.0]];
    /// let mut is_shadowed = [0; 3];
    /// index.occluded(&Batch::on_nearest(&points, None), &[LightId(0)], &mut is_shadowed)?;
    /// assert_eq!(is_shadowed, [1, 0, 0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Lengths do not fit, a light does not exist, or a point has no answer ([`BatchError`]). `out` may be
    /// written in parts then.
    pub fn occluded<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[LightId],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        into_bytes(self, batch, lights, out)
    }

    /// Answers as [`ShadowIndex::occluded`] and writes a bit each: light after light, with `n.div_ceil(8)`
    /// bytes for `n` points. Point `i` is bit `i % 8`, counted from the lowest, of byte `i / 8`
    /// (`numpy.packbits(..., bitorder="little")`); bits beyond the last point are 0.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded`].
    pub fn occluded_bits<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[LightId],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        into_bits(self, batch, lights, out)
    }
}
