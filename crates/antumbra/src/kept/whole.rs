//! Writing a file so that a crash leaves the one before.
//!
//! In: what is to be written. Out: a file with all of it, or the file that was there. A temporary file in the same
//! folder takes it all, is put on the disk, and takes the place of the file by one renaming. So any number of
//! processes may read meanwhile and go on reading what they have opened; of two that write at once each writes
//! a file of its own, and the last to finish is the one whose file stays.

use std::borrow::Cow;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A file that is being written.
pub(super) struct Writing {
    file: File,
}

impl Writing {
    /// Leaves room at the start.
    pub(super) fn skip(&mut self, bytes: u64) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(bytes)).map(drop)
    }

    /// Writes words behind what was written, the lowest byte of each first.
    pub(super) fn words(&mut self, mut words: Cow<'_, [u32]>) -> io::Result<()> {
        if cfg!(target_endian = "big") {
            words
                .to_mut()
                .iter_mut()
                .for_each(|word| *word = word.to_le());
        }
        self.file.write_all(bytemuck::cast_slice(&words))
    }

    /// Writes bytes at the start.
    pub(super) fn start(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(bytes)
    }
}

/// Writes a file; what was at the path is replaced when all is done, and untouched if anything fails.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut Writing) -> io::Result<()>,
) -> io::Result<()> {
    let temporary = temporary_beside(path)?;
    let file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&temporary)?;
    let mut writing = Writing { file };
    let written = fill(&mut writing)
        .and_then(|()| writing.file.sync_all())
        .and_then(|()| fs::rename(&temporary, path));
    drop(writing);
    if written.is_err() {
        // The first error is the one worth telling.
        let _ = fs::remove_file(&temporary);
    }
    written?;
    sync_folder(path)
}

/// A name in the same folder, so that renaming never crosses file systems, and nobody else's.
fn temporary_beside(path: &Path) -> io::Result<PathBuf> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::other("it names no file"))?;
    let mut temporary: OsString = name.to_owned();
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    temporary.push(format!(".{}-{number}.partial", std::process::id()));
    Ok(path.with_file_name(temporary))
}

/// Puts the renaming on the disk, too, where folders can be opened.
fn sync_folder(path: &Path) -> io::Result<()> {
    if cfg!(not(unix)) {
        return Ok(());
    }
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let name = |entry: io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_fails_midway_leaves_the_file_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        let fill = |first: u32| {
            move |file: &mut Writing| {
                file.skip(3)?;
                file.words(vec![first, 0x0403_0201].into())?;
                file.start(b"abc")
            }
        };
        write(&path, fill(7)).expect("a file");
        let before = fs::read(&path).expect("a file");
        assert_eq!(before, b"abc\x07\0\0\0\x01\x02\x03\x04");

        for fail_after in 0..3 {
            let failed = write(&path, |file| {
                let mut steps = 0;
                let mut step = || {
                    steps += 1;
                    match steps > fail_after {
                        true => Err(io::Error::other("the disk is full")),
                        false => Ok(()),
                    }
                };
                step()?;
                file.skip(3)?;
                step()?;
                file.words(vec![1; 1000].into())?;
                step()?;
                file.start(b"xyz")
            });
            let error = failed.expect_err("it failed").to_string();
            assert_eq!(error, "the disk is full");
            assert_eq!(fs::read(&path).expect("a file"), before);
            assert_eq!(names(folder.path()), ["file"]);
        }
        // Who reads goes on reading what was there.
        let mut reader = File::open(&path).expect("a file");
        write(&path, fill(8)).expect("a file");
        let mut read = Vec::new();
        io::Read::read_to_end(&mut reader, &mut read).expect("a file");
        assert_eq!(read, before);
        assert_eq!(fs::read(&path).expect("a file")[3], 8);
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn what_cannot_be_written_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let nothing = |_: &mut Writing| Ok(());
        assert!(write(&folder.path().join("no/file"), nothing).is_err());
        // A folder is in the way.
        fs::create_dir(folder.path().join("taken")).expect("a folder");
        fs::create_dir(folder.path().join("taken/within")).expect("a folder");
        assert!(write(&folder.path().join("taken"), nothing).is_err());
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(write(Path::new("/"), nothing).is_err());
    }
}
