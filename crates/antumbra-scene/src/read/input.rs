//! What readers are given and give: bytes, options, a scene.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use antumbra_files::NotRegular;
use antumbra_geometry::DVec3;

use crate::error::{Place, ReadError, ReadErrorKind};
use crate::model::Scene;
use crate::warning::Warning;

/// The largest file that is read, in bytes: 4 GiB.
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// Bytes that are read between two looks whether to stop.
pub(super) const PART: u64 = 1 << 24;

/// A scene and what its reader had to say.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene, valid.
    pub scene: Scene,
    /// Warnings about all that was ignored, repaired or guessed.
    pub warnings: Vec<Warning>,
    /// The files that it was read from, the scene's own first; none where bytes were given.
    pub files: Vec<PathBuf>,
    /// Whether [`Scene::up`] is only what is usual for the format: neither the file nor [`ReadOptions::up`] says it.
    pub is_up_assumed: bool,
}

/// Answers to what a file leaves open, and its memory limit. The default takes what is usual for the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Which axis of the file is up; used where the format does not say (OBJ: y by
    /// default; PLY and STL: z). Nothing is turned; only [`Scene::up`] changes.
    pub up: Option<UpAxis>,
    /// The most bytes that files, pictures and the scene may take together while they are read; by
    /// default 4 GiB. What does not fit is refused by the sizes that files give, before it is taken.
    pub memory_limit: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            up: None,
            memory_limit: 4 << 30,
        }
    }
}

/// An axis that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +y, usual for OBJ and glTF.
    Y,
    /// +z, usual for NFF, CAD and Blender.
    Z,
}

impl UpAxis {
    /// Returns the unit vector along the axis.
    pub(super) fn vector(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }
}

/// Reads a whole regular file of at most `limit` bytes.
pub(super) fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let fail = |error| whole(path, ReadErrorKind::Io(error));
    let file = antumbra_files::open(path).map_err(|error| match error.get_ref() {
        Some(inner) if inner.is::<NotRegular>() => whole(path, ReadErrorKind::NotAFile),
        _ => fail(error),
    })?;
    let length = file.metadata().map_err(fail)?.len();
    let too_large = |bytes| {
        let kind = if limit < MAX_FILE_BYTES {
            let what = "the file".into();
            ReadErrorKind::OverLimit { what, bytes, limit }
        } else {
            ReadErrorKind::TooLarge { bytes, limit }
        };
        whole(path, kind)
    };
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::new();
    // The file may grow while it is read.
    let mut file = file.take(limit + 1);
    let _ = bytes.try_reserve_exact(length as usize);
    while file
        .by_ref()
        .take(PART)
        .read_to_end(&mut bytes)
        .map_err(fail)?
        > 0
    {
        antumbra_task::check();
    }
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Returns an error about a file as a whole.
pub(super) fn whole(path: &Path, kind: ReadErrorKind) -> ReadError {
    ReadError {
        file: path.to_path_buf(),
        place: Place::Whole,
        kind,
    }
}
