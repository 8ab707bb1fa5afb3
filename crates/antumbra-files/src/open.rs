//! Opening what is to be read.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;

/// Kind of a path that names no regular file: a folder, a device, a pipe, a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it is no regular file")]
pub struct NotRegular;

/// Opens a regular file for reading. Never waits, as opening a pipe would.
///
/// # Errors
/// The system refuses, or the path names something else: then the error holds a [`NotRegular`].
pub fn open(path: &Path) -> io::Result<File> {
    let is_file = |found: fs::Metadata| match found.is_file() {
        true => Ok(()),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, NotRegular)),
    };
    // Before it is opened, for opening some devices does something; and after, for what stands there may change.
    is_file(fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    without_waiting(&mut options);
    let file = options.open(path)?;
    is_file(file.metadata()?)?;
    Ok(file)
}

/// Has a pipe opened at once or refused.
pub(crate) fn without_waiting(options: &mut OpenOptions) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits() as i32);
    }
    #[cfg(not(unix))]
    let _ = options;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    fn is_not_regular(path: &Path) -> bool {
        let error = open(path).expect_err("it is refused");
        error
            .get_ref()
            .is_some_and(|inner| inner.is::<NotRegular>())
    }

    #[test]
    fn regular_files_are_opened_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        fs::write(&file, "abc").expect("a file");
        let mut text = String::new();
        let mut opened = open(&file).expect("a file");
        opened.read_to_string(&mut text).expect("a file");
        assert_eq!(text, "abc");
        assert!(is_not_regular(folder.path()));
        let absent = open(&folder.path().join("none")).expect_err("it is not there");
        assert_eq!(absent.kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_without_a_writer_is_refused_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo").success());
        assert!(is_not_regular(&pipe));
        assert!(is_not_regular(Path::new("/dev/null")));
        let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket"));
        assert!(is_not_regular(&folder.path().join("socket")));
    }
}
