//! What text formats share: from bytes to text, from words to numbers.
//!
//! In: the bytes of a file; single words. Out: text, finite numbers, or what is wrong.
//! Invariant: the locale plays no part; `nan`, `inf` and hexadecimal are no numbers.

use std::path::Path;

use crate::error::{Place, ReadError, ReadErrorKind};

use super::MAX_FILE_BYTES;

/// The largest magnitude of a coordinate, 2^100: EXACTNESS.md, "Degenerate input".
pub(super) const LARGEST_COORDINATE: f64 = (1_u128 << 100) as f64;

/// Checks what every format asks of the bytes of a file.
///
/// # Errors
/// They are too many, or a git-lfs pointer.
pub(super) fn check_bytes(file: &Path, bytes: &[u8]) -> Result<(), ReadError> {
    let kind = if bytes.len() as u64 > MAX_FILE_BYTES {
        ReadErrorKind::TooLarge {
            bytes: bytes.len() as u64,
            limit: MAX_FILE_BYTES,
        }
    } else if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        ReadErrorKind::LfsPointer
    } else {
        return Ok(());
    };
    Err(ReadError {
        file: file.to_path_buf(),
        place: Place::Whole,
        kind,
    })
}

/// Returns the text of a file, without a byte order mark.
///
/// # Errors
/// The bytes are too many, a git-lfs pointer, binary data, or not UTF-8.
pub(super) fn decode<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, ReadError> {
    check_bytes(file, bytes)?;
    let fail = |place, kind| {
        Err(ReadError {
            file: file.to_path_buf(),
            place,
            kind,
        })
    };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return fail(Place::Byte(0), ReadErrorKind::NotText { found: "UTF-16" });
    }
    if let Some(at) = bytes.iter().position(|&b| b == 0) {
        return fail(
            Place::Byte(at as u64),
            ReadErrorKind::NotText {
                found: "binary data",
            },
        );
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(error) => {
            let line = 1 + line_breaks(&bytes[..error.valid_up_to()]);
            fail(
                Place::Line(line),
                ReadErrorKind::NotText {
                    found: "a byte that is not UTF-8",
                },
            )
        }
    }
}

/// Counts line breaks: `\n`, `\r\n` or a lone `\r`.
pub(super) fn line_breaks(bytes: &[u8]) -> u32 {
    let mut count = 0_u32;
    let mut previous = 0;
    for &byte in bytes {
        if byte == b'\r' || (byte == b'\n' && previous != b'\r') {
            count = count.saturating_add(1);
        }
        previous = byte;
    }
    count
}

/// Reads a whole word as a decimal number, as C's `printf("%g")` and its like write them.
/// Returns `None` for anything else, also for numbers too large for an `f64`.
pub(super) fn parse_number(word: &str) -> Option<f64> {
    // The character set keeps out the `inf`, `nan` and `infinity` that Rust would read.
    let is_numeric = |b: &u8| matches!(b, b'0'..=b'9' | b'.' | b'+' | b'-' | b'e' | b'E');
    if !word.as_bytes().iter().all(is_numeric) {
        return None;
    }
    word.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Returns whether a word begins like a number: with a digit, a sign or a decimal point.
pub(super) fn begins_like_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_what_printf_writes() {
        for (word, number) in [
            ("1", 1.0),
            ("-4.44089e-16", -4.44089e-16),
            ("1e+06", 1e6),
            (".5", 0.5),
            ("5.", 5.0),
            ("+5", 5.0),
            ("1e-05", 1e-5),
            ("1.0e+005", 1e5),
            ("1E2", 100.0),
        ] {
            assert_eq!(parse_number(word), Some(number), "{word}");
        }
        assert!(parse_number("-0").unwrap().is_sign_negative());
        for word in [
            "",
            "nan",
            "inf",
            "-inf",
            "infinity",
            "0x10",
            "1,5",
            "1e",
            "e5",
            ".",
            "-",
            "1e999",
            "0.0780.3610.753",
            "1-2",
            "1_000",
            "1f",
            "--1",
            "NaN",
            "٣",
        ] {
            assert_eq!(parse_number(word), None, "{word}");
        }
    }

    #[test]
    fn text_that_is_none_is_refused_by_name() {
        let refusal = |bytes: &[u8]| decode(Path::new("a.nff"), bytes).unwrap_err().to_string();
        assert!(
            refusal(b"version https://git-lfs.github.com/spec/v1\noid").contains("git lfs pull")
        );
        assert!(
            refusal(b"s 0 0\0 0").starts_with("a.nff: byte 5: expected UTF-8 text, found binary")
        );
        assert!(
            refusal(b"s 0\r\n# caf\xe9\n")
                .starts_with("a.nff:2: expected UTF-8 text, found a byte")
        );
        assert!(refusal(b"\xff\xfes\0").contains("found UTF-16"));
        assert_eq!(decode(Path::new("a"), b"\xef\xbb\xbfs 0").unwrap(), "s 0");
    }

    #[test]
    fn every_kind_of_line_break_counts_once() {
        assert_eq!(line_breaks(b"a\nb\r\nc\rd\n\n"), 5);
    }
}
