//! Pictures on surfaces.
//!
//! In: the bytes of a PNG or JPEG; texels and a place in the picture. Out: a texture; linear color
//! and alpha. Invariants: nothing is decoded before its [`Room`] is known to suffice; sampling
//! gives the same bits on every platform: sRGB is decoded by a table that `libm` fills, and
//! filtering uses additions and multiplications only.
//!
//! Pixels of PNG files are the same on every platform. JPEG leaves decoders some freedom, so
//! colors from JPEG files may differ by a step or two between versions of the decoder; JPEG has
//! no alpha.

use std::{
    io::{self, Cursor},
    sync::LazyLock,
};

use image::{ColorType, DynamicImage, ImageDecoder, ImageError, ImageReader, Limits};

use crate::room::{OverLimit, Room};

/// The most texels along a side.
const MAX_SIDE: u32 = 16_384;

use serde::{Deserialize, Serialize};

/// A picture that is laid on surfaces.
///
/// `width * height` is the number of texels and not zero; what [`sample`](Self::sample) returns
/// for a picture that breaks this is white.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// A name for messages; may be empty.
    pub name: String,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue (sRGB-encoded) and alpha (linear); rows from the top down, each from left
    /// to right.
    pub texels: Vec<[u8; 4]>,
    /// Wrapping beyond the left and right edge, and beyond the upper and lower one.
    pub wrap: [Wrap; 2],
    /// Filter between texels.
    pub filter: Filter,
}

/// Wrapping beyond the edge of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture again, every other time mirrored.
    MirroredRepeat,
    /// The texels of the edge.
    ClampToEdge,
}

/// Filter between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// The four nearest texels, weighted by distance along each axis.
    #[default]
    Linear,
}

/// The linear value of each sRGB byte, 0 to 1 (IEC 61966-2-1).
static LINEAR_OF_SRGB: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_of_srgb(byte as f64 / 255.0)));

/// Returns the linear value, 0 to 1, of an sRGB-encoded one; 0 for what is no number.
pub(crate) fn linear_of_srgb(encoded: f64) -> f64 {
    let encoded = if encoded.is_nan() {
        0.0
    } else {
        encoded.clamp(0.0, 1.0)
    };
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

impl Texture {
    /// Returns linear red, green, blue and alpha, each 0 to 1, at a place in the picture.
    ///
    /// `uv` is (0, 0) at the upper left corner of the upper left texel and (1, 1) at the lower
    /// right corner of the lower right one, as in glTF; beyond that, `wrap` decides. Texels are
    /// decoded first and filtered then. There are no smaller copies for distant views. A
    /// coordinate that is not finite counts as 0. Constant time.
    ///
    /// # Example
    /// ```
    /// use antumbra_scene::model::{Filter, Texture, Wrap};
    /// let texture = Texture {
    ///     name: "left black, right white".into(),
    ///     width: 2,
    ///     height: 1,
    ///     texels: vec![[0, 0, 0, 255], [255; 4]],
    ///     wrap: [Wrap::ClampToEdge; 2],
    ///     filter: Filter::Linear,
    /// };
    /// assert_eq!(texture.sample([0.5, 0.5]), [0.5, 0.5, 0.5, 1.0]);
    /// ```
    pub fn sample(&self, uv: [f64; 2]) -> [f64; 4] {
        self.filtered(uv, linear_of_texel)
    }

    /// Returns what [`sample`](Self::sample) does, of values as they are stored: for heights and normals, which are no
    /// colors.
    pub fn sample_stored(&self, uv: [f64; 2]) -> [f64; 4] {
        self.filtered(uv, |texel| texel.map(|byte| f64::from(byte) / 255.0))
    }

    /// Returns the alpha of what [`sample`](Self::sample) returns, the same bits, without a look at colors.
    pub fn sample_alpha(&self, uv: [f64; 2]) -> f64 {
        let [alpha] = self.filtered(uv, |[.., alpha]| [f64::from(alpha) / 255.0]);
        alpha
    }

    fn filtered<const N: usize>(
        &self,
        uv: [f64; 2],
        decoded: impl Fn([u8; 4]) -> [f64; N],
    ) -> [f64; N] {
        let texel = |column, row| self.texel(column, row).map_or([1.0; N], &decoded);
        let [x, y] = [(uv[0], self.width), (uv[1], self.height)]
            .map(|(coordinate, size)| finite(coordinate) * f64::from(size));
        let [wrap_x, wrap_y] = self.wrap;
        match self.filter {
            Filter::Nearest => texel(
                wrapped(x.floor(), self.width, wrap_x),
                wrapped(y.floor(), self.height, wrap_y),
            ),
            Filter::Linear => {
                // Texels are points in their middles.
                let (left, right_share) = split(x - 0.5);
                let (top, bottom_share) = split(y - 0.5);
                let columns = [left, left + 1.0].map(|x| wrapped(x, self.width, wrap_x));
                let rows = [top, top + 1.0].map(|y| wrapped(y, self.height, wrap_y));
                let [upper, lower] = rows.map(|row| {
                    let [a, b] = columns.map(|column| texel(column, row));
                    mix(a, b, right_share)
                });
                mix(upper, lower, bottom_share)
            }
        }
    }

    /// Returns the least and greatest alpha, 0 to 255, of all texels that [`sample`](Self::sample) may look at in a
    /// box of places, given by its least and greatest coordinates; `None` for a box of more than 2^16 texels that is
    /// not all of the picture, and for coordinates that are not finite.
    ///
    /// `all` is [`alphas`](Self::alphas), which is given for every box as large as the picture.
    pub fn alphas_in(&self, low: [f64; 2], high: [f64; 2], all: [u8; 2]) -> Option<[u8; 2]> {
        // Places between texels lie between the nearest two; one more bears the rounding of places.
        let spans: [(f64, f64); 2] = [(0, self.width), (1, self.height)].map(|(axis, size)| {
            let at = |place: f64| (place * f64::from(size)).floor();
            (at(low[axis]) - 2.0, at(high[axis]) + 2.0)
        });
        let is_near = |place: f64| place.abs() < 1e15;
        if !spans
            .iter()
            .all(|&(first, last)| is_near(first) && is_near(last))
        {
            return None;
        }
        // What is as long as the picture may be anywhere in it, whatever is beyond its edges.
        let sides = [self.width, self.height];
        let runs: [(f64, u32); 2] = std::array::from_fn(|axis| {
            let (first, last) = spans[axis];
            let count = last - first + 1.0;
            if count < f64::from(sides[axis]) {
                (first, count as u32)
            } else {
                (0.0, sides[axis])
            }
        });
        if runs.map(|(_, count)| count) == sides {
            return Some(all);
        }
        if u64::from(runs[0].1) * u64::from(runs[1].1) > 1 << 16 {
            return None;
        }
        let places = |axis: usize| {
            let (first, count) = runs[axis];
            (0..count)
                .map(move |step| wrapped(first + f64::from(step), sides[axis], self.wrap[axis]))
        };
        let mut found: Option<[u8; 2]> = None;
        for row in places(1) {
            for column in places(0) {
                let texel = self.texels.get(row * self.width as usize + column);
                let alpha = texel.map_or(255, |&[.., alpha]| alpha);
                let [least, greatest] = found.unwrap_or([alpha; 2]);
                found = Some([least.min(alpha), greatest.max(alpha)]);
            }
        }
        found
    }

    /// Returns the least and greatest alpha, 0 to 255, of all texels; 255 for a picture without any.
    pub fn alphas(&self) -> [u8; 2] {
        let alphas = self.texels.iter().map(|&[.., alpha]| alpha);
        match (alphas.clone().min(), alphas.max()) {
            (Some(least), Some(greatest)) if self.is_whole() => [least, greatest],
            (Some(least), _) => [least, 255],
            _ => [255; 2],
        }
    }

    /// Returns whether there are as many texels as the sides say.
    fn is_whole(&self) -> bool {
        self.texels.len() as u64 >= u64::from(self.width) * u64::from(self.height)
    }

    /// Returns the linear mean of all texels: red, green, blue and alpha.
    pub fn mean(&self) -> [f64; 4] {
        if self.texels.is_empty() {
            return [1.0; 4];
        }
        let mut counts = [[0_u64; 256]; 4];
        for texel in &self.texels {
            for (count, &byte) in counts.iter_mut().zip(texel) {
                count[usize::from(byte)] += 1;
            }
        }
        let all = self.texels.len() as f64;
        std::array::from_fn(|channel| {
            let value = |byte: usize| {
                if channel == 3 {
                    byte as f64 / 255.0
                } else {
                    LINEAR_OF_SRGB[byte]
                }
            };
            let sum: f64 = (0..256).map(|b| counts[channel][b] as f64 * value(b)).sum();
            sum / all
        })
    }

    /// Returns a texel, if there is one.
    fn texel(&self, column: usize, row: usize) -> Option<[u8; 4]> {
        let index = row * self.width as usize + column;
        self.texels.get(index).copied()
    }
}

fn linear_of_texel([red, green, blue, alpha]: [u8; 4]) -> [f64; 4] {
    let linear = |byte: u8| LINEAR_OF_SRGB[usize::from(byte)];
    [
        linear(red),
        linear(green),
        linear(blue),
        f64::from(alpha) / 255.0,
    ]
}

/// Why a picture is not there.
#[derive(Debug)]
pub(crate) enum PictureError {
    /// It cannot be read.
    Unreadable(String),
    /// It needs more memory than there may be.
    OverLimit(OverLimit),
}

impl From<String> for PictureError {
    fn from(problem: String) -> Self {
        Self::Unreadable(problem)
    }
}

impl From<ImageError> for PictureError {
    fn from(error: ImageError) -> Self {
        Self::Unreadable(error.to_string())
    }
}

/// Decodes a PNG or JPEG; the content says which. The texture repeats, is filtered linearly and has
/// no name. Its texels stay charged to `room`.
///
/// # Errors
/// The picture cannot be read, or there is no room for it; that is asked by the size that its header
/// gives, before anything is decoded.
pub(crate) fn decode(bytes: &[u8], room: &mut Room) -> Result<Texture, PictureError> {
    let unreadable = |error: io::Error| PictureError::Unreadable(error.to_string());
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(unreadable)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // What headers hold besides the picture: profiles, remarks.
    limits.max_alloc = Some(8 * bytes.len() as u64 + (64 << 20));
    reader.limits(limits.clone());
    let mut decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || width.max(height) > MAX_SIDE {
        return Err(PictureError::Unreadable(format!(
            "it has {width} x {height} texels; expected 1 to {MAX_SIDE} along each side"
        )));
    }
    let kept = 4 * u64::from(width) * u64::from(height);
    // Other layouts than four bytes a texel are converted, with both there for a while.
    let converted = match decoder.color_type() {
        ColorType::Rgba8 => 0,
        _ => decoder.total_bytes(),
    };
    let what = || format!("a picture of {width} x {height} texels");
    let needed = kept.saturating_add(converted);
    room.check(needed, what).map_err(PictureError::OverLimit)?;
    // The decoder's own needs: rows, tables and, of progressive pictures, all coefficients.
    limits.max_alloc = Some(needed.saturating_mul(2).saturating_add(64 << 20));
    decoder.set_limits(limits)?;
    let decoded = DynamicImage::from_decoder(decoder)?;
    room.take(kept, what).map_err(PictureError::OverLimit)?;
    let texels = decoded.into_rgba8().into_raw();
    let texels = bytemuck::allocation::try_cast_vec(texels)
        .unwrap_or_else(|(_, texels)| texels.as_chunks().0.to_vec());
    Ok(Texture {
        name: String::new(),
        width,
        height,
        texels,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    })
}

/// Returns 0 for what is no number or too large to scale.
fn finite(coordinate: f64) -> f64 {
    if coordinate.abs() < 1e300 {
        coordinate
    } else {
        0.0
    }
}

/// Splits a number into the whole one below and the rest, 0 to 1.
fn split(number: f64) -> (f64, f64) {
    let whole = number.floor();
    (whole, number - whole)
}

/// Mixes so that equal ends give that value, whatever the share.
fn mix<const N: usize>(a: [f64; N], b: [f64; N], share_of_b: f64) -> [f64; N] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share_of_b)
}

/// Returns the texel that stands at a whole number, possibly beyond the edge. Remainders of whole
/// numbers are exact.
fn wrapped(place: f64, size: u32, wrap: Wrap) -> usize {
    let size = f64::from(size.max(1));
    let inside = match wrap {
        // Most are, and remainders are slow.
        _ if (0.0..size).contains(&place) => place,
        Wrap::Repeat => place.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let turned = place.rem_euclid(2.0 * size);
            turned.min(2.0 * size - 1.0 - turned)
        }
        Wrap::ClampToEdge => place,
    };
    inside.clamp(0.0, size - 1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four texels in a row, told apart by alpha.
    fn row(wrap: Wrap, filter: Filter) -> Texture {
        Texture {
            name: String::new(),
            width: 4,
            height: 1,
            texels: [0, 51, 102, 255].map(|alpha| [0, 0, 0, alpha]).to_vec(),
            wrap: [wrap; 2],
            filter,
        }
    }

    fn alphas(texture: &Texture, places: &[f64]) -> Vec<f64> {
        places
            .iter()
            .map(|&u| {
                let [.., alpha] = texture.sample([u, 0.5]);
                assert_eq!(texture.sample_alpha([u, 0.5]), alpha);
                alpha
            })
            .collect()
    }

    #[test]
    fn edges() {
        let places = [-0.3, -0.1, 0.0, 0.3, 0.999, 1.0, 1.1, 1.9, 2.1, -1.1];
        for (wrap, expected) in [
            (
                Wrap::Repeat,
                [0.4, 1.0, 0.0, 0.2, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            ),
            (
                Wrap::MirroredRepeat,
                [0.2, 0.0, 0.0, 0.2, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0],
            ),
            (
                Wrap::ClampToEdge,
                [0.0, 0.0, 0.0, 0.2, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0],
            ),
        ] {
            let found = alphas(&row(wrap, Filter::Nearest), &places);
            assert_eq!(found, expected, "{wrap:?}");
        }
    }

    #[test]
    fn between_texels() {
        let clamped = row(Wrap::ClampToEdge, Filter::Linear);
        assert_eq!(
            alphas(&clamped, &[0.0, 0.125, 0.25, 1.0]),
            [0.0, 0.0, 0.1, 1.0]
        );
        assert_eq!(
            alphas(&row(Wrap::Repeat, Filter::Linear), &[0.0, 1.0]),
            [0.5, 0.5]
        );
    }

    #[test]
    fn no_sample_of_a_box_is_beyond_the_alphas_said_of_it() {
        let texels =
            (0..21 * 15_u32).map(|n| [0, 0, 0, (n.wrapping_mul(2_654_435_769) >> 24) as u8]);
        let mut random = 1_u64;
        let mut next = || {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (random >> 40) as f64 / f64::from(1 << 24)
        };
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            for filter in [Filter::Nearest, Filter::Linear] {
                let texture = Texture {
                    name: String::new(),
                    width: 21,
                    height: 15,
                    texels: texels.clone().collect(),
                    wrap: [wrap, Wrap::Repeat],
                    filter,
                };
                let all = texture.alphas();
                let mut narrower = 0;
                for _ in 0..500 {
                    let low = [next() * 6.0 - 3.0, next() * 6.0 - 3.0];
                    let size = next() * next() * 1.5;
                    let high = low.map(|low| low + size * next());
                    let [least, greatest] = texture.alphas_in(low, high, all).expect("small");
                    narrower += u32::from([least, greatest] != all);
                    let [least, greatest] = [least, greatest].map(|byte| f64::from(byte) / 255.0);
                    for _ in 0..30 {
                        let place = std::array::from_fn(|i| low[i] + (high[i] - low[i]) * next());
                        let alpha = texture.sample(place)[3];
                        let inside = least - 1e-12..=greatest + 1e-12;
                        assert!(
                            inside.contains(&alpha),
                            "{wrap:?} {filter:?} {low:?} {high:?}"
                        );
                    }
                }
                assert!(narrower > 100, "{narrower} boxes say less than the picture");
            }
        }
        let beyond = row(Wrap::Repeat, Filter::Linear);
        assert_eq!(
            beyond.alphas_in([0.0; 2], [f64::NAN, 0.0], beyond.alphas()),
            None
        );
        assert_eq!(
            beyond.alphas_in([-9.0; 2], [9.0; 2], [0, 255]),
            Some([0, 255])
        );
    }

    #[test]
    fn rows_go_down() {
        let texture = Texture {
            width: 1,
            height: 4,
            ..row(Wrap::Repeat, Filter::Nearest)
        };
        assert_eq!(texture.sample([0.5, 0.1])[3], 0.0);
        assert_eq!(texture.sample([0.5, 0.9])[3], 1.0);
    }

    #[test]
    fn no_coordinate_is_too_odd() {
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            for filter in [Filter::Nearest, Filter::Linear] {
                let texture = row(wrap, filter);
                for odd in [f64::NAN, f64::INFINITY, f64::MAX, -1e299, 1e18, -1e-320] {
                    let sample = texture.sample([odd, odd]);
                    assert!(sample.iter().all(|c| (0.0..=1.0).contains(c)), "{odd}");
                }
            }
        }
        let empty = Texture {
            width: 0,
            texels: Vec::new(),
            ..row(Wrap::Repeat, Filter::Linear)
        };
        assert_eq!(empty.sample([0.3, 0.3]), [1.0; 4]);
    }

    #[test]
    fn colors_are_decoded_before_they_are_mixed() {
        let texture = Texture {
            name: String::new(),
            width: 3,
            height: 1,
            texels: vec![[0, 0, 0, 255], [10, 128, 255, 255], [10, 128, 255, 255]],
            wrap: [Wrap::ClampToEdge; 2],
            filter: Filter::Linear,
        };
        let [red, green, blue, _] = texture.sample([0.9, 0.5]);
        assert_eq!(red, 10.0 / 255.0 / 12.92);
        assert!((green - 0.215_860_500_113_899_26).abs() < 1e-15);
        assert_eq!(blue, 1.0);
        assert_eq!(texture.sample([1.0 / 3.0, 0.5])[2], 0.5);
        assert!((texture.mean()[2] - 2.0 / 3.0).abs() < 1e-15);
    }

    /// The table's bits, summed: another platform's would differ here first.
    #[test]
    fn the_table_is_the_same_everywhere() {
        let sum = LINEAR_OF_SRGB
            .iter()
            .fold(0_u64, |sum, v| sum.rotate_left(1) ^ v.to_bits());
        assert_eq!(sum, 0xf404_1998_e777_2449, "{sum:#x}");
    }
}
