//! A legend beside a picture: a bar of colors with numbers.
//!
//! In: a picture, a range of numbers, their unit. Out: a wider picture. Absent here: what the numbers mean.

use antumbra_scene::model::Color;

use crate::color_map::inferno;
use crate::film::Picture;

/// Columns and rows of a letter, without the gap to the next.
const LETTER: [usize; 2] = [5, 7];

/// Width of a legend at scale 1, in pixels.
const WIDTH: u32 = 76;

/// Height of a picture that a legend of scale 1 is made for.
const HEIGHT: u32 = 400;

/// Least height of a picture that has a legend.
pub const LEAST_HEIGHT: u32 = 80;

/// Most marks of a bar.
const MARKS: f64 = 6.0;

/// Letters: rows from the top, the left column in the highest of five bits.
const FONT: [(char, [u8; 7]); 41] = [
    ('0', [14, 17, 19, 21, 25, 17, 14]),
    ('1', [4, 12, 4, 4, 4, 4, 14]),
    ('2', [14, 17, 1, 2, 4, 8, 31]),
    ('3', [31, 2, 4, 2, 1, 17, 14]),
    ('4', [2, 6, 10, 18, 31, 2, 2]),
    ('5', [31, 16, 30, 1, 1, 17, 14]),
    ('6', [6, 8, 16, 30, 17, 17, 14]),
    ('7', [31, 1, 2, 4, 8, 8, 8]),
    ('8', [14, 17, 17, 14, 17, 17, 14]),
    ('9', [14, 17, 17, 15, 1, 2, 12]),
    ('.', [0, 0, 0, 0, 0, 12, 12]),
    ('-', [0, 0, 0, 31, 0, 0, 0]),
    ('/', [0, 1, 2, 4, 8, 16, 0]),
    ('%', [24, 25, 2, 4, 8, 19, 3]),
    ('W', [17, 17, 17, 21, 21, 21, 10]),
    ('a', [0, 0, 14, 1, 15, 17, 15]),
    ('b', [16, 16, 22, 25, 17, 17, 30]),
    ('c', [0, 0, 14, 16, 16, 17, 14]),
    ('d', [1, 1, 13, 19, 17, 17, 15]),
    ('e', [0, 0, 14, 17, 31, 16, 14]),
    ('f', [6, 9, 8, 28, 8, 8, 8]),
    ('g', [0, 15, 17, 17, 15, 1, 14]),
    ('h', [16, 16, 22, 25, 17, 17, 17]),
    ('i', [4, 0, 12, 4, 4, 4, 14]),
    ('j', [2, 0, 6, 2, 2, 18, 12]),
    ('k', [16, 16, 18, 20, 24, 20, 18]),
    ('l', [12, 4, 4, 4, 4, 4, 14]),
    ('m', [0, 0, 26, 21, 21, 17, 17]),
    ('n', [0, 0, 22, 25, 17, 17, 17]),
    ('o', [0, 0, 14, 17, 17, 17, 14]),
    ('p', [0, 0, 30, 17, 30, 16, 16]),
    ('q', [0, 0, 13, 19, 15, 1, 1]),
    ('r', [0, 0, 22, 25, 16, 16, 16]),
    ('s', [0, 0, 14, 16, 14, 1, 30]),
    ('t', [8, 8, 28, 8, 8, 9, 6]),
    ('u', [0, 0, 17, 17, 17, 19, 13]),
    ('v', [0, 0, 17, 17, 17, 10, 4]),
    ('w', [0, 0, 17, 17, 21, 21, 10]),
    ('x', [0, 0, 17, 10, 4, 10, 17]),
    ('y', [0, 0, 17, 17, 15, 1, 14]),
    ('z', [0, 0, 31, 2, 4, 8, 31]),
];

/// Returns the width of the legend beside a picture of so many rows, in pixels.
pub fn width(height: u32) -> u32 {
    WIDTH * scale(height)
}

fn scale(height: u32) -> u32 {
    (height / HEIGHT).max(1)
}

/// Returns the picture with a legend at its right side: colors from 0 at the bottom to `most` at the top, round numbers,
/// and above them the unit in up to two lines.
pub fn with_legend(picture: &Picture, most: f64, unit: &[&str]) -> Picture {
    let [width, height] = picture.size.map(|n| n as usize);
    let most = if most.is_finite() { most.max(0.0) } else { 0.0 };
    let scale = scale(picture.size[1]) as usize;
    let whole = width + WIDTH as usize * scale;
    let mut sheet = Sheet {
        size: [whole, height],
        pixels: vec![[1.0; 3]; whole * height],
        scale,
    };
    for (row, pixels) in picture.pixels.chunks(width).enumerate() {
        sheet.pixels[row * whole..][..width].copy_from_slice(pixels);
    }
    let line = (LETTER[1] + 3) * scale;
    let left = width + 8 * scale;
    let top = unit.len() * line + 8 * scale;
    for (number, text) in unit.iter().enumerate() {
        sheet.text([left, 6 * scale + number * line], text);
    }
    // The bar, with half a letter above and below for the numbers at its ends.
    let margin = 6 * scale;
    let (begin, end) = (
        top + margin,
        height.saturating_sub(margin).max(top + margin + 2),
    );
    let bar = 12 * scale;
    let long = (end - begin - 1) as f64;
    for row in begin..end {
        let share = (end - 1 - row) as f64 / long;
        sheet.fill([left, row], [bar, 1], inferno(share));
    }
    let step = step(most);
    let mut mark = 0.0;
    while mark * step <= most * (1.0 + 1e-9) {
        let number = mark * step;
        let share = if most > 0.0 { number / most } else { 0.0 };
        let row = end - 1 - (share.min(1.0) * long + 0.5) as usize;
        sheet.fill([left + bar, row], [3 * scale, 1], Color::ZERO);
        let raised = row.saturating_sub(LETTER[1] * scale / 2);
        sheet.text([left + bar + 5 * scale, raised], &written(number, step));
        mark += 1.0;
    }
    Picture {
        size: [whole as u32, height as u32],
        pixels: sheet.pixels,
    }
}

/// Returns the distance between marks: 1, 2 or 5 times a power of ten.
pub fn step(most: f64) -> f64 {
    if !(most > 0.0 && most.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(most / MARKS)));
    let fits = |&factor: &f64| most / (factor * power) <= MARKS;
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(fits)
        .map_or(most, |factor| factor * power)
}

/// Returns a number with as many places as its step has.
pub fn written(number: f64, step: f64) -> String {
    let places = (-libm::floor(libm::log10(step) + 1e-9)).clamp(0.0, 9.0) as usize;
    format!("{number:.places$}")
}

/// Pixels to write on.
struct Sheet {
    size: [usize; 2],
    pixels: Vec<[f32; 3]>,
    scale: usize,
}

impl Sheet {
    /// Fills a rectangle, as far as it lies on the sheet.
    fn fill(&mut self, [left, top]: [usize; 2], [across, down]: [usize; 2], color: Color) {
        let [width, height] = self.size;
        let color = color.as_vec3().to_array();
        for row in top..(top + down).min(height) {
            for column in left..(left + across).min(width) {
                self.pixels[row * width + column] = color;
            }
        }
    }

    /// Writes letters in black. What the font lacks is a blank.
    fn text(&mut self, [left, top]: [usize; 2], text: &str) {
        let scale = self.scale;
        for (number, letter) in text.chars().enumerate() {
            let Some((_, rows)) = FONT.iter().find(|(known, _)| *known == letter) else {
                continue;
            };
            let left = left + number * (LETTER[0] + 1) * scale;
            for (row, bits) in rows.iter().enumerate() {
                for column in 0..LETTER[0] {
                    if bits >> (LETTER[0] - 1 - column) & 1 == 1 {
                        let place = [left + column * scale, top + row * scale];
                        self.fill(place, [scale; 2], Color::ZERO);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_few() {
        for (most, expected) in [
            (4376.0, 1000.0),
            (0.75, 0.2),
            (12.0, 2.0),
            (6.0, 1.0),
            (0.0, 1.0),
        ] {
            assert_eq!(step(most), expected, "{most}");
        }
        for most in [1e-300, 3.7e-9, 0.123, 1e300] {
            assert!(most / step(most) <= MARKS, "{most}");
        }
        assert_eq!(written(0.2 * 3.0, 0.2), "0.6");
        assert_eq!(written(3000.0, 1000.0), "3000");
    }

    #[test]
    fn the_picture_stays_and_the_bar_runs_from_dark_to_light() {
        let picture = Picture {
            size: [3, 100],
            pixels: vec![[0.25, 0.5, 0.75]; 300],
        };
        let whole = with_legend(&picture, 12.0, &["hours", "of sun"]);
        assert_eq!(whole.size, [3 + width(100), 100]);
        let at = |column: usize, row: usize| whole.pixels[row * whole.size[0] as usize + column];
        assert_eq!(
            (at(0, 0), at(2, 99)),
            ([0.25, 0.5, 0.75], [0.25, 0.5, 0.75])
        );
        let bar: Vec<f32> = (40..94).map(|row| at(12, row).iter().sum()).collect();
        assert!(bar.is_sorted_by(|a, b| a >= b) && bar[0] > bar[53]);
        // Numbers are there: black beside the bar.
        let is_black = |row: usize| (30..76).any(|column| at(column, row) == [0.0; 3]);
        assert!((40..100).any(is_black));
    }

    #[test]
    fn a_picture_too_low_for_a_bar_has_one_without_panic() {
        for height in 1..40 {
            let picture = Picture {
                size: [1, height],
                pixels: vec![[0.0; 3]; height as usize],
            };
            assert_eq!(with_legend(&picture, 1.0, &["a", "b"]).size[1], height);
        }
    }
}
