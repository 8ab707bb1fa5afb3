//! Rays that ask what they meet.
//!
//! In: arrays of origins and directions. Out: arrays of faces, distances and points.

use antumbra::{Coordinates, Hits, RayBatch};
use antumbra_geometry::Hit;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays::{Rows, rows};
use crate::error::batch_error;
use crate::index::ShadowIndex;
use crate::work::stoppable;

/// Rays that are asked about together: hits take memory twice until they are in their arrays.
const BLOCK: usize = 1 << 18;

/// Ranges of rays that are asked about together: at least one, so that what does not depend on rays is checked
/// without any.
fn blocks(count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let starts = (0..count.max(1)).step_by(BLOCK);
    starts.map(move |start| start..count.min(start + BLOCK))
}

type Arrays<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

type ManyArrays<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Returns for each ray the nearest face, or -1, its distance in lengths of the direction, and where it is hit;
/// NaN where nothing is.
#[pyfunction]
pub(crate) fn nearest_hits<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: Rows<'py>,
    directions: Rows<'py>,
    leaves: Option<PyReadonlyArray1<'py, u32>>,
    threads: usize,
) -> PyResult<Arrays<'py>> {
    let leaves = leaves.as_ref().map(|ids| ids.as_slice()).transpose()?;
    match (&origins, &directions) {
        (Rows::Double(origins), Rows::Double(directions)) => {
            nearest_of(py, index, origins, directions, leaves, threads)
        }
        (Rows::Single(origins), Rows::Single(directions)) => {
            nearest_of(py, index, origins, directions, leaves, threads)
        }
        _ => Err(of_two_types()),
    }
}

/// Returns all that rays meet: the number of the ray, the face, the distance, the place; ray after ray, each by
/// distance.
#[pyfunction]
pub(crate) fn all_hits<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: Rows<'py>,
    directions: Rows<'py>,
    leaves: Option<PyReadonlyArray1<'py, u32>>,
    threads: usize,
) -> PyResult<ManyArrays<'py>> {
    let leaves = leaves.as_ref().map(|ids| ids.as_slice()).transpose()?;
    match (&origins, &directions) {
        (Rows::Double(origins), Rows::Double(directions)) => {
            all_of(py, index, origins, directions, leaves, threads)
        }
        (Rows::Single(origins), Rows::Single(directions)) => {
            all_of(py, index, origins, directions, leaves, threads)
        }
        _ => Err(of_two_types()),
    }
}

fn of_two_types() -> PyErr {
    PyTypeError::new_err("origins and directions: expected one dtype for both")
}

fn nearest_of<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: &PyReadonlyArray2<'py, T>,
    directions: &PyReadonlyArray2<'py, T>,
    leaves: Option<&[u32]>,
    threads: usize,
) -> PyResult<Arrays<'py>>
where
    [T; 3]: Coordinates,
{
    let (origins, directions) = (rows(origins, "origins")?, rows(directions, "directions")?);
    let count = origins.len();
    let mut faces = Vec::with_capacity(count);
    let mut distances = Vec::with_capacity(count);
    let mut points = Vec::with_capacity(3 * count);
    let mut hits: Vec<Option<Hit>> = Vec::new();
    for range in blocks(count) {
        let rays = RayBatch {
            origins: &origins[range.clone()],
            directions: &directions[range.clone()],
            leaves: leaves.map(|leaves| &leaves[range.clone()]),
        };
        hits.resize(range.len(), None);
        stoppable(py, threads, |_| index.index.nearest_hits(&rays, &mut hits))?
            .map_err(|error| batch_error(&error, range.start))?;
        for hit in &hits {
            faces.push(hit.map_or(-1, |hit| i64::from(hit.surface.0)));
            distances.push(hit.map_or(f64::NAN, |hit| hit.distance));
            points.extend(hit.map_or([f64::NAN; 3], |hit| hit.point.to_array()));
        }
    }
    Ok((
        PyArray1::from_vec(py, faces),
        PyArray1::from_vec(py, distances),
        PyArray1::from_vec(py, points).reshape([count, 3])?,
    ))
}

fn all_of<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    origins: &PyReadonlyArray2<'py, T>,
    directions: &PyReadonlyArray2<'py, T>,
    leaves: Option<&[u32]>,
    threads: usize,
) -> PyResult<ManyArrays<'py>>
where
    [T; 3]: Coordinates,
{
    let (origins, directions) = (rows(origins, "origins")?, rows(directions, "directions")?);
    let (mut rays_hit, mut faces, mut distances, mut points) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for range in blocks(origins.len()) {
        let rays = RayBatch {
            origins: &origins[range.clone()],
            directions: &directions[range.clone()],
            leaves: leaves.map(|leaves| &leaves[range.clone()]),
        };
        let Hits { hits, ends } = stoppable(py, threads, |_| index.index.all_hits(&rays))?
            .map_err(|error| batch_error(&error, range.start))?;
        let mut first = 0;
        for (number, end) in range.zip(ends) {
            for hit in &hits[first..end] {
                rays_hit.push(number as i64);
                faces.push(i64::from(hit.surface.0));
                distances.push(hit.distance);
                points.extend(hit.point.to_array());
            }
            first = end;
        }
    }
    let count = faces.len();
    Ok((
        PyArray1::from_vec(py, rays_hit),
        PyArray1::from_vec(py, faces),
        PyArray1::from_vec(py, distances),
        PyArray1::from_vec(py, points).reshape([count, 3])?,
    ))
}
