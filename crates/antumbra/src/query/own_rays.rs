//! A renderer's own rays behind our values.
//!
//! In: queries, and whatever intersector a renderer has. Out: answers: exact where values, lists or an own
//! rule know, the renderer's where they do not. Absent here: a tree of ours.

use antumbra_geometry::{LightId, LightShape, ReceiverPoint};

use super::run::{self, Answers};
use crate::method::{self, Rays as _};
use crate::{
    Answer, Batch, BatchCounters, BatchError, Coordinates, Counters, Decided, Method, QueryError,
    Shadow, ShadowIndex,
};

/// Queries of an index without lists that are answered together.
const CHUNK: usize = 1024;

/// Any-hit rays of a renderer.
pub trait AnyHit: Sync {
    /// Returns whether an opaque surface is between `start` and `light`, both as given to the query.
    ///
    /// The rays must see the surfaces that the index was built over. How they leave the start's surface
    /// and what they do at edges is theirs, and is part of the answer. The far side of a closed curved
    /// surface need not be found: starts that shade themselves are not passed on.
    fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool;

    /// Answers as [`AnyHit::is_blocked`] for many queries of one light, and writes `true` where it is blocked. Both
    /// slices are as long; some have thousands of items, some one.
    ///
    /// A renderer that traces packets or streams of rays overrides it. Without, rays are traced one by one.
    fn are_occluded(&self, starts: &[ReceiverPoint], light: &LightShape, is_occluded: &mut [bool]) {
        for (start, is_occluded) in starts.iter().zip(is_occluded) {
            *is_occluded = self.is_blocked(start, light);
        }
    }
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
/// # use antumbra::{DVec3, LightId, LightShape, Occluders, Opacity, ReceiverPoint, SurfaceId};
/// struct Scene {/* a renderer's own */}
///
/// impl AnyHit for Scene {
///     fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
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
/// let start = ReceiverPoint { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
/// let answer = index.with_rays(&Scene {}).shadow(&start, LightId(0), &mut Counters::default())?;
/// // The value of the start's voxel knew; no ray was asked.
/// assert_eq!(answer.decided, Decided::FirstPass);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct WithRays<'a, R> {
    pub(crate) index: &'a ShadowIndex,
    pub(crate) rays: &'a R,
}

impl ShadowIndex {
    /// Returns the same index with a renderer's own rays in place of ours.
    pub fn with_rays<'a, R: AnyHit>(&'a self, rays: &'a R) -> WithRays<'a, R> {
        WithRays { index: self, rays }
    }
}

impl<R: AnyHit> WithRays<'_, R> {
    /// Answers one query, by what is known, else by the rays. Counts under `counters.shadow`.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow(
        &self,
        start: &ReceiverPoint,
        light: LightId,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        self.index.check_query(start, light)?;
        let rays = self.rays_to(light);
        let by_ray = || Answer::new(rays.is_occluded(start), Decided::Ray);
        let answer = match self.index.by_voxel_or(light.index(), rays) {
            _ if self.index.parts.is_far(start) => by_ray(),
            Some(by_voxel) => by_voxel.answer_one(start, counters),
            None => match self.first_pass(start, light) {
                Some(is_shadowed) => Answer::new(is_shadowed, Decided::FirstPass),
                None => by_ray(),
            },
        };
        // Values know the near surfaces only, rays all.
        let answer = match answer.decided {
            Decided::Ray => answer,
            _ => {
                let light = &self.index.lights()[light.index()];
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
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        assert_eq!(starts.len(), is_shadowed.len(), "one answer a start");
        if light.index() >= self.index.lights().len() {
            return Err(QueryError::UnknownLight(light));
        }
        match self.index.by_voxel_or(light.index(), self.rays_to(light)) {
            Some(by_voxel) if self.index.parts.is_whole() => {
                by_voxel.answer(starts, is_shadowed, counters, |start| {
                    self.index.check_query(start, light)
                })?;
            }
            Some(_) => {
                for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                    *is_shadowed = self.shadow(start, light, counters)?.shadow == Shadow::Shadowed;
                }
            }
            None => {
                let mut unknown = Unknown::default();
                let chunks = starts.chunks(CHUNK).zip(is_shadowed.chunks_mut(CHUNK));
                for (starts, is_shadowed) in chunks {
                    antumbra_task::check();
                    self.answer_chunk(starts, light, is_shadowed, counters, &mut unknown)?;
                }
            }
        }
        Ok(())
    }

    /// Answers queries of an index without lists: what is not known goes to the rays together.
    fn answer_chunk(
        &self,
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        unknown: &mut Unknown,
    ) -> Result<(), QueryError> {
        let shape = &self.index.lights()[light.index()];
        unknown.clear();
        for (number, start) in starts.iter().enumerate() {
            self.index.check_query(start, light)?;
            let known = match self.index.parts.is_far(start) {
                true => None,
                false => self.first_pass(start, light),
            };
            match known {
                Some(is_known_shadowed) => {
                    let answer = Answer::new(is_known_shadowed, Decided::FirstPass);
                    let answer = self.index.with_far(answer, start, shape, counters);
                    counters.shadow.count(answer);
                    is_shadowed[number] = answer.shadow == Shadow::Shadowed;
                }
                None => unknown.push(number, *start),
            }
        }
        let rays = self.rays_to(light);
        unknown.ask(
            |starts, out| rays.are_blocked(starts, out, counters),
            is_shadowed,
        );
        for &place in &unknown.places {
            counters
                .shadow
                .count(Answer::new(is_shadowed[place], Decided::Ray));
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
        lights: &[LightId],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        run::into_bytes(self, batch, lights, out)
    }

    /// Answers a batch into bits, as [`ShadowIndex::occluded_bits`] does.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded_bits`].
    pub fn occluded_bits<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        lights: &[LightId],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        run::into_bits(self, batch, lights, out)
    }

    fn rays_to(&self, light: LightId) -> RaysTo<'_, R> {
        RaysTo {
            index: self.index,
            rays: self.rays,
            light: &self.index.lights()[light.index()],
        }
    }

    /// What is known without blocker lists.
    fn first_pass(&self, start: &ReceiverPoint, light: LightId) -> Option<bool> {
        let index = self.index;
        if index.method() == Method::Voxel1990 {
            let segment = index
                .occluders()
                .segment(start, &index.lights()[light.index()]);
            let values = &index.values[light.index()];
            return method::first_pass(index.occluders(), index.grid(), values, &segment);
        }
        self.rays_to(light).is_self_shadowed(start).then_some(true)
    }
}

/// A renderer's rays to one light.
struct RaysTo<'a, R> {
    index: &'a ShadowIndex,
    rays: &'a R,
    light: &'a LightShape,
}

impl<R> Clone for RaysTo<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for RaysTo<'_, R> {}

impl<R: AnyHit> RaysTo<'_, R> {
    /// Asks a ray, once the start is known not to shade itself.
    fn is_occluded(&self, start: &ReceiverPoint) -> bool {
        self.is_self_shadowed(start) || self.rays.is_blocked(start, self.light)
    }

    fn is_self_shadowed(&self, start: &ReceiverPoint) -> bool {
        let own_rule = self.index.occluders().own_rule(start);
        own_rule.is_some_and(|rule| rule.hides(self.light))
    }
}

impl<R: AnyHit> method::Rays for RaysTo<'_, R> {
    fn is_blocked(&self, start: &ReceiverPoint, _: &mut Counters) -> bool {
        self.is_occluded(start)
    }

    fn are_blocked(&self, starts: &[ReceiverPoint], is_blocked: &mut [bool], _: &mut Counters) {
        let mut shaded = starts.iter().map(|start| self.is_self_shadowed(start));
        let Some(first) = shaded.position(|is_shaded| is_shaded) else {
            return self.rays.are_occluded(starts, self.light, is_blocked);
        };
        // Who shades itself is not asked.
        let mut unknown = Unknown::default();
        for (number, start) in starts.iter().enumerate() {
            match number >= first && self.is_self_shadowed(start) {
                true => is_blocked[number] = true,
                false => unknown.push(number, *start),
            }
        }
        let rays = |starts: &[ReceiverPoint], out: &mut [bool]| {
            self.rays.are_occluded(starts, self.light, out)
        };
        unknown.ask(rays, is_blocked);
    }
}

/// Queries that go to the rays together, and their places among all.
#[derive(Default)]
struct Unknown {
    starts: Vec<ReceiverPoint>,
    places: Vec<usize>,
    is_blocked: Vec<bool>,
}

impl Unknown {
    fn clear(&mut self) {
        self.starts.clear();
        self.places.clear();
    }

    fn push(&mut self, place: usize, start: ReceiverPoint) {
        self.starts.push(start);
        self.places.push(place);
    }

    /// Asks all, and writes each answer to its place.
    fn ask(&mut self, rays: impl FnOnce(&[ReceiverPoint], &mut [bool]), out: &mut [bool]) {
        self.is_blocked.clear();
        self.is_blocked.resize(self.starts.len(), false);
        rays(&self.starts, &mut self.is_blocked);
        for (&place, &is_blocked) in self.places.iter().zip(&self.is_blocked) {
            out[place] = is_blocked;
        }
    }
}

impl<R: AnyHit> Answers for WithRays<'_, R> {
    fn index(&self) -> &ShadowIndex {
        self.index
    }

    fn shadows(
        &self,
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        self.shadows(starts, light, is_shadowed, counters)
    }
}
