//! Texts in which the program explains itself, and the length of their lines.

use std::fs;
use std::path::Path;
use std::process::Command;

use antumbra_testkit::help::{Expected, assert_fits, assert_states_north};

use super::support::{Folder, antumbra, assert_code, npy, stderr, stdout, text};

/// Every command, with the words that its help must have.
const COMMANDS: [Expected<'_>; 9] = [
    (
        &["render"],
        &[
            "Scene and lights:",
            "Output:",
            "Picture:",
            "Method:",
            "Index and memory:",
        ],
    ),
    (&["inspect"], &["Scene and lights:", "Index and memory:"]),
    (
        &["query"],
        &[
            "Scene and lights:",
            "Points:",
            "Output:",
            "Method:",
            "Threads:",
        ],
    ),
    (
        &["sun"],
        &["Scene:", "Sensors:", "Suns:", "Output:", "Threads:"],
    ),
    (
        &["verify"],
        &["Scene and lights:", "Comparison:", "Threads:"],
    ),
    (
        &["bake"],
        &["Scene and lights:", "Output:", "Index and memory:"],
    ),
    (
        &["export"],
        &["Scene and lights:", "Output:", "Saved values:"],
    ),
    (
        &["scene"],
        &["Scene:", "Output:", "sphereflake", "heightfield", "rooms"],
    ),
    (&["convert"], &["Files:", ".nff, .obj, .ply or .glb"]),
];

fn help(arguments: &[&str]) -> String {
    let output = antumbra(arguments);
    assert_code(&output, 0);
    stdout(&output)
}

#[test]
fn no_line_of_help_has_more_than_100_columns_and_every_command_has_headings() {
    let program: Expected<'_> = (&[], &["Examples", "Exit codes"]);
    assert_fits(help, &[&COMMANDS[..], &[program]].concat());
}

#[test]
fn north_is_stated_wherever_a_sun_can_be_typed() {
    assert_states_north(
        help,
        &["render", "inspect", "query", "verify", "bake", "export"],
    );
}

#[test]
fn a_sun_below_the_horizon_is_told() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("a.png");
    let render = [
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--size",
        "8x8",
    ];
    for (sun, is_reported) in [("10,-30", true), ("10,30", false)] {
        let output = antumbra(&[&render[..], &["--sun", sun]].concat());
        assert_code(&output, 0);
        let said = stderr(&output);
        assert_eq!(
            said.contains("30 degrees below the horizon"),
            is_reported,
            "{said}"
        );
    }
}

#[test]
fn query_offers_the_methods_that_it_has_and_no_others() {
    let text = help(&["query", "--help"]);
    for method in ["voxel-1990", "bvh", "naive"] {
        assert!(text.contains(method), "{method}");
    }
    for rival in ["light-buffer", "hybrid", "shadow-volumes", "shadow-map"] {
        assert!(!text.contains(rival), "{rival}");
        let typed = [
            "query",
            "a.nff",
            "--points",
            "p.npy",
            "-o",
            "o.npy",
            "--shadows",
            rival,
        ];
        let output = antumbra(&typed);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains("possible values"),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn values_that_begin_with_a_minus_are_told_what_is_expected() {
    let query = [
        "query",
        "a.nff",
        "--points",
        "p.npy",
        "-o",
        "o.npy",
        "--on-surface",
    ];
    let render = ["render", "a.nff", "-o", "a.png"];
    for (command, option, value, expected) in [
        (
            &query[..],
            "--tolerance",
            "-1",
            "expected a distance, zero or more",
        ),
        (
            &render,
            "--background",
            "-1,0,0",
            "a background must not be negative",
        ),
        (&render, "--light", "-1,2,3", "expected point:X,Y,Z"),
        (&render, "--camera", "-1,2,3", "expected eye:X,Y,Z"),
    ] {
        let output = antumbra(&[command, &[option, value]].concat());
        assert_code(&output, 2);
        let said = stderr(&output);
        assert!(said.contains(expected) && said.contains(value), "{said}");
    }
}

/// A square that stands on a floor, with z up: as a modeller writes it, without a word about up.
const HOUSE: &str = "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nv -1 0 0\nv 1 0 0\nv 1 0 2\nv -1 0 2\nf 1 2 3 4\nf 5 6 7 8\n";

#[test]
fn the_examples_of_the_help_run_as_they_stand() {
    let folder = Folder::new();
    fs::write(folder.path("house.obj"), HOUSE).unwrap();
    // A point of the floor in the shadow of the wall, and one before it.
    let points: [[f64; 3]; 2] = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let array = npy(&points);
    fs::write(folder.path("P.npy"), array).unwrap();
    let help = help(&["--help"]);
    let examples = help
        .lines()
        .filter_map(|line| line.strip_prefix("    antumbra "));
    let mut count = 0;
    for example in examples {
        let output = Command::new(env!("CARGO_BIN_EXE_antumbra"))
            .args(example.split_whitespace())
            .current_dir(folder.path("."))
            .output()
            .unwrap();
        assert_code(&output, 0);
        assert!(
            !stderr(&output).contains("which way is up"),
            "{}",
            stderr(&output)
        );
        count += 1;
    }
    assert_eq!(count, 2);
    assert!(fs::metadata(folder.path("house.png")).unwrap().len() > 1000);
    assert!(fs::read(folder.path("OUT.npy")).unwrap().ends_with(&[1, 0]));
}

/// Each command says once which axis it takes for up, if something depends on it and nobody has said it.
#[test]
fn an_assumed_up_axis_is_told_where_something_depends_on_it() {
    let folder = Folder::new();
    let mesh = folder.path("house.obj");
    fs::write(&mesh, HOUSE).unwrap();
    let stl = folder.path("house.stl");
    fs::write(&stl, "solid a\nfacet normal 0 0 1\nouter loop\nvertex -4 -4 0\nvertex 4 -4 0\nvertex 4 4 0\nendloop\nendfacet\nendsolid a\n").unwrap();
    let lamps = folder.path("lamps.json");
    fs::write(&lamps, r#"{"lights": [{"type": "sky"}]}"#).unwrap();
    let points: [[f64; 3]; 2] = [[0.0, 1.0, 0.5], [0.0, -1.0, 0.5]];
    let array = npy(&points);
    fs::write(folder.path("P.npy"), array).unwrap();
    let (points, out, picture) = (
        folder.path("P.npy"),
        folder.path("O.npy"),
        folder.path("p.png"),
    );
    let query = |scene: &Path, more: &[&str]| {
        let typed = [
            "query",
            text(scene),
            "--points",
            text(&points),
            "-o",
            text(&out),
        ];
        let output = antumbra(&[&typed[..], more].concat());
        assert_code(&output, 0);
        stderr(&output)
    };
    let lamp = "point:0,0,9";
    for (more, told) in [
        (&["--sun", "180,45"][..], Some("--sun")),
        (&["--light", "sky"], Some("the sky")),
        (
            &["--lights", text(&lamps)],
            Some("suns and skies of --lights"),
        ),
        (&["--sky-view-factor"], Some("the sky")),
        (&[], Some("the sun")),
        (&["--light", lamp], None),
        (&["--ambient-occlusion"], None),
        (&["--sun", "180,45", "--up", "y"], None),
        (&["--sky-view-factor", "--up", "z"], None),
    ] {
        let said = query(&mesh, more);
        assert_eq!(
            said.matches("which way is up").count(),
            usize::from(told.is_some()),
            "{more:?}: {said}"
        );
        if let Some(what) = told {
            let line = format!(
                "note: the file does not say which way is up: taking +y for {what} (--up z for +z)"
            );
            assert!(said.contains(&line), "{more:?}: {said}");
        }
    }
    let said = query(&stl, &["--sun", "180,45"]);
    assert!(
        said.contains("taking +z for --sun (--up y for +y)"),
        "{said}"
    );
    // A camera goes by it, too, and a sun and a camera together are told once.
    for (more, count) in [
        (&[][..], 1),
        (&["--light", lamp], 1),
        (
            &["--light", lamp, "--camera", "eye:0,-9,3/at:0,0,0/up:0,0,1"],
            0,
        ),
    ] {
        let typed = ["render", text(&mesh), "-o", text(&picture), "--size", "4x4"];
        let output = antumbra(&[&typed[..], more].concat());
        assert_code(&output, 0);
        let said = stderr(&output);
        assert_eq!(
            said.matches("which way is up").count(),
            count,
            "{more:?}: {said}"
        );
    }
    // NFF says it.
    let (_folder, nff) = Folder::with_scene();
    let output = antumbra(&["verify", text(&nff), "--sun", "180,45", "--queries", "10"]);
    assert_code(&output, 0);
    assert!(!stderr(&output).contains("which way is up"));
}

#[test]
fn a_sun_that_nobody_gave_is_told_as_invented_and_not_where_no_light_is_asked_about() {
    let folder = Folder::new();
    let mesh = folder.path("house.obj");
    fs::write(&mesh, HOUSE).unwrap();
    let inspect = |more: &[&str]| {
        let output = antumbra(&[&["inspect", text(&mesh)], more].concat());
        assert_code(&output, 0);
        assert_eq!(stderr(&output), "");
        stdout(&output)
    };
    let invented = "invented, as neither the file nor an option has a light";
    let said = inspect(&["--up", "z"]);
    assert!(
        said.contains(invented) && !said.contains("assumed"),
        "{said}"
    );
    let said = inspect(&["--light", "point:0,0,9"]);
    assert!(!said.contains(invented), "{said}");
    assert!(
        said.contains("up                     (0, 1, 0); assumed, as the file does not say it"),
        "{said}"
    );
    let points: [[f64; 3]; 2] = [[0.0, 1.0, 0.5], [0.0, -1.0, 0.5]];
    let array = npy(&points);
    fs::write(folder.path("P.npy"), array).unwrap();
    let (points, out) = (folder.path("P.npy"), folder.path("O.npy"));
    let query = [
        "query",
        text(&mesh),
        "--up",
        "z",
        "--points",
        text(&points),
        "-o",
        text(&out),
    ];
    for (more, is_reported) in [
        (&[][..], true),
        (&["--ambient-occlusion"], false),
        (&["--sky-view-factor"], false),
    ] {
        let output = antumbra(&[&query[..], more].concat());
        assert_code(&output, 0);
        let said = stderr(&output);
        assert_eq!(
            said.contains("taking a sun"),
            is_reported,
            "{more:?}: {said}"
        );
    }
}
