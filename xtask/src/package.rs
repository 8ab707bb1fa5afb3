//! The packages of the crates that are published: what they hold, and whether they build from nothing else.

use anyhow::{Context, Result, bail};
use cargo_metadata::MetadataCommand;

use crate::run;

/// Files that each package carries.
const CARRIED: [&str; 3] = ["README.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// Lists and builds all packages, as a dry run of publishing them. Crates that are not published are left out.
pub(crate) fn check() -> Result<()> {
    for name in published()? {
        let list = run::cargo_output(&["package", "--list", "--allow-dirty", "--package", &name])?;
        if let Some(absent) = absent(&list) {
            bail!("the package of {name} has no {absent}");
        }
    }
    let publish = ["publish", "--workspace", "--dry-run", "--locked"];
    run::cargo(&publish, &[])
}

/// Returns the crates of the workspace that are published.
fn published() -> Result<Vec<String>> {
    let metadata = MetadataCommand::new()
        .manifest_path(run::root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .context("cargo metadata")?;
    let is_published =
        |publish: &Option<Vec<String>>| publish.as_ref().is_none_or(|to| !to.is_empty());
    let packages = metadata.packages.into_iter();
    let published = packages.filter(|package| is_published(&package.publish));
    Ok(published.map(|package| package.name.to_string()).collect())
}

/// Returns a file that a package has to carry and does not.
fn absent(list: &str) -> Option<&'static str> {
    CARRIED
        .into_iter()
        .find(|due| !list.lines().any(|line| line == *due))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_without_a_readme_or_a_license_is_told() {
        let all = "Cargo.toml\nLICENSE-APACHE\nLICENSE-MIT\nREADME.md\nsrc/lib.rs\n";
        assert_eq!(absent(all), None);
        for due in CARRIED {
            let lacking = all.replace(due, "docs/other");
            assert_eq!(absent(&lacking), Some(due));
        }
    }

    #[test]
    fn the_product_is_published_and_its_measurements_are_not() {
        let published = published().unwrap();
        assert!(published.iter().any(|name| name == "antumbra"));
        assert!(!published.iter().any(|name| name == "antumbra-bench"));
    }
}
