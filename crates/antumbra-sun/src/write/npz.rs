//! NumPy's `.npz`: all arrays of a study, uncompressed.

use std::io;
use std::path::Path;

use super::zip::ZipWriter;
use crate::arrays::{Array, Numbers, arrays};
use crate::record::Study;
use crate::sums::Sums;

/// Writes all arrays of a study and its `about`, JSON as bytes. `numpy.load` reads it, as does
/// [`read_npz`](crate::read_npz).
///
/// # Errors
/// The system refuses.
pub fn write_npz(path: &Path, study: &Study, sums: &Sums) -> io::Result<()> {
    antumbra_files::write(
        path,
        |error| error,
        |file| {
            let mut zip = ZipWriter::new(file);
            let about = serde_json::to_vec(&study.about)?;
            let about = Array {
                name: "about",
                axes: vec![("byte", about.len())],
                unit: "JSON",
                numbers: Numbers::U8(about),
            };
            for array in std::iter::once(about).chain(arrays(study, sums)) {
                zip.part(&format!("{}.npy", array.name), |out| {
                    out.write_all(&header(&array))?;
                    array.numbers.write(out)
                })?;
            }
            zip.finish()
        },
    )
}

/// Returns NumPy's name of a type.
pub(crate) fn descr(numbers: &Numbers) -> &'static str {
    match numbers {
        Numbers::F64(_) => "<f8",
        Numbers::F32(_) => "<f4",
        Numbers::I32(_) => "<i4",
        Numbers::U32(_) => "<u4",
        Numbers::U8(_) | Numbers::Bits(..) => "|u1",
        Numbers::Time(_) => "<M8[s]",
    }
}

/// Returns the header of an array, version 1.0, padded to a multiple of 64 bytes.
fn header(array: &Array) -> Vec<u8> {
    let lengths: String = array
        .axes
        .iter()
        .map(|(_, length)| format!("{length}, "))
        .collect();
    let shape = match array.axes.len() {
        1 => lengths.trim_end().to_owned(),
        _ => lengths.trim_end_matches(", ").to_owned(),
    };
    let text = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': ({shape}), }}",
        descr(&array.numbers)
    );
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{text:<width$}\n", width = length - 1).bytes());
    bytes
}
