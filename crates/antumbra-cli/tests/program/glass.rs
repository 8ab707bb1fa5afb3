//! Glass on the command line: colored shadows in pictures, transmittance of points.

use std::fs;
use std::path::PathBuf;

use super::query::doubles;
use super::support::{Folder, antumbra, assert_code, figures, rendered, stderr, stdout, text};

fn window() -> (Folder, PathBuf) {
    let folder = Folder::new();
    let scene = folder.path("window.glb");
    assert_code(&antumbra(&["scene", "window", "-o", text(&scene), "-q"]), 0);
    (folder, scene)
}

#[test]
fn pictures_of_colored_glass_are_the_same_for_any_method_and_number_of_threads() {
    let (folder, scene) = window();
    let of = |more: &[&str]| {
        let size = ["--size", "64x48", "--light", "sun:170,40"];
        rendered(&folder, &scene, &[&size, more].concat())
    };
    let expected = of(&["--shadows", "naive", "--threads", "1"]);
    for method in ["auto", "voxel", "voxel-1990", "grid", "bvh"] {
        for threads in ["1", "3"] {
            let found = of(&["--shadows", method, "--threads", threads]);
            assert!(found == expected, "{method}, {threads} threads");
        }
    }
    assert!(of(&["--shadows-through-glass", "off"]) != expected);
    let found = figures(&folder, &scene, &["--shadows-through-glass", "off"]);
    assert_eq!(
        found.pointer("/settings/colored_shadows"),
        Some(&false.into())
    );
}

#[test]
fn transmittance_of_points_is_written_as_colors() {
    let folder = Folder::new();
    let (scene, library) = (folder.path("pane.obj"), folder.path("pane.mtl"));
    fs::write(&library, "newmtl red\nKd 0 0 0\nd 0.5\nTf 1 0.5 0.25\n").unwrap();
    let pane = "mtllib pane.mtl\nusemtl red\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n";
    fs::write(&scene, pane).unwrap();
    let (points, out) = (folder.path("points.npy"), folder.path("out.npy"));
    fs::write(
        &points,
        doubles(&[[0.0, 0.0, 0.0], [0.5, -0.25, 0.0], [3.0, 0.0, 0.0]]),
    )
    .unwrap();
    let ask = |more: &[&str]| {
        let files = [
            "--points",
            text(&points),
            "-o",
            text(&out),
            "--transmittance",
        ];
        antumbra(&[&["query", text(&scene)][..], &files, more].concat())
    };
    let above = ["--light", "point:0,0,9"];
    let asked = ask(&above);
    assert_code(&asked, 0);
    assert!(stdout(&asked).contains("0 answers blocked, 1 unfiltered, 2 filtered"));
    let bytes = fs::read(&out).unwrap();
    let numbers = bytes[bytes.len() - 72..].chunks(8);
    let numbers: Vec<f64> = numbers
        .map(|number| f64::from_le_bytes(number.try_into().unwrap()))
        .collect();
    assert_eq!(numbers, [0.5, 0.25, 0.125, 0.5, 0.25, 0.125, 1.0, 1.0, 1.0]);

    let refused = ask(&["--light", "sphere:0,0,9,1"]);
    assert_code(&refused, 2);
    assert!(stderr(&refused).contains("--transmittance is of lights without"));
    assert_code(&ask(&[&above[..], &["--packed"]].concat()), 2);
}

#[test]
fn nff_has_no_colored_glass() {
    let folder = Folder::new();
    let scene = folder.path("window.nff");
    let refused = antumbra(&["scene", "window", "-o", text(&scene)]);
    assert_code(&refused, 2);
    let said = stderr(&refused);
    assert!(
        said.contains("cannot write NFF") && said.contains(".glb"),
        "{said}"
    );
    assert!(!scene.exists());
}
