//! Figures that must not move, through the real program: the SPD's own counts, and answers that do
//! not depend on the method, on other people's scenes.
//!
//! Scenes that are not in the repository are looked for in `ANTUMBRA_SCENES`; without them those
//! tests say loudly that they do not run. Scenes that the program makes are always there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use antumbra_testkit::absent::shared_scenes;
use serde_json::Value;
use tempfile::TempDir;

fn antumbra(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_antumbra"))
        .args(arguments)
        .output()
        .unwrap()
}

fn assert_done(output: &Output, what: &str) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success(),
        "{what}: {}: {}{}",
        output.status,
        text(&output.stdout),
        text(&output.stderr)
    );
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Returns all files below a folder that end in `.{extension}`, sorted.
fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Writes a built-in scene.
fn generated(folder: &TempDir, name: &str, size: &str) -> PathBuf {
    let path = folder.path().join(format!("{name}_{size}.nff"));
    assert_done(
        &antumbra(&["scene", name, "--size", size, "-o", text(&path)]),
        name,
    );
    path
}

/// Renders eye rays through the corners of 512 x 512 pixels and compares hits and queries (to 3:
/// rays through outlines) and blocked queries (to 5: shadow outlines too).
fn assert_counts(scene: &Path, [hits, queries, blocked]: [u64; 3]) {
    let folder = tempfile::tempdir().unwrap();
    let (picture, json) = (
        folder.path().join("picture.png"),
        folder.path().join("figures.json"),
    );
    let output = antumbra(&[
        "render",
        text(scene),
        "-o",
        text(&picture),
        "--size",
        "512x512",
        "--corner-rays",
        "--max-depth",
        "0",
        "--stats-json",
        text(&json),
    ]);
    assert_done(&output, text(scene));
    let figures: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    let of = |path: &str| figures.pointer(path).and_then(Value::as_u64).unwrap();
    assert_eq!(of("/rays/primary"), 513 * 513);
    // Points that face away from a light need no query.
    let asked = of("/shadow/queries") - of("/shadow/facing_away") - of("/shadow/out_of_cone");
    for (what, found, expected, room) in [
        ("hits", of("/rays/primary_hits"), hits, 3),
        ("queries", asked, queries, 3),
        ("blocked", of("/shadow/shadowed"), blocked, 5),
    ] {
        assert!(
            found.abs_diff(expected) <= room,
            "{}: {what}: {found}, not {expected}",
            scene.display()
        );
    }
}

#[test]
fn published_spd_files_give_the_known_counts() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for (name, counts) in [
        ("tetra_3", [62_788, 59_726, 1_715]),
        ("tetra_6", [49_950, 46_261, 5_557]),
        ("balls_2", [263_169, 723_394, 140_766]),
        ("balls_3", [263_169, 715_891, 161_797]),
        ("gears_2", [243_148, 1_165_309, 213_441]),
        ("tree_3", [158_540, 1_063_704, 26_757]),
        ("sample_1", [229_225, 222_690, 19_595]),
    ] {
        assert_counts(&folder.join(format!("nff/spd/{name}.nff")), counts);
    }
}

#[test]
fn built_in_spd_scenes_give_the_known_counts() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size, counts) in [
        ("tetra", "3", [62_788, 59_726, 1_715]),
        ("tetra", "6", [49_950, 46_261, 5_557]),
        ("sphereflake", "2", [263_169, 723_394, 140_766]),
        ("sphereflake", "3", [263_169, 715_891, 161_797]),
    ] {
        assert_counts(&generated(&folder, name, size), counts);
    }
}

fn inspected_objects(scene: &Path) -> String {
    let output = antumbra(&["inspect", text(scene)]);
    assert_done(&output, text(scene));
    let lines = String::from_utf8(output.stdout).unwrap();
    let line = lines.lines().find(|line| line.starts_with("objects"));
    line.unwrap_or_else(|| panic!("{lines}"))["objects".len()..]
        .trim()
        .to_owned()
}

#[test]
fn inspect_counts_the_objects_of_the_paper() {
    // Paper, Table 1: Tetra has 4096 objects, Balls 92.
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(inspected_objects(&generated(&folder, "tetra", "6")), "4096");
    assert_eq!(
        inspected_objects(&generated(&folder, "sphereflake", "2")),
        "92"
    );
    let Some(shared) = shared_scenes() else {
        return;
    };
    for (name, count) in [("tetra_6", "4096"), ("balls_2", "92")] {
        let scene = shared.join(format!("nff/spd/{name}.nff"));
        assert_eq!(inspected_objects(&scene), count);
    }
}

fn assert_same_pictures(scene: &Path, more: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let picture = |method: &str| {
        let path = folder.path().join(format!("{method}.png"));
        let arguments = ["render", text(scene), "-o", text(&path), "--size", "48x36"];
        let output = antumbra(&[&arguments[..], &["--shadows", method], more].concat());
        assert_done(&output, text(scene));
        fs::read(&path).unwrap()
    };
    let naive = picture("naive");
    // Not a picture of nothing.
    assert!(
        naive.len() > 300,
        "{}: {} bytes",
        scene.display(),
        naive.len()
    );
    for method in ["voxel-1990", "grid", "bvh"] {
        assert!(
            picture(method) == naive,
            "{}: {method} differs from naive",
            scene.display()
        );
    }
}

#[test]
fn pictures_do_not_depend_on_the_method() {
    let folder = tempfile::tempdir().unwrap();
    assert_same_pictures(&generated(&folder, "tetra", "4"), &[]);
    assert_same_pictures(&generated(&folder, "sphereflake", "2"), &["--spp", "2"]);
    let Some(shared) = shared_scenes() else {
        return;
    };
    for (scene, more) in [
        ("nff/spd/balls_2.nff", &["--corner-rays"][..]),
        ("nff/spd/tetra_3.nff", &[]),
        ("nff/spd/tree_3.nff", &[]),
        ("nff/spd/gears_2.nff", &["--max-depth", "1"]),
        ("nff/spd/sample_1.nff", &["--max-depth", "1"]),
        ("nff/dialect-assimp/cone.nff", &[]),
        (
            "mesh/cornell-box/CornellBox-Original.obj",
            &["--light", "point:0,1.9,0"],
        ),
        (
            "mesh/odedstein/spot_low_resolution.obj",
            &["--sun", "40,35"],
        ),
    ] {
        assert_same_pictures(&shared.join(scene), more);
    }
}

fn assert_verified(scene: &Path, queries: &str) {
    let output = antumbra(&["verify", text(scene), "--queries", queries, "--quiet"]);
    let result = String::from_utf8_lossy(&output.stdout).into_owned();
    // Before it, of scenes with glass, what was asked about that.
    assert!(
        result.ends_with(&format!("{queries} queries, 0 differences\n")),
        "{}: {result} {}",
        scene.display(),
        String::from_utf8_lossy(&output.stderr)
    );
    assert_done(&output, text(scene));
}

#[test]
fn verify_finds_no_difference_on_built_in_scenes() {
    let folder = tempfile::tempdir().unwrap();
    assert_verified(&generated(&folder, "tetra", "4"), "4000");
    assert_verified(&generated(&folder, "sphereflake", "3"), "4000");
}

#[test]
fn verify_finds_no_difference_on_shared_scenes() {
    let Some(shared) = shared_scenes() else {
        return;
    };
    let mut seen = 0;
    for extension in ["nff", "obj"] {
        for scene in files_below(&shared, extension) {
            // Not meant to be read, or so large that the reference takes minutes.
            let is_bad = scene.starts_with(shared.join("malformed"))
                || scene.ends_with("issue-140-zero-face-idx.obj");
            let bytes = fs::metadata(&scene).unwrap().len();
            if is_bad || bytes > 300_000 {
                continue;
            }
            seen += 1;
            let queries = if bytes > 100_000 { "1500" } else { "3000" };
            assert_verified(&scene, queries);
        }
    }
    assert!(seen >= 25, "only {seen} scenes");
}
