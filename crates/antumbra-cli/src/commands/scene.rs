//! `antumbra scene`: writes one of the built-in scenes.

use std::fs;

use crate::failure::{Failure, Outcome};
use crate::scene_source;
use crate::screen::Screen;
use crate::typed;

/// Generates and writes.
pub(crate) fn run(typed: &typed::Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let scene = scene_source::generate(&typed.name, typed.size, typed.lights)?;
    let text = scene_source::nff(&scene)?;
    let path = &typed.output;
    fs::write(path, text)
        .map_err(|error| Failure::system(format!("cannot write {}: {error}", path.display())))?;
    screen.detail(format!(
        "{} objects in {}",
        scene.objects.len(),
        path.display()
    ));
    Ok(Outcome::Done)
}
