//! A renderer's own rays behind our values.
//!
//! In: queries, and whatever intersector a renderer has. Out: answers: exact where values, lists or an own
//! rule know, the renderer's where they do not. Absent here: a tree of ours.

use antumbra_geometry::{LightShape, Start};

use crate::shadow;
use crate::{
    Answer, Batch, BatchCounters, BatchError, Coordinates, Counters, Decided, Method, QueryError,
    Shadow, ShadowIndex,
};

/// Any-hit rays of a renderer.
pub trait AnyHit: Sync {
    /// Returns whether an opaque surface is between `start` and `light`, both as given to the query.
    ///
    /// The rays must see the surfaces that the index was built over. How they leave the start's surface
    /// and what they do at edges is theirs, and is part of the answer. The far side of a closed curved
    /// surface need not be told: starts that shade themselves are not asked.
    fn is_blocked(&self, start: &Start, light: &LightShape) -> bool;
}

/// An index whose rays are somebody else's: made by [`ShadowIndex::with_rays`].
///
/// Answers by values and blocker lists ([`Method::Voxel`]) or by values ([`Method::Voxel1990`]) and own
/// rules of curved surfaces are those of the reference, bit for bit. All others, counted under
/// [`Decided::Ray`], are what the rays say, exact or not. The other methods have no values, so the rays
/// answer nearly everything.
///
/// An index made with [`Builder::without_tree`](crate::Builder::without_tree) has all that is needed.
///
/// ```
/// # use std::sync::Arc;
/// use antumbra::{AnyHit, Counters, Decided, Method, ShadowIndex};
/// # use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, Start, SurfaceId};
/// struct Scene {/* a renderer's own */}
///
/// impl AnyHit for Scene {
///     fn is_blocked(&self, start: &Start, light: &LightShape) -> bool {
///         let direction = light.towards(start.point);
/// #       let _ = direction;
///         // Offset the start as usual, trace `direction`.
///         false
///     }
/// }
///
/// # let mut builder = Occluders::builder();
/// # let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
/// # builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
/// # let occluders = Arc::new(builder.build());
/// # let lamp = LightShape::Point(DVec3::new(0.0, 0.0, 9.0));
/// let index = ShadowIndex::builder(occluders, vec![lamp])
///     .method(Method::Voxel)
///     .without_tree()
///     .build()?;
/// let start = Start { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
/// let answer = index.with_rays(&Scene {}).shadow(&start, 0, &mut Counters::default())?;
/// // The value of the start's voxel knew; no ray was asked.
/// assert_eq!(answer.decided, Decided::FirstPass);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct WithRays<'a, R> {
    pub(crate) index: &'a ShadowIndex,
    pub(crate) rays: &'a R,
}

impl<R: AnyHit> WithRays<'_, R> {
    /// Answers one query, by what is known, else by the rays. Counts under `counters.shadow`.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow(
        &self,
        start: &Start,
        light: usize,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        self.index.check_query(start, light)?;
        let by_ray = |start: &Start, _: &mut Counters| self.is_blocked(start, light);
        let is_far = self.index.parts.is_far(start);
        let answer = match self.index.by_voxel_or(light, by_ray) {
            _ if is_far => Answer::new(self.is_blocked(start, light), Decided::Ray),
            Some(by_voxel) => by_voxel.answer_one(start, counters),
            None => match self.first_pass(start, light) {
                Some(is_shadowed) => Answer::new(is_shadowed, Decided::FirstPass),
                None => Answer::new(self.is_blocked(start, light), Decided::Ray),
            },
        };
        // Values know the near surfaces only, rays all.
        let answer = match answer.decided {
            Decided::Ray => answer,
            _ => {
                let light = &self.index.lights()[light];
                self.index.with_far(answer, start, light, counters)
            }
        };
        counters.shadow.count(answer);
        Ok(answer)
    }

    /// Answers queries of one light, as [`ShadowIndex::shadows`] does.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadows`].
    ///
    /// # Panics
    /// `is_shadowed` is not as long as `starts`.
    pub fn shadows(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        assert_eq!(starts.len(), is_shadowed.len(), "one answer a start");
        if light >= self.index.lights().len() {
            return Err(QueryError::UnknownLight(light));
        }
        let by_ray = |start: &Start, _: &mut Counters| self.is_blocked(start, light);
        if let Some(by_voxel) = self.index.by_voxel_or(light, by_ray)
            && self.index.parts.is_whole()
        {
            return by_voxel.answer(starts, is_shadowed, counters, |start| {
                self.index.check_query(start, light)
            });
        }
        for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
            *is_shadowed = self.shadow(start, light, counters)?.shadow == Shadow::Shadowed;
        }
        Ok(())
    }

    /// Answers a batch into bytes, as [`ShadowIndex::occluded`] does.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded`].
    pub fn occluded<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[usize],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        crate::batch::into_bytes(self, batch, lights, out)
    }

    /// Answers a batch into bits, as [`ShadowIndex::occluded_bits`] does.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded_bits`].
    pub fn occluded_bits<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[usize],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        crate::batch::into_bits(self, batch, lights, out)
    }

    /// A ray, once the start is known not to shade itself.
    fn is_blocked(&self, start: &Start, light: usize) -> bool {
        self.is_self_shadowed(start, light)
            || self.rays.is_blocked(start, &self.index.lights()[light])
    }

    fn is_self_shadowed(&self, start: &Start, light: usize) -> bool {
        let occluders = self.index.occluders();
        start.surface.is_some_and(|own| {
            occluders.has_own_rule(own)
                && occluders.own_rule_blocks(&occluders.segment(start, &self.index.lights()[light]))
        })
    }

    /// What is known without blocker lists.
    fn first_pass(&self, start: &Start, light: usize) -> Option<bool> {
        let index = self.index;
        if index.method() == Method::Voxel1990 {
            let segment = index.occluders().segment(start, &index.lights()[light]);
            let values = &index.values[light];
            return shadow::first_pass(index.occluders(), index.grid(), values, &segment);
        }
        self.is_self_shadowed(start, light).then_some(true)
    }
}
