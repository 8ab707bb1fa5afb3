//! OBJ and MTL as lines of words.
//!
//! In: text. Out: statements, each a keyword with its words and its line number. Invariant:
//! a line that ends in `\` goes on in the next one, a comment does not; `#` begins a comment
//! only where it begins a word, since names hold it too.

use std::borrow::Cow;

use antumbra_task::check;

/// One statement: a line, or several joined by `\`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    /// Its text without comment, line breaks and white space around it; not empty.
    text: Cow<'a, str>,
    /// The line it begins on, counted from 1.
    pub(super) line: u32,
}

impl Statement<'_> {
    /// Returns the first word.
    pub(super) fn keyword(&self) -> &str {
        self.words().next().unwrap_or_default()
    }

    /// Returns all words, the keyword first.
    fn words(&self) -> impl Iterator<Item = &str> {
        self.text.split_ascii_whitespace()
    }

    /// Returns the words after the keyword.
    pub(super) fn arguments(&self) -> impl Iterator<Item = &str> {
        self.words().skip(1)
    }

    /// Returns everything after the keyword as one name, white space inside included.
    pub(super) fn name(&self) -> &str {
        self.text[self.keyword().len()..].trim_ascii()
    }
}

/// Walks over the statements of a text.
#[derive(Clone, Debug)]
pub(super) struct Statements<'a> {
    rest: &'a str,
    line: u32,
}

impl<'a> Statements<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            rest: text,
            line: 0,
        }
    }

    /// Takes a line without its break: `\n`, `\r\n` or a lone `\r`.
    fn next_line(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        check();
        self.line = self.line.saturating_add(1);
        let bytes = self.rest.as_bytes();
        let end = bytes
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(bytes.len());
        let line = &self.rest[..end];
        let break_length = if bytes[end..].starts_with(b"\r\n") {
            2
        } else {
            1
        };
        self.rest = self.rest.get(end + break_length..).unwrap_or_default();
        Some(line)
    }

    /// Joins the lines that follow a `\` to the first, until one does not end in `\`.
    fn continued(&mut self, first: &str) -> String {
        let mut joined = String::from(first);
        while let Some(line) = self.next_line() {
            let line = line.trim_ascii();
            joined.push(' ');
            let Some(part) = line.strip_suffix('\\') else {
                joined.push_str(line);
                break;
            };
            joined.push_str(part);
        }
        joined
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        loop {
            let first = self.next_line()?.trim_ascii();
            let line = self.line;
            if first.is_empty() || first.starts_with('#') {
                continue;
            }
            let text = match first.strip_suffix('\\') {
                None => Cow::Borrowed(without_comment(first)),
                Some(part) => Cow::Owned(without_comment(&self.continued(part)).to_owned()),
            };
            if !text.is_empty() {
                return Some(Statement { text, line });
            }
        }
    }
}

/// Cuts a comment off: from a `#` at the beginning of a word.
fn without_comment(text: &str) -> &str {
    let bytes = text.as_bytes();
    let begins_word = |at: usize| at == 0 || bytes[at - 1].is_ascii_whitespace();
    let comment = (0..bytes.len()).find(|&at| bytes[at] == b'#' && begins_word(at));
    text[..comment.unwrap_or(text.len())].trim_ascii()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(text: &str) -> Vec<(u32, String)> {
        Statements::new(text)
            .map(|s| (s.line, s.text.into_owned()))
            .collect()
    }

    #[test]
    fn lines_comments_and_continuations() {
        let text = "# C:\\x\\\r\n v 1 2 3 # x\r\n\r\nf 1 2 \\\r\n3 \\\n 4\nusemtl a#1 b\rg x\\";
        let expected = [
            (2, "v 1 2 3"),
            (4, "f 1 2  3  4"),
            (7, "usemtl a#1 b"),
            (8, "g x"),
        ];
        assert_eq!(
            statements(text),
            expected.map(|(line, s)| (line, s.to_owned()))
        );
        assert_eq!(statements(""), []);
        assert_eq!(statements("\\\n\\\n"), []);
    }

    #[test]
    fn a_name_is_the_rest_of_the_line() {
        let statement = Statements::new("g  back  cube # x").next().unwrap();
        assert_eq!(statement.keyword(), "g");
        assert_eq!(statement.name(), "back  cube");
        assert_eq!(statement.arguments().collect::<Vec<_>>(), ["back", "cube"]);
    }
}
