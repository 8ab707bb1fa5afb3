//! Many points at once: slices in, bytes or bits out, on all threads.
//!
//! In: [`Batch`], points that may lie on surfaces or have normals. Out: an answer a point and light in the
//! caller's memory, the same for any number of threads. Invariant: an answer is that of
//! [`ShadowIndex::shadow`] for the start that the point means (EXACTNESS.md, "Points of a batch"). Absent
//! here: how a query is answered; files.

use std::sync::atomic::{AtomicUsize, Ordering};

use antumbra_geometry::{DVec3, Precision, Short, Start, SurfaceId};
use antumbra_task::checked;

use crate::index::LARGEST;
use crate::named::{OffSurface, off_surface};
use crate::own_rays::{AnyHit, WithRays};
use crate::threads::{self, prelude::*};
use crate::{Counters, Nearness, QueryError, ShadowIndex};

/// Fewest and most points that a thread takes at a time. Its buffers take 67 bytes a point.
const CHUNK: [usize; 2] = [1024, 32_768];

/// Chunks a thread, so that threads that are done early find more.
const CHUNKS_A_THREAD: usize = 4;

/// Three coordinates in the form that the caller has them.
pub trait Coordinates: Copy + Sync {
    /// How finely they are given.
    const PRECISION: Precision;

    /// Returns them as `f64`, without rounding.
    fn as_f64(self) -> DVec3;
}

impl Coordinates for DVec3 {
    const PRECISION: Precision = Precision::Double;

    fn as_f64(self) -> DVec3 {
        self
    }
}

impl Coordinates for [f64; 3] {
    const PRECISION: Precision = Precision::Double;

    fn as_f64(self) -> DVec3 {
        DVec3::from_array(self)
    }
}

impl Coordinates for [f32; 3] {
    const PRECISION: Precision = Precision::Single;

    fn as_f64(self) -> DVec3 {
        DVec3::from_array(self.map(f64::from))
    }
}

/// The name of a surface: a [`SurfaceId`], or its number.
pub trait SurfaceNumber: Copy {
    /// Returns the numbers of some, without a copy.
    fn numbers(surfaces: &[Self]) -> &[u32];
}

impl SurfaceNumber for SurfaceId {
    fn numbers(surfaces: &[Self]) -> &[u32] {
        Self::numbers(surfaces)
    }
}

impl SurfaceNumber for u32 {
    fn numbers(surfaces: &[Self]) -> &[u32] {
        surfaces
    }
}

/// Points to ask about, all of one kind.
///
/// Coordinates of points and normals are finite and at most 2^100 in magnitude.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a, P = [f64; 3]> {
    /// The points, world space.
    pub points: &'a [P],
    /// What they are.
    pub kind: BatchKind<'a, P>,
}

/// What the points of a [`Batch`] are. Slices have an item a point.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum BatchKind<'a, P = [f64; 3]> {
    /// Points of space: free queries.
    Free,
    /// Points of space that face somewhere. Those whose light is not strictly on their normal's side
    /// (`N . L <= 0`, the exact sign) are shadowed; the others are free queries from the point as given.
    Facing {
        /// World space, any length; a zero normal faces no light.
        normals: &'a [P],
    },
    /// Points on surfaces, up to rounding: surface queries. On a triangle or a disk the rule of starts repairs it;
    /// on a curved surface the point stays as given.
    OnSurfaces {
        /// Numbers of [`SurfaceId`]s.
        surfaces: &'a [u32],
        /// Largest distance of a point from its surface, world units, infinite for any. `None` for what rounding to
        /// `f32` may make of it ([`Occluders::rounding`](antumbra_geometry::Occluders::rounding)), whatever the
        /// points are given in: a point farther off most likely names another mesh's surface.
        tolerance: Option<f64>,
    },
    /// Points on surfaces, up to rounding, whose surfaces [`ShadowIndex::start_near`] finds: surface
    /// queries. As these do not depend on the side that is looked at, normals only choose among surfaces.
    OnNearest {
        /// World space, any length; zero for none.
        normals: Option<&'a [P]>,
        /// How near they are to them. The precision is that which the points had once, before they were
        /// perhaps widened.
        nearness: Nearness,
    },
}

impl<'a, P> Batch<'a, P> {
    /// Makes a batch of points of space.
    pub fn free(points: &'a [P]) -> Self {
        let kind = BatchKind::Free;
        Self { points, kind }
    }

    /// Makes a batch of points of space that face somewhere ([`BatchKind::Facing`]).
    pub fn facing(points: &'a [P], normals: &'a [P]) -> Self {
        let kind = BatchKind::Facing { normals };
        Self { points, kind }
    }

    /// Makes a batch of points on surfaces: a [`SurfaceId`] or its number for each ([`BatchKind::OnSurfaces`]).
    pub fn on_surfaces<S: SurfaceNumber>(points: &'a [P], surfaces: &'a [S]) -> Self {
        let kind = BatchKind::OnSurfaces {
            surfaces: S::numbers(surfaces),
            tolerance: None,
        };
        Self { points, kind }
    }

    /// Makes a batch of points on the nearest surfaces, as far as they are rounded
    /// ([`BatchKind::OnNearest`]).
    pub fn on_nearest(points: &'a [P], normals: Option<&'a [P]>) -> Self
    where
        P: Coordinates,
    {
        let nearness = Nearness {
            precision: P::PRECISION,
            tolerance: None,
        };
        let kind = BatchKind::OnNearest { normals, nearness };
        Self { points, kind }
    }
}

/// How the queries of a batch were decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchCounters {
    /// Those that were asked.
    pub counters: Counters,
    /// Those of [`BatchKind::Facing`] that were shadowed without being asked.
    pub facing_away: u64,
}

/// Why a batch has no answers. Where several points are at fault the first is named.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// A slice does not fit the points and lights.
    #[error("{what}: expected {expected}, found {found}")]
    Length {
        /// Which slice.
        what: &'static str,
        /// Items due.
        expected: usize,
        /// Items there.
        found: usize,
    },
    /// A light does not exist.
    #[error("light {0} does not exist")]
    UnknownLight(usize),
    /// A tolerance is NaN or negative.
    #[error("tolerance {}: expected zero or more, or infinity for any distance", Short(*.0))]
    BadTolerance(f64),
    /// A point is NaN, infinite or beyond 2^100.
    #[error("point {index} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*point))]
    BadPoint {
        /// Which point.
        index: usize,
        /// What it is.
        point: DVec3,
    },
    /// A normal is NaN, infinite or beyond 2^100.
    #[error("normal {index} is {}: components must be finite and at most 2^100 in magnitude", Short(*normal))]
    BadNormal {
        /// Which point's.
        index: usize,
        /// What it is.
        normal: DVec3,
    },
    /// What a point looks at, or the direction of a ray, is NaN, infinite or beyond 2^100.
    #[error("{what} {index} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*found))]
    BadTarget {
        /// An end or a direction.
        what: &'static str,
        /// Which point's.
        index: usize,
        /// What it is.
        found: DVec3,
    },
    /// A point names a surface that is not there.
    #[error("point {index}: surface {surface} does not exist")]
    UnknownSurface {
        /// Which point.
        index: usize,
        /// What it names.
        surface: u32,
    },
    /// No surface is near a point that is meant to lie on one.
    #[error("point {index} is {}: {}", Short(*point), said(nearest, *allowed))]
    NoSurface {
        /// Which point.
        index: usize,
        /// Where it is.
        point: DVec3,
        /// The nearest surface and its distance, world units; none in an empty scene.
        nearest: Option<(SurfaceId, f64)>,
        /// How far the surface might have been, world units.
        allowed: f64,
    },
    /// A point is not on the surface that it names.
    #[error(
        "point {} is {}: surface {} is {} away, more than the {} that rounding explains",
        first.index, first.point, first.surface, Short(first.distance), Short(first.allowed)
    )]
    OffSurface {
        /// The first such point.
        first: OffSurface,
    },
}

fn said(nearest: &Option<(SurfaceId, f64)>, allowed: f64) -> String {
    match nearest {
        Some((SurfaceId(surface), distance)) => format!(
            "the nearest surface, {surface}, is {} away, more than {}",
            Short(*distance),
            Short(allowed)
        ),
        None => "there is no surface".to_owned(),
    }
}

impl ShadowIndex {
    /// Answers every point of a batch for every light of `lights` (places in [`ShadowIndex::lights`], any
    /// order), and writes a byte each: 1 where the light is blocked, 0 where not. The lights of a point lie
    /// together, point after point: NumPy's shape `(points, lights)` in C order.
    ///
    /// Runs on all threads of the current rayon pool; answers, errors and how queries were decided do not depend
    /// on them. How many nodes rays visit and surfaces they test does: rays of a chunk walk together.
    /// Takes memory for the work of each thread, some two mebibytes at most, and nothing for each query.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{Batch, ShadowIndex};
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
    /// index.occluded(&Batch::on_nearest(&points, None), &[0], &mut is_shadowed)?;
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
        lights: &[usize],
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
        lights: &[usize],
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        into_bits(self, batch, lights, out)
    }
}

/// Who answers starts: an index with its own rays or with others.
pub(crate) trait Answers: Sync {
    fn index(&self) -> &ShadowIndex;

    /// As [`ShadowIndex::shadows`].
    fn shadows(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError>;
}

impl Answers for ShadowIndex {
    fn index(&self) -> &ShadowIndex {
        self
    }

    fn shadows(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        self.shadows(starts, light, is_shadowed, counters)
    }
}

impl<R: AnyHit> Answers for WithRays<'_, R> {
    fn index(&self) -> &ShadowIndex {
        self.index
    }

    fn shadows(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        self.shadows(starts, light, is_shadowed, counters)
    }
}

pub(crate) fn into_bytes<P: Coordinates>(
    answers: &impl Answers,
    batch: &Batch<P>,
    lights: &[usize],
    out: &mut [u8],
) -> Result<BatchCounters, BatchError> {
    let run = Run::new(answers, batch, lights)?;
    let stride = lights.len();
    check_length(
        "bytes of output",
        batch.points.len().saturating_mul(stride),
        out.len(),
    )?;
    let rest = &mut &mut *out;
    let outs = run
        .chunks()
        .map(|points| vec![split_off(rest, points * stride)]);
    run.answer(outs.collect(), |out, number, is_shadowed| {
        let bytes = out[0].iter_mut().skip(number).step_by(stride);
        for (byte, &is_shadowed) in bytes.zip(is_shadowed) {
            *byte = u8::from(is_shadowed);
        }
    })
}

pub(crate) fn into_bits<P: Coordinates>(
    answers: &impl Answers,
    batch: &Batch<P>,
    lights: &[usize],
    out: &mut [u8],
) -> Result<BatchCounters, BatchError> {
    let run = Run::new(answers, batch, lights)?;
    let stride = batch.points.len().div_ceil(8);
    check_length(
        "bytes of output",
        stride.saturating_mul(lights.len()),
        out.len(),
    )?;
    let mut columns: Vec<&mut [u8]> = out.chunks_exact_mut(stride.max(1)).collect();
    let outs = run.chunks().map(|points| {
        let bytes = points.div_ceil(8);
        columns
            .iter_mut()
            .map(|rest| split_off(rest, bytes))
            .collect()
    });
    run.answer(outs.collect(), |out, number, is_shadowed| {
        for (byte, is_shadowed) in out[number].iter_mut().zip(is_shadowed.chunks(8)) {
            let bits = is_shadowed.iter().enumerate();
            *byte = bits.fold(0, |byte, (bit, &is_shadowed)| {
                byte | u8::from(is_shadowed) << bit
            });
        }
    })
}

/// Takes the first bytes of a slice.
fn split_off<'o>(rest: &mut &'o mut [u8], length: usize) -> &'o mut [u8] {
    let (first, others) = std::mem::take(rest).split_at_mut(length);
    *rest = others;
    first
}

pub(crate) fn check_length(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), BatchError> {
    if expected == found {
        return Ok(());
    }
    Err(BatchError::Length {
        what,
        expected,
        found,
    })
}

/// A batch that is checked as a whole; its points are not.
pub(crate) struct Run<'a, A, P> {
    answers: &'a A,
    batch: &'a Batch<'a, P>,
    lights: &'a [usize],
    /// A multiple of 8, so that no two chunks share a byte of bits.
    chunk_length: usize,
}

/// Returns how many points a thread takes at a time: a multiple of 8.
pub(crate) fn chunk_length(count: usize) -> usize {
    let share = count / (CHUNKS_A_THREAD * threads::count());
    share.clamp(CHUNK[0], CHUNK[1]).next_multiple_of(8)
}

/// What a thread works with.
#[derive(Default)]
struct Buffers {
    starts: Vec<Start>,
    is_shadowed: Vec<bool>,
    /// Starts that face the light, and where they are in the chunk.
    facing: Vec<Start>,
    places: Vec<u16>,
}

impl<'a, A: Answers, P: Coordinates> Run<'a, A, P> {
    pub(crate) fn new(
        answers: &'a A,
        batch: &'a Batch<'a, P>,
        lights: &'a [usize],
    ) -> Result<Self, BatchError> {
        let index = answers.index();
        let count = batch.points.len();
        let tolerance = match batch.kind {
            BatchKind::Free => None,
            BatchKind::Facing { normals } => {
                check_length("normals", count, normals.len())?;
                None
            }
            BatchKind::OnSurfaces {
                surfaces,
                tolerance,
            } => {
                check_length("surfaces", count, surfaces.len())?;
                tolerance
            }
            BatchKind::OnNearest { normals, nearness } => {
                if let Some(normals) = normals {
                    check_length("normals", count, normals.len())?;
                }
                nearness.tolerance
            }
        };
        if let Some(tolerance) = tolerance
            && (tolerance.is_nan() || tolerance < 0.0)
        {
            return Err(BatchError::BadTolerance(tolerance));
        }
        if let Some(&light) = lights.iter().find(|&&light| light >= index.lights().len()) {
            return Err(BatchError::UnknownLight(light));
        }
        Ok(Self {
            answers,
            batch,
            lights,
            chunk_length: chunk_length(count),
        })
    }

    /// The numbers of points of all chunks.
    fn chunks(&self) -> impl Iterator<Item = usize> + use<'a, A, P> {
        let points = self.batch.points.chunks(self.chunk_length);
        points.map(<[P]>::len)
    }

    /// Answers all chunks. `write` takes a chunk's part of the output, the place of a light among those
    /// asked, and the answers.
    fn answer(
        &self,
        outs: Vec<Vec<&mut [u8]>>,
        write: impl Fn(&mut [&mut [u8]], usize, &[bool]) + Sync,
    ) -> Result<BatchCounters, BatchError> {
        // Nothing behind a chunk with a bad point needs an answer; all before it may hold a worse one.
        let first_bad = AtomicUsize::new(usize::MAX);
        for &light in self.lights {
            let index = self.answers.index();
            index.expect_queries(light, self.batch.points.len() as u64);
        }
        let task = antumbra_task::current();
        let counted = outs
            .into_par_iter()
            .enumerate()
            .map_init(Buffers::default, |buffers, (chunk, mut out)| {
                if chunk > first_bad.load(Ordering::Relaxed) {
                    return Ok(BatchCounters::default());
                }
                task.enter(|| self.answer_chunk(chunk, &mut out, &write, buffers))
                    .map_err(|error| {
                        first_bad.fetch_min(chunk, Ordering::Relaxed);
                        (chunk, error)
                    })
            })
            .reduce(
                || Ok(BatchCounters::default()),
                |first, second| match (first, second) {
                    (Ok(mut first), Ok(second)) => {
                        first.counters.add(&second.counters);
                        first.facing_away += second.facing_away;
                        Ok(first)
                    }
                    (Err(first), Err(second)) => {
                        Err(if first.0 < second.0 { first } else { second })
                    }
                    (Err(error), Ok(_)) | (Ok(_), Err(error)) => Err(error),
                },
            );
        counted.map_err(|(_, error)| error)
    }

    fn answer_chunk(
        &self,
        chunk: usize,
        out: &mut [&mut [u8]],
        write: &impl Fn(&mut [&mut [u8]], usize, &[bool]),
        buffers: &mut Buffers,
    ) -> Result<BatchCounters, BatchError> {
        let first = chunk * self.chunk_length;
        let end = self.batch.points.len().min(first + self.chunk_length);
        buffers.starts.clear();
        for index in checked(first..end) {
            buffers.starts.push(self.start(index)?);
        }
        let mut counted = BatchCounters::default();
        for (number, &light) in self.lights.iter().enumerate() {
            antumbra_task::check();
            buffers.is_shadowed.clear();
            buffers.is_shadowed.resize(end - first, true);
            match self.batch.kind {
                BatchKind::Facing { normals } => {
                    counted.facing_away += self.ask_facing(
                        &normals[first..end],
                        light,
                        buffers,
                        &mut counted.counters,
                    );
                }
                _ => {
                    let (starts, is_shadowed) = (&buffers.starts, &mut buffers.is_shadowed);
                    self.ask(starts, light, is_shadowed, &mut counted.counters);
                }
            }
            write(out, number, &buffers.is_shadowed);
        }
        Ok(counted)
    }

    /// Asks about the starts that face the light; returns how many do not.
    fn ask_facing(
        &self,
        normals: &[P],
        light: usize,
        buffers: &mut Buffers,
        counters: &mut Counters,
    ) -> u64 {
        let Buffers {
            starts,
            is_shadowed,
            facing,
            places,
        } = buffers;
        facing.clear();
        places.clear();
        let shape = &self.answers.index().lights()[light];
        for (place, (start, normal)) in (0..).zip(starts.iter().zip(normals)) {
            if shape.side_of(start.point, normal.as_f64()) > 0 {
                facing.push(*start);
                places.push(place);
            }
        }
        // The answers to the starts that face the light come first, then go to their places.
        let (asked, away_count) = (facing.len(), starts.len() - facing.len());
        self.ask(facing, light, &mut is_shadowed[..asked], counters);
        for (number, &place) in places.iter().enumerate().rev() {
            let place = usize::from(place);
            is_shadowed[place] = is_shadowed[number];
            if place != number {
                is_shadowed[number] = true;
            }
        }
        away_count as u64
    }

    fn ask(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        self.answers
            .shadows(starts, light, is_shadowed, counters)
            .expect("starts and light were checked");
    }

    /// Returns the start that a point means.
    #[inline]
    pub(crate) fn start(&self, index: usize) -> Result<Start, BatchError> {
        let point = self.batch.points[index].as_f64();
        if !is_fine(point) {
            return Err(BatchError::BadPoint { index, point });
        }
        let normal_of = |normals: &[P]| {
            let normal = normals[index].as_f64();
            if is_fine(normal) {
                Ok(normal)
            } else {
                Err(BatchError::BadNormal { index, normal })
            }
        };
        let surface = match self.batch.kind {
            BatchKind::Free => None,
            BatchKind::Facing { normals } => {
                normal_of(normals)?;
                None
            }
            BatchKind::OnSurfaces {
                surfaces,
                tolerance,
            } => {
                let surface = surfaces[index];
                let occluders = self.answers.index().occluders();
                if surface as usize >= occluders.surface_count() {
                    return Err(BatchError::UnknownSurface { index, surface });
                }
                if let Some(first) = off_surface(occluders, index, point, surface, tolerance) {
                    return Err(BatchError::OffSurface { first });
                }
                Some(SurfaceId(surface))
            }
            BatchKind::OnNearest { normals, nearness } => {
                let normal = normals.map(normal_of).transpose()?;
                let start = self.answers.index().start_near(point, normal, nearness);
                return start.ok_or_else(|| self.no_surface(index, point, nearness));
            }
        };
        Ok(Start { point, surface })
    }

    #[cold]
    fn no_surface(&self, index: usize, point: DVec3, nearness: Nearness) -> BatchError {
        let nearest = self.answers.index().nearest_surface(point);
        let occluders = self.answers.index().occluders();
        let allowed = nearness.tolerance.or_else(|| {
            nearest.map(|(surface, _)| occluders.allowed(surface, point, nearness.precision))
        });
        BatchError::NoSurface {
            index,
            point,
            nearest,
            allowed: allowed.unwrap_or(0.0),
        }
    }
}

/// Not for NaN.
#[inline]
pub(crate) fn is_fine(v: DVec3) -> bool {
    v.abs().cmple(DVec3::splat(LARGEST)).all()
}
