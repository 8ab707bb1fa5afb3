//! How the program ends.
//!
//! In: what went wrong. Out: an exit code by meaning and a report. The codes are part of the
//! program's interface and listed in `--help`.

use antumbra::{BuildError, LoadError, Refusal};
use antumbra_render::prepare::PrepareError;
use antumbra_scene::ReadError;
use antumbra_scene::gather::GatherError;
use miette::MietteDiagnostic;

/// How a run that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As asked.
    Done,
    /// Answers that differ were found.
    Differences,
    /// Stopped by a signal, which says the exit code.
    Interrupted,
}

/// Why a run failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// What was given cannot be used: code 2, as for usage errors.
    Input {
        /// What, where, and what was expected.
        message: String,
        /// What to do next.
        help: Option<String>,
    },
    /// Input was fine, but the system refused something: code 3.
    System {
        /// What was refused.
        message: String,
    },
}

impl Failure {
    /// Makes a failure of what was given.
    pub fn input(message: impl Into<String>, help: impl Into<String>) -> Self {
        let help = help.into();
        Self::Input {
            message: message.into(),
            help: (!help.is_empty()).then_some(help),
        }
    }

    /// Makes a failure of the system.
    pub fn system(message: impl Into<String>) -> Self {
        Self::System {
            message: message.into(),
        }
    }

    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } => 2,
            Self::System { .. } => 3,
        }
    }

    /// Returns the failure in the form that `miette` draws.
    pub fn diagnostic(&self) -> MietteDiagnostic {
        match self {
            Self::Input {
                message,
                help: Some(help),
            } => MietteDiagnostic::new(message).with_help(help),
            Self::Input {
                message,
                help: None,
            }
            | Self::System { message } => MietteDiagnostic::new(message),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        let message = format!("{}{}: {}", error.file.display(), error.place, error.kind);
        Self::input(message, error.help())
    }
}

impl From<GatherError> for Failure {
    fn from(error: GatherError) -> Self {
        Self::input(error.to_string(), "")
    }
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Self {
        let help = match &error {
            BuildError::Memory { predicted, .. } => {
                match predicted.tree > predicted.grid + predicted.values {
                    true => "raise --memory-limit, or use a scene of fewer surfaces",
                    false => "give --grid fewer voxels, or raise --memory-limit",
                }
            }
            BuildError::BadResolution(_) => "give --grid other numbers",
            BuildError::Occlusion(refused) => help_with_file(refused),
            _ => "",
        };
        Self::input(error.to_string(), help)
    }
}

impl From<PrepareError> for Failure {
    fn from(error: PrepareError) -> Self {
        match error {
            PrepareError::Gather(error) => error.into(),
            PrepareError::Build(error) => error.into(),
        }
    }
}

/// Returns what to do about a file that is refused.
fn help_with_file(error: &LoadError) -> &'static str {
    match error.reason {
        Refusal::Stale(_) => {
            "write it again for this scene and these settings: antumbra bake SCENE -o FILE.antumbra"
        }
        Refusal::Version { .. }
        | Refusal::Length { .. }
        | Refusal::Damaged(_)
        | Refusal::Malformed { .. } => "write it again: antumbra bake SCENE -o FILE.antumbra",
        Refusal::Foreign | Refusal::Unreadable(_) => "give a file that antumbra bake wrote",
        Refusal::NoValues => "leave --shadows or --occlusion out",
        Refusal::OtherMethod => {
            "write another with antumbra bake SCENE --shadows voxel -o FILE.antumbra, or leave --shadows out"
        }
        _ => "leave --occlusion out",
    }
}
