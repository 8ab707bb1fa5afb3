//! NumPy arrays as slices of points.
//!
//! In: what the Python side prepared: C order, two axes, three columns. Out: slices of it. Invariant: what does
//! not fit is refused, never copied.

use numpy::{Element, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Rows of three coordinates, in the form that the caller has them.
#[derive(FromPyObject)]
pub(crate) enum Rows<'py> {
    /// `float64`.
    #[pyo3(transparent)]
    Double(PyReadonlyArray2<'py, f64>),
    /// `float32`.
    #[pyo3(transparent)]
    Single(PyReadonlyArray2<'py, f32>),
}

/// Returns an array's rows.
pub(crate) fn rows<'a, T: Element, const N: usize>(
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; N]]> {
    let refused = |what: &str| {
        let shape = array.shape();
        PyValueError::new_err(format!("{name}: {what}, found shape {shape:?}"))
    };
    if array.shape()[1] != N {
        return Err(refused(&format!("expected {N} columns")));
    }
    if !array.data().is_aligned() {
        return Err(refused("expected aligned numbers"));
    }
    let slice = array
        .as_slice()
        .map_err(|_| refused("expected C order without gaps"))?;
    Ok(slice.as_chunks().0)
}
