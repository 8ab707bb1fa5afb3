//! Files are whole or the ones before, and nothing but a regular file is ever replaced.

use std::fs;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use antumbra_files::{Writing, write, write_bytes};

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
    let mut names: Vec<String> = entries
        .map(|entry| name(entry).to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    (folder, path)
}

fn put(path: &Path, fill: impl FnOnce(&mut Writing<'_>) -> io::Result<()>) -> io::Result<()> {
    write(path, |error| error, fill)
}

#[test]
fn what_fails_midway_leaves_the_file_before() {
    let (folder, path) = folder();
    let fill = |first: u8| {
        move |file: &mut Writing<'_>| {
            file.seek(SeekFrom::Start(3))?;
            file.write_all(&[first, 9])?;
            file.rewind()?;
            file.write_all(b"abc")
        }
    };
    put(&path, fill(7)).expect("a file");
    let before = fs::read(&path).expect("a file");
    assert_eq!(before, b"abc\x07\x09");

    for fail_after in 0..3 {
        let failed = put(&path, |file| {
            let mut steps = 0;
            let mut step = || {
                steps += 1;
                match steps > fail_after {
                    true => Err(io::Error::other("the disk is full")),
                    false => Ok(()),
                }
            };
            step()?;
            file.seek(SeekFrom::Start(3))?;
            step()?;
            file.write_all(&[1; 100_000])?;
            step()
        });
        let error = failed.expect_err("it failed").to_string();
        assert_eq!(error, "the disk is full");
        assert_eq!(fs::read(&path).expect("a file"), before);
        assert_eq!(names(folder.path()), ["file"]);
    }
    // Who reads goes on reading what was there.
    let mut reader = fs::File::open(&path).expect("a file");
    put(&path, fill(8)).expect("a file");
    let mut read = Vec::new();
    reader.read_to_end(&mut read).expect("a file");
    assert_eq!(read, before);
    assert_eq!(fs::read(&path).expect("a file")[3], 8);
    assert_eq!(names(folder.path()), ["file"]);
}

#[test]
fn a_panic_midway_leaves_nothing() {
    let (folder, path) = folder();
    let panicked = std::panic::catch_unwind(|| put(&path, |_| panic!("midway")));
    assert!(panicked.is_err());
    assert_eq!(names(folder.path()), [""; 0]);
    write_bytes(&path, b"1").expect("the next one");
}

#[test]
fn what_cannot_be_written_is_said() {
    let (folder, path) = folder();
    let said = |path: &Path| {
        let error = write_bytes(path, b"").expect_err("it is refused");
        error.to_string()
    };
    // Of the temporary file nobody has heard.
    let missing = said(&folder.path().join("no/file"));
    assert!(
        !missing.contains(".antumbra-") && !missing.contains("at path"),
        "{missing}"
    );
    // A folder is in the way.
    fs::create_dir_all(folder.path().join("taken/within")).expect("a folder");
    assert_eq!(said(&folder.path().join("taken")), "it is a folder");
    assert_eq!(said(Path::new("/")), "it names no file");
    assert_eq!(names(folder.path()), ["taken"]);
    // A file is where a folder is due.
    fs::write(&path, "1").expect("a file");
    assert!(write_bytes(&path.join("inner"), b"").is_err());
}

#[test]
fn a_protected_file_is_not_replaced() {
    let (folder, path) = folder();
    fs::write(&path, "mine").expect("a file");
    let mut permissions = fs::metadata(&path).expect("a file").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).expect("a file");
    let error = write_bytes(&path, b"other").expect_err("it is refused");
    assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
    assert_eq!(fs::read(&path).expect("a file"), b"mine");
    assert_eq!(names(folder.path()), ["file"]);
}

#[test]
fn names_may_be_as_long_as_the_system_has_them() {
    let (folder, _) = folder();
    for length in [1, 241, 242, 254, 255] {
        let name = "n".repeat(length);
        for content in [b"1", b"2"] {
            let path = folder.path().join(&name);
            write_bytes(&path, content).unwrap_or_else(|error| panic!("{length}: {error}"));
            assert_eq!(fs::read(&path).expect("a file"), content);
        }
    }
    assert_eq!(names(folder.path()).len(), 5);
    assert!(write_bytes(&folder.path().join("n".repeat(256)), b"").is_err());
}

#[test]
fn many_threads_write_one_file_and_it_is_one_of_theirs() {
    let (folder, path) = folder();
    std::thread::scope(|scope| {
        for thread in 0..8_u8 {
            let path = &path;
            scope.spawn(move || {
                for _ in 0..20 {
                    write_bytes(path, &[thread; 10_000]).expect("a file");
                }
            });
        }
    });
    let found = fs::read(&path).expect("a file");
    assert!(found.len() == 10_000 && found.iter().all(|&byte| byte == found[0]));
    assert_eq!(names(folder.path()), ["file"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _, symlink};
    use std::process::Command;
    use std::time::{Duration, Instant};

    fn pipe(path: &Path) {
        let made = Command::new("mkfifo").arg(path).status();
        assert!(made.expect("mkfifo").success());
    }

    #[test]
    fn a_pipe_is_written_into_once_somebody_reads() {
        let (folder, path) = folder();
        pipe(&path);
        let reader = {
            let path = path.clone();
            std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(100));
                fs::read(path).expect("a pipe")
            })
        };
        let long = vec![7; 1_000_000];
        write_bytes(&path, &long).expect("a pipe");
        assert!(reader.join().expect("a reader") == long);
        let found = fs::symlink_metadata(&path).expect("a pipe").file_type();
        assert!(found.is_fifo());
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_pipe_that_nobody_reads_is_an_error() {
        let (_folder, path) = folder();
        pipe(&path);
        let begin = Instant::now();
        let error = write_bytes(&path, b"1").expect_err("nobody reads");
        assert!(error.to_string().contains("nobody reads"), "{error}");
        assert!(begin.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn a_device_stays_a_device() {
        let before = fs::metadata("/dev/null").expect("a device");
        write_bytes(Path::new("/dev/null"), b"1").expect("a device");
        let after = fs::symlink_metadata("/dev/null").expect("a device");
        assert!(after.file_type().is_char_device());
        assert_eq!(before.ino(), after.ino());
        if Path::new("/dev/full").exists() {
            assert!(write_bytes(Path::new("/dev/full"), b"1").is_err());
        }
    }

    #[test]
    fn a_link_is_neither_replaced_nor_followed() {
        let (folder, link) = folder();
        let target = folder.path().join("target");
        fs::write(&target, "theirs").expect("a file");
        symlink("target", &link).expect("a link");
        let said = write_bytes(&link, b"1").expect_err("a link").to_string();
        assert!(said.contains("symbolic link to target"), "{said}");
        assert_eq!(fs::read(&target).expect("a file"), b"theirs");
        // Nor one that leads nowhere.
        fs::remove_file(&target).expect("a file");
        assert!(write_bytes(&link, b"1").is_err());
        assert_eq!(names(folder.path()), ["file"]);
        // A link to a device is that device.
        let null = folder.path().join("null");
        symlink("/dev/null", &null).expect("a link");
        write_bytes(&null, b"1").expect("a device");
        assert!(fs::symlink_metadata(&null).expect("a link").is_symlink());
    }

    #[test]
    fn a_file_has_the_permissions_of_the_one_before_and_else_the_usual_ones() {
        let (_folder, path) = folder();
        let usual = path.with_file_name("usual");
        fs::write(&usual, "").expect("a file");
        let mode = |path: &Path| fs::metadata(path).expect("a file").permissions().mode();
        write_bytes(&path, b"1").expect("a file");
        assert_eq!(mode(&path), mode(&usual));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("a file");
        write_bytes(&path, b"2").expect("a file");
        assert_eq!(mode(&path) & 0o777, 0o640);
    }
}
