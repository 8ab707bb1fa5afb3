//! STL as text: solids of facets, a statement a line.
//!
//! In: the bytes of a file. Out: an object for each solid with a face. Invariants: keywords may
//! be in any case; a facet is one loop of three vertices; lines that begin with `#` are comments;
//! text that is not UTF-8 can occur only in names and comments, where it is replaced.

use std::path::Path;

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::Object,
    warning::WarningLog,
};

use super::{super::text::parse_any_number, Solid};

/// What comes next.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// `solid`, or the end of the file.
    Outside,
    /// `facet` or `endsolid`.
    InSolid,
    /// `outer loop`.
    InFacet,
    /// `vertex`, or `endloop` after the third.
    InLoop(usize),
    /// `endfacet`.
    AfterLoop,
}

impl State {
    fn expected(self) -> &'static str {
        match self {
            Self::Outside => "`solid`",
            Self::InSolid => "`facet` or `endsolid`",
            Self::InFacet => "`outer loop`",
            Self::InLoop(3) => "`endloop` after 3 vertices",
            Self::InLoop(_) => "`vertex` (3 to a facet)",
            Self::AfterLoop => "`endfacet`",
        }
    }
}

/// Reads the solids.
///
/// # Errors
/// A statement is out of place, a number is none, or a coordinate too large.
pub(super) fn read(
    file: &Path,
    bytes: &[u8],
    warnings: &mut WarningLog,
) -> Result<Vec<Object>, ReadError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = Reader {
        file,
        line: 0,
        state: State::Outside,
        solid: Solid::default(),
        corners: [DVec3::ZERO; 3],
        facet_line: 0,
        objects: Vec::new(),
    };
    let mut rest = bytes;
    while !rest.is_empty() {
        antumbra_task::check();
        let end = rest.iter().position(|&b| b == b'\n' || b == b'\r');
        let line = &rest[..end.unwrap_or(rest.len())];
        let is_pair = end.is_some_and(|end| rest[end..].starts_with(b"\r\n"));
        rest = end.map_or(&[], |end| &rest[end + 1 + usize::from(is_pair)..]);
        reader.line = reader.line.saturating_add(1);
        reader.statement(line.trim_ascii(), warnings)?;
    }
    match reader.state {
        State::Outside => {}
        State::InSolid => {
            let place = Place::Line(reader.line);
            warnings.add(place, "the last solid has no `endsolid`");
            reader.end_solid(warnings)?;
        }
        _ => return Err(reader.unexpected("the end of the file".into())),
    }
    Ok(reader.objects)
}

struct Reader<'f> {
    file: &'f Path,
    line: u32,
    state: State,
    solid: Solid,
    corners: [DVec3; 3],
    facet_line: u32,
    objects: Vec<Object>,
}

impl Reader<'_> {
    /// Reads one line.
    fn statement(&mut self, line: &[u8], warnings: &mut WarningLog) -> Result<(), ReadError> {
        let (keyword, mut arguments) = split_word(line);
        if keyword.is_empty() || keyword.starts_with(b"#") {
            return Ok(());
        }
        let mut lower = keyword[..keyword.len().min(16)].to_ascii_lowercase();
        // Some write `end solid` for `endsolid`.
        if lower == b"end" {
            let (word, rest) = split_word(arguments);
            lower.extend(word[..word.len().min(16)].to_ascii_lowercase());
            arguments = rest;
        }
        self.state = match (self.state, lower.as_slice()) {
            (State::Outside, b"solid") => {
                self.solid.name = String::from_utf8_lossy(arguments).into_owned();
                State::InSolid
            }
            // The normal is not used: the winding decides.
            (State::InSolid, b"facet") => {
                self.facet_line = self.line;
                State::InFacet
            }
            (State::InSolid, b"endsolid") => {
                self.end_solid(warnings)?;
                State::Outside
            }
            (State::InFacet, b"outer") if arguments.eq_ignore_ascii_case(b"loop") => {
                State::InLoop(0)
            }
            (State::InLoop(count @ 0..3), b"vertex") => {
                self.corners[count] = self.point(arguments)?;
                State::InLoop(count + 1)
            }
            (State::InLoop(3), b"endloop") => State::AfterLoop,
            (State::AfterLoop, b"endfacet") => {
                self.solid.add(self.corners, self.facet_line);
                State::InSolid
            }
            _ => {
                let shown = String::from_utf8_lossy(&line[..line.len().min(200)]);
                return Err(self.unexpected(quoted(&shown)));
            }
        };
        Ok(())
    }

    fn end_solid(&mut self, warnings: &mut WarningLog) -> Result<(), ReadError> {
        let solid = std::mem::take(&mut self.solid);
        let object = solid.finish(self.file, Place::Line, warnings)?;
        self.objects.extend(object);
        Ok(())
    }

    /// Reads three coordinates, finite or not, and nothing more.
    fn point(&self, arguments: &[u8]) -> Result<DVec3, ReadError> {
        let mut rest = arguments;
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            let word;
            (word, rest) = split_word(rest);
            *number = std::str::from_utf8(word)
                .ok()
                .and_then(parse_any_number)
                .ok_or_else(|| self.no_number(word))?;
        }
        if !rest.is_empty() {
            return Err(self.no_number(rest));
        }
        Ok(DVec3::from_array(numbers))
    }

    fn no_number(&self, word: &[u8]) -> ReadError {
        let found = match word {
            b"" => "the end of the line".into(),
            word => quoted(&String::from_utf8_lossy(&word[..word.len().min(200)])),
        };
        self.error(ReadErrorKind::Expected {
            entity: "vertex",
            expected: "3 numbers (x y z)".into(),
            found: found.into(),
            help: "correct the line, or export the file again",
        })
    }

    fn unexpected(&self, found: String) -> ReadError {
        let help = match found.starts_with('`') {
            true => "correct the line, or export the file again",
            false => "the file may be cut short",
        };
        self.error(ReadErrorKind::Expected {
            entity: "",
            expected: self.state.expected().into(),
            found: found.into(),
            help,
        })
    }

    fn error(&self, kind: ReadErrorKind) -> ReadError {
        ReadError {
            file: self.file.to_path_buf(),
            place: Place::Line(self.line),
            kind,
        }
    }
}

/// Splits the first word off; neither part begins or ends with white space.
fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii();
    let end = text
        .iter()
        .position(u8::is_ascii_whitespace)
        .unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (word, rest.trim_ascii_start())
}
