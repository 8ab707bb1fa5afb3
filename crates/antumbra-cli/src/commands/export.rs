//! `antumbra export`: values as a regular grid of cells, for other programs.
//!
//! In: a scene, perhaps a file of its values. Out: a NumPy array, and where its cells are.

use std::path::Path;

use antumbra::{Method, Prediction, Volume};
use antumbra_geometry::{DVec3, Short};
use antumbra_render::aov::light_names;
use antumbra_scene::gather::{light_shapes, scene_bytes};
use antumbra_scene::model::Scene;
use serde::Serialize;

use super::{bake, query};
use crate::failure::{Failure, Outcome};
use crate::load;
use crate::memory::{self, Need};
use crate::outputs::{self, Content, Outputs};
use crate::saved;
use crate::screen::Screen;
use crate::typed::Export;

/// Where the cells of an array are: cell (i, j, k) begins at `min + edge * (i, j, k)`.
#[derive(Serialize)]
struct Place<'a> {
    cells: [u32; 3],
    min: [f64; 3],
    max: [f64; 3],
    edge: f64,
    lights: &'a [String],
    lit: u8,
    shadowed: u8,
    mixed: u8,
}

/// Reads, makes what is missing, writes.
pub fn run(typed: &Export, screen: &Screen) -> Result<Outcome, Failure> {
    let mut outputs = Outputs::none();
    outputs.add("--output", &typed.output, Content::Array)?;
    outputs.add_if("--json", typed.json.as_ref(), Content::Json)?;
    outputs.spare(&typed.occlusion)?;
    let scene = load::lit_scene(&typed.file, &typed.cost, &outputs, screen)?.scene;
    super::on_threads(&typed.threads, || work(typed, &scene, screen))?
}

fn work(typed: &Export, scene: &Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let (gathered, options) = bake::gathered(scene, &typed.cost, Method::Voxel)?;
    let file = typed.occlusion.as_deref();
    let index = options.build_from(gathered.occluders(), light_shapes(&scene.lights), file)?;
    if let Some(path) = file {
        saved::report(&index, &scene.lights, path, screen);
    }
    let nothing = || Failure::input("the scene has no surfaces, so there are no cells", "");
    // Beside what was taken for the index.
    let predicted = options.predict(gathered.occluders(), scene.lights.len(), None)?;
    let need = Need {
        scene: scene_bytes(scene),
        surfaces: gathered.memory_bytes(),
        arrays: index.volume_bytes(typed.cells).ok_or_else(nothing)?,
        index: Prediction {
            values: index.knowledge_bytes(),
            knowledge: 0,
            ..predicted
        },
        ..Need::default()
    };
    need.check(memory::limit(typed.cost.memory_limit))?;
    let volume = index.volume(typed.cells).ok_or_else(nothing)?;
    let mut shape: Vec<u64> = volume.cells.iter().map(|&count| count.into()).collect();
    if volume.light_count != 1 {
        shape.push(volume.light_count as u64);
    }
    query::arrays::write(&typed.output, &shape, &volume.values)?;
    let names = light_names(&scene.lights);
    if let Some(path) = &typed.json {
        write_place(path, &volume, &names)?;
    }
    report(&volume, &names, screen);
    Ok(Outcome::Done)
}

fn max_of(volume: &Volume) -> [f64; 3] {
    let min = volume.min.to_array();
    std::array::from_fn(|axis| min[axis] + volume.edge * f64::from(volume.cells[axis]))
}

fn write_place(path: &Path, volume: &Volume, names: &[String]) -> Result<(), Failure> {
    let place = Place {
        cells: volume.cells,
        min: volume.min.to_array(),
        max: max_of(volume),
        edge: volume.edge,
        lights: names,
        lit: Volume::LIT,
        shadowed: Volume::SHADOWED,
        mixed: Volume::MIXED,
    };
    outputs::write_json(path, &place)
}

fn report(volume: &Volume, names: &[String], screen: &Screen) {
    let [x, y, z] = volume.cells;
    let (min, max) = (Short(volume.min), Short(DVec3::from_array(max_of(volume))));
    screen.result(format!(
        "{x} x {y} x {z} cells, edge {}, from {min} to {max}",
        Short(volume.edge)
    ));
    let count = (volume.values.len() / volume.light_count.max(1)).max(1) as f64;
    for (light, name) in names.iter().enumerate() {
        let of_light = || volume.values[light..].iter().step_by(volume.light_count);
        let share = |wanted: u8| {
            let found = of_light().filter(|&&value| value == wanted).count();
            100.0 * found as f64 / count
        };
        screen.result(format!(
            "{name}: lit {:.1} %, shadowed {:.1} %, mixed or not known {:.1} %",
            share(Volume::LIT),
            share(Volume::SHADOWED),
            share(Volume::MIXED)
        ));
    }
}
