//! Words and bytes in a file, the lowest byte of each word first.
//!
//! In: a path. Out: copies of its parts, or a file with parts. Invariant: a part is whole or an error, whatever
//! becomes of the file while it is read.
//!
//! Cost: a part is read once, from the system's cache to where it is needed, and no part is read that nobody asks
//! for. The file is read, not mapped: another process that cuts off a mapped file ends this one by a signal.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use antumbra_files::Writing;

/// An open file.
pub(super) struct Parts {
    file: File,
    length: u64,
}

impl Parts {
    /// Opens a regular file.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = antumbra_files::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file, length })
    }

    /// Returns how many bytes there were when the file was opened.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Reads some bytes.
    pub(super) fn bytes(&self, at: u64, count: u64) -> io::Result<Vec<u8>> {
        self.part(at, count)
    }

    /// Reads some words.
    pub(super) fn words(&self, at: u64, count: u64) -> io::Result<Vec<u32>> {
        let mut words = self.part(at, count)?;
        if cfg!(target_endian = "big") {
            words
                .iter_mut()
                .for_each(|word: &mut u32| *word = word.to_le());
        }
        Ok(words)
    }

    fn part<T: bytemuck::Pod>(&self, at: u64, count: u64) -> io::Result<Vec<T>> {
        let end = count
            .checked_mul(size_of::<T>() as u64)
            .and_then(|bytes| at.checked_add(bytes));
        // Before memory is taken for it.
        if end.is_none_or(|end| end > self.length) {
            return Err(too_short());
        }
        let no_memory = || io::Error::from(io::ErrorKind::OutOfMemory);
        let count = usize::try_from(count).map_err(|_| no_memory())?;
        let room = bytemuck::allocation::try_zeroed_slice_box(count);
        let mut items = room.map_err(|()| no_memory())?.into_vec();
        let mut file = &self.file;
        file.seek(SeekFrom::Start(at))?;
        let read = file.read_exact(bytemuck::cast_slice_mut(&mut items));
        match read {
            // It was cut off since it was opened.
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(too_short()),
            read => read.map(|()| items),
        }
    }
}

fn too_short() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "it ends too early")
}

/// Writes words.
pub(super) fn write(file: &mut Writing<'_>, mut words: Cow<'_, [u32]>) -> io::Result<()> {
    if cfg!(target_endian = "big") {
        words
            .to_mut()
            .iter_mut()
            .for_each(|word| *word = word.to_le());
    }
    file.write_all(bytemuck::cast_slice(&words))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_and_no_more() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, [1, 0, 0, 0, 2, 1, 0, 0, 9]).expect("a file");
        let parts = Parts::open(&path).expect("a file");
        assert_eq!(parts.length(), 9);
        assert_eq!(parts.bytes(8, 1).expect("a byte"), [9]);
        assert_eq!(parts.bytes(9, 0).expect("nothing"), [0; 0]);
        assert_eq!(parts.words(0, 2).expect("words"), [1, 258]);
        // Words at any byte.
        assert_eq!(parts.words(1, 1).expect("a word"), [2 << 24]);
        for (at, count) in [(9, 1), (u64::MAX, 2), (0, u64::MAX)] {
            assert!(parts.bytes(at, count).is_err());
        }
        assert!(parts.words(4, 2).is_err() && parts.words(0, u64::MAX).is_err());

        std::fs::write(&path, []).expect("a file");
        let parts = Parts::open(&path).expect("a file");
        assert_eq!(parts.length(), 0);
        assert_eq!(parts.bytes(0, 0).expect("nothing"), [0; 0]);
        assert!(parts.bytes(0, 1).is_err());
        assert!(Parts::open(folder.path()).is_err());
    }

    #[test]
    fn a_file_cut_off_after_it_was_opened_is_an_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, [1; 100_000]).expect("a file");
        let parts = Parts::open(&path).expect("a file");
        std::fs::write(&path, [1; 10]).expect("a file");
        let error = parts.words(0, 25_000).expect_err("it is too short");
        assert_eq!(error.to_string(), "it ends too early");
    }
}
