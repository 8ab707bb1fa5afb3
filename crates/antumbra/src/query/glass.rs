//! How much of a light's color reaches points: shadows, and what glass lets through.
//!
//! In: points, a light. Out: shares of red, green and blue. Invariant: they are the same for every method, bit by bit
//! (EXACTNESS.md, "What glass lets through"). Points that nothing opaque is before are asked about glass as if it were
//! opaque: by what is known, too. Where none is in the way no filter is looked at. Paper 6.3.

use antumbra_geometry::{Hit, LightId, LightShape, ReceiverPoint, Segment, SurfaceId};
use antumbra_task::checked;

use super::ask::{in_space, on_surface};
use super::off_surface::check_surface;
use super::points::{Batch, Coordinates};
use super::refused::BatchError;
use super::run::{Run, check_length, chunk_length};
use crate::threads::prelude::*;
use crate::{BatchCounters, Counters, QueryError, Shadow, ShadowIndex};

/// All of a light.
const ALL: [f64; 3] = [1.0; 3];

/// Nothing of it.
const NOTHING: [f64; 3] = [0.0; 3];

impl ShadowIndex {
    /// Returns which shares of a light's red, green and blue reach a point on a surface, each from 0 to 1: nothing behind an
    /// opaque surface, else the product over all filtering surfaces between, which light crosses straight on.
    ///
    /// Costs what [`ShadowIndex::is_occluded`] does where something opaque is in the way. Else the same again, among
    /// filtering surfaces alone, and if they are in the way a walk that finds all of them.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{LightShape, Occluders, Opacity, ShadowIndex, Tint};
    ///
    /// // A red pane over a floor, lit from straight above.
    /// let corners = |size: f64, z: f64| [[-size, -size, z], [size, -size, z], [0.0, size, z]];
    /// let mut surfaces = Occluders::builder();
    /// let floor = surfaces.add_mesh(&corners(9.0, 0.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// let red = surfaces.add_filter(Arc::new(Tint([0.5, 0.1, 0.1])));
    /// surfaces.add_mesh(&corners(1.0, 2.0), &[[0, 1, 2]], Opacity::Filtering(red))?;
    /// let sun = LightShape::Direction([0.0, 0.0, 1.0].into());
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![sun]).build()?;
    ///
    /// assert_eq!(index.transmittance([0.0, 0.0, 0.0], floor.start, 0)?, [0.5, 0.1, 0.1]);
    /// assert_eq!(index.transmittance([3.0, -4.0, 0.0], floor.start, 0)?, [1.0; 3]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`ShadowIndex::is_occluded`].
    pub fn transmittance(
        &self,
        point: impl Coordinates,
        surface: impl Into<SurfaceId>,
        light: impl Into<LightId>,
    ) -> Result<[f64; 3], QueryError> {
        let start = on_surface(point, surface);
        let shares = self.transmittance_of(&start, light.into(), &mut Counters::default())?;
        check_surface(self.occluders(), &start)?;
        Ok(shares)
    }

    /// Returns which shares of a light's red, green and blue reach a point of space, as [`ShadowIndex::transmittance`].
    ///
    /// # Errors
    /// As [`ShadowIndex::is_occluded_at`].
    pub fn transmittance_at(
        &self,
        point: impl Coordinates,
        light: impl Into<LightId>,
    ) -> Result<[f64; 3], QueryError> {
        self.transmittance_of(&in_space(point), light.into(), &mut Counters::default())
    }

    /// Returns what [`ShadowIndex::transmittance`] does, for a receiver point as it is; counts shadow queries, and under
    /// `counters.intersections` what was tested.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn transmittance_of(
        &self,
        start: &ReceiverPoint,
        light: LightId,
        counters: &mut Counters,
    ) -> Result<[f64; 3], QueryError> {
        if self.shadow(start, light, counters)?.shadow == Shadow::Shadowed {
            return Ok(NOTHING);
        }
        self.filtered_from(start, light, counters)
    }

    /// Returns which shares of a light's red, green and blue all filtering surfaces between it and a point let through,
    /// whether or not something opaque is between, too: for who knows that already. Counts no shadow query.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn filtered_from(
        &self,
        start: &ReceiverPoint,
        light: LightId,
        counters: &mut Counters,
    ) -> Result<[f64; 3], QueryError> {
        self.check_query(start, light)?;
        let Some(glass) = self.glass() else {
            return Ok(ALL);
        };
        let mut behind = Counters::default();
        let answer = glass.shadow(start, light, &mut behind)?;
        add_work(counters, &behind);
        Ok(match answer.shadow {
            Shadow::Shadowed => {
                let light = &self.lights()[light.index()];
                self.filtered(glass, start, light, counters)
            }
            Shadow::Lit => ALL,
        })
    }

    /// Returns what [`ShadowIndex::filtered_from`] does, for a target that is none of the index's lights: a sample of a light
    /// with size. By rays alone.
    ///
    /// # Errors
    /// The receiver point is not finite or beyond 2^100, or its surface does not exist.
    pub fn filtered_towards(
        &self,
        start: &ReceiverPoint,
        target: &LightShape,
        counters: &mut Counters,
    ) -> Result<[f64; 3], QueryError> {
        self.check_start(start)?;
        let Some(glass) = self.glass() else {
            return Ok(ALL);
        };
        let mut behind = Counters::default();
        let answer = glass.answer_to(start, target, &mut behind);
        add_work(counters, &behind);
        Ok(match answer.shadow {
            Shadow::Shadowed => self.filtered(glass, start, target, counters),
            Shadow::Lit => ALL,
        })
    }

    /// Writes which shares of the red, green and blue of each light of `lights` reach every point of a batch: as
    /// [`ShadowIndex::transmittance`], the lights of a point together, point after point.
    ///
    /// Runs on all threads of the current rayon pool; answers and errors do not depend on them.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded`].
    pub fn transmittances<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[LightId],
        out: &mut [[f64; 3]],
    ) -> Result<BatchCounters, BatchError> {
        let count = batch.points.len().saturating_mul(lights.len());
        check_length("triples of output", count, out.len())?;
        let mut bits = vec![0; count];
        let mut counted = self.occluded(batch, lights, &mut bits)?;
        for (share, &is_shadowed) in out.iter_mut().zip(&bits) {
            *share = if is_shadowed == 0 { ALL } else { NOTHING };
        }
        let (Some(glass), true) = (self.glass(), !lights.is_empty()) else {
            return Ok(counted);
        };
        let run = Run::new(self, batch, lights)?;
        let length = chunk_length(batch.points.len());
        let task = antumbra_task::current();
        let filter = |(chunk, out): (usize, &mut [[f64; 3]])| {
            let mut counters = Counters::default();
            for (place, &light) in lights.iter().enumerate() {
                let first = chunk * length;
                self.filter_chunk((&run, glass), first, (place, light), out, &mut counters)?;
            }
            Ok(counters)
        };
        let tested: Vec<Result<Counters, BatchError>> = out
            .par_chunks_mut(length * lights.len())
            .enumerate()
            .map(|part| task.enter(|| filter(part)))
            .collect();
        for counters in tested {
            add_work(&mut counted.counters, &counters?);
        }
        Ok(counted)
    }

    /// Filters what reaches the points of a chunk from one of the batch's lights.
    fn filter_chunk<P: Coordinates>(
        &self,
        (run, glass): (&Run<'_, Self, P>, &Self),
        first: usize,
        (place, light): (usize, LightId),
        out: &mut [[f64; 3]],
        counters: &mut Counters,
    ) -> Result<(), BatchError> {
        let stride = run.lights().len();
        let mut lit = Vec::new();
        for (number, shares) in checked((0..).zip(out.chunks(stride))) {
            if shares[place] != NOTHING {
                lit.push((number * stride + place, run.start(first + number)?));
            }
        }
        let starts: Vec<ReceiverPoint> = lit.iter().map(|&(_, start)| start).collect();
        let mut is_behind = vec![false; starts.len()];
        glass
            .shadows(&starts, light, &mut is_behind, counters)
            .expect("starts and light were checked");
        for ((at, start), is_behind) in checked(lit.iter().zip(is_behind)) {
            if is_behind {
                out[*at] = self.filtered(glass, start, &self.lights()[light.index()], counters);
            }
        }
        Ok(())
    }

    /// Returns the product over all filtering surfaces between a point and a light that nothing opaque is between.
    fn filtered(
        &self,
        glass: &Self,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> [f64; 3] {
        let segment = self.occluders().segment(start, light);
        let mut met = Vec::new();
        glass.visit_crossed(&segment, counters, |surface| met.push(surface));
        self.product(&segment, met)
    }

    /// Returns the product over those of some surfaces that filter a segment.
    fn product(&self, segment: &Segment, met: Vec<SurfaceId>) -> [f64; 3] {
        let occluders = self.occluders();
        let filter = |surface| Some((surface, occluders.filtered_by(surface, segment)?));
        let mut filters: Vec<(SurfaceId, [f64; 3])> = met.into_iter().filter_map(filter).collect();
        filters.sort_unstable_by_key(|&(surface, _)| surface);
        // Parts of a curved shape filter once, together.
        filters.dedup_by_key(|&mut (surface, _)| match occluders.has_own_rule(surface) {
            true => (occluders.element_of(surface).0, true),
            false => (surface.0, false),
        });
        let product = |[r, g, b]: [f64; 3], (_, [x, y, z]): (_, [f64; 3])| [r * x, g * y, b * z];
        filters.into_iter().fold(ALL, product)
    }

    /// Returns what [`ShadowIndex::transmittance_of`] does by testing every surface: the reference of EXACTNESS.md.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn transmittance_by_reference(
        &self,
        start: &ReceiverPoint,
        light: LightId,
    ) -> Result<[f64; 3], QueryError> {
        if self.shadow_by_reference(start, light)? == Shadow::Shadowed {
            return Ok(NOTHING);
        }
        let (occluders, own) = (self.occluders(), start.surface);
        let segment = occluders.segment(start, &self.lights()[light.index()]);
        // Of shapes with the start's own rule the first counts.
        let has_own_rule =
            |&surface: &SurfaceId| own.is_some_and(|own| occluders.have_one_own_rule(own, surface));
        let own_parts = own.into_iter().flat_map(|own| occluders.own_parts(own));
        let others = occluders
            .surfaces()
            .filter(|surface| !has_own_rule(surface));
        Ok(self.product(&segment, others.chain(own_parts).collect()))
    }

    /// Visits every surface that a segment may cross, in any order: all that do, and perhaps others.
    fn visit_crossed(
        &self,
        segment: &Segment,
        counters: &mut Counters,
        mut visit: impl FnMut(SurfaceId),
    ) {
        let (occluders, own) = (self.occluders(), segment.start().surface);
        let is_own = |surface| own.is_some_and(|own| occluders.have_one_own_rule(own, surface));
        let mut visit_other = |surface: SurfaceId| {
            if !is_own(surface) {
                visit(surface);
            }
        };
        match self.bvh() {
            Some(bvh) => {
                let mut visit_hit = |hit: Hit| visit_other(hit.surface);
                bvh.all(&self.parts.near, segment, counters, &mut visit_hit);
                self.parts.all(occluders, segment, counters, &mut visit_hit);
            }
            None => {
                counters.intersections += occluders.surface_count() as u64;
                occluders.surfaces().for_each(&mut visit_other);
            }
        }
        // The own rule holds wherever the start is, so no walk finds all that it speaks of.
        let own_parts = own.into_iter().flat_map(|own| occluders.own_parts(own));
        own_parts.for_each(visit);
    }
}

/// Adds work among glass, but not its shadow queries: those about opaque surfaces are counted.
fn add_work(counters: &mut Counters, among_glass: &Counters) {
    counters.steps += among_glass.steps;
    counters.intersections += among_glass.intersections;
}
