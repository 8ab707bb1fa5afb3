//! A batch on all threads: chunks of points, what each thread works with, and where answers go.
//!
//! In: a [`Batch`] and who answers it. Out: bytes or bits. Invariant: answers, errors and how queries were decided do not
//! depend on the number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use antumbra_geometry::{DVec3, LightId, ReceiverPoint, SurfaceId};
use antumbra_task::checked;

use super::off_surface::off_surface;
use super::points::{Batch, BatchKind, Coordinates};
use super::refused::BatchError;
use crate::accel::bvh::TARGETS as WORD;
use crate::limits::is_fine;
use crate::threads::{self, prelude::*};
use crate::{BatchCounters, Counters, Nearness, QueryError, ReceiverSide, ShadowIndex};

/// Fewest and most points that a thread takes at a time. Its buffers take 67 bytes a point.
const CHUNK: [usize; 2] = [1024, 32_768];

/// Chunks a thread, so that threads that are done early find more.
const CHUNKS_A_THREAD: usize = 4;

/// Who answers starts: an index with its own rays or with others.
pub(crate) trait Answers: Sync {
    fn index(&self) -> &ShadowIndex;

    /// Returns whether these lights are asked all at once.
    fn asks_at_once(&self, _lights: &[LightId]) -> bool {
        false
    }

    /// As [`ShadowIndex::shadows`].
    fn shadows(
        &self,
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError>;
}

impl Answers for ShadowIndex {
    fn index(&self) -> &ShadowIndex {
        self
    }

    fn asks_at_once(&self, lights: &[LightId]) -> bool {
        self.asks_lights_at_once(lights)
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

pub(crate) fn into_bytes<P: Coordinates>(
    answers: &impl Answers,
    batch: &Batch<P>,
    lights: &[LightId],
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
    lights: &[LightId],
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
    lights: &'a [LightId],
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
    starts: Vec<ReceiverPoint>,
    is_shadowed: Vec<bool>,
    /// Starts that face the light, and where they are in the chunk.
    facing: Vec<ReceiverPoint>,
    places: Vec<u16>,
    /// The lights that reach each start, where all are asked at once.
    visible: Vec<u64>,
}

impl<'a, A: Answers, P: Coordinates> Run<'a, A, P> {
    pub(crate) fn new(
        answers: &'a A,
        batch: &'a Batch<'a, P>,
        lights: &'a [LightId],
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
        if let Some(&light) = lights
            .iter()
            .find(|&&light| light.index() >= index.lights().len())
        {
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
        if !self.answers.asks_at_once(self.lights) {
            let index = self.answers.index();
            for &light in self.lights {
                index.expect_queries(light, self.batch.points.len() as u64);
            }
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
        if self.answers.asks_at_once(self.lights) {
            let left = (self.batch.points.len() - end) as f64 / end as f64;
            let index = self.answers.index();
            counted = index.all_lights_of_chunk(
                &buffers.starts,
                |number| match self.batch.kind {
                    BatchKind::Facing { normals } => {
                        ReceiverSide::Normal(normals[first + number].as_f64())
                    }
                    _ => ReceiverSide::Both,
                },
                left,
                &mut buffers.visible,
            );
            let stride = index.lights().len().div_ceil(WORD);
            for (number, &light) in self.lights.iter().enumerate() {
                let (word, bit) = (light.index() / WORD, light.index() % WORD);
                let words = buffers.visible.iter().skip(word).step_by(stride);
                buffers.is_shadowed.clear();
                let is_shadowed = words.map(|word| word >> bit & 1 == 0);
                buffers.is_shadowed.extend(is_shadowed);
                write(out, number, &buffers.is_shadowed);
            }
            return Ok(counted);
        }
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
        light: LightId,
        buffers: &mut Buffers,
        counters: &mut Counters,
    ) -> u64 {
        let Buffers {
            starts,
            is_shadowed,
            facing,
            places,
            ..
        } = buffers;
        facing.clear();
        places.clear();
        let shape = &self.answers.index().lights()[light.index()];
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
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        self.answers
            .shadows(starts, light, is_shadowed, counters)
            .expect("starts and light were checked");
    }

    /// Returns the lights that are asked.
    pub(crate) fn lights(&self) -> &[LightId] {
        self.lights
    }

    /// Returns the start that a point means.
    #[inline]
    pub(crate) fn start(&self, index: usize) -> Result<ReceiverPoint, BatchError> {
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
        Ok(ReceiverPoint { point, surface })
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
