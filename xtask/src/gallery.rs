//! The pictures in `docs/images`, made by the commands that the pages show beside them.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result, bail, ensure};

use crate::{python, run};

/// Pages whose pictures their own commands make.
const PAGES: [&str; 5] = [
    "README.md",
    "docs/glass.md",
    "docs/bumps.md",
    "docs/curved.md",
    "docs/sun.md",
];

/// How commands of the program begin.
const PROMPTS: [&str; 2] = ["$ cargo run --release -- ", "$ antumbra "];

/// Makes the pictures of all pages again.
pub(crate) fn make() -> Result<()> {
    let build = [
        "build",
        "--release",
        "--locked",
        "--package",
        "antumbra-cli",
    ];
    run::cargo(&build, &[])?;
    let program = python::target()?.join("release").join("antumbra");
    let folder = std::env::temp_dir().join(format!("antumbra-gallery-{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    let made = PAGES
        .iter()
        .try_for_each(|page| make_page(page, &program, &folder));
    std::fs::remove_dir_all(&folder)?;
    made
}

/// Runs the commands of a page whose picture it shows, each after those that make the scenes that it names.
fn make_page(page: &str, program: &Path, folder: &Path) -> Result<()> {
    let text = std::fs::read_to_string(run::root().join(page))?;
    let commands: Vec<Vec<&str>> = text
        .lines()
        .filter_map(|line| PROMPTS.iter().find_map(|prompt| line.strip_prefix(prompt)))
        .map(|line| line.split_whitespace().collect())
        .collect();
    let mut count = 0;
    for command in &commands {
        let shown = command
            .iter()
            .find(|word| word.ends_with(".png") && text.contains(&format!("images/{word}")));
        let Some(picture) = shown else { continue };
        let scenes = commands.iter().filter(|other| {
            other.first() == Some(&"scene")
                && other.last().is_some_and(|file| command.contains(file))
        });
        for scene in scenes.chain([command]) {
            run_in(folder, program, scene)?;
        }
        std::fs::copy(
            folder.join(picture),
            run::root().join("docs/images").join(picture),
        )
        .with_context(|| format!("{page}: no {picture} was made"))?;
        count += 1;
    }
    ensure!(count > 0, "{page} has no command whose picture it shows");
    Ok(())
}

/// Runs the program in a folder; scenes of the repository are found there.
fn run_in(folder: &Path, program: &Path, words: &[&str]) -> Result<()> {
    run::say(&format!("xtask: antumbra {}", words.join(" ")));
    let words = words.iter().map(|word| match word.strip_prefix("scenes/") {
        Some(scene) => run::root().join("scenes").join(scene).into_os_string(),
        None => word.into(),
    });
    let status = Command::new(program)
        .args(words)
        .current_dir(folder)
        .status()
        .context("the program does not start")?;
    if !status.success() {
        bail!("the program failed ({status})");
    }
    Ok(())
}
