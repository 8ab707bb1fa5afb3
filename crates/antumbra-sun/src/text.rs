//! Shared parts of readers of text: from a file to numbered lines, from words to numbers.
//!
//! In: a path. Out: lines, numbers. Invariants: no more than 256 MiB are read; `\n`, `\r\n` and a lone `\r` end lines;
//! bytes that are not UTF-8 are read as Latin-1, since they stand in names and comments only.

use std::io::Read as _;
use std::path::Path;

use crate::error::FileError;

/// Most bytes of a text file: a year of weather by the minute has a quarter of them.
const MOST_BYTES: u64 = 256 << 20;

/// Reads a text file.
pub(crate) fn read(file: &Path) -> Result<String, FileError> {
    let unreadable =
        |error: std::io::Error| FileError::whole(file, format!("cannot read it: {error}"));
    let opened = antumbra_files::open(file).map_err(unreadable)?;
    let mut bytes = Vec::new();
    opened
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        let message =
            format!("it has more than the {MOST_BYTES} bytes that are read of a text file");
        return Err(FileError::whole(file, message));
    }
    if bytes.contains(&0) {
        return Err(FileError::whole(
            file,
            "it is no text: expected UTF-8, found zero bytes",
        ));
    }
    Ok(decode(bytes))
}

/// Returns the text of bytes, with lines that end in `\n`.
pub(crate) fn decode(bytes: Vec<u8>) -> String {
    let text = match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => error
            .into_bytes()
            .iter()
            .map(|&byte| char::from(byte))
            .collect(),
    };
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    match text.contains('\r') {
        true => text.replace("\r\n", "\n").replace('\r', "\n"),
        false => text.to_owned(),
    }
}

/// Returns the lines of a text with their numbers, counted from 1; empty ones are left out.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text
        .split('\n')
        .enumerate()
        .map(|(at, line)| (at + 1, line.trim()));
    antumbra_task::checked(numbered).filter(|(_, line)| !line.is_empty())
}

/// Reads a finite decimal number.
pub(crate) fn number(word: &str) -> Option<f64> {
    let is_numeric = |b: &u8| matches!(b, b'0'..=b'9' | b'.' | b'+' | b'-' | b'e' | b'E');
    let word = word.trim();
    let plain = word
        .as_bytes()
        .iter()
        .all(is_numeric)
        .then(|| word.parse::<f64>().ok())?;
    plain.filter(|number| number.is_finite())
}

/// Reads a whole number.
pub(crate) fn whole(word: &str) -> Option<i32> {
    word.trim().parse().ok()
}

/// Returns a word as a message shows it: at most some characters.
pub(crate) fn shown(word: &str) -> String {
    const MOST: usize = 40;
    match word.char_indices().nth(MOST) {
        Some((at, _)) => format!("{}...", &word[..at]),
        None => word.to_owned(),
    }
}

/// Returns the fields of a line of a CSV file. A field may stand in double quotes, doubled ones within.
pub(crate) fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut letters = line.chars().peekable();
    let mut is_quoted = false;
    while let Some(letter) = letters.next() {
        let last = fields.len() - 1;
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => {
                letters.next();
                fields[last].push('"');
            }
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            letter => fields[last].push(letter),
        }
    }
    for field in &mut fields {
        *field = field.trim().to_owned();
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_break_counts_once_and_empty_lines_keep_the_numbers() {
        let text = decode(b"\xef\xbb\xbfa\r\n\r\nb\rc\nd \xf6".to_vec());
        // Latin-1 has no byte order mark: this text is not UTF-8 as a whole.
        let found: Vec<_> = lines(&text).skip(1).collect();
        assert_eq!(found, [(3, "b"), (4, "c"), (5, "d ö")]);
        let marked = decode(b"\xef\xbb\xbfa".to_vec());
        assert_eq!(lines(&marked).collect::<Vec<_>>(), [(1, "a")]);
    }

    #[test]
    fn numbers_are_decimal_and_finite() {
        assert_eq!(number(" -1.5e1 "), Some(-15.0));
        for bad in ["", "nan", "inf", "0x10", "1,5", "1e999", "--1", "1 2"] {
            assert_eq!(number(bad), None, "{bad}");
        }
    }

    #[test]
    fn commas_in_quotes_divide_nothing() {
        assert_eq!(fields(r#"a, "b,""c""",,"#), ["a", r#"b,"c""#, "", ""]);
        assert_eq!(fields(r#""open, end"#), ["open, end"]);
    }
}
