//! `antumbra query`: answers of a batch of points, from file to file.
//!
//! In: a scene, an array of points, perhaps of normals. Out: an array of answers, and a line that counts them.
//! Absent here: what a point means and how it is answered.

pub(super) mod arrays;

use antumbra::{
    Batch, BatchCounters, BatchError, BatchKind, IndexOptions, Nearness, Refine, ShadowIndex,
};
use antumbra_render::aov::light_names;
use antumbra_scene::gather::{Gathered, light_shapes, scene_bytes, surface_bytes};
use antumbra_scene::model::Scene;

use crate::failure::{Failure, Outcome};
use crate::light_values::LightValue;
use crate::load;
use crate::memory::{self, Need};
use crate::outputs::{Content, Outputs};
use crate::saved;
use crate::screen::Screen;
use crate::typed::{Query, SceneFile};
use crate::values::{LightChoice, PointLight};
use arrays::PointFile;

/// Reads, asks, writes, counts.
pub fn run(typed: &Query, screen: &Screen) -> Result<Outcome, Failure> {
    let mut outputs = Outputs::none();
    outputs.add("--output", &typed.output, Content::Array)?;
    typed.kept.add_to(&mut outputs)?;
    typed.kept.spare(&outputs)?;
    outputs.spare([&typed.points].into_iter().chain(&typed.normals))?;
    // Headers first: what does not fit costs no scene.
    let files = Files::open(typed)?;
    let (points, names) = typed_lights(typed)?;
    let file = SceneFile {
        scene: typed.scene.clone(),
        up: typed.up,
        lights: points.into_iter().map(LightValue::Point).collect(),
        sun: typed.sun,
        background: None,
    };
    let scene = load::lit_scene(&file, &typed.cost, &outputs, screen)?.scene;
    let chosen = Chosen::of(&scene, &names)?;
    super::on_threads(&typed.threads, || {
        work(typed, files, &scene, &chosen, screen)
    })?
}

fn work(
    typed: &Query,
    files: Files,
    scene: &Scene,
    chosen: &Chosen,
    screen: &Screen,
) -> Result<Outcome, Failure> {
    let shape = shape(files.points.count, chosen.columns.len(), typed.packed);
    let out_bytes = shape.iter().product::<u64>();
    let sizes = (files.points.count, files.bytes() + out_bytes);
    let index = index(typed, scene, chosen, sizes, screen)?;
    let nearness = Nearness {
        precision: files.points.precision(),
        tolerance: typed.tolerance,
    };
    let (points, normals) = files.read()?;
    let normals = normals.as_deref();
    let batch = Batch {
        points: &points,
        kind: match (typed.on_surface, normals) {
            (true, normals) => BatchKind::OnNearest { normals, nearness },
            (false, Some(normals)) => BatchKind::Facing { normals },
            (false, None) => BatchKind::Free,
        },
    };
    if !typed.on_surface {
        warn_of_surfaces(&index, &points, screen);
    }
    // Below the memory limit, so it fits a `usize`.
    let mut out = vec![0; out_bytes as usize];
    let counted = if typed.packed {
        index.occluded_bits(&batch, &chosen.columns, &mut out)
    } else {
        index.occluded(&batch, &chosen.columns, &mut out)
    };
    let counted = counted.map_err(|error| failure(typed, &error))?;
    arrays::write(&typed.output, &shape, &out)?;
    saved::save_if_typed(&typed.kept, &index, screen)?;
    tell(points.len(), chosen, &counted, screen);
    Ok(Outcome::Done)
}

/// The arrays to read, opened.
struct Files {
    points: PointFile,
    normals: Option<PointFile>,
}

impl Files {
    fn open(typed: &Query) -> Result<Self, Failure> {
        let points = PointFile::open(&typed.points)?;
        let normals = typed.normals.as_deref().map(PointFile::open).transpose()?;
        if let Some(normals) = &normals
            && normals.count != points.count
        {
            let (path, count) = (typed.points.display(), points.count);
            let message = format!(
                "{}: {} normals, but {path} has {count} points",
                normals.path.display(),
                normals.count
            );
            return Err(Failure::input(message, "give a normal for each point"));
        }
        Ok(Self { points, normals })
    }

    /// What they take in memory.
    fn bytes(&self) -> u64 {
        self.points.bytes() + self.normals.as_ref().map_or(0, PointFile::bytes)
    }

    #[expect(
        clippy::type_complexity,
        reason = "two arrays, one of which may be absent"
    )]
    fn read(self) -> Result<(Vec<[f64; 3]>, Option<Vec<[f64; 3]>>), Failure> {
        let points = self.points.read()?;
        let normals = self.normals.map(PointFile::read).transpose()?;
        Ok((points, normals))
    }
}

/// Parts what was typed into points and names.
fn typed_lights(typed: &Query) -> Result<(Vec<PointLight>, Vec<&str>), Failure> {
    let mut points = Vec::new();
    let mut names = Vec::new();
    for choice in &typed.lights {
        match choice {
            LightChoice::Point(point) => points.push(*point),
            LightChoice::Named(name) => names.push(name.as_str()),
        }
    }
    if let Some(name) = names.first()
        && (!points.is_empty() || typed.sun.is_some())
    {
        return Err(Failure::input(
            format!(
                "--light {name} names a light of the file, but --light point: and --sun replace those"
            ),
            "give names only, or none",
        ));
    }
    Ok((points, names))
}

/// The lights that are asked about.
struct Chosen {
    /// Places in the scene, each once: those that an index is made for.
    lights: Vec<usize>,
    /// For each column of the answers a place in `lights`.
    columns: Vec<usize>,
}

impl Chosen {
    fn of(scene: &Scene, names: &[&str]) -> Result<Self, Failure> {
        let all = 0..scene.lights.len();
        if names.is_empty() {
            return Ok(Self {
                lights: all.clone().collect(),
                columns: all.collect(),
            });
        }
        let layers = light_names(&scene.lights);
        let mut chosen = Self {
            lights: Vec::new(),
            columns: Vec::new(),
        };
        for &name in names {
            let mut own = all
                .clone()
                .filter(|&light| scene.lights[light].name == name);
            let light = match (own.next(), own.next()) {
                (Some(light), None) => Some(light),
                // A layer's name is unlike all others.
                _ => layers.iter().position(|layer| layer == name),
            };
            let Some(light) = light else {
                let message = format!("no light, or more than one, is called `{name}`");
                return Err(Failure::input(
                    message,
                    format!("the scene has {}", layers.join(", ")),
                ));
            };
            let place = chosen.lights.iter().position(|&known| known == light);
            chosen.columns.push(place.unwrap_or(chosen.lights.len()));
            if place.is_none() {
                chosen.lights.push(light);
            }
        }
        Ok(chosen)
    }
}

/// The shape of the answers: points and lights, a single light without an axis.
fn shape(point_count: u64, light_count: usize, is_packed: bool) -> Vec<u64> {
    let lights = light_count as u64;
    match (is_packed, light_count) {
        (false, 1) => vec![point_count],
        (false, _) => vec![point_count, lights],
        (true, 1) => vec![point_count.div_ceil(8)],
        (true, _) => vec![lights, point_count.div_ceil(8)],
    }
}

/// Builds the index, unless all together needs more memory than may be taken.
fn index(
    typed: &Query,
    scene: &Scene,
    chosen: &Chosen,
    (point_count, array_bytes): (u64, u64),
    screen: &Screen,
) -> Result<ShadowIndex, Failure> {
    let limit = memory::limit(typed.cost.memory_limit);
    let mut need = Need {
        scene: scene_bytes(scene),
        surfaces: surface_bytes(scene),
        arrays: array_bytes,
        ..Need::default()
    };
    need.check(limit)?;
    let gathered = Gathered::of(scene)?;
    let mut options = IndexOptions {
        method: typed.shadows.method(),
        grid: typed.cost.grid.unwrap_or_default(),
        refinement: typed.cost.refinement(Refine::Lazy),
        ..IndexOptions::default()
    };
    let predicted =
        options.predict(gathered.occluders(), chosen.lights.len(), Some(point_count))?;
    need.set_index(gathered.memory_bytes(), predicted);
    need.check(limit)?;
    options.memory_limit = need.left_for_index(limit);
    screen.detail(format!("memory predicted: {need}"));
    let lights = chosen
        .lights
        .iter()
        .map(|&light| scene.lights[light].clone());
    let lights: Vec<_> = lights.collect();
    let file = typed.kept.occlusion.as_deref();
    let index = options.build_from(gathered.occluders(), light_shapes(&lights), file)?;
    if let Some(path) = file {
        saved::tell(&index, &lights, path, screen);
    }
    Ok(index)
}

/// Names the file that holds what is wrong.
fn failure(typed: &Query, error: &BatchError) -> Failure {
    let file = match error {
        BatchError::BadNormal { .. } => typed.normals.as_ref().unwrap_or(&typed.points),
        _ => &typed.points,
    };
    let help = match error {
        BatchError::NoSurface { .. } => {
            "raise --tolerance, save points as float32 if they were rounded to that, or leave --on-surface out \
             for points of space"
        }
        _ => "",
    };
    Failure::input(format!("{}: {error}", file.display()), help)
}

/// Points on surfaces that are asked about as points of space are most likely meant otherwise.
fn warn_of_surfaces(index: &ShadowIndex, points: &[[f64; 3]], screen: &Screen) {
    let sample = index.sample_on_surfaces(points);
    if sample.is_suspicious() {
        screen.warning(format!(
            "{} of {} points looked at lie on surfaces, and points of space may be in the shadow of the surface \
             that they lie on; give --on-surface if they are points of surfaces",
            sample.on_surface, sample.looked_at
        ));
    }
}

fn tell(point_count: usize, chosen: &Chosen, counted: &BatchCounters, screen: &Screen) {
    let shadow = counted.counters.shadow;
    let query_count = point_count as u64 * chosen.columns.len() as u64;
    let lights = match chosen.columns.len() {
        1 => "1 light".to_owned(),
        count => format!("{count} lights"),
    };
    screen.result(format!(
        "{point_count} points, {lights}: {} of {query_count} queries in shadow",
        shadow.shadowed + counted.facing_away
    ));
    screen.detail(format!(
        "facing away {}, first pass {}, intermediate {}, blocker list {}, ray {}",
        counted.facing_away,
        shadow.first_pass,
        shadow.intermediate,
        shadow.blocker_list,
        shadow.rays
    ));
}
