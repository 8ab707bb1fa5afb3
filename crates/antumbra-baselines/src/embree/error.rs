//! Why there is no Embree.

use std::path::PathBuf;

/// Why Embree cannot be had. Whoever meets it must say so: a table without the rival looks the
/// same as one in which it was left out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmbreeError {
    /// No library was found.
    #[error(
        "Embree 4 is not there (tried {}); set ANTUMBRA_EMBREE to libembree4, or `pip install embreex` in an active environment",
        list(tried)
    )]
    NotFound {
        /// Names that were tried, in order.
        tried: Vec<PathBuf>,
    },
    /// A library was found but cannot be used.
    #[error("{path:?} cannot be used as Embree 4: {message}")]
    Unusable {
        /// The library.
        path: PathBuf,
        /// Message of the loader.
        message: String,
    },
    /// Embree reports an error.
    #[error("Embree reports error {code} while {doing}")]
    Refused {
        /// `RTCError`.
        code: i32,
        /// Step that failed.
        doing: &'static str,
    },
}

pub(super) fn list(paths: &[PathBuf]) -> String {
    let paths: Vec<_> = paths
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    paths.join(", ")
}
