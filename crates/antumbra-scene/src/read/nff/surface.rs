//! NFF's `f`: the surface in force, with the liberties that files take.
//!
//! In: the words after `f`. Out: the material of the objects that follow. Invariant: a number that
//! is garbled is an error, never taken for the name of a texture or for a short `f`.

use crate::{
    defaults::nff_material,
    error::{Place, ReadError},
};

use super::{
    super::text::{begins_like_number, parse_number},
    Reader, is_keyword,
    lexer::Word,
};

impl<'a> Reader<'a> {
    /// `f`: eight numbers; dialects leave some out or add the name of a texture.
    pub(super) fn read_surface(&mut self) -> Result<(), ReadError> {
        const EXPECTED: &str = "8 numbers (red green blue Kd Ks shine T ior)";
        let mut numbers = Vec::with_capacity(8);
        let mut line = self.lexer.line();
        while numbers.len() < 8 {
            let Some(word) = self.lexer.peek() else { break };
            let Some(number) = parse_number(word.text) else {
                break;
            };
            numbers.push(number);
            line = word.line;
            self.lexer.next();
        }
        // Whatever follows on the same line and begins no entity is the name of a texture.
        if let Some(name) = self.texture_name(line, numbers.len()) {
            self.lexer.take(name);
            let message = "the texture named after `f` is not read";
            self.warnings.add(Place::Line(name.line), message);
        }
        if numbers.len() < 8 {
            // Where a number is garbled, or next to nothing is there, guessing would hide it.
            let next = self.lexer.peek();
            let is_garbled = next.is_some_and(|w| begins_like_number(w.text) || w.line == line)
                && self
                    .lexer
                    .peek_keyword()
                    .is_none_or(|k| !is_keyword(k.text));
            if numbers.len() < 3 || is_garbled {
                return Err(self.expected(next, "f", EXPECTED));
            }
            let message = format!(
                "`f` with {} numbers instead of 8: the rest is taken from Kd 1, Ks 0, shine 1, T 0, ior 1",
                numbers.len()
            );
            self.warnings.add(Place::Line(line), message);
            const DEFAULTS: [f64; 8] = [0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
            numbers.extend_from_slice(&DEFAULTS[numbers.len()..]);
        }
        let mut numbers: [f64; 8] = std::array::from_fn(|i| numbers[i]);
        self.clamp_negative(line, "f", &mut numbers[..7]);
        let [.., transmittance, ior] = numbers;
        if transmittance > 0.0 && ior <= 0.0 {
            let message =
                "`f` transmits light, but its index of refraction is not positive: 1 is used";
            self.warnings.add(Place::Line(line), message);
        }
        let material = nff_material(numbers);
        if !material.diffuse.is_finite() {
            return Err(self.invalid(
                line,
                "f",
                "the color times Kd overflows",
                "colors are 0 to 1",
            ));
        }
        self.surface = (material, None);
        Ok(())
    }

    /// Returns the word that must be a texture's name after `count` numbers of `f`, if one is.
    fn texture_name(&mut self, line: u32, count: usize) -> Option<Word<'a>> {
        let word = self.lexer.peek().filter(|word| word.line == line)?;
        let keyword = self.lexer.peek_keyword()?;
        if is_keyword(keyword.text) || parse_number(word.text).is_some() {
            return None;
        }
        // After fewer numbers a garbled one is more likely, unless it ends the line.
        let mut after = self.lexer.clone();
        after.take(word);
        let ends_line = after.peek().is_none_or(|next| next.line != line);
        (count == 8 || (count >= 3 && !begins_like_number(word.text) && ends_line)).then_some(word)
    }
}
