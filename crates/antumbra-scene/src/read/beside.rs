//! Files that a scene names: read from its folder and below, never from elsewhere.
//!
//! In: a scene's path, the names in it. Out: bytes, and which files were read. Invariant: neither a name nor a link
//! leads out of the folder of the scene.

use std::{
    io,
    path::{Component, Path, PathBuf},
};

use crate::error::ReadErrorKind;

use super::read_bytes;

/// Reads files for a scene.
pub(super) struct Beside<'a> {
    scene: &'a Path,
    /// The largest file that is read.
    limit: u64,
    /// Those that were read, the scene's own first.
    pub(super) files: Vec<PathBuf>,
}

impl<'a> Beside<'a> {
    /// Returns who reads for a scene that is read itself.
    pub(super) fn new(scene: &'a Path, limit: u64) -> Self {
        Self {
            scene,
            limit,
            files: vec![scene.to_path_buf()],
        }
    }

    /// Reads a file by the name that the scene gives it.
    pub(super) fn read(&mut self, name: &str) -> io::Result<Vec<u8>> {
        let path = inside(self.scene, name)?;
        let bytes = read_bytes(&path, self.limit).map_err(|error| match error.kind {
            ReadErrorKind::Io(error) => error,
            large @ ReadErrorKind::OverLimit { .. } => {
                io::Error::new(io::ErrorKind::FileTooLarge, large)
            }
            other => io::Error::other(other.to_string()),
        })?;
        self.files.push(path);
        Ok(bytes)
    }
}

/// Returns where a file is, without links.
fn inside(scene: &Path, name: &str) -> io::Result<PathBuf> {
    let outside = |what| Err(io::Error::new(io::ErrorKind::PermissionDenied, what));
    // Windows paths occur in files that are read elsewhere.
    let name = name.replace('\\', "/");
    let relative = Path::new(&name);
    let stays_inside = relative
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays_inside || name.contains(':') {
        return outside("the name leads outside the folder of the scene");
    }
    let folder = match scene.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize()?;
    let path = folder.join(relative).canonicalize()?;
    if !path.starts_with(&folder) {
        return outside("a link leads outside the folder of the scene");
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::MAX_FILE_BYTES;
    use std::fs;

    #[test]
    fn libraries_stay_inside_the_folder_of_the_scene() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("inner")).unwrap();
        fs::write(folder.path().join("outside.mtl"), "newmtl a").unwrap();
        fs::write(folder.path().join("inner/inside.mtl"), "newmtl a").unwrap();
        let scene = folder.path().join("inner/scene.obj");
        let mut beside = Beside::new(&scene, MAX_FILE_BYTES);
        assert!(beside.read("inside.mtl").is_ok());
        assert!(beside.read("./inside.mtl").is_ok());
        let absolute = folder.path().join("inner/inside.mtl");
        for name in [
            "../outside.mtl",
            "..\\outside.mtl",
            absolute.to_str().unwrap(),
            "C:\\a.mtl",
        ] {
            let error = beside.read(name).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{name}");
        }
        assert_eq!(
            beside.read("none.mtl").unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
        // The two that were read are one.
        assert_eq!(beside.files[0], scene);
        let inside = absolute.canonicalize().unwrap();
        assert_eq!(beside.files[1..], [inside.clone(), inside]);
    }

    #[cfg(unix)]
    #[test]
    fn links_may_lead_about_the_folder_and_not_out_of_it() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir_all(inner.join("textures")).unwrap();
        fs::write(folder.path().join("outside.png"), "secret").unwrap();
        fs::write(inner.join("textures/a.png"), "a").unwrap();
        symlink("textures/a.png", inner.join("to-a.png")).unwrap();
        symlink("../outside.png", inner.join("out.png")).unwrap();
        symlink("out.png", inner.join("twice.png")).unwrap();
        symlink(folder.path(), inner.join("up")).unwrap();
        symlink("/dev/zero", inner.join("zero.png")).unwrap();
        // The folder itself may be a link.
        symlink("inner", folder.path().join("linked")).unwrap();
        for place in ["inner", "linked"] {
            let scene = folder.path().join(place).join("scene.gltf");
            let mut beside = Beside::new(&scene, MAX_FILE_BYTES);
            assert_eq!(beside.read("to-a.png").unwrap(), b"a");
            assert_eq!(beside.read("up/inner/to-a.png").unwrap(), b"a");
            for name in ["out.png", "twice.png", "up/outside.png", "zero.png"] {
                let error = beside.read(name).unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{name}");
                assert!(error.to_string().contains("leads outside"), "{error}");
            }
        }
    }
}
