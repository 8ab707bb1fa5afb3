//! Readers, one file a format.
//!
//! In: a path, or bytes with the name they came under. Out: [`Loaded`], a valid scene and what
//! was not used of the file, or a [`ReadError`]. Invariant: what a reader returns keeps the
//! promises of [`crate::model`]; coordinates are at most 2^100 in magnitude, as the geometry wants.

mod area;
mod beside;
mod gltf;
mod indexed;
mod input;
mod lights;
mod mtl;
mod nff;
mod obj;
mod ply;
mod statements;
mod stl;
mod text;

use std::path::Path;

use crate::error::{ReadError, ReadErrorKind, quoted};

pub(crate) use area::has_area;
use beside::Beside;

pub use gltf::read_gltf;
pub use input::{Loaded, MAX_FILE_BYTES, ReadOptions, UpAxis};
use input::{read_bytes, whole};
pub use lights::{Lights, read_lights};
pub use nff::read_nff;
pub use obj::read_obj;
pub use ply::read_ply;
pub use stl::read_stl;

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
