//! Writing a file so that a crash leaves the one before.
//!
//! In: a path, and what writes. Out: a file with all of it, or the file that was there. A temporary file in the same
//! folder takes it all, is put on the disk, and takes the place of the file by one renaming. So any number of
//! processes may read meanwhile and go on reading what they have opened; of two that write at once each writes
//! a file of its own, and the last to finish is the one whose file stays.
//!
//! The temporary's name is short, whatever the file is called, and cannot be foreseen: neither what a killed process
//! left behind nor what somebody planted stands in its way.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::identity::folder_of;
use crate::place::Place;

/// Takes what a file is made of; parts may be written out of order.
pub type Writing<'a> = BufWriter<&'a File>;

/// Files that are not finished, so that a signal can remove them.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file by `fill`; `io_error` wraps what the system says. What was at the path is replaced when all is done,
/// and untouched if anything fails. A pipe or character device is not replaced: it gets the bytes once all are there.
///
/// The new file has the permissions of the one before.
///
/// # Errors
/// What `fill` or the system says, or why nothing is written at such a path (a [`Refusal`](crate::Refusal)).
pub fn write<E>(
    path: &Path,
    io_error: impl Fn(io::Error) -> E,
    fill: impl FnOnce(&mut Writing<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let filled = |file: &File| {
        let mut writing = BufWriter::new(file);
        fill(&mut writing)?;
        writing.flush().map_err(&io_error)
    };
    match Place::of(path).map_err(|refusal| io_error(refusal.into()))? {
        Place::Stream => {
            let mut whole = tempfile::tempfile().map_err(&io_error)?;
            filled(&whole)?;
            pour(&mut whole, path).map_err(io_error)
        }
        Place::Free | Place::File => {
            let file = Unfinished::beside(path).map_err(&io_error)?;
            filled(file.temporary.as_file())?;
            file.finish(path).map_err(io_error)
        }
    }
}

/// Writes bytes as [`write()`] does.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, |error| error, |file| file.write_all(bytes))
}

/// Removes all that is not finished. From then on this process finishes no file: a thread that is about to waits
/// for ever. For a process that is about to end because of a signal.
pub fn abandon() {
    let unfinished = unfinished();
    for path in unfinished.iter() {
        // Nobody is left to tell.
        let _ = fs::remove_file(path);
    }
    std::mem::forget(unfinished);
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths holds whatever happened to a thread that held it.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file, on the list. Dropped, it is gone from both.
struct Unfinished {
    temporary: NamedTempFile,
    _listed: Listed,
}

struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

impl Unfinished {
    /// Makes one in the folder of a file, so that renaming never crosses file systems.
    fn beside(path: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".antumbra-").rand_bytes(12);
        #[cfg(unix)]
        let everybody = std::os::unix::fs::PermissionsExt::from_mode(0o666);
        #[cfg(unix)]
        builder.permissions(everybody);
        let mut unfinished = unfinished();
        let temporary = builder.tempfile_in(folder_of(path)).map_err(without_name)?;
        unfinished.push(temporary.path().to_owned());
        let listed = Listed(temporary.path().to_owned());
        Ok(Self {
            temporary,
            _listed: listed,
        })
    }

    /// Puts the file on the disk and in its place.
    fn finish(self, path: &Path) -> io::Result<()> {
        // The list is left last.
        let Self {
            _listed: listed,
            temporary,
        } = self;
        if let Ok(before) = fs::metadata(path) {
            // Where the file system knows permissions.
            let _ = temporary.as_file().set_permissions(before.permissions());
        }
        temporary.as_file().sync_all()?;
        let list = unfinished();
        let renamed = temporary.persist(path);
        drop(list);
        drop(listed);
        renamed.map_err(|refused| refused.error)?;
        sync_folder(path);
        Ok(())
    }
}

/// Leaves out of what is said of a temporary file where that would have been: nobody has asked for it.
fn without_name(error: io::Error) -> io::Error {
    let said = error.to_string();
    match said.split_once(" at path ") {
        Some((why, _)) => io::Error::new(error.kind(), why),
        None => error,
    }
}

/// Puts the renaming on the disk, too, where the system lets folders be opened. A folder that may not be listed cannot
/// be, and the file is whole either way: so nothing is said.
fn sync_folder(path: &Path) {
    if cfg!(unix) {
        let _ = File::open(folder_of(path)).and_then(|folder| folder.sync_all());
    }
}

/// Writes a whole file into a pipe or a device.
fn pour(whole: &mut File, path: &Path) -> io::Result<()> {
    whole.rewind()?;
    let mut stream = open_stream(path)?;
    io::copy(whole, &mut stream).map(drop)
}

#[cfg(unix)]
fn open_stream(path: &Path) -> io::Result<File> {
    use rustix::fs::{OFlags, fcntl_setfl};
    use std::time::{Duration, Instant};

    /// How long a reader of a pipe may take to come: it is started in the same moment as this process.
    const PATIENCE: Duration = Duration::from_secs(5);
    let mut options = fs::OpenOptions::new();
    options.write(true);
    crate::open::without_waiting(&mut options);
    let begin = Instant::now();
    let nobody_reads = rustix::io::Errno::NXIO.raw_os_error();
    let stream = loop {
        match options.open(path) {
            Err(error) if error.raw_os_error() == Some(nobody_reads) => {
                if begin.elapsed() > PATIENCE {
                    return Err(io::Error::other("nobody reads from this pipe"));
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            opened => break opened?,
        }
    };
    // From here on it waits for whoever reads.
    fcntl_setfl(&stream, OFlags::empty())?;
    Ok(stream)
}

#[cfg(not(unix))]
fn open_stream(path: &Path) -> io::Result<File> {
    fs::OpenOptions::new().write(true).open(path)
}
