//! What is said of a file: what was taken of it, and why it is refused.

#[cfg(feature = "file")]
use std::io;
#[cfg(feature = "file")]
use std::path::Path;
use std::path::PathBuf;

use antumbra_geometry::{LightId, UnidentifiedCoverage};

/// Outcome for the values of a light in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SavedLight {
    /// They were loaded.
    Loaded,
    /// The file has none of a light of this kind and pose: it is new or has been moved. Its values are made
    /// as without a file.
    Absent,
    /// They need more memory than [`Refinement::memory`](crate::Refinement::memory) leaves, and are made as
    /// without a file.
    NoRoom,
}

/// Summary of a file that was saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Saved {
    /// Length of the file.
    pub bytes: u64,
    /// Voxels and lists, of all lights, in whose place finer voxels may still be made.
    pub pending_count: u64,
}

/// Why a file of occlusion values is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {reason}", path.display())]
#[non_exhaustive]
pub struct LoadError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    #[source]
    pub reason: Refusal,
}

/// Fault of a file of occlusion values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The system does not let it be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// It is something else.
    #[error("is no file of occlusion values")]
    Foreign,
    /// It was written by another version of this library.
    #[error("has version {found} of the format; this library reads version {expected}")]
    Version {
        /// Version of the file.
        found: u32,
        /// Version that is read.
        expected: u32,
    },
    /// It has more or fewer bytes than it says.
    #[error("has {found} bytes, and {expected} are due: it was cut off or added to")]
    Length {
        /// Bytes there are.
        found: u64,
        /// Bytes there should be, as far as that is known.
        expected: u64,
    },
    /// A checksum is wrong.
    #[error("is damaged: the checksum of {0} is wrong")]
    Damaged(Part),
    /// The checksums are right, and it makes no sense.
    #[error("makes no sense in {part}, word {word}: {what}")]
    Malformed {
        /// Where.
        part: Part,
        /// The word of that part.
        word: usize,
        /// What was found.
        what: &'static str,
    },
    /// It is about something else: what changed.
    #[error("is about {0}")]
    Stale(Change),
    /// The scene cannot be identified.
    #[error(transparent)]
    Unidentified(#[from] UnidentifiedCoverage),
    /// The index keeps nothing: only [`Method::Auto`](crate::Method::Auto) and [`Method::Voxel`](crate::Method::Voxel) do.
    #[error("is of no use to a method that keeps nothing")]
    NoValues,
    /// It holds maps of [`Method::Auto`](crate::Method::Auto), and [`Method::Voxel`](crate::Method::Voxel) is wanted.
    #[error("holds maps of the method auto, not values of the method voxel")]
    OtherMethod,
}

/// A part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Part {
    /// What it is about, and where what is.
    Head,
    /// The tree over the surfaces.
    Tree,
    /// The values of the light of this index.
    Light(LightId),
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Head => write!(f, "the head"),
            Self::Tree => write!(f, "the tree"),
            Self::Light(light) => write!(f, "light {light}"),
        }
    }
}

/// Difference from the scene that a file was saved for. A light that changed is no reason to refuse a file
/// ([`SavedLight::Absent`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// A surface, its opacity, its holes, or the order of surfaces.
    Scene,
    /// A setting of [`Refinement`](crate::Refinement), by name; values depend on it.
    Setting {
        /// Which.
        name: &'static str,
        /// As the file has it; of resolutions the power of two.
        found: u32,
        /// As it is wanted.
        expected: u32,
    },
    /// How this library divides space.
    Cells,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene => write!(f, "another scene: its surfaces are not these"),
            Self::Setting {
                name,
                found,
                expected,
            } => write!(f, "another {name}: {found}, and {expected} is wanted"),
            Self::Cells => write!(f, "other voxels than this library's"),
        }
    }
}

/// Why values were not saved. What was at the path is untouched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The index keeps nothing: only [`Method::Auto`](crate::Method::Auto) and [`Method::Voxel`](crate::Method::Voxel) do.
    #[error("the method of this index keeps nothing")]
    NoValues,
    /// The scene cannot be identified.
    #[error(transparent)]
    Unidentified(#[from] UnidentifiedCoverage),
    /// Something else is at the path, which is not replaced.
    #[error("{}: is no file of occlusion values, and is not replaced", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The system refuses.
    #[error("cannot write {}: {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
}

#[cfg(feature = "file")]
impl SaveError {
    pub(super) fn unwritable(path: &Path, error: &io::Error) -> Self {
        Self::Unwritable {
            path: path.to_owned(),
            reason: error.to_string(),
        }
    }
}

#[cfg(feature = "file")]
impl LoadError {
    pub(super) fn new(path: &Path, reason: Refusal) -> Self {
        Self {
            path: path.to_owned(),
            reason,
        }
    }
}
