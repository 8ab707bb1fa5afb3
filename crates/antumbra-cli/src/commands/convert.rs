//! `antumbra convert`: writes a scene in another format.
//!
//! What the format has no place for is said; what it would change the shadows by is refused.

use crate::failure::{Failure, Outcome};
use crate::memory;
use crate::outputs::Outputs;
use crate::scene_source;
use crate::screen::Screen;
use crate::typed::Convert;

/// Reads and writes; adds neither light nor camera.
pub fn run(typed: &Convert, screen: &Screen) -> Result<Outcome, Failure> {
    let mut outputs = Outputs::none();
    outputs.add_scene("OUT", &typed.output)?;
    outputs.spare([&typed.input])?;
    let loaded = scene_source::read(&typed.input, None, memory::limit(None))?;
    outputs.spare(&loaded.files)?;
    let scene = match typed.tessellate {
        Some(cells) => loaded.scene.tessellated(cells),
        None => loaded.scene,
    };
    let notes = scene_source::write(&scene, &typed.output)?;
    loaded
        .warnings
        .iter()
        .chain(&notes)
        .for_each(|warning| screen.warning(warning));
    let (count, path) = (scene.objects.len(), typed.output.display());
    screen.detail(format!("{count} objects in {path}"));
    Ok(Outcome::Done)
}
