//! From what was typed to a scene with lights and a camera.
//!
//! Whatever the program adds or leaves out by itself is said on standard error.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use antumbra_geometry::Short;
use antumbra_scene::model::{Camera, Light, LightKind, Scene};

use crate::failure::Failure;
use crate::memory;
use crate::outputs::Outputs;
use crate::scene_source;
use crate::screen::Screen;
use crate::typed::{IndexCost, SceneFile};
use crate::values::CameraParts;

/// The field of view for a typed camera without one.
const DEFAULT_FOV_DEGREES: f64 = 45.0;

/// A scene that can be lit.
#[derive(Debug)]
pub(crate) struct LitScene {
    pub(crate) scene: Scene,
    /// How long reading took.
    pub(crate) load_time: Duration,
    /// The files that it was read from.
    pub(crate) files: Vec<PathBuf>,
}

/// Reads a scene and settles its lights: as typed, else the file's, else a sun. Settles what is
/// behind everything, too. Refuses to go on where one of the outputs is a file of the scene.
pub(crate) fn lit_scene(
    typed: &SceneFile,
    cost: &IndexCost,
    outputs: &Outputs,
    screen: &Screen,
) -> Result<LitScene, Failure> {
    outputs.spare([&typed.scene])?;
    let limit = memory::limit(cost.memory_limit);
    memory::check_file(&typed.scene, limit)?;
    let begin = Instant::now();
    let loaded = scene_source::read(&typed.scene, typed.up, limit)?;
    let load_time = begin.elapsed();
    outputs.spare(&loaded.files)?;
    loaded
        .warnings
        .iter()
        .for_each(|warning| screen.warning(warning));

    let mut scene = loaded.scene;
    let up = scene_source::up(&scene, typed.up);
    let point_lights = typed
        .lights
        .iter()
        .enumerate()
        .map(|(number, light)| Light {
            name: format!("light {}", number + 1),
            kind: LightKind::Point {
                position: light.position,
            },
            color: light.color,
            falls_off: false,
        });
    if let Some(sun) = typed.sun
        && sun.elevation_degrees < 0.0
    {
        screen.note(format!(
            "the sun of --sun is {} degrees below the horizon: it shines from below",
            Short(-sun.elevation_degrees)
        ));
    }
    let suns = typed.sun.map(|sun| scene_source::sun(sun, up));
    let typed_lights: Vec<Light> = point_lights.chain(suns).collect();
    if !typed_lights.is_empty() {
        if !scene.lights.is_empty() {
            let count = scene.lights.len();
            screen.note(format!(
                "--light and --sun replace the file's lights ({count})"
            ));
        }
        scene.lights = typed_lights;
        // What is typed has no unit: it is meant to be shown as it is.
        scene.is_photometric = false;
    } else if scene.lights.is_empty() {
        screen.note("the scene has no light; taking a sun (choose one with --sun or --light)");
        scene.lights.push(scene_source::default_sun(up));
    }
    let sky = scene_source::sky(&typed.scene, &scene);
    scene.background = typed.background.or(sky).unwrap_or(scene.background);
    Ok(LitScene {
        scene,
        load_time,
        files: loaded.files,
    })
}

/// Settles the camera: as typed, else the file's, else one that frames the scene.
pub(crate) fn camera(
    scene: &Scene,
    file: &SceneFile,
    typed: Option<&CameraParts>,
    size: [u32; 2],
    screen: &Screen,
) -> Result<Camera, Failure> {
    let up = scene_source::up(scene, file.up);
    let Some(parts) = typed else {
        return Ok(scene.camera.unwrap_or_else(|| {
            screen.note("the scene has no camera; taking one that frames it (--camera sets one)");
            scene_source::frame_camera(scene, up, size)
        }));
    };
    let due = |part: Option<_>, from_file: Option<_>, name: &str| {
        part.or(from_file).ok_or_else(|| {
            Failure::input(
                format!(
                    "--camera leaves out `{name}`, and the scene has no camera to take it from"
                ),
                "give eye:X,Y,Z and at:X,Y,Z",
            )
        })
    };
    let base = scene.camera.as_ref();
    Ok(Camera {
        eye: due(parts.eye, base.map(|camera| camera.eye), "eye")?,
        at: due(parts.at, base.map(|camera| camera.at), "at")?,
        up: parts.up.or(base.map(|camera| camera.up)).unwrap_or(up),
        vertical_fov_degrees: parts
            .fov_degrees
            .or(base.map(|camera| camera.vertical_fov_degrees))
            .unwrap_or(DEFAULT_FOV_DEGREES),
        resolution: base.and_then(|camera| camera.resolution),
    })
}
