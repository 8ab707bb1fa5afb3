//! Proposals of the paper beside its tables, each with a picture and a figure: sections 6.3, 7.2 and 9.1.
//!
//! In: scenes of the generators. Out: pictures and sentences. Every figure is that of the picture beside it.

use antumbra_render::film::RenderSettings;
use antumbra_scene::generate;
use antumbra_scene::model::Bump;
use antumbra_scene::model::{Scene, Shape};

use antumbra_cli::failure::Failure;

use super::super::VOXEL_1990;
use super::super::shot::{Shot, Subject};
use super::super::tables::{grouped, percent};
use super::pictures::packed;
use crate::measure::Stopwatch;

/// A section of the paper.
pub(super) struct Proposal {
    pub(super) section: &'static str,
    pub(super) title: &'static str,
    pub(super) picture: String,
    pub(super) size: [u32; 2],
    pub(super) figure: String,
}

/// Voxels along each axis of the proposals' scenes.
const GRID: u32 = 48;

/// Renders what all sections propose.
pub(super) fn all(size: [u32; 2]) -> Result<Vec<Proposal>, Failure> {
    Ok(vec![glass(size)?, bumps(size)?, curved(size)?])
}

fn shoot(scene: Scene, size: [u32; 2], settings: &RenderSettings) -> Result<Shot, Failure> {
    let subject = Subject::new(scene, size, GRID)?;
    subject.shoot_with(VOXEL_1990, settings, Stopwatch::new(1))
}

fn made(scene: Result<Scene, generate::GenerateError>) -> Result<Scene, Failure> {
    scene.map_err(|error| Failure::input(error.to_string(), ""))
}

fn glass(size: [u32; 2]) -> Result<Proposal, Failure> {
    let scene = made(generate::window(6))?;
    let uncolored = RenderSettings {
        colored_shadows: false,
        ..RenderSettings::default()
    };
    let plain = shoot(scene.clone(), size, &uncolored)?;
    let colored = shoot(scene, size, &RenderSettings::default())?;
    let ratio = colored.render.as_secs_f64() / plain.render.as_secs_f64();
    Ok(Proposal {
        section: "6.3",
        title: "Non-opaque objects",
        picture: packed(&colored.picture)?,
        size,
        figure: format!(
            "Panes of glass block nothing and color the light that goes through them. The picture takes \
             {ratio:.2} times as long as one in which they let light through unchanged."
        ),
    })
}

fn bumps(size: [u32; 2]) -> Result<Proposal, Failure> {
    let mut scene = made(generate::sphereflake(2))?;
    for material in &mut scene.materials {
        material.bump = Some(Bump::Noise {
            height: 0.03,
            size: 0.1,
        });
    }
    let shot = shoot(scene, size, &RenderSettings::default())?;
    let counts = &shot.tally.bumps;
    let share = counts.perturbed as f64 / counts.queries.max(1) as f64;
    Ok(Proposal {
        section: "7.2",
        title: "Shadows on bump-mapped surfaces",
        picture: packed(&shot.picture)?,
        size,
        figure: format!(
            "Borders of shadows follow the bumps. Only {} of {} shadow queries needed the perturbed test: \
             elsewhere values know of all places that bumps may lift a point to.",
            percent(share),
            grouped(counts.queries as i64)
        ),
    })
}

fn curved(size: [u32; 2]) -> Result<Proposal, Failure> {
    let scene = made(generate::teapot(8))?;
    let triangles: u64 = scene
        .objects
        .iter()
        .map(|object| match &object.shape {
            Shape::Patch(patch) => 2 << (2 * patch.level),
            _ => 0,
        })
        .sum();
    let shot = shoot(scene, size, &RenderSettings::default())?;
    let shadows = &shot.tally.counters.shadow;
    let known = shadows.first_pass + shadows.intermediate;
    let queries = known + shadows.blocker_list + shadows.rays;
    let share = known as f64 / queries.max(1) as f64;
    Ok(Proposal {
        section: "9.1",
        title: "Complex surfaces",
        picture: packed(&shot.picture)?,
        size,
        figure: format!(
            "Newell’s teapot as 32 bicubic patches. They stand for {} triangles, of which none is kept; {} of the \
             shadow queries are answered by the known part of their shadows.",
            grouped(triangles as i64),
            percent(share)
        ),
    })
}
