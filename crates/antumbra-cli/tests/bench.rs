//! Drives `antumbra bench`.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the program; without a rival if `embree` says where none is.
fn antumbra(folder: &Path, arguments: &[&str], embree: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_antumbra"));
    command.current_dir(folder).args(arguments);
    if let Some(path) = embree {
        command.env("ANTUMBRA_EMBREE", path);
    }
    command.output().unwrap()
}

fn assert_success(output: &Output) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{error}");
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn without_embree_bench_says_so_and_measures_us() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ["scene", "city", "--size", "30", "-o", "city.nff"];
    assert_success(&antumbra(folder.path(), &scene, None));
    let arguments = [
        "bench",
        "shadows",
        "city.nff",
        "--size",
        "40x30",
        "--rounds",
        "2",
        "--oracle",
        "--json",
        "figures.json",
    ];
    let output = antumbra(folder.path(), &arguments, Some("/nowhere/libembree4.so"));
    assert_success(&output);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("/nowhere/libembree4.so"), "{said}");
    assert!(said.contains("rows are left out"), "{said}");

    let figures = json(&folder.path().join("figures.json"));
    let scene = &figures["scenes"][0];
    assert_eq!(scene["name"], "city");
    assert_eq!(scene["mismatches"], 0);
    for set in ["coherent", "shuffled", "free"] {
        let set = &scene[set];
        assert!(set["queries"].as_u64().unwrap() > 100);
        assert!(set["voxel_1990_ns"].as_f64().unwrap() > 0.0);
        assert!(set["grid_ns"].as_f64().unwrap() > 0.0);
        assert!(set["bvh_ns"].as_f64().unwrap() > 0.0);
        // A row that has no figure is there and null.
        assert_eq!(set.get("voxel_cold_ns"), Some(&Value::Null));
        assert_eq!(set.get("embree_ns"), Some(&Value::Null));
        assert_eq!(set["shares"]["grid"]["ray"], 1.0);
        assert!(set["bytes"]["voxel_1990"].as_u64().unwrap() > 0);
    }
    for (voxels, is_sampled) in [("64", true), ("256", true), ("512", false)] {
        let values = &scene["oracle"][voxels];
        assert!(values["first_pass"].as_f64().unwrap() > 0.0);
        assert!(values["value_bytes"].as_u64().unwrap() > 0);
        assert_eq!(values["ceiling"].is_null(), !is_sampled);
    }
}

/// With Embree if it is there.
#[test]
fn embree_is_judged_and_never_believed() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ["scene", "sphereflake", "--size", "2", "-o", "flake.nff"];
    assert_success(&antumbra(folder.path(), &scene, None));
    let arguments = [
        "bench",
        "shadows",
        "flake.nff",
        "--size",
        "64x64",
        "--rounds",
        "1",
        "--threads",
        "2",
        "--light-number",
        "1",
        "--json",
        "figures.json",
    ];
    assert_success(&antumbra(folder.path(), &arguments, None));
    let scene = &json(&folder.path().join("figures.json"))["scenes"][0];
    assert_eq!(scene["ours_wrong"], 0);
    assert_eq!(scene["mismatches"], 0);
}

#[test]
fn lights_and_scenes_that_are_not_there_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ["scene", "tetra", "--size", "1", "-o", "tetra.nff"];
    assert_success(&antumbra(folder.path(), &scene, None));
    for arguments in [
        &["bench", "shadows", "tetra.nff", "--light-number", "1"][..],
        &["bench", "shadows", "none.nff"],
        &["bench", "shadows"],
        &["bench"],
    ] {
        let output = antumbra(folder.path(), arguments, None);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn nothing_of_ours_leaks() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["bench", "watertight", "--json", "leaks.json"];
    assert_success(&antumbra(folder.path(), &arguments, None));
    let figures = json(&folder.path().join("leaks.json"));
    let leaks = figures["leaks"].as_array().unwrap();
    let ours: Vec<_> = leaks.iter().filter(|row| row["is_ours"] == true).collect();
    assert!(ours.len() >= 36);
    for row in ours {
        assert_eq!(row["leaks"], 0, "{row}");
        assert!(row["rays"].as_u64().unwrap() > 8000, "{row}");
    }
}
