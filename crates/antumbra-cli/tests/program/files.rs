//! Files of people: nothing that is read is written, nothing but files is replaced, nothing half done is left.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Folder, antumbra, assert_code, stderr, text};

/// Makes an array of two points.
pub(crate) fn npy() -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((118_u16).to_le_bytes());
    bytes.extend(format!("{header:<117}\n").bytes());
    bytes.extend(
        [0.0, 0.1, 2.0, 2.5, 2.5, 2.0_f64]
            .iter()
            .flat_map(|x| x.to_le_bytes()),
    );
    bytes
}

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
        fs::write(&points, npy()).unwrap();
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
    fs::write(&normals, npy()).unwrap();
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
    for name in ["x.obj", "x.glb", "x"] {
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

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
    use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
    use std::process::Child;

    use crate::support::stdout;

    fn pipe(path: &str) {
        assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    }

    /// Runs the program, which has to end soon.
    fn soon(arguments: &[&str]) -> Output {
        let mut program = Command::new(env!("CARGO_BIN_EXE_antumbra"));
        program.args(arguments).stdin(Stdio::null());
        let mut child = program
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let begin = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if begin.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{arguments:?} waits");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        child.wait_with_output().unwrap()
    }

    #[test]
    fn a_pipe_or_a_device_in_place_of_an_input_is_refused_at_once() {
        let world = World::new();
        let [scene, points] = [text(&world.scene), text(&world.points)];
        let fifo = world.path("fifo.obj");
        pipe(&fifo);
        let out = world.path("a.npy");
        let glb = world.path("a.glb");
        let folder = world.path("");
        for path in [&*fifo, "/dev/zero", &folder] {
            let commands: [&[&str]; 6] = [
                &["query", scene, "--points", path, "-o", &out],
                &[
                    "query",
                    scene,
                    "--points",
                    points,
                    "--normals",
                    path,
                    "-o",
                    &out,
                ],
                &[
                    "query",
                    scene,
                    "--points",
                    points,
                    "--occlusion",
                    path,
                    "-o",
                    &out,
                ],
                &["export", scene, "--occlusion", path, "-o", &out],
                &["inspect", path],
                &["convert", path, &glb],
            ];
            for command in commands {
                assert_code(&soon(command), 2);
            }
        }
        // Nor by a scene that names one.
        let library = world.path("l.mtl");
        pipe(&library);
        let obj = world.path("a.obj");
        fs::write(&obj, "mtllib l.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let output = soon(&["inspect", &obj]);
        assert_code(&output, 0);
        assert!(stderr(&output).contains("l.mtl"), "{}", stderr(&output));
        assert!(!Path::new(&out).exists());
    }

    #[test]
    fn a_link_that_leads_out_of_the_folder_of_a_scene_is_not_followed() {
        let world = World::new();
        fs::create_dir(world.path("in")).unwrap();
        fs::write(world.path("in/a.gltf"), GLTF).unwrap();
        fs::write(world.path("secret"), [0; 36]).unwrap();
        symlink("../secret", world.path("in/a.bin")).unwrap();
        let output = antumbra(&["inspect", &world.path("in/a.gltf")]);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains("a link leads outside"),
            "{}",
            stderr(&output)
        );
        symlink("../secret", world.path("in/a.mtl")).unwrap();
        let obj = world.path("in/a.obj");
        fs::write(&obj, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let output = antumbra(&["inspect", &obj]);
        assert_code(&output, 0);
        assert!(
            stderr(&output).contains("a link leads outside"),
            "{}",
            stderr(&output)
        );
    }

    #[test]
    fn streams_are_written_into_and_links_are_left_alone() {
        let world = World::new();
        let expected = world.path("expected.npy");
        assert_code(&world.query(&["-o", &expected]), 0);
        let expected = fs::read(&expected).unwrap();
        // A pipe, by whatever name.
        let fifo = world.path("fifo");
        pipe(&fifo);
        let reader = {
            let fifo = fifo.clone();
            std::thread::spawn(move || fs::read(fifo).unwrap())
        };
        assert_code(&world.query(&["-o", &fifo]), 0);
        assert!(reader.join().unwrap() == expected);
        assert!(fs::symlink_metadata(&fifo).unwrap().file_type().is_fifo());
        // A device.
        assert_code(&world.query(&["-o", "/dev/null"]), 0);
        let null = fs::symlink_metadata("/dev/null").unwrap();
        assert!(null.file_type().is_char_device());
        // Links to a file, to nothing, to a folder.
        fs::write(world.path("theirs.npy"), "theirs").unwrap();
        for target in ["theirs.npy", "nothing.npy", "."] {
            let link = world.path("link.npy");
            symlink(target, &link).unwrap();
            let output = world.query(&["-o", &link]);
            assert_code(&output, 2);
            assert!(
                stderr(&output).contains("symbolic link"),
                "{}",
                stderr(&output)
            );
            assert_eq!(fs::read_link(&link).unwrap(), Path::new(target));
            fs::remove_file(&link).unwrap();
        }
        assert_eq!(fs::read(world.path("theirs.npy")).unwrap(), b"theirs");
        assert!(!Path::new(&world.path("nothing.npy")).exists());
        // A folder, a socket.
        let folder = world.path("folder.npy");
        fs::create_dir(&folder).unwrap();
        assert_code(&world.query(&["-o", &folder]), 2);
        let socket = world.path("socket.npy");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert_code(&world.query(&["-o", &socket]), 2);
        assert!(
            fs::symlink_metadata(&socket)
                .unwrap()
                .file_type()
                .is_socket()
        );
    }

    #[test]
    fn long_names_are_written() {
        let world = World::new();
        for length in [242, 250, 255] {
            let name = format!("{}.npy", "n".repeat(length - 4));
            assert_code(&world.query(&["-o", &world.path(&name)]), 0);
            let name = format!("{}.png", "n".repeat(length - 4));
            assert_code(&world.render(&["-o", &world.path(&name)]), 0);
            let name = format!("{}.antumbra", "n".repeat(length - 9));
            let more = ["--resolution", "64", "-o", &world.path(&name)];
            assert_code(
                &antumbra(&[&["bake", text(&world.scene)], &more[..]].concat()),
                0,
            );
            let name = format!("{}.nff", "n".repeat(length - 4));
            let more = ["--size", "1", "-o", &world.path(&name)];
            assert_code(&antumbra(&[&["scene", "tetra"], &more[..]].concat()), 0);
            let name = format!("{}.ply", "n".repeat(length - 4));
            let tetra = format!("{}.nff", "n".repeat(length - 4));
            assert_code(
                &antumbra(&["convert", &world.path(&tetra), &world.path(&name)]),
                0,
            );
        }
        assert!(!world.names().iter().any(|name| name.starts_with('.')));
    }

    #[test]
    fn the_limit_of_a_files_size_ends_with_3_and_leaves_nothing() {
        let world = World::new();
        let before = world.names();
        let scene = text(&world.scene);
        let out = |name: &str| world.path(name);
        let commands: [&[&str]; 4] = [
            &["scene", "tetra", "--size", "5", "-o", &out("a.nff")],
            &["render", scene, "--size", "200x200", "-o", &out("a.png")],
            &[
                "bake",
                scene,
                "--resolution",
                "256",
                "-o",
                &out("a.antumbra"),
            ],
            &[
                "export",
                scene,
                "--resolution",
                "64",
                "--cells",
                "64",
                "-o",
                &out("a.npy"),
            ],
        ];
        for command in commands {
            let mut shell = Command::new("sh");
            shell.args(["-c", "ulimit -f 4; exec \"$@\"", "sh"]);
            shell.arg(env!("CARGO_BIN_EXE_antumbra")).args(command);
            let output = shell.output().unwrap();
            assert_code(&output, 3);
            assert!(stderr(&output).contains("cannot"), "{}", stderr(&output));
            assert_eq!(world.names(), before, "{command:?}");
        }
    }

    /// Starts to write a file for so long that a signal comes in time, and sends it.
    fn interrupted(world: &World, signal: &str) -> (Child, bool) {
        let mut program = Command::new(env!("CARGO_BIN_EXE_antumbra"));
        let out = world.path("big.nff");
        program.args(["scene", "heightfield", "--size", "300", "-o", &out]);
        let mut child = program.stderr(Stdio::null()).spawn().unwrap();
        let is_writing = || {
            world
                .names()
                .iter()
                .any(|name| name.starts_with(".antumbra-"))
        };
        while child.try_wait().unwrap().is_none() {
            if is_writing() {
                let pid = child.id().to_string();
                let sent = Command::new("kill").args([signal, &pid]).status();
                return (child, sent.unwrap().success());
            }
        }
        (child, false)
    }

    #[test]
    fn a_signal_while_a_file_is_written_leaves_nothing_and_a_kill_does_no_harm() {
        let whole = {
            let world = World::new();
            let (mut child, _) = interrupted(&world, "-0");
            assert!(child.wait().unwrap().success());
            fs::metadata(world.path("big.nff")).unwrap().len()
        };
        for (signal, code) in [("-TERM", Some(143)), ("-INT", Some(130)), ("-KILL", None)] {
            let world = World::new();
            let before = world.names();
            let mut caught = 0;
            for _ in 0..30 {
                let (mut child, is_sent) = interrupted(&world, signal);
                let status = child.wait().unwrap();
                // It may have been done before the signal came; and after it, writing may be brought to its end.
                let is_done = signal != "-KILL" && status.success();
                let is_caught = is_sent && (is_done || status.code() == code && !status.success());
                if signal == "-KILL" {
                    assert!(!is_caught || status.signal() == Some(9));
                } else if is_caught {
                    // Nothing, or all of it where the signal came behind the renaming.
                    let is_whole = fs::metadata(world.path("big.nff"));
                    assert!(
                        is_whole.is_ok_and(|found| found.len() == whole) || world.names() == before
                    );
                    assert!(
                        !world.names().iter().any(|name| name.starts_with('.')),
                        "{signal}"
                    );
                }
                caught += usize::from(is_caught);
                let _ = fs::remove_file(world.path("big.nff"));
                if caught == 2 {
                    break;
                }
            }
            assert!(caught > 0, "{signal} never came while a file was written");
            // What a kill left stands in nobody's way.
            let out = world.path("big.nff");
            assert_code(&antumbra(&["scene", "tetra", "--size", "1", "-o", &out]), 0);
        }
    }

    /// Runs the program where a folder has certain permissions. Root may do everything in any folder: then somebody
    /// else has to try.
    fn in_a_folder(
        permissions: u32,
        arguments: impl Fn(&Path) -> Vec<String>,
    ) -> (Output, PathBuf, World) {
        let world = World::new();
        let program = world.folder.path("antumbra");
        fs::copy(env!("CARGO_BIN_EXE_antumbra"), &program).unwrap();
        let folder = world.folder.path("drop");
        fs::create_dir(&folder).unwrap();
        let is_root = fs::read_dir("/proc/self/task").is_ok()
            && String::from_utf8_lossy(&Command::new("id").arg("-u").output().unwrap().stdout)
                .trim()
                == "0";
        let mode = |path: &Path, mode| {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        };
        mode(&world.folder.path(""), 0o755);
        let others = if is_root { permissions >> 6 & 7 } else { 0 };
        mode(&folder, permissions | others);
        let mut command = Command::new(&program);
        command.args(arguments(&folder));
        if is_root {
            command.uid(65_534).gid(65_534);
        }
        let output = command.output().unwrap();
        mode(&folder, 0o755);
        (output, folder, world)
    }

    #[test]
    fn a_folder_that_may_not_be_listed_is_written_to() {
        let (output, folder, _world) = in_a_folder(0o300, |folder| {
            let out = text(&folder.join("a.nff")).to_owned();
            ["scene", "tetra", "--size", "1", "-o", &out]
                .map(str::to_owned)
                .to_vec()
        });
        assert_code(&output, 0);
        assert!(fs::metadata(folder.join("a.nff")).unwrap().len() > 0);
    }

    #[test]
    fn a_folder_that_may_not_be_written_to_is_refused_before_the_scene_is_read() {
        let (output, folder, _world) = in_a_folder(0o500, |folder| {
            let out = text(&folder.join("a.antumbra")).to_owned();
            ["bake", "no such scene.nff", "-o", &out]
                .map(str::to_owned)
                .to_vec()
        });
        assert_code(&output, 3);
        assert!(
            stderr(&output).contains("cannot write"),
            "{}",
            stderr(&output)
        );
        assert!(fs::read_dir(folder).unwrap().next().is_none());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn results_that_cannot_be_printed_end_with_3() {
        let world = World::new();
        let [scene, points] = [text(&world.scene), text(&world.points)];
        let out = |name: &str| world.path(name);
        let [npy, values, volume] = ["a.npy", "a.antumbra", "b.npy"].map(out);
        let commands: [&[&str]; 8] = [
            &["inspect", scene],
            &["verify", scene, "--queries", "10", "--resolution", "64"],
            &["query", scene, "--points", points, "-o", &npy],
            &["bake", scene, "--resolution", "64", "-o", &values],
            &[
                "export",
                scene,
                "--resolution",
                "64",
                "--cells",
                "4",
                "-o",
                &volume,
            ],
            &["--help"],
            &["--version"],
            &["query", "--help"],
        ];
        for command in commands {
            let full = fs::OpenOptions::new()
                .write(true)
                .open("/dev/full")
                .unwrap();
            let mut program = Command::new(env!("CARGO_BIN_EXE_antumbra"));
            let output = program.args(command).stdout(full).output().unwrap();
            assert_code(&output, 3);
            assert!(stderr(&output).contains("cannot print"), "{command:?}");
        }
        // Whoever reads may stop.
        let mut program = Command::new(env!("CARGO_BIN_EXE_antumbra"));
        let mut child = program
            .args(["inspect", scene])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        assert!(child.wait().unwrap().success());
        // The files are there all the same.
        assert!(Path::new(&npy).exists() && Path::new(&values).exists());
        assert!(stdout(&antumbra(&["--version"])).starts_with("antumbra"));
    }
}
