//! What a reader says when it refuses a file.
//!
//! In: the place and the reason, from a reader. Out: one line of text that names the file, the
//! place, what was expected, what was found and what to do next. Invariant: text from the file
//! is quoted, shortened and free of control characters.

use std::{borrow::Cow, fmt, io, path::PathBuf};

/// Place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text file, counted from 1.
    Line(u32),
    /// A byte of a binary file, counted from 0.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

impl fmt::Display for Place {
    /// Writes what follows the file name: `:12`, `: byte 7` or nothing.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": byte {byte}"),
            Self::Whole => Ok(()),
        }
    }
}

/// Why a file was refused. Displays as `file:line: reason; help: what to do`.
#[derive(Debug, thiserror::Error)]
#[error("{}{place}: {kind}{}", .file.display(), HelpSuffix(.kind.help()))]
pub struct ReadError {
    /// The file that is wrong; a scene's material library has its own name.
    pub file: PathBuf,
    /// Place in the file.
    pub place: Place,
    /// Fault that was found.
    #[source]
    pub kind: ReadErrorKind,
}

impl ReadError {
    /// Returns what to do about it; empty when there is nothing to add.
    pub fn help(&self) -> &'static str {
        self.kind.help()
    }
}

/// Fault of a file.
#[derive(Debug, thiserror::Error)]
pub enum ReadErrorKind {
    /// The operating system refused.
    #[error("cannot read the file: {0}")]
    Io(#[source] io::Error),
    /// The path names no regular file.
    #[error("this is not a regular file")]
    NotAFile,
    /// The name does not end like a format that is read.
    #[error(
        "no reader for {found}; expected a name that ends in .nff, .obj, .gltf, .glb, .ply or .stl"
    )]
    UnknownFormat {
        /// The ending, described.
        found: String,
    },
    /// The file is larger than any reader takes.
    #[error("the file has {bytes} bytes, more than the {limit} that are read")]
    TooLarge {
        /// The file's size.
        bytes: u64,
        /// The largest size that is read.
        limit: u64,
    },
    /// Reading would take more memory than it may.
    #[error(
        "{what} needs {} in memory, with what is read already more than the limit of {}",
        Bytes(*bytes),
        Bytes(*limit)
    )]
    OverLimit {
        /// What needs it.
        what: Box<str>,
        /// How much it needs, in bytes.
        bytes: u64,
        /// The most that reading may take, in bytes.
        limit: u64,
    },
    /// A checkout without git-lfs left a pointer in place of the file.
    #[error("expected a scene, found a git-lfs pointer")]
    LfsPointer,
    /// The content is not text.
    #[error("expected UTF-8 text, found {found}")]
    NotText {
        /// What was found instead.
        found: &'static str,
    },
    /// The file is in another format with the same ending.
    #[error("`{keyword}` belongs to {dialect}, which is not read")]
    Dialect {
        /// The word that gives it away.
        keyword: &'static str,
        /// The other format.
        dialect: &'static str,
    },
    /// A word that begins no entity of the format.
    #[error("unknown keyword {found}; expected one of {known}")]
    UnknownKeyword {
        /// The word, quoted.
        found: String,
        /// The keywords of the format.
        known: &'static str,
    },
    /// Something else was due.
    #[error("{}expected {expected}, found {found}", Within(.entity))]
    Expected {
        /// The entity that was being read; empty between entities.
        entity: &'static str,
        /// What was due.
        expected: Cow<'static, str>,
        /// What was there, quoted.
        found: Box<str>,
        /// What to do; may be empty.
        help: &'static str,
    },
    /// A part of a structured file (glTF) is wrong.
    #[error("{path}: {problem}")]
    Element {
        /// Where in the structure, such as `nodes[3].mesh`.
        path: Box<str>,
        /// What is wrong and what was expected.
        problem: Box<str>,
        /// What to do; may be empty.
        help: &'static str,
    },
    /// Well-formed, but without a meaning.
    #[error("{}{problem}", Within(.entity))]
    Invalid {
        /// The entity it is about; empty for none.
        entity: &'static str,
        /// What is wrong and what was expected.
        problem: Box<str>,
        /// What to do; may be empty.
        help: &'static str,
    },
}

impl ReadErrorKind {
    /// Returns what to do about it; empty when there is nothing to add.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Io(_) => "check that the file exists and may be read",
            Self::NotAFile => "name the scene file itself",
            Self::UnknownFormat { .. } => "convert the scene to NFF, OBJ, glTF, PLY or STL",
            Self::TooLarge { .. } => "split the scene into smaller files",
            Self::OverLimit { .. } => "raise the memory limit, or make the file smaller",
            Self::LfsPointer => "run `git lfs pull` in the checkout the file comes from",
            Self::NotText { .. } => "check that this is the scene file, saved as plain UTF-8 text",
            Self::Dialect { .. } => "export it again as SPD's NFF (Neutral File Format) or as OBJ",
            Self::UnknownKeyword { .. } => "remove the line, or turn it into a comment with `#`",
            Self::Expected { help, .. }
            | Self::Element { help, .. }
            | Self::Invalid { help, .. } => help,
        }
    }
}

/// Displays a number of bytes in MiB, where that loses little.
struct Bytes(u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MEBIBYTE: u64 = 1 << 20;
        if self.0 < 10 * MEBIBYTE {
            write!(f, "{} bytes", self.0)
        } else {
            write!(f, "{} MiB", self.0.div_ceil(MEBIBYTE))
        }
    }
}

/// Displays `in `s`: ` for an entity, nothing for none.
struct Within<'a>(&'a str);

impl fmt::Display for Within<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            Ok(())
        } else {
            write!(f, "in `{}`: ", self.0)
        }
    }
}

/// Displays `; help: ...` for a help text, nothing for none.
struct HelpSuffix(&'static str);

impl fmt::Display for HelpSuffix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            Ok(())
        } else {
            write!(f, "; help: {}", self.0)
        }
    }
}

/// Quotes text from a file: between backticks, control characters escaped, at most 40 characters.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut shown: String = text
        .chars()
        .take(LONGEST)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push_str("...");
    }
    format!("`{shown}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_with_everything() {
        let error = ReadError {
            file: "scene.nff".into(),
            place: Place::Line(12),
            kind: ReadErrorKind::Expected {
                entity: "s",
                expected: "4 numbers (centre and radius)".into(),
                found: quoted("abc").into(),
                help: "give them",
            },
        };
        assert_eq!(
            error.to_string(),
            "scene.nff:12: in `s`: expected 4 numbers (centre and radius), found `abc`; help: give them"
        );
        assert_eq!(error.help(), "give them");
    }

    #[test]
    fn errors_stay_small_enough_to_pass_by_value() {
        assert!(size_of::<ReadError>() <= 128);
    }

    #[test]
    fn quoted_text_is_short_and_harmless() {
        assert_eq!(quoted("a\u{1b}[31m"), "`a\\u{1b}[31m`");
        assert_eq!(
            quoted(&"x".repeat(1000)),
            format!("`{}...`", "x".repeat(40))
        );
    }
}
