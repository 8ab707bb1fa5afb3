//! Fog on the command line.

use std::fs;

use super::support::{Folder, antumbra, assert_code, count, figures, rendered, stderr, text};

#[test]
fn foggy_pictures_are_the_same_for_any_method_and_number_of_threads() {
    let (folder, scene) = Folder::with_scene();
    let of = |more: &[&str]| {
        let fog = [
            "--fog",
            "0.05,0.9,0.3",
            "--sun",
            "225,40",
            "--light",
            "point:1,-2,3",
        ];
        rendered(&folder, &scene, &[&fog[..], more].concat())
    };
    let expected = of(&["--shadows", "naive", "--threads", "1"]);
    for method in ["auto", "voxel", "voxel-1990", "grid", "bvh"] {
        for threads in ["2", "7"] {
            let found = of(&["--shadows", method, "--threads", threads]);
            assert!(found == expected, "{method}, {threads} threads");
        }
    }
}

#[test]
fn fog_changes_the_picture_and_no_mask() {
    let (folder, scene) = Folder::with_scene();
    let mask = folder.path("picture.shadow.light-1.png");
    let clear = rendered(&folder, &scene, &["--aov", "shadow"]);
    let clear_mask = fs::read(&mask).unwrap();
    let foggy = rendered(&folder, &scene, &["--aov", "shadow,fog", "--fog", "0.05"]);
    assert!(foggy != clear);
    assert!(fs::read(&mask).unwrap() == clear_mask);
    for layer in ["fog", "transmittance"] {
        let file = folder.path(&format!("picture.{layer}.png"));
        assert!(fs::read(file).unwrap().starts_with(b"\x89PNG"), "{layer}");
    }
    // False colors show queries about surfaces, which fog does not change.
    let show = ["--show", "occlusion", "--shadows", "bvh"];
    let clear = rendered(&folder, &scene, &show);
    assert!(rendered(&folder, &scene, &[&show[..], &["--fog", "0.05"]].concat()) == clear);
}

#[test]
fn openexr_has_the_layers_of_the_fog() {
    let (folder, scene) = Folder::with_scene();
    let path = folder.path("picture.exr");
    let names = |more: &[&str]| {
        let arguments = ["render", text(&scene), "-o", text(&path), "--size", "8x8"];
        assert_code(&antumbra(&[&arguments[..], more].concat()), 0);
        let bytes = fs::read(&path).unwrap();
        // The name of a part stands behind its length.
        let has = |name: &str| {
            let needle = [&(name.len() as u32).to_le_bytes()[..], name.as_bytes()].concat();
            bytes.windows(needle.len()).any(|window| window == needle)
        };
        [has("fog"), has("transmittance")]
    };
    assert_eq!(names(&["--fog", "0.05"]), [true, true]);
    assert_eq!(names(&["--fog", "0.05", "--aov", "shadow"]), [false, false]);
    assert_eq!(names(&[]), [false, false]);
}

#[test]
fn figures_count_segments_in_fog() {
    let (folder, scene) = Folder::with_scene();
    let clear = figures(&folder, &scene, &["--sun", "225,40"]);
    assert!(clear["fog"].is_null() && clear["settings"]["fog"].is_null());
    let found = figures(&folder, &scene, &["--sun", "225,40", "--fog", "0.05,0.9"]);
    let rays = ["primary", "reflection", "refraction", "passed"];
    let rays: u64 = rays
        .iter()
        .map(|ray| count(&found, &format!("/rays/{ray}")))
        .sum();
    assert_eq!(count(&found, "/fog/segments"), rays);
    assert!(count(&found, "/fog/intervals") > 0);
    assert!(count(&found, "/fog/by_parts") <= rays);
    assert_eq!(
        found["settings"]["fog"],
        serde_json::json!([0.05, 0.9, 0.0])
    );
    // A medium that only absorbs needs no light.
    let dark = figures(&folder, &scene, &["--sun", "225,40", "--fog", "0.05,0"]);
    assert_eq!(count(&dark, "/fog/segments"), 0);
}

#[test]
fn what_is_no_fog_is_refused_with_what_was_expected() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("picture.png");
    for (more, expected) in [
        (&["--fog", "thick"][..], "expected a finite number"),
        (&["--fog", "0.1,2"], "expected 0 to 1"),
        (&["--fog", "0.1,1,-1"], "expected above -1 and below 1"),
        (&["--fog", "1,1,0,0"], "DENSITY[,ALBEDO[,G]]"),
        (&["--aov", "fog"], "--fog DENSITY"),
        (
            &["--aov", "fog", "--fog", "1", "--show", "occlusion"],
            "--fog DENSITY",
        ),
    ] {
        let arguments = ["render", text(&scene), "-o", text(&picture)];
        let output = antumbra(&[&arguments[..], more].concat());
        assert_code(&output, 2);
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
        assert!(!picture.exists());
    }
}
