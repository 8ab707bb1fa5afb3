//! A file in memory, and copies of its parts: the only `unsafe` code of this crate.
//!
//! In: a path. Out: copies. Invariant: nothing refers to the mapped memory but a copy that is being made, so
//! what another process does to the file is at worst a copy that its checksum refuses.
//!
//! Cost: a part is read once, by the page, from the system's cache to where it is needed, and no page of parts
//! that nobody asks for is read. Values are not used in place, though that would save the copy: a file that
//! another process writes to would then change values after they were checked.
//!
//! One hazard is left: a file that another process cuts off while a part is copied ends this process (SIGBUS).
//! This library replaces files and never changes one, so that takes another program and bad luck.
#![allow(
    unsafe_code,
    reason = "mapped memory is no Rust memory: it is copied by hand"
)]

use std::fs::File;
use std::io;
use std::path::Path;

use memmap2::{MmapOptions, MmapRaw};

/// A mapped file.
pub(super) struct Map {
    /// None for an empty file, which cannot be mapped.
    raw: Option<MmapRaw>,
}

impl Map {
    /// Maps a regular file.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        if !metadata.is_file() {
            return Err(io::Error::other("it is no regular file"));
        }
        if metadata.len() == 0 {
            return Ok(Self { raw: None });
        }
        let raw = MmapOptions::new().map_raw_read_only(&file)?;
        Ok(Self { raw: Some(raw) })
    }

    /// Returns how many bytes there were when the file was mapped.
    pub(super) fn length(&self) -> u64 {
        self.raw.as_ref().map_or(0, |raw| raw.len() as u64)
    }

    /// Copies some bytes.
    pub(super) fn bytes(&self, at: u64, count: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.copy(at, count, &mut bytes, |count| count)?;
        Ok(bytes)
    }

    /// Copies some words, the lowest byte of each first.
    pub(super) fn words(&self, at: u64, count: u64) -> io::Result<Vec<u32>> {
        let bytes = count.checked_mul(4).ok_or_else(too_far)?;
        let mut words = Vec::new();
        self.copy(at, bytes, &mut words, |count| count / 4)?;
        if cfg!(target_endian = "big") {
            words
                .iter_mut()
                .for_each(|word| *word = u32::from_le(*word));
        }
        Ok(words)
    }

    /// Copies `count` bytes, which make `length_of(count)` items.
    fn copy<T: bytemuck::Pod>(
        &self,
        at: u64,
        count: u64,
        items: &mut Vec<T>,
        length_of: impl Fn(usize) -> usize,
    ) -> io::Result<()> {
        let is_inside = at
            .checked_add(count)
            .is_some_and(|end| end <= self.length());
        if !is_inside {
            return Err(too_far());
        }
        let Some(raw) = &self.raw else {
            return Ok(());
        };
        // Both are below the length of a map, which is a `usize`.
        let (at, count) = (at as usize, count as usize);
        let length = length_of(count);
        items.try_reserve_exact(length).map_err(io::Error::other)?;
        assert!(items.is_empty() && length * size_of::<T>() <= count);
        // SAFETY: the source is `length` items' worth of bytes inside the mapping, which lives as long as `raw`
        // is borrowed; the target is room for as many that was just reserved; the two cannot overlap, since
        // the vector's memory is its own. Any bytes make a `T` (`Pod`), so the items are initialised.
        // Another process may change the file meanwhile: the bytes are copied through raw pointers, no
        // reference to them exists, and whatever was copied is checked afterwards. A page that the file no
        // longer has ends the process by a signal, which is no access out of range.
        unsafe {
            let source = raw.as_ptr().add(at);
            let target = items.as_mut_ptr().cast::<u8>();
            std::ptr::copy_nonoverlapping(source, target, length * size_of::<T>());
            items.set_len(length);
        }
        Ok(())
    }
}

fn too_far() -> io::Error {
    io::Error::other("it ends too early")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_copied_and_no_more() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, [1, 0, 0, 0, 2, 1, 0, 0, 9]).expect("a file");
        let map = Map::open(&path).expect("a map");
        assert_eq!(map.length(), 9);
        assert_eq!(map.bytes(8, 1).expect("a byte"), [9]);
        assert_eq!(map.bytes(9, 0).expect("nothing"), [0; 0]);
        assert_eq!(map.words(0, 2).expect("words"), [1, 258]);
        // Words at any byte.
        assert_eq!(map.words(1, 1).expect("a word"), [2 << 24]);
        for (at, count) in [(9, 1), (u64::MAX, 2), (0, u64::MAX)] {
            assert!(map.bytes(at, count).is_err());
        }
        assert!(map.words(4, 2).is_err() && map.words(0, u64::MAX).is_err());

        std::fs::write(&path, []).expect("a file");
        let map = Map::open(&path).expect("a map");
        assert_eq!(
            (map.length(), map.bytes(0, 0).expect("nothing").len()),
            (0, 0)
        );
        assert!(map.bytes(0, 1).is_err());
        assert!(Map::open(folder.path()).is_err());
    }
}
