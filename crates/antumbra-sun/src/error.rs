//! Why a file or a setting is refused: the place, what was found, what was expected.

use std::fmt;
use std::path::{Path, PathBuf};

/// Why a file is not read. Displays as `FILE:LINE: message`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {message}", file.display(), AtLine(*line))]
pub struct FileError {
    /// Path of the file.
    pub file: PathBuf,
    /// Number of the line, counted from 1; `None` where the whole file is at fault.
    pub line: Option<usize>,
    /// Fault: what was found, and what was expected.
    pub message: String,
}

impl FileError {
    /// Makes an error about a whole file.
    pub(crate) fn whole(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: file.to_path_buf(),
            line: None,
            message: message.into(),
        }
    }

    /// Makes an error about a line, counted from 1.
    pub(crate) fn at(file: &Path, line: usize, message: impl Into<String>) -> Self {
        Self {
            line: Some(line),
            ..Self::whole(file, message)
        }
    }
}

struct AtLine(Option<usize>);

impl fmt::Display for AtLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(line) => write!(f, ":{line}"),
            None => Ok(()),
        }
    }
}

/// Setting that is out of range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BadSetting(pub String);
