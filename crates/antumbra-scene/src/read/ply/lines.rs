//! The header of a PLY file as lines of words.
//!
//! In: the bytes of a file. Out: its lines, numbered from 1, and their words. Invariant: what is
//! left after `end_header` begins with the first byte of the body.

/// The words of a line.
pub(super) struct Words<'a>(&'a [u8]);

impl<'a> Words<'a> {
    pub(super) fn of(line: &'a [u8]) -> Self {
        Self(line)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.0.trim_ascii_start();
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.0 = rest;
        (!word.is_empty()).then_some(word)
    }
}

/// The lines of a header. Which line break it uses is decided by the first, so that a binary
/// body after a lone `\r` may begin with the byte of `\n`.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    line: u32,
    is_lone_return: bool,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let end = bytes.iter().position(|&b| b == b'\n' || b == b'\r');
        let is_lone_return =
            end.is_some_and(|at| bytes[at] == b'\r' && bytes.get(at + 1) != Some(&b'\n'));
        Self {
            rest: bytes,
            line: 0,
            is_lone_return,
        }
    }

    /// Returns how many bytes come after the lines taken so far.
    pub(super) fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    /// Returns the number of the line taken last, from 1.
    pub(super) fn number(&self) -> u32 {
        self.line
    }

    /// Takes a line, without its break.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.line = self.line.saturating_add(1);
        let mark = if self.is_lone_return { b'\r' } else { b'\n' };
        let end = self.rest.iter().position(|&b| b == mark);
        let line = &self.rest[..end.unwrap_or(self.rest.len())];
        self.rest = end.map_or(&[], |end| &self.rest[end + 1..]);
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}
