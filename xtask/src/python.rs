//! The chores of the Python package: its wheel, its tests, the documentation's site.
//!
//! All work in virtual environments below the target folder, made anew each time, so that nothing of the machine
//! is used but its interpreter and nothing of it is changed.

use std::env::consts::EXE_EXTENSION;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use cargo_metadata::MetadataCommand;

use crate::run;

/// The oldest Python that the package is for.
const OLDEST: (u32, u32) = (3, 10);

/// The largest wheel that is passed.
const MOST_WHEEL_BYTES: u64 = 12_000_000;

/// A fresh environment with what the package is tested and compared with.
pub(crate) struct Tests(Environment);

impl Tests {
    pub(crate) fn new() -> Result<Self> {
        let environment = Environment::new("test")?;
        environment.install(&["--requirement", "python/requirements-test.txt"])?;
        Ok(Self(environment))
    }

    /// Finds the Embree library that came with its Python binding, for the tests of Rust.
    pub(crate) fn embree(&self) -> Option<PathBuf> {
        let folder = self.0.interpreter.parent()?.parent()?.join("lib");
        let pythons = std::fs::read_dir(folder).ok()?.flatten();
        let libraries = pythons.filter_map(|python| {
            let folder = python.path().join("site-packages/embreex.libs");
            std::fs::read_dir(folder).ok()
        });
        let files = libraries.flat_map(|folder| folder.flatten());
        files.map(|file| file.path()).find(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("libembree4")
        })
    }

    /// Installs the package, as `pip install .` does, and runs its tests; no warning passes.
    ///
    /// The library is built as for the tests of Rust, with what they have built; the wheel for users is
    /// [`wheel`]'s.
    pub(crate) fn run(&self) -> Result<()> {
        // maturin is there already, in the version that is pinned.
        let quick = ["--no-build-isolation", "--no-deps", "--force-reinstall"];
        let profile = "--config-settings=build-args=--profile dev --locked";
        self.0.install(&[&quick[..], &[profile, "."]].concat())?;
        self.0.python(&["-m", "pytest", "-W", "error"])
    }
}

/// Builds the wheel that users get, and refuses a large one.
pub(crate) fn wheel() -> Result<()> {
    let environment = Environment::new("wheel")?;
    environment.install(&["maturin>=1.9.4,<2"])?;
    let folder = target()?.join("wheels");
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    let out = text(&folder)?;
    environment.python(&[
        "-m",
        "maturin",
        "build",
        "--release",
        "--locked",
        "--out",
        out,
    ])?;
    for file in std::fs::read_dir(&folder)? {
        let file = file?;
        let bytes = file.metadata()?.len();
        run::say(&format!("xtask: {:?}: {bytes} bytes", file.path()));
        if bytes > MOST_WHEEL_BYTES {
            bail!("the wheel takes more than {MOST_WHEEL_BYTES} bytes");
        }
    }
    Ok(())
}

/// Builds the documentation's site.
pub(crate) fn site() -> Result<()> {
    let environment = Environment::new("site")?;
    environment.install(&["--requirement", "python/requirements-site.txt"])?;
    let out = target()?.join("site");
    let out = text(&out)?;
    let config = "docs/site/mkdocs.yml";
    environment.python(&[
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--config-file",
        config,
        "--site-dir",
        out,
    ])?;
    let report = run::root().join("docs/report/index.html");
    let page = Path::new(out).join("paper.html");
    std::fs::copy(&report, &page).with_context(|| format!("copying {report:?} to {page:?}"))?;
    run::say(&format!("xtask: the site is in {out}"));
    Ok(())
}

/// A virtual environment.
struct Environment {
    interpreter: PathBuf,
    /// The search path with the environment's programs first: pip looks for maturin there.
    search_path: OsString,
}

impl Environment {
    /// Makes one anew.
    fn new(name: &str) -> Result<Self> {
        let base = interpreter()?;
        let folder = target()?.join("python").join(name);
        run::say(&format!("xtask: a fresh virtual environment in {folder:?}"));
        let search_path = std::env::var_os("PATH").unwrap_or_default();
        let venv = ["-m", "venv", "--clear", text(&folder)?];
        call(&base, &venv, &search_path).with_context(|| {
            format!("{base:?} makes no virtual environment; install its module venv with pip")
        })?;
        let programs = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
        let interpreter = programs.join("python").with_extension(EXE_EXTENSION);
        let others = std::env::split_paths(&search_path);
        let search_path = std::env::join_paths(std::iter::once(programs).chain(others))?;
        Ok(Self {
            interpreter,
            search_path,
        })
    }

    /// Runs pip.
    fn install(&self, what: &[&str]) -> Result<()> {
        let pip = [
            "-m",
            "pip",
            "--disable-pip-version-check",
            "install",
            "--quiet",
        ];
        self.python(&[&pip[..], what].concat())
    }

    fn python(&self, arguments: &[&str]) -> Result<()> {
        run::say(&format!("xtask: python {}", arguments.join(" ")));
        call(&self.interpreter, arguments, &self.search_path)
    }
}

/// Finds a Python that is new enough: the one that `PYTHON` names, or `python3`, or `python`.
fn interpreter() -> Result<PathBuf> {
    let named = std::env::var_os("PYTHON").map(PathBuf::from);
    let candidates = match named {
        Some(named) => vec![named],
        None => vec!["python3".into(), "python".into()],
    };
    for candidate in &candidates {
        let asked = Command::new(candidate)
            .args(["-c", "import sys; print(*sys.version_info[:2])"])
            .output();
        let Ok(answer) = asked else { continue };
        let version = String::from_utf8_lossy(&answer.stdout);
        let mut numbers = version.split_whitespace().map(str::parse::<u32>);
        if let (Some(Ok(major)), Some(Ok(minor))) = (numbers.next(), numbers.next())
            && (major, minor) >= OLDEST
        {
            return Ok(candidate.clone());
        }
    }
    let (major, minor) = OLDEST;
    bail!(
        "no Python {major}.{minor} or newer among {candidates:?}, so the Python package is not tested. Install one \
         (Debian: apt install python3 python3-venv), or name it: PYTHON=/path/to/python3 cargo xtask ..."
    )
}

/// Returns the folder that cargo builds into.
pub(crate) fn target() -> Result<PathBuf> {
    let metadata = MetadataCommand::new()
        .manifest_path(run::root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .context("cargo metadata")?;
    Ok(metadata.target_directory.into_std_path_buf())
}

fn text(path: &Path) -> Result<&str> {
    path.to_str()
        .with_context(|| format!("path {path:?} is not UTF-8"))
}

fn call(program: impl AsRef<OsStr>, arguments: &[&str], search_path: &OsStr) -> Result<()> {
    let status = Command::new(&program)
        .args(arguments)
        .env("PATH", search_path)
        .current_dir(run::root())
        .status()
        .with_context(|| format!("{:?} does not start", program.as_ref()))?;
    if !status.success() {
        bail!(
            "{:?} {} failed ({status})",
            program.as_ref(),
            arguments.join(" ")
        );
    }
    Ok(())
}
