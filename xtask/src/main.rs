//! Every chore of the project: `cargo xtask CHORE`.

mod gallery;
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

use anyhow::Result;

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
  gallery  remakes the pictures in docs/images, by the commands of the pages that show them
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
        Some("gallery") => gallery::make(),
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
