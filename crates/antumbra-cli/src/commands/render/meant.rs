//! What was typed, set against the scene: views, settings, files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use antumbra::IndexOptions;
use antumbra_render::aov::Aovs;
use antumbra_render::camera::View;
use antumbra_render::exr_file;
use antumbra_render::film::{self, RenderSettings, Sampling};
use antumbra_render::orbit::camera_of_frame;
use antumbra_scene::model::Scene;

use super::files::Format;
use crate::failure::Failure;
use crate::load::{self, LitScene};
use crate::memory;
use crate::screen::Screen;
use crate::typed::{QuickCheckAction, Render, ShowWhat, Whether};
use crate::values::{Exposure, MAX_SIDE};

/// The picture's size where neither file nor command line gives one.
const DEFAULT_SIZE: [u32; 2] = [512, 512];

/// What was meant: everything but the scene, settled and checked.
pub(super) struct Meant {
    /// One view and one file a frame.
    pub(super) frames: Vec<(View, PathBuf)>,
    pub(super) format: Format,
    pub(super) size: [u32; 2],
    pub(super) settings: RenderSettings,
    pub(super) exposure: Exposure,
    /// The memory limit in it is still the whole one.
    pub(super) prepare: IndexOptions,
    pub(super) memory_limit: u64,
    /// What film and file take.
    pub(super) picture_bytes: u64,
}

impl Meant {
    pub(super) fn of(
        typed: &Render,
        format: Format,
        lit: &LitScene,
        screen: &Screen,
    ) -> Result<Self, Failure> {
        let scene = &lit.scene;
        let file_size = scene.camera.and_then(|camera| camera.resolution);
        let size = typed
            .size
            .or(file_size.map(clamped))
            .unwrap_or(DEFAULT_SIZE);
        let camera = load::camera(scene, &lit.up, typed.camera.as_ref(), size, screen)?;
        let frame_count = typed.orbit.unwrap_or(1);
        let frames = (0..frame_count)
            .map(|frame| {
                let view = View::new(&camera_of_frame(&camera, frame, frame_count), size)
                    .map_err(|error| Failure::input(error.to_string(), "give another --camera"))?;
                let path = match typed.orbit {
                    Some(_) => numbered(&typed.output, frame + 1),
                    None => typed.output.clone(),
                };
                Ok((view, path))
            })
            .collect::<Result<Vec<_>, Failure>>()?;

        let sampling = if typed.corner_rays {
            Sampling::Corners
        } else {
            Sampling::Stratified { samples: typed.spp }
        };
        let shows_fog = typed.fog.is_some() && typed.show == ShowWhat::Scene;
        let aovs = format.aovs(&typed.aov, shows_fog)?;
        let light_count = film::light_count(scene);
        let file_bytes = match format {
            // Eight bits a channel; layers follow one by one.
            Format::Png => 3 * u64::from(size[0]) * u64::from(size[1]),
            Format::Exr => exr_file::predict_bytes(size, aovs.channel_count(light_count)),
        };
        Ok(Self {
            frames,
            format,
            size,
            settings: RenderSettings {
                sampling,
                max_depth: typed.max_depth,
                light_samples: typed.more_lights.soft.samples(),
                exact_fractions: typed.more_lights.soft.is_exact(),
                colored_shadows: typed.shadows_through_glass == Whether::On,
                bumps: typed.bumps == Whether::On,
                fog: typed.fog,
                seed: typed.seed,
                show: typed.show.show(),
                aovs,
            },
            exposure: exposure(typed, format, scene, screen),
            prepare: IndexOptions {
                method: typed.shadows.method(),
                rays: typed.rays.method(),
                grid: typed.cost.grid.unwrap_or_default(),
                refinement: typed.cost.refinement(antumbra::Refine::Lazy),
                quick_check: QuickCheckAction::quick_check(typed.quick_check),
                ..IndexOptions::default()
            },
            memory_limit: memory::limit(typed.cost.memory_limit),
            picture_bytes: film::predict_bytes(size, sampling, aovs, light_count) + file_bytes,
        })
    }

    /// Returns the files that depend on the scene, by the option that asks for them: all frames of an orbit, and
    /// the layers beside each picture.
    pub(super) fn more_files<'a>(
        &'a self,
        typed: &'a Render,
        scene: &'a Scene,
    ) -> impl Iterator<Item = (&'static str, PathBuf)> + 'a {
        let frames = self.frames.iter().map(|(_, path)| path);
        let numbered = frames.clone().filter(|_| typed.orbit.is_some());
        let layers = frames.flat_map(|path| {
            let layers = self.format.layer_files(path, self.settings.aovs, scene);
            layers.into_iter().map(|layer| ("--aov", layer))
        });
        let numbered = numbered.map(|path| ("--output", path.clone()));
        numbered.chain(layers)
    }

    /// Returns the names of the layers in the figures.
    pub(super) fn layer_names(&self) -> Vec<String> {
        let Aovs {
            shadow,
            decided,
            fog,
        } = self.settings.aovs;
        [(shadow, "shadow"), (decided, "decided"), (fog, "fog")]
            .into_iter()
            .filter(|&(is_on, _)| is_on)
            .map(|(_, name)| name.to_owned())
            .collect()
    }
}

/// Settles the exposure: as typed, else automatic where light is in physical units. False colors
/// are never brightened by themselves, and OpenEXR keeps the scene's own values.
fn exposure(typed: &Render, format: Format, scene: &Scene, screen: &Screen) -> Exposure {
    match (format, typed.exposure) {
        (Format::Exr, Some(_)) => {
            screen.note("OpenEXR keeps the scene's linear values; --exposure changes PNG only");
            Exposure::Stops(0.0)
        }
        (Format::Exr, None) => Exposure::Stops(0.0),
        (Format::Png, Some(exposure)) => exposure,
        (Format::Png, None) if scene.is_photometric && typed.show == ShowWhat::Scene => {
            Exposure::Auto
        }
        (Format::Png, None) => Exposure::Stops(0.0),
    }
}

/// Keeps a size from a file within what `--size` takes.
fn clamped(size: [u32; 2]) -> [u32; 2] {
    size.map(|side| side.clamp(1, MAX_SIDE))
}

/// Returns `a/b-0007.png` for `a/b.png` and 7.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().map(OsString::from).unwrap_or_default();
    name.push(format!("-{number:04}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_before_the_ending() {
        assert_eq!(
            numbered(Path::new("a.b/c.png"), 7),
            Path::new("a.b/c-0007.png")
        );
        assert_eq!(numbered(Path::new("plain"), 12), Path::new("plain-0012"));
    }

    #[test]
    fn sizes_from_files_are_kept_in_range() {
        assert_eq!(clamped([0, 1_000_000]), [1, 16_384]);
    }
}
