//! What a writer says when it refuses a scene.
//!
//! In: what the format cannot say. Out: one line of text that names it.

use std::{io, path::PathBuf};

use crate::model::Object;

/// Why a scene was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The output refused.
    #[error("cannot write: {0}")]
    Io(#[from] io::Error),
    /// The output file refused.
    #[error("{}: cannot write: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        #[source]
        source: io::Error,
    },
    /// A file of somebody else is where a file beside the scene goes.
    #[error("{}: antumbra did not write this file, and it would be overwritten; choose another name for the scene or move it", .path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The name does not end like a format that is written.
    #[error("{}: no writer for this name; expected one that ends in .nff, .obj, .ply or .glb", .path.display())]
    UnknownFormat {
        /// The name.
        path: PathBuf,
    },
    /// The format has no way to say it.
    #[error("{format} cannot say {what} (number {index}{})", Called(.name))]
    Unsupported {
        /// The format.
        format: &'static str,
        /// What it is.
        what: &'static str,
        /// Its index in the scene's list, from 0.
        index: usize,
        /// Its name; may be empty.
        name: String,
    },
    /// Nothing would be left.
    #[error(
        "{format} has 32-bit coordinates: all {triangle_count} triangles would lose their area by rounding"
    )]
    Collapsed {
        /// The format.
        format: &'static str,
        /// Triangles with area that there are.
        triangle_count: u64,
    },
    /// The format has no room for so much.
    #[error("the scene is too large for {format}: {what}")]
    TooLarge {
        /// The format.
        format: &'static str,
        /// What does not fit.
        what: &'static str,
    },
}

impl WriteError {
    /// Returns the error about an object.
    pub(super) fn unsupported(
        format: &'static str,
        what: &'static str,
        index: usize,
        object: &Object,
    ) -> Self {
        Self::Unsupported {
            format,
            what,
            index,
            name: object.name.clone(),
        }
    }
}

/// Displays `, `name`` unless the name is empty.
struct Called<'a>(&'a str);

impl std::fmt::Display for Called<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0.is_empty() {
            Ok(())
        } else {
            write!(f, ", `{}`", self.0)
        }
    }
}
