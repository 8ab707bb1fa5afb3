//! Files that appear whole or not at all: written under a temporary name beside their place and
//! renamed.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// Writes a file to `path`, replacing what was there, if `encode` and the file system allow. `io_error`
/// wraps what the file system says.
///
/// # Errors
/// What `encode` or the file system says; what was at `path` is then untouched.
pub fn write<E>(
    path: &Path,
    io_error: impl Fn(io::Error) -> E,
    encode: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    // Beside its place, so that renaming never crosses file systems.
    let mut name: OsString = path.as_os_str().to_owned();
    name.push(format!(".{}.partial", std::process::id()));
    let temporary = PathBuf::from(name);

    let written = (|| {
        let mut file = BufWriter::new(File::create(&temporary).map_err(&io_error)?);
        encode(&mut file)?;
        file.flush().map_err(&io_error)?;
        drop(file);
        fs::rename(&temporary, path).map_err(&io_error)
    })();
    if written.is_err() {
        // The first error is the one worth telling.
        let _ = fs::remove_file(&temporary);
    }
    written
}
