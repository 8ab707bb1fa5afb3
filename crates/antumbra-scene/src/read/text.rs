//! What text formats share: from bytes to text, from words to numbers.
//!
//! In: the bytes of a file; single words. Out: text, finite numbers, or what is wrong.
//! Invariant: the locale plays no part; hexadecimal is no number; `nan` and `inf` are numbers only to
//! those who ask for them.

use std::{borrow::Cow, path::Path};

use antumbra_geometry::DVec3;

use crate::{
    error::{Place, ReadError, ReadErrorKind},
    warning::WarningLog,
};

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

/// Returns the text of a file, without a byte order mark. Bytes that are not UTF-8 stand in names and
/// comments: each is read as the character of that number (Latin-1), so that equal names stay equal,
/// with a warning.
///
/// # Errors
/// The bytes are too many, a git-lfs pointer or binary data.
pub(super) fn decode<'a>(
    file: &Path,
    bytes: &'a [u8],
    warnings: &mut WarningLog,
) -> Result<Cow<'a, str>, ReadError> {
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
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return Ok(Cow::Borrowed(text)),
        Err(error) => error,
    };
    let line = 1 + line_breaks(&bytes[..error.valid_up_to()]);
    let message = "the text is not all UTF-8: other bytes are read as Latin-1";
    warnings.add(Place::Line(line), message);
    let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
    let mut follows_invalid = false;
    for chunk in bytes.utf8_chunks() {
        let mut valid = chunk.valid();
        // In Shift-JIS, the second byte of a character may be that of `\`. It does not continue a line.
        if follows_invalid
            && let Some(rest) = valid.strip_prefix('\\')
            && (rest.is_empty() || rest.starts_with(['\n', '\r']))
        {
            text.push('\u{ff3c}');
            valid = rest;
        }
        text.push_str(valid);
        text.extend(chunk.invalid().iter().map(|&byte| char::from(byte)));
        follows_invalid = !chunk.invalid().is_empty();
    }
    Ok(Cow::Owned(text))
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

/// Reads a number as [`parse_number`] does, or what stands for one that is not finite (`nan`, `inf`,
/// `-1.#IND`, a number too large for an `f64`), which is then NaN or infinite.
pub(super) fn parse_any_number(word: &str) -> Option<f64> {
    parse_number(word).or_else(|| {
        let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
        let begins = |name: &str| {
            let head = unsigned.get(..name.len());
            head.is_some_and(|head| head.eq_ignore_ascii_case(name))
        };
        if ["nan", "1.#ind", "1.#qnan", "1.#snan"]
            .into_iter()
            .any(begins)
        {
            return Some(f64::NAN);
        }
        let is_numeric = |b: u8| matches!(b, b'0'..=b'9' | b'.' | b'+' | b'-' | b'e' | b'E');
        let is_too_large = word.bytes().all(is_numeric) && word.parse::<f64>().is_ok();
        (is_too_large || begins("inf") || begins("1.#inf")).then_some(f64::INFINITY)
    })
}

/// What is to be done about a face with corners at these places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Corners {
    /// All are places.
    Fine,
    /// One is not finite.
    NotFinite,
    /// A coordinate is beyond 2^100.
    TooLarge(f64),
}

impl Corners {
    pub(super) fn of(places: impl Iterator<Item = DVec3>) -> Self {
        let mut found = Self::Fine;
        for place in places {
            if !place.is_finite() {
                return Self::NotFinite;
            }
            if place.abs().max_element() > LARGEST_COORDINATE {
                let coordinates = place.to_array().into_iter();
                let largest =
                    coordinates.fold(0.0, |m: f64, x| if x.abs() > m.abs() { x } else { m });
                found = Self::TooLarge(largest);
            }
        }
        found
    }

    /// What is said about a face that is dropped.
    pub(super) const NOT_FINITE: &str = "a face has a corner that is not finite: dropped";

    /// Says what is wrong with a coordinate.
    pub(super) fn too_large(coordinate: f64) -> String {
        format!("{coordinate:e} exceeds 2^100 (1.27e30), the largest coordinate")
    }
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

    fn decoded(bytes: &[u8]) -> (Result<String, String>, Vec<String>) {
        let mut warnings = WarningLog::new(Path::new("a.nff"));
        let text = decode(Path::new("a.nff"), bytes, &mut warnings);
        let text = text.map(Cow::into_owned).map_err(|error| error.to_string());
        (
            text,
            warnings.finish().iter().map(ToString::to_string).collect(),
        )
    }

    #[test]
    fn text_that_is_none_is_refused_by_name() {
        let refusal = |bytes: &[u8]| decoded(bytes).0.unwrap_err();
        assert!(
            refusal(b"version https://git-lfs.github.com/spec/v1\noid").contains("git lfs pull")
        );
        assert!(
            refusal(b"s 0 0\0 0").starts_with("a.nff: byte 5: expected UTF-8 text, found binary")
        );
        assert!(refusal(b"\xff\xfes\0").contains("found UTF-16"));
        assert_eq!(decoded(b"\xef\xbb\xbfs 0").0.unwrap(), "s 0");
    }

    #[test]
    fn bytes_of_other_encodings_are_kept_apart_and_said_once() {
        let warning = "the text is not all UTF-8: other bytes are read as Latin-1";
        let (text, warnings) = decoded(b"s 0\r\n# caf\xe9\n\xe9");
        assert_eq!(text.unwrap(), "s 0\r\n# caf\u{e9}\n\u{e9}");
        assert_eq!(warnings, [format!("a.nff:2: {warning}")]);
        // The Shift-JIS character 95 5C ends a name; the line does not go on.
        let (text, _) = decoded(b"usemtl \x95\\\nf 1 2 3 \\\n4");
        assert_eq!(text.unwrap(), "usemtl \u{95}\u{ff3c}\nf 1 2 3 \\\n4");
    }

    #[test]
    fn numbers_that_are_not_finite_are_told_from_garbage() {
        for word in [
            "nan",
            "NaN",
            "-nan(ind)",
            "inf",
            "-Infinity",
            "1e999",
            "-1.#IND",
            "1.#QNAN",
        ] {
            assert!(
                parse_any_number(word).is_some_and(|n| !n.is_finite()),
                "{word}"
            );
        }
        for word in ["", "x", "1.0.0", "--1", "0x10", "1f", "\u{e9}"] {
            assert_eq!(parse_any_number(word), None, "{word}");
        }
        assert_eq!(parse_any_number("-2.5"), Some(-2.5));
    }

    #[test]
    fn every_kind_of_line_break_counts_once() {
        assert_eq!(line_breaks(b"a\nb\r\nc\rd\n\n"), 5);
    }
}
