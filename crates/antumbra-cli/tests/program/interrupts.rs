//! Ctrl-C and the other signals that ask for an end: every command ends within a second, and leaves what it should.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::support::{Folder, antumbra, assert_code, stderr, text};

/// A second is promised. As much again is for machines that do much else.
const PROMISED: Duration = Duration::from_secs(2);

/// By then a command has read its scene and works.
const WORKING: Duration = Duration::from_millis(2500);

fn scene(folder: &Folder, name: &str, size: &str) -> std::path::PathBuf {
    let path = folder.path("scene.nff");
    assert_code(
        &antumbra(&["scene", name, "--size", size, "-o", text(&path)]),
        0,
    );
    path
}

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_antumbra"))
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Presses Ctrl-C, and returns what came of it.
fn interrupted(arguments: &[&str], wait: Duration) -> Output {
    stopped(start(arguments), arguments, wait, ("-INT", 130))
}

/// Sends a signal, and returns what came of it.
fn stopped(
    mut child: Child,
    arguments: &[&str],
    wait: Duration,
    (signal, code): (&str, i32),
) -> Output {
    std::thread::sleep(wait);
    assert!(
        child.try_wait().unwrap().is_none(),
        "{arguments:?} was done too early"
    );
    let pid = child.id().to_string();
    let begin = Instant::now();
    assert!(
        Command::new("kill")
            .args([signal, &pid])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    let took = begin.elapsed();
    assert!(took < PROMISED, "{arguments:?} ended after {took:?}");
    assert_code(&output, code);
    output
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn bake_ends_soon_after_ctrl_c_and_leaves_no_file() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "8");
    let out = folder.path("out.antumbra");
    interrupted(&["bake", text(&scene), "-o", text(&out)], WORKING);
    assert_eq!(names(out.parent().unwrap()), ["scene.nff"]);
}

#[test]
fn verify_and_eager_preparation_end_soon_after_ctrl_c() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "8");
    let picture = folder.path("picture.png");
    let many = [
        "verify",
        text(&scene),
        "--queries",
        "1000000000",
        "--shadows",
        "bvh",
    ];
    interrupted(&many, WORKING);
    let eager = [
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--shadows",
        "voxel",
        "--refine",
        "eager",
    ];
    interrupted(&eager, WORKING);
    assert!(!picture.exists());
}

#[test]
fn query_ends_soon_after_ctrl_c_however_slow_a_query_is() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "8");
    let (points, out) = (folder.path("points.npy"), folder.path("out.npy"));
    let mut header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 3), }".to_owned();
    header += &" ".repeat(128 - 10 - 1 - header.len());
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(header.bytes());
    bytes.resize(128 + 12_000_000, 0);
    fs::write(&points, bytes).unwrap();
    let query = [
        "query",
        text(&scene),
        "--points",
        text(&points),
        "-o",
        text(&out),
        "--shadows",
        "naive",
    ];
    interrupted(&query, WORKING);
    assert!(!out.exists());
}

/// Starts a command with the terminal's end ignored or not, whatever this process was started with.
#[cfg(target_os = "linux")]
fn start_with_hangups(way: &[&str], arguments: &[&str]) -> Child {
    Command::new(way[0])
        .args(&way[1..])
        .arg(env!("CARGO_BIN_EXE_antumbra"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_terminal_and_a_request_to_terminate_leave_the_partial_picture_as_ctrl_c_does() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "6");
    for (signal, code) in [("-HUP", 129), ("-TERM", 143)] {
        let picture = folder.path(&format!("picture{signal}.png"));
        let render = slow_render(&scene, &picture);
        let child = start_with_hangups(&["env", "--default-signal=HUP"], &render);
        let output = stopped(child, &render, WORKING, (signal, code));
        assert!(picture.exists(), "{signal}");
        let said = stderr(&output);
        assert!(said.contains("stopped; what was finished"), "{said}");
    }
    // Without a partial result nothing is left.
    let out = folder.path("out.antumbra");
    let large = folder.path("large.nff");
    let made = antumbra(&["scene", "tetra", "--size", "8", "-o", text(&large)]);
    assert_code(&made, 0);
    let bake = ["bake", text(&large), "-o", text(&out)];
    let child = start_with_hangups(&["env", "--default-signal=HUP"], &bake);
    stopped(child, &bake, WORKING, ("-HUP", 129));
    assert!(
        !names(out.parent().unwrap())
            .iter()
            .any(|name| { name.ends_with(".antumbra") || name.starts_with('.') })
    );
}

#[cfg(target_os = "linux")]
#[test]
fn nohup_outlives_its_terminal() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "6");
    let picture = folder.path("picture.png");
    let render = slow_render(&scene, &picture);
    let mut child = start_with_hangups(&["env", "--ignore-signal=HUP"], &render);
    std::thread::sleep(Duration::from_millis(1500));
    let pid = child.id().to_string();
    let send = |signal: &str| Command::new("kill").args([signal, &pid]).status().unwrap();
    assert!(send("-HUP").success());
    std::thread::sleep(Duration::from_millis(1500));
    let is_running = child.try_wait().unwrap().is_none();
    assert!(is_running, "it ended with its terminal");
    assert!(send("-TERM").success());
    assert_code(&child.wait_with_output().unwrap(), 143);
}

/// A picture that takes minutes.
fn slow_render<'a>(scene: &'a Path, picture: &'a Path) -> Vec<&'a str> {
    #[rustfmt::skip]
    let render = [
        "render", text(scene), "-o", text(picture), "--spp", "65536", "--shadows", "naive", "--size", "64x64",
    ];
    render.to_vec()
}

#[test]
fn render_leaves_the_partial_picture_even_within_a_pixel() {
    let folder = Folder::new();
    let scene = scene(&folder, "tetra", "6");
    let picture = folder.path("picture.png");
    let render = slow_render(&scene, &picture);
    let output = interrupted(&render, WORKING);
    assert!(picture.exists());
    assert!(
        stderr(&output).contains("stopped; what was finished"),
        "{}",
        stderr(&output)
    );
}
