//! Every chore of the project: `cargo xtask CHORE`.

mod layers;
mod paths;
mod python;
mod run;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};

const USAGE: &str = "\
usage: cargo xtask CHORE

chores:
  lint     formatting, clippy, documentation, layers and paths in Markdown; no warning passes
  test     all tests, those of the Python package too
  python   only the tests of the Python package
  wheel    the Python package's wheel for users, into target/wheels
  site     the documentation's site, into target/site
  layers   only the check that crates and modules look downwards
  paths    only the check that files named in our Markdown exist
  package  the packages of all published crates, built from nothing else, as a dry run of publishing them
  gallery  remakes the pictures of the README into docs/images
";

fn main() -> ExitCode {
    let chore = std::env::args().nth(1);
    let outcome = match chore.as_deref() {
        Some("lint") => lint(),
        Some("test") => test(),
        Some("python") => python::Tests::new().and_then(|tests| tests.run()),
        Some("wheel") => python::wheel(),
        Some("site") => python::site(),
        Some("layers") => layers::check(),
        Some("paths") => paths::check(),
        Some("package") => package(),
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

/// Crates that are not published are left out.
fn package() -> Result<()> {
    let publish = ["publish", "--workspace", "--dry-run", "--locked"];
    run::cargo(&publish, &[])
}

/// The pictures of the README, from the project's own scenes only.
///
/// One light shows what a voxel knows more clearly than three, whose colors would be averaged. The first two are
/// made by the commands of the README.
fn gallery() -> Result<()> {
    let images = run::root().join("docs/images");
    std::fs::create_dir_all(&images)?;
    let lamp = "point:4,-2,4";
    // A lamp with a size: a square whose front looks at the spheres.
    let panel = "area:4,-2,4/0.8,1.6,0/1.07,-0.54,-1.34/0.95,0.9,0.8";
    let pictures: [(&str, &[&str]); 7] = [
        (
            "sphereflake.png",
            &[
                "scenes/sphereflake.nff",
                "--light",
                lamp,
                "--camera",
                "fov:40",
                "--spp",
                "16",
            ],
        ),
        (
            "sphereflake-occlusion.png",
            &[
                "scenes/sphereflake.nff",
                "--light",
                lamp,
                "--camera",
                "fov:40",
                "--show",
                "occlusion",
                "--shadows",
                "voxel",
                "--refine",
                "eager",
            ],
        ),
        ("tetra.png", &["scenes/tetra.nff", "--spp", "16"]),
        (
            "tetra-occlusion.png",
            &[
                "scenes/tetra.nff",
                "--show",
                "occlusion",
                "--shadows",
                "voxel-1990",
                "--spp",
                "4",
            ],
        ),
        (
            "tetra-3-occlusion.png",
            &[
                "scenes/tetra-3.nff",
                "--show",
                "occlusion",
                "--shadows",
                "voxel-1990",
                "--spp",
                "4",
            ],
        ),
        (
            "soft.png",
            &[
                "scenes/sphereflake.nff",
                "--light",
                panel,
                "--light",
                "sky:.15,.2,.3",
                "--camera",
                "fov:40",
                "--light-samples",
                "32",
                "--spp",
                "9",
            ],
        ),
        (
            "soft-occlusion.png",
            &[
                "scenes/sphereflake.nff",
                "--light",
                panel,
                "--camera",
                "fov:40",
                "--show",
                "occlusion",
                "--light-samples",
                "64",
                "--spp",
                "4",
            ],
        ),
    ];
    for (name, arguments) in pictures {
        let output = images.join(name);
        let Some(output) = output.to_str() else {
            bail!("path {output:?} is not UTF-8")
        };
        let mut command = vec![
            "run",
            "--release",
            "--locked",
            "-p",
            "antumbra-cli",
            "--",
            "render",
        ];
        command.extend_from_slice(arguments);
        command.extend_from_slice(&["--size", "480x480", "-o", output]);
        run::cargo(&command, &[])?;
    }
    Ok(())
}
