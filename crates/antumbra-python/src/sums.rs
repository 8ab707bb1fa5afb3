//! Weighted sums of bits: hours of sun, shares of the sky, energy.
//!
//! In: rows of bits, eight a byte, the first in the lowest; weights of each bit. Out: a sum a row and column of weights.
//! Invariant: a sum is added in the order of the bits, so it does not depend on threads or on other rows.

use numpy::{PyArray2, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::work::stoppable;

/// Rows that a thread adds up before it looks for other work.
const BLOCK: usize = 256;

/// Columns of weights that are added together: a vector of the machine.
const COLUMNS: usize = 4;

/// Sums of the weights of each four bits that are set, for all sixteen cases.
type Table = [[f64; COLUMNS]; 16];

/// Returns the sums of the weights of bits that are 1: float64, shape (rows, columns).
///
/// `bits` has shape (rows, bytes), `weights` (bits, columns). Bits beyond the last weight have to be 0.
#[pyfunction]
pub(crate) fn weighted_sums<'py>(
    py: Python<'py>,
    bits: PyReadonlyArray2<'py, u8>,
    weights: PyReadonlyArray2<'py, f64>,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let &[row_count, width] = bits.shape() else {
        unreachable!("two axes");
    };
    let &[weight_count, column_count] = weights.shape() else {
        unreachable!("two axes");
    };
    if weight_count.div_ceil(8) != width {
        return Err(PyValueError::new_err(format!(
            "{width} bytes a row do not hold a bit for each of {weight_count} weights"
        )));
    }
    let (bits, weights) = (bits.as_slice()?, weights.as_slice()?);
    let out = PyArray2::<f64>::zeros(py, [row_count, column_count], false);
    if row_count == 0 || column_count == 0 || width == 0 {
        return Ok(out);
    }
    let mut writable = out.readwrite();
    let sums = writable.as_slice_mut()?;
    stoppable(py, threads, |_| {
        let task = antumbra_task::current();
        for first in (0..column_count).step_by(COLUMNS) {
            let columns = COLUMNS.min(column_count - first);
            let tables = tables(weights, column_count, first, columns);
            let blocks = sums
                .par_chunks_mut(column_count * BLOCK)
                .zip(bits.par_chunks(width * BLOCK));
            blocks.for_each(|(sums, bits)| {
                task.enter(|| {
                    antumbra_task::check();
                    let lines = sums.chunks_exact_mut(column_count);
                    for (sums, bits) in lines.zip(bits.chunks_exact(width)) {
                        let sum = sum_of(&tables, bits);
                        sums[first..first + columns].copy_from_slice(&sum[..columns]);
                    }
                });
            });
        }
    })?;
    drop(writable);
    Ok(out)
}

/// Makes two tables a byte of a row, for its lower and its upper four bits.
fn tables(weights: &[f64], column_count: usize, first: usize, columns: usize) -> Vec<[Table; 2]> {
    let of_four = |weights: &[f64]| {
        let mut table = Table::default();
        for (case, sums) in table.iter_mut().enumerate() {
            let lines = weights.chunks_exact(column_count).enumerate();
            for (_, line) in lines.filter(|(bit, _)| case >> bit & 1 == 1) {
                for (sum, weight) in sums.iter_mut().zip(&line[first..first + columns]) {
                    *sum += weight;
                }
            }
        }
        table
    };
    let bytes = weights.chunks(8 * column_count);
    bytes
        .map(|weights| {
            let (lower, upper) = weights.split_at(weights.len().min(4 * column_count));
            [of_four(lower), of_four(upper)]
        })
        .collect()
}

fn sum_of(tables: &[[Table; 2]], bits: &[u8]) -> [f64; COLUMNS] {
    let mut sum = [0.0; COLUMNS];
    for (tables, &byte) in tables.iter().zip(bits) {
        // Nights and other sides: many bytes are zero.
        if byte == 0 {
            continue;
        }
        let (lower, upper) = (
            &tables[0][usize::from(byte & 15)],
            &tables[1][usize::from(byte >> 4)],
        );
        for column in 0..COLUMNS {
            sum[column] += lower[column] + upper[column];
        }
    }
    sum
}
