//! The files that a command writes, checked before it works.
//!
//! In: what was typed. Out: a refusal before anything is computed, or files, each whole or the one before. Invariants:
//! nothing that the command reads is written, whatever links lead to it; no two outputs are one file; a name's ending
//! says what is in the file; a file that nobody named is replaced only if antumbra wrote it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use antumbra::{SaveError, ShadowIndex};
use antumbra_files::{Identity, Place, Refusal};
use serde::Serialize;

use crate::failure::Failure;

/// Mark in the head of a report's page, by which antumbra knows its own files.
pub const PAGE_MARK: &str = "antumbra-bench";

/// Mark in the head of a sun study's page.
pub const STUDY_PAGE_MARK: &str = "antumbra sun";

/// Mark of a report's summary: the first words below its title.
pub const SUMMARY_MARK: &str = "Made by `antumbra-bench";

/// Content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A picture; its ending says the format.
    Picture,
    /// A NumPy array.
    Array,
    /// A sun study in one file; its ending says the format.
    Study,
    /// A table, CSV.
    Table,
    /// Figures as JSON.
    Json,
    /// A built-in scene.
    Nff,
    /// A scene; its ending says the format.
    Scene,
    /// The materials of a scene in OBJ.
    Library,
    /// Occlusion values.
    Values,
    /// A page of a report.
    Page,
    /// The page of a sun study.
    StudyPage,
    /// The summary of a report, Markdown.
    Summary,
}

impl Content {
    /// Returns the endings that name it, in lower case.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Picture => &["png", "exr"],
            Self::Array => &["npy"],
            Self::Study => &["npz", "csv", "nc", "zarr"],
            Self::Table => &["csv"],
            Self::Json => &["json"],
            Self::Nff => &["nff"],
            Self::Scene => &["nff", "obj", "ply", "glb"],
            Self::Library => &["mtl"],
            Self::Values => &["antumbra"],
            Self::Page | Self::StudyPage => &["html"],
            Self::Summary => &["md"],
        }
    }

    /// Returns what a file bears near its beginning if antumbra wrote it.
    fn mark(self) -> Option<&'static str> {
        match self {
            Self::Picture => Some(antumbra_render::image_file::SOFTWARE),
            Self::Library => Some(antumbra_scene::write::LIBRARY_MARK),
            Self::Page => Some(PAGE_MARK),
            Self::StudyPage => Some(STUDY_PAGE_MARK),
            Self::Summary => Some(SUMMARY_MARK),
            Self::Array
            | Self::Study
            | Self::Table
            | Self::Json
            | Self::Nff
            | Self::Scene
            | Self::Values => None,
        }
    }

    /// Returns whether the ending alone says what to write.
    fn is_known_by_ending(self) -> bool {
        matches!(self, Self::Picture | Self::Scene | Self::Study)
    }

    fn advice(self, option: &str) -> String {
        let endings: Vec<String> = self.endings().iter().map(|e| format!(".{e}")).collect();
        format!("give {option} a name that ends in {}", endings.join(" or "))
    }
}

/// Files to write, by what they are.
#[derive(Debug, Default)]
pub struct Outputs {
    /// The option that names each file, and the name.
    files: HashMap<Identity, (String, PathBuf)>,
}

impl Outputs {
    /// Of a command that writes no files.
    pub fn none() -> Self {
        Self::default()
    }

    /// Adds a file that `option` names.
    pub fn add(&mut self, option: &str, path: &Path, content: Content) -> Result<(), Failure> {
        if path == Path::new("-") {
            let message = format!("{option} -: nothing is written to standard output");
            return Err(Failure::input(message, content.advice(option)));
        }
        let place = Place::of(path).map_err(|refusal| refused(path, refusal))?;
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        let ending = ending.as_deref().and_then(|ending| ending.to_str());
        let is_named = ending.is_some_and(|ending| content.endings().contains(&ending));
        // A pipe or a device may have any name where only one thing can be meant.
        if !is_named && (place != Place::Stream || content.is_known_by_ending()) {
            let message = format!(
                "{} ends like nothing that {option} can write",
                path.display()
            );
            return Err(Failure::input(message, content.advice(option)));
        }
        if content == Content::Values {
            ShadowIndex::check_save(path).map_err(|error| unsaved(&error))?;
        }
        let output = (option.to_owned(), path.to_path_buf());
        if let Some((other, _)) = self.files.insert(Identity::of(path), output) {
            let message = format!("{other} and {option} are one file: {}", path.display());
            return Err(Failure::input(message, "give them different names"));
        }
        Ok(())
    }

    /// Adds a file whose name follows from what `option` names. What stands there must be antumbra's own: nobody
    /// has said that it may be replaced.
    pub fn add_made(&mut self, option: &str, path: &Path, content: Content) -> Result<(), Failure> {
        self.add(option, path, content)?;
        let is_file = matches!(Place::of(path), Ok(Place::File));
        let Some(mark) = content.mark().filter(|_| is_file) else {
            return Ok(());
        };
        if antumbra_files::is_own(path, mark).unwrap_or(false) {
            return Ok(());
        }
        let message = format!(
            "{option} would overwrite {}, which antumbra did not write",
            path.display()
        );
        let help = format!("give {option} another name, or move that file away");
        Err(Failure::input(message, help))
    }

    /// Adds a scene, with the files that come beside it.
    pub fn add_scene(&mut self, option: &str, output: &Path) -> Result<(), Failure> {
        for path in antumbra_scene::write::files_of(output) {
            match path == output {
                true => self.add(option, &path, Content::Scene)?,
                false => self.add_made(option, &path, Content::Library)?,
            }
        }
        Ok(())
    }

    /// Adds a file if it was asked for.
    pub fn add_if(
        &mut self,
        option: &str,
        path: Option<&PathBuf>,
        content: Content,
    ) -> Result<(), Failure> {
        path.map_or(Ok(()), |path| self.add(option, path, content))
    }

    /// Refuses to write any of the files that are read.
    pub fn spare<'a>(&self, read: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), Failure> {
        for path in read {
            if let Some((option, output)) = self.files.get(&Identity::of(path)) {
                let message = format!(
                    "{option} would overwrite a file that is read: {} is {}",
                    output.display(),
                    path.display()
                );
                return Err(Failure::input(
                    message,
                    format!("give {option} another name"),
                ));
            }
        }
        Ok(())
    }
}

/// Returns why nothing can be written at a path: what was typed, or the system.
fn refused(path: &Path, refusal: Refusal) -> Failure {
    let message = format!("cannot write {}: {refusal}", path.display());
    match refusal {
        Refusal::System(_) | Refusal::Protected => Failure::system(message),
        Refusal::Link(_) => Failure::input(message, "give the file that it leads to"),
        _ => Failure::input(message, "give another name"),
    }
}

/// Returns why values are not saved.
pub fn unsaved(error: &SaveError) -> Failure {
    let help = match error {
        SaveError::Unwritable { .. } => return Failure::system(error.to_string()),
        SaveError::NoValues => "leave --shadows out",
        SaveError::Foreign { .. } => "give another name",
        _ => "",
    };
    Failure::input(error.to_string(), help)
}

/// Writes a file, whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    antumbra_files::write_bytes(path, bytes).map_err(|error| unwritable(path, error))
}

/// Writes figures as JSON, whole or not at all.
pub fn write_json(path: &Path, figures: &impl Serialize) -> Result<(), Failure> {
    let mut text =
        serde_json::to_vec_pretty(figures).map_err(|error| unwritable(path, error.into()))?;
    text.push(b'\n');
    write(path, &text)
}

/// Returns what the system says about a file.
pub fn unwritable(path: &Path, error: std::io::Error) -> Failure {
    Failure::system(format!("cannot write {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_say_what_is_in_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let add = |name: &str, content| {
            Outputs::none().add("--output", &folder.path().join(name), content)
        };
        for (name, content) in [
            ("a.png", Content::Picture),
            ("a.EXR", Content::Picture),
            ("a.npy", Content::Array),
            ("b.json", Content::Json),
            ("a.nff", Content::Nff),
            ("a.glb", Content::Scene),
            ("a.antumbra", Content::Values),
        ] {
            assert_eq!(add(name, content), Ok(()), "{name}");
        }
        for (name, content) in [
            ("a.jpg", Content::Picture),
            ("a", Content::Picture),
            ("a.csv", Content::Array),
            ("npy", Content::Array),
            ("a.npy.gz", Content::Array),
            ("a.obj", Content::Nff),
            ("a.stl", Content::Scene),
            ("a.npy", Content::Values),
        ] {
            let Err(failure) = add(name, content) else {
                panic!("{name}")
            };
            assert_eq!(failure.exit_code(), 2, "{name}");
            let said = format!("{:?}", failure);
            assert!(said.contains("a name that ends in ."), "{said}");
        }
    }

    #[test]
    fn no_output_is_an_input_or_another_output() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("in")).unwrap();
        let mut outputs = Outputs::none();
        outputs
            .add("--output", &path("a.npy"), Content::Array)
            .unwrap();
        let same = path("in/../a.npy");
        assert!(outputs.add("--json", &same, Content::Array).is_err());
        assert!(outputs.spare([&same]).is_err());
        assert_eq!(outputs.spare([&path("b.npy")]), Ok(()));
    }
}
