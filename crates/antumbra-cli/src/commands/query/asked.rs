//! What queries of points share: the arrays to read, the lights that are asked about, the index.

use antumbra::{
    Batch, BatchError, BatchKind, IndexOptions, LightId, Nearness, Refine, ShadowIndex,
};
use antumbra_render::aov::light_names;
use antumbra_scene::gather::{Gathered, light_shapes, scene_bytes, surface_bytes};
use antumbra_scene::model::Scene;

use super::arrays::PointFile;
use crate::failure::Failure;
use crate::memory::{self, Need};
use crate::saved;
use crate::screen::Screen;
use crate::typed::Query;

/// Returns how far points may be off their surfaces.
pub(super) fn nearness(typed: &Query, files: &Files) -> Nearness {
    Nearness {
        precision: files.points.precision(),
        tolerance: typed.tolerance,
    }
}

/// Returns what the points mean.
pub(super) fn batch<'a>(
    typed: &Query,
    points: &'a [[f64; 3]],
    normals: Option<&'a [[f64; 3]]>,
    nearness: Nearness,
) -> Batch<'a, [f64; 3]> {
    let kind = match (typed.on_surface, normals) {
        (true, normals) => BatchKind::OnNearest { normals, nearness },
        (false, Some(normals)) => BatchKind::Facing { normals },
        (false, None) => BatchKind::Free,
    };
    Batch { points, kind }
}

/// The arrays to read, opened.
pub(super) struct Files {
    pub(super) points: PointFile,
    pub(super) normals: Option<PointFile>,
}

impl Files {
    pub(super) fn open(typed: &Query) -> Result<Self, Failure> {
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
    pub(super) fn bytes(&self) -> u64 {
        self.points.bytes() + self.normals.as_ref().map_or(0, PointFile::bytes)
    }

    #[expect(
        clippy::type_complexity,
        reason = "two arrays, one of which may be absent"
    )]
    pub(super) fn read(self) -> Result<(Vec<[f64; 3]>, Option<Vec<[f64; 3]>>), Failure> {
        let points = self.points.read()?;
        let normals = self.normals.map(PointFile::read).transpose()?;
        Ok((points, normals))
    }
}

/// The lights that are asked about.
pub(super) struct Chosen {
    /// Places in the scene, each once: those that an index is made for.
    pub(super) lights: Vec<usize>,
    /// For each column of the answers a light of that index.
    pub(super) columns: Vec<LightId>,
}

impl Chosen {
    pub(super) fn of(scene: &Scene, names: &[&str]) -> Result<Self, Failure> {
        let all = 0..scene.lights.len();
        if names.is_empty() {
            return Ok(Self {
                lights: all.clone().collect(),
                columns: all.map(LightId::from_index).collect(),
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
            let number = place.unwrap_or(chosen.lights.len());
            chosen.columns.push(LightId::from_index(number));
            if place.is_none() {
                chosen.lights.push(light);
            }
        }
        Ok(chosen)
    }
}

/// Builds the index, unless all together needs more memory than may be taken.
pub(super) fn index(
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
    let file = typed.saved.occlusion.as_deref();
    let index = options.build_from(gathered.occluders(), light_shapes(&lights), file)?;
    if let Some(path) = file {
        saved::report(&index, &lights, path, screen);
    }
    Ok(index)
}

/// Names the file that holds what is wrong.
pub(super) fn failure(typed: &Query, error: &BatchError) -> Failure {
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
pub(in crate::commands) fn warn_of_surfaces(
    index: &ShadowIndex,
    points: &[[f64; 3]],
    screen: &Screen,
) {
    let sample = index.sample_on_surfaces(points);
    if sample.is_suspicious() {
        screen.warning(format!(
            "{} of {} points looked at lie on surfaces, and points of space may be in the shadow of the surface \
             that they lie on; give --on-surface if they are points of surfaces",
            sample.on_surface, sample.looked_at
        ));
    }
}
