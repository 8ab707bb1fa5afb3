//! Whether a file was written by this project.
//!
//! A file that somebody names may be replaced: that was asked for. A file whose name the program makes (a page in
//! a folder, a layer beside a picture) is replaced only if it is the project's own.

use std::io::{self, Read as _};
use std::path::Path;

use crate::open::open;

/// How far into a file its mark may lie, bytes: behind the head of any format that is written.
const REACH: u64 = 1 << 16;

/// Returns whether a regular file is empty, or has `mark` within its first 64 KiB.
///
/// # Errors
/// The file cannot be read, or the path names no regular file.
pub fn is_own(path: &Path, mark: &str) -> io::Result<bool> {
    let mut head = Vec::new();
    open(path)?.take(REACH).read_to_end(&mut head)?;
    let mark = mark.as_bytes();
    Ok(head.is_empty() || head.windows(mark.len()).any(|window| window == mark))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn files_are_own_by_their_mark_and_not_by_their_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("index.html");
        let far = [vec![b' '; 1 << 16], b"mark".to_vec()].concat();
        for (bytes, expected) in [
            (&b""[..], true),
            (b"mark", true),
            (b"a mark here", true),
            (b"mar", false),
            (b"<html>", false),
            (&far, false),
        ] {
            fs::write(&path, bytes).expect("a file");
            assert_eq!(is_own(&path, "mark").expect("a file"), expected);
        }
        assert!(is_own(folder.path(), "mark").is_err());
    }
}
