//! Lights with size on the command line and in files.

use std::fs;

use super::support::{
    Folder, antumbra, assert_code, count, figures, rendered, stderr, stdout, text,
};

/// Lights of every kind, typed.
const TYPED: [&str; 8] = [
    "point:3,-3,5",
    "spot:0,0,5/0,0,-1/20,40/1,1,1",
    "area:0,0,5/0,2,0/2,0,0/0.9,0.9,0.8",
    "disk:2,-2,4/-2,2,-4/0.5",
    "sphere:-2,-2,4,0.5/0.5,0.5,0.5",
    "segment:-2,0,3/2,0,3",
    "sky:0.2,0.3,0.4",
    "sun:225,40,3/0.5,0.5,0.4",
];

#[test]
fn pictures_with_any_light_are_the_same_for_any_method_and_number_of_threads() {
    let (folder, scene) = Folder::with_scene();
    let mut options: Vec<&str> = TYPED.iter().flat_map(|light| ["--light", light]).collect();
    options.extend(["--sun", "225,40,3", "--spp", "2"]);
    let with = |samples: &str, more: &[&str]| {
        let samples = ["--light-samples", samples];
        rendered(&folder, &scene, &[&options[..], &samples, more].concat())
    };
    let of = |more: &[&str]| with("7", more);
    let expected = of(&["--shadows", "naive", "--threads", "1"]);
    for method in ["auto", "voxel", "voxel-1990", "grid", "bvh"] {
        for threads in ["1", "3"] {
            let found = of(&["--shadows", method, "--threads", threads]);
            assert!(found == expected, "{method}, {threads} threads");
        }
    }
    assert!(of(&["--seed", "1"]) != expected);
    assert!(with("8", &[]) != expected);
}

#[test]
fn figures_count_points_and_samples_of_lights_with_size() {
    let (folder, scene) = Folder::with_scene();
    let figures = figures(
        &folder,
        &scene,
        &[
            "--light",
            TYPED[2],
            "--light",
            TYPED[6],
            "--light-samples",
            "9",
        ],
    );
    let of = |name: &str| count(&figures, &format!("/light_samples/{name}"));
    assert!(of("points") > 1000);
    let regions = of("facing_away") + of("umbra") + of("penumbra") + of("lit");
    assert_eq!(of("points"), regions);
    assert_eq!(of("samples"), 9 * of("points"));
    assert!(of("blocked") > 0 && of("blocked") < of("asked") && of("asked") < of("samples"));
    assert_eq!(count(&figures, "/shadow/queries"), 0);
    assert_eq!(count(&figures, "/settings/light_samples"), 9);
    let rays = |name: &str| count(&figures, &format!("/rays/{name}"));
    let other = ["primary", "reflection", "refraction", "passed"].map(rays);
    assert_eq!(rays("total"), other.iter().sum::<u64>() + of("asked"));
}

#[test]
fn lights_without_size_are_untouched_by_samples() {
    let (folder, scene) = Folder::with_scene();
    let few = rendered(&folder, &scene, &[]);
    assert!(few == rendered(&folder, &scene, &["--light-samples", "64"]));
}

#[test]
fn a_file_of_lights_stands_for_what_is_typed() {
    let (folder, scene) = Folder::with_scene();
    let file = folder.path("lights.json");
    fs::write(
        &file,
        r#"{"lights": [
            {"type": "rectangle", "center": [0, 0, 5], "edges": [[0, 2, 0], [2, 0, 0]], "color": [0.9, 0.9, 0.8]},
            {"type": "sky", "color": [0.2, 0.3, 0.4]}
        ]}"#,
    )
    .unwrap();
    let typed = rendered(&folder, &scene, &["--light", TYPED[2], "--light", TYPED[6]]);
    assert!(typed == rendered(&folder, &scene, &["--lights", text(&file)]));
    // The masks have the names of the lights.
    rendered(
        &folder,
        &scene,
        &["--lights", text(&file), "--aov", "shadow,decided"],
    );
    for layer in ["shadow.light-1", "shadow.light-2", "decided-by"] {
        assert!(
            folder.path(&format!("picture.{layer}.png")).exists(),
            "{layer}"
        );
    }
}

#[test]
fn bad_lights_end_with_2_and_say_what_is_wrong() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("p.png");
    let render = |more: &[&str]| {
        let base = [
            "render",
            text(&scene),
            "-o",
            text(&picture),
            "--size",
            "4x4",
        ];
        antumbra(&[&base[..], more].concat())
    };
    let cases: [(&[&str], &str); 8] = [
        (&["--light", "area:0,0,5/1,0,0/2,0,0"], "it has no area"),
        (
            &["--light", "area:0,0,nan/1,0,0/0,1,0"],
            "expected a finite number",
        ),
        (&["--light", "sphere:0,0,5,0"], "its radius is zero"),
        (&["--light", "cube:0,0,5,0"], "unknown kind of light"),
        (&["--sun", "225,40,0"], "above 0, below 180 degrees"),
        (&["--sun", "225"], "AZIMUTH,ELEVATION[,DIAMETER] in degrees"),
        (&["--light-samples", "0"], "1..=65536"),
        (&["--lights", "nothing.json"], "cannot read the file"),
    ];
    for (more, expected) in cases {
        let output = render(more);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains(expected),
            "{expected}: {}",
            stderr(&output)
        );
        assert!(!picture.exists());
    }
    let file = folder.path("lights.json");
    fs::write(
        &file,
        r#"{"lights": [{"type": "sky"}, {"type": "disk", "radius": 1}]}"#,
    )
    .unwrap();
    let output = render(&["--lights", text(&file)]);
    assert_code(&output, 2);
    assert!(
        stderr(&output).contains("lights[1].center: is missing"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn lights_of_a_file_without_size_or_not_finite_end_with_2_and_are_named() {
    let (folder, scene) = Folder::with_scene();
    let (file, picture) = (folder.path("lights.json"), folder.path("p.png"));
    for (light, expected) in [
        (
            r#"{"type": "point", "position": [0, 0, 1e999]}"#,
            "lights[0].position[2]: number out of range",
        ),
        (
            r#"{"type": "point", "position": [0, 0, NaN]}"#,
            "lights[0].position[2]: expected value",
        ),
        (
            r#"{"type": "directional", "towards_light": [0, 0, 0]}"#,
            "lights[0].towards_light: is zero",
        ),
        (
            r#"{"type": "sphere", "center": [0, 0, 5], "radius": 0}"#,
            "lights[0]: its radius is zero",
        ),
        (
            r#"{"type": "sphere", "center": [0, 0, 5], "radius": -1}"#,
            "lights[0]: the radius is -1; expected above 0",
        ),
        (
            r#"{"type": "segment", "ends": [[0, 0, 1], [0, 0, 1]]}"#,
            "lights[0]: its ends are the same point",
        ),
        (
            r#"{"type": "triangle", "corners": [[0, 0, 0], [1, 0, 0], [2, 0, 0]]}"#,
            "lights[0]: it has no area",
        ),
        (
            r#"{"type": "rectangle", "center": [0, 0, 5], "edges": [[1e31, 0, 0], [0, 1, 0]]}"#,
            "lights[0]: an edge is not finite, or beyond 2^100",
        ),
    ] {
        fs::write(&file, format!("{{\"lights\": [{light}]}}")).unwrap();
        let output = antumbra(&[
            "render",
            text(&scene),
            "-o",
            text(&picture),
            "--lights",
            text(&file),
        ]);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains(expected),
            "{expected}: {}",
            stderr(&output)
        );
        assert!(!picture.exists());
    }
}

#[test]
fn lights_in_surfaces_inside_out_and_beyond_the_scene_are_fine() {
    let (folder, scene) = Folder::with_scene();
    for light in [
        // In the floor, through the ball, below everything and turned away, larger than the scene.
        "area:0,0,0/1,0,0/0,1,0/both",
        "sphere:0,0,0.8,0.5",
        "area:0,0,0.8/1,0,1/0,1,0/both",
        "area:0,0,-5/0,1,0/1,0,0",
        "area:0,0,900/0,9e5,0/9e5,0,0",
        "disk:0,0,1e29/0,0,-1/1e29",
        "sphere:0,0,0,1e29",
        "segment:0,0,-1e29/0,0,1e29",
    ] {
        let options = ["--light", light, "--size", "16x12"];
        let expected = rendered(
            &folder,
            &scene,
            &[&options[..], &["--shadows", "naive"]].concat(),
        );
        assert!(expected == rendered(&folder, &scene, &options), "{light}");
        let exact = [&options[..], &["--soft", "exact"]].concat();
        let expected = rendered(
            &folder,
            &scene,
            &[&exact[..], &["--shadows", "naive"]].concat(),
        );
        assert!(expected == rendered(&folder, &scene, &exact), "{light}");
    }
}

#[test]
fn a_hundred_thousand_lights_without_size_make_the_same_picture_for_any_method() {
    let (folder, scene) = Folder::with_scene();
    let file = folder.path("lights.json");
    let all: Vec<String> = (0..100_000)
        .map(|number| {
            let [x, y] = [number % 317, number % 499].map(|n| f64::from(n) / 100.0 - 2.0);
            format!(
                r#"{{"type": "point", "position": [{x}, {y}, {}], "color": [1e-5, 1e-5, 1e-5]}}"#,
                2 + number % 7
            )
        })
        .collect();
    fs::write(&file, format!("{{\"lights\": [{}]}}", all.join(","))).unwrap();
    let options = ["--lights", text(&file), "--size", "4x4"];
    let expected = rendered(
        &folder,
        &scene,
        &[&options[..], &["--shadows", "bvh"]].concat(),
    );
    for method in ["auto", "voxel"] {
        let found = rendered(
            &folder,
            &scene,
            &[&options[..], &["--shadows", method]].concat(),
        );
        assert!(found == expected, "{method}");
    }
}

#[test]
fn a_hundred_thousand_lights_are_read_and_rendered() {
    let (folder, scene) = Folder::with_scene();
    let file = folder.path("lights.json");
    let one =
        r#"{"type": "sphere", "center": [0, 0, 5], "radius": 0.5, "color": [1e-5, 1e-5, 1e-5]}"#;
    let all = vec![one; 100_000].join(",");
    fs::write(&file, format!("{{\"lights\": [{all}]}}")).unwrap();
    let options = [
        "--lights",
        text(&file),
        "--size",
        "1x1",
        "--light-samples",
        "1",
    ];
    let figures = figures(&folder, &scene, &options);
    let points = count(&figures, "/light_samples/points");
    assert!(
        points >= 100_000 && points.is_multiple_of(100_000),
        "{points}"
    );
}

#[test]
fn faces_that_emit_light_the_scene_when_asked() {
    let folder = Folder::new();
    let scene = folder.path("lamp.obj");
    fs::write(
        folder.path("lamp.mtl"),
        "newmtl floor\nKd .8 .8 .8\nnewmtl lamp\nKd 0 0 0\nKe 9 8 7\n",
    )
    .unwrap();
    fs::write(
        &scene,
        "mtllib lamp.mtl\nv -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
         usemtl floor\nf 4 3 2 1\nusemtl lamp\nf 5 6 7 8\n",
    )
    .unwrap();
    let options = ["--size", "32x24", "--emissive-lights"];
    let figures = figures(&folder, &scene, &options);
    assert!(count(&figures, "/light_samples/lit") > 100, "{figures}");
    // No other light was taken.
    assert_eq!(count(&figures, "/shadow/queries"), 0);
}

/// A plate over a floor, without anything round.
const FLAT: &str = "\
v
from 4 -6 5
at 0 0 0.5
up 0 0 1
angle 40
hither 0.1
resolution 48 36
f 0.8 0.7 0.6 0.9 0 1 0 0
p 4
-3 -3 0
3 -3 0
3 3 0
-3 3 0
p 4
-1 -1 1
1 -1 1
1 1 1.2
-1 1 1.2
";

#[test]
fn exact_soft_shadows_have_no_noise_and_are_the_same_for_any_method() {
    let folder = Folder::new();
    let scene = folder.path("flat.nff");
    fs::write(&scene, FLAT).unwrap();
    let lights = [
        "--light", TYPED[2], "--light", TYPED[5], "--sun", "225,40,3",
    ];
    let of = |more: &[&str]| rendered(&folder, &scene, &[&lights[..], more].concat());
    let expected = of(&["--soft", "exact", "--shadows", "naive", "--threads", "1"]);
    for method in ["auto", "voxel", "voxel-1990", "grid", "bvh"] {
        let found = of(&["--soft", "exact", "--shadows", method, "--threads", "3"]);
        assert!(found == expected, "{method}");
    }
    // A seed changes samples, of which there are none.
    assert!(of(&["--soft", "exact", "--seed", "5"]) == expected);
    assert!(of(&["--soft", "8", "--seed", "5"]) != of(&["--soft", "8"]));
    assert!(of(&["--soft", "8"]) == of(&["--light-samples", "8"]));

    let figures = figures(
        &folder,
        &scene,
        &[&lights[..], &["--soft", "exact"]].concat(),
    );
    let of = |name: &str| count(&figures, &format!("/light_samples/{name}"));
    assert!(
        of("points") > 1000 && of("exact") == of("points"),
        "{figures}"
    );
    assert!(of("penumbra") > 100 && of("samples") == 0);
    let regions = of("facing_away") + of("umbra") + of("penumbra") + of("lit");
    assert_eq!(of("points"), regions);
}

#[test]
fn samples_answer_where_exact_fractions_have_no_closed_form() {
    let (folder, scene) = Folder::with_scene();
    let options = ["--light", TYPED[2], "--soft", "exact"];
    let figures = figures(&folder, &scene, &options);
    let of = |name: &str| count(&figures, &format!("/light_samples/{name}"));
    // Behind the ball and the cone there are samples, elsewhere none.
    assert!(of("exact") > 0 && of("exact") < of("points"), "{figures}");
    assert_eq!(of("samples"), 64 * (of("points") - of("exact")));
}

#[test]
fn verify_compares_lights_with_size() {
    let (_folder, scene) = Folder::with_scene();
    let lights: Vec<&str> = TYPED[2..]
        .iter()
        .flat_map(|light| ["--light", light])
        .collect();
    let options = ["--queries", "20000", "--seed", "3"];
    for judge in ["reference", "bvh"] {
        let command = ["verify", text(&scene), "--against", judge];
        let output = antumbra(&[&command[..], &lights, &options].concat());
        assert_code(&output, 0);
        let said = stdout(&output);
        assert!(
            said.contains("of lights with size, 0 differences"),
            "{said}"
        );
    }
    // Both kinds of lights, and delicate places.
    let both = ["--light", TYPED[0], "--light", TYPED[2], "--attack"];
    let output = antumbra(&[&["verify", text(&scene)], &both[..], &options].concat());
    assert_code(&output, 0);
    assert!(
        stdout(&output).contains("20000 queries, 0 differences"),
        "{}",
        stdout(&output)
    );
}

#[test]
fn inspect_lists_lights_with_size() {
    let (_folder, scene) = Folder::with_scene();
    let lights = ["--light", TYPED[2], "--light", "sky:", "--sun", "225,40,3"];
    let output = antumbra(&[&["inspect", text(&scene)], &lights[..]].concat());
    assert_code(&output, 0);
    let said = stdout(&output);
    for expected in [
        "lights with size       3",
        "rectangle, area 4",
        "sky, 6.28",
        "sun, 0.00",
    ] {
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn commands_about_values_refuse_lights_with_size_and_say_why() {
    let (folder, scene) = Folder::with_scene();
    let saved = folder.path("saved.antumbra");
    let cells = folder.path("cells.npy");
    for command in [
        vec!["bake", text(&scene), "-o", text(&saved)],
        vec!["export", text(&scene), "-o", text(&cells)],
    ] {
        for option in [
            ["--light", TYPED[2]],
            ["--light", "sky:"],
            ["--sun", "225,40,3"],
        ] {
            let output = antumbra(&[&command[..], &option[..]].concat());
            assert_code(&output, 2);
            let expected = "lights with size have no values or maps of their own";
            assert!(stderr(&output).contains(expected), "{}", stderr(&output));
        }
    }
}
