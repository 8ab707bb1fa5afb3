//! How much of lights' colors reaches points through glass.
//!
//! In: arrays of points and what is known of them, lights. Out: an array of shares of red, green and blue.

use antumbra::{Coordinates, LightId, Nearness};
use antumbra_geometry::Precision;
use numpy::{Element, PyArray1, PyArray3, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{Rows, rows};
use crate::index::{Meant, ShadowIndex};
use crate::work::stoppable;

/// Returns shares: float64, shape (points, lights, 3).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
pub(crate) fn transmittance<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    lights: Vec<u32>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    on_surface: bool,
    tolerance: Option<f64>,
    was_single: bool,
    threads: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let lights = LightId::from_numbers(&lights);
    let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
    let precision = match was_single {
        true => Precision::Single,
        false => Precision::Double,
    };
    let nearness = Nearness {
        precision,
        tolerance,
    };
    match &points {
        Rows::Double(points) => {
            let meant = Meant::new(None, surfaces, on_surface, nearness);
            shares_of(py, index, points, lights, &meant, threads)
        }
        Rows::Single(points) => {
            let meant = Meant::new(None, surfaces, on_surface, nearness);
            shares_of(py, index, points, lights, &meant, threads)
        }
    }
}

fn shares_of<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: &PyReadonlyArray2<'py, T>,
    lights: &[LightId],
    meant: &Meant<'_, T>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>>
where
    [T; 3]: Coordinates,
{
    let points = rows(points, "points")?;
    let batch = meant.batch(points);
    let mut shares = vec![[0.0; 3]; points.len() * lights.len()];
    let counted = stoppable(py, threads, |_| {
        index.index.transmittances(&batch, lights, &mut shares)
    })?;
    let counted = counted.map_err(|error| meant.error(&index.index, points, (0, &error)))?;
    index.count(&counted);
    let shape = [points.len(), lights.len(), 3];
    PyArray1::from_vec(py, shares.into_flattened()).reshape(shape)
}
