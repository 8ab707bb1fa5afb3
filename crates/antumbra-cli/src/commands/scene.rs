//! `antumbra scene`: writes one of the built-in scenes.

use crate::failure::{Failure, Outcome};
use crate::outputs::{self, Content, Outputs};
use crate::scene_source;
use crate::screen::Screen;
use crate::typed;

/// Generates and writes.
pub fn run(typed: &typed::Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let path = &typed.output;
    Outputs::none().add("--output", path, Content::Nff)?;
    let scene = scene_source::generate(&typed.name, typed.size, typed.lights)?;
    let text = scene_source::nff(&scene)?;
    outputs::write(path, &text)?;
    screen.detail(format!(
        "{} objects in {}",
        scene.objects.len(),
        path.display()
    ));
    Ok(Outcome::Done)
}
