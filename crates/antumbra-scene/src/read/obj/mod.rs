//! OBJ, Wavefront's text format for polygons.
//!
//! In: the text of a file and a way to open its material libraries. Out: a scene with one mesh
//! for every pair of name (`o` or `g`, whichever came last) and material, in the order in which
//! the pairs first have faces. Invariant: meshes hold the positions and normals their faces
//! use, each once, in the order of first use; every face has area.
//!
//! The format has no lights, no view and no background: the scene has none either, and
//! [`AMBIENT`](crate::defaults::AMBIENT) light. Texture coordinates, smoothing groups, vertex colours, points, lines and
//! curves are not used. Vertices may follow the faces that use them.

mod build;

use std::{
    collections::{HashMap, HashSet},
    io,
    path::Path,
};

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{Corner, Material},
    warning::{Warning, WarningLog},
};

use super::{
    Loaded, ReadOptions, UpAxis,
    mtl::read_mtl,
    statements::{Statement, Statements},
    text::{LARGEST_COORDINATE, decode, parse_number},
};

/// The most pairs of name and material that have faces. A pair takes about a kilobyte and as little
/// as 17 bytes of text; no real file comes near this number.
const MOST_PARTS: usize = 1 << 20;
/// Statements that are read past in silence: they change nothing that is used.
const SILENT: [&str; 2] = ["vt", "s"];
/// Statements of the format that are not supported.
const UNSUPPORTED: [(&str, &[&str]); 3] = [
    ("points and lines (`p`, `l`) are not read", &["p", "l"]),
    (
        "curves and free-form surfaces are not read",
        &[
            "vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole",
            "scrv", "sp", "end", "con", "ctech", "stech", "bsp", "bzp", "cdc", "cdp", "res",
        ],
    ),
    (
        "display attributes are not read",
        &[
            "mg",
            "bevel",
            "c_interp",
            "d_interp",
            "lod",
            "usemap",
            "maplib",
            "shadow_obj",
            "trace_obj",
        ],
    ),
];

/// Reads OBJ from bytes. `file` is only a name for messages; `open` returns the bytes of a
/// material library by the name the file gives it, or says why not (a warning, not an error).
///
/// Time is linear in the number of bytes; memory is at most some 20 times that, and a kilobyte for
/// each of at most 2^20 pairs of name and material.
///
/// # Errors
/// The bytes are no text, a number is none, an index names no vertex, a coordinate exceeds
/// 2^100, there are too many names, a material library is malformed; see [`ReadErrorKind`].
///
/// # Example
/// ```
/// use std::{io, path::Path};
/// let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3";
/// let no_libraries = &mut |_: &str| Err(io::ErrorKind::NotFound.into());
/// let loaded =
///     antumbra_scene::read::read_obj(Path::new("a.obj"), text, &Default::default(), no_libraries);
/// assert_eq!(loaded.unwrap().scene.objects.len(), 1);
/// ```
pub fn read_obj(
    file: &Path,
    bytes: &[u8],
    options: &ReadOptions,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Loaded, ReadError> {
    let text = decode(file, bytes)?;
    let mut reader = Reader {
        file,
        warnings: WarningLog::new(file),
        library_warnings: Vec::new(),
        libraries: HashSet::new(),
        materials: HashMap::new(),
        positions: Vec::new(),
        normals: Vec::new(),
        name: String::new(),
        material: None,
        current: None,
        parts: Vec::new(),
        part_of: HashMap::new(),
        corners: Vec::new(),
    };
    for statement in Statements::new(text) {
        reader.read(&statement, open)?;
    }
    let mut loaded = reader.finish()?;
    loaded.scene.up = options.up.unwrap_or(UpAxis::Y).vector();
    Ok(loaded)
}

/// Faces of one name and one material; indices are the file's, counted from 0.
#[derive(Default)]
struct Part {
    name: String,
    material: Option<String>,
    corners: Vec<Corner>,
    face_ends: Vec<u32>,
    face_lines: Vec<u32>,
}

struct Reader<'a> {
    file: &'a Path,
    warnings: WarningLog,
    library_warnings: Vec<Warning>,
    /// Names of the libraries opened so far, each once.
    libraries: HashSet<String>,
    materials: HashMap<String, Material>,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// What the next face belongs to.
    name: String,
    material: Option<String>,
    /// The part of that name and material, once a face needs it.
    current: Option<usize>,
    parts: Vec<Part>,
    part_of: HashMap<(String, Option<String>), usize>,
    /// The face being read; kept for its allocation.
    corners: Vec<Corner>,
}

impl Reader<'_> {
    fn read(
        &mut self,
        statement: &Statement<'_>,
        open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(), ReadError> {
        match statement.keyword() {
            "v" => self.read_position(statement)?,
            "vn" => {
                let mut words = statement.arguments();
                let normal = self.point(statement, &mut words, "vn", "3 numbers (a normal)")?;
                self.normals.push(normal);
            }
            "f" => self.read_face(statement)?,
            "o" | "g" => {
                statement.name().clone_into(&mut self.name);
                self.current = None;
            }
            "usemtl" => {
                self.material = Some(statement.name().to_owned());
                self.current = None;
            }
            "mtllib" => self.read_libraries(statement, open)?,
            keyword if SILENT.contains(&keyword) => {}
            keyword => {
                let place = Place::Line(statement.line);
                match UNSUPPORTED
                    .iter()
                    .find(|(_, words)| words.contains(&keyword))
                {
                    Some((message, _)) => self.warnings.add(place, message),
                    None => {
                        let message = format!("unknown keyword {}: skipped", quoted(keyword));
                        self.warnings.add(place, message);
                    }
                }
            }
        }
        Ok(())
    }

    /// `v x y z`, then a weight `w`, or a colour.
    fn read_position(&mut self, statement: &Statement<'_>) -> Result<(), ReadError> {
        const EXPECTED: &str = "3 numbers (x y z), 4 (and w), or 6 and more (and a colour)";
        let mut words = statement.arguments();
        let position = self.point(statement, &mut words, "v", EXPECTED)?;
        let mut surplus = 0;
        for word in words {
            self.number(statement, Some(word), "v", EXPECTED)?;
            surplus += 1;
        }
        match surplus {
            0 | 1 => {}
            2 => return Err(self.expected(statement, "v", EXPECTED, "5 numbers".into())),
            _ => self
                .warnings
                .add(Place::Line(statement.line), "vertex colours are not read"),
        }
        self.positions.push(position);
        Ok(())
    }

    fn read_face(&mut self, statement: &Statement<'_>) -> Result<(), ReadError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in statement.arguments() {
            corners.push(self.corner(statement, word)?);
        }
        if corners.len() < 3 {
            let message = "a face has fewer than 3 corners: dropped";
            self.warnings.add(Place::Line(statement.line), message);
        } else {
            let part = self.part(statement.line)?;
            part.corners.extend_from_slice(&corners);
            // A file of 4 GiB holds fewer than 2^31 corners.
            part.face_ends.push(part.corners.len() as u32);
            part.face_lines.push(statement.line);
        }
        self.corners = corners;
        Ok(())
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, statement: &Statement<'_>, word: &str) -> Result<Corner, ReadError> {
        let garbled = || {
            let expected = "corners like 1, 1/2, 1//3 or 1/2/3";
            self.expected(statement, "f", expected, quoted(word))
        };
        let mut fields = word.split('/');
        let position = fields.next().and_then(parse_index).ok_or_else(garbled)?;
        let texture = fields.next().unwrap_or_default();
        let normal = fields.next().unwrap_or_default();
        let is_texture_fine = texture.is_empty() || parse_index(texture).is_some();
        if fields.next().is_some() || !is_texture_fine {
            return Err(garbled());
        }
        let position = self.resolve(statement, position, self.positions.len(), "v")?;
        let normal = match normal {
            "" => Corner::NONE,
            index => {
                let index = parse_index(index).ok_or_else(garbled)?;
                self.resolve(statement, index, self.normals.len(), "vn")?
            }
        };
        Ok(Corner {
            normal,
            ..Corner::at(position)
        })
    }

    /// Returns the index from 0 of a vertex that a face names: from 1, or backwards from -1.
    /// Whether a vertex counted forwards exists is known only at the end of the file.
    fn resolve(
        &self,
        statement: &Statement<'_>,
        index: i64,
        count: usize,
        list: &str,
    ) -> Result<u32, ReadError> {
        let count = count as i64;
        let from_zero = if index < 0 {
            count.saturating_add(index)
        } else {
            index - 1
        };
        let problem = if index == 0 {
            format!("index 0 names no `{list}`; indices count from 1, or backwards from -1")
        } else if from_zero < 0 {
            format!("index {index} names no `{list}`: only {count} came before")
        } else if from_zero >= i64::from(Corner::NONE) {
            format!("index {index} names no `{list}`: no file has that many")
        } else {
            return Ok(from_zero as u32);
        };
        Err(self.invalid(statement.line, "f", problem, "export the file again"))
    }

    /// Returns the part that the next face belongs to.
    fn part(&mut self, line: u32) -> Result<&mut Part, ReadError> {
        let index = match self.current {
            Some(index) => index,
            None => {
                let key = (self.name.clone(), self.material.clone());
                let index = *self.part_of.entry(key).or_insert(self.parts.len());
                if index == MOST_PARTS {
                    let problem =
                        format!("there are more than {MOST_PARTS} pairs of name and material");
                    return Err(self.invalid(line, "f", problem, "split the file, or name less"));
                }
                if index == self.parts.len() {
                    self.parts.push(Part {
                        name: self.name.clone(),
                        material: self.material.clone(),
                        ..Part::default()
                    });
                }
                index
            }
        };
        self.current = Some(index);
        Ok(&mut self.parts[index])
    }

    /// `mtllib` names one file, perhaps with blanks in its name, or several.
    fn read_libraries(
        &mut self,
        statement: &Statement<'_>,
        open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(), ReadError> {
        let whole = statement.name();
        if !self.libraries.insert(plain_path(whole)) {
            return Ok(());
        }
        match open(whole) {
            Ok(bytes) => self.read_library(whole, &bytes),
            Err(error) if statement.arguments().nth(1).is_none() => {
                self.library_missing(statement, whole, &error);
                Ok(())
            }
            Err(_) => {
                for name in statement.arguments() {
                    if !self.libraries.insert(plain_path(name)) {
                        continue;
                    }
                    match open(name) {
                        Ok(bytes) => self.read_library(name, &bytes)?,
                        Err(error) => self.library_missing(statement, name, &error),
                    }
                }
                Ok(())
            }
        }
    }

    fn read_library(&mut self, name: &str, bytes: &[u8]) -> Result<(), ReadError> {
        let path = self.file.parent().unwrap_or(Path::new("")).join(name);
        let library = read_mtl(&path, bytes)?;
        self.materials.extend(library.materials);
        self.library_warnings.extend(library.warnings);
        Ok(())
    }

    fn library_missing(&mut self, statement: &Statement<'_>, name: &str, error: &io::Error) {
        let message = format!(
            "cannot open the material library {}: {error}; grey is used",
            quoted(name)
        );
        self.warnings.add(Place::Line(statement.line), message);
    }

    fn point<'w>(
        &self,
        statement: &Statement<'_>,
        words: &mut impl Iterator<Item = &'w str>,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<DVec3, ReadError> {
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            *number = self.number(statement, words.next(), entity, expected)?;
            if number.abs() > LARGEST_COORDINATE {
                let problem = format!("{number:e} exceeds 2^100 (1.27e30), the largest coordinate");
                return Err(self.invalid(statement.line, entity, problem, "scale the scene down"));
            }
        }
        Ok(DVec3::from_array(numbers))
    }

    fn number(
        &self,
        statement: &Statement<'_>,
        word: Option<&str>,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<f64, ReadError> {
        word.and_then(parse_number).ok_or_else(|| {
            let found = word.map_or_else(|| "the end of the line".into(), quoted);
            self.expected(statement, entity, expected, found)
        })
    }

    fn expected(
        &self,
        statement: &Statement<'_>,
        entity: &'static str,
        expected: &'static str,
        found: String,
    ) -> ReadError {
        let kind = ReadErrorKind::Expected {
            entity,
            expected: expected.into(),
            found: found.into(),
            help: "correct the line, or export the file again",
        };
        ReadError {
            file: self.file.to_path_buf(),
            place: Place::Line(statement.line),
            kind,
        }
    }

    fn invalid(
        &self,
        line: u32,
        entity: &'static str,
        problem: String,
        help: &'static str,
    ) -> ReadError {
        let kind = ReadErrorKind::Invalid {
            entity,
            problem: problem.into(),
            help,
        };
        ReadError {
            file: self.file.to_path_buf(),
            place: Place::Line(line),
            kind,
        }
    }
}

/// Spells a path one way, so that no library is read twice: `./a.mtl` is `a.mtl`.
fn plain_path(name: &str) -> String {
    let parts = name
        .split(['/', '\\'])
        .filter(|part| !matches!(*part, "" | "."));
    parts.collect::<Vec<_>>().join("/")
}

/// Reads a whole word as an integer. Rust reads no blanks, no fractions and no overflow.
fn parse_index(word: &str) -> Option<i64> {
    word.parse().ok()
}
