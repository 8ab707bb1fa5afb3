//! Files of maps and occlusion values, for all commands that load or save them.
//!
//! In: what was typed, an index. Out: a file, and what to report about one.

use std::path::{Path, PathBuf};

use antumbra::{Saved, SavedLight, ShadowIndex};
use antumbra_files::Identity;
use antumbra_render::aov::light_names;
use antumbra_scene::model::Light;
use clap::Args;

use crate::failure::Failure;
use crate::outputs::{self, Content, Outputs};
use crate::screen::Screen;

/// Files that values are loaded from and saved to.
#[derive(Args, Debug)]
#[command(next_help_heading = "Saved values")]
pub struct SavedFiles {
    /// File of precomputed maps (method auto) or values (method voxel) to load, which `antumbra bake` wrote;
    /// lights that it lacks are computed as without it
    #[arg(long, value_name = "FILE.antumbra")]
    pub occlusion: Option<PathBuf>,

    /// File to save the maps or values to at the end, also those computed on the way
    #[arg(long, value_name = "FILE.antumbra")]
    pub save_occlusion: Option<PathBuf>,
}

impl SavedFiles {
    /// Adds the file that values are written to.
    pub fn add_to(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        let path = self.save_occlusion.as_ref();
        outputs.add_if("--save-occlusion", path, Content::Values)
    }

    /// Refuses to write the file that values are loaded from, but for values: then it is updated.
    pub fn spare(&self, outputs: &Outputs) -> Result<(), Failure> {
        let identity = |path: &Option<PathBuf>| path.as_deref().map(Identity::of);
        match identity(&self.occlusion) == identity(&self.save_occlusion) {
            true => Ok(()),
            false => outputs.spare(&self.occlusion),
        }
    }
}

/// Says which lights were not loaded from a file; returns how many were.
pub fn report(index: &ShadowIndex, lights: &[Light], path: &Path, screen: &Screen) -> usize {
    let names = light_names(lights);
    let mut loaded_count = 0;
    for (name, saved) in names.iter().zip(index.saved_lights()) {
        match saved {
            SavedLight::Loaded => loaded_count += 1,
            SavedLight::Absent => screen.note(format!(
                "{}: knows nothing of {name}, which is new or was moved; that is computed again",
                path.display()
            )),
            SavedLight::NoRoom => screen.note(format!(
                "{}: what it knows of {name} needs more than --occlusion-memory; that is computed again",
                path.display()
            )),
        }
    }
    loaded_count
}

/// Writes a file of values, whole or not at all.
pub fn save(index: &ShadowIndex, path: &Path) -> Result<Saved, Failure> {
    index.save(path).map_err(|error| outputs::unsaved(&error))
}

/// Writes the values that were asked for, and says so.
pub fn save_if_typed(
    typed: &SavedFiles,
    index: &ShadowIndex,
    screen: &Screen,
) -> Result<(), Failure> {
    if let Some(path) = &typed.save_occlusion {
        let saved = save(index, path)?;
        let path = path.display();
        screen.detail(format!("values in {path}: {} bytes", saved.bytes));
    }
    Ok(())
}
