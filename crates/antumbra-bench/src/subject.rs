//! Who is measured: a scene with one light and a camera, and Embree, if it is there.

use std::path::Path;
use std::time::Duration;

use antumbra::{IndexOptions, Method};
use antumbra_baselines::embree::{Embree, EmbreeError, EmbreeScene, Geometry};
use antumbra_geometry::{DVec3, Short};
use antumbra_render::camera::View;
use antumbra_render::orbit::camera_of_frame;
use antumbra_render::prepare::Prepared;
use antumbra_scene::model::{Alpha, Camera, LightKind, Scene, ShadowKind};

use antumbra_cli::failure::Failure;
use antumbra_cli::screen::Screen;
use antumbra_cli::{load, memory};

use super::head::Head;
use super::measure::Stopwatch;
use super::typed::{Subjects, TimedThreads};

/// A scene of which one light stays, number 0.
pub(super) struct Subject {
    pub(super) name: String,
    /// The plain grid: it records, and its answers are expected of everybody.
    pub(super) recorder: Prepared,
    camera: Camera,
    size: [u32; 2],
}

impl Subject {
    /// Loads a scene and prepares what records its queries.
    pub(super) fn load(
        path: &Path,
        typed: &Subjects,
        size: [u32; 2],
        screen: &Screen,
    ) -> Result<Self, Failure> {
        let file = typed.light.file(path);
        let lit = load::lit_scene(&file, &typed.cost, &typed.outputs()?, screen)?;
        let mut scene = lit.scene;
        fill_holes(&mut scene, screen);
        if typed.light_number >= scene.lights.len() {
            return Err(Failure::input(
                format!(
                    "{} has no light {}; it has {}",
                    path.display(),
                    typed.light_number,
                    scene.lights.len()
                ),
                "give --light-number a smaller number",
            ));
        }
        scene.lights = vec![scene.lights.swap_remove(typed.light_number)];
        let camera = load::camera(&scene, &lit.up, typed.camera.as_ref(), size, screen)?;
        let options = IndexOptions {
            method: Method::Grid,
            grid: typed.cost.grid.unwrap_or_default(),
            memory_limit: memory::limit(typed.cost.memory_limit),
            ..IndexOptions::default()
        };
        Ok(Self {
            name: path
                .file_stem()
                .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            recorder: Prepared::new(scene, &options)?,
            camera,
            size,
        })
    }

    /// Returns what is seen in a frame of so many around the scene.
    pub(super) fn view(&self, frame: u32, frame_count: u32) -> Result<View, Failure> {
        View::new(
            &camera_of_frame(&self.camera, frame, frame_count),
            self.size,
        )
        .map_err(|error| Failure::input(error.to_string(), "the scene's camera sees nothing"))
    }

    /// Returns where the camera is.
    pub(super) fn eye(&self) -> DVec3 {
        self.camera.eye
    }

    /// Returns the light for people.
    pub(super) fn light(&self) -> String {
        match self.recorder.scene().lights[0].kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                format!("light at {}", Short(position))
            }
            LightKind::Directional { towards_light: to } => {
                format!("light towards {}", Short(to))
            }
        }
    }

    /// Returns the scene as Embree takes it.
    pub(super) fn geometry(&self) -> Geometry {
        Geometry::of(self.recorder.scene(), self.recorder.gathered().occluders())
    }
}

/// Makes faces with holes whole: Embree has no masks of its own, and all are to answer the same questions.
pub(super) fn fill_holes(scene: &mut Scene, screen: &Screen) {
    let materials = scene.materials.iter_mut();
    let masked = materials.filter(|material| material.shadow_kind() == ShadowKind::AlphaTested);
    let count = masked
        .map(|material| material.alpha = Alpha::Opaque)
        .count();
    if count > 0 {
        screen.note(format!(
            "{count} materials have holes; they are filled, for Embree as for us"
        ));
    }
}

/// Looks for Embree and returns where it is, too, or that it is not.
fn find_embree(thread_count: usize, screen: &Screen) -> (Option<Embree>, String) {
    match Embree::load(thread_count) {
        Ok(embree) => {
            let name = embree.path().file_name().unwrap_or_default();
            let name = name.to_string_lossy().into_owned();
            (Some(embree), name)
        }
        Err(error) => {
            screen.warning(format!("{error}; its rows are left out"));
            (None, format!("none: {error}"))
        }
    }
}

/// The conditions of a measurement: how time is taken, the rival, and the head of the report, which this prints.
pub(super) fn begin(
    threads: &TimedThreads,
    rounds: u32,
    size: [u32; 2],
    screen: &Screen,
) -> (Stopwatch, Option<Embree>, Head) {
    let stopwatch = Stopwatch::new(threads.count());
    let (embree, where_it_is) = find_embree(threads.count(), screen);
    let head = Head::new(stopwatch.name(), threads.count(), rounds, size, where_it_is);
    screen.result(head.text());
    (stopwatch, embree, head)
}

/// Builds Embree's scene and returns how long it took.
pub(super) fn rival(
    embree: &Embree,
    geometry: &Geometry,
    stopwatch: Stopwatch,
) -> Result<(EmbreeScene, Duration), Failure> {
    let (scene, time) = stopwatch.time(|| embree.build(geometry, false));
    scene.map(|scene| (scene, time)).map_err(failure)
}

/// Embree was found and then refused: that is the system's.
pub(super) fn failure(error: EmbreeError) -> Failure {
    Failure::system(error.to_string())
}
