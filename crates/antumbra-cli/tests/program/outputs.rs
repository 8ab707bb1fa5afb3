//! Files the program writes and what it settles by itself: layers, OpenEXR, exposure, sky, memory,
//! conversion.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{
    Folder, antumbra, assert_code, count, figures, rendered, stderr, stdout, text,
};

/// One triangle on the ground under a lamp of many candela.
const LAMP: &str = r#"{
  "asset": { "version": "2.0" },
  "extensionsUsed": ["KHR_lights_punctual"],
  "extensions": { "KHR_lights_punctual": { "lights": [
    { "type": "point", "name": "lamp", "intensity": 5000 }
  ] } },
  "scene": 0,
  "scenes": [{ "nodes": [0, 1] }],
  "nodes": [
    { "mesh": 0 },
    { "translation": [0, 3, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } }
  ],
  "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
  "accessors": [{
    "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [-4, 0, -4], "max": [4, 0, 4]
  }],
  "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
  "buffers": [{
    "byteLength": 36,
    "uri": "data:application/octet-stream;base64,AACAwAAAAAAAAIDAAAAAAAAAAAAAAIBAAACAQAAAAAAAAIDA"
  }]
}"#;

const TETRAHEDRON: &str = "\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
";

/// Returns the names of the files beside `scene`, sorted.
fn names(folder: &Folder) -> Vec<String> {
    let entries = fs::read_dir(folder.path("")).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn render_to(path: &Path, scene: &Path, more: &[&str]) -> String {
    let arguments = ["render", text(scene), "-o", text(path)];
    let output = antumbra(&[&arguments[..], more].concat());
    assert_code(&output, 0);
    stderr(&output)
}

fn holds(bytes: &[u8], part: &str) -> bool {
    bytes
        .windows(part.len())
        .any(|window| window == part.as_bytes())
}

#[test]
fn openexr_is_the_same_for_every_method_and_thread_count() {
    let (folder, scene) = Folder::with_scene();
    let path = folder.path("picture.exr");
    let bytes = |more: &[&str]| {
        // How queries are decided depends on who came first, as long as anything is made on the way.
        let all = ["--spp", "2", "--refine", "eager"];
        render_to(&path, &scene, &[&all, more].concat());
        fs::read(&path).unwrap()
    };
    let all = bytes(&["--threads", "1"]);
    assert!(all.starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    for part in ["beauty", "shadow.light-1", "shadow.light-2", "decided-by"] {
        assert!(holds(&all, part), "{part}");
    }
    assert!(bytes(&["--threads", "7"]) == all);
    let masks = bytes(&["--aov", "shadow"]);
    assert!(!holds(&masks, "decided-by"));
    for method in ["grid", "naive"] {
        assert!(bytes(&["--aov", "shadow", "--shadows", method]) == masks);
    }
    let beauty = bytes(&["--aov", "none"]);
    assert!(!holds(&beauty, "shadow."));
    let said = render_to(&path, &scene, &["--exposure", "3", "--aov", "none"]);
    assert!(said.contains("--exposure changes PNG only"), "{said}");
}

#[test]
fn layers_lie_beside_a_png_when_asked_for() {
    let (folder, scene) = Folder::with_scene();
    let plain = rendered(&folder, &scene, &[]);
    assert_eq!(names(&folder), ["picture.png", "small.nff"]);
    assert!(rendered(&folder, &scene, &["--aov", "shadow,decided"]) == plain);
    assert_eq!(
        names(&folder),
        [
            "picture.decided-by.png",
            "picture.png",
            "picture.shadow.light-1.png",
            "picture.shadow.light-2.png",
            "small.nff"
        ]
    );
    let layer = |name: &str| fs::read(folder.path(name)).unwrap();
    for name in ["picture.decided-by.png", "picture.shadow.light-2.png"] {
        assert!(layer(name).starts_with(b"\x89PNG"));
    }
    let figures = figures(&folder, &scene, &["--aov", "decided", "--orbit", "2"]);
    assert_eq!(figures["settings"]["aovs"], serde_json::json!(["decided"]));
    assert!(folder.path("picture-0002.decided-by.png").exists());
}

#[test]
fn a_picture_in_no_known_format_ends_with_2_before_anything_is_read() {
    let folder = Folder::new();
    let output = antumbra(&["render", "missing.nff", "-o", text(&folder.path("a.jpg"))]);
    assert_code(&output, 2);
    assert!(
        stderr(&output).contains(".png or .exr"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn automatic_exposure_is_told_and_does_not_depend_on_threads() {
    let (folder, scene) = Folder::with_scene();
    let of = |more: &[&str]| {
        let figures = figures(&folder, &scene, more);
        let settings = &figures["settings"];
        let stops = settings["exposure_stops"].as_f64().unwrap();
        (settings["exposure"].as_str().unwrap().to_owned(), stops)
    };
    assert_eq!(of(&[]), ("fixed".to_owned(), 0.0));
    assert_eq!(of(&["--exposure", "-2"]), ("fixed".to_owned(), -2.0));
    let (kind, stops) = of(&["--exposure", "auto", "--threads", "1"]);
    assert!(kind == "auto" && stops != 0.0);
    assert_eq!(of(&["--exposure", "auto", "--threads", "7"]), (kind, stops));
    let by_hand = rendered(&folder, &scene, &["--exposure", &format!("{stops:?}")]);
    assert!(rendered(&folder, &scene, &["--exposure", "auto"]) == by_hand);
    let said = render_to(
        &folder.path("picture.png"),
        &scene,
        &["-v", "--exposure", "auto"],
    );
    assert!(said.contains("automatic exposure: "), "{said}");
}

#[test]
fn light_in_candela_is_exposed_by_itself() {
    let folder = Folder::new();
    let scene = folder.path("lamp.gltf");
    fs::write(&scene, LAMP).unwrap();
    let auto = figures(&folder, &scene, &["--size", "32x32"]);
    assert_eq!(auto["settings"]["exposure"], "auto");
    let stops = auto["settings"]["exposure_stops"].as_f64().unwrap();
    assert!((-20.0..-5.0).contains(&stops), "{stops}");
    // False colors are as documented, whatever the light; typed light has no unit.
    for more in [["--show", "occlusion"], ["--light", "point:0,3,0"]] {
        let figures = figures(&folder, &scene, &[&["--size", "8x8"], &more[..]].concat());
        assert_eq!(figures["settings"]["exposure"], "fixed");
    }
    let inspected = antumbra(&["inspect", text(&scene)]);
    assert_code(&inspected, 0);
    let layers = folder.path("layers.png");
    render_to(&layers, &scene, &["--size", "8x8", "--aov", "shadow"]);
    assert!(folder.path("layers.shadow.lamp.png").exists());
}

#[test]
fn formats_without_a_background_get_a_sky_and_any_can_be_typed() {
    let folder = Folder::new();
    let obj = folder.path("tetrahedron.obj");
    fs::write(&obj, TETRAHEDRON).unwrap();
    // A corner of the picture, as the layer without exposure tells it: linear bytes.
    let picture = |scene: &Path, more: &[&str]| {
        rendered(
            &folder,
            scene,
            &[&["--size", "16x16", "--quiet"], more].concat(),
        )
    };
    let sky = picture(&obj, &[]);
    assert!(picture(&obj, &["--background", "0.38,0.43,0.51"]) == sky);
    assert!(picture(&obj, &["--background", "0,0,0"]) != sky);
    // NFF has a word for it; without that word it is black.
    let nff = folder.path("ball.nff");
    fs::write(&nff, "s 0 0 0 1\n").unwrap();
    assert!(picture(&nff, &["--background", "0,0,0"]) == picture(&nff, &[]));
}

#[test]
fn up_counts_for_every_format() {
    let folder = Folder::new();
    let obj = folder.path("tetrahedron.obj");
    fs::write(&obj, TETRAHEDRON).unwrap();
    let ply = folder.path("tetrahedron.ply");
    assert_code(&antumbra(&["convert", text(&obj), text(&ply)]), 0);
    let seen = |scene: &Path, up: &[&str]| {
        rendered(
            &folder,
            scene,
            &[&["--size", "16x16", "--quiet"], up].concat(),
        )
    };
    let [y, z] = ["y", "z"].map(|up| seen(&obj, &["--up", up]));
    assert!(y != z && seen(&obj, &[]) == y && seen(&ply, &[]) == z);
    assert!(seen(&ply, &["--up", "y"]) == y);
}

#[test]
fn memory_is_refused_before_it_is_taken_and_by_name() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("picture.png");
    let cases = [
        (
            &["--memory-limit", "100"][..],
            "the file alone takes",
            "raise",
        ),
        (
            &["--size", "16384x16384", "--memory-limit", "1GiB"],
            "picture 3.8 GiB",
            "smaller --size",
        ),
        (
            &[
                "--size",
                "8000x8000",
                "--memory-limit",
                "1300MiB",
                "--aov",
                "shadow,decided",
            ],
            "fewer layers",
            "--aov",
        ),
        (
            &[
                "--grid",
                "1000",
                "--shadows",
                "voxel-1990",
                "--memory-limit",
                "500MiB",
            ],
            "values of the grid",
            "--grid fewer voxels",
        ),
    ];
    for (more, expected, advice) in cases {
        let arguments = ["render", text(&scene), "-o", text(&picture)];
        let output = antumbra(&[&arguments[..], more].concat());
        assert_code(&output, 2);
        let said = stderr(&output);
        assert!(said.contains(expected) && said.contains(advice), "{said}");
        assert!(!picture.exists());
    }
    let figures = figures(&folder, &scene, &[]);
    assert!(count(&figures, "/memory/predicted_bytes") > 64 * 48 * 15);
}

#[test]
fn converting_keeps_the_scene_and_says_what_is_lost() {
    let (folder, scene) = Folder::with_scene();
    let copy = folder.path("copy.nff");
    let output = antumbra(&["convert", text(&scene), text(&copy)]);
    assert_code(&output, 0);
    assert_eq!(stdout(&output), "");
    assert!(rendered(&folder, &copy, &[]) == rendered(&folder, &scene, &[]));

    // Round things have no word in OBJ, and are not approximated.
    let obj = folder.path("small.obj");
    let refused = antumbra(&["convert", text(&scene), text(&obj)]);
    assert_code(&refused, 2);
    assert!(
        stderr(&refused).contains("cannot say"),
        "{}",
        stderr(&refused)
    );
    assert!(!obj.exists());

    let tetra = folder.path("tetra.nff");
    let made = antumbra(&["scene", "tetra", "--size", "2", "-o", text(&tetra)]);
    assert_code(&made, 0);
    let ply = folder.path("tetra.ply");
    let converted = antumbra(&["convert", text(&tetra), text(&ply)]);
    assert_code(&converted, 0);
    assert!(
        stderr(&converted).contains("warning: "),
        "{}",
        stderr(&converted)
    );
    let inspected = antumbra(&["inspect", text(&ply)]);
    assert!(stdout(&inspected).contains("triangles              16\n"));

    let unknown = antumbra(&["convert", text(&tetra), text(&folder.path("tetra.xyz"))]);
    assert_code(&unknown, 2);
    let nowhere = folder.path("missing/tetra.nff");
    assert_code(&antumbra(&["convert", text(&tetra), text(&nowhere)]), 3);
}

#[test]
fn figures_tell_rays_that_went_on() {
    let (folder, scene) = Folder::with_scene();
    let figures: Value = figures(&folder, &scene, &[]);
    assert_eq!(count(&figures, "/rays/passed"), 0);
}
