//! The check that files which our Markdown names exist.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use crate::run;

/// First parts of paths that are looked up; other back-ticked words are not paths of ours.
const ROOTS: &[&str] = &[
    "crates/", "python/", "docs/", "scenes/", "xtask/", "bench/", ".ci/",
];

/// Checks all Markdown files of the repository.
pub(crate) fn check() -> Result<()> {
    let mut missing = Vec::new();
    for page in pages(&run::root())? {
        let text = std::fs::read_to_string(&page)?;
        for name in named_paths(&text) {
            let beside = page.parent().unwrap_or(Path::new(".")).join(name);
            if !run::root().join(name).exists() && !beside.exists() {
                missing.push(format!("{}: {name}", page.display()));
            }
        }
    }
    if !missing.is_empty() {
        bail!(
            "Markdown names files that do not exist:\n{}",
            missing.join("\n")
        );
    }
    Ok(())
}

fn pages(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() && name != "target" && !(name.starts_with('.') && name != ".ci") {
            found.extend(pages(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
    Ok(found)
}

/// Paths in back-ticks under our folders, and targets of relative links.
fn named_paths(text: &str) -> Vec<&str> {
    let quoted = text.split('`').skip(1).step_by(2);
    let linked = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let is_ours = |path: &&str| {
        ROOTS.iter().any(|root| path.starts_with(root))
            && !path.contains(|c: char| c.is_whitespace() || "*<>{}|".contains(c))
    };
    let is_relative = |target: &&str| !target.contains("://") && !target.starts_with('#');
    quoted
        .filter(is_ours)
        .chain(linked.filter(is_relative))
        .map(|path| {
            path.split('#')
                .next()
                .unwrap_or(path)
                .trim_end_matches([':', ','])
        })
        .filter(|path| !path.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::named_paths;

    #[test]
    fn finds_paths_and_links_only() {
        let text =
            "See `crates/a/b.rs`, `cargo test` and [this](docs/x.md#part), [web](https://a.b).";
        assert_eq!(named_paths(text), ["crates/a/b.rs", "docs/x.md"]);
    }
}
