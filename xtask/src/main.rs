//! Every chore of the project: `cargo xtask CHORE`.

mod inlined;
mod layers;
mod package;
mod paths;
mod python;
mod run;
mod tables;
mod words;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context as _, Result, bail};

const USAGE: &str = "\
usage: cargo xtask CHORE

chores:
  lint     formatting, clippy, documentation, layers and paths in Markdown; no warning passes
  test     all tests, those of the Python package too
  python   only the tests of the Python package
  wheel    the Python package's wheel for users, into target/wheels
  site     the documentation's site, into target/site
  cli      the reference of the program in docs/cli.md, from what the program says of itself
  tables   the tables of docs/performance.md, from the raw runs in bench/runs
  layers   only the check that crates and modules look downwards
  paths    only the check that files named in our Markdown exist
  words    only the check of words that have a better one
  package  the packages of all published crates, built from nothing else, as a dry run of publishing them
  inlined  whether the release build calls SIMD operations that it should inline (objdump)
  gallery  remakes the pictures of the README and of the pages about glass, bumps and curved surfaces into docs/images
";

fn main() -> ExitCode {
    let chore = std::env::args().nth(1);
    let outcome = match chore.as_deref() {
        Some("lint") => lint(),
        Some("test") => test(),
        Some("python") => python::Tests::new().and_then(|tests| tests.run()),
        Some("wheel") => python::wheel(),
        Some("site") => python::site(),
        Some("cli") => cli(),
        Some("tables") => tables::write(),
        Some("layers") => layers::check(),
        Some("paths") => paths::check(),
        Some("words") => words::check(),
        Some("package") => package::check(),
        Some("inlined") => inlined::check(),
        Some("gallery") => gallery(),
        _ => {
            run::say(USAGE);
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            run::say(&format!("xtask: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

/// Embree comes with what the Python package is compared with; the tests of Rust use it, too.
fn test() -> Result<()> {
    const EMBREE: &str = "ANTUMBRA_EMBREE";
    let python = python::Tests::new()?;
    let embree = python.embree();
    let embree = embree.as_deref().and_then(Path::to_str);
    let named = embree.filter(|_| std::env::var_os(EMBREE).is_none());
    let variables: Vec<_> = named.map(|path| (EMBREE, path)).into_iter().collect();
    run::cargo(&["test", "--workspace", "--locked"], &variables)?;
    python.run()
}

/// Cheap checks first.
fn lint() -> Result<()> {
    layers::check()?;
    paths::check()?;
    words::check()?;
    tables::check()?;
    run::cargo(&["fmt", "--all", "--check"], &[])?;
    let clippy = [
        "clippy",
        "--workspace",
        "--all-targets",
        "--locked",
        "--",
        "-D",
        "warnings",
    ];
    run::cargo(&clippy, &[])?;
    // What a renderer may leave out of the library: each feature alone, and none.
    for features in ["", "parallel", "file"] {
        let alone = [
            "clippy",
            "--package",
            "antumbra",
            "--no-default-features",
            "--features",
            features,
            "--locked",
            "--",
            "-D",
            "warnings",
        ];
        run::cargo(&alone, &[])?;
    }
    let doc = [
        "doc",
        "--workspace",
        "--no-deps",
        "--locked",
        "--document-private-items",
    ];
    run::cargo(&doc, &[("RUSTDOCFLAGS", "-D warnings")])?;
    licenses()
}

/// Licenses and sources of dependencies, where the tool is there.
fn licenses() -> Result<()> {
    if !run::has_cargo_command("deny") {
        run::say("xtask: cargo-deny is not installed: licenses of dependencies are not checked");
        return Ok(());
    }
    run::cargo(&["deny", "check"], &[])
}

/// The test that compares the reference writes it, too.
fn cli() -> Result<()> {
    let test = [
        "test",
        "--package",
        "antumbra-cli",
        "--test",
        "reference",
        "--locked",
    ];
    run::cargo(&test, &[("ANTUMBRA_WRITE", "1")])
}

/// Runs the commands of the README that render, and puts their pictures where the README shows them.
fn gallery() -> Result<()> {
    const RENDER: &str = "$ cargo run --release -- render ";
    let readme = std::fs::read_to_string(run::root().join("README.md"))?;
    let commands: Vec<_> = readme
        .lines()
        .filter_map(|line| line.strip_prefix(RENDER)?.split_once(" -o "))
        .collect();
    if commands.is_empty() {
        bail!("README.md has no command that renders");
    }
    for (arguments, name) in commands {
        render(arguments, &format!("docs/images/{name}"))?;
    }
    pictures_of("docs/glass.md")?;
    pictures_of("docs/curved.md")?;
    bumps()
}

/// Makes the pictures of docs/bumps.md by its commands that render a scene of the repository.
fn bumps() -> Result<()> {
    let page = std::fs::read_to_string(run::root().join("docs/bumps.md"))?;
    let commands: Vec<_> = page
        .lines()
        .filter_map(|line| {
            line.strip_prefix("$ antumbra render scenes/")?
                .split_once(" -o ")
        })
        .collect();
    if commands.len() < 2 {
        bail!("docs/bumps.md has no two commands that render");
    }
    for (arguments, name) in commands {
        render(
            &format!("scenes/{arguments}"),
            &format!("docs/images/{name}"),
        )?;
    }
    Ok(())
}

/// Makes the pictures of a page: of each scene that it makes by a command, the one that the command after it renders.
fn pictures_of(page: &str) -> Result<()> {
    let text = std::fs::read_to_string(run::root().join(page))?;
    let commands: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("$ antumbra "))
        .collect();
    let mut count = 0;
    for pair in commands.windows(2) {
        let Some(scene) = pair[0].strip_prefix("scene ") else {
            continue;
        };
        let (name, file) = scene.split_once(" -o ").context("a scene without `-o`")?;
        let place = std::env::temp_dir().join(file);
        let place = place
            .to_str()
            .context("the temporary folder's name is no text")?;
        run::cargo(
            &[
                "run",
                "--release",
                "--locked",
                "--",
                "scene",
                name,
                "-o",
                place,
            ],
            &[],
        )?;
        let rest = pair[1].strip_prefix(&format!("render {file} "));
        let rest = rest.with_context(|| format!("{page} renders no {file}"))?;
        let (options, picture) = rest.split_once(" -o ").context("a command without `-o`")?;
        render(
            &format!("{place} {options}"),
            &format!("docs/images/{picture}"),
        )?;
        count += 1;
    }
    anyhow::ensure!(count > 0, "{page} makes no scene");
    Ok(())
}

/// Renders by the program as it is.
fn render(arguments: &str, output: &str) -> Result<()> {
    let mut command = vec!["run", "--release", "--locked", "--", "render"];
    command.extend(arguments.split(' '));
    command.extend(["-o", output]);
    run::cargo(&command, &[])
}
