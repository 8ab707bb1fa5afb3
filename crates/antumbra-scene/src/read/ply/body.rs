//! The numbers of a PLY body, one after the other.
//!
//! In: the bytes after the header and the type each number has. Out: the number, or a [`Fault`].
//! Invariants: a body never reads past its bytes; every number read or skipped takes at least
//! one of them, so that reading is linear whatever counts the header claims.

use crate::error::{Place, quoted};

use super::{super::text::parse_any_number, header::NumberType};

/// Why there is no number; the place is [`Body::place`].
#[derive(Debug)]
pub(super) enum Fault {
    /// The bytes are used up.
    End,
    /// There is something else, quoted.
    Other(String),
}

/// A stream of numbers.
pub(super) trait Body {
    /// Reads a number of the given type. `float` is rounded to 32 bits also in text, so that the
    /// two forms of a file give the same scene. Not finite where the file says so.
    fn real(&mut self, kind: NumberType) -> Result<f64, Fault>;

    /// Reads an integer of the given integer type.
    fn integer(&mut self, kind: NumberType) -> Result<i64, Fault>;

    /// Steps over `count` numbers without looking at them.
    fn skip(&mut self, kind: NumberType, count: u64) -> Result<(), Fault>;

    /// Checks that an element ends where its last number did.
    fn end_element(&mut self) -> Result<(), Fault>;

    /// Returns the line, or the byte, at which the last number or fault began.
    fn at(&self) -> u32;

    /// Turns what [`Self::at`] returned into a place.
    fn place(at: u32) -> Place;

    /// Returns how few bytes a number may take.
    fn fewest_bytes(&self, kind: NumberType) -> usize;

    /// Returns how many bytes are left.
    fn bytes_left(&self) -> usize;

    /// Returns where anything but white space follows, if it does.
    fn surplus(&mut self) -> Option<u32>;
}

/// A body of words. A new element begins on a new line; one element may take several lines.
pub(super) struct Ascii<'a> {
    rest: &'a [u8],
    /// The line that `rest` begins on.
    line: u32,
    at: u32,
}

impl<'a> Ascii<'a> {
    pub(super) fn new(bytes: &'a [u8], line: u32) -> Self {
        Self {
            rest: bytes,
            line,
            at: line,
        }
    }

    fn skip_white(&mut self) {
        let mut length = 0;
        while let Some(&byte) = self.rest.get(length) {
            let is_break = match byte {
                b'\n' => true,
                b'\r' => self.rest.get(length + 1) != Some(&b'\n'),
                b' ' | b'\t' | b'\x0c' => false,
                _ => break,
            };
            self.line = self.line.saturating_add(u32::from(is_break));
            length += 1;
        }
        self.rest = &self.rest[length..];
        self.at = self.line;
    }

    fn word(&mut self) -> Result<&'a [u8], Fault> {
        self.skip_white();
        let end = self
            .rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            Err(Fault::End)
        } else {
            Ok(word)
        }
    }
}

/// Quotes a word of unknown encoding.
fn other(word: &[u8]) -> Fault {
    // Quoting shortens to 40 characters, none longer than 4 bytes.
    Fault::Other(quoted(&String::from_utf8_lossy(
        &word[..word.len().min(200)],
    )))
}

impl Body for Ascii<'_> {
    fn real(&mut self, kind: NumberType) -> Result<f64, Fault> {
        let word = self.word()?;
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(parse_any_number)
            .ok_or_else(|| other(word))?;
        Ok(match kind {
            NumberType::F32 => f64::from(number as f32),
            _ => number,
        })
    }

    fn integer(&mut self, _: NumberType) -> Result<i64, Fault> {
        let word = self.word()?;
        let text = std::str::from_utf8(word).map_err(|_| other(word))?;
        text.parse().map_err(|_| other(word))
    }

    fn skip(&mut self, _: NumberType, count: u64) -> Result<(), Fault> {
        for _ in 0..count {
            self.word()?;
        }
        Ok(())
    }

    fn end_element(&mut self) -> Result<(), Fault> {
        let blanks = self
            .rest
            .iter()
            .take_while(|byte| matches!(byte, b' ' | b'\t' | b'\x0c'))
            .count();
        self.rest = &self.rest[blanks..];
        match self.rest.first() {
            None | Some(b'\n' | b'\r') => Ok(()),
            Some(_) => Err(other(self.word()?)),
        }
    }

    fn at(&self) -> u32 {
        self.at
    }

    fn place(at: u32) -> Place {
        Place::Line(at)
    }

    /// A digit and the white space before it.
    fn fewest_bytes(&self, _: NumberType) -> usize {
        2
    }

    fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    fn surplus(&mut self) -> Option<u32> {
        self.skip_white();
        (!self.rest.is_empty()).then_some(self.line)
    }
}

/// A body of bytes, in either order.
pub(super) struct Binary<'a, const IS_BIG: bool> {
    bytes: &'a [u8],
    next: usize,
    at: u32,
}

impl<'a, const IS_BIG: bool> Binary<'a, IS_BIG> {
    /// `bytes` is the whole file, for the places; the body begins at `start`.
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self {
            bytes,
            next: start,
            at: start as u32,
        }
    }

    /// Takes the bytes of one number. A file of at most 4 GiB has places below 2^32, but for its
    /// very end, which is then told as one byte less.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.at = u32::try_from(self.next).unwrap_or(u32::MAX);
        let end = self.next.saturating_add(N);
        let bytes = self.bytes.get(self.next..end).ok_or(Fault::End)?;
        self.next = end;
        let mut number = [0; N];
        number.copy_from_slice(bytes);
        if IS_BIG {
            number.reverse();
        }
        Ok(number)
    }
}

impl<const IS_BIG: bool> Body for Binary<'_, IS_BIG> {
    fn real(&mut self, kind: NumberType) -> Result<f64, Fault> {
        Ok(match kind {
            NumberType::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            NumberType::F64 => f64::from_le_bytes(self.take()?),
            // 32 bits fit a 64-bit floating-point number exactly.
            integer => self.integer(integer)? as f64,
        })
    }

    fn integer(&mut self, kind: NumberType) -> Result<i64, Fault> {
        Ok(match kind {
            NumberType::I8 => i8::from_le_bytes(self.take()?).into(),
            NumberType::U8 => u8::from_le_bytes(self.take()?).into(),
            NumberType::I16 => i16::from_le_bytes(self.take()?).into(),
            NumberType::U16 => u16::from_le_bytes(self.take()?).into(),
            NumberType::I32 => i32::from_le_bytes(self.take()?).into(),
            NumberType::U32 => u32::from_le_bytes(self.take()?).into(),
            NumberType::F32 | NumberType::F64 => self.real(kind)? as i64,
        })
    }

    fn skip(&mut self, kind: NumberType, count: u64) -> Result<(), Fault> {
        self.at = u32::try_from(self.next).unwrap_or(u32::MAX);
        let left = (self.bytes.len() - self.next) as u64;
        let length = count.saturating_mul(kind.size() as u64);
        if length > left {
            return Err(Fault::End);
        }
        self.next += length as usize;
        Ok(())
    }

    fn end_element(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn at(&self) -> u32 {
        self.at
    }

    fn place(at: u32) -> Place {
        Place::Byte(at.into())
    }

    fn fewest_bytes(&self, kind: NumberType) -> usize {
        kind.size()
    }

    fn bytes_left(&self) -> usize {
        self.bytes.len() - self.next
    }

    fn surplus(&mut self) -> Option<u32> {
        (self.next < self.bytes.len()).then_some(self.next as u32)
    }
}
