//! Every call into `antumbra-scene` that is more than its data.

use std::path::Path;

use antumbra_geometry::{AreaError, AreaShape, DVec3, SunDisc};
use antumbra_scene::model::{AreaLight, Camera, Color, Light, Scene};
use antumbra_scene::{Loaded, ReadOptions, UpAxis, Warning, defaults, generate, read_file, write};
use clap::builder::{PossibleValue, PossibleValuesParser};

use crate::failure::Failure;
use crate::typed::Up;
use crate::values::Sun;

/// Reads a scene file, taking no more than `memory_limit` bytes.
pub fn read(path: &Path, up: Option<Up>, memory_limit: u64) -> Result<Loaded, Failure> {
    let up = up.map(|up| match up {
        Up::Y => UpAxis::Y,
        Up::Z => UpAxis::Z,
    });
    let options = ReadOptions { up, memory_limit };
    Ok(read_file(path, &options)?)
}

/// Returns which way is up: as typed, else as the scene says.
pub fn up(scene: &Scene, typed: Option<Up>) -> DVec3 {
    match typed {
        Some(Up::Y) => DVec3::Y,
        Some(Up::Z) => DVec3::Z,
        None => scene.up,
    }
}

/// Writes a scene file; returns what its format has no place for.
pub fn write(scene: &Scene, path: &Path) -> Result<Vec<Warning>, Failure> {
    use write::WriteError;
    let is_curved = |what: &str| write::CURVED.contains(&what);
    write::write_file(scene, path).map_err(|error| match &error {
        WriteError::Io(_) | WriteError::File { .. } => Failure::system(error.to_string()),
        WriteError::Unsupported { what, .. } if is_curved(what) => {
            Failure::input(error.to_string(), "convert --tessellate N makes it a mesh")
        }
        _ => Failure::input(error.to_string(), ""),
    })
}

/// Returns what is behind everything, where a scene's format has no word for it. Scenes with light
/// in candela and lux stay black: no constant suits all exposures.
pub fn sky(path: &Path, scene: &Scene) -> Option<Color> {
    let ending = path.extension()?.to_ascii_lowercase();
    let is_silent = ["obj", "gltf", "glb", "ply", "stl"].contains(&ending.to_str()?);
    (is_silent && !scene.is_photometric).then_some(defaults::SKY)
}

/// Returns a camera that sees the whole scene in a picture of `size` pixels.
pub fn frame_camera(scene: &Scene, up: DVec3, size: [u32; 2]) -> Camera {
    let [width, height] = size.map(f64::from);
    defaults::frame_camera_for(&scene.bounds(), up, width / height)
}

/// Returns the sun for scenes without light.
pub fn default_sun(up: DVec3) -> Light {
    defaults::default_sun(up)
}

/// Returns a sun at a place of the sky.
pub fn sun(sun: Sun, up: DVec3) -> Light {
    defaults::sun(sun.azimuth_degrees, sun.elevation_degrees, up)
}

/// Returns a sun with the size that was typed.
pub fn sun_disc(sun: Sun, up: DVec3) -> Result<AreaLight, AreaError> {
    let towards = defaults::towards_sun(sun.azimuth_degrees, sun.elevation_degrees, up);
    let disc = SunDisc::new(towards, sun.diameter_degrees.unwrap_or_default())?;
    let Light { name, color, .. } = self::sun(sun, up);
    Ok(AreaLight {
        name,
        shape: AreaShape::SunDisc(disc),
        color,
        falls_off: false,
    })
}

/// Returns what reads the name of a built-in scene.
pub fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(generate::NAMES.map(|(name, size)| {
        let help = format!("{}; size {size} by default", what_is(name));
        PossibleValue::new(name).help(help)
    }))
}

/// Returns what a built-in scene shows.
fn what_is(name: &str) -> &'static str {
    match name {
        "tetra" => "Tetrahedra of tetrahedra (Paper 8.1, SPD)",
        "sphereflake" => "Spheres on spheres (SPD)",
        "flakes" => "Spheres on spheres, as the paper has them (Paper 8.1)",
        "graph" => "Bar chart on a floor (Paper 8.1)",
        "quadric" => "Spheres, cones and cylinders (Paper 8.1)",
        "dgp" => "Letters D, G and P of flat strokes (Paper 8.1)",
        "bars" => "Lattice of bars over a floor (Paper 8.1)",
        "rooms" => "Flat of rooms with many lights",
        "city" => "Boxes of many sizes along streets",
        "glazed-city" => "The city with a window in every wall",
        "town" => "Gabled houses around courtyards",
        "forest" => "Trees of loose leaves",
        "heightfield" => "Hills, as one large mesh",
        "window" => "Room with a window of colored panes; for .glb and .obj",
        "teapot" => "Newell's teapot of 32 bicubic patches; the size is their level",
        "knot" => "Trefoil knot of rings (implicit surfaces)",
        "metaballs" => "Balls that melt together (an implicit surface)",
        "gyroid" => "Cube of a gyroid (an implicit surface); the size is periods a side",
        _ => "Built-in scene",
    }
}

/// Makes a built-in scene.
pub fn generate(name: &str, size: Option<u32>, lights: Option<u32>) -> Result<Scene, Failure> {
    generate::by_name(name, size, lights).map_err(|error| Failure::input(error.to_string(), ""))
}

/// Returns a scene as NFF text, with the six digits of the SPD programs, so that figures for a
/// built-in scene and for the published file of the same name are comparable.
pub fn nff(scene: &Scene) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    write::write_nff(scene, write::Precision::SixDigits, &mut bytes).map_err(|error| {
        Failure::input(format!("cannot write NFF: {error}"), "write .glb or .obj")
    })?;
    Ok(bytes)
}
