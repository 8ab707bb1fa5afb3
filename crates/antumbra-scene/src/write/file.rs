//! Writes a file in the format its name asks for.
//!
//! In: a scene and a path. Out: the file (for OBJ two), and what the format left out. Invariant: a
//! scene that is refused leaves an existing file as it was.

use std::{fs, path::Path};

use crate::{error::Place, model::Scene, warning::Warning};

use super::{Precision, WriteError, write_glb, write_nff, write_obj, write_ply};

/// Writes a scene; the ending of the name chooses the format: `.nff`, `.obj` (with a material
/// library of the same name and the ending `.mtl` beside it), `.ply` or `.glb`, in any case.
///
/// Returns what the format has no place for. Numbers are written exactly where the format allows.
/// The text is made in memory first, so that a refused scene leaves an existing file alone; a
/// failure while writing may leave half a file.
///
/// # Errors
/// The name has no known ending, the format cannot say something that matters (spheres in a mesh
/// format, coloured glass in NFF), or the file system refuses.
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
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut bytes = Vec::new();
    let mut library = None;
    let notes = match extension.as_deref() {
        Some("nff") => {
            write_nff(scene, Precision::Exact, &mut bytes)?;
            Vec::new()
        }
        Some("obj") => {
            let library_path = path.with_extension("mtl");
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
    let files = library.into_iter().chain([(path.to_path_buf(), bytes)]);
    for (path, bytes) in files {
        fs::write(&path, bytes).map_err(|source| WriteError::File { path, source })?;
    }
    let note = |message| Warning {
        file: path.to_path_buf(),
        place: Place::Whole,
        message,
    };
    Ok(notes.into_iter().map(note).collect())
}
