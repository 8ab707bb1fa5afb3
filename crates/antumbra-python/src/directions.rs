//! Directions that all points share: which of them are lit, as bits.
//!
//! In: arrays of points and what is known of them, directions towards light from afar. Out: eight directions a byte, the
//! first in the lowest bit, 1 where a direction is lit and on the side that the point looks to.

use antumbra::{Batch, BatchKind, Coordinates, Nearness, ReceiverPoint, ReceiverSide, Targets};
use antumbra_geometry::{DVec3, LightShape, Occluders, Precision, SurfaceId};
use numpy::{Element, PyArray2, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::area::side_of;
use crate::arrays::{Rows, rows};
use crate::index::{Meant, ShadowIndex};
use crate::work::stoppable;

/// Points whose sides a thread looks at before it looks for other work.
const BLOCK: usize = 256;

/// What is asked besides points.
struct Question<'a> {
    targets: Vec<LightShape>,
    side: ReceiverSide,
    /// First and last row of the points, the last excluded.
    part: (usize, usize),
    surfaces: Option<&'a [u32]>,
    nearness: Nearness,
    threads: usize,
}

/// Answers for the rows of `part`: uint8, shape (rows, bytes). Errors name rows of all points.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
pub(crate) fn lit_towards<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    directions: PyReadonlyArray2<'py, f64>,
    normals: Option<Rows<'py>>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    side: &str,
    tolerance: Option<f64>,
    part: (usize, usize),
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let directions = rows::<f64, 3>(&directions, "directions")?;
    let towards = |&direction: &[f64; 3]| LightShape::Direction(DVec3::from_array(direction));
    let precision = match points {
        Rows::Double(_) => Precision::Double,
        Rows::Single(_) => Precision::Single,
    };
    let question = Question {
        targets: directions.iter().map(towards).collect(),
        side: side_of(side)?,
        part,
        surfaces: face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?,
        nearness: Nearness {
            precision,
            tolerance,
        },
        threads,
    };
    match (&points, &normals) {
        (Rows::Double(points), None) => question.answer(py, index, points, None),
        (Rows::Double(points), Some(Rows::Double(normals))) => {
            question.answer(py, index, points, Some(normals))
        }
        (Rows::Single(points), None) => question.answer(py, index, points, None),
        (Rows::Single(points), Some(Rows::Single(normals))) => {
            question.answer(py, index, points, Some(normals))
        }
        _ => Err(PyTypeError::new_err(
            "points and normals: expected one dtype for both",
        )),
    }
}

impl Question<'_> {
    fn answer<'py, T: Element>(
        &self,
        py: Python<'py>,
        index: &ShadowIndex,
        points: &PyReadonlyArray2<'py, T>,
        normals: Option<&PyReadonlyArray2<'py, T>>,
    ) -> PyResult<Bound<'py, PyArray2<u8>>>
    where
        [T; 3]: Coordinates,
    {
        let points = rows(points, "points")?;
        let normals = normals.map(|normals| rows(normals, "normals"));
        let meant = Meant::new(normals.transpose()?, self.surfaces, false, self.nearness);
        let (begin, end) = self.part;
        let part = meant.part(begin..end);
        let batch = part.batch(&points[begin..end]);
        let out = PyArray2::<u8>::zeros(py, [end - begin, self.targets.len().div_ceil(8)], false);
        let mut writable = out.readwrite();
        let answers = writable.as_slice_mut()?;
        let counted = stoppable(py, self.threads, |_| {
            let stride = self.targets.len().div_ceil(64);
            let mut words = vec![0_u64; (end - begin) * stride];
            let targets = Targets::Shared(&self.targets);
            let counted = index
                .index
                .occluded_targets_batch(&batch, targets, &mut words)?;
            self.write(index.index.occluders(), &batch, &words, answers);
            Ok(counted)
        })?;
        let counted =
            counted.map_err(|error| meant.error(&index.index, points, (begin, &error)))?;
        index.count(&counted);
        drop(writable);
        Ok(out)
    }

    /// Writes a bit for each direction that is neither occluded nor on the other side.
    fn write<P: Coordinates>(
        &self,
        occluders: &Occluders,
        batch: &Batch<'_, P>,
        words: &[u64],
        answers: &mut [u8],
    ) {
        let (stride, width) = (
            self.targets.len().div_ceil(64),
            self.targets.len().div_ceil(8),
        );
        if width == 0 {
            return;
        }
        let task = antumbra_task::current();
        let blocks = answers
            .par_chunks_mut(width * BLOCK)
            .zip(words.par_chunks(stride * BLOCK));
        blocks.enumerate().for_each(|(block, (answers, words))| {
            task.enter(|| {
                antumbra_task::check();
                let mut facing = Facing::new(self, occluders);
                let lines = answers.chunks_exact_mut(width);
                for (line, (answers, words)) in lines.zip(words.chunks_exact(stride)).enumerate() {
                    let facing = facing.of(batch, block * BLOCK + line);
                    for (bytes, (word, facing)) in
                        answers.chunks_mut(8).zip(words.iter().zip(facing))
                    {
                        let lit = !word & facing;
                        bytes.copy_from_slice(&lit.to_le_bytes()[..bytes.len()]);
                    }
                }
            });
        });
    }
}

/// Directions on the side that a point looks to. Neighbors on one triangle share them.
struct Facing<'a> {
    question: &'a Question<'a>,
    occluders: &'a Occluders,
    words: Vec<u64>,
    of_triangle: Option<u32>,
}

impl<'a> Facing<'a> {
    fn new(question: &'a Question<'a>, occluders: &'a Occluders) -> Self {
        let count = question.targets.len();
        let mut facing = Self {
            question,
            occluders,
            words: vec![0; count.div_ceil(64)],
            of_triangle: None,
        };
        // Who looks to both sides looks to all directions.
        facing.fill(|_| true);
        facing
    }

    fn fill(&mut self, is_facing: impl Fn(&LightShape) -> bool) {
        self.words.fill(0);
        for (place, target) in self.question.targets.iter().enumerate() {
            self.words[place / 64] |= u64::from(is_facing(target)) << (place % 64);
        }
    }

    fn of<P: Coordinates>(&mut self, batch: &Batch<'_, P>, point: usize) -> &[u64] {
        // Normals were looked at where the bits come from.
        let BatchKind::OnSurfaces { surfaces, .. } = batch.kind else {
            return &self.words;
        };
        let sign = match self.question.side {
            ReceiverSide::Front => 1,
            ReceiverSide::Back => -1,
            ReceiverSide::Both | ReceiverSide::Normal(_) => return &self.words,
        };
        let surface = surfaces[point];
        if self.of_triangle != Some(surface) {
            let start = ReceiverPoint {
                point: batch.points[point].as_f64(),
                surface: Some(SurfaceId(surface)),
            };
            let occluders = self.occluders;
            self.fill(|target| occluders.light_side(&start, target) == sign);
            // A curved surface has another normal at each point.
            let is_triangle = (surface as usize) < occluders.triangle_count();
            self.of_triangle = is_triangle.then_some(surface);
        }
        &self.words
    }
}
