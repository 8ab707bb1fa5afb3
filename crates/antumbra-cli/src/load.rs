//! From what was typed to a scene with lights and a camera.
//!
//! Whatever the program adds or leaves out by itself is said on standard error.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use antumbra_geometry::{DVec3, Short};
use antumbra_scene::gather::emissive_lights;
use antumbra_scene::model::{Camera, Scene};
use antumbra_scene::{Lights, read_lights};

use crate::failure::Failure;
use crate::light_values::{LightValue, SceneLight};
use crate::memory;
use crate::outputs::Outputs;
use crate::scene_source;
use crate::screen::Screen;
use crate::typed::{IndexCost, MoreLights, SceneFile};
use crate::values::CameraParts;

/// The field of view for a typed camera without one.
const DEFAULT_FOV_DEGREES: f64 = 45.0;

/// A scene that can be lit.
#[derive(Debug)]
pub struct LitScene {
    pub scene: Scene,
    /// How long reading took.
    pub load_time: Duration,
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
    /// Which way is up.
    pub up: Up,
    /// Whether the only light is a sun that neither the file nor the command line has.
    pub is_sun_invented: bool,
}

/// Which way is up, and whether that is a guess that the user has to hear of.
#[derive(Debug)]
pub struct Up {
    pub direction: DVec3,
    /// Whether neither the file nor `--up` says it.
    pub is_assumed: bool,
    is_said: AtomicBool,
}

impl Up {
    /// Says once which axis is taken for up, where that is a guess; `what` depends on it.
    pub fn say(&self, what: &str, screen: &Screen) {
        if self.is_assumed && !self.is_said.swap(true, Ordering::Relaxed) {
            let (axis, other) = match self.direction == DVec3::Z {
                true => ("+z", "y"),
                false => ("+y", "z"),
            };
            screen.note(format!(
                "the file does not say which way is up: taking {axis} for {what} (--up {other} for +{other})"
            ));
        }
    }
}

/// Whether a command asks about lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lighting {
    /// A scene without lights gets a sun, and a note says so.
    Needed,
    /// A scene without lights gets a sun; the command itself says that it is invented.
    Listed,
    /// No light plays a part.
    Unneeded,
}

/// Reads a scene and settles its lights: as typed, else the file's, else a sun. Settles what is
/// behind everything, too. Refuses to go on where one of the outputs is a file of the scene.
pub fn lit_scene(
    typed: &SceneFile,
    cost: &IndexCost,
    outputs: &Outputs,
    screen: &Screen,
) -> Result<LitScene, Failure> {
    let has_size = typed.sun.is_some_and(|sun| sun.diameter_degrees.is_some())
        || typed.lights.iter().any(LightValue::has_size);
    if has_size {
        return Err(Failure::input(
            "lights with size have no values or maps of their own, which this command is about",
            "give points, spots, or a sun without a diameter; render, query, verify and inspect take lights with size",
        ));
    }
    any_lit_scene(typed, None, Lighting::Needed, cost, outputs, screen)
}

/// Reads a scene as [`lit_scene`] does, with lights with size too.
pub fn any_lit_scene(
    typed: &SceneFile,
    more: Option<&MoreLights>,
    lighting: Lighting,
    cost: &IndexCost,
    outputs: &Outputs,
    screen: &Screen,
) -> Result<LitScene, Failure> {
    outputs.spare(more.and_then(|more| more.file.as_ref()))?;
    outputs.spare([&typed.scene])?;
    let limit = memory::limit(cost.memory_limit);
    memory::check_file(&typed.scene, limit)?;
    let begin = Instant::now();
    let loaded = scene_source::read(&typed.scene, typed.up, limit)?;
    let load_time = begin.elapsed();
    let mut files = loaded.files;
    outputs.spare(&files)?;
    loaded
        .warnings
        .iter()
        .for_each(|warning| screen.warning(warning));

    let mut scene = match typed.tessellate {
        Some(cells) => loaded.scene.tessellated(cells),
        None => loaded.scene,
    };
    let up = Up {
        direction: scene_source::up(&scene, typed.up),
        is_assumed: loaded.is_up_assumed,
        is_said: AtomicBool::default(),
    };
    let from_file = more.and_then(|more| more.file.as_ref());
    files.extend(from_file.cloned());
    if lighting == Lighting::Unneeded {
        return Ok(LitScene {
            scene,
            load_time,
            files,
            up,
            is_sun_invented: false,
        });
    }
    let chosen = chosen_lights(typed, more, &up, limit, screen)?;
    let of_lights = typed.lights.iter().filter_map(LightValue::sun);
    let of_lights = of_lights.map(|sun| ("--light", sun));
    for (option, sun) in of_lights.chain(typed.sun.map(|sun| ("--sun", sun))) {
        if sun.elevation_degrees < 0.0 {
            screen.note(format!(
                "the sun of {option} is {} degrees below the horizon: it shines from below",
                Short(-sun.elevation_degrees)
            ));
        }
    }
    if let Some(chosen) = chosen {
        if !scene.lights.is_empty() {
            let count = scene.lights.len();
            let options = match from_file {
                Some(_) => "--light, --lights and --sun",
                None => "--light and --sun",
            };
            screen.note(format!("{options} replace the file's lights ({count})"));
        }
        scene.lights = chosen.lights;
        scene.area_lights = chosen.area_lights;
        // What is typed has no unit: it is meant to be shown as it is.
        scene.is_photometric = false;
    }
    if more.is_some_and(|more| more.emissive) {
        let emissive = emissive_lights(&scene)?;
        if emissive.is_empty() {
            screen.note("--emissive-lights: no face of the scene emits light");
        }
        scene.area_lights.extend(emissive);
    }
    let is_sun_invented = scene.lights.is_empty() && scene.area_lights.is_empty();
    if is_sun_invented {
        if lighting == Lighting::Needed {
            screen.note("the scene has no light; taking a sun (choose one with --sun or --light)");
            up.say("the sun", screen);
        }
        scene.lights.push(scene_source::default_sun(up.direction));
    }
    let sky = scene_source::sky(&typed.scene, &scene);
    scene.background = typed.background.or(sky).unwrap_or(scene.background);
    Ok(LitScene {
        scene,
        load_time,
        files,
        up,
        is_sun_invented,
    })
}

/// Returns the lights that replace the file's; `None` if none were asked for.
fn chosen_lights(
    typed: &SceneFile,
    more: Option<&MoreLights>,
    up: &Up,
    memory_limit: u64,
    screen: &Screen,
) -> Result<Option<Lights>, Failure> {
    let from_file = more.and_then(|more| more.file.as_ref());
    if typed.lights.is_empty() && typed.sun.is_none() && from_file.is_none() {
        return Ok(None);
    }
    let mut chosen = Lights::default();
    if typed.sun.is_some() {
        up.say("--sun", screen);
    }
    let is_sky = |light: &LightValue| matches!(light, LightValue::Sky { .. });
    if typed.lights.iter().any(is_sky) {
        up.say("the sky", screen);
    }
    if typed.lights.iter().any(|light| light.sun().is_some()) {
        up.say("the sun", screen);
    }
    for (number, light) in typed.lights.iter().enumerate() {
        let name = format!("light {}", number + 1);
        let light = light.clone().into_light(name, up.direction);
        match light.map_err(|error| Failure::input(error.to_string(), ""))? {
            SceneLight::Plain(light) => chosen.lights.push(light),
            SceneLight::Area(light) => chosen.area_lights.push(light),
        }
    }
    if let Some(path) = from_file {
        let of_file = read_lights(path, up.direction, memory_limit)?;
        if of_file.depend_on_up {
            up.say("suns and skies of --lights", screen);
        }
        chosen.lights.extend(of_file.lights);
        chosen.area_lights.extend(of_file.area_lights);
    }
    match typed.sun {
        Some(sun) if sun.diameter_degrees.is_some() => {
            let disc = scene_source::sun_disc(sun, up.direction);
            chosen
                .area_lights
                .push(disc.map_err(|error| Failure::input(error.to_string(), ""))?);
        }
        Some(sun) => chosen.lights.push(scene_source::sun(sun, up.direction)),
        None => {}
    }
    Ok(Some(chosen))
}

/// Settles the camera: as typed, else the file's, else one that frames the scene.
pub fn camera(
    scene: &Scene,
    up: &Up,
    typed: Option<&CameraParts>,
    size: [u32; 2],
    screen: &Screen,
) -> Result<Camera, Failure> {
    let Some(parts) = typed else {
        return Ok(scene.camera.unwrap_or_else(|| {
            screen.note("the scene has no camera; taking one that frames it (--camera sets one)");
            up.say("the camera", screen);
            scene_source::frame_camera(scene, up.direction, size)
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
    let own_up = || {
        up.say("the camera", screen);
        up.direction
    };
    Ok(Camera {
        eye: due(parts.eye, base.map(|camera| camera.eye), "eye")?,
        at: due(parts.at, base.map(|camera| camera.at), "at")?,
        up: parts
            .up
            .or(base.map(|camera| camera.up))
            .unwrap_or_else(own_up),
        vertical_fov_degrees: parts
            .fov_degrees
            .or(base.map(|camera| camera.vertical_fov_degrees))
            .unwrap_or(DEFAULT_FOV_DEGREES),
        resolution: base.and_then(|camera| camera.resolution),
    })
}
