//! Pipes, devices, links, signals, limits and rights of files.

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
        && String::from_utf8_lossy(&Command::new("id").arg("-u").output().unwrap().stdout).trim()
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
