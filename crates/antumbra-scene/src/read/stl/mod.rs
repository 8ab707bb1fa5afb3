//! STL, the triangle lists of stereolithography: as text or as bytes.
//!
//! In: the bytes of a file. Out: a scene with one mesh for each solid that has a face (a binary
//! file is one solid), in the default grey. Invariants: corners at one position are one vertex
//! (bit by bit; -0 counts as 0); every face has area.
//!
//! The normals in the file are ignored: the winding of a face says which side is its front, and
//! nothing is shaded smoothly. Coordinates in text are read as 64-bit numbers, so a text and a
//! binary file of one shape agree only as far as the text has digits. The format has no lights,
//! no view, no background and says nothing about up (+z unless the options say otherwise): the
//! scene has none either, and [`AMBIENT`] light.
//!
//! Text or bytes: a file as long as its triangle count says is binary, whatever its first word.
//! Any other is text if it begins with `solid`, comments (`#`) apart, and the kilobyte from there on has
//! no control characters.

mod ascii;
mod binary;
mod solid;

use std::path::Path;

use crate::defaults::AMBIENT;
use crate::error::{Place, ReadError};
use crate::model::{Facing, Material, Scene};
use crate::warning::WarningLog;

use super::text::check_bytes;
use super::{Loaded, ReadOptions, UpAxis};
use solid::Solid;

/// Reads STL from bytes. `file` is only a name for messages.
///
/// Time is linear in the number of bytes, memory a small multiple of it.
///
/// # Errors
/// The file is neither form of STL, ends within a triangle, a number is none, a coordinate
/// exceeds 2^100; errors name the line, or the byte in a binary file.
///
/// # Example
/// ```
/// use std::path::Path;
/// let text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
///     vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
/// let loaded = antumbra_scene::read::read_stl(Path::new("a.stl"), text, &Default::default());
/// assert_eq!(loaded.unwrap().scene.objects.len(), 1);
/// ```
pub fn read_stl(file: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Loaded, ReadError> {
    check_bytes(file, bytes)?;
    let mut warnings = WarningLog::new(file);
    let objects = if is_text(bytes) {
        ascii::read(file, bytes, &mut warnings)?
    } else {
        binary::read(file, bytes, &mut warnings)?
    };
    if objects.is_empty() {
        warnings.add(Place::Whole, "no faces in the file");
    }
    let has_objects = !objects.is_empty();
    let scene = Scene {
        materials: has_objects.then(Material::default).into_iter().collect(),
        objects,
        facing: Facing::Viewer,
        ambient: AMBIENT,
        up: options.up.unwrap_or(UpAxis::Z).vector(),
        ..Scene::default()
    };
    Ok(Loaded {
        scene,
        warnings: warnings.finish(),
        files: Vec::new(),
        is_up_assumed: options.up.is_none(),
    })
}

/// Tells the two forms apart; the module header says how.
fn is_text(bytes: &[u8]) -> bool {
    const LOOKED_AT: usize = 1024;
    if binary::expected_length(bytes) == Some(bytes.len() as u64) {
        return false;
    }
    let mut start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // Comments may come first.
    while let Some(comment) = start.trim_ascii_start().strip_prefix(b"#") {
        let end = comment.iter().position(|&b| b == b'\n' || b == b'\r');
        start = &comment[end.unwrap_or(comment.len())..];
    }
    let start = start.trim_ascii_start();
    let head = &start[..start.len().min(LOOKED_AT)];
    let word = head.get(..5).unwrap_or_default();
    let is_control = |byte: &u8| byte.is_ascii_control() && !byte.is_ascii_whitespace();
    word.eq_ignore_ascii_case(b"solid") && !head.iter().any(is_control)
}
