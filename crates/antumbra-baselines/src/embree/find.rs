//! Where Embree may be.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns the places to try, in order.
pub(super) fn candidates() -> Vec<PathBuf> {
    if let Some(path) = env::var_os("ANTUMBRA_EMBREE") {
        return vec![path.into()];
    }
    let variable = |name| env::var_os(name).map(PathBuf::from);
    let environments = [
        variable("VIRTUAL_ENV"),
        variable("CONDA_PREFIX"),
        variable("HOME").map(|home| home.join(".local")),
        Some("/usr/local".into()),
        Some("/usr".into()),
    ];
    let mut found: Vec<_> = environments
        .iter()
        .flatten()
        .flat_map(|environment| in_environment(environment))
        .collect();
    found.push("libembree4.so.4".into());
    found
}

/// Returns the libraries that `embreex` brought into a Python environment.
fn in_environment(environment: &Path) -> Vec<PathBuf> {
    let pythons = entries(&environment.join("lib"), "python3");
    let packages = pythons.iter().flat_map(|python| {
        ["site-packages", "dist-packages"].map(|name| python.join(name).join("embreex.libs"))
    });
    packages
        .flat_map(|folder| entries(&folder, "libembree4"))
        .collect()
}

/// Returns what a folder holds under names that begin so, sorted; nothing if it cannot be read.
fn entries(folder: &Path, beginning: &str) -> Vec<PathBuf> {
    let mut found: Vec<_> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(beginning))
        .map(|entry| entry.path())
        .collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_are_not_there_give_nothing() {
        assert_eq!(in_environment(Path::new("/nowhere")), Vec::<PathBuf>::new());
    }
}
