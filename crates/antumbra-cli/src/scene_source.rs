//! Every call into `antumbra-scene` that is more than its data.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::model::{Camera, Light, Scene};
use antumbra_scene::{Loaded, ReadOptions, UpAxis, defaults, generate, read_file, write};

use crate::failure::Failure;
use crate::typed::Up;
use crate::values::Sun;

/// Reads a scene file.
pub(crate) fn read(path: &Path, up: Option<Up>) -> Result<Loaded, Failure> {
    let up = up.map(|up| match up {
        Up::Y => UpAxis::Y,
        Up::Z => UpAxis::Z,
    });
    Ok(read_file(path, &ReadOptions { up })?)
}

/// Returns which way is up: as typed, else as the scene says.
pub(crate) fn up(scene: &Scene, typed: Option<Up>) -> DVec3 {
    match typed {
        Some(Up::Y) => DVec3::Y,
        Some(Up::Z) => DVec3::Z,
        None => scene.up,
    }
}

/// Returns a camera that sees the whole scene.
pub(crate) fn frame_camera(scene: &Scene, up: DVec3) -> Camera {
    defaults::frame_camera(&scene.bounds(), up)
}

/// Returns the sun for scenes without light.
pub(crate) fn default_sun(up: DVec3) -> Light {
    defaults::default_sun(up)
}

/// Returns a sun at a place of the sky.
pub(crate) fn sun(sun: Sun, up: DVec3) -> Light {
    defaults::sun(sun.azimuth_degrees, sun.elevation_degrees, up)
}

/// Checks the name of a built-in scene.
pub(crate) fn name(text: &str) -> Result<String, String> {
    let known = generate::NAMES.map(|(name, _)| name);
    if known.contains(&text) {
        Ok(text.to_owned())
    } else {
        Err(format!(
            "no such scene; expected one of {}",
            known.join(", ")
        ))
    }
}

/// Makes a built-in scene.
pub(crate) fn generate(name: &str, size: Option<u32>) -> Result<Scene, Failure> {
    generate::by_name(name, size).map_err(|error| Failure::input(error.to_string(), ""))
}

/// Returns a scene as NFF text, with the six digits of the SPD programs, so that figures for a
/// built-in scene and for the published file of the same name are comparable.
pub(crate) fn nff(scene: &Scene) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    write::write_nff(scene, write::Precision::SixDigits, &mut bytes)
        .map_err(|error| Failure::system(format!("cannot write NFF: {error}")))?;
    Ok(bytes)
}
