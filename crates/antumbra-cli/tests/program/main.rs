//! Drives the real `antumbra` program.

mod attack;
mod bumps;
mod files;
mod fog;
mod foreign;
mod freeform;
mod glass;
mod help;
mod interrupts;
mod lazy;
mod lights;
mod outputs;
mod query;
mod saved;
mod sun;
mod sun_light;
mod sun_pages;
mod support;
mod terminal;

use std::fs;

use serde_json::Value;

use support::{Folder, antumbra, assert_code, count, figures, rendered, stderr, stdout, text};

#[test]
fn help_names_every_command_and_the_exit_codes() {
    let output = antumbra(&["--help"]);
    assert_code(&output, 0);
    for part in [
        "render",
        "inspect",
        "verify",
        "query",
        "sun",
        "scene",
        "convert",
        "bake",
        "export",
        "Exit codes",
        "130",
    ] {
        assert!(stdout(&output).contains(part), "{part}");
    }
    for command in [
        "render", "inspect", "query", "sun", "verify", "scene", "convert", "bake", "export",
    ] {
        assert_code(&antumbra(&[command, "--help"]), 0);
    }
}

#[test]
fn bad_usage_ends_with_2_and_says_what_was_expected() {
    let render = |more: &[&str]| antumbra(&[&["render", "a.nff", "-o", "b.png"], more].concat());
    let cases: [(&[&str], &str); 18] = [
        (&["--size", "0x5"], "1 to 16384 pixels"),
        (&["--size", "99999x1"], "1 to 16384 pixels"),
        (&["--grid", "0"], "1 to 2048 voxels"),
        (
            &["--shadows", "soft"],
            "voxel-1990, voxel, grid, bvh, naive",
        ),
        (&["--rays", "octree"], "bvh, grid"),
        (&["--quick-check", "maybe"], "report"),
        (&["--spp", "0"], "1..=65536"),
        (&["--spp", "2", "--corner-rays"], "cannot be used with"),
        (&["--max-depth", "1000"], "0..=32"),
        (&["--exposure", "nan"], "expected a finite number"),
        (&["--exposure", "bright"], "or give `auto`"),
        (&["--aov", "depth"], "decided"),
        (&["--background", "1,2"], "expected R,G,B"),
        (&["--camera", "eye:1,2"], "expected X,Y,Z"),
        (&["--light", "moon:1,2,3"], "expected point:X,Y,Z"),
        (&["--sun", "0,100"], "-90 to 90 degrees"),
        (&["--threads", "0"], "1..=1024"),
        (&["--memory-limit", "much"], "expected a size such as"),
    ];
    for (more, expected) in cases {
        let output = render(more);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains(expected),
            "{more:?}: {}",
            stderr(&output)
        );
    }
    assert_code(&antumbra(&[]), 2);
    assert_code(&antumbra(&["paint"]), 2);
    assert_code(&antumbra(&["render", "a.nff"]), 2);
    assert_code(
        &antumbra(&["scene", "nothing-of-the-kind", "-o", "x.nff"]),
        2,
    );
}

#[test]
fn a_missing_file_ends_with_2_and_is_named() {
    let output = antumbra(&["inspect", "no/such/scene.nff"]);
    assert_code(&output, 2);
    assert!(
        stderr(&output).contains("no/such/scene.nff"),
        "{}",
        stderr(&output)
    );
    assert!(stderr(&output).contains("help:"), "{}", stderr(&output));
}

#[test]
fn a_bad_file_ends_with_2_and_the_line() {
    let folder = Folder::new();
    let scene = folder.path("bad.nff");
    fs::write(&scene, "s 0 0 0 1\ns 0 0 zero 1\n").unwrap();
    let output = antumbra(&["inspect", text(&scene)]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("bad.nff:2"), "{}", stderr(&output));
}

#[test]
fn a_picture_that_cannot_be_written_ends_with_3() {
    let (folder, scene) = Folder::with_scene();
    let nowhere = folder.path("missing/picture.png");
    let output = antumbra(&[
        "render",
        text(&scene),
        "-o",
        text(&nowhere),
        "--size",
        "4x4",
    ]);
    assert_code(&output, 3);
    assert!(
        stderr(&output).contains("picture.png"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn the_picture_depends_neither_on_the_method_nor_on_threads() {
    let (folder, scene) = Folder::with_scene();
    for sampling in [&["--spp", "3"][..], &["--corner-rays"], &[]] {
        let expected = rendered(&folder, &scene, sampling);
        assert!(expected.starts_with(b"\x89PNG\r\n"));
        for method in ["voxel-1990", "grid", "bvh", "naive"] {
            for threads in ["1", "2", "7"] {
                let more = [sampling, &["--shadows", method, "--threads", threads]].concat();
                assert!(rendered(&folder, &scene, &more) == expected, "{more:?}");
            }
        }
        for grid in ["1", "3x4x5", "40"] {
            for rays in ["bvh", "grid"] {
                let more = [sampling, &["--grid", grid, "--rays", rays]].concat();
                assert!(rendered(&folder, &scene, &more) == expected, "{more:?}");
            }
        }
    }
}

#[test]
fn the_occlusion_picture_does_not_depend_on_threads() {
    let (folder, scene) = Folder::with_scene();
    // `auto` decides by measured times, so that only a named method shows the same twice.
    let shown = ["--shadows", "voxel", "--show", "occlusion"];
    let eager = ["--refine", "eager", "--threads"];
    let by = |threads| rendered(&folder, &scene, &[&shown[..], &eager, &[threads]].concat());
    let expected = by("1");
    assert!(by("7") == expected);
    assert!(rendered(&folder, &scene, &[]) != expected);
}

#[test]
fn figures_are_all_there_and_add_up() {
    let (folder, scene) = Folder::with_scene();
    for method in ["voxel-1990", "grid", "bvh", "naive"] {
        for show in ["scene", "occlusion"] {
            let figures = figures(&folder, &scene, &["--shadows", method, "--show", show]);
            let of = |path| count(&figures, path);
            assert_eq!(of("/rays/primary"), 64 * 48, "the size comes from the file");
            assert!(of("/rays/primary_hits") > 0);
            assert_eq!(
                of("/rays/total"),
                of("/rays/primary")
                    + of("/rays/reflection")
                    + of("/rays/refraction")
                    + of("/shadow/rays")
            );
            assert_eq!(
                of("/shadow/first_pass")
                    + of("/shadow/intermediate")
                    + of("/shadow/blocker_list")
                    + of("/shadow/rays"),
                of("/shadow/queries") - of("/shadow/facing_away") - of("/shadow/out_of_cone")
            );
            assert!(of("/shadow/shadowed") > 0);
            assert_eq!(of("/frames"), 1);
            assert_eq!(of("/preparations"), 1);
            assert_eq!(figures["is_complete"], true);
            assert_eq!(figures["settings"]["shadows"], method);
            assert_eq!(figures["settings"]["rays"], "bvh");
            assert!(figures["quick_check"].is_null());
            for path in ["/time/load_s", "/time/prepare_s", "/time/render_s"] {
                assert!(
                    figures.pointer(path).unwrap().as_f64().unwrap() >= 0.0,
                    "{path}"
                );
            }
            for path in [
                "/traversal/steps",
                "/traversal/intersections",
                "/memory/occlusion_bytes",
            ] {
                assert!(figures.pointer(path).unwrap().is_u64(), "{path}");
            }
            assert!(figures["memory"].get("peak_bytes").is_some());
        }
    }
}

#[test]
fn every_method_counts_the_same_queries() {
    let (folder, scene) = Folder::with_scene();
    let of = |method| {
        let figures = figures(&folder, &scene, &["--corner-rays", "--shadows", method]);
        [
            "/rays/primary",
            "/shadow/queries",
            "/shadow/facing_away",
            "/shadow/shadowed",
        ]
        .map(|path| count(&figures, path))
    };
    let expected = of("naive");
    assert_eq!(expected[0], 65 * 49);
    for method in ["voxel-1990", "grid", "bvh"] {
        assert_eq!(of(method), expected, "{method}");
    }
}

#[test]
fn depth_counts_the_eye_ray() {
    let (folder, scene) = Folder::with_scene();
    let secondary = |depth| {
        let figures = figures(&folder, &scene, &["--max-depth", depth]);
        count(&figures, "/rays/reflection") + count(&figures, "/rays/refraction")
    };
    assert_eq!(secondary("0"), 0);
    assert_eq!(secondary("1"), 0);
    assert!(secondary("2") > 0);
    assert!(secondary("5") > secondary("2"));
}

#[test]
fn the_quick_check_is_reported_when_asked_for() {
    let (folder, scene) = Folder::with_scene();
    let figures = figures(&folder, &scene, &["--quick-check", "report"]);
    assert!(
        figures["quick_check"]["is_advised"].is_boolean(),
        "{figures}"
    );
}

#[test]
fn an_orbit_prepares_once_and_numbers_its_frames() {
    let (folder, scene) = Folder::with_scene();
    let json = folder.path("figures.json");
    let output = antumbra(&[
        "render",
        text(&scene),
        "-o",
        text(&folder.path("round.png")),
        "--size",
        "16x16",
        "--orbit",
        "3",
        "--stats-json",
        text(&json),
        "--stats",
    ]);
    assert_code(&output, 0);
    let figures: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    assert_eq!(
        (count(&figures, "/frames"), count(&figures, "/preparations")),
        (3, 1)
    );
    assert_eq!(count(&figures, "/rays/primary"), 3 * 16 * 16);
    let frames = ["0001", "0002", "0003"]
        .map(|number| fs::read(folder.path(&format!("round-{number}.png"))).unwrap());
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    assert!(!folder.path("round.png").exists());
    assert!(
        stderr(&output).contains("preparations"),
        "{}",
        stderr(&output)
    );

    // Frame 1 is the still picture.
    assert!(rendered(&folder, &scene, &["--size", "16x16"]) == frames[0]);
}

#[test]
fn lights_and_cameras_that_are_missing_are_made_up_and_said() {
    let folder = Folder::new();
    let scene = folder.path("ball.nff");
    fs::write(&scene, "s 0 0 0 1\n").unwrap();
    let picture = folder.path("ball.png");
    let arguments = [
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--size",
        "8x8",
    ];
    let output = antumbra(&arguments);
    assert_code(&output, 0);
    assert!(stderr(&output).contains("no camera"), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("taking a sun"),
        "{}",
        stderr(&output)
    );
    let quiet = antumbra(&[&arguments[..], &["--quiet"]].concat());
    assert_code(&quiet, 0);
    assert_eq!(stderr(&quiet), "");

    let partial = antumbra(&[&arguments[..], &["--camera", "fov:30"]].concat());
    assert_code(&partial, 2);
    assert!(
        stderr(&partial).contains("leaves out `eye`"),
        "{}",
        stderr(&partial)
    );
}

#[test]
fn typed_lights_replace_the_files_and_that_is_said() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("picture.png");
    let json = folder.path("figures.json");
    let output = antumbra(&[
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--light",
        "point:1,-4,9/2,2,2",
        "--sun",
        "-90,30",
        "--light",
        "point:-3,-4,9",
        "--camera",
        "fov:20",
        "--exposure",
        "-1",
        "--stats-json",
        text(&json),
    ]);
    assert_code(&output, 0);
    assert!(
        stderr(&output).contains("replace the file's lights (2)"),
        "{}",
        stderr(&output)
    );
    let figures: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    let hits = count(&figures, "/rays/primary_hits")
        + count(&figures, "/rays/reflection")
        + count(&figures, "/rays/refraction");
    let queries = count(&figures, "/shadow/queries");
    assert!(
        queries.is_multiple_of(3) && queries <= 3 * hits,
        "{queries} queries, {hits} hits at most"
    );
}

#[test]
fn impossible_cameras_and_limits_end_with_2() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("picture.png");
    for more in [
        ["--camera", "eye:0,0,0.5"],
        ["--camera", "up:4,-6,4.5"],
        ["--camera", "up:0,0,0"],
        ["--memory-limit", "10kB"],
        ["--light", "point:1e300,0,0"],
    ] {
        let arguments = ["render", text(&scene), "-o", text(&picture)];
        let output = antumbra(&[&arguments[..], &more].concat());
        assert_code(&output, 2);
        assert!(!picture.exists());
    }
}

#[test]
fn inspect_counts_and_predicts() {
    let (_folder, scene) = Folder::with_scene();
    let output = antumbra(&["inspect", text(&scene)]);
    assert_code(&output, 0);
    let lines = stdout(&output);
    let row = |name: &str| {
        let line = lines
            .lines()
            .find(|line| line.starts_with(name))
            .unwrap_or_else(|| panic!("{lines}"));
        line[name.len()..].trim().to_owned()
    };
    assert_eq!(row("objects"), "4");
    assert_eq!(row("elements"), "4");
    assert_eq!(row("triangles"), "3");
    assert_eq!(row("lights"), "2");
    assert_eq!(row("bounds"), "(-3, -3, 0) to (3, 3, 1.5)");
    assert!(row("grid").contains(" x "));
    for method in ["voxel-1990", "grid", "bvh", "naive"] {
        assert!(row(&format!("memory, {method} ")).contains('B'));
    }
}

#[test]
fn built_in_scenes_are_written_and_verify_finds_no_difference() {
    let folder = Folder::new();
    let scene = folder.path("tetra.nff");
    let written = antumbra(&["scene", "tetra", "--size", "2", "-o", text(&scene)]);
    assert_code(&written, 0);
    let inspected = antumbra(&["inspect", text(&scene)]);
    assert_code(&inspected, 0);
    assert!(
        stdout(&inspected).contains("triangles              16\n"),
        "{}",
        stdout(&inspected)
    );
    let verified = antumbra(&["verify", text(&scene), "--queries", "3000"]);
    assert_code(&verified, 0);
    let lines = stdout(&verified);
    let (bumps, queries) = lines.split_once('\n').expect("two lines");
    assert!(
        bumps.starts_with("bump: ") && bumps.ends_with(": 0 differences"),
        "{lines}"
    );
    assert_eq!(queries, "3000 queries, 0 differences\n");
}

#[test]
fn verify_takes_every_shape_and_any_one_method() {
    let (_folder, scene) = Folder::with_scene();
    for method in ["voxel-1990", "grid", "bvh", "naive"] {
        let arguments = [
            "verify",
            text(&scene),
            "--queries",
            "2000",
            "--seed",
            "9",
            "--shadows",
        ];
        let output = antumbra(&[&arguments[..], &[method]].concat());
        assert_code(&output, 0);
        // The pane is asked about, too.
        let lines = stdout(&output);
        let (glass, rest) = lines.split_once('\n').expect("two lines");
        assert_eq!(
            glass,
            "1692 of them about glass, 13 filtered, 0 differences of colors"
        );
        // Of these methods one keeps values, which know something of points above surfaces.
        let queries = match method {
            "voxel-1990" => {
                rest.split_once(" perturbed reference: 0 differences\n")
                    .expect("it")
                    .1
            }
            _ => rest,
        };
        assert_eq!(queries, "2000 queries, 0 differences\n");
    }
}
