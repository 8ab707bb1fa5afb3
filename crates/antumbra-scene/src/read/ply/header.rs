//! The header of a PLY file.
//!
//! In: the bytes of a file. Out: [`Header`]: how the body is encoded, where it begins, and which
//! elements with which properties it holds. Invariants: no count is believed yet; names of elements
//! are unique, and so are those of the properties that say where surfaces are; what has to be there (`vertex` with x, y and z) is there.

use std::{collections::HashSet, path::Path};

use crate::error::{Place, ReadError, ReadErrorKind, quoted};

use super::lines::{Lines, Words};

/// More elements, or properties of one element, than this are refused: no real file has them,
/// and each element of a body costs time for each of its properties.
const MOST_NAMES: usize = 1024;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberType {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Returns how many bytes a number takes in a binary body.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the largest number of an integer type.
    pub(super) fn largest(self) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::MAX.into(),
            Self::U8 => u8::MAX.into(),
            Self::I16 => i16::MAX.into(),
            Self::U16 => u16::MAX.into(),
            Self::I32 => i32::MAX.into(),
            Self::U32 => u32::MAX.into(),
            Self::F32 | Self::F64 => return None,
        })
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// What a property holds for each element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PropertyKind {
    /// One number.
    Scalar(NumberType),
    /// A count, then that many numbers.
    List { count: NumberType, item: NumberType },
}

/// One property of an element.
#[derive(Debug)]
pub(super) struct Property<'a> {
    pub(super) name: &'a str,
    pub(super) kind: PropertyKind,
}

/// One kind of element: so many of them, each with these properties in this order.
#[derive(Debug)]
pub(super) struct Element<'a> {
    pub(super) name: &'a str,
    /// As the file says; not to be trusted.
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
    /// The line of the header that declares it.
    pub(super) line: u32,
}

impl Element<'_> {
    /// Returns where among the properties a name is.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }
}

/// A whole header.
#[derive(Debug)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
    /// Properties that are declared again, and the line where; the first is the one that counts.
    pub(super) doubled: Vec<(u32, &'a str)>,
    /// The byte at which the body begins.
    pub(super) body_start: usize,
    /// The line at which the body begins, if it is text.
    pub(super) body_line: u32,
}

/// Reads the header of a file.
///
/// # Errors
/// The first line is not `ply`, a line says nothing known, a name comes twice, `vertex` or one
/// of its coordinates is missing; each with its line.
pub(super) fn read_header<'a>(file: &Path, bytes: &'a [u8]) -> Result<Header<'a>, ReadError> {
    let mut lines = Lines::new(bytes);
    let magic = lines.next().unwrap_or_default();
    if magic.trim_ascii_end() != b"ply" {
        let found = match magic {
            b"" => "an empty line".into(),
            other => quoted(&String::from_utf8_lossy(&other[..other.len().min(200)])),
        };
        return Err(expected(
            file,
            1,
            "",
            "`ply` on the first line",
            &found,
            "check that this is a PLY file",
        ));
    }
    let mut reader = Reader {
        file,
        encoding: None,
        elements: Vec::new(),
        names: HashSet::new(),
        doubled: Vec::new(),
    };
    while let Some(line) = lines.next() {
        let number = lines.number();
        let mut words = Words::of(line);
        match words.next().unwrap_or_default() {
            b"" | b"comment" | b"obj_info" => {}
            b"format" => reader.format(number, words)?,
            b"element" => reader.element(number, words)?,
            b"property" => reader.property(number, words)?,
            b"end_header" => {
                let encoding = reader.finish(number)?;
                return Ok(Header {
                    encoding,
                    elements: reader.elements,
                    doubled: reader.doubled,
                    body_start: bytes.len() - lines.bytes_left(),
                    body_line: number.saturating_add(1),
                });
            }
            other => {
                let kind = ReadErrorKind::UnknownKeyword {
                    found: quoted(&String::from_utf8_lossy(&other[..other.len().min(200)])),
                    known: "format, comment, obj_info, element, property, end_header",
                };
                return Err(error(file, number, kind));
            }
        }
    }
    let found = "the end of the file";
    Err(expected(
        file,
        lines.number(),
        "",
        "`end_header`",
        found,
        "the file may be cut short",
    ))
}

struct Reader<'a, 'f> {
    file: &'f Path,
    encoding: Option<Encoding>,
    elements: Vec<Element<'a>>,
    /// The property names of the last element.
    names: HashSet<&'a str>,
    /// Properties that are declared again, and where.
    doubled: Vec<(u32, &'a str)>,
}

impl<'a> Reader<'a, '_> {
    /// `format ENCODING VERSION`.
    fn format(&mut self, line: u32, mut words: Words<'a>) -> Result<(), ReadError> {
        const EXPECTED: &str = "`ascii`, `binary_little_endian` or `binary_big_endian`";
        let word = self.word(line, &mut words, "format", EXPECTED)?;
        let encoding = match word {
            "ascii" => Encoding::Ascii,
            "binary_little_endian" => Encoding::LittleEndian,
            "binary_big_endian" => Encoding::BigEndian,
            other => return Err(self.expected(line, "format", EXPECTED, &quoted(other))),
        };
        // The version has always been 1.0; some writers leave it out.
        let version = words.next();
        if version.is_some_and(|version| version != b"1.0") {
            let found = quoted(&String::from_utf8_lossy(version.unwrap_or_default()));
            return Err(self.expected(line, "format", "version 1.0", &found));
        }
        if self.encoding.replace(encoding).is_some() {
            return Err(self.invalid(line, "format", "the format is given twice".into()));
        }
        Ok(())
    }

    /// `element NAME COUNT`.
    fn element(&mut self, line: u32, mut words: Words<'a>) -> Result<(), ReadError> {
        const EXPECTED: &str = "a name and how many there are";
        let name = self.word(line, &mut words, "element", EXPECTED)?;
        let count = self.word(line, &mut words, "element", EXPECTED)?;
        if count.is_empty() || !count.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(self.expected(line, "element", EXPECTED, &quoted(count)));
        }
        // Indices have 32 bits, so no file can use more than that.
        let count = match count.parse::<u64>() {
            Ok(count) if count <= u64::from(u32::MAX) => count,
            _ => {
                let problem = format!("{} elements are more than 2^32 - 1", quoted(count));
                return Err(self.invalid(line, "element", problem));
            }
        };
        if self.elements.iter().any(|element| element.name == name) {
            let problem = format!("{} is declared twice", quoted(name));
            return Err(self.invalid(line, "element", problem));
        }
        self.check_room(line, "element", self.elements.len())?;
        self.names.clear();
        self.elements.push(Element {
            name,
            count,
            properties: Vec::new(),
            line,
        });
        Ok(())
    }

    /// `property TYPE NAME` or `property list TYPE TYPE NAME`.
    fn property(&mut self, line: u32, mut words: Words<'a>) -> Result<(), ReadError> {
        const EXPECTED: &str = "a type and a name, or `list`, two types and a name";
        let first = self.word(line, &mut words, "property", EXPECTED)?;
        let kind = if first == "list" {
            let count = self.word(line, &mut words, "property", EXPECTED)?;
            let count = self.number_type(line, count)?;
            if !count.is_integer() {
                let problem = "the count of a list has to be an integer".into();
                return Err(self.invalid(line, "property", problem));
            }
            let item = self.word(line, &mut words, "property", EXPECTED)?;
            PropertyKind::List {
                count,
                item: self.number_type(line, item)?,
            }
        } else {
            PropertyKind::Scalar(self.number_type(line, first)?)
        };
        let name = words
            .next()
            .ok_or_else(|| self.expected(line, "property", EXPECTED, "the end of the line"))?;
        // No property that is read has such a name.
        let name = std::str::from_utf8(name).unwrap_or("(not UTF-8)");
        let Some(element) = self.elements.last_mut() else {
            let problem = "it belongs to no element".into();
            return Err(self.invalid(line, "property", problem));
        };
        let count = element.properties.len();
        element.properties.push(Property { name, kind });
        if !self.names.insert(name) {
            // Which of two would be meant decides where the surfaces are.
            if matches!(name, "x" | "y" | "z") || is_index_list(name) {
                let problem = format!("{} is declared twice", quoted(name));
                return Err(self.invalid(line, "property", problem));
            }
            self.doubled.push((line, name));
        }
        self.check_room(line, "property", count)
    }

    /// Checks what only the end of the header shows.
    fn finish(&self, line: u32) -> Result<Encoding, ReadError> {
        let encoding = self.encoding.ok_or_else(|| {
            self.expected(line, "", "a `format` line before `end_header`", "none")
        })?;
        let Some(vertex) = self.elements.iter().find(|e| e.name == "vertex") else {
            return Err(self.expected(line, "", "an element `vertex`", "none"));
        };
        for name in ["x", "y", "z"] {
            let property = vertex.properties.iter().find(|p| p.name == name);
            if !property.is_some_and(|p| matches!(p.kind, PropertyKind::Scalar(_))) {
                let expected = "a number each for the properties x, y and z";
                let found = format!("none for `{name}`");
                return Err(self.expected(vertex.line, "element vertex", expected, &found));
            }
        }
        for element in self.elements.iter().filter(|e| e.count > 0) {
            let entity = match element.name {
                "face" => "element face",
                "tristrips" => "element tristrips",
                _ => continue,
            };
            let list = element.properties.iter().find(|p| is_index_list(p.name));
            let is_fine =
                |kind| matches!(kind, PropertyKind::List { item, .. } if item.is_integer());
            if !list.is_some_and(|p| is_fine(p.kind)) {
                let expected = "a list of integers `vertex_indices` (or `vertex_index`)";
                return Err(self.expected(element.line, entity, expected, "none"));
            }
        }
        Ok(encoding)
    }

    fn number_type(&self, line: u32, word: &str) -> Result<NumberType, ReadError> {
        const EXPECTED: &str = "a type (char, uchar, short, ushort, int, uint, float, double, \
             int8, uint8, int16, uint16, int32, uint32, float32, float64)";
        NumberType::of(word).ok_or_else(|| self.expected(line, "property", EXPECTED, &quoted(word)))
    }

    /// Takes a word; names and keywords are UTF-8.
    fn word(
        &self,
        line: u32,
        words: &mut Words<'a>,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<&'a str, ReadError> {
        let word = words
            .next()
            .ok_or_else(|| self.expected(line, entity, expected, "the end of the line"))?;
        std::str::from_utf8(word).map_err(|_| {
            let found = "a byte that is not UTF-8";
            error(self.file, line, ReadErrorKind::NotText { found })
        })
    }

    fn check_room(&self, line: u32, entity: &'static str, count: usize) -> Result<(), ReadError> {
        if count < MOST_NAMES {
            return Ok(());
        }
        let problem = format!("there are more than {MOST_NAMES}");
        Err(self.invalid(line, entity, problem))
    }

    fn expected(
        &self,
        line: u32,
        entity: &'static str,
        what: &'static str,
        found: &str,
    ) -> ReadError {
        expected(self.file, line, entity, what, found, HELP)
    }

    fn invalid(&self, line: u32, entity: &'static str, problem: String) -> ReadError {
        let kind = ReadErrorKind::Invalid {
            entity,
            problem: problem.into(),
            help: HELP,
        };
        error(self.file, line, kind)
    }
}

const HELP: &str = "correct the header, or export the file again";

/// Returns whether a property of `face` or `tristrips` names the corners.
pub(super) fn is_index_list(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

fn expected(
    file: &Path,
    line: u32,
    entity: &'static str,
    expected: &'static str,
    found: &str,
    help: &'static str,
) -> ReadError {
    let kind = ReadErrorKind::Expected {
        entity,
        expected: expected.into(),
        found: found.into(),
        help,
    };
    error(file, line, kind)
}

fn error(file: &Path, line: u32, kind: ReadErrorKind) -> ReadError {
    ReadError {
        file: file.to_path_buf(),
        place: Place::Line(line),
        kind,
    }
}
