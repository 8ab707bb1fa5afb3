//! PLY, the Stanford polygon format: a header in text, a body in text or in bytes.
//!
//! In: the bytes of a file. Out: a scene with one mesh, in the default grey. Invariants: the mesh
//! holds the positions and normals its faces use, each once, in the order of first use; every
//! face has area; no count in the file is believed before the bytes behind it are there.
//!
//! Read are `vertex` with `x`, `y`, `z` and, if all three are there, `nx`, `ny`, `nz` or `red`, `green`,
//! `blue`; `face` with the list `vertex_indices` (or `vertex_index`); and `tristrips` with such a list,
//! in which -1 begins another strip; in any order, of any types, among any other properties.
//! Everything else is stepped over exactly and named in a warning. Colors are taken for sRGB; alpha is
//! not used: all surfaces are opaque. The format has no lights, no view, no background and says
//! nothing about up (+z unless the options say otherwise): the scene has none either, and
//! [`AMBIENT`] light.
//!
//! This is no use of the crate `ply-rs-bw`: its errors have no byte offsets in binary files.

mod body;
mod columns;
mod header;
mod lines;

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_task::checked;

use crate::{
    defaults::AMBIENT,
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{Color, Facing, Material, Object, Scene, Shape},
    texture::linear_of_srgb,
    warning::WarningLog,
};

use super::{
    Loaded, ReadOptions, UpAxis,
    indexed::{Faces, Vertices},
    text::{Corners, LARGEST_COORDINATE, check_bytes},
};
use body::{Ascii, Binary, Body, Fault};
use columns::{COLOR, NORMAL, index_list, vertex_slots, warn_unused};
use header::{Element, Encoding, Header, PropertyKind, read_header};

/// Reads PLY from bytes. `file` is only a name for messages.
///
/// Time is linear in the number of bytes, memory a small multiple of it.
///
/// # Errors
/// The header is malformed, the body ends early, a number is none, a coordinate of a face
/// exceeds 2^100, an index names no vertex; errors name the line, or the byte in a binary body.
///
/// # Example
/// ```
/// use std::path::Path;
/// let text = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
///     property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
///     0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let loaded = antumbra_scene::read::read_ply(Path::new("a.ply"), text, &Default::default());
/// assert_eq!(loaded.unwrap().scene.objects.len(), 1);
/// ```
pub fn read_ply(file: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Loaded, ReadError> {
    check_bytes(file, bytes)?;
    let header = read_header(file, bytes)?;
    let mut scene = Scene {
        facing: Facing::Viewer,
        ambient: AMBIENT,
        up: options.up.unwrap_or(UpAxis::Z).vector(),
        ..Scene::default()
    };
    let mut warnings = WarningLog::new(file);
    warn_unused(&header, &mut warnings);
    let start = header.body_start;
    let shape = match header.encoding {
        Encoding::Ascii => {
            let body = Ascii::new(&bytes[start..], header.body_line);
            Reader { file, body }.read(&header, &mut warnings)?
        }
        Encoding::LittleEndian => {
            let body = Binary::<false>::new(bytes, start);
            Reader { file, body }.read(&header, &mut warnings)?
        }
        Encoding::BigEndian => {
            let body = Binary::<true>::new(bytes, start);
            Reader { file, body }.read(&header, &mut warnings)?
        }
    };
    if let Some(shape) = shape {
        let has_colors = matches!(&shape, Shape::Mesh(mesh) if !mesh.colors.is_empty());
        scene.materials.push(Material {
            diffuse: if has_colors {
                Color::ONE
            } else {
                Material::default().diffuse
            },
            ..Material::default()
        });
        scene.objects.push(Object {
            name: String::new(),
            shape,
            material: 0,
        });
    } else {
        warnings.add(Place::Whole, "no faces in the file");
    }
    Ok(Loaded {
        scene,
        warnings: warnings.finish(),
        files: Vec::new(),
        is_up_assumed: options.up.is_none(),
    })
}

/// Where in the file the numbers come from: for messages.
#[derive(Clone, Copy)]
struct Context<'a> {
    element: &'a Element<'a>,
    /// Which of the elements, from 0.
    index: u64,
    property: &'a str,
}

struct Reader<'f, B> {
    file: &'f Path,
    body: B,
}

impl<B: Body> Reader<'_, B> {
    /// Reads the whole body; `None` without a face.
    fn read(
        mut self,
        header: &Header<'_>,
        warnings: &mut WarningLog,
    ) -> Result<Option<Shape>, ReadError> {
        let vertex_count = header
            .elements
            .iter()
            .find(|element| element.name == "vertex")
            .map_or(0, |element| element.count);
        let mut vertices = Vertices::default();
        let mut faces = Faces::default();
        for element in &header.elements {
            match element.name {
                "vertex" => vertices = self.vertices(element, warnings)?,
                "face" => self.faces(element, vertex_count, &mut faces, warnings)?,
                "tristrips" => self.strips(element, vertex_count, &mut faces, warnings)?,
                _ => self.skip_all(element)?,
            }
        }
        if let Some(at) = self.body.surplus() {
            let message = "there is more after the last element: not read";
            warnings.add(B::place(at), message);
        }
        let mesh = faces.mesh(&vertices, B::place, warnings);
        let mesh = mesh.map_err(|(place, coordinate)| ReadError {
            file: self.file.to_path_buf(),
            place,
            kind: ReadErrorKind::Invalid {
                entity: "face",
                problem: Corners::too_large(coordinate).into(),
                help: "scale the scene down",
            },
        })?;
        Ok((!mesh.face_ends.is_empty()).then_some(Shape::Mesh(mesh)))
    }

    fn vertices(
        &mut self,
        element: &Element<'_>,
        warnings: &mut WarningLog,
    ) -> Result<Vertices, ReadError> {
        let slots = vertex_slots(element);
        let has_normals = slots.contains(&Some(NORMAL.start));
        let has_colors = slots.contains(&Some(COLOR.start));
        // What an integer that is full stands for.
        let mut full = [1.0; 10];
        for (property, slot) in element.properties.iter().zip(&slots) {
            if let (&Some(slot), PropertyKind::Scalar(kind)) = (slot, property.kind) {
                full[slot] = kind.largest().unwrap_or(1.0);
            }
        }
        let room = self.room(element);
        let mut vertices = Vertices {
            positions: Vec::with_capacity(room),
            normals: Vec::with_capacity(if has_normals { room } else { 0 }),
            colors: Vec::with_capacity(if has_colors { room } else { 0 }),
        };
        for index in checked(0..element.count) {
            let mut numbers = [0.0; 10];
            numbers[9] = full[9];
            for (property, slot) in element.properties.iter().zip(&slots) {
                let context = Context {
                    element,
                    index,
                    property: property.name,
                };
                match (slot, property.kind) {
                    (&Some(slot), PropertyKind::Scalar(kind)) => {
                        numbers[slot] = self
                            .body
                            .real(kind)
                            .map_err(|fault| self.expected(context, "a number", fault))?;
                    }
                    (_, kind) => self.skip(context, kind)?,
                }
            }
            self.end_element(element, index)?;
            let [x, y, z, nx, ny, nz, red, green, blue, alpha] = numbers;
            vertices.positions.push(DVec3::new(x, y, z));
            if has_normals {
                let normal = DVec3::new(nx, ny, nz);
                if normal.abs().max_element() <= LARGEST_COORDINATE && !normal.is_nan() {
                    vertices.normals.push(normal);
                } else {
                    let message = "a normal is not finite or exceeds 2^100: none is used";
                    warnings.add(B::place(self.body.at()), message);
                    vertices.normals.push(DVec3::ZERO);
                }
            }
            if has_colors {
                let share = |slot: usize, number: f64| linear_of_srgb(number / full[slot]) as f32;
                let [red, green, blue] = [share(6, red), share(7, green), share(8, blue)];
                vertices.colors.push([red, green, blue, 1.0]);
                if alpha < full[9] {
                    let message = "alpha of vertices is not used: all faces are opaque";
                    warnings.add(B::place(self.body.at()), message);
                }
            }
        }
        Ok(vertices)
    }

    /// Adds the faces of an element.
    fn faces(
        &mut self,
        element: &Element<'_>,
        vertex_count: u64,
        faces: &mut Faces,
        warnings: &mut WarningLog,
    ) -> Result<(), ReadError> {
        let room = self.room(element);
        faces.ends.reserve(room);
        faces.places.reserve(room);
        let mut corners = Vec::new();
        for index in checked(0..element.count) {
            corners.clear();
            let at = self.indices(element, index, vertex_count, 0, &mut corners)?;
            if corners.len() < 3 {
                let message = "a face has fewer than 3 corners: dropped";
                warnings.add(B::place(at), message);
                continue;
            }
            faces.add(corners.iter().map(|&corner| corner as u32), at);
        }
        Ok(())
    }

    /// Adds the triangles of strips: every three corners in a row make one, every other time turned
    /// round; -1 begins another strip.
    fn strips(
        &mut self,
        element: &Element<'_>,
        vertex_count: u64,
        faces: &mut Faces,
        warnings: &mut WarningLog,
    ) -> Result<(), ReadError> {
        let mut corners = Vec::new();
        for index in checked(0..element.count) {
            corners.clear();
            let at = self.indices(element, index, vertex_count, -1, &mut corners)?;
            for strip in corners.split(|&corner| corner == -1) {
                if matches!(strip.len(), 1 | 2) {
                    let message = "a strip has fewer than 3 corners: dropped";
                    warnings.add(B::place(at), message);
                }
                for (number, triangle) in strip.windows(3).enumerate() {
                    let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
                    // Corners that are doubled only lead on to where the strip continues.
                    if a == b || b == c || c == a {
                        continue;
                    }
                    let turned = if number % 2 == 0 {
                        [a, b, c]
                    } else {
                        [b, a, c]
                    };
                    // Three corners to an index, which may take a byte.
                    if faces.corners.len() > u32::MAX as usize - 3 {
                        let context = Context {
                            element,
                            index,
                            property: "vertex_indices",
                        };
                        let problem = "there are more than 2^32 corners".into();
                        return Err(self.invalid(context, problem));
                    }
                    faces.add(turned.into_iter().map(|corner| corner as u32), at);
                }
            }
        }
        Ok(())
    }

    /// Reads an element's list of vertices, each from `least` on, and steps over the rest of it.
    /// Returns where the element is.
    fn indices(
        &mut self,
        element: &Element<'_>,
        index: u64,
        vertex_count: u64,
        least: i64,
        corners: &mut Vec<i64>,
    ) -> Result<u32, ReadError> {
        let list = index_list(element);
        let mut at = None;
        for (number, property) in element.properties.iter().enumerate() {
            let context = Context {
                element,
                index,
                property: property.name,
            };
            match property.kind {
                PropertyKind::List { count, item } if Some(number) == list => {
                    let corner_count = self.count(context, count)?;
                    at.get_or_insert(self.body.at());
                    for _ in 0..corner_count {
                        let corner = self
                            .body
                            .integer(item)
                            .map_err(|fault| self.expected(context, "an index", fault))?;
                        if !(least..vertex_count as i64).contains(&corner) {
                            let problem = format!(
                                "index {corner} names no vertex: the file has {vertex_count}"
                            );
                            return Err(self.invalid(context, problem));
                        }
                        corners.push(corner);
                    }
                }
                kind => {
                    self.skip(context, kind)?;
                    at.get_or_insert(self.body.at());
                }
            }
        }
        self.end_element(element, index)?;
        Ok(at.unwrap_or(self.body.at()))
    }

    /// Steps over all elements of a kind.
    fn skip_all(&mut self, element: &Element<'_>) -> Result<(), ReadError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        for index in checked(0..element.count) {
            for property in &element.properties {
                let context = Context {
                    element,
                    index,
                    property: property.name,
                };
                self.skip(context, property.kind)?;
            }
            self.end_element(element, index)?;
        }
        Ok(())
    }

    /// Steps over one property.
    fn skip(&mut self, context: Context<'_>, kind: PropertyKind) -> Result<(), ReadError> {
        let (kind, count) = match kind {
            PropertyKind::Scalar(kind) => (kind, 1),
            PropertyKind::List { count, item } => (item, self.count(context, count)?),
        };
        self.body
            .skip(kind, count)
            .map_err(|fault| self.expected(context, "a number", fault))
    }

    /// Reads how many numbers a list has.
    fn count(&mut self, context: Context<'_>, kind: header::NumberType) -> Result<u64, ReadError> {
        let count = self
            .body
            .integer(kind)
            .map_err(|fault| self.expected(context, "the length of a list", fault))?;
        u64::try_from(count).map_err(|_| {
            let problem = format!("a list has the length {count}; expected 0 or more");
            self.invalid(context, problem)
        })
    }

    /// Returns for how many elements room may be made: no more than there are bytes for.
    fn room(&self, element: &Element<'_>) -> usize {
        let smallest = |kind| match kind {
            PropertyKind::Scalar(kind) | PropertyKind::List { count: kind, .. } => {
                self.body.fewest_bytes(kind)
            }
        };
        let smallest: usize = element.properties.iter().map(|p| smallest(p.kind)).sum();
        let most = self.body.bytes_left() / smallest.max(1) + 1;
        usize::try_from(element.count).map_or(most, |count| count.min(most))
    }

    fn end_element(&mut self, element: &Element<'_>, index: u64) -> Result<(), ReadError> {
        self.body.end_element().map_err(|fault| {
            let expected = format!(
                "the end of the line after {} {} of {}",
                quoted(element.name),
                index + 1,
                element.count
            );
            self.error(ReadErrorKind::Expected {
                entity: entity(element),
                expected: expected.into(),
                found: found(fault).into(),
                help: "check the properties in the header",
            })
        })
    }

    fn expected(&self, context: Context<'_>, what: &str, fault: Fault) -> ReadError {
        let expected = format!(
            "{what} for {} of {} {} of {}",
            quoted(context.property),
            quoted(context.element.name),
            context.index + 1,
            context.element.count
        );
        let help = match fault {
            Fault::End => "the file may be cut short",
            Fault::Other(_) => "correct the line, or export the file again",
        };
        self.error(ReadErrorKind::Expected {
            entity: entity(context.element),
            expected: expected.into(),
            found: found(fault).into(),
            help,
        })
    }

    fn invalid(&self, context: Context<'_>, problem: String) -> ReadError {
        let problem = format!("{}: {problem}", quoted(context.property));
        self.error(ReadErrorKind::Invalid {
            entity: entity(context.element),
            problem: problem.into(),
            help: "export the file again",
        })
    }

    /// An error where the body was read last.
    fn error(&self, kind: ReadErrorKind) -> ReadError {
        ReadError {
            file: self.file.to_path_buf(),
            place: B::place(self.body.at()),
            kind,
        }
    }
}

/// Returns the name of an element, if it is one of those that are read.
fn entity(element: &Element<'_>) -> &'static str {
    match element.name {
        "vertex" => "vertex",
        "face" => "face",
        "tristrips" => "tristrips",
        _ => "",
    }
}

fn found(fault: Fault) -> String {
    match fault {
        Fault::End => "the end of the file".into(),
        Fault::Other(found) => found,
    }
}
