//! Which points of segments a light reaches.
//!
//! In: arrays of origins and ends, a light. Out: arrays of intervals, and where those of each segment begin.

use antumbra::{Coordinates, LightShape, LitIntervalsError};
use antumbra_geometry::Short;
use antumbra_scene::gather::light_shapes;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{Rows, rows};
use crate::index::ShadowIndex;
use crate::lights::{LightTuple, from_tuples};
use crate::work::stoppable;

type Arrays<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// Returns the place of the first interval of each segment and the end of the last one's; and the lit intervals.
#[pyfunction]
pub(crate) fn lit_intervals_along<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: Rows<'py>,
    ends: Rows<'py>,
    light: LightTuple,
    threads: usize,
) -> PyResult<Arrays<'py>> {
    let lights = from_tuples(vec![light])?;
    let [light] = light_shapes(&lights)[..] else {
        return Err(PyValueError::new_err("expected one light"));
    };
    match (&origins, &ends) {
        (Rows::Double(origins), Rows::Double(ends)) => {
            intervals_of(py, index, origins, ends, &light, threads)
        }
        (Rows::Single(origins), Rows::Single(ends)) => {
            intervals_of(py, index, origins, ends, &light, threads)
        }
        _ => Err(PyTypeError::new_err(
            "origins and ends: expected one dtype for both",
        )),
    }
}

fn intervals_of<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: &PyReadonlyArray2<'py, T>,
    ends: &PyReadonlyArray2<'py, T>,
    light: &LightShape,
    threads: usize,
) -> PyResult<Arrays<'py>>
where
    [T; 3]: Coordinates,
{
    let (origins, ends) = (rows(origins, "origins")?, rows(ends, "ends")?);
    let found = stoppable(py, threads, |_| {
        index.index.lit_intervals_of_segments(origins, ends, light)
    })?;
    let found = found.map_err(|error| refused(&error))?;
    let offsets = std::iter::once(0).chain(found.ends.iter().map(|&end| end as i64));
    let count = found.intervals.len();
    Ok((
        PyArray1::from_iter(py, offsets),
        PyArray1::from_vec(py, found.intervals.into_flattened()).reshape([count, 2])?,
    ))
}

fn refused(error: &LitIntervalsError) -> PyErr {
    let text = match error {
        LitIntervalsError::BadEnd {
            what,
            segment,
            found,
        } => {
            let found = Short(*found);
            format!(
                "{what}s[{segment}] is {found}: coordinates must be finite and at most 2^100 in magnitude"
            )
        }
        _ => error.to_string(),
    };
    PyValueError::new_err(text)
}
