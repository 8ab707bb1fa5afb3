//! The pictures that MTL names: `map_Kd`, `map_d`, `bump` and `norm`, with their options.
//!
//! In: what follows the keyword. Out: the name, and what the options do. Invariant: a name may hold
//! blanks and backslashes; options that are not used are stepped over with their arguments.

use super::super::text::{LARGEST_COORDINATE, parse_number};

/// The pictures of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::read) struct Maps {
    /// Where the library is, up to the last `/`: pictures are looked for there first.
    pub(in crate::read) folder: String,
    /// `map_Kd`.
    pub(in crate::read) color: Option<Map>,
    /// `map_d`.
    pub(in crate::read) alpha: Option<Map>,
    /// `bump`, `map_Bump`, or `norm`.
    pub(in crate::read) relief: Option<Relief>,
}

/// A picture of a relief.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::read) struct Relief {
    pub(in crate::read) map: Map,
    /// Whether the library says that it is one of normals.
    pub(in crate::read) is_normals: bool,
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::read) struct Map {
    /// As the library gives it.
    pub(in crate::read) name: String,
    /// `-s` and `-o`.
    pub(in crate::read) place: MapPlace,
    /// `-clamp on`.
    pub(in crate::read) is_clamped: bool,
    /// `-imfchan`: r, g, b, m (alpha), l or z (luminance).
    pub(in crate::read) channel: Option<u8>,
    /// `-mm`: what is added to values, after they are multiplied.
    pub(in crate::read) base_and_gain: [f64; 2],
    /// `-bm`.
    pub(in crate::read) multiplier: f64,
}

/// How texture coordinates are moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::read) struct MapPlace {
    scale: [f64; 2],
    offset: [f64; 2],
}

impl Default for MapPlace {
    fn default() -> Self {
        Self {
            scale: [1.0; 2],
            offset: [0.0; 2],
        }
    }
}

impl MapPlace {
    /// Returns the place in the picture, v down as textures have it.
    pub(in crate::read) fn of(&self, uv: [f64; 2]) -> [f64; 2] {
        let [u, v] = [0, 1].map(|i| {
            let moved = self.offset[i] + self.scale[i] * uv[i];
            // Numbers of any size meet here; what cannot be a place counts as the corner.
            if moved.abs() <= LARGEST_COORDINATE {
                moved
            } else {
                0.0
            }
        });
        [u, 1.0 - v]
    }
}

impl Maps {
    /// Returns how coordinates are moved: as the colors say, or else the holes, or else the relief.
    pub(in crate::read) fn place(&self) -> MapPlace {
        let relief = || self.relief.as_ref().map(|relief| &relief.map);
        let map = self.color.as_ref().or(self.alpha.as_ref()).or_else(relief);
        map.map_or_else(MapPlace::default, |map| map.place)
    }
}

/// Reads options and a name; `None` without a name.
pub(in crate::read) fn parse_map(text: &str) -> Option<Map> {
    let mut map = Map {
        name: String::new(),
        place: MapPlace::default(),
        is_clamped: false,
        channel: None,
        base_and_gain: [0.0, 1.0],
        multiplier: 1.0,
    };
    let mut multiplier = [1.0; 2];
    let mut rest = text.trim_ascii();
    while rest.starts_with('-') {
        let (option, after) = split_word(rest);
        rest = match &*option.to_ascii_lowercase() {
            "-o" => numbers(after, &mut map.place.offset, 3),
            "-s" => numbers(after, &mut map.place.scale, 3),
            "-t" => numbers(after, &mut [0.0; 2], 3),
            "-mm" => numbers(after, &mut map.base_and_gain, 2),
            "-bm" => numbers(after, &mut multiplier, 1),
            "-boost" | "-texres" => numbers(after, &mut [0.0; 2], 1),
            "-clamp" => {
                let (word, after) = split_word(after);
                map.is_clamped = word.eq_ignore_ascii_case("on");
                after
            }
            "-imfchan" => {
                let (word, after) = split_word(after);
                map.channel = word.bytes().next();
                after
            }
            "-blendu" | "-blendv" | "-cc" | "-type" => split_word(after).1,
            // A name that begins so.
            _ => break,
        };
    }
    let unquoted = rest
        .strip_prefix('"')
        .and_then(|rest| rest.strip_suffix('"'));
    map.multiplier = multiplier[0];
    map.name = unquoted.unwrap_or(rest).to_owned();
    (!map.name.is_empty()).then_some(map)
}

/// Takes up to `most` numbers, of which the first are kept. The word that is left last is a name, even
/// if it looks like a number.
fn numbers<'a>(text: &'a str, kept: &mut [f64; 2], most: usize) -> &'a str {
    let mut rest = text;
    for index in 0..most {
        let (word, after) = split_word(rest);
        let Some(number) = parse_number(word).filter(|_| !after.is_empty()) else {
            break;
        };
        if let Some(kept) = kept.get_mut(index) {
            *kept = number;
        }
        rest = after;
    }
    rest
}

/// Splits the first word off.
fn split_word(text: &str) -> (&str, &str) {
    let text = text.trim_ascii();
    let end = text
        .find(|c: char| c.is_ascii_whitespace())
        .unwrap_or(text.len());
    (&text[..end], text[end..].trim_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_before_names_of_any_kind() {
        let name = |text: &str| parse_map(text).map(|map| map.name);
        for (text, expected) in [
            ("a.png", "a.png"),
            ("-s 1 1 1 a.png", "a.png"),
            ("-s 2 a.png", "a.png"),
            (
                "-o 0.5 0.5 -s 2 2 -clamp on my picture.png",
                "my picture.png",
            ),
            (
                "-blendu off -blendv on -cc on -mm 0 1 -bm 2 -boost 1 -texres 512 -imfchan l -t 0 0 0 a.png",
                "a.png",
            ),
            (
                "-type sphere tex\\sub folder\\a.png",
                "tex\\sub folder\\a.png",
            ),
            ("-s 1 1 1 2.png", "2.png"),
            ("-s 1 1 1 2", "2"),
            ("-strange.png", "-strange.png"),
            ("\"a b.png\"", "a b.png"),
        ] {
            assert_eq!(name(text).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(name(""), None);
        assert_eq!(name("-clamp on"), None);
    }

    #[test]
    fn coordinates_are_scaled_and_moved_before_v_is_turned_down() {
        let map = parse_map("-s 2 3 -o 0.25 0.5 -clamp on a.png").unwrap();
        assert!(map.is_clamped);
        assert_eq!(map.place.of([0.5, 0.1]), [1.25, 1.0 - (0.5 + 3.0 * 0.1)]);
        assert_eq!(MapPlace::default().of([0.25, 0.25]), [0.25, 0.75]);
    }
}
