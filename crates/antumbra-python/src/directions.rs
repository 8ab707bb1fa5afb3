//! Directions that all points share: which of them are lit, as bits.
//!
//! In: arrays of points and what is known of them, directions towards light from afar. Out: eight directions a byte, the
//! first in the lowest bit, 1 where a direction is lit and on the side that the point looks to.

use antumbra::{Coordinates, DirectionSet, Nearness, ReceiverSide};
use antumbra_geometry::Precision;
use numpy::{Element, PyArray2, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::area::side_of;
use crate::arrays::{Rows, rows};
use crate::index::{Meant, ShadowIndex};
use crate::work::stoppable;

/// A question besides its points.
struct Question<'a> {
    directions: DirectionSet,
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
    let directions =
        DirectionSet::new(directions).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let precision = match points {
        Rows::Double(_) => Precision::Double,
        Rows::Single(_) => Precision::Single,
    };
    let question = Question {
        directions,
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
        let width = self.directions.len().div_ceil(8);
        let out = PyArray2::<u8>::zeros(py, [end - begin, width], false);
        let mut writable = out.readwrite();
        let answers = writable.as_slice_mut()?;
        let counted = stoppable(py, self.threads, |_| {
            let stride = self.directions.word_count();
            let mut words = vec![0_u64; (end - begin) * stride];
            let index = &index.index;
            let counted =
                index.visible_directions(&batch, &self.directions, self.side, &mut words)?;
            if width > 0 {
                let lines = answers.par_chunks_exact_mut(width);
                lines
                    .zip(words.par_chunks_exact(stride))
                    .for_each(|(answers, words)| {
                        for (bytes, word) in answers.chunks_mut(8).zip(words) {
                            bytes.copy_from_slice(&word.to_le_bytes()[..bytes.len()]);
                        }
                    });
            }
            Ok(counted)
        })?;
        let counted =
            counted.map_err(|error| meant.error(&index.index, points, (begin, &error)))?;
        index.count(&counted);
        drop(writable);
        Ok(out)
    }
}
