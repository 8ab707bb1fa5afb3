//! Pictures and layers become files; the ending says which.
//!
//! | ending | picture | layers |
//! |---|---|---|
//! | `.png` | 8-bit sRGB after exposure | beside it: `name.shadow.<light>.png`, grey, 255 where all samples are lit; `name.decided-by.png`, the colors of `--show occlusion` mixed by shares; `name.fog.png`, exposed as the picture; `name.transmittance.png`, grey, 255 where the air leaves all light |
//! | `.exr` | part `beauty`, linear | parts `shadow.<light>`, `decided-by`, `fog` and `transmittance` |

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use antumbra_render::aov::{Aovs, DECIDED_LAYER, DecidedBy, FOG_LAYER, Layer};
use antumbra_render::exr_file::write_exr;
use antumbra_render::false_color::decided_color;
use antumbra_render::film::{Picture, Rendered};
use antumbra_render::image_file::{ImageFileError, write_mask_png, write_png};
use antumbra_scene::model::{Color, Scene};

use crate::failure::Failure;
use crate::typed::Aov;

/// The format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Exr,
}

impl Format {
    /// Returns the format that a file's ending says.
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        if path.file_name().is_none() {
            let message = format!("{} names no file to write", path.display());
            return Err(Failure::input(
                message,
                "give --output FILE.png or FILE.exr",
            ));
        }
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Failure::input(
                format!("{} ends like no format of pictures", path.display()),
                "give --output a name that ends in .png or .exr",
            )),
        }
    }

    /// Returns the layers to make: as typed, else all in OpenEXR and none beside PNG. Where the picture shows no fog there
    /// are no layers of it.
    pub(super) fn aovs(self, typed: &[Aov], shows_fog: bool) -> Result<Aovs, Failure> {
        if typed.is_empty() {
            let is_exr = self == Self::Exr;
            return Ok(Aovs {
                shadow: is_exr,
                decided: is_exr,
                fog: is_exr && shows_fog,
            });
        }
        if typed.contains(&Aov::Fog) && !shows_fog {
            return Err(Failure::input(
                "--aov fog: the picture shows no fog",
                "give --fog DENSITY, without --show occlusion",
            ));
        }
        Ok(Aovs {
            shadow: typed.contains(&Aov::Shadow),
            decided: typed.contains(&Aov::Decided),
            fog: typed.contains(&Aov::Fog),
        })
    }

    /// Returns the files of the layers beside a picture.
    pub(super) fn layer_files(self, path: &Path, aovs: Aovs, scene: &Scene) -> Vec<PathBuf> {
        if self == Self::Exr {
            return Vec::new();
        }
        let names = aovs.layer_names(scene);
        names.iter().map(|name| beside(path, name)).collect()
    }

    /// Writes a picture and its layers.
    pub(super) fn write(
        self,
        path: &Path,
        rendered: &Rendered,
        exposure_in_stops: f64,
    ) -> Result<(), Failure> {
        let Rendered {
            picture, layers, ..
        } = rendered;
        let written = match self {
            Self::Exr => write_exr(path, picture, layers),
            Self::Png => write_png(path, picture, exposure_in_stops).and_then(|()| {
                layers.iter().try_for_each(|layer| {
                    write_layer_png(path, picture.size, layer, exposure_in_stops)
                })
            }),
        };
        written.map_err(|error| Failure::system(error.to_string()))
    }
}

/// Writes a layer beside the picture at `path`.
fn write_layer_png(
    path: &Path,
    size: [u32; 2],
    layer: &Layer,
    exposure_in_stops: f64,
) -> Result<(), ImageFileError> {
    let path = beside(path, &layer.name);
    let pixel_count = size[0] as usize * size[1] as usize;
    if layer.name == FOG_LAYER {
        let plane = |channel: usize, pixel: usize| layer.channels[channel].1[pixel];
        let color = |pixel: usize| [0, 1, 2].map(|channel| plane(channel, pixel));
        let picture = Picture {
            size,
            pixels: (0..pixel_count).map(color).collect(),
        };
        return write_png(&path, &picture, exposure_in_stops);
    }
    if layer.name != DECIDED_LAYER {
        let mask = layer.channels.first().map_or(&[][..], |(_, mask)| mask);
        return write_mask_png(&path, size, mask);
    }
    let colors = DecidedBy::ALL.map(decided_color);
    let mixed = |pixel: usize| {
        let parts = layer.channels.iter().zip(colors);
        parts
            .map(|((_, shares), color)| f64::from(shares[pixel]) * color)
            .fold(Color::ZERO, |sum, part| sum + part)
            .as_vec3()
            .to_array()
    };
    let picture = Picture {
        size,
        pixels: (0..pixel_count).map(mixed).collect(),
    };
    write_png(&path, &picture, 0.0)
}

/// Returns `a/b.layer.png` for `a/b.png`.
fn beside(path: &Path, layer: &str) -> PathBuf {
    let mut name = path.file_stem().map(OsString::from).unwrap_or_default();
    name.push(format!(".{layer}.png"));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_says_the_format() {
        assert_eq!(Format::of(Path::new("a/b.png")), Ok(Format::Png));
        assert_eq!(Format::of(Path::new("b.EXR")), Ok(Format::Exr));
        for bad in ["b", "b.jpg", "..", "b.png/.."] {
            assert!(Format::of(Path::new(bad)).is_err(), "{bad}");
        }
    }

    #[test]
    fn layers_are_beside_the_picture() {
        assert_eq!(
            beside(Path::new("a.b/c.d.png"), "shadow.sun"),
            Path::new("a.b/c.d.shadow.sun.png")
        );
    }
}
