//! The picture of a study: the scene in the colors of what its sensors have.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_render::camera::View;
use antumbra_render::color_map::inferno;
use antumbra_render::film::Picture;
use antumbra_render::image_file::write_png;
use antumbra_render::prepare::Prepared;
use antumbra_render::{legend, value_picture};
use antumbra_scene::model::{Color, Scene};
use antumbra_sun::{NearestSensors, Study, Sums};

use crate::failure::Failure;
use crate::load::{self, Up};
use crate::screen::Screen;
use crate::typed::SunStudy;

/// Size where neither file nor command line gives one.
const DEFAULT_SIZE: [u32; 2] = [800, 600];

/// Samples of a pixel.
const SAMPLES: u32 = 4;

/// Linear grey of faces without sensors.
const GREY: f64 = 0.4;

/// Numbers that a picture shows.
pub(super) struct Shown<'a> {
    /// A number a sensor.
    pub(super) list: &'a [f64],
    /// Its unit, in up to two short lines.
    pub(super) unit: [&'static str; 2],
}

/// Returns what a study is mostly about: irradiation, else hours, else the visible share of the sky.
pub(super) fn shown(sums: &Sums) -> Option<Shown<'_>> {
    let choices = [
        (&sums.total, ["kWh/m2", "sun, sky"]),
        (&sums.irradiation, ["kWh/m2", "direct"]),
        (&sums.hours, ["hours", "of sun"]),
        (&sums.sky_visible, ["share of", "the sky"]),
    ];
    choices.into_iter().find_map(|(list, unit)| {
        Some(Shown {
            list: list.as_ref()?,
            unit,
        })
    })
}

/// Scene of a study, once it was asked.
pub(super) struct Looked {
    pub(super) prepared: Prepared,
    pub(super) up: Up,
    /// Statements about suns and sensors that a user should hear of.
    pub(super) notes: Vec<String>,
}

/// Returns whether a picture is made: sensors in space lie on nothing that could be colored.
pub(super) fn is_drawn(typed: &SunStudy) -> bool {
    let is_on_faces = typed.sensors.is_some() || typed.on_surface;
    is_on_faces && (typed.picture.is_some() || typed.report.is_some())
}

/// Refuses a picture that cannot be made, before anything is computed.
pub(super) fn check(typed: &SunStudy) -> Result<(), Failure> {
    if let Some(path) = &typed.picture
        && !is_png(path)
    {
        let message = format!(
            "{} ends like nothing that --picture can write",
            path.display()
        );
        return Err(Failure::input(
            message,
            "give --picture a name that ends in .png",
        ));
    }
    if typed.picture.is_some() && typed.points.is_some() && !typed.on_surface {
        return Err(Failure::input(
            "--picture: points of space lie on no face to be drawn",
            "give --on-surface, or --sensors grid:SPACING",
        ));
    }
    Ok(())
}

fn is_png(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}

/// Returns the size of the picture, legend included.
pub(super) fn size(typed: &SunStudy, scene: &Scene) -> Result<[u32; 2], Failure> {
    let of_file = scene.camera.and_then(|camera| camera.resolution);
    let size = typed.size.or(of_file).unwrap_or(DEFAULT_SIZE);
    let least = [2 * legend::width(size[1]), legend::LEAST_HEIGHT];
    if size[0] < least[0] || size[1] < least[1] {
        return Err(Failure::input(
            format!(
                "a picture of {}x{} pixels has no room for a legend",
                size[0], size[1]
            ),
            format!("give --size {}x{} or more", least[0], least[1]),
        ));
    }
    Ok(size)
}

/// Returns the bytes that a picture takes, before any is taken.
pub(super) fn predict_bytes(size: [u32; 2], sensors: usize) -> u64 {
    // With the legend it is there once more; then as bytes.
    let sheet = u64::from(size[0]) * u64::from(size[1]) * 15;
    value_picture::predict_bytes(size) + sheet + NearestSensors::predict_bytes(sensors)
}

/// Draws what `shown` says of each place: the number of the nearest sensor of the same face and side. Faces without
/// sensors are grey.
pub(super) fn draw(
    typed: &SunStudy,
    looked: &Looked,
    study: &Study,
    shown: &Shown<'_>,
    screen: &Screen,
) -> Result<Picture, Failure> {
    let Looked { prepared, up, .. } = looked;
    let scene = prepared.scene();
    let [width, height] = size(typed, scene)?;
    let size = [width - legend::width(height), height];
    let camera = load::camera(scene, up, typed.camera.as_ref(), size, screen)?;
    let view = View::new(&camera, size)
        .map_err(|error| Failure::input(error.to_string(), "give another --camera"))?;
    let occluders = prepared.gathered().occluders();
    let nearest = NearestSensors::of(study, occluders).ok_or_else(|| {
        Failure::input(
            "the sensors lie on no faces of the scene",
            "give --sensors grid:SPACING",
        )
    })?;
    let most = shown.list.iter().copied().fold(0.0, f64::max);
    let grey = Color::splat(GREY);
    let color = |found: &antumbra_render::integrator::SurfacePoint<'_>| {
        let (surface, point): (_, DVec3) = (found.hit.surface, found.hit.point);
        let sensor = nearest.nearest(occluders, surface, found.viewer_side < 0, point);
        sensor.map_or(grey, |sensor| inferno(shown.list[sensor] / most))
    };
    let picture = value_picture::value_picture(prepared, &view, SAMPLES, Color::ONE, &color);
    Ok(legend::with_legend(&picture, most, &shown.unit))
}

/// Writes a picture.
pub(super) fn write(path: &Path, picture: &Picture) -> Result<(), Failure> {
    write_png(path, picture, 0.0).map_err(|error| Failure::system(error.to_string()))
}
