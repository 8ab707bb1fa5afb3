//! Pictures as files: 8-bit PNG, sRGB for colors and linear for masks.
//!
//! In: linear values and an exposure. Out: a file that appears whole or not at all. Invariant:
//! equal pictures give equal bytes on every platform; the transfer function uses libm, not the C
//! library.

use std::io;
use std::path::{Path, PathBuf};

use png::{BitDepth, ColorType, Compression, Filter};
use rayon::prelude::*;

use crate::film::Picture;

/// Name of the program in the heads of pictures: PNG has it under `Software`, OpenEXR in the attribute
/// `software` of each part.
pub const SOFTWARE: &str = "made by antumbra";

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The file system refuses.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file meant.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The encoder refuses.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The file meant.
        path: PathBuf,
        /// What the encoder says.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl ImageFileError {
    /// Wraps what the file system says about the file at `path`.
    pub(crate) fn of(path: &Path) -> impl Fn(io::Error) -> Self {
        |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}

/// Returns the sRGB byte of a linear value (IEC 61966-2-1); values outside `0..=1` are clipped and
/// NaN is black.
pub fn srgb_byte(linear: f64) -> u8 {
    let clipped = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    let encoded = if clipped <= 0.003_130_8 {
        12.92 * clipped
    } else {
        1.055 * libm::pow(clipped, 1.0 / 2.4) - 0.055
    };
    (255.0 * encoded + 0.5) as u8
}

/// Returns the bytes of all pixels, RGB, after multiplying by two to the power of
/// `exposure_in_stops`.
pub fn srgb_bytes(picture: &Picture, exposure_in_stops: f64) -> Vec<u8> {
    let factor = libm::exp2(exposure_in_stops);
    let mut bytes = vec![0; 3 * picture.pixels.len()];
    bytes
        .par_chunks_exact_mut(3)
        .zip(&picture.pixels)
        .for_each(|(bytes, pixel)| {
            for (byte, &value) in bytes.iter_mut().zip(pixel) {
                *byte = srgb_byte(factor * f64::from(value));
            }
        });
    bytes
}

/// Writes a picture as PNG to `path`, replacing what was there.
///
/// # Errors
/// The file cannot be written or renamed; what was at `path` is then untouched.
pub fn write_png(
    path: &Path,
    picture: &Picture,
    exposure_in_stops: f64,
) -> Result<(), ImageFileError> {
    let bytes = srgb_bytes(picture, exposure_in_stops);
    encode(path, picture.size, &bytes, ColorType::Rgb)
}

/// Returns a picture as the bytes of a PNG file.
///
/// # Errors
/// The encoder refuses.
pub fn png_bytes(picture: &Picture, exposure_in_stops: f64) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let bytes = srgb_bytes(picture, exposure_in_stops);
    encode_to(&mut file, picture.size, &bytes, ColorType::Rgb)?;
    Ok(file)
}

/// Writes numbers from 0 to 1 as grey PNG to `path`, replacing what was there: 255 times the
/// number, rounded, without a transfer function, as masks are read.
///
/// # Errors
/// As [`write_png`].
pub fn write_mask_png(path: &Path, size: [u32; 2], shares: &[f32]) -> Result<(), ImageFileError> {
    let byte = |&share: &f32| (255.0 * share.clamp(0.0, 1.0) + 0.5) as u8;
    let bytes: Vec<u8> = shares.iter().map(byte).collect();
    encode(path, size, &bytes, ColorType::Grayscale)
}

fn encode(
    path: &Path,
    size: [u32; 2],
    bytes: &[u8],
    color: ColorType,
) -> Result<(), ImageFileError> {
    antumbra_files::write(path, ImageFileError::of(path), |file| {
        encode_to(file, size, bytes, color).map_err(|source| ImageFileError::Encode {
            path: path.to_owned(),
            source: source.into(),
        })
    })
}

fn encode_to(
    file: impl io::Write,
    [width, height]: [u32; 2],
    bytes: &[u8],
    color: ColorType,
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    encoder.add_text_chunk("Software".into(), SOFTWARE.into())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_transfer_function_hits_known_values_and_clips() {
        let cases = [
            (0.0, 0),
            (1.0, 255),
            (0.5, 188),
            (0.215_861, 128),
            (0.002, 7),
            (-1.0, 0),
        ];
        for (linear, byte) in cases {
            assert_eq!(srgb_byte(linear), byte, "{linear}");
        }
        assert_eq!(srgb_byte(f64::NAN), 0);
        assert_eq!(srgb_byte(f64::INFINITY), 255);
    }

    #[test]
    fn exposure_counts_in_stops() {
        let picture = Picture {
            size: [1, 1],
            pixels: vec![[0.25, 0.125, 0.5]],
        };
        assert_eq!(srgb_bytes(&picture, 1.0), [0.5, 0.25, 1.0].map(srgb_byte));
        assert_eq!(srgb_bytes(&picture, 0.0), [0.25, 0.125, 0.5].map(srgb_byte));
    }

    #[test]
    fn a_file_is_whole_or_absent_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let picture = Picture {
            size: [2, 1],
            pixels: vec![[1.0; 3], [0.0; 3]],
        };
        let path = folder.path().join("picture.png");
        write_png(&path, &picture, 0.0).unwrap();
        assert!(fs::read(&path).unwrap().starts_with(b"\x89PNG"));
        assert!(antumbra_files::is_own(&path, SOFTWARE).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

        let nowhere = folder.path().join("missing/picture.png");
        let error = write_png(&nowhere, &picture, 0.0).unwrap_err();
        assert!(error.to_string().contains("picture.png"), "{error}");
    }
}
