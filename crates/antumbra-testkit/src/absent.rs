//! What tests compare with and may not be there: other people's scenes, Embree, a browser.
//!
//! A test that does not run says so aloud. It fails instead where the environment variable `ANTUMBRA_REQUIRE`, a list
//! with commas, names what is missing: `scenes`, `embree`, `browser`.

use std::path::{Path, PathBuf};

/// Says that a test does not run for want of something.
///
/// # Panics
/// `ANTUMBRA_REQUIRE` names it.
#[expect(clippy::print_stderr, reason = "a skipped test must be seen")]
pub fn skip(what: &str, why: &str) {
    let required = std::env::var("ANTUMBRA_REQUIRE").unwrap_or_default();
    let is_required = required.split(',').any(|name| name.trim() == what);
    assert!(
        !is_required,
        "{what} is required by ANTUMBRA_REQUIRE: {why}"
    );
    eprintln!("SKIPPED for want of {what}: {why}");
}

/// Returns the folder of other people's scenes: that of `ANTUMBRA_SCENES`, or `shared/scenes` beside the repository.
/// `None` if it is not there, which is said.
///
/// # Panics
/// It is not there, and `ANTUMBRA_REQUIRE` names `scenes`.
pub fn shared_scenes() -> Option<PathBuf> {
    let folder = std::env::var_os("ANTUMBRA_SCENES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    let why = format!(
        "no folder {}; ANTUMBRA_SCENES names another",
        folder.display()
    );
    skip("scenes", &why);
    None
}
