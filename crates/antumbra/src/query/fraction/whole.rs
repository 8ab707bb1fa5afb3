//! Samples of lights with size by what is known of the whole light, and by walks where nothing is.
//!
//! In: starts, and samples of one light. Out: a bit a sample. Invariant: a bit is that of [`ShadowIndex::shadow`] for the
//! sample, whatever is known. What is known lies in `crates/antumbra/src/occlusion/whole`. Absent here: where samples lie.

use std::ops::Range;

use antumbra_geometry::{AreaShape, LightShape, Occluders, ReceiverPoint};

use super::LightSampling;
use super::walker::{Walker, fill};
use crate::clock::Reading;
use crate::occlusion::{AskedOfWhole, Corners, Scene, Told, WHOLE_BLOCK, WholeSide, WholeView};
use crate::query::beam::{BadTargets, word_count};
use crate::query::points::ReceiverSide;
use crate::query::run::{Run, check_length};
use crate::threads::prelude::*;
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, QueryError, ShadowIndex,
    Targets,
};

/// Points that a thread takes at a time.
const CHUNK: usize = 1024;

/// Points between two looks at whether values pay.
const GROUP: usize = 64 * CHUNK;

/// Samples are fine.
const FINE: &str = "samples of a light are finite";

impl ShadowIndex {
    /// Answers which samples of a light with size are occluded, for many starts, one after another: bits as
    /// [`ShadowIndex::occluded_targets_of`] gives them, sooner where something is known of the whole light.
    ///
    /// With [`Method::Auto`](crate::Method) and [`Method::Voxel`](crate::Method), values for the whole light are made while
    /// samples are asked about, where that pays: for the part of a surface in a small cell they say that all of the light
    /// reaches every point, or that nothing of it does, or what little may block. Answers do not depend on them. Nothing is
    /// ever known of skies and very wide suns.
    ///
    /// Counts under `counters.shadow` each sample: under `first_pass` where a value answered, under `blocker_list` where a
    /// list did, else under `rays`.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Counters, ShadowIndex, Targets};
    /// # use antumbra_geometry::{
    /// #     AreaShape, DVec3, Occluders, Opacity, RectangleLight, Sphere, ReceiverPoint, SurfaceId
    /// # };
    /// # let mut builder = Occluders::builder();
    /// # let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
    /// # builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
    /// # let ball = Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 1.0 };
    /// # builder.add_sphere(ball, Opacity::Opaque)?;
    /// // A ball over a floor; both ends and the middle of a lamp above.
    /// let index = ShadowIndex::builder(Arc::new(builder.build()), Vec::new()).build()?;
    /// let edges = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(6.0, 0.0, 0.0)];
    /// let lamp = AreaShape::Rectangle(RectangleLight::new(DVec3::new(0.0, 0.0, 4.0), edges, false)?);
    /// let start = ReceiverPoint { point: DVec3::ZERO, surface: Some(SurfaceId(0)) };
    /// let sample = |v| lamp.sample(start.point, [0.5, v]).map(|sample| sample.target);
    /// let samples: Vec<_> = [0.0, 0.5, 0.99].into_iter().filter_map(sample).collect();
    /// let mut occluded = [0];
    /// let targets = Targets::Shared(&samples);
    /// index.occluded_samples_of(&[start], &lamp, targets, &mut occluded, &mut Counters::default())?;
    /// assert_eq!(occluded, [0b010]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded_targets_of`].
    ///
    /// # Panics
    /// As [`ShadowIndex::occluded_targets_of`]. Targets that are no samples of the light ([`AreaShape::sample`]) may have the
    /// answer of some that are; zero directions, in the place of samples that are not asked about, are never occluded.
    pub fn occluded_samples_of(
        &self,
        starts: &[ReceiverPoint],
        light: &AreaShape,
        samples: Targets,
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        let view = self.whole_lights().and_then(|whole| whole.view(light));
        let (Some(view), Some(bvh)) = (view, self.bvh()) else {
            return self.occluded_targets_of(starts, samples, occluded, counters);
        };
        for start in starts {
            self.check_start(start)?;
        }
        let per_start = samples.per_start();
        let stride = word_count(per_start);
        assert_eq!(occluded.len(), stride * starts.len(), "a bit a sample");
        assert!(samples.fit(starts.len()), "samples for each start");
        if stride == 0 {
            return Ok(());
        }
        let occluders = &*self.parts.near;
        let scene = Scene { occluders, bvh };
        let begin = view
            .weight_of(starts.len())
            .map(|weight| (Reading::now(), weight));
        let mut view = view;
        let mut asked = AskedOfWhole::default();
        let mut walker = Walker::new(stride);
        let mut answered = Ok(());
        let groups = starts
            .chunks(CHUNK)
            .zip(occluded.chunks_mut(CHUNK * stride));
        if view.is_eager() {
            view.make_for(&scene, &AskedOfWhole::default());
        }
        for (number, (starts, words)) in groups.enumerate() {
            let mut asked_now = AskedOfWhole::default();
            let mut told = tell_all(&view, occluders, starts, &mut asked_now);
            if view.is_eager() && asked_now.has_missed() {
                drop(told);
                view.make_for(&scene, &asked_now);
                view = view.anew();
                asked_now = AskedOfWhole::default();
                told = tell_all(&view, occluders, starts, &mut asked_now);
            }
            asked.add(asked_now);
            let known = (view.corners(), told.as_flattened());
            let samples = samples.part(number * CHUNK, starts.len());
            let starts = (starts, samples);
            answered = self.occluded_samples_by(&mut walker, known, starts, words, counters);
            if answered.is_err() {
                break;
            }
        }
        if answered.is_err() {
            return match samples.first_bad() {
                Some((index, target)) => Err(QueryError::BadTarget { index, target }),
                None => unreachable!("a sample is bad"),
            };
        }
        if let Some((begin, weight)) = begin {
            self.note_whole(&view, &scene, &asked, (begin.elapsed_ns(), weight));
        }
        Ok(())
    }

    /// Answers the samples of some starts, up to one that has no answer.
    fn occluded_samples_by(
        &self,
        walker: &mut Walker,
        (corners, told): (Option<&Corners>, &[Told<'_>]),
        (starts, samples): (&[ReceiverPoint], Targets),
        occluded: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), BadTargets> {
        let per_start = samples.per_start();
        let words = occluded.chunks_mut(word_count(per_start));
        for (number, (start, words)) in starts.iter().zip(words).enumerate() {
            if number.is_multiple_of(WHOLE_BLOCK) {
                antumbra_task::check();
            }
            let targets = samples.of(number);
            let leaves = match told[number] {
                Told::Lit { .. } => {
                    words.fill(0);
                    counters.shadow.first_pass += per_start as u64;
                    continue;
                }
                Told::Dark => {
                    let hidden = fill(words, targets);
                    counters.shadow.first_pass += per_start as u64;
                    counters.shadow.shadowed += hidden;
                    continue;
                }
                Told::Listed(leaves) => Some(leaves),
                Told::Open | Told::Behind => None,
            };
            let known = (corners, leaves);
            walker.walk(self, start, targets, known, words, counters)?;
        }
        Ok(())
    }

    /// Answers the samples of one start that was checked, all on one side of its surface.
    pub(super) fn occluded_samples(
        &self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        light: &AreaShape,
        targets: &[LightShape],
        occluded: &mut [u64],
        counters: &mut Counters,
    ) {
        let mut walker = Walker::new(occluded.len());
        let side = whole_side(side, start);
        let view = self.whole_lights().filter(|_| side.is_some());
        let view = view.and_then(|whole| whole.view(light));
        let (Some(side), Some(view), Some(bvh)) = (side, view, self.bvh()) else {
            let known = (None, None);
            let answered = walker.walk(self, start, targets, known, occluded, counters);
            return answered.expect(FINE);
        };
        let occluders = &*self.parts.near;
        let scene = Scene { occluders, bvh };
        let starts = std::slice::from_ref(start);
        let view = self.with_what_is_asked(view, &scene, starts, side);
        let begin = view
            .weight_of(starts.len())
            .map(|weight| (Reading::now(), weight));
        let mut asked = AskedOfWhole::default();
        let leaves = match view.tell(occluders, starts, side, &mut asked)[0] {
            Told::Lit { .. } => {
                counters.shadow.first_pass += targets.len() as u64;
                None
            }
            Told::Dark => {
                counters.shadow.first_pass += targets.len() as u64;
                counters.shadow.shadowed += fill(occluded, targets);
                None
            }
            Told::Behind if targets.is_empty() => None,
            Told::Listed(leaves) => Some(Some(leaves)),
            Told::Open | Told::Behind => Some(None),
        };
        if let Some(leaves) = leaves {
            let known = (view.corners(), leaves);
            let answered = walker.walk(self, start, targets, known, occluded, counters);
            answered.expect(FINE);
        }
        if let Some((begin, weight)) = begin {
            self.note_whole(&view, &scene, &asked, (begin.elapsed_ns(), weight));
        }
    }

    /// Writes the visible fraction of a light that something may be known of, for every point of a batch.
    pub(super) fn lit_shares_of_whole<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        side: ReceiverSide,
        light: &AreaShape,
        sampling: &LightSampling,
        fractions: &mut [f32],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        check_length("fractions", batch.points.len(), fractions.len())?;
        let task = antumbra_task::current();
        let mut sum = BatchCounters::default();
        // What the points of one group cost says what pays for the next.
        for (group, fractions) in fractions.chunks_mut(GROUP).enumerate() {
            let counted: Vec<Result<(BatchCounters, AskedOfWhole, u64), BatchError>> = fractions
                .par_chunks_mut(CHUNK)
                .enumerate()
                .map_init(Chunk::default, |chunk, (number, fractions)| {
                    task.enter(|| {
                        let first = group * GROUP + number * CHUNK;
                        let rows = first..first + fractions.len();
                        chunk.take(|row| run.start(row), batch, side, rows)?;
                        Ok(self.shares_of_chunk(chunk, light, sampling, first, fractions))
                    })
                })
                .collect();
            let mut all = AskedOfWhole::default();
            let mut all_ns = 0;
            // The first error is that of the first point at fault.
            for counted in counted {
                let (counted, asked, ns) = counted?;
                sum.counters.add(&counted.counters);
                sum.facing_away += counted.facing_away;
                all.add(asked);
                all_ns += ns;
            }
            let view = self.whole_lights().and_then(|whole| whole.view(light));
            if let (Some(view), Some(bvh)) = (view, self.bvh()) {
                let occluders = &*self.parts.near;
                if let Some(weight) = view.weight_of(fractions.len()) {
                    self.note_whole(&view, &Scene { occluders, bvh }, &all, (all_ns, weight));
                }
            }
        }
        Ok(sum)
    }

    /// Writes the visible fractions of some starts in a row.
    fn shares_of_chunk(
        &self,
        chunk: &mut Chunk,
        light: &AreaShape,
        sampling: &LightSampling,
        first: usize,
        fractions: &mut [f32],
    ) -> (BatchCounters, AskedOfWhole, u64) {
        let mut counted = BatchCounters::default();
        let mut asked = AskedOfWhole::default();
        let view = self.whole_lights().and_then(|whole| whole.view(light));
        let (Some(view), Some(bvh)) = (view, self.bvh()) else {
            unreachable!("the caller looked");
        };
        let Chunk {
            starts,
            sides,
            targets,
            occluded,
        } = chunk;
        let occluders = &*self.parts.near;
        let scene = Scene { occluders, bvh };
        let per_start = sampling.count() as usize;
        occluded.resize(word_count(per_start), 0);
        let mut walker = Walker::new(word_count(per_start));
        // Starts that share what is asked about are told together.
        let side = sides.first().map_or(WholeSide::All, |(_, whole)| *whole);
        let view = self.with_what_is_asked(view, &scene, starts, side);
        let begin = Reading::now();
        for (number, starts) in starts.chunks(WHOLE_BLOCK).enumerate() {
            antumbra_task::check();
            let told = view.tell(occluders, starts, side, &mut asked);
            for (at, start) in starts.iter().enumerate() {
                let row = number * WHOLE_BLOCK + at;
                let fraction = &mut fractions[row];
                match told[at] {
                    // Not by a normal of the caller's.
                    Told::Lit {
                        are_all_asked: true,
                    } if !matches!(sides[row].0, ReceiverSide::Normal(_)) => {
                        counted.counters.shadow.first_pass += per_start as u64;
                        *fraction = 1.0;
                        continue;
                    }
                    Told::Behind => {
                        counted.facing_away += per_start as u64;
                        *fraction = 0.0;
                        continue;
                    }
                    _ => {}
                }
                targets.clear();
                let point = ((first + row) as u64, sampling);
                let sample = |place| light.sample(start.point, place);
                self.each_sample(start, sides[row].0, point, sample, |sample| {
                    targets.extend(sample.map(|sample| sample.target));
                });
                counted.facing_away += (per_start - targets.len()) as u64;
                let words = &mut occluded[..word_count(targets.len())];
                let counters = &mut counted.counters;
                let leaves = match told[at] {
                    Told::Lit { .. } => {
                        words.fill(0);
                        counters.shadow.first_pass += targets.len() as u64;
                        *fraction = share(targets.len(), per_start);
                        continue;
                    }
                    Told::Dark => {
                        counters.shadow.first_pass += targets.len() as u64;
                        counters.shadow.shadowed += targets.len() as u64;
                        *fraction = 0.0;
                        continue;
                    }
                    Told::Listed(leaves) => Some(leaves),
                    Told::Open | Told::Behind => None,
                };
                let known = (view.corners(), leaves);
                let answered = walker.walk(self, start, targets, known, words, counters);
                answered.expect(FINE);
                let hidden: u32 = words.iter().map(|word| word.count_ones()).sum();
                *fraction = share(targets.len() - hidden as usize, per_start);
            }
        }
        (counted, asked, begin.elapsed_ns())
    }

    /// Returns a light with the values of some starts made, where the index makes all that is asked for.
    fn with_what_is_asked<'a>(
        &'a self,
        view: WholeView<'a>,
        scene: &Scene<'_>,
        starts: &[ReceiverPoint],
        side: WholeSide,
    ) -> WholeView<'a> {
        if !view.is_eager() {
            return view;
        }
        view.make_for(scene, &AskedOfWhole::default());
        let mut asked = AskedOfWhole::default();
        for starts in starts.chunks(WHOLE_BLOCK) {
            view.tell(scene.occluders, starts, side, &mut asked);
        }
        view.make_for(scene, &asked);
        view.anew()
    }

    /// Notes what some starts took, and makes values where that pays.
    fn note_whole(
        &self,
        view: &WholeView<'_>,
        scene: &Scene<'_>,
        asked: &AskedOfWhole,
        timed: (u64, u32),
    ) {
        let is_refining = self.knowledge().is_some_and(|values| values.is_refining());
        view.note(scene, asked, timed, is_refining && !view.is_eager());
    }

    /// Returns the lowest corner of the cells of whole lights and their edge, for tests that aim at what is between them.
    #[doc(hidden)]
    pub fn whole_light_planes(&self) -> Option<(antumbra_geometry::DVec3, f64)> {
        self.whole_lights().map(|whole| whole.planes_between())
    }

    /// Returns the bytes of what is known of whole lights. They are a part of [`ShadowIndex::knowledge_bytes`].
    pub fn whole_light_bytes(&self) -> u64 {
        self.asked_whole_lights().map_or(0, |whole| whole.bytes())
    }
}

/// Returns which part of a light a side of a receiver sees; `None` where a normal says so.
fn whole_side(side: ReceiverSide, start: &ReceiverPoint) -> Option<WholeSide> {
    match side {
        ReceiverSide::Front => Some(WholeSide::Front),
        ReceiverSide::Back => Some(WholeSide::Back),
        ReceiverSide::Both => Some(WholeSide::All),
        // What is known of points of space holds for whatever they ask about.
        ReceiverSide::Normal(_) => start.surface.is_none().then_some(WholeSide::All),
    }
}

/// Tells what is known of some starts, block by block: the starts' own order.
fn tell_all<'a>(
    view: &'a WholeView<'_>,
    occluders: &Occluders,
    starts: &[ReceiverPoint],
    asked: &mut AskedOfWhole,
) -> Vec<[Told<'a>; WHOLE_BLOCK]> {
    starts
        .chunks(WHOLE_BLOCK)
        .map(|starts| view.tell(occluders, starts, WholeSide::All, asked))
        .collect()
}

fn share(lit: usize, of: usize) -> f32 {
    (lit as f64 / of as f64) as f32
}

/// What a thread works with.
#[derive(Default)]
struct Chunk {
    starts: Vec<ReceiverPoint>,
    sides: Vec<(ReceiverSide, WholeSide)>,
    targets: Vec<LightShape>,
    occluded: Vec<u64>,
}

impl Chunk {
    /// Takes the starts of some rows.
    fn take<P: Coordinates>(
        &mut self,
        start: impl Fn(usize) -> Result<ReceiverPoint, BatchError>,
        batch: &Batch<P>,
        side: ReceiverSide,
        rows: Range<usize>,
    ) -> Result<(), BatchError> {
        self.starts.clear();
        self.sides.clear();
        for row in rows {
            antumbra_task::check();
            let start = start(row)?;
            let side = match batch.kind {
                BatchKind::Facing { normals } => ReceiverSide::Normal(normals[row].as_f64()),
                _ => side,
            };
            // With a normal nothing is said of what lies on which side: points of space ask about all.
            let whole = whole_side(side, &start).unwrap_or(WholeSide::All);
            self.starts.push(start);
            self.sides.push((side, whole));
        }
        Ok(())
    }
}
