//! `antumbra bake`: makes the maps or values of all lights and keeps them in a file.
//!
//! In: a scene, perhaps the file as it was. Out: the file. What still holds of the file before is not made again:
//! after a light was moved only that light's values are.

use std::time::Instant;

use antumbra::{BuildError, IndexOptions, Method, Refine, Refusal, ShadowIndex};
use antumbra_scene::gather::{Gathered, light_shapes, scene_bytes, surface_bytes};
use antumbra_scene::model::Scene;

use crate::failure::{Failure, Outcome};
use crate::load;
use crate::memory::{self, Need};
use crate::outputs::{Content, Outputs};
use crate::saved;
use crate::screen::Screen;
use crate::typed::{Bake, IndexCost, RefineWhen};
use crate::values::format_bytes;

/// Reads, makes what is missing, writes.
pub fn run(typed: &Bake, screen: &Screen) -> Result<Outcome, Failure> {
    if matches!(
        typed.cost.refine,
        Some(RefineWhen::Lazy | RefineWhen::Queried)
    ) {
        return Err(Failure::input(
            "bake computes all values, so --refine can only be eager",
            "to save values that render or query compute on the way, give them --save-occlusion",
        ));
    }
    let mut outputs = Outputs::none();
    outputs.add("--output", &typed.output, Content::Values)?;
    let scene = load::lit_scene(&typed.file, &typed.cost, &outputs, screen)?.scene;
    super::on_threads(&typed.threads, || work(typed, &scene, screen))?
}

fn work(typed: &Bake, scene: &Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let begin = Instant::now();
    let (gathered, options) = gathered(scene, &typed.cost, typed.shadows.method())?;
    let path = &typed.output;
    let (index, loaded_count) = if path.is_file() {
        match options.build_from(
            gathered.occluders(),
            light_shapes(&scene.lights),
            Some(path),
        ) {
            Ok(index) => {
                let loaded_count = saved::report(&index, &scene.lights, path, screen);
                (index, loaded_count)
            }
            Err(error) => (anew(error, &gathered, scene, &options, screen)?, 0),
        }
    } else {
        (
            options.build(gathered.occluders(), light_shapes(&scene.lights))?,
            0,
        )
    };
    let saved = saved::save(&index, path)?;
    // Where nothing is, there is nothing to refine.
    if saved.pending_count > 0 && index.occluders().surface_count() > 0 {
        screen.warning(format!(
            "{} places are not refined to the end: --occlusion-memory, or what --memory-limit leaves of it, is full",
            saved.pending_count
        ));
    }
    screen.result(format!(
        "{}: {}, {} lights, of which {loaded_count} were loaded, in {:.2} s",
        path.display(),
        format_bytes(saved.bytes),
        scene.lights.len(),
        begin.elapsed().as_secs_f64()
    ));
    Ok(Outcome::Done)
}

/// Makes all values, unless the file before cannot be read.
fn anew(
    error: BuildError,
    gathered: &Gathered,
    scene: &Scene,
    options: &IndexOptions,
    screen: &Screen,
) -> Result<ShadowIndex, Failure> {
    let BuildError::Occlusion(refused) = &error else {
        return Err(error.into());
    };
    match refused.reason {
        Refusal::Unreadable(_) => {
            let message = format!("{refused}, and is not replaced");
            Err(Failure::input(message, "give -o another name"))
        }
        _ => {
            screen.note(format!("{refused}; everything is computed again"));
            Ok(options.build(gathered.occluders(), light_shapes(&scene.lights))?)
        }
    }
}

/// Gathers a scene for an index with all values, unless that needs more memory than may be taken.
pub(super) fn gathered(
    scene: &Scene,
    cost: &IndexCost,
    method: Method,
) -> Result<(Gathered, IndexOptions), Failure> {
    let limit = memory::limit(cost.memory_limit);
    let mut need = Need {
        scene: scene_bytes(scene),
        surfaces: surface_bytes(scene),
        ..Need::default()
    };
    need.check(limit)?;
    let gathered = Gathered::of(scene)?;
    let mut options = IndexOptions {
        method,
        grid: cost.grid.unwrap_or_default(),
        refinement: cost.refinement(Refine::Eager),
        ..IndexOptions::default()
    };
    let predicted = options.predict(gathered.occluders(), scene.lights.len(), None)?;
    need.set_index(gathered.memory_bytes(), predicted);
    need.check(limit)?;
    options.memory_limit = need.left_for_index(limit);
    Ok((gathered, options))
}
