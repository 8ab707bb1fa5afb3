//! The visible fraction without samples, where it has a closed form.
//!
//! In: receiver points, a flat light, a sun disc or a segment. Out: the share of it that is lit, or the lit intervals of
//! a segment. Invariants: which surfaces are shown to the light's view is a superset of those that matter, and the view
//! decides exactly, so the answer is a function of start, side, light and surfaces alone (EXACTNESS.md, "The exact
//! visible fraction"). Absent here: the geometry of what is left of a light, which [`LightView`] knows.

use std::ops::ControlFlow;

use antumbra_geometry::{
    AreaShape, Horizon, LightView, Meeting, ReceiverPoint, SegmentLight, Shares, SurfaceId,
};

use super::{CHUNK_POINTS, LightSamples, LightSampling};
use crate::accel::bvh::Region;
use crate::query::points::ReceiverSide;
use crate::query::run::{Run, check_length};
use crate::threads::prelude::*;
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, Method, QueryError,
    ShadowIndex,
};

/// What starts may err in the tree's frame, so that planes through them are of use.
const LARGEST_OFFSET: f64 = 1.0 / (1 << 24) as f64;

/// Points that a thread takes at a time: one may take as long as a thousand.
const CHUNK: usize = 64;

/// How a visible fraction was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FractionBy {
    /// The closed form: the only error is rounding.
    #[default]
    Exact,
    /// Samples of the light, each answered exactly.
    Samples,
}

/// The share of a light that a receiver point sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VisibleFraction {
    /// Share that is lit, 0 to 1: by length, area or solid angle over that of the whole light. 0 and 1 mean wholly hidden
    /// and wholly visible.
    pub fraction: f64,
    /// Share that would be lit if nothing were in between: the part that shines towards the point and is above its plane.
    pub queried: f64,
    /// How it was found.
    pub by: FractionBy,
}

impl From<ReceiverSide> for Horizon {
    fn from(side: ReceiverSide) -> Self {
        match side {
            ReceiverSide::Front => Self::Front,
            ReceiverSide::Back => Self::Back,
            ReceiverSide::Both => Self::Open,
            ReceiverSide::Normal(normal) => Self::Normal(normal),
        }
    }
}

impl ShadowIndex {
    /// Returns the exact visible fraction of a light for a start, `None` where there is no closed form: spheres of
    /// light and skies; more than [`crate::MOST_BLOCKERS`] triangles in the way ([`crate::MOST_SPANS`] of a segment); a
    /// curved or alpha-tested surface that may hide some of the light; a start on a cone, or on the back of a sphere; a
    /// polygon or mesh of more than 64 triangles.
    ///
    /// EXACTNESS.md ("The exact visible fraction") says what is exact. Needs no values, whatever the method, and changes
    /// none. Takes some microseconds where nothing is in the way, and some more for each triangle that is.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Counters, ReceiverSide, ShadowIndex};
    /// # use antumbra_geometry::{AreaShape, DVec3, Occluders, Opacity, RectangleLight, ReceiverPoint, SurfaceId};
    /// # let mut builder = Occluders::builder();
    /// # let square = |half: f64, z: f64| {
    /// #     [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| DVec3::new(x, y, z))
    /// # };
    /// # builder.add_face(&square(4.0, 0.0), Opacity::Opaque)?;
    /// # builder.add_face(&square(0.5, 2.0), Opacity::Opaque)?;
    /// // A plate of 1 x 1, half way between a floor and a lamp of 6 x 2 that shines down.
    /// let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new()).build()?;
    /// let edges = [DVec3::new(0.0, 2.0, 0.0), DVec3::new(6.0, 0.0, 0.0)];
    /// let lamp = RectangleLight::new(DVec3::new(0.0, 0.0, 4.0), edges, false)?;
    /// let start = ReceiverPoint { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
    /// let found = index.exact_fraction(
    ///     &start,
    ///     ReceiverSide::Front,
    ///     &AreaShape::Rectangle(lamp),
    ///     &mut Counters::default(),
    /// )?;
    /// // The plate hides 2 x 2 of it.
    /// let found = found.ok_or("no closed form")?;
    /// assert!((found.fraction - 2.0 / 3.0).abs() < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The start is not finite or beyond 2^100, or its surface does not exist.
    pub fn exact_fraction(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &AreaShape,
        counters: &mut Counters,
    ) -> Result<Option<VisibleFraction>, QueryError> {
        self.check_start(start)?;
        let shares = self
            .view_of(start, side, light, counters)
            .and_then(|mut view| view.shares());
        Ok(shares.map(|Shares { asked, lit }| VisibleFraction {
            fraction: lit,
            queried: asked,
            by: FractionBy::Exact,
        }))
    }

    /// Returns the lit intervals of a linear light, in order, as shares of its length from its first end; `None` where
    /// there is no closed form, as for [`ShadowIndex::exact_fraction`]. Intervals have a length and do not touch, but
    /// one that is shorter than rounding may begin and end at the same number.
    ///
    /// # Errors
    /// As [`ShadowIndex::exact_fraction`].
    pub fn lit_intervals(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &SegmentLight,
        counters: &mut Counters,
    ) -> Result<Option<Vec<[f64; 2]>>, QueryError> {
        self.check_start(start)?;
        let light = AreaShape::Segment(*light);
        let view = self.view_of(start, side, &light, counters);
        Ok(view.and_then(|mut view| view.intervals()))
    }

    /// Returns the visible fraction of a light for a start: the exact one where it has a closed form, else that of
    /// samples, as [`ShadowIndex::sample_light`] takes them. `samples` is written only then.
    ///
    /// # Errors
    /// As [`ShadowIndex::exact_fraction`].
    #[expect(
        clippy::too_many_arguments,
        reason = "each changes from call to call on its own"
    )]
    pub fn visible_fraction(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &AreaShape,
        point: u64,
        sampling: &LightSampling,
        samples: &mut LightSamples,
        counters: &mut Counters,
    ) -> Result<VisibleFraction, QueryError> {
        if let Some(exact) = self.exact_fraction(start, side, light, counters)? {
            return Ok(exact);
        }
        self.sample_light(start, side, light, point, sampling, samples, counters)?;
        Ok(VisibleFraction {
            fraction: samples.visible_fraction(),
            queried: samples.queried().len() as f64 / f64::from(samples.total().max(1)),
            by: FractionBy::Samples,
        })
    }

    /// Writes the visible fraction of a light for every point of a batch, as [`ShadowIndex::visible_fraction`] finds it;
    /// where samples answer they are those of [`ShadowIndex::visible_fractions`].
    ///
    /// Runs on all threads of the current rayon pool. Fractions and errors do not depend on them.
    ///
    /// # Errors
    /// Lengths do not fit, or a point has no answer; of several the first is named. `fractions` may be
    /// written in parts then.
    pub fn exact_visible_fractions<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        light: &AreaShape,
        sampling: &LightSampling,
        fractions: &mut [VisibleFraction],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        check_length("fractions", batch.points.len(), fractions.len())?;
        let task = antumbra_task::current();
        let length = CHUNK.min(CHUNK_POINTS);
        let counted: Vec<Result<BatchCounters, BatchError>> = fractions
            .par_chunks_mut(length)
            .enumerate()
            .map_init(LightSamples::default, |samples, (number, fractions)| {
                task.enter(|| {
                    let mut counted = BatchCounters::default();
                    for (place, fraction) in fractions.iter_mut().enumerate() {
                        antumbra_task::check();
                        let row = number * length + place;
                        let start = run.start(row)?;
                        let side = match batch.kind {
                            BatchKind::Facing { normals } => {
                                ReceiverSide::Normal(normals[row].as_f64())
                            }
                            _ => side,
                        };
                        let counters = &mut counted.counters;
                        *fraction = self
                            .visible_fraction(
                                &start, side, light, row as u64, sampling, samples, counters,
                            )
                            .expect("what was checked has answers");
                    }
                    Ok(counted)
                })
            })
            .collect();
        let mut sum = BatchCounters::default();
        // The first error is that of the first point at fault.
        for counted in counted {
            sum.counters.add(&counted?.counters);
        }
        Ok(sum)
    }

    /// Looks at a light with all surfaces that may hide some of it; `None` without a closed form.
    fn view_of(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &AreaShape,
        counters: &mut Counters,
    ) -> Option<LightView<'_>> {
        let mut view = LightView::new(self.occluders(), start, side.into(), light)?;
        let tree = match self.method() {
            Method::Auto | Method::Voxel | Method::Bvh => self.bvh(),
            Method::Voxel1990 | Method::Grid | Method::Naive => None,
        };
        for part in 0..view.part_count() {
            if view.is_dark(part) {
                continue;
            }
            let mut shown = 0;
            let mut show = |surface: SurfaceId| {
                shown += 1;
                match view.meet(part, surface) {
                    Meeting::Misses | Meeting::Hides => ControlFlow::Continue(()),
                    Meeting::Unclear => ControlFlow::Break(()),
                }
            };
            let near = match tree {
                Some(_) => ControlFlow::Continue(()),
                None => self.parts.near.present_surfaces().try_for_each(&mut show),
            };
            let mut is_clear = near.is_continue();
            is_clear = is_clear
                && self
                    .parts
                    .far_surfaces()
                    .try_for_each(&mut show)
                    .is_continue();
            if let (true, Some(tree)) = (is_clear, tree) {
                let planes = view.planes(part);
                let offset = view.offset(part) * tree.frame().scale;
                // Not for NaN.
                let is_fit = offset <= LARGEST_OFFSET;
                let planes = planes.into_iter().filter(|_| is_fit);
                let region = Region::below(tree.frame(), planes);
                let mut show = |surface: SurfaceId| {
                    shown += 1;
                    match view.meet(part, surface) {
                        Meeting::Misses | Meeting::Hides => ControlFlow::Continue(()),
                        Meeting::Unclear => ControlFlow::Break(()),
                    }
                };
                let walked = tree.cull_until(&region, |surface, _| show(surface));
                is_clear = walked.is_continue();
            }
            counters.intersections += shown;
            if !is_clear {
                return None;
            }
        }
        Some(view)
    }
}
