//! OBJ, Wavefront's text format for polygons.
//!
//! In: the text of a file and a way to open its material libraries. Out: a scene with one mesh
//! for every pair of name (`o` or `g`, whichever came last) and material, in the order in which
//! the pairs first have faces. Invariant: meshes hold the positions, normals and texture coordinates
//! their faces use, each once, in the order of first use; every face has area. What no face uses may
//! be anything; normals, texture coordinates and colors that are wrong are left out with a warning.
//!
//! The format has no lights, no view and no background: the scene has none either, and
//! [`AMBIENT`](crate::defaults::AMBIENT) light. Smoothing groups, points, lines and curves are not used.
//! Vertices may follow the faces that use them. Colors of vertices are taken for sRGB, 0 to 1, or to
//! 255 if one is above 1.

mod build;
mod pictures;

use std::{
    collections::{HashMap, HashSet},
    io,
    path::Path,
};

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::Corner,
    room::Room,
    warning::{Warning, WarningLog},
};

use super::{
    Loaded, ReadOptions, UpAxis,
    mtl::{Entry, read_mtl},
    statements::{Statement, Statements},
    text::{Corners, LARGEST_COORDINATE, decode, parse_any_number},
    whole,
};

/// The most pairs of name and material that have faces. A pair takes about a kilobyte and as little
/// as 17 bytes of text; no real file comes near this number.
const MOST_PARTS: usize = 1 << 20;
/// What is said about normals that are not finite.
const BAD_NORMAL: &str = "a normal is no 3 finite numbers of at most 2^100: none is used";
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
/// material library or a picture by the name the files give it, or says why not (a warning, not an
/// error).
///
/// Time is linear in the number of bytes and texels; memory is at most some 20 times the bytes, a
/// kilobyte for each of at most 2^20 pairs of name and material, and for pictures what
/// [`ReadOptions::memory_limit`] leaves.
///
/// # Errors
/// The bytes are no text, a number is none, an index names no vertex, a coordinate of a face exceeds
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
    let mut warnings = WarningLog::new(file);
    let mut room = Room::new(options.memory_limit);
    room.take(bytes.len() as u64, || "the file".into())
        .map_err(|over| whole(file, over.into()))?;
    let text = decode(file, bytes, &mut warnings)?;
    let mut reader = Reader {
        file,
        warnings,
        library_warnings: Vec::new(),
        libraries: HashSet::new(),
        materials: HashMap::new(),
        positions: Vec::new(),
        normals: Vec::new(),
        uvs: Vec::new(),
        colors: Vec::new(),
        largest_color: 0.0,
        name: String::new(),
        material: None,
        current: None,
        parts: Vec::new(),
        part_of: HashMap::new(),
        corners: Vec::new(),
    };
    for statement in Statements::new(&text) {
        reader.read(&statement, open)?;
    }
    let mut loaded = reader.finish(open, room)?;
    loaded.scene.up = options.up.unwrap_or(UpAxis::Y).vector();
    loaded.is_up_assumed = options.up.is_none();
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
    materials: HashMap<String, Entry>,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    uvs: Vec<[f64; 2]>,
    /// As written, for positions up to the last that has one; white for others.
    colors: Vec<[f32; 3]>,
    largest_color: f32,
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
                let normal = self.point(statement, &mut words, "vn", "3 numbers (a normal)");
                match normal {
                    Ok(normal) if Corners::of([normal].into_iter()) == Corners::Fine => {
                        self.normals.push(normal);
                    }
                    // No shadow depends on it; the numbers of those behind do.
                    _ => {
                        self.warnings.add(Place::Line(statement.line), BAD_NORMAL);
                        self.normals.push(DVec3::ZERO);
                    }
                }
            }
            "vt" => self.read_uv(statement),
            // Smoothing groups change nothing that is used.
            "s" => {}
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

    /// `v x y z`, then a weight `w`, or a color.
    fn read_position(&mut self, statement: &Statement<'_>) -> Result<(), ReadError> {
        const EXPECTED: &str = "3 numbers (x y z), 4 (and w), or 6 and more (and a color)";
        let mut words = statement.arguments();
        let position = self.point(statement, &mut words, "v", EXPECTED)?;
        let mut color = [0.0; 3];
        let mut surplus = 0;
        for word in words {
            let number = self.number(statement, Some(word), "v", EXPECTED)?;
            if let Some(channel) = color.get_mut(surplus) {
                *channel = number as f32;
            }
            surplus += 1;
        }
        self.positions.push(position);
        match surplus {
            0 | 1 => {}
            2 => return Err(self.expected(statement, "v", EXPECTED, "5 numbers".into())),
            _ if color.iter().all(|channel| channel.is_finite()) => {
                self.colors.resize(self.positions.len() - 1, [f32::NAN; 3]);
                self.colors.push(color);
                self.largest_color = color.into_iter().fold(self.largest_color, f32::max);
            }
            _ => {
                let message = "a color is not finite: white is used";
                self.warnings.add(Place::Line(statement.line), message);
            }
        }
        Ok(())
    }

    /// `vt u v`; `v` is 0 where it is left out. Only looks and holes depend on it.
    fn read_uv(&mut self, statement: &Statement<'_>) {
        let mut words = statement.arguments();
        let mut number = || words.next().map_or(Some(0.0), parse_any_number);
        let uv = [number(), number()];
        let is_fine = |number: &Option<f64>| number.is_some_and(|n| n.abs() <= LARGEST_COORDINATE);
        if !uv.iter().all(is_fine) {
            let message = "a texture coordinate is no number or too large: 0 is used";
            self.warnings.add(Place::Line(statement.line), message);
        }
        self.uvs
            .push(uv.map(|n| if is_fine(&n) { n.unwrap_or(0.0) } else { 0.0 }));
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
        let mut other = || match fields.next() {
            None | Some("") => Ok(None),
            Some(field) => parse_index(field).map(Some).ok_or_else(garbled),
        };
        let [uv, normal] = [other()?, other()?];
        if fields.next().is_some() {
            return Err(garbled());
        }
        let resolved = |index: Option<i64>, count: usize| match index {
            None => Corner::NONE,
            Some(index) => from_zero(index, count).unwrap_or(MISSING),
        };
        Ok(Corner {
            position: self.resolve(statement, position)?,
            normal: resolved(normal, self.normals.len()),
            uv: resolved(uv, self.uvs.len()),
        })
    }

    /// Returns the index from 0 of a vertex that a face names: from 1, or backwards from -1.
    /// Whether a vertex counted forwards exists is known only at the end of the file.
    fn resolve(&self, statement: &Statement<'_>, index: i64) -> Result<u32, ReadError> {
        let count = self.positions.len();
        if let Some(position) = from_zero(index, count) {
            return Ok(position);
        }
        let problem = if index == 0 {
            "index 0 names no `v`; indices count from 1, or backwards from -1".into()
        } else if index < 0 {
            format!("index {index} names no `v`: only {count} came before")
        } else {
            format!("index {index} names no `v`: no file has that many")
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
        if whole.is_empty() {
            let message = "`mtllib` names no material library: grey is used".to_owned();
            self.warnings.add(Place::Line(statement.line), message);
            return Ok(());
        }
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
        let library = read_mtl(self.file, name, bytes)?;
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

    /// Reads three numbers of any size, or not finite.
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
        word.and_then(parse_any_number).ok_or_else(|| {
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

/// An index that names nothing, of what a face can do without.
const MISSING: u32 = Corner::NONE - 1;

/// Returns the index from 0 for one from 1, or for one backwards from -1 where so many came before.
fn from_zero(index: i64, count: usize) -> Option<u32> {
    let index = match index {
        0 => return None,
        1.. => index - 1,
        _ => (count as i64).checked_add(index)?,
    };
    u32::try_from(index).ok().filter(|&index| index < MISSING)
}

/// Reads a whole word as an integer. Rust reads no blanks, no fractions and no overflow.
fn parse_index(word: &str) -> Option<i64> {
    word.parse().ok()
}
