//! What is wrong with a glTF file.

use crate::error::{Place, ReadErrorKind};
use crate::room::OverLimit;

/// What is wrong with the file, and where in it.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) place: Place,
    pub(super) kind: ReadErrorKind,
}

impl Fault {
    /// Something is wrong at a path in the JSON, such as `nodes[3].mesh`.
    pub(super) fn at(
        path: impl Into<Box<str>>,
        problem: impl Into<Box<str>>,
        help: &'static str,
    ) -> Self {
        Self {
            place: Place::Whole,
            kind: ReadErrorKind::Element {
                path: path.into(),
                problem: problem.into(),
                help,
            },
        }
    }

    /// Something does not fit into memory.
    pub(super) fn over_limit(over: OverLimit) -> Self {
        Self {
            place: Place::Whole,
            kind: over.into(),
        }
    }

    /// An index names nothing.
    pub(super) fn missing(
        path: impl Into<Box<str>>,
        list: &str,
        index: usize,
        count: usize,
    ) -> Self {
        let problem = format!("{list}[{index}] is not there: the file has {count}");
        Self::at(path, problem, "export the file again")
    }
}

/// Returns a name for messages: not all of a long one, since objects are many.
pub(super) fn short_name(name: &str) -> String {
    name.chars().take(80).collect()
}
