//! Bumps on the command line: reliefs for any format, their figures, what is refused.

use std::fs;
use std::path::PathBuf;

use super::support::{Folder, antumbra, assert_code, figures, rendered, stderr, stdout, text};

/// A plate over a floor.
fn plate() -> (Folder, PathBuf) {
    let folder = Folder::new();
    let scene = folder.path("plate.obj");
    let square = |half: i32, z: i32| {
        format!(
            "v -{half} -{half} {z}\nv {half} -{half} {z}\nv {half} {half} {z}\nv -{half} {half} {z}\n"
        )
    };
    let faces = "f 1 2 3 4\nf 5 6 7 8\n";
    fs::write(&scene, square(9, 0) + &square(3, 2) + faces).unwrap();
    (folder, scene)
}

const VIEW: [&str; 10] = [
    "--up",
    "z",
    "--light",
    "point:1,2,9",
    "--size",
    "96x64",
    "--camera",
    "eye:1,-14,9/at:0,0,0",
    "--bump",
    "noise:0.4,0.8",
];

#[test]
fn a_relief_is_the_same_for_any_method_and_is_asked_near_shadows_only() {
    let (folder, scene) = plate();
    let of = |more: &[&str]| rendered(&folder, &scene, &[&VIEW, more].concat());
    let expected = of(&["--shadows", "naive", "--threads", "1"]);
    for method in ["auto", "voxel", "voxel-1990", "grid", "bvh"] {
        assert!(of(&["--shadows", method]) == expected, "{method}");
    }
    assert!(rendered(&folder, &scene, &VIEW[..8]) != expected);
    let count = |more: &[&str], name: &str| {
        let found = figures(&folder, &scene, &[&VIEW, more].concat());
        found.pointer(name).and_then(serde_json::Value::as_u64)
    };
    let by_values = |name| count(&["--shadows", "voxel-1990"], name).expect("a count");
    let [queries, lit, shadowed, perturbed] = [
        "/bumps/queries",
        "/bumps/known_lit",
        "/bumps/known_shadowed",
        "/bumps/perturbed",
    ]
    .map(by_values);
    assert_eq!(queries, lit + shadowed + perturbed);
    assert!(
        shadowed > 100 && lit > 100 && perturbed < queries / 2,
        "{lit} {shadowed} {perturbed}"
    );
    let naive = count(&["--shadows", "naive"], "/bumps/perturbed");
    assert_eq!(naive, Some(queries));
    let smooth = figures(&folder, &scene, &VIEW[..8]);
    assert!(smooth["bumps"].is_null());
}

#[test]
fn verify_compares_what_is_known_above_surfaces() {
    let (_folder, scene) = plate();
    let light = ["--up", "z", "--light", "point:1,2,9", "--queries", "20000"];
    let verified = antumbra(&[&["verify", text(&scene)][..], &light].concat());
    assert_code(&verified, 0);
    let said = stdout(&verified);
    let begin =
        "answers in full and null regions equal those of the perturbed reference: 0 differences";
    assert!(said.contains("bump: ") && said.contains(begin), "{said}");
}

#[test]
fn odd_reliefs_are_refused() {
    let (folder, scene) = plate();
    let out = folder.path("a.png");
    for (bump, reason) in [
        ("noise", "expected noise:HEIGHT,SIZE or ripples:HEIGHT,SIZE"),
        ("noise:1", "found 1 numbers"),
        (
            "bricks:1,2",
            "a relief is `bricks`: expected noise or ripples",
        ),
        ("noise:0,1", "height of a relief is 0"),
        ("ripples:1,-2", "size of a relief is -2"),
        ("noise:nan,1", "expected a finite number"),
        ("noise:1e40,1", "height of a relief is 1"),
    ] {
        let refused = antumbra(&["render", text(&scene), "-o", text(&out), "--bump", bump]);
        assert_code(&refused, 2);
        assert!(
            stderr(&refused).contains(reason),
            "{bump}: {}",
            stderr(&refused)
        );
    }
}
