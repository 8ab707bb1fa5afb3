//! The rivals of the paper's time as the program shows them.

use std::fs;

use crate::support::{
    Folder, antumbra, assert_code, count, figures, rendered, stderr, stdout, text,
};

const EXACT: [&str; 3] = ["light-buffer", "hybrid", "shadow-volumes"];

#[test]
fn exact_rivals_make_the_same_picture() {
    let (folder, scene) = Folder::with_scene();
    let expected = rendered(&folder, &scene, &["--shadows", "naive"]);
    for method in EXACT {
        for threads in ["1", "3"] {
            let more = ["--shadows", method, "--threads", threads];
            assert!(rendered(&folder, &scene, &more) == expected, "{more:?}");
        }
    }
}

#[test]
fn a_picture_that_differs_is_not_passed_off() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("map.png");
    let json = folder.path("map.json");
    let output = antumbra(&[
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--shadows",
        "shadow-map",
        "--stats-json",
        text(&json),
    ]);
    assert_code(&output, 0);
    let said = stderr(&output);
    assert!(said.contains("shadow-map is not exact"), "{said}");
    let figures: serde_json::Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    assert_eq!(figures["settings"]["is_exact"], false);
    // So does the picture, or the warning would be wrong.
    let exact = rendered(&folder, &scene, &[]);
    assert!(fs::read(&picture).unwrap() != exact);
}

#[test]
fn rivals_have_figures_that_add_up() {
    let (folder, scene) = Folder::with_scene();
    let naive = figures(&folder, &scene, &["--shadows", "naive"]);
    let expected = count(&naive, "/shadow/shadowed");
    for method in EXACT {
        let figures = figures(&folder, &scene, &["--shadows", method, "--rays", "grid"]);
        let of = |path| count(&figures, path);
        assert_eq!(
            of("/shadow/first_pass")
                + of("/shadow/intermediate")
                + of("/shadow/blocker_list")
                + of("/shadow/rays"),
            of("/shadow/queries") - of("/shadow/facing_away") - of("/shadow/out_of_cone")
        );
        assert_eq!(of("/shadow/shadowed"), expected, "{method}");
        // Where shadow rays cost less than shadow polygons, hybrid sends them all.
        if method != "hybrid" {
            assert!(of("/shadow/first_pass") > 0, "{method}");
            assert!(of("/traversal/candidates") > 0, "{method}");
        }
        assert!(figures["memory"]["bytes_per_light"].as_f64() > Some(0.0));
        assert_eq!(figures["settings"]["shadows_used"], method);
        assert_eq!(figures["settings"]["is_exact"], true);
    }
}

/// Our own scenes, also where answers are most likely to be wrong.
#[test]
fn verify_finds_no_difference_of_exact_rivals() {
    let folder = Folder::new();
    for (name, size) in [("tetra", "3"), ("sphereflake", "2"), ("city", "40")] {
        let scene = folder.path("scene.nff");
        let made = antumbra(&["scene", name, "--size", size, "-o", text(&scene)]);
        assert_code(&made, 0);
        for attack in [&[][..], &["--attack", "--lights", "3"]] {
            let mut arguments = vec!["verify", text(&scene), "--queries", "4000"];
            for method in EXACT {
                arguments.extend(["--shadows", method]);
            }
            arguments.extend(attack);
            let output = antumbra(&arguments);
            assert_code(&output, 0);
            let told = stdout(&output);
            assert!(told.contains("4000 queries, 0 differences"), "{told}");
        }
    }
}

#[test]
fn verify_tells_how_often_the_shadow_map_is_wrong_and_does_not_fail() {
    let (_folder, scene) = Folder::with_scene();
    let output = antumbra(&[
        "verify",
        text(&scene),
        "--queries",
        "3000",
        "--shadows",
        "shadow-map",
    ]);
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

#[test]
fn batches_are_answered_by_our_own_methods_only() {
    let (folder, scene) = Folder::with_scene();
    let points = folder.path("points.npy");
    fs::write(&points, npy()).unwrap();
    let out = folder.path("out.npy");
    let arguments = |method| {
        antumbra(&[
            "query",
            text(&scene),
            "--points",
            text(&points),
            "-o",
            text(&out),
            "--shadows",
            method,
        ])
    };
    assert_code(&arguments("grid"), 0);
    let refused = arguments("hybrid");
    assert_code(&refused, 2);
    let said = stderr(&refused);
    assert!(
        said.contains("possible values: auto, voxel, voxel-1990, grid, bvh, naive"),
        "{said}"
    );
}

/// One point, as NumPy writes it.
fn npy() -> Vec<u8> {
    let mut header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3), }".to_owned();
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend([0.5_f64, 0.25, 3.0].iter().flat_map(|x| x.to_le_bytes()));
    bytes
}
