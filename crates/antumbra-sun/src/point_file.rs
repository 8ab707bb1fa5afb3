//! Lists of points in CSV files.
//!
//! In: a path. Out: points, and normals if there are columns for them. The first line names the columns: `x`, `y` and
//! `z`, and perhaps `nx`, `ny` and `nz`, in any order; other columns play no part.

use std::path::Path;

use crate::error::FileError;
use crate::text;

/// Columns that are read.
const COLUMNS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Points and normals of a CSV file.
#[derive(Clone, Debug, PartialEq)]
pub struct PointList {
    /// Points in world space.
    pub points: Vec<[f64; 3]>,
    /// Normals, if the file has all three columns of them.
    pub normals: Option<Vec<[f64; 3]>>,
}

/// Reads a list of points.
///
/// # Errors
/// A column is missing or there twice, or a row has no number where one is due.
pub fn read_points(file: &Path) -> Result<PointList, FileError> {
    parse(file, &text::read(file)?)
}

pub(crate) fn parse(file: &Path, text: &str) -> Result<PointList, FileError> {
    let mut lines = text::lines(text);
    let (number, head) = lines.next().unwrap_or((1, ""));
    let head = text::fields(head);
    let at = |line: usize, message: String| FileError::at(file, line, message);
    let mut places = [None; COLUMNS.len()];
    for (place, name) in head.iter().enumerate() {
        let column = COLUMNS
            .iter()
            .position(|column| name.eq_ignore_ascii_case(column));
        if let Some(column) = column
            && places[column].replace(place).is_some()
        {
            return Err(at(
                number,
                format!("the column `{}` is there twice", COLUMNS[column]),
            ));
        }
    }
    let [x, y, z, nx, ny, nz] = places;
    let (Some(x), Some(y), Some(z)) = (x, y, z) else {
        let found = text::shown(&head.join(","));
        let message = format!("expected a line with the columns `x`, `y` and `z`, found `{found}`");
        return Err(at(number, message));
    };
    let normal = match (nx, ny, nz) {
        (Some(x), Some(y), Some(z)) => Some([x, y, z]),
        (None, None, None) => None,
        _ => {
            let message = "expected all of the columns `nx`, `ny` and `nz`, or none".to_owned();
            return Err(at(number, message));
        }
    };
    let mut list = PointList {
        points: Vec::new(),
        normals: normal.map(|_| Vec::new()),
    };
    for (line, row) in lines {
        let fields = text::fields(row);
        let triple = |places: [usize; 3]| -> Result<[f64; 3], FileError> {
            let mut found = [0.0; 3];
            for (axis, place) in places.into_iter().enumerate() {
                let field = fields.get(place).map_or("", String::as_str);
                found[axis] = text::number(field).ok_or_else(|| {
                    let (name, field) = (&head[place], text::shown(field));
                    at(
                        line,
                        format!("`{name}` is `{field}`: expected a finite number"),
                    )
                })?;
            }
            Ok(found)
        };
        list.points.push(triple([x, y, z])?);
        if let (Some(normals), Some(places)) = (&mut list.normals, normal) {
            normals.push(triple(places)?);
        }
    }
    Ok(list)
}
