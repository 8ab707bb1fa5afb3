//! `antumbra-bench` as a program: its help, what it may write to, its end by Ctrl-C, and the rivals that it compares.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use antumbra_testkit::help::{Expected, assert_fits, assert_states_north};
use tempfile::TempDir;

fn bench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_antumbra-bench"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn assert_code(output: &Output, code: i32) {
    let streams = || format!("{}{}", stdout(output), stderr(output));
    assert_eq!(output.status.code(), Some(code), "{}", streams());
}

fn help(arguments: &[&str]) -> String {
    let output = bench(arguments);
    assert_code(&output, 0);
    stdout(&output)
}

fn generated(folder: &TempDir, name: &str, size: u32) -> PathBuf {
    let path = folder.path().join(format!("{name}.nff"));
    let scene = antumbra_scene::generate::by_name(name, Some(size), None).unwrap();
    antumbra_scene::write::write_file(&scene, &path).unwrap();
    path
}

#[test]
fn no_line_of_help_has_more_than_100_columns_and_every_command_has_headings() {
    let commands: [Expected<'_>; 9] = [
        (&[], &["Commands:", "Exit codes"]),
        (
            &["shadows"],
            &["Scenes and lights:", "Queries:", "Rounds:", "Output:"],
        ),
        (
            &["frames"],
            &["Scenes and lights:", "Frames:", "Rounds:", "Output:"],
        ),
        (
            &["soft"],
            &["Scenes and lights:", "Queries:", "Rounds:", "Output:"],
        ),
        (
            &["fog"],
            &["Scenes and lights:", "Queries:", "Rounds:", "Output:"],
        ),
        (&["paper"], &["Scenes:", "Rounds:", "Output:"]),
        (&["watertight"], &["Scenes and lights:", "Output:"]),
        (&["kept"], &["Output:"]),
        (&["verify"], &["Comparison:", "light-buffer", "shadow-map"]),
    ];
    assert_fits(help, &commands);
}

#[test]
fn north_is_stated_wherever_a_sun_can_be_typed() {
    let commands = ["shadows", "frames", "soft", "fog", "watertight", "kept"];
    assert_states_north(help, &commands);
}

#[test]
fn figures_are_not_written_over_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = generated(&folder, "tetra", 1);
    let link = folder.path().join("scene.json");
    fs::hard_link(&scene, &link).unwrap();
    let before = fs::read(&scene).unwrap();
    let output = bench(&[
        "shadows",
        text(&scene),
        "--rounds",
        "1",
        "--json",
        text(&link),
    ]);
    assert_code(&output, 2);
    assert!(fs::read(&scene).unwrap() == before);
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_printed_end_with_3() {
    let folder = tempfile::tempdir().unwrap();
    let scene = generated(&folder, "tetra", 1);
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_antumbra-bench"))
        .args(["shadows", text(&scene), "--size", "16x16", "--rounds", "1"])
        .stdout(full)
        .output()
        .unwrap();
    assert_code(&output, 3);
    assert!(stderr(&output).contains("cannot print"));
}

/// Names that follow from what was typed: the user has not said that those files may be replaced.
#[test]
fn a_page_that_it_did_not_write_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report");
    fs::create_dir(&report).unwrap();
    let paper = [
        "paper", "--scene", "tetra", "--size", "8x8", "--rounds", "1",
    ];
    let paper = [&paper[..], &["--no-sweeps", "--html", text(&report)]].concat();
    // A page that only speaks of antumbra is somebody's, too.
    let foreign = b"<html><title>My notes on antumbra</title>";
    for name in ["index.html", "README.md"] {
        let at = report.join(name);
        let count = || fs::read_dir(&report).unwrap().count();
        fs::write(&at, foreign).unwrap();
        let before = count();
        let refused = bench(&paper);
        assert_code(&refused, 2);
        let said = stderr(&refused).replace('\n', " ");
        assert!(said.contains("did not write"), "{name}: {said}");
        assert_eq!(fs::read(&at).unwrap(), foreign, "{name}");
        assert_eq!(count(), before, "{name}: refused before it worked");
        // What is empty is nobody's, and what antumbra-bench wrote it replaces.
        fs::write(&at, "").unwrap();
        for _ in 0..2 {
            assert_code(&bench(&paper), 0);
            assert!(fs::metadata(&at).unwrap().len() > foreign.len() as u64 / 2);
        }
    }
}

#[cfg(unix)]
#[test]
fn paper_tells_and_writes_what_it_has_measured_when_ctrl_c_comes() {
    use std::io::{BufRead as _, BufReader};
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let folder = tempfile::tempdir().unwrap();
    let (json, html) = (
        folder.path().join("figures.json"),
        folder.path().join("report"),
    );
    let mut child = Command::new(env!("CARGO_BIN_EXE_antumbra-bench"))
        .args(["paper", "--scene", "graph", "--scene", "tetra"])
        .args(["--size", "32x24", "--rounds", "1"])
        .args(["--sweep-rounds", "1000", "--verbose"])
        .args(["--json", text(&json), "--html", text(&html)])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let said = child.stderr.as_mut().unwrap();
    let mut lines = BufReader::new(said).lines().map(Result::unwrap);
    assert!(lines.any(|line| line.contains("graph: measured")));
    let pid = child.id().to_string();
    let begin = Instant::now();
    let kill = Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    // A second is promised. As much again is for machines that do much else.
    assert!(begin.elapsed() < Duration::from_secs(2));
    assert_code(&output, 130);
    let figures: serde_json::Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    assert_eq!(figures["is_complete"], false);
    assert!(
        !figures["scenes"].as_array().unwrap().is_empty(),
        "{figures}"
    );
    let said = stderr(&output);
    assert!(
        said.contains("stopped after") && said.contains("the report is not written"),
        "{said}"
    );
    assert!(!html.join("index.html").exists());
}

/// Our own scenes, also where answers are most likely to be wrong.
#[test]
fn verify_finds_no_difference_of_exact_rivals() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size) in [("tetra", 3), ("sphereflake", 2), ("city", 40)] {
        let scene = generated(&folder, name, size);
        for attack in [&[][..], &["--attack", "--lights", "3"]] {
            let mut arguments = vec!["verify", text(&scene), "--queries", "4000"];
            arguments.extend(["--shadows", "grid"]);
            for rival in ["light-buffer", "hybrid", "shadow-volumes"] {
                arguments.extend(["--rival", rival]);
            }
            arguments.extend(attack);
            let output = bench(&arguments);
            assert_code(&output, 0);
            let told = stdout(&output);
            assert!(told.contains("4000 queries, 0 differences"), "{told}");
        }
    }
}

#[test]
fn verify_tells_how_often_the_shadow_map_is_wrong_and_does_not_fail() {
    let folder = tempfile::tempdir().unwrap();
    let scene = generated(&folder, "sphereflake", 2);
    let arguments = ["verify", text(&scene), "--queries", "3000"];
    let rival = ["--shadows", "grid", "--rival", "shadow-map"];
    let output = bench(&[&arguments[..], &rival].concat());
    assert_code(&output, 0);
    let told = stdout(&output);
    let wrong = told
        .split("shadow-map is not exact: ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .and_then(|number| number.parse::<u64>().ok());
    assert!(
        wrong.is_some_and(|wrong| 0 < wrong && wrong < 3000),
        "{told}"
    );
    assert!(told.contains("3000 queries, 0 differences"), "{told}");
}
