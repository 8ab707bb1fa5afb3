//! `antumbra scene`: writes one of the built-in scenes.

use crate::failure::{Failure, Outcome};
use crate::outputs::{self, Content, Outputs};
use crate::scene_source;
use crate::screen::Screen;
use crate::typed;

/// Generates and writes. NFF has the digits of the SPD programs, other formats all.
pub fn run(typed: &typed::Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let path = &typed.output;
    let is_other = ["obj", "ply", "glb"].iter().any(|&ending| {
        let found = path.extension();
        found.is_some_and(|found| found.eq_ignore_ascii_case(ending))
    });
    let mut outputs = Outputs::none();
    match is_other {
        true => outputs.add_scene("--output", path)?,
        false => outputs.add("--output", path, Content::Nff)?,
    }
    let scene = scene_source::generate(&typed.name, typed.size, typed.lights)?;
    if is_other {
        let notes = scene_source::write(&scene, path)?;
        notes.iter().for_each(|note| screen.warning(note));
    } else {
        let text = scene_source::nff(&scene)?;
        outputs::write(path, &text)?;
    }
    screen.detail(format!(
        "{} objects in {}",
        scene.objects.len(),
        path.display()
    ));
    Ok(Outcome::Done)
}
