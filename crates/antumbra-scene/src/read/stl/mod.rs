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

use std::{collections::HashMap, path::Path};

use antumbra_geometry::DVec3;

use crate::{
    defaults::AMBIENT,
    error::{Place, ReadError, ReadErrorKind},
    model::{Facing, Material, Object, Scene, Shape},
    warning::WarningLog,
};

use super::{
    Loaded, ReadOptions, UpAxis,
    indexed::{Faces, Vertices},
    text::{Corners, check_bytes},
};

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

/// One solid as its triangles come in.
#[derive(Default)]
struct Solid {
    name: String,
    vertices: Vertices,
    faces: Faces,
    vertex_of: HashMap<[u64; 3], u32>,
}

impl Solid {
    /// Adds a triangle that is at a line or byte of the file.
    fn add(&mut self, corners: [DVec3; 3], at: u32) {
        let corners = corners.map(|corner| {
            // Adding 0 turns -0 into 0 and changes nothing else.
            let corner = corner + DVec3::ZERO;
            let key = corner.to_array().map(f64::to_bits);
            let positions = &mut self.vertices.positions;
            *self.vertex_of.entry(key).or_insert_with(|| {
                positions.push(corner);
                positions.len() as u32 - 1
            })
        });
        self.faces.add(corners, at);
    }

    /// Returns the solid as an object, if a face is left.
    fn finish(
        self,
        file: &Path,
        place: fn(u32) -> Place,
        warnings: &mut WarningLog,
    ) -> Result<Option<Object>, ReadError> {
        let mesh = self.faces.mesh(&self.vertices, place, warnings);
        let mesh = mesh.map_err(|(place, coordinate)| ReadError {
            file: file.to_path_buf(),
            place,
            kind: ReadErrorKind::Invalid {
                entity: "vertex",
                problem: Corners::too_large(coordinate).into(),
                help: "scale the scene down",
            },
        })?;
        Ok((!mesh.face_ends.is_empty()).then_some(Object {
            name: self.name,
            shape: Shape::Mesh(mesh),
            material: 0,
        }))
    }
}
