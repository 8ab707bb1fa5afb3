//! What gathering refuses.

use antumbra_geometry::OccludersError;

/// Why the surfaces of a scene cannot be gathered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GatherError {
    /// An object's numbers are out of range.
    #[error("object {object}{}: {source}", named(name))]
    BadObject {
        /// Index into [`Scene::objects`](crate::model::Scene::objects).
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// What is wrong.
        source: OccludersError,
    },
    /// An object names a material, a texture, a position or a face end that is not there.
    #[error("object {object}{}: {what} is out of range", named(name))]
    BadIndex {
        /// Index into [`Scene::objects`](crate::model::Scene::objects).
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// Which index it is.
        what: &'static str,
    },
}

fn named(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" ({name})")
    }
}
