//! Readers, one file a format.
//!
//! In: a path, or bytes with the name they came under. Out: [`Loaded`], a valid scene and what
//! was not used of the file, or a [`ReadError`]. Invariant: what a reader returns keeps the
//! promises of [`crate::model`]; coordinates are at most 2^100 in magnitude, as the geometry wants.

mod area;
mod beside;
mod gltf;
mod indexed;
mod lights;
mod mtl;
mod nff;
mod obj;
mod ply;
mod statements;
mod stl;
mod text;

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use antumbra_files::NotRegular;
use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::Scene,
    warning::Warning,
};

pub(crate) use area::has_area;
use beside::Beside;

pub use gltf::read_gltf;
pub use lights::{Lights, read_lights};
pub use nff::read_nff;
pub use obj::read_obj;
pub use ply::read_ply;
pub use stl::read_stl;

/// The largest file that is read, in bytes: 4 GiB.
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// Bytes that are read between two looks whether to stop.
const PART: u64 = 1 << 24;

/// A scene and what its reader had to say.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene, valid.
    pub scene: Scene,
    /// What was ignored, repaired or guessed.
    pub warnings: Vec<Warning>,
    /// The files that it was read from, the scene's own first; none where bytes were given.
    pub files: Vec<PathBuf>,
}

/// What a file leaves open, and how much it may take. The default takes what is usual for the format.
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
    fn vector(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }
}

/// Reads a scene file; its ending chooses the reader: `.nff`, `.obj`, `.gltf`, `.glb`, `.ply` or
/// `.stl`, in any case.
///
/// Files that a scene names (material libraries, buffers, pictures) are looked
/// for in its folder and below it only; a link that leads out of the folder is refused.
///
/// # Errors
/// The file cannot be read, is in no format that is read, or is refused by its reader; the
/// error names the line, or the byte in a binary file.
///
/// # Example
/// ```
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("ball.nff");
/// std::fs::write(&path, "s 0 0 0 1")?;
/// let loaded = antumbra_scene::read_file(&path, &Default::default())?;
/// assert_eq!(loaded.scene.objects.len(), 1);
/// assert!(loaded.warnings[0].to_string().ends_with("no view (`v`) in the file"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_file(path: &Path, options: &ReadOptions) -> Result<Loaded, ReadError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let limit = options.memory_limit.min(MAX_FILE_BYTES);
    let mut beside = Beside::new(path, limit);
    let read = &mut |name: &str| beside.read(name);
    let bytes = || read_bytes(path, limit);
    let loaded = match extension.as_deref() {
        Some("nff") => read_nff(path, &bytes()?),
        Some("obj") => read_obj(path, &bytes()?, options, read),
        Some("gltf" | "glb") => read_gltf(path, &bytes()?, options, read),
        Some("ply") => read_ply(path, &bytes()?, options),
        Some("stl") => read_stl(path, &bytes()?, options),
        other => {
            let found = other.map_or("a name without an ending".into(), |e| {
                quoted(&format!(".{e}"))
            });
            Err(whole(path, ReadErrorKind::UnknownFormat { found }))
        }
    };
    Ok(Loaded {
        files: beside.files,
        ..loaded?
    })
}

/// Reads a whole regular file of at most `limit` bytes.
fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
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
fn whole(path: &Path, kind: ReadErrorKind) -> ReadError {
    ReadError {
        file: path.to_path_buf(),
        place: Place::Whole,
        kind,
    }
}
