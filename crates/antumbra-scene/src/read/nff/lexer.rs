//! NFF as a stream of words.
//!
//! In: text. Out: words with their line numbers, comments and white space gone. Invariant: a
//! number ends where its word ends; a keyword may be glued to the number after it.

use super::super::text::begins_like_number;

/// One word of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word<'a> {
    /// The word itself, never empty.
    pub(super) text: &'a str,
    /// Its line, counted from 1.
    pub(super) line: u32,
}

/// Walks over the words of a text.
#[derive(Clone, Debug)]
pub(super) struct Lexer<'a> {
    text: &'a str,
    /// Where the next word is looked for; always at a character boundary.
    at: usize,
    /// The line of `at`.
    line: u32,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            text,
            at: 0,
            line: 1,
        }
    }

    /// Returns how many bytes are not read yet.
    pub(super) fn bytes_left(&self) -> usize {
        self.text.len() - self.at
    }

    /// Returns the line reached: that of the last word, or of the end of the file once
    /// [`Self::peek`] found none.
    pub(super) fn line(&self) -> u32 {
        self.line
    }

    /// Returns the next word without taking it.
    pub(super) fn peek(&mut self) -> Option<Word<'a>> {
        self.skip_blanks();
        let rest = &self.text[self.at..];
        let ends = |b: u8| is_blank(b) || b == b'#';
        let end = rest.bytes().position(ends).unwrap_or(rest.len());
        (end > 0).then(|| Word {
            text: &rest[..end],
            line: self.line,
        })
    }

    /// Takes the next word.
    pub(super) fn next(&mut self) -> Option<Word<'a>> {
        let word = self.peek()?;
        self.at += word.text.len();
        Some(word)
    }

    /// Returns the next word without taking it, up to a number glued to it: `s` for `s0`.
    pub(super) fn peek_keyword(&mut self) -> Option<Word<'a>> {
        let mut word = self.peek()?;
        let letters = word
            .text
            .bytes()
            .take_while(u8::is_ascii_alphabetic)
            .count();
        if letters > 0 && begins_like_number(&word.text[letters..]) {
            word.text = &word.text[..letters];
        }
        Some(word)
    }

    /// Takes a word that was peeked at, whole or up to a glued number.
    pub(super) fn take(&mut self, word: Word<'a>) {
        self.at += word.text.len();
    }

    /// Skips what is left of the line, without its break.
    pub(super) fn skip_line(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest.iter().position(|&b| is_break(b)).unwrap_or(rest.len());
    }

    /// Moves to the next byte that belongs to a word.
    fn skip_blanks(&mut self) {
        let bytes = self.text.as_bytes();
        while let Some(&byte) = bytes.get(self.at) {
            if byte == b'#' {
                self.skip_line();
                continue;
            }
            if !is_blank(byte) {
                break;
            }
            // `\r\n` is one break, counted at its `\n`.
            let is_first_half = byte == b'\r' && bytes.get(self.at + 1) == Some(&b'\n');
            if is_break(byte) && !is_first_half {
                self.line = self.line.saturating_add(1);
            }
            self.at += 1;
        }
    }
}

/// Space, tab, line feed, vertical tab, form feed, carriage return: C's `isspace`.
fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | 0x09..=0x0d)
}

fn is_break(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(String, u32)> {
        let mut lexer = Lexer::new(text);
        std::iter::from_fn(|| lexer.next())
            .map(|w| (w.text.to_owned(), w.line))
            .collect()
    }

    #[test]
    fn comments_and_all_line_breaks_separate() {
        let found = words("s 1#x\r\n# y\n2\r3\x0c4\t5 # end");
        let expected = [("s", 1), ("1", 1), ("2", 3), ("3", 4), ("4", 4), ("5", 4)];
        assert_eq!(found, expected.map(|(w, l)| (w.to_owned(), l)));
    }

    #[test]
    fn keywords_may_be_glued_to_numbers() {
        for (text, keyword) in [
            ("s0 0", "s"),
            ("pp3", "pp"),
            ("c-1", "c"),
            ("l.5", "l"),
            ("angle45", "angle"),
        ] {
            assert_eq!(Lexer::new(text).peek_keyword().unwrap().text, keyword);
        }
        for text in ["s", "from", "3", "a_1", "é1"] {
            assert_eq!(Lexer::new(text).peek_keyword().unwrap().text, text);
        }
    }
}
