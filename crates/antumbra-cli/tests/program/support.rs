//! Folders, scenes and runs of the program.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// A floor, a ball, a post, a glass pane and a mirror under two lights.
const SMALL_SCENE: &str = "\
v
from 4 -6 5
at 0 0 0.5
up 0 0 1
angle 40
hither 0.1
resolution 64 48
b 0.1 0.2 0.3
l 5 -3 8
l -4 -5 6 0.5 0.4 0.3
f 0.8 0.7 0.6 0.9 0 1 0 0
p 4
-3 -3 0
3 -3 0
3 3 0
-3 3 0
f 0.9 0.2 0.1 0.7 0.3 20 0 0
s 0 0 0.8 0.5
f 0.1 0.8 0.2 0.9 0 1 0 0
c
1 0.5 0 0.3
1 0.5 1.5 0.1
f 1 1 1 0.1 0.1 50 0.8 1.5
p 3
-1.5 -1 0.2
-0.5 -1.5 0.2
-1 -1.2 1.5
";

pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn with_scene() -> (Self, PathBuf) {
        let folder = Self::new();
        let scene = folder.path("small.nff");
        fs::write(&scene, SMALL_SCENE).unwrap();
        (folder, scene)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

pub(crate) fn antumbra(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_antumbra"))
        .args(arguments)
        .output()
        .unwrap()
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub(crate) fn assert_code(output: &Output, code: i32) {
    let streams = || format!("{}{}", stdout(output), stderr(output));
    assert_eq!(output.status.code(), Some(code), "{}", streams());
}

/// Renders with more arguments and returns the file's bytes.
pub(crate) fn rendered(folder: &Folder, scene: &Path, more: &[&str]) -> Vec<u8> {
    let picture = folder.path("picture.png");
    let mut arguments = vec!["render", text(scene), "-o", text(&picture)];
    arguments.extend(more);
    let output = antumbra(&arguments);
    assert_code(&output, 0);
    assert_eq!(
        stdout(&output),
        "",
        "a picture leaves standard output alone"
    );
    fs::read(&picture).unwrap()
}

/// Renders with more arguments and returns the figures.
pub(crate) fn figures(folder: &Folder, scene: &Path, more: &[&str]) -> Value {
    let json = folder.path("figures.json");
    rendered(
        folder,
        scene,
        &[more, &["--stats-json", text(&json)]].concat(),
    );
    serde_json::from_slice(&fs::read(&json).unwrap()).unwrap()
}

pub(crate) fn count(figures: &Value, path: &str) -> u64 {
    figures
        .pointer(path)
        .and_then(Value::as_u64)
        .unwrap_or_else(|| panic!("{path} in {figures}"))
}

/// Two points of space near the small scene.
pub(crate) const POINTS: [[f64; 3]; 2] = [[0.0, 0.1, 2.0], [2.5, 2.5, 2.0]];

/// Makes an array of two points.
pub(crate) fn npy(points: &[[f64; 3]; 2]) -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((118_u16).to_le_bytes());
    bytes.extend(format!("{header:<117}\n").bytes());
    bytes.extend(points.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes
}
