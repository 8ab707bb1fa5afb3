//! Drives `antumbra-bench`.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the program; without a rival if `embree` says where none is.
fn bench(folder: &Path, arguments: &[&str], embree: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_antumbra-bench"));
    command.current_dir(folder).args(arguments);
    if let Some(path) = embree {
        command.env("ANTUMBRA_EMBREE", path);
    }
    command.output().unwrap()
}

fn generate(folder: &Path, name: &str, size: u32, file: &str) {
    let scene = antumbra_scene::generate::by_name(name, Some(size), None).unwrap();
    antumbra_scene::write::write_file(&scene, &folder.join(file)).unwrap();
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
    generate(folder.path(), "city", 30, "city.nff");
    let arguments = [
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
    let output = bench(folder.path(), &arguments, Some("/nowhere/libembree4.so"));
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
        assert_eq!(set.get("embree_ns"), Some(&Value::Null));
        assert_eq!(set["shares"]["grid"]["ray"], 1.0);
        assert!(set["bytes"]["voxel_1990"].as_u64().unwrap() > 0);
    }
    // Only the first queries are asked of no values.
    assert!(scene["coherent"]["auto_cold_ns"].as_f64().unwrap() > 0.0);
    for set in ["shuffled", "free"] {
        assert_eq!(scene[set].get("auto_cold_ns"), Some(&Value::Null));
    }
    assert_eq!(scene["break_even"]["most_frames"], 16);
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("cold auto has"), "{table}");
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
    generate(folder.path(), "sphereflake", 2, "flake.nff");
    let arguments = [
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
    assert_success(&bench(folder.path(), &arguments, None));
    let scene = &json(&folder.path().join("figures.json"))["scenes"][0];
    assert_eq!(scene["ours_wrong"], 0);
    assert_eq!(scene["mismatches"], 0);
}

/// With Embree if it is there.
#[test]
fn frames_are_asked_of_values_that_are_made_on_the_way() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "city", 30, "city.nff");
    for threads in ["1", "2"] {
        let arguments = [
            "frames",
            "city.nff",
            "--size",
            "48x40",
            "--frames",
            "5",
            "--samples",
            "3",
            "--rounds",
            "2",
            "--threads",
            threads,
            "--json",
            "figures.json",
        ];
        let output = bench(folder.path(), &arguments, None);
        assert_success(&output);
        let table = String::from_utf8_lossy(&output.stdout);
        for part in [
            "first frame:",
            "fourth frame",
            "orbit, 5 frames",
            "still, 3 samples",
            "geometric means, first_frame",
        ] {
            assert!(table.contains(part), "{part} in {table}");
        }

        let figures = json(&folder.path().join("figures.json"));
        assert!(figures["geometric_means"]["orbit"]["auto_by_bvh"].is_f64());
        let scene = &figures["scenes"][0];
        assert_eq!(scene["name"], "city");
        assert_eq!(scene["mismatches"], 0);
        assert_eq!(scene["ours_wrong"], 0);
        for part in ["first_frame", "warm_after_three_views", "orbit", "samples"] {
            let part = &scene[part];
            assert!(part["queries"].as_u64().unwrap() > 100);
            assert!(part["auto_ns"].as_f64().unwrap() > 0.0);
            assert!(part["bvh_ns"].as_f64().unwrap() > 0.0);
            assert!(part["auto_by_bvh"].as_f64().unwrap() > 0.0);
            assert!(
                ["embree_ns", "embree8_ns", "embree16_ns"]
                    .iter()
                    .all(|key| part.get(*key).is_some())
            );
        }
        for (series, count) in [("orbit", 5), ("samples", 3)] {
            let series = &scene[series];
            assert_eq!(series["frames"], count);
            let times = series["frames_ns"]["auto"].as_array().unwrap();
            assert_eq!(times.len(), count);
            let last = &series["last_frame"];
            let shares = ["first_pass", "blocker_list", "ray"].map(|by| last[by].as_f64().unwrap());
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{last}");
            for bytes in ["value_bytes", "table_bytes", "evictions"] {
                assert!(series[bytes].is_u64(), "{bytes}");
            }
        }
        // The orbit begins at the camera itself, and the first frame is played alone before.
        let first = &scene["first_frame"];
        assert!(first["queries"].as_u64().unwrap() < scene["orbit"]["queries"].as_u64().unwrap());
    }
}

#[test]
fn short_series_and_eager_values_are_told() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "tetra", 2, "tetra.nff");
    let common = ["--size", "32x32", "--rounds", "1", "--refine", "eager"];
    let json_file = ["--json", "figures.json"];
    let series = ["frames", "tetra.nff", "--frames", "3", "--samples", "1"];
    let arguments = [&series[..], &common, &json_file].concat();
    let nowhere = Some("/nowhere/libembree4.so");
    assert_success(&bench(folder.path(), &arguments, nowhere));
    let scene = &json(&folder.path().join("figures.json"))["scenes"][0];
    assert_eq!(scene.get("warm_after_three_views"), Some(&Value::Null));
    assert_eq!(scene["orbit"].get("embree_ns"), Some(&Value::Null));
    let notes = scene["notes"].to_string();
    assert!(notes.contains("before the first query"), "{notes}");

    let sets = ["shadows", "tetra.nff"];
    let arguments = [&sets[..], &common, &json_file].concat();
    assert_success(&bench(folder.path(), &arguments, nowhere));
    let scene = &json(&folder.path().join("figures.json"))["scenes"][0];
    assert_eq!(scene["coherent"].get("auto_cold_ns"), Some(&Value::Null));
    assert_eq!(scene.get("break_even"), Some(&Value::Null));
}

#[test]
fn lights_and_scenes_that_are_not_there_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "tetra", 1, "tetra.nff");
    for arguments in [
        &["shadows", "tetra.nff", "--light-number", "1"][..],
        &["shadows", "none.nff"],
        &["shadows"],
        &["frames", "tetra.nff", "--light-number", "1"],
        &["frames", "none.nff"],
        &["frames", "tetra.nff", "--frames", "0"],
        &["frames", "tetra.nff", "--samples", "2000"],
        &["frames"],
        &[],
    ] {
        let output = bench(folder.path(), arguments, None);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn nothing_of_ours_leaks() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["watertight", "--json", "leaks.json"];
    assert_success(&bench(folder.path(), &arguments, None));
    let figures = json(&folder.path().join("leaks.json"));
    let leaks = figures["leaks"].as_array().unwrap();
    let ours: Vec<_> = leaks.iter().filter(|row| row["is_ours"] == true).collect();
    assert!(ours.len() >= 36);
    for row in ours {
        assert_eq!(row["leaks"], 0, "{row}");
        assert!(row["rays"].as_u64().unwrap() > 8000, "{row}");
    }
}

#[test]
fn samples_of_lights_with_a_size_have_the_bits_of_single_rays() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "sphereflake", 2, "flake.nff");
    let mut arguments = vec!["soft", "flake.nff", "--size", "32x32"];
    arguments.extend(["--rounds", "1", "--degrees", "0,6", "--json", "soft.json"]);
    let output = bench(folder.path(), &arguments, Some("/nowhere/libembree4.so"));
    assert_success(&output);
    let figures = json(&folder.path().join("soft.json"));
    let scenes = figures["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 2);
    for (scene, degrees) in scenes.iter().zip([0.0, 6.0]) {
        assert_eq!(scene["name"], "flake");
        assert_eq!(scene["degrees"], degrees);
        assert_eq!(scene["mismatches"], 0);
        let share = |name: &str| scene[name].as_f64().unwrap();
        // The floor, not the balls.
        assert!(share("by_value_share") > 0.02 && share("known_bytes") > 0.0);
        assert!(share("by_value_share") + share("by_list_share") <= 1.0);
        assert!(scene["embree_ns"].is_null() && scene["embree_best_ns"].is_null());
        for time in ["ours_ns", "cold_ns", "walk_ns", "rays_ns"] {
            assert!(scene[time].as_f64().unwrap() > 0.0, "{time}");
        }
    }
    // A point is all lit or all dark.
    assert_eq!(scenes[0]["uniform_share"], 1.0);
    assert!(scenes[1]["uniform_share"].as_f64().unwrap() < 1.0);
    let angle = ["soft", "flake.nff", "--degrees", "100"];
    let output = bench(folder.path(), &angle, None);
    assert_eq!(output.status.code(), Some(2));
}

/// Writes `leaf.obj`: a floor, and over it a square that is solid where a 2 x 2 checkerboard is white.
fn write_leaf(folder: &Path) {
    #[rustfmt::skip]
    let checkerboard: [u8; 69] = [
        137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 2, 0, 0, 0, 2, 8, 0, 0, 0, 0, 87, 221, 82,
        248, 0, 0, 0, 12, 73, 68, 65, 84, 120, 218, 99, 96, 248, 15, 132, 0, 6, 0, 1, 255, 173, 44, 55, 37, 0, 0, 0, 0, 73,
        69, 78, 68, 174, 66, 96, 130,
    ];
    let square = |size: f64, height: f64| {
        let corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)];
        corners.map(|(x, y)| {
            format!(
                "v {} {} {height}\n",
                f64::from(x) * size,
                f64::from(y) * size
            )
        })
    };
    let vertices = [square(2.0, 0.0), square(1.0, 1.0)].concat().concat();
    let faces =
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl floor\nf 1 2 3 4\nusemtl leaf\nf 5/1 6/2 7/3 8/4\n";
    fs::write(folder.join("leaf.png"), checkerboard).unwrap();
    fs::write(
        folder.join("leaf.mtl"),
        "newmtl floor\nnewmtl leaf\nmap_d leaf.png\n",
    )
    .unwrap();
    fs::write(
        folder.join("leaf.obj"),
        format!("mtllib leaf.mtl\n{vertices}{faces}"),
    )
    .unwrap();
}

#[test]
fn intervals_in_the_air_agree_with_every_step_of_a_march() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "city", 30, "city.nff");
    generate(folder.path(), "sphereflake", 2, "flake.nff");
    let mut arguments = vec!["fog", "city.nff", "--size", "64x64", "--tiles", "6"];
    arguments.extend(["--rounds", "1", "--steps", "8,32", "--reference", "512"]);
    arguments.extend(["--json", "fog.json"]);
    let output = bench(folder.path(), &arguments, Some("/nowhere/libembree4.so"));
    assert_success(&output);
    let figures = json(&folder.path().join("fog.json"));
    let scenes = figures["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 2);
    for (scene, steps) in scenes.iter().zip([8, 32]) {
        assert_eq!(scene["name"], "city");
        assert_eq!(scene["steps"], steps);
        assert_eq!(scene["mismatches"], 0);
        assert_eq!(scene["march_mismatches"], 0);
        assert!(scene["segments"].as_u64().unwrap() > 100);
        assert!(scene["embree_march_ns"].is_null() && scene["embree_best_march_ns"].is_null());
        for time in ["ours_ns", "own_march_ns", "auto_march_ns", "map_march_ns"] {
            assert!(scene[time].as_f64().unwrap() > 0.0, "{time}");
        }
        let error = |of: &str| scene["rms"][of].as_f64().unwrap();
        assert!(error("ours") < 0.002 && error("ours") < 0.5 * error("march"));
    }
    // Balls have exact intervals, too; triangles with holes have none: they are filled for all, and that is told.
    let flake = ["fog", "flake.nff", "--size", "32x32", "--tiles", "4"];
    let few = ["--rounds", "1", "--steps", "8", "--reference", "64"];
    let output = bench(
        folder.path(),
        &[&flake[..], &few, &["--json", "flake.json"]].concat(),
        None,
    );
    assert_success(&output);
    let figures = json(&folder.path().join("flake.json"));
    assert_eq!(figures["scenes"][0]["mismatches"], 0);
    write_leaf(folder.path());
    let leaf = ["fog", "leaf.obj", "--size", "32x32", "--tiles", "4"];
    let seen = [
        "--camera",
        "eye:0,-6,3/at:0,0,0",
        "--light",
        "point:0,0,5",
        "--up",
        "z",
    ];
    let output = bench(folder.path(), &[&leaf[..], &seen, &few].concat(), None);
    assert_success(&output);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("1 materials have holes; they are filled"),
        "{said}"
    );
    let steps = ["fog", "city.nff", "--reference", "100"];
    let output = bench(folder.path(), &steps, None);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn rivals_are_rows_where_they_are_named() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "tetra", 2, "tetra.nff");
    let methods = ["light-buffer", "hybrid", "shadow-volumes", "shadow-map"];
    let mut arguments = vec!["shadows", "tetra.nff", "--size", "64x64"];
    arguments.extend(["--rounds", "1", "--json", "figures.json"]);
    for method in methods {
        arguments.extend(["--shadows", method]);
    }
    let output = bench(folder.path(), &arguments, Some("/nowhere/libembree4.so"));
    assert_success(&output);
    let scene = &json(&folder.path().join("figures.json"))["scenes"][0];
    assert_eq!(scene["mismatches"], 0);
    for method in methods.map(|method| method.replace('-', "_")) {
        let set = &scene["coherent"];
        assert!(set[format!("{method}_ns")].as_f64().unwrap() > 0.0);
        assert!(set["work"][&method]["steps"].as_f64().unwrap() > 0.0);
        let kept = &scene["preparation"][&method];
        assert!(kept["bytes_per_light"].as_f64().unwrap() > 0.0);
        let is_counted_by_the_paper = method == "light_buffer" || method == "hybrid";
        assert_eq!(kept["paper"].is_null(), !is_counted_by_the_paper);
    }
    let verdicts = &scene["coherent"]["differences"]["shadow_map"];
    assert_eq!(verdicts["judged"], verdicts["rival_wrong"]);
}

#[test]
fn a_second_process_is_measured_with_a_file_and_without() {
    let folder = tempfile::tempdir().unwrap();
    generate(folder.path(), "city", 30, "city.nff");
    for refine in ["lazy", "eager"] {
        let arguments = [
            &["kept", "city.nff", "--size", "40x30"][..],
            &["--queries", "3000", "--learn", "3", "--rounds", "2"],
            &["--refine", refine, "--resolution", "64"],
            &["--json", "figures.json"],
        ]
        .concat();
        let output = bench(folder.path(), &arguments, None);
        assert_success(&output);
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(said.contains("0 answers differ"), "{said}");
        let figures = json(&folder.path().join("figures.json"));
        assert_eq!(figures["refine"], refine);
        assert!(figures["file_bytes"].as_u64().unwrap() > 1000);
        let ratio = |name: &str| figures[name].as_f64().unwrap();
        assert!(ratio("ratio_from_scene") > 0.0 && ratio("ratio_whole") > 0.0);
        for name in ["with_file", "without"] {
            let rounds = figures[name].as_array().unwrap();
            assert_eq!(rounds.len(), 2);
            for round in rounds {
                let count = |name: &str| round[name].as_u64().unwrap();
                let answered = count("first_pass") + count("blocker_list") + count("rays");
                assert_eq!(answered, 3000);
                assert_eq!(count("differences"), 0);
            }
        }
        if refine == "eager" {
            // The same values, whether they were taken or made.
            let known = |name: &str| figures[name][0]["first_pass"].clone();
            assert_eq!(known("with_file"), known("without"));
        }
    }
}
