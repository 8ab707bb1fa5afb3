//! Rendering to arrays.
//!
//! In: a scene, lights, a camera, settings. Out: linear colors and layers as arrays, or a PNG of such colors.
//! Invariant: the picture is the program's for the same settings.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use antumbra_files::Identity;
use antumbra_geometry::DVec3;
use antumbra_render::aov::{Aovs, DECIDED_LAYER, DecidedBy, FOG_LAYER, Layer, TRANSMITTANCE_LAYER};
use antumbra_render::camera::View;
use antumbra_render::exposure::Metering;
use antumbra_render::film::{
    self, Picture, RenderSettings, Rendered, Sampling, Show, Watch, Window,
};
use antumbra_render::fog::Fog;
use antumbra_render::prepare::Prepared;
use antumbra_render::{exr_file, image_file};
use antumbra_scene::defaults;
use antumbra_scene::model::{Bump, Camera};
use numpy::{
    PyArray1, PyArray3, PyArrayMethods as _, PyReadonlyArray3, PyUntypedArrayMethods as _,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::area::{AreaTuple, area_light};
use crate::error::ToPython as _;
use crate::index::Settings;
use crate::lights::{LightTuple, from_tuples};
use crate::scene::Scene;
use crate::work::{Progress, stoppable, watched};

/// Eye, at, up, vertical field of view in degrees.
type CameraTuple = ([f64; 3], [f64; 3], [f64; 3], f64);

/// What a picture depends on besides scene, lights and camera.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PictureSettings {
    size: [u32; 2],
    samples: u32,
    max_depth: u32,
    seed: u64,
    light_samples: u32,
    exact_fractions: bool,
    colored_shadows: bool,
    bumps: bool,
    /// Kind, height and size of a relief for all surfaces.
    bump: Option<(String, f64, f64)>,
    area_lights: Vec<AreaTuple>,
    shows_occlusion: bool,
    background: Option<[f64; 3]>,
    /// Density, albedo, g.
    fog: Option<[f64; 3]>,
}

/// A scene with its lights, ready to be looked at by one camera.
#[pyclass(frozen, module = "antumbra._antumbra")]
pub(crate) struct Renderer {
    prepared: Prepared,
    view: View,
    shown: RenderSettings,
    samples: u32,
    threads: usize,
}

#[pymethods]
impl Renderer {
    /// Makes values and lists. Lights and camera left out are the scene's, or a sun and a camera that frames the scene.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        lights: Option<Vec<LightTuple>>,
        camera: Option<CameraTuple>,
        picture: PictureSettings,
        settings: Settings,
        occlusion: Option<PathBuf>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let lights = lights.map(from_tuples).transpose()?;
        let area_lights = picture.area_lights.into_iter().map(area_light);
        let area_lights = area_lights.collect::<PyResult<Vec<_>>>()?;
        let options = settings.options()?;
        let model = &*scene.model;
        let size = picture.size;
        let camera = match camera {
            Some((eye, at, up, vertical_fov_degrees)) => Camera {
                eye: DVec3::from_array(eye),
                at: DVec3::from_array(at),
                up: DVec3::from_array(up),
                vertical_fov_degrees,
                resolution: None,
            },
            None => model.camera.unwrap_or_else(|| {
                let aspect = f64::from(size[0]) / f64::from(size[1]);
                defaults::frame_camera_for(&model.bounds(), model.up, aspect)
            }),
        };
        let view = View::new(&camera, size).map_err(|error| error.to_python())?;
        let fog = picture.fog.map(|[density, albedo, g]| {
            Fog::new(density, albedo, g)
                .map_err(|error| PyValueError::new_err(format!("fog: {error}")))
        });
        let fog = fog.transpose()?;
        let shown = RenderSettings {
            sampling: Sampling::Stratified {
                samples: picture.samples,
            },
            max_depth: picture.max_depth,
            light_samples: picture.light_samples,
            exact_fractions: picture.exact_fractions,
            colored_shadows: picture.colored_shadows,
            bumps: picture.bumps,
            fog,
            seed: picture.seed,
            show: if picture.shows_occlusion {
                Show::Occlusion
            } else {
                Show::Scene
            },
            aovs: Aovs {
                shadow: true,
                decided: true,
                fog: fog.is_some(),
            },
        };
        let bump = picture.bump.map(|(kind, height, size)| {
            let bump = Bump::in_space(&kind, height, size);
            bump.map_err(|error| PyValueError::new_err(format!("bumps: {error}")))
        });
        let bump = bump.transpose()?;
        let progress = Progress::new(progress);
        let prepared = watched(py, settings.threads, &progress, |_| {
            let mut model = model.clone();
            if let Some(lights) = lights {
                model.lights = lights;
                model.area_lights = area_lights;
                model.is_photometric = false;
            } else if model.lights.is_empty() {
                model.lights.push(defaults::default_sun(model.up));
            }
            if bump.is_some() {
                for material in &mut model.materials {
                    material.bump = bump;
                }
            }
            if let Some(background) = picture.background {
                model.background = DVec3::from_array(background);
            }
            let gathered = scene.gathered.clone();
            Prepared::of_gathered_from(model, gathered, &options, occlusion.as_deref())
        })?;
        Ok(Self {
            prepared: prepared.map_err(|error| error.to_python())?,
            view,
            shown,
            samples: picture.samples,
            threads: settings.threads,
        })
    }

    /// Renders a window of the picture: column and row of its first pixel, its width and height.
    ///
    /// Returns colors (height, width, 3), shares of samples that each light reaches (lights, height, width), how
    /// queries were decided (ways, height, width), with fog its red, green and blue and what the air leaves (4, height,
    /// width), names of lights and ways, parts of an automatic exposure, counts.
    #[expect(clippy::type_complexity, reason = "a tuple for Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        first: [u32; 2],
        size: [u32; 2],
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(
        Bound<'py, PyArray3<f32>>,
        Bound<'py, PyArray3<f32>>,
        Bound<'py, PyArray3<f32>>,
        Bound<'py, PyArray3<f32>>,
        Vec<String>,
        Vec<String>,
        (i128, u64),
        Bound<'py, PyDict>,
    )> {
        let [width, height] = size.map(|side| side as usize);
        let progress = Progress::new(progress);
        let (done, count) = (
            AtomicU64::new(0),
            u64::from(size[0]) * u64::from(size[1]) * u64::from(self.samples),
        );
        let rendered = watched(py, self.threads, &progress, |task| {
            let watch = Watch {
                task,
                progress: &|samples| {
                    let done = samples + done.fetch_add(samples, Ordering::Relaxed);
                    progress.note("rendering", done, count);
                },
            };
            let window = Window { first, size };
            film::render_window(&self.prepared, &self.view, window, &self.shown, watch)
        })?;
        let is_metered = self.prepared.scene().is_photometric && self.shown.show == Show::Scene;
        let metered = if is_metered {
            rendered.metering.parts()
        } else {
            (0, 0)
        };
        let counts = counts(py, &rendered)?;
        let light_count = film::light_count(self.prepared.scene());
        let mut masks = Vec::with_capacity(light_count * width * height);
        let (mut decided, mut air) = (Vec::new(), Vec::new());
        let (mut light_names, mut ways) = (Vec::new(), Vec::new());
        for layer in &rendered.layers {
            let light = layer.name.strip_prefix("shadow.");
            for (channel, plane) in &layer.channels {
                if [FOG_LAYER, TRANSMITTANCE_LAYER].contains(&&*layer.name) {
                    air.extend_from_slice(plane);
                } else if let Some(light) = light {
                    light_names.push(light.to_owned());
                    masks.extend_from_slice(plane);
                } else {
                    ways.push((*channel).to_owned());
                    decided.extend_from_slice(plane);
                }
            }
        }
        let colors = rendered.picture.pixels.into_flattened();
        let air_planes = if self.shown.fog.is_some() { 4 } else { 0 };
        Ok((
            PyArray1::from_vec(py, colors).reshape([height, width, 3])?,
            PyArray1::from_vec(py, masks).reshape([light_count, height, width])?,
            PyArray1::from_vec(py, decided).reshape([ways.len(), height, width])?,
            PyArray1::from_vec(py, air).reshape([air_planes, height, width])?,
            light_names,
            ways,
            metered,
            counts,
        ))
    }
}

/// Returns the stops of an automatic exposure from the parts of all windows of a picture, added up.
#[pyfunction]
pub(crate) fn stops_of(log_sum: i128, count: u64) -> f64 {
    Metering::of_parts(log_sum, count).stops()
}

/// Counts of the figures' schema.
fn counts<'py>(py: Python<'py>, rendered: &Rendered) -> PyResult<Bound<'py, PyDict>> {
    use antumbra_render::statistics::{BumpCounts, Rays, ShadowQueries};
    let bumps = BumpCounts::from(&rendered.tally);
    let rays = Rays::from(&rendered.tally);
    let shadow = ShadowQueries::from(&rendered.tally);
    let counts = PyDict::new(py);
    counts.set_item("primary", rays.primary)?;
    counts.set_item("primary_hits", rays.primary_hits)?;
    counts.set_item("queries", shadow.queries)?;
    counts.set_item("facing_away", shadow.facing_away)?;
    counts.set_item("out_of_cone", shadow.out_of_cone)?;
    counts.set_item("first_pass", shadow.first_pass)?;
    counts.set_item("intermediate", shadow.intermediate)?;
    counts.set_item("blocker_list", shadow.blocker_list)?;
    counts.set_item("rays", shadow.rays)?;
    counts.set_item("shadowed", shadow.shadowed)?;
    counts.set_item("on_bumps", bumps.queries)?;
    counts.set_item("perturbed", bumps.perturbed)?;
    Ok(counts)
}

/// Writes linear colors as PNG, brightened by two to the power of `stops`; never over one of the files `read`.
#[pyfunction]
pub(crate) fn write_png(
    py: Python<'_>,
    path: PathBuf,
    colors: PyReadonlyArray3<'_, f32>,
    stops: f64,
    read: Vec<PathBuf>,
) -> PyResult<()> {
    check_target(&path, &read)?;
    let picture = picture_of(&colors)?;
    stoppable(py, 0, |_| {
        image_file::write_png(&path, &picture, stops).map_err(|error| error.to_python())
    })?
}

/// Writes linear colors and layers as OpenEXR, never over one of the files `read`: `shadow` of shape (lights, height,
/// width) with a name for each light, `decided` of shape (ways, height, width), `air` of shape (4 or 0, height, width).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
pub(crate) fn write_exr(
    py: Python<'_>,
    path: PathBuf,
    colors: PyReadonlyArray3<'_, f32>,
    light_names: Vec<String>,
    shadow: PyReadonlyArray3<'_, f32>,
    decided: PyReadonlyArray3<'_, f32>,
    air: PyReadonlyArray3<'_, f32>,
    read: Vec<PathBuf>,
) -> PyResult<()> {
    check_target(&path, &read)?;
    let picture = picture_of(&colors)?;
    let pixels = picture.pixels.len();
    let planes = |array: &PyReadonlyArray3<'_, f32>| -> PyResult<Vec<Vec<f32>>> {
        if array.len() != array.shape()[0] * pixels {
            return Err(PyValueError::new_err("layers: expected the picture's size"));
        }
        let planes = array.as_slice()?.chunks(pixels.max(1));
        Ok(planes.map(<[f32]>::to_vec).collect())
    };
    let (masks, ways, air) = (planes(&shadow)?, planes(&decided)?, planes(&air)?);
    let mask = |(name, plane): (String, _)| Layer {
        name: format!("shadow.{name}"),
        channels: vec![("Y", plane)],
    };
    let mut layers: Vec<_> = light_names.into_iter().zip(masks).map(mask).collect();
    if !ways.is_empty() {
        let names = DecidedBy::ALL.map(DecidedBy::channel_name);
        layers.push(Layer {
            name: DECIDED_LAYER.to_owned(),
            channels: names.into_iter().zip(ways).collect(),
        });
    }
    if let Ok([r, g, b, left]) = <[Vec<f32>; 4]>::try_from(air) {
        let light = [("R", r), ("G", g), ("B", b)];
        layers.push(Layer {
            name: FOG_LAYER.to_owned(),
            channels: light.into(),
        });
        layers.push(Layer {
            name: TRANSMITTANCE_LAYER.to_owned(),
            channels: vec![("Y", left)],
        });
    }
    stoppable(py, 0, |_| {
        exr_file::write_exr(&path, &picture, &layers).map_err(|error| error.to_python())
    })?
}

/// Returns linear colors as sRGB bytes, brightened by two to the power of `stops`: those of the PNG.
#[pyfunction]
pub(crate) fn to_srgb<'py>(
    py: Python<'py>,
    colors: PyReadonlyArray3<'py, f32>,
    stops: f64,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let picture = picture_of(&colors)?;
    let [width, height] = picture.size.map(|side| side as usize);
    let bytes = stoppable(py, 0, |_| image_file::srgb_bytes(&picture, stops))?;
    PyArray1::from_vec(py, bytes).reshape([height, width, 3])
}

/// Refuses a file that a scene was read from.
fn check_target(path: &Path, read: &[PathBuf]) -> PyResult<()> {
    let target = Identity::of(path);
    if let Some(read) = read.iter().find(|read| Identity::of(read) == target) {
        let read = read.display();
        let message = format!(
            "{}: the scene was read from this file ({read})",
            path.display()
        );
        return Err(PyValueError::new_err(message));
    }
    Ok(())
}

fn picture_of(colors: &PyReadonlyArray3<'_, f32>) -> PyResult<Picture> {
    let shape = colors.shape();
    let size = [shape[1], shape[0]].map(u32::try_from);
    let ([Ok(width), Ok(height)], 3) = (size, shape[2]) else {
        let message = format!("colors: expected shape (height, width, 3), found {shape:?}");
        return Err(PyValueError::new_err(message));
    };
    Ok(Picture {
        size: [width, height],
        pixels: colors.as_slice()?.as_chunks().0.to_vec(),
    })
}
