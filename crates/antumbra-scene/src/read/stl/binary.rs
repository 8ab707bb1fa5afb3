//! STL as bytes, little-endian: a header of 80, a count, 50 for each triangle.
//!
//! In: the bytes of a file. Out: one object, or none. Invariant: the count is compared with the
//! bytes that are there before anything is made of it.

use std::path::Path;

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind},
    model::Object,
    warning::WarningLog,
};

use super::Solid;

/// Bytes before the count.
const HEADER: usize = 80;
/// Bytes before the triangles.
const START: usize = HEADER + 4;
/// Bytes of a triangle: a normal and three vertices of three numbers, two bytes of attributes.
const TRIANGLE: usize = 50;
/// Bytes of a triangle before its vertices.
const NORMAL: usize = 12;

/// Returns how long a binary file of this triangle count is; `None` where there is no count.
pub(super) fn expected_length(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER..START)?.first_chunk::<4>()?;
    let count = u64::from(u32::from_le_bytes(*count));
    Some(START as u64 + count * TRIANGLE as u64)
}

/// Reads the triangles.
///
/// # Errors
/// The file is shorter than it says, or a coordinate is too large.
pub(super) fn read(
    file: &Path,
    bytes: &[u8],
    warnings: &mut WarningLog,
) -> Result<Vec<Object>, ReadError> {
    let fail = |at: usize, kind| {
        Err(ReadError {
            file: file.to_path_buf(),
            place: Place::Byte(at as u64),
            kind,
        })
    };
    let length = bytes.len();
    let Some(expected_length) = expected_length(bytes) else {
        let kind = ReadErrorKind::Expected {
            entity: "",
            expected: "STL: text that begins with `solid`, or 84 bytes and more".into(),
            found: format!("{length} bytes that are neither").into(),
            help: "check that this is an STL file",
        };
        return fail(0, kind);
    };
    let triangles = bytes[START..].chunks_exact(TRIANGLE);
    if expected_length > length as u64 {
        let announced = (expected_length - START as u64) / TRIANGLE as u64;
        let kind = ReadErrorKind::Expected {
            entity: "",
            expected: format!("{announced} triangles, {expected_length} bytes").into(),
            found: format!("the end of the file after {} triangles", triangles.len()).into(),
            help: "the file may be cut short, or no STL at all",
        };
        return fail(length, kind);
    }
    let surplus = length as u64 - expected_length;
    if surplus > 0 {
        let message = format!("{surplus} bytes after the last triangle are not read");
        warnings.add(Place::Byte(expected_length), message);
    }
    let mut solid = Solid::default();
    let end = expected_length as usize;
    let triangles = bytes[START..end].chunks_exact(TRIANGLE);
    for (index, triangle) in antumbra_task::checked(triangles.enumerate()) {
        let at = START + index * TRIANGLE;
        let mut numbers = [0.0; 9];
        let stored = triangle[NORMAL..].as_chunks::<4>().0;
        for (number, bytes) in numbers.iter_mut().zip(stored) {
            *number = f64::from(f32::from_le_bytes(*bytes));
        }
        if triangle[TRIANGLE - 2..] != [0, 0] {
            let message = "attributes (colors) of triangles are not read";
            warnings.add(Place::Byte((at + TRIANGLE - 2) as u64), message);
        }
        let [a, b, c, d, e, f, g, h, i] = numbers;
        let corners = [
            DVec3::new(a, b, c),
            DVec3::new(d, e, f),
            DVec3::new(g, h, i),
        ];
        // A file of 4 GiB has no byte beyond 2^32.
        solid.add(corners, at as u32);
    }
    let place = |at: u32| Place::Byte(at.into());
    let object = solid.finish(file, place, warnings)?;
    Ok(object.into_iter().collect())
}
