//! Kinds of things that stand where a file is to be written.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::identity::folder_of;

/// Kind of thing that stands where a file is to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Nothing: a file appears.
    Free,
    /// A regular file, which is replaced when all is written.
    File,
    /// A pipe or a character device such as `/dev/null`, which is written into.
    Stream,
}

/// Why nothing is written at a path.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// It ends in no name.
    #[error("it names no file")]
    Nameless,
    /// It names a folder.
    #[error("it is a folder")]
    Folder,
    /// It names a link, and a link must neither be replaced nor have its target replaced.
    #[error("it is a symbolic link to {}, and links are not written to", .0.display())]
    Link(PathBuf),
    /// It names a block device, a socket or something else that takes no file.
    #[error("it is a device or a socket, which takes no file")]
    Special,
    /// It names a file that is protected from writing.
    #[error("it is protected from writing")]
    Protected,
    /// The system says why.
    #[error(transparent)]
    System(#[from] io::Error),
}

impl Place {
    /// Returns what stands at a path, unless nothing can be written there. Touches nothing. A file appears by renaming,
    /// so that its folder, too, must not be protected from writing.
    ///
    /// A link counts as what it leads to where that is a stream: `/dev/stdout` is one.
    ///
    /// # Errors
    /// What stands there is neither a file nor a stream, or there is no folder for it.
    pub fn of(path: &Path) -> Result<Self, Refusal> {
        if path.file_name().is_none() {
            return Err(Refusal::Nameless);
        }
        let found = match fs::symlink_metadata(path) {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let folder = fs::metadata(folder_of(path))?;
                if !folder.is_dir() {
                    return Err(io::Error::from(io::ErrorKind::NotADirectory).into());
                }
                takes_files(folder_of(path))?;
                return Ok(Self::Free);
            }
            Err(error) => return Err(error.into()),
        };
        if found.is_symlink() {
            let target = fs::metadata(path);
            return match target.is_ok_and(|target| is_stream(&target)) {
                true => Ok(Self::Stream),
                false => Err(Refusal::Link(fs::read_link(path)?)),
            };
        }
        match () {
            () if found.is_dir() => Err(Refusal::Folder),
            () if is_stream(&found) => Ok(Self::Stream),
            () if !found.is_file() => Err(Refusal::Special),
            () if found.permissions().readonly() => Err(Refusal::Protected),
            () => {
                takes_files(folder_of(path))?;
                Ok(Self::File)
            }
        }
    }
}

impl From<Refusal> for io::Error {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::System(error) => error,
            Refusal::Protected => Self::new(io::ErrorKind::PermissionDenied, refusal),
            _ => Self::new(io::ErrorKind::InvalidInput, refusal),
        }
    }
}

/// Refuses a folder that this process may not add files to.
#[cfg(unix)]
fn takes_files(folder: &Path) -> io::Result<()> {
    use rustix::fs::{Access, access};
    access(folder, Access::WRITE_OK | Access::EXEC_OK).map_err(io::Error::from)
}

#[cfg(not(unix))]
fn takes_files(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(unix)]
fn is_stream(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    let kind = found.file_type();
    kind.is_fifo() || kind.is_char_device()
}

#[cfg(not(unix))]
fn is_stream(_: &fs::Metadata) -> bool {
    false
}
