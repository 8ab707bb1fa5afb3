//! Chunks of a study that is not done: written one file each, so that the next run need not answer them again.
//!
//! In: a folder, the identity of a study. Out: bits of chunks. Invariants: a file is whole or absent; what another study
//! left is never taken, and is written over; files that are no parts are never touched.

use std::borrow::Cow;
use std::fs;
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

/// Beginning of a file.
const MARK: &str = "antumbra sun part 1\n";

/// Folder that parts of a study are kept in. It appears with the first part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Path of the folder.
    pub folder: PathBuf,
}

/// Why a part is not kept.
#[derive(Debug, thiserror::Error)]
#[error("cannot keep what is done in {}: {source}", path.display())]
pub struct PartError {
    /// Path of the file or folder.
    pub path: PathBuf,
    /// Reason that the system gives.
    pub source: io::Error,
}

impl Parts {
    /// Removes all parts, and the folder if nothing else is in it. What cannot be removed stays: it is taken for what
    /// it is by the next run.
    pub fn remove(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else {
            return;
        };
        for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
            if antumbra_files::is_own(&path, MARK).unwrap_or(false) {
                let _ = fs::remove_file(&path);
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Parts of one study.
pub(super) struct Kept {
    folder: PathBuf,
    identity: [u8; 32],
}

impl Kept {
    /// Makes the folder, unless it is there.
    pub(super) fn new(parts: &Parts, identity: [u8; 32]) -> Result<Self, PartError> {
        let folder = parts.folder.clone();
        match fs::create_dir(&folder) {
            Err(source) if !folder.is_dir() => Err(PartError {
                path: folder,
                source,
            }),
            _ => Ok(Self { folder, identity }),
        }
    }

    fn path(&self, chunk: usize) -> PathBuf {
        self.folder.join(format!("{chunk:06}.bits"))
    }

    /// Reads the words of a chunk. Returns whether they were there, whole and of this study; if not, the words are as
    /// they were.
    pub(super) fn load(&self, chunk: usize, words: &mut [u64]) -> bool {
        self.read(&self.path(chunk), words.len())
            .is_ok_and(|found| {
                words.copy_from_slice(&found);
                true
            })
    }

    fn read(&self, path: &Path, count: usize) -> io::Result<Vec<u64>> {
        let mut file = io::BufReader::new(antumbra_files::open(path)?);
        let foreign = || io::Error::from(io::ErrorKind::InvalidData);
        let mut mark = [0; MARK.len()];
        file.read_exact(&mut mark)?;
        let (mut identity, mut sum) = ([0; 32], [0; 32]);
        file.read_exact(&mut identity)?;
        file.read_exact(&mut sum)?;
        if mark != MARK.as_bytes() || identity != self.identity {
            return Err(foreign());
        }
        let mut bytes = vec![0; count * 8];
        file.read_exact(&mut bytes)?;
        let is_whole = file.read(&mut [0])? == 0 && *blake3::hash(&bytes).as_bytes() == sum;
        let words = bytes.as_chunks::<8>().0.iter();
        let words = words.map(|&word| u64::from_le_bytes(word));
        is_whole.then(|| words.collect()).ok_or_else(foreign)
    }

    /// Writes the words of a chunk.
    pub(super) fn save(&self, chunk: usize, words: &[u64]) -> Result<(), PartError> {
        let path = self.path(chunk);
        let bytes = le_bytes(words);
        let written = refuse_foreign(&path).and_then(|()| {
            antumbra_files::write(
                &path,
                |error| error,
                |file| {
                    file.write_all(MARK.as_bytes())?;
                    file.write_all(&self.identity)?;
                    file.write_all(blake3::hash(&bytes).as_bytes())?;
                    file.write_all(&bytes)
                },
            )
        });
        written.map_err(|source| PartError { path, source })
    }
}

/// Refuses to replace a file that is no part.
fn refuse_foreign(path: &Path) -> io::Result<()> {
    match antumbra_files::is_own(path, MARK) {
        Ok(false) => Err(io::Error::other(
            "a file that is no part of a study is there",
        )),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Returns words as bytes, lowest first.
pub(crate) fn le_bytes(words: &[u64]) -> Cow<'_, [u8]> {
    match cfg!(target_endian = "little") {
        true => Cow::Borrowed(bytemuck::cast_slice(words)),
        false => Cow::Owned(words.iter().flat_map(|word| word.to_le_bytes()).collect()),
    }
}
