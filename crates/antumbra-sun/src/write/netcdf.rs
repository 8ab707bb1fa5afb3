//! NetCDF, classic format with 64-bit offsets ("CDF-2"), which every netCDF library reads.
//!
//! Numbers stand highest byte first. The format has no unsigned numbers: bytes of bits bear the attribute `_Unsigned`,
//! and numbers of surfaces are doubles.

use std::io::{self, Write};
use std::path::Path;

use crate::arrays::{Array, Numbers, arrays};
use crate::record::Study;
use crate::sums::Sums;

const DIMENSION: u32 = 10;
const VARIABLE: u32 = 11;
const ATTRIBUTE: u32 = 12;

/// Types of the format.
const BYTE: u32 = 1;
const CHAR: u32 = 2;
const INT: u32 = 4;
const FLOAT: u32 = 5;
const DOUBLE: u32 = 6;

/// Most bytes of a variable that is not the last, and most of an axis.
const MOST_BYTES: u64 = (1 << 32) - 4;
const MOST_LENGTH: usize = (1 << 31) - 4;

/// Writes all arrays of a study, and its `about` as an attribute.
///
/// # Errors
/// The system refuses, or an array is larger than the format allows.
pub fn write_netcdf(path: &Path, study: &Study, sums: &Sums) -> io::Result<()> {
    let mut all = arrays(study, sums);
    // The last variable may be of any length.
    let size = |array: &Array| match array.numbers {
        Numbers::F32(_) => 2,
        Numbers::Bits(..) => 1,
        _ => 0,
    };
    all.sort_by_key(size);
    let (_, before) = all.split_last().ok_or(io::ErrorKind::InvalidInput)?;
    let is_long = |array: &Array| variable_bytes(array) > MOST_BYTES;
    let is_wide = |array: &Array| array.axes.iter().any(|&(_, length)| length > MOST_LENGTH);
    if before.iter().any(is_long) || all.iter().any(is_wide) {
        let message =
            "the study is larger than netCDF's classic format allows: write .npz or .zarr";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let about = serde_json::to_string(&study.about)?;
    // Offsets are known once the header's length is.
    let length = header(&all, &about, 0).len() as u64;
    let header = header(&all, &about, length);
    antumbra_files::write(
        path,
        |error| error,
        |file| {
            file.write_all(&header)?;
            all.iter().try_for_each(|array| write_numbers(file, array))
        },
    )
}

/// Returns the type of a variable and the bytes of a number.
fn kind(numbers: &Numbers) -> (u32, u64) {
    match numbers {
        Numbers::F64(_) | Numbers::U32(_) | Numbers::Time(_) => (DOUBLE, 8),
        Numbers::F32(_) => (FLOAT, 4),
        Numbers::I32(_) => (INT, 4),
        Numbers::U8(_) | Numbers::Bits(..) => (BYTE, 1),
    }
}

/// Returns the bytes of a variable, filled up to four.
fn variable_bytes(array: &Array) -> u64 {
    (array.count() as u64 * kind(&array.numbers).1).next_multiple_of(4)
}

fn word(out: &mut Vec<u8>, number: u32) {
    out.extend(number.to_be_bytes());
}

/// Writes text with its length, filled up to four bytes.
fn text(out: &mut Vec<u8>, text: &str) {
    word(out, text.len() as u32);
    out.extend(text.bytes());
    out.resize(out.len().next_multiple_of(4), 0);
}

fn attributes(out: &mut Vec<u8>, list: &[(&str, &str)]) {
    word(out, ATTRIBUTE);
    word(out, list.len() as u32);
    for (name, value) in list {
        text(out, name);
        word(out, CHAR);
        text(out, value);
    }
}

/// Returns the header; the first variable begins at `begin`.
fn header(all: &[Array], about: &str, begin: u64) -> Vec<u8> {
    let mut out = b"CDF\x02".to_vec();
    word(&mut out, 0);
    let mut axes: Vec<(&str, usize)> = Vec::new();
    for &axis in all.iter().flat_map(|array| &array.axes) {
        if !axes.contains(&axis) {
            axes.push(axis);
        }
    }
    word(&mut out, DIMENSION);
    word(&mut out, axes.len() as u32);
    for &(name, length) in &axes {
        text(&mut out, name);
        word(&mut out, length as u32);
    }
    attributes(
        &mut out,
        &[("title", "antumbra sun study"), ("about", about)],
    );
    word(&mut out, VARIABLE);
    word(&mut out, all.len() as u32);
    let mut at = begin;
    for array in all {
        text(&mut out, array.name);
        word(&mut out, array.axes.len() as u32);
        for axis in &array.axes {
            let place = axes
                .iter()
                .position(|known| known == axis)
                .unwrap_or_default();
            word(&mut out, place as u32);
        }
        match array.numbers {
            Numbers::Time(_) => attributes(
                &mut out,
                &[
                    ("units", "seconds since 1970-01-01 00:00:00"),
                    ("calendar", "proleptic_gregorian"),
                    ("clock", array.unit),
                ],
            ),
            Numbers::Bits(..) | Numbers::U8(_) => {
                attributes(&mut out, &[("unit", array.unit), ("_Unsigned", "true")]);
            }
            _ => attributes(&mut out, &[("unit", array.unit)]),
        }
        word(&mut out, kind(&array.numbers).0);
        let bytes = variable_bytes(array);
        word(&mut out, u32::try_from(bytes).unwrap_or(u32::MAX));
        out.extend(at.to_be_bytes());
        at += bytes;
    }
    out
}

fn write_numbers(out: &mut dyn Write, array: &Array) -> io::Result<()> {
    let mut double = |number: f64| out.write_all(&number.to_be_bytes());
    match &array.numbers {
        Numbers::F64(numbers) => numbers.iter().try_for_each(|&x| double(x))?,
        Numbers::U32(numbers) => numbers.iter().try_for_each(|&x| double(x.into()))?,
        // Below 2^53 for all years that there are.
        Numbers::Time(numbers) => numbers.iter().try_for_each(|&x| double(x as f64))?,
        Numbers::F32(numbers) => antumbra_task::checked(numbers.iter())
            .try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
        Numbers::I32(numbers) => numbers
            .iter()
            .try_for_each(|x| out.write_all(&x.to_be_bytes()))?,
        numbers @ (Numbers::U8(_) | Numbers::Bits(..)) => numbers.write(out)?,
    }
    let (_, size) = kind(&array.numbers);
    let filled = variable_bytes(array) - array.count() as u64 * size;
    out.write_all(&[0; 4][..filled as usize])
}
