//! `antumbra query`: answers of a batch of points, from file to file.
//!
//! In: a scene, an array of points, perhaps of normals. Out: an array of answers, and a line that counts them.
//! Absent here: what a point means and how it is answered.

pub(super) mod arrays;
pub(super) mod asked;
mod glass;
mod intervals;
mod shares;

use antumbra::BatchCounters;
use antumbra_scene::model::Scene;

use crate::failure::{Failure, Outcome};
use crate::light_values::{LightChoice, LightValue};
use crate::load::{self, Lighting};
use crate::outputs::{Content, Outputs};
use crate::saved;
use crate::screen::Screen;
use crate::typed::{Query, SceneFile};
use arrays::PointFile;
use asked::{Chosen, Files, batch, failure, index, nearness, warn_of_surfaces};

/// Reads, asks, writes, counts.
pub fn run(typed: &Query, screen: &Screen) -> Result<Outcome, Failure> {
    let mut outputs = Outputs::none();
    outputs.add("--output", &typed.output, Content::Array)?;
    typed.saved.add_to(&mut outputs)?;
    typed.saved.spare(&outputs)?;
    outputs.spare(
        [&typed.points]
            .into_iter()
            .chain(&typed.normals)
            .chain(&typed.intervals),
    )?;
    // Headers first: what does not fit costs no scene.
    let files = Files::open(typed)?;
    let ends = typed.intervals.as_deref().map(PointFile::open);
    let ends = ends.transpose()?;
    outputs.spare(&typed.more_lights.file)?;
    let (lights, names) = typed_lights(typed)?;
    let file = SceneFile {
        scene: typed.scene.clone(),
        up: typed.up,
        tessellate: None,
        lights,
        sun: typed.sun,
        background: None,
    };
    let more = Some(&typed.more_lights);
    let lighting = match typed.shares.replace_lights() {
        true => Lighting::Unneeded,
        false => Lighting::Needed,
    };
    let lit = load::any_lit_scene(&file, more, lighting, &typed.cost, &outputs, screen)?;
    let scene = &lit.scene;
    if let Some(ends) = ends {
        if let Some(light) = scene.area_lights.first() {
            return Err(Failure::input(
                format!(
                    "light `{}` has a size, and lit intervals are those of lights without",
                    light.name
                ),
                "give lights without size with --light",
            ));
        }
        let chosen = Chosen::of(scene, &names)?;
        return super::on_threads(&typed.threads, || {
            intervals::work(typed, files, ends, scene, &chosen, screen)
        })?;
    }
    if typed.transmittance
        && let Some(light) = scene.area_lights.first()
    {
        return Err(Failure::input(
            format!(
                "light `{}` has a size, and --transmittance is of lights without",
                light.name
            ),
            "give lights without size with --light",
        ));
    }
    if typed.shares.replace_lights() || !scene.area_lights.is_empty() {
        return super::on_threads(&typed.threads, || {
            shares::work(typed, files, &lit, &names, screen)
        })?;
    }
    let chosen = Chosen::of(scene, &names)?;
    super::on_threads(&typed.threads, || match typed.transmittance {
        true => glass::work(typed, files, scene, &chosen, screen),
        false => work(typed, files, scene, &chosen, screen),
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
    let nearness = nearness(typed, &files);
    let (points, normals) = files.read()?;
    let batch = batch(typed, &points, normals.as_deref(), nearness);
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
    saved::save_if_typed(&typed.saved, &index, screen)?;
    report(points.len(), chosen, &counted, screen);
    Ok(Outcome::Done)
}

/// Parts what was typed into lights and names.
fn typed_lights(typed: &Query) -> Result<(Vec<LightValue>, Vec<&str>), Failure> {
    let mut lights = Vec::new();
    let mut names = Vec::new();
    for choice in &typed.lights {
        match choice {
            LightChoice::Typed(light) => lights.push(light.clone()),
            LightChoice::Named(name) => names.push(name.as_str()),
        }
    }
    if let Some(name) = names.first()
        && (!lights.is_empty() || typed.sun.is_some())
    {
        return Err(Failure::input(
            format!(
                "--light {name} names a light of the file, but lights that are typed, and --sun, replace those"
            ),
            "give names only, or none",
        ));
    }
    Ok((lights, names))
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

fn report(point_count: usize, chosen: &Chosen, counted: &BatchCounters, screen: &Screen) {
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
