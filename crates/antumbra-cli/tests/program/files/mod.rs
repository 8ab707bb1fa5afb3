//! Files of people: nothing that is read is written, nothing but files is replaced, nothing half done is left.

#[cfg(unix)]
mod unix;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Folder, POINTS, antumbra, assert_code, npy, stderr, text};

/// A scene, points and normals.
struct World {
    folder: Folder,
    scene: PathBuf,
    points: PathBuf,
}

impl World {
    fn new() -> Self {
        let (folder, scene) = Folder::with_scene();
        let points = folder.path("points.npy");
        fs::write(&points, npy(&POINTS)).unwrap();
        Self {
            folder,
            scene,
            points,
        }
    }

    fn path(&self, name: &str) -> String {
        text(&self.folder.path(name)).to_owned()
    }

    fn query(&self, more: &[&str]) -> Output {
        let arguments = ["query", text(&self.scene), "--points", text(&self.points)];
        antumbra(&[&arguments, more].concat())
    }

    fn render(&self, more: &[&str]) -> Output {
        let arguments = ["render", text(&self.scene), "--size", "8x8"];
        antumbra(&[&arguments, more].concat())
    }

    /// All files and what is in them.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let entries = fs::read_dir(self.folder.path("")).unwrap();
        let mut files: Vec<_> = entries
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), fs::read(&path).unwrap()))
            .collect();
        files.sort();
        files
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path("")).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

#[test]
fn no_command_overwrites_what_it_reads() {
    let world = World::new();
    let path = |name: &str| world.path(name);
    let [scene, points] = [text(&world.scene), text(&world.points)];
    let normals = path("normals.npy");
    fs::write(&normals, npy(&POINTS)).unwrap();
    let values = path("values.antumbra");
    assert_code(
        &antumbra(&["bake", scene, "--resolution", "64", "-o", &values]),
        0,
    );
    // The same files by other names.
    fs::create_dir(path("in")).unwrap();
    let round = path("in/../points.npy");
    for (file, link) in [
        (scene, "scene.npy"),
        (scene, "scene.png"),
        (scene, "scene.json"),
        (scene, "scene.antumbra"),
        (scene, "scene.glb"),
        (points, "points.antumbra"),
        (&normals, "other.npy"),
        (&values, "values.npy"),
        (&values, "values.json"),
    ] {
        fs::hard_link(file, path(link)).unwrap();
    }
    let before = world.files();
    let all = [
        "scene.npy",
        "scene.png",
        "scene.json",
        "scene.antumbra",
        "scene.glb",
        "points.antumbra",
        "other.npy",
        "values.npy",
        "values.json",
        "a.npy",
        "a.png",
    ];
    let [
        snpy,
        spng,
        sjson,
        svalues,
        sglb,
        pvalues,
        onpy,
        vnpy,
        vjson,
        anpy,
        apng,
    ] = all.map(path);
    let query = ["query", scene, "--points", points, "--normals", &normals];
    let export = [
        "export",
        scene,
        "--resolution",
        "64",
        "--occlusion",
        &values,
        "--cells",
        "4",
    ];
    let render = ["render", scene, "--size", "8x8"];
    let cases: [(&[&str], &[&str]); 16] = [
        (&query, &["-o", points]),
        (&query, &["-o", &round]),
        (&query, &["-o", &normals]),
        (&query, &["-o", &onpy]),
        (&query, &["-o", &snpy]),
        (&query, &["-o", &anpy, "--save-occlusion", &svalues]),
        (&query, &["-o", &anpy, "--save-occlusion", &pvalues]),
        (&query, &["-o", scene]),
        (&export, &["-o", &vnpy]),
        (&export, &["-o", &anpy, "--json", &vjson]),
        (&export, &["-o", &anpy, "--json", &sjson]),
        (&export, &["-o", scene]),
        (&render, &["-o", &spng]),
        (&render, &["-o", &apng, "--stats-json", &sjson]),
        (&["bake", scene], &["-o", &svalues]),
        (&["convert", scene, &sglb], &[]),
    ];
    for (command, more) in cases {
        let output = antumbra(&[command, more].concat());
        assert_code(&output, 2);
        assert!(world.files() == before, "{command:?} {more:?}");
    }
    assert_code(&antumbra(&["convert", scene, scene]), 2);
    assert!(world.files() == before);
    // A file of values may grow.
    let more = [
        "--resolution",
        "64",
        "--occlusion",
        &values,
        "--save-occlusion",
        &values,
    ];
    assert_code(&world.query(&[&more[..], &["-o", &anpy]].concat()), 0);
}

#[test]
fn files_that_a_scene_names_are_not_overwritten() {
    let world = World::new();
    let obj = world.path("a.obj");
    let library = world.path("b.mtl");
    fs::write(&library, "newmtl m\nKd 1 0 0\n").unwrap();
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    fs::write(&obj, format!("mtllib b.mtl\n{faces}")).unwrap();
    // An OBJ is written with a library beside it.
    let output = antumbra(&["convert", &obj, &world.path("b.obj")]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("b.mtl"), "{}", stderr(&output));
    assert_eq!(fs::read(&library).unwrap(), b"newmtl m\nKd 1 0 0\n");
    assert!(!Path::new(&world.path("b.obj")).exists());
    assert_code(&antumbra(&["convert", &obj, &world.path("c.obj")]), 0);

    // A buffer of a glTF, under the name of a picture.
    let buffer = world.path("a.bin");
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    fs::write(&buffer, &bytes).unwrap();
    let gltf = world.path("a.gltf");
    fs::write(&gltf, GLTF).unwrap();
    let picture = world.path("a.png");
    fs::hard_link(&buffer, &picture).unwrap();
    let output = antumbra(&["render", &gltf, "--size", "8x8", "-o", &picture]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("would overwrite a file that is read"));
    assert_eq!(fs::read(&buffer).unwrap(), bytes);
    assert_code(
        &antumbra(&["render", &gltf, "--size", "8x8", "-o", &world.path("b.png")]),
        0,
    );
}

const GLTF: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "a.bin", "byteLength": 36}]}"#;

#[test]
fn two_outputs_are_never_one_file() {
    let world = World::new();
    let [figures, picture] = ["a.json", "a.png"].map(|name| world.path(name));
    fs::write(&figures, "").unwrap();
    fs::hard_link(&figures, &picture).unwrap();
    let output = world.render(&["-o", &picture, "--stats-json", &figures]);
    assert_code(&output, 2);
    assert!(
        stderr(&output).contains("are one file"),
        "{}",
        stderr(&output)
    );
    assert_eq!(fs::read(&figures).unwrap(), b"");
    // A layer beside the picture.
    let layer = world.path("c.decided-by.png");
    fs::hard_link(&figures, &layer).unwrap();
    let more = ["--aov", "decided", "--stats-json", &figures];
    let output = world.render(&[&["-o", &world.path("c.png")], &more[..]].concat());
    assert_code(&output, 2);
    assert!(stderr(&output).contains("--aov"), "{}", stderr(&output));
    assert!(!Path::new(&world.path("c.png")).exists());
}

#[test]
fn a_name_that_says_something_else_is_refused_with_what_is_possible() {
    let world = World::new();
    let scene = text(&world.scene);
    let before = world.names();
    for name in ["out.csv", "out.txt", "out", "out.npy.gz", "out.npz"] {
        let output = world.query(&["-o", &world.path(name)]);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains("ends in .npy"),
            "{}",
            stderr(&output)
        );
    }
    for name in ["x.png", "x.vdb", "x.vti", "x.json"] {
        assert_code(&antumbra(&["export", scene, "-o", &world.path(name)]), 2);
    }
    let json = ["-o", &world.path("x.npy"), "--json", &world.path("x.csv")];
    assert_code(&antumbra(&[&["export", scene], &json[..]].concat()), 2);
    for name in ["x.stl", "x.gltf", "x"] {
        let output = antumbra(&["scene", "tetra", "-o", &world.path(name)]);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains("ends in .nff"),
            "{}",
            stderr(&output)
        );
    }
    assert_code(&antumbra(&["bake", scene, "-o", &world.path("x.npy")]), 2);
    assert_code(
        &world.render(&[
            "-o",
            &world.path("x.png"),
            "--stats-json",
            &world.path("x.txt"),
        ]),
        2,
    );
    let output = antumbra(&["convert", scene, &world.path("x.stl")]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains(".nff or .obj or .ply or .glb"));
    assert_eq!(world.names(), before);
}

#[test]
fn no_file_is_called_minus() {
    let world = World::new();
    let scene = text(&world.scene);
    let before = world.names();
    let commands: [&[&str]; 6] = [
        &["query", scene, "--points", text(&world.points), "-o", "-"],
        &["export", scene, "-o", "-"],
        &["render", scene, "-o", "-"],
        &["bake", scene, "-o", "-"],
        &["scene", "tetra", "-o", "-"],
        &["convert", scene, "-"],
    ];
    for command in commands {
        let mut program = Command::new(env!("CARGO_BIN_EXE_antumbra"));
        let program = program.current_dir(world.folder.path("")).args(command);
        assert_code(&program.output().unwrap(), 2);
        assert_eq!(world.names(), before, "{command:?}");
    }
}

#[test]
fn what_is_no_file_of_values_is_not_replaced_by_one() {
    let world = World::new();
    let scene = text(&world.scene);
    let other = world.path("notes.antumbra");
    fs::write(&other, "mine").unwrap();
    let more = ["-o", &world.path("a.npy"), "--save-occlusion", &other];
    let output = world.query(&more);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("is not replaced"));
    // It was refused before anything was computed.
    assert!(!Path::new(&world.path("a.npy")).exists());
    assert_code(&antumbra(&["bake", scene, "-o", &other]), 2);
    assert_eq!(fs::read(&other).unwrap(), b"mine");
}

#[test]
fn a_face_in_map_coordinates_is_there_after_conversion() {
    let world = World::new();
    let obj = world.path("map.obj");
    let corners = "v 691000 5334000 520\nv 691000.1 5334000 520\nv 691000 5334000.1 520.03\n";
    fs::write(&obj, format!("{corners}f 1 2 3\n")).unwrap();
    let [glb, back] = ["map.glb", "back.obj"].map(|name| world.path(name));
    let output = antumbra(&["convert", &obj, &glb]);
    assert_code(&output, 0);
    assert_code(&antumbra(&["convert", &glb, &back]), 0);
    let numbers = |path: &str| -> Vec<f64> {
        let text = fs::read_to_string(path).unwrap();
        let vertices = text.lines().filter_map(|line| line.strip_prefix("v "));
        vertices
            .flat_map(str::split_whitespace)
            .map(|x| x.parse().unwrap())
            .collect()
    };
    let [before, after] = [&obj, &back].map(|path| numbers(path));
    assert_eq!(after.len(), 9);
    for (before, after) in before.iter().zip(&after) {
        assert!((before - after).abs() < 1e-8, "{before} {after}");
    }
    // Where nothing would be left, nothing is written.
    let corners = "v 0 0 0\nv 100000000 100000000 0\nv 200000000 200000001 0\n";
    fs::write(&obj, format!("{corners}f 1 2 3\n")).unwrap();
    let none = world.path("none.glb");
    let output = antumbra(&["convert", &obj, &none]);
    assert_code(&output, 2);
    assert!(
        stderr(&output).contains("would lose their area"),
        "{}",
        stderr(&output)
    );
    assert!(!Path::new(&none).exists());
}
