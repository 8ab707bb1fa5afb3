//! What a reader says about things it did not use.
//!
//! In: warnings as they arise, each with a key. Out: one [`Warning`] a key, at the place of the
//! first, with a count. Invariant: the number of warnings is bounded, whatever the file holds.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use crate::error::Place;

/// Something in a file that was ignored, repaired or guessed. Displays as `file:line: message`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file it is about.
    pub file: PathBuf,
    /// Place where it first happened.
    pub place: Place,
    /// Text that says what happened and what was done about it; ends with a count when it happened again.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}: {}", self.file.display(), self.place, self.message)
    }
}

/// Collects warnings of one file; says each kind once.
#[derive(Debug)]
pub(crate) struct WarningLog {
    file: PathBuf,
    entries: Vec<Entry>,
    unlisted: u64,
}

#[derive(Debug)]
struct Entry {
    message: String,
    place: Place,
    count: u64,
}

impl WarningLog {
    /// More different warnings than this are counted, not listed.
    const MOST: usize = 64;

    pub(crate) fn new(file: &Path) -> Self {
        Self {
            file: file.to_path_buf(),
            entries: Vec::new(),
            unlisted: 0,
        }
    }

    /// Notes a warning. Equal messages are said once, at the first place, with a count.
    pub(crate) fn add(&mut self, place: Place, message: impl AsRef<str>) {
        let message = message.as_ref();
        if let Some(entry) = self
            .entries
            .iter_mut()
            .find(|entry| entry.message == message)
        {
            entry.count += 1;
        } else if self.entries.len() < Self::MOST {
            self.entries.push(Entry {
                message: message.to_owned(),
                place,
                count: 1,
            });
        } else {
            self.unlisted += 1;
        }
    }

    /// Returns the warnings, in the order of their first places.
    pub(crate) fn finish(self) -> Vec<Warning> {
        let Self {
            file,
            entries,
            unlisted,
        } = self;
        let rest = (unlisted > 0).then(|| Entry {
            message: format!("{unlisted} further warnings are not listed"),
            place: Place::Whole,
            count: 1,
        });
        let said = |entry: Entry| Warning {
            file: file.clone(),
            place: entry.place,
            message: match entry.count {
                1 => entry.message,
                count => format!("{} ({count} times; this is the first)", entry.message),
            },
        };
        entries.into_iter().chain(rest).map(said).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_warnings_are_said_once_with_a_count() {
        let mut log = WarningLog::new(Path::new("a.nff"));
        log.add(Place::Line(3), "radius 0");
        log.add(Place::Line(4), "other");
        log.add(Place::Line(9), "radius 0");
        let texts: Vec<_> = log.finish().iter().map(Warning::to_string).collect();
        assert_eq!(
            texts,
            [
                "a.nff:3: radius 0 (2 times; this is the first)",
                "a.nff:4: other"
            ]
        );
    }

    #[test]
    fn the_number_of_warnings_is_bounded() {
        let mut log = WarningLog::new(Path::new("a.nff"));
        for i in 0..1000 {
            log.add(Place::Line(i), format!("keyword {i}"));
        }
        let warnings = log.finish();
        assert_eq!(warnings.len(), 65);
        assert_eq!(warnings[64].message, "936 further warnings are not listed");
    }
}
