//! Writes a file in the format its name asks for.
//!
//! In: a scene and a path. Out: the file (for OBJ two), and what the format left out. Invariant: each file is
//! whole or the one before; a scene that is refused leaves existing files as they were.

use std::path::{Path, PathBuf};

use antumbra_files::Place;

use crate::{error, model::Scene, warning::Warning};

use super::{
    LIBRARY_MARK, Precision, WriteError, obj::library_name, write_glb, write_nff, write_obj,
    write_ply,
};

/// Writes a scene; the ending of the name chooses the format: `.nff`, `.obj` (with a material
/// library of the same name and the ending `.mtl` beside it; what OBJ cannot say in a name becomes `_`), `.ply` or
/// `.glb`, in any case.
///
/// Returns what the format has no place for. Numbers are written exactly where the format allows.
/// All is made in memory first, so that a refused scene leaves an existing file alone, and a file appears whole
/// or not at all. [`files_of`] says which files are written; whether one of them was read is the caller's to check.
///
/// # Errors
/// The name has no known ending, the format cannot say something that matters (spheres in a mesh
/// format, colored glass in NFF), the material library of somebody else is in the way, or the file system refuses.
///
/// # Example
/// ```
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("tetra.ply");
/// use antumbra_scene::{generate::tetra, read_file, write::write_file};
/// let notes = write_file(&tetra(1).unwrap(), &path)?;
/// assert!(notes[0].to_string().ends_with("objects are not written"));
/// assert_eq!(read_file(&path, &Default::default()).unwrap().scene.objects.len(), 1);
/// # Ok::<(), antumbra_scene::write::WriteError>(())
/// ```
pub fn write_file(scene: &Scene, path: &Path) -> Result<Vec<Warning>, WriteError> {
    let extension = extension_of(path);
    let mut bytes = Vec::new();
    let mut library = None;
    let notes = match extension.as_deref() {
        Some("nff") => {
            write_nff(scene, Precision::Exact, &mut bytes)?;
            Vec::new()
        }
        Some("obj") => {
            let library_path = library_of(path);
            let name = library_path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy();
            let mut text = Vec::new();
            let notes = write_obj(scene, Precision::Exact, &name, &mut bytes, &mut text)?;
            library = Some((library_path, text));
            notes
        }
        Some("ply") => write_ply(scene, &mut bytes)?,
        Some("glb") => write_glb(scene, &mut bytes)?,
        _ => {
            let path = path.to_path_buf();
            return Err(WriteError::UnknownFormat { path });
        }
    };
    if let Some((path, _)) = &library {
        check_library(path)?;
    }
    let files = library.into_iter().chain([(path.to_path_buf(), bytes)]);
    for (path, bytes) in files {
        antumbra_files::write_bytes(&path, &bytes)
            .map_err(|source| WriteError::File { path, source })?;
    }
    let note = |message| Warning {
        file: path.to_path_buf(),
        place: error::Place::Whole,
        message,
    };
    Ok(notes.into_iter().map(note).collect())
}

/// Refuses to overwrite a material library that somebody else wrote: its name was not chosen, but follows.
fn check_library(path: &Path) -> Result<(), WriteError> {
    let is_file = matches!(Place::of(path), Ok(Place::File));
    if !is_file || antumbra_files::is_own(path, LIBRARY_MARK).unwrap_or(false) {
        return Ok(());
    }
    let path = path.to_path_buf();
    Err(WriteError::Foreign { path })
}

/// Returns the files that [`write_file`] writes for a path: the path, and for OBJ the material library beside it.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let library = (extension_of(path).as_deref() == Some("obj")).then(|| library_of(path));
    std::iter::once(path.to_path_buf()).chain(library).collect()
}

fn extension_of(path: &Path) -> Option<String> {
    path.extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
}

/// Returns where the material library goes: the name with another ending, where `mtllib` can say that.
fn library_of(path: &Path) -> PathBuf {
    let library = path.with_extension("mtl");
    let name = library.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(library_name(&name))
}
