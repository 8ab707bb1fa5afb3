//! Whether two paths lead to one file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Identity of the file that a path leads to. Equal for all paths of one file, whatever links are on the way.
///
/// On Unix hard links count, too. Elsewhere two hard links are two files.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Identity(Kind);

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Kind {
    /// Device and number of a file that exists.
    #[cfg(unix)]
    Inode(u64, u64),
    /// A path without links.
    Path(PathBuf),
}

impl Identity {
    /// Returns what a path leads to now; a path that leads nowhere is identified by its folder and name.
    pub fn of(path: &Path) -> Self {
        #[cfg(unix)]
        if let Ok(found) = std::fs::metadata(path) {
            use std::os::unix::fs::MetadataExt as _;
            return Self(Kind::Inode(found.dev(), found.ino()));
        }
        Self(Kind::Path(resolved(path)))
    }
}

/// Returns a path without links, as far as it exists.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(whole) = path.canonicalize() {
        return whole;
    }
    let folder = folder_of(path).canonicalize();
    let name = path.file_name().unwrap_or(OsStr::new(""));
    folder.map_or_else(|_| path.to_owned(), |folder| folder.join(name))
}

/// Returns the folder that a path names a file in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn paths_of_one_file_are_alike() {
        let folder = tempfile::tempdir().expect("a folder");
        let [a, b, new] = ["a", "b", "new"].map(|name| folder.path().join(name));
        fs::write(&a, "1").expect("a file");
        fs::write(&b, "1").expect("a file");
        fs::create_dir(folder.path().join("in")).expect("a folder");
        let round = folder.path().join("in/../a");
        assert_eq!(Identity::of(&a), Identity::of(&round));
        assert_ne!(Identity::of(&a), Identity::of(&b));
        // What is not there yet.
        let round = folder.path().join("in/../new");
        assert_eq!(Identity::of(&new), Identity::of(&round));
        assert_ne!(Identity::of(&new), Identity::of(&a));
        assert_ne!(
            Identity::of(&new),
            Identity::of(&folder.path().join("in/new"))
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_to_the_file_itself() {
        let folder = tempfile::tempdir().expect("a folder");
        let [a, hard, soft] = ["a", "hard", "soft"].map(|name| folder.path().join(name));
        fs::write(&a, "1").expect("a file");
        fs::hard_link(&a, &hard).expect("a link");
        std::os::unix::fs::symlink("a", &soft).expect("a link");
        assert_eq!(Identity::of(&a), Identity::of(&hard));
        assert_eq!(Identity::of(&a), Identity::of(&soft));
    }
}
