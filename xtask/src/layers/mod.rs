//! The check that everything looks downwards (ARCHITECTURE.md, "Floors").

mod imports;
mod modules;
mod rooms;

use std::path::Path;

use anyhow::{Context, Result, bail};
use cargo_metadata::{DependencyKind, MetadataCommand};

use crate::run;

/// Floors of the crates. A crate may use crates of lower floors only.
const FLOORS: &[(&str, u32)] = &[
    ("antumbra-files", 0),
    ("antumbra-task", 0),
    ("antumbra-geometry", 1),
    ("antumbra-scene", 2),
    ("antumbra", 2),
    ("antumbra-baselines", 3),
    ("antumbra-render", 4),
    ("antumbra-sun", 4),
    ("antumbra-cli", 5),
    ("antumbra-bench", 6),
    ("antumbra-python", 6),
    // Test and chore crates stand beside the house: nothing ships that uses them.
    ("antumbra-testkit", 9),
    ("xtask", 9),
];

/// Floors of the rooms of crates, from the lowest up: a file or a folder of a crate's `src` is a room. A room may use
/// rooms of lower floors only.
const ROOMS: &[(&str, &[&str])] = &[
    (
        "crates/antumbra/src",
        &[
            "answer clock draw limits threads",
            "stats",
            "accel",
            "occlusion",
            "method settings",
            "file",
            "index",
            "query",
        ],
    ),
    (
        "crates/antumbra-geometry/src",
        &[
            "bounds coverage filter ids number polygon shape short",
            "flat light ray",
            "area segment",
            "intersect",
            "freeform",
            "umbra",
            "occluders",
            "mesh",
            "lit along patch",
        ],
    ),
    (
        "crates/antumbra-scene/src",
        &[
            "error mesh shadow_kind",
            "instance room warning",
            "bump texture",
            "model",
            "bounds defaults gather opacity shared tessellate",
            "generate read",
            "write",
        ],
    ),
    (
        "crates/antumbra-render/src",
        &[
            "cone exposure sampler vector",
            "camera fog orbit prepare",
            "integrator",
            "aov statistics",
            "false_color",
            "color_map film",
            "image_file legend value_picture",
            "exr_file",
        ],
    ),
    (
        "crates/antumbra-sun/src",
        &[
            "calendar error",
            "suns text",
            "positions",
            "sky weather point_file",
            "epw wea sun_file",
            "sensors",
            "grid study",
            "blockers record",
            "nearest sums",
            "groups",
            "arrays",
            "write",
            "read",
        ],
    ),
    (
        "crates/antumbra-cli/src",
        &[
            "failure machine methods values",
            "light_values memory outputs scene_source screen soft",
            "interrupt saved",
            "typed",
            "load",
            "commands",
        ],
    ),
];

/// The one folder of the library that may touch files: its own.
const FILES: &str = "crates/antumbra/src/file";

/// What a folder of source must not mention, tests and [`FILES`] apart.
const FORBIDDEN: &[(&str, &str, &str)] = &[
    (
        "crates/antumbra/src/accel/grid",
        "LightShape",
        "the grid knows no lights",
    ),
    (
        "crates/antumbra/src/occlusion",
        "crate::method",
        "values know no queries",
    ),
    (
        "crates/antumbra/src",
        "std::fs",
        "the library reads and writes no files but those of `file`",
    ),
    (
        "crates/antumbra/src",
        "std::io",
        "the library reads and writes no files but those of `file`",
    ),
    (
        "crates/antumbra/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-cli/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-cli/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-cli/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-python/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-python/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-python/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-render/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-render/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-render/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-scene/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-scene/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-scene/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-geometry/src",
        "std::fs",
        "geometry knows no files",
    ),
    (
        "crates/antumbra-geometry/src",
        "std::thread",
        "geometry knows no threads",
    ),
    (
        "crates/antumbra-sun/src",
        "fs::write",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-sun/src",
        "File::create",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-sun/src",
        "OpenOptions",
        "files are opened and written by antumbra-files",
    ),
    (
        "crates/antumbra-sun/src",
        "std::env",
        "only the program looks at its surroundings",
    ),
    (
        "crates/antumbra-render/src",
        "std::env",
        "only the program looks at its surroundings",
    ),
];

/// Lines of a source file at most, its tests included.
const LONGEST_FILE: usize = 600;

/// Checks crates and modules: floors of crates, imports within a crate, how long files are, and what a folder must not
/// mention.
pub(crate) fn check() -> Result<()> {
    check_crates()?;
    check_lengths(&run::root().join("crates"))?;
    rooms::check(ROOMS)?;
    for (folder, word, reason) in FORBIDDEN {
        check_folder(&run::root().join(folder), word, reason)?;
    }
    Ok(())
}

fn check_crates() -> Result<()> {
    let metadata = MetadataCommand::new()
        .manifest_path(run::root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .context("cargo metadata")?;
    let floor = |name: &str| {
        FLOORS
            .iter()
            .find(|(known, _)| *known == name)
            .map(|&(_, floor)| floor)
    };
    for package in &metadata.packages {
        let name = package.name.as_str();
        let Some(own) = floor(name) else {
            bail!("crate {name} has no floor in xtask's layers")
        };
        let used = package
            .dependencies
            .iter()
            .filter(|dependency| dependency.kind != DependencyKind::Development)
            .filter_map(|dependency| {
                floor(&dependency.name).map(|floor| (&dependency.name, floor))
            });
        for (dependency, below) in used {
            if below >= own {
                bail!(
                    "crate {name} (floor {own}) uses {dependency} (floor {below}): look downwards"
                );
            }
        }
    }
    Ok(())
}

fn check_lengths(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("{folder:?}"))? {
        let path = entry?.path();
        if path.is_dir() {
            check_lengths(&path)?;
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let count = std::fs::read_to_string(&path)?.lines().count();
            if count > LONGEST_FILE {
                bail!(
                    "{}: {count} lines: part it (at most {LONGEST_FILE})",
                    path.display()
                );
            }
        }
    }
    Ok(())
}

fn check_folder(folder: &Path, word: &str, reason: &str) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("{folder:?}"))? {
        let path = entry?.path();
        if path == run::root().join(FILES) {
            continue;
        }
        if path.is_dir() {
            check_folder(&path, word, reason)?;
            continue;
        }
        let text = std::fs::read_to_string(&path)?;
        // Tests stand at the end of a file.
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let line = code
            .lines()
            .position(|line| !line.trim_start().starts_with("//") && line.contains(word));
        if let Some(line) = line {
            bail!("{}:{}: `{word}`: {reason}", path.display(), line + 1);
        }
    }
    Ok(())
}
