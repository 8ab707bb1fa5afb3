//! Readers, one file a format.
//!
//! In: a path, or bytes with the name they came under. Out: [`Loaded`], a valid scene and what
//! was not used of the file, or a [`ReadError`]. Invariant: what a reader returns keeps the
//! promises of [`crate::model`]; coordinates are at most 2^100 in magnitude, as the geometry wants.

mod area;
mod gltf;
mod indexed;
mod mtl;
mod nff;
mod obj;
mod ply;
mod statements;
mod stl;
mod text;

use std::{
    fs::File,
    io::{self, Read},
    path::{Component, Path},
};

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::Scene,
    warning::Warning,
};

pub use gltf::read_gltf;
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
/// for in its folder and below it only.
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
    match extension.as_deref() {
        Some("nff") => read_nff(path, &read_bytes(path, limit)?),
        Some("obj") => {
            let bytes = read_bytes(path, limit)?;
            let beside = &mut |name: &str| read_beside(path, name, limit);
            read_obj(path, &bytes, options, beside)
        }
        Some("gltf" | "glb") => {
            let bytes = read_bytes(path, limit)?;
            let beside = &mut |name: &str| read_beside(path, name, limit);
            read_gltf(path, &bytes, options, beside)
        }
        Some("ply") => read_ply(path, &read_bytes(path, limit)?, options),
        Some("stl") => read_stl(path, &read_bytes(path, limit)?, options),
        other => {
            let found = other.map_or("a name without an ending".into(), |e| {
                quoted(&format!(".{e}"))
            });
            Err(whole(path, ReadErrorKind::UnknownFormat { found }))
        }
    }
}

/// Reads a file beside a scene, named by the scene: inside its folder or below, never outside.
fn read_beside(scene: &Path, name: &str, limit: u64) -> io::Result<Vec<u8>> {
    // Windows paths occur in files that are read elsewhere.
    let name = name.replace('\\', "/");
    let relative = Path::new(&name);
    let stays_inside = relative
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays_inside || name.contains(':') {
        return Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "the name leads outside the folder of the scene",
        ));
    }
    let path = scene.parent().unwrap_or(Path::new("")).join(relative);
    read_bytes(&path, limit).map_err(|error| match error.kind {
        ReadErrorKind::Io(error) => error,
        large @ ReadErrorKind::OverLimit { .. } => {
            io::Error::new(io::ErrorKind::FileTooLarge, large)
        }
        other => io::Error::other(other.to_string()),
    })
}

/// Reads a whole regular file of at most `limit` bytes.
fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let fail = |error| whole(path, ReadErrorKind::Io(error));
    // Asked before opening: opening a pipe would wait for a writer.
    let metadata = std::fs::metadata(path).map_err(fail)?;
    if !metadata.is_file() {
        return Err(whole(path, ReadErrorKind::NotAFile));
    }
    let too_large = |bytes| {
        let kind = if limit < MAX_FILE_BYTES {
            let what = "the file".into();
            ReadErrorKind::OverLimit { what, bytes, limit }
        } else {
            ReadErrorKind::TooLarge { bytes, limit }
        };
        whole(path, kind)
    };
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(fail)?;
    // The file may grow while it is read.
    let mut file = file.take(limit + 1);
    let _ = bytes.try_reserve_exact(metadata.len() as usize);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_stay_inside_the_folder_of_the_scene() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("inner")).unwrap();
        std::fs::write(folder.path().join("outside.mtl"), "newmtl a").unwrap();
        std::fs::write(folder.path().join("inner/inside.mtl"), "newmtl a").unwrap();
        let scene = folder.path().join("inner/scene.obj");
        let beside = |name: &str| read_beside(&scene, name, MAX_FILE_BYTES);
        assert!(beside("inside.mtl").is_ok());
        assert!(beside("./inside.mtl").is_ok());
        let absolute = folder.path().join("inner/inside.mtl");
        for name in [
            "../outside.mtl",
            "..\\outside.mtl",
            absolute.to_str().unwrap(),
            "C:\\a.mtl",
        ] {
            let error = beside(name).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{name}");
        }
        assert_eq!(
            beside("none.mtl").unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
    }
}
