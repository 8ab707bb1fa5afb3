//! NFF, entity by entity and error by error.

use antumbra_geometry::{Cone, DVec3, Sphere};
use antumbra_scene::model::{Color, Facing, LightKind, Material, Polygon, Scene, Shape};

use crate::support::nff;

const VIEW: &str = "v from 0 0 5 at 0 0 0 up 0 1 0 angle 45 hither 1 resolution 640 480\n";

/// Reads text after a valid view; fails on warnings too.
fn clean(text: &str) -> Scene {
    let loaded = nff(&format!("{VIEW}{text}")).unwrap();
    assert_eq!(loaded.warnings, []);
    loaded.scene
}

/// Reads text after a valid view and returns the scene and the warnings, shortened.
fn warned(text: &str) -> (Scene, Vec<String>) {
    let loaded = nff(&format!("{VIEW}{text}")).unwrap();
    let texts = loaded.warnings.iter().map(|w| w.to_string()).collect();
    (loaded.scene, texts)
}

fn refusal(text: &str) -> String {
    nff(text).unwrap_err().to_string()
}

#[test]
fn a_view_in_the_usual_order() {
    let scene = clean("s 0 0 0 1");
    let camera = scene.camera.unwrap();
    assert_eq!(camera.eye, DVec3::new(0.0, 0.0, 5.0));
    assert_eq!(camera.at, DVec3::ZERO);
    assert_eq!(camera.up, DVec3::Y);
    assert_eq!(camera.vertical_fov_degrees, 45.0);
    assert_eq!(camera.resolution, Some([640, 480]));
    assert_eq!(scene.up, DVec3::Y);
    assert_eq!(scene.facing, Facing::Winding);
}

#[test]
fn a_view_in_any_order_without_the_optional_records() {
    let loaded = nff("v angle 30 up 0 0 1 at 1 1 1 from 2 2 2 s 0 0 0 1").unwrap();
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.scene.camera.unwrap().resolution, None);
}

#[test]
fn of_two_views_the_last_counts() {
    let (scene, warnings) =
        warned("s 0 0 0 1\nv from 0 0 9 at 0 0 0 up 0 1 0 angle 30 angle 31 hither 0");
    assert_eq!(scene.camera.unwrap().vertical_fov_degrees, 31.0);
    assert_eq!(
        warnings,
        [
            "a.nff:3: `angle` is given twice in one view: the last counts",
            "a.nff:3: another view (`v`): the last one counts"
        ]
    );
}

#[test]
fn views_without_a_meaning_are_refused() {
    for (view, problem) in [
        (
            "at 0 0 0 up 0 1 0 angle 45",
            "a.nff:1: in `v`: `from` is missing",
        ),
        (
            "from 0 0 1 up 0 1 0 angle 45",
            "a.nff:1: in `v`: `at` is missing",
        ),
        (
            "from 0 0 1 at 0 0 0 angle 45",
            "a.nff:1: in `v`: `up` is missing",
        ),
        (
            "from 0 0 1 at 0 0 0 up 0 1 0",
            "a.nff:1: in `v`: `angle` is missing",
        ),
        (
            "from 1 2 3 at 1 2 3 up 0 1 0 angle 45",
            "a.nff:1: in `v`: `from` and `at` are the same point",
        ),
        (
            "from 0 0 1 at 0 0 0 up 0 0 0 angle 45",
            "a.nff:1: in `v`: `up` is zero",
        ),
        (
            "from 0 0 1 at 0 0 0 up 0 0 -3 angle 45",
            "a.nff:1: in `v`: `up` is parallel to the view direction",
        ),
        (
            "from 0 0 1\nat 0 0 0\nup 0 1 0\nangle 180",
            "a.nff:4: in `angle`: expected more than 0 and less than 180 degrees, found 180",
        ),
        (
            "from 0 0 1 at 0 0 0 up 0 1 0 angle 45 resolution 0 10",
            "a.nff:1: in `resolution`: expected 2 whole numbers from 1 to 65536",
        ),
        (
            "from 0 0 1 at 0 0 0 up 0 1 0 angle 45 resolution 10 99999999",
            "a.nff:1: in `resolution`: expected 2 whole numbers",
        ),
        (
            "from 0 0 x",
            "a.nff:1: in `from`: expected 3 numbers (the eye), found `x`",
        ),
    ] {
        let error = refusal(&format!("v {view}"));
        assert!(error.starts_with(problem), "{error}");
    }
}

#[test]
fn background_and_lights() {
    let scene = clean("b 0.1 0.2 0.3\nl 1 2 3\nl 4 5 6 20 20 10\nl0 0 0\nl 0 0 0 s 0 0 0 1");
    assert_eq!(scene.background, Color::new(0.1, 0.2, 0.3));
    // sqrt(4) / (2 * 4)
    let plain = Color::splat(0.25);
    let colors: Vec<_> = scene.lights.iter().map(|l| l.color).collect();
    assert_eq!(colors, [plain, Color::new(20.0, 20.0, 10.0), plain, plain]);
    let second = LightKind::Point {
        position: DVec3::new(4.0, 5.0, 6.0),
    };
    assert_eq!(scene.lights[1].kind, second);
    assert_eq!(scene.lights[1].name, "light 2");
    assert!(scene.lights.iter().all(|light| !light.falls_off));
    assert_eq!(scene.ambient, plain);
}

#[test]
fn a_scene_without_lights_has_ambient_light() {
    let scene = clean("s 0 0 0 1");
    assert_eq!(scene.lights, []);
    assert_eq!(scene.ambient, Color::splat(0.5));
}

#[test]
fn surfaces_stay_in_force_and_default_to_grey() {
    let (scene, warnings) = warned(
        "s 0 0 0 1 f 1 0.5 0.25 0.5 0.25 32 0 0 s 0 0 0 2 s 0 0 0 3\n\
         f 0 0 0 0 0 100000 0 0 f 1 1 1 0 0.5 10 0.9 1.5 s 0 0 0 4",
    );
    assert_eq!(
        warnings,
        [
            "a.nff: 1 surface lets light through: `f` with a transmittance T of 0.9; a T of 0 would \
             make them block"
        ]
    );
    let used: Vec<_> = scene.objects.iter().map(|object| object.material).collect();
    assert_eq!(used, [0, 1, 1, 2]);
    assert_eq!(
        scene.materials.len(),
        3,
        "surfaces that no object has are left out"
    );
    assert_eq!(scene.materials[0], Material::default());
    let second = Material {
        diffuse: Color::new(0.5, 0.25, 0.125),
        specular: Color::splat(0.25),
        shininess: 32.0,
        reflection: Color::splat(0.25),
        ..Material::default()
    };
    assert_eq!(scene.materials[1], second);
    assert_eq!(scene.materials[2].transmission, Color::splat(0.9));
    assert_eq!(scene.materials[2].ior, 1.5);
    assert!(!scene.materials[2].is_opaque());
}

#[test]
fn dialects_of_surfaces() {
    let (scene, warnings) = warned("f 1 1 1 0.5 0.5 45 0 1 earth.jpg\ns 0 0 0 1");
    assert_eq!(
        warnings,
        ["a.nff:2: the texture named after `f` is not read"]
    );
    assert_eq!(scene.materials[0].shininess, 45.0);

    for (text, count) in [
        ("1 0 1", 3),
        ("1 0 1 1", 4),
        ("1 0 1 1 0", 5),
        ("1 0 1 1 0 1", 6),
        ("1 0 1 1 0 1 0", 7),
    ] {
        let (scene, warnings) = warned(&format!("f {text}\ns 0 0 0 1"));
        let start = format!("a.nff:2: `f` with {count} numbers instead of 8");
        assert!(warnings[0].starts_with(&start), "{warnings:?}");
        let expected = Material {
            diffuse: Color::new(1.0, 0.0, 1.0),
            ..Material::default()
        };
        assert_eq!(scene.materials[0], expected);
    }
    let (_, warnings) = warned("f 1 0 1 texture.png\ns 0 0 0 1");
    assert_eq!(warnings.len(), 2, "{warnings:?}");

    let (scene, warnings) = warned("f 1 1 1 1 0 1 0.5 0 s 0 0 0 1 f -1 1 1 1 0 -1 0 0 s 0 0 0 1");
    assert!(warnings[0].contains("index of refraction is not positive: 1 is used"));
    assert!(
        warnings[1].contains("negative color or weight: 0 is used (2 times"),
        "{warnings:?}"
    );
    assert_eq!(scene.materials[0].ior, 1.0);
    assert_eq!(scene.materials[1].diffuse, Color::new(0.0, 1.0, 1.0));
}

#[test]
fn garbled_surfaces_are_refused() {
    for (text, found) in [
        ("f 0.0780.3610.753 1 0 3 0 0", "found `0.0780.3610.753`"),
        ("f 1 1", "found the end of the file"),
        ("f 1 1\ns 0 0 0 1", "found `s`"),
        ("f 1 1 1 0.5 abc 10 0 1", "found `abc`"),
        ("f 1 1 1 0.5 0.5.5", "found `0.5.5`"),
        ("f 1 1 1 nan 0 1 0 1", "found `nan`"),
    ] {
        let error = refusal(text);
        let start = "a.nff:1: in `f`: expected 8 numbers (red green blue Kd Ks shine T ior), ";
        let line = error.replacen("a.nff:2", "a.nff:1", 1);
        assert!(line.starts_with(&format!("{start}{found}")), "{error}");
    }
    assert!(refusal("f 1e300 0 0 1e300 0 0 0 0").contains("overflows"));
    let error = refusal("f 1 1 1 1 0 1 0 1 2");
    assert!(error.contains("expected a keyword"), "{error}");
}

#[test]
fn spheres() {
    let scene = clean("s 1 2 3 4 s0 0 0 .5\ns\n1\n2\n3 # centre\n-4");
    let sphere = |x, y, z, radius| {
        Shape::Sphere(Sphere {
            center: DVec3::new(x, y, z),
            radius,
        })
    };
    let shapes: Vec<_> = scene
        .objects
        .into_iter()
        .map(|object| object.shape)
        .collect();
    let expected = [
        sphere(1.0, 2.0, 3.0, 4.0),
        sphere(0.0, 0.0, 0.0, 0.5),
        sphere(1.0, 2.0, 3.0, 4.0),
    ];
    assert_eq!(shapes, expected);
}

#[test]
fn spheres_without_a_size_are_skipped_and_surplus_numbers_too() {
    let (scene, warnings) = warned("s 0 0 0 0\ns 0 0 0 -0\ns 1 -4 2 4 2 2\ns 1 -4 2 4 s 0 0 0 1");
    assert_eq!(scene.objects.len(), 3);
    assert_eq!(
        warnings,
        [
            "a.nff:2: `s` has radius 0: skipped (2 times; this is the first)",
            "a.nff:4: `s` has more than 4 numbers: the rest of the line is ignored",
        ]
    );
    let error = refusal("s 0 0 0 1\n2 s 0 0 0 1");
    assert!(
        error.starts_with(
            "a.nff:2: expected a keyword (v, b, l, f, s, c, p, pp) after the numbers of `s`, found `2`"
        ),
        "{error}"
    );
}

#[test]
fn cones_are_open_tubes() {
    let scene = clean("c 0 0 0 2 0 0 5 1 c\n0 0 0 -1\n0 0 5 -1\nc 0 0 0 1 1 0 0 0");
    let cone = |base_radius, apex, apex_radius| {
        Shape::Cone(Cone {
            base: DVec3::ZERO,
            base_radius,
            apex,
            apex_radius,
            is_closed: false,
        })
    };
    let shapes: Vec<_> = scene
        .objects
        .into_iter()
        .map(|object| object.shape)
        .collect();
    let up = DVec3::new(0.0, 0.0, 5.0);
    assert_eq!(
        shapes,
        [
            cone(2.0, up, 1.0),
            cone(1.0, up, 1.0),
            cone(1.0, DVec3::X, 0.0)
        ]
    );
}

#[test]
fn degenerate_cones() {
    let (scene, warnings) = warned("c 1 1 1 2 1 1 1 1\nc 0 0 0 0 0 0 1 0\ns 0 0 0 1");
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(
        warnings,
        [
            "a.nff:2: `c` has its base at its apex: skipped",
            "a.nff:3: `c` has two radii of 0: skipped"
        ]
    );
    assert!(
        refusal("c 0 0 0 1 0 0 1 -1")
            .starts_with("a.nff:1: in `c`: the radii 1 and -1 have different signs; help: ")
    );
}

#[test]
fn polygons_convex_and_concave() {
    let scene = clean("p 3 0 0 0 1 0 0 0 1 0\np4\n0 0 0\n2 0 0\n0.5 0.5 0\n0 2 0");
    let Shape::Polygon(Polygon { vertices, normals }) = &scene.objects[1].shape else {
        panic!()
    };
    assert_eq!(vertices[2], DVec3::new(0.5, 0.5, 0.0));
    assert_eq!(vertices.len(), 4);
    assert!(normals.is_empty());
}

#[test]
fn patches_keep_their_normals_whatever_they_are() {
    let scene = clean("pp 3 0 0 0 0 0 -7 1 0 0 0 0 0 0 1 0 0 0 1");
    let Shape::Polygon(polygon) = &scene.objects[0].shape else {
        panic!()
    };
    assert_eq!(polygon.vertices, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(
        polygon.normals,
        [DVec3::new(0.0, 0.0, -7.0), DVec3::ZERO, DVec3::Z]
    );
}

#[test]
fn polygons_without_area_are_skipped() {
    let (scene, warnings) =
        warned("p 3 0 0 0 1 1 1 2 2 2\np 3 1 1 1 1 1 1 0 0 0\np 4 0 0 0 0 0 0 1 0 0 0 1 0");
    assert_eq!(scene.objects.len(), 1, "a repeated vertex is no harm");
    assert_eq!(
        warnings,
        ["a.nff:2: `p` has no area: skipped (2 times; this is the first)"]
    );
}

#[test]
fn vertex_counts_are_not_believed() {
    for (text, problem) in [
        (
            "p 2 0 0 0 1 0 0",
            "in `p`: expected 3 vertices or more, found 2",
        ),
        ("p 0", "in `p`: expected 3 vertices or more, found 0"),
        (
            "p -3 0 0 0",
            "in `p`: expected 3 vertices or more, found -3",
        ),
        (
            "p 3.0 0 0 0",
            "in `p`: expected the number of vertices, 3 or more, found `3.0`",
        ),
        (
            "p",
            "in `p`: expected the number of vertices, 3 or more, found the end of the file",
        ),
        (
            "p 4000000000 0 0 0",
            "in `p`: `4000000000` vertices are announced, but only 6 bytes are left in the file",
        ),
        (
            "pp 99999999999999999999999 0 0 0",
            "in `pp`: `99999999999999999999999` vertices are",
        ),
        (
            "p -99999999999999999999999",
            "in `p`: expected 3 vertices or more, found -1",
        ),
        (
            "p 3 0 0 0 1 0 0 0 abc 1 0",
            "in `p`: expected 3 numbers for each vertex, found `abc`",
        ),
        (
            "pp 3 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0000000000000000000",
            "in `pp`: expected 6 numbers for each vertex (position and normal), found the end",
        ),
    ] {
        let error = refusal(text);
        assert!(error.starts_with(&format!("a.nff:1: {problem}")), "{error}");
    }
}

#[test]
fn numbers_are_finite_decimal_and_apart() {
    for word in [
        "nan",
        "inf",
        "0x1",
        "1,5",
        "1e999",
        "0.0780.3610.753",
        "1d5",
        "--1",
    ] {
        let error = refusal(&format!("# comment\ns 0 0 {word} 1"));
        let expected =
            format!("a.nff:2: in `s`: expected 4 numbers (centre and radius), found `{word}`");
        assert!(error.starts_with(&expected), "{error}");
    }
    let error = refusal("s 0 0 1e31 1");
    assert!(
        error.starts_with("a.nff:1: in `s`: 1e31 exceeds 2^100"),
        "{error}"
    );
    assert!(nff("s 0 0 1e30 1").is_ok());
}

#[test]
fn an_entity_cut_off_by_the_end_of_the_file() {
    let error = refusal("s 0 0 0 1\ns 0 0\n# the end\n");
    assert_eq!(
        error,
        "a.nff:4: in `s`: expected 4 numbers (centre and radius), found the end of the file; \
         help: the file may be cut short"
    );
    assert!(refusal("l 1 2").contains("in `l`: expected 3 numbers (position), or 6"));
    assert!(refusal("l 1 2 3 4").contains("in `l`: expected 3 numbers (position), or 6"));
    assert!(refusal("b 1 2").contains("in `b`: expected 3 numbers (red, green, blue)"));
    assert!(refusal("c 1 2").contains("in `c`: expected 8 numbers"));
}

#[test]
fn unknown_keywords_are_refused_whole() {
    let error = refusal("s 0 0 0 1\n\nfoo7bar 1 2");
    assert_eq!(
        error,
        "a.nff:3: unknown keyword `foo7bar`; expected one of v, b, l, f, s, c, p, pp; \
         help: remove the line, or turn it into a comment with `#`"
    );
    assert!(refusal("from 0 0 0").contains("unknown keyword `from`"));
    assert!(refusal("1 2 3").contains("expected a keyword (v, b, l, f, s, c, p, pp), found `1`"));
}

#[test]
fn assimp_additions_are_skipped() {
    let (scene, warnings) = warned(
        "tess 4\nshader foo bar\ndod 0 0 0 5\ntet 1\nhex 1\noct 1\n\
         tpp 3\n0 0 0 1 1 1 2 2\n1 1 1 1 1 1 2 2\ns 0 0 0 1",
    );
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(warnings.len(), 7);
    assert_eq!(
        warnings[0],
        "a.nff:2: `tess` is not NFF (assimp's addition): skipped"
    );
}

#[test]
fn other_formats_are_refused_by_name() {
    for (text, dialect) in [
        (
            "nff\nversion 2.00",
            "`nff` belongs to Sense8's NFF (WorldToolKit), which is not read",
        ),
        ("k\n", "`k` belongs to BART's AFF"),
        ("x {", "`x` belongs to BART's AFF"),
        ("fm 1 1 1", "`fm` belongs to BART's AFF"),
        (
            "pl 0 0 0 1 1 1",
            "`pl` belongs to a course's variant of NFF (P3F and similar)",
        ),
        ("obj a.obj", "`obj` belongs to an unknown variant of NFF"),
    ] {
        let error = refusal(text);
        assert!(error.starts_with(&format!("a.nff:1: {dialect}")), "{error}");
    }
}

#[test]
fn line_breaks_of_all_kinds() {
    let unix = "# c\ns 0 0 0 1 # d\ns 0 0 0 2\n";
    let expected = nff(unix).unwrap();
    assert_eq!(expected.scene.objects.len(), 2);
    assert_eq!(nff(&unix.replace('\n', "\r\n")).unwrap(), expected);
    assert_eq!(nff(&unix.replace('\n', "\r")).unwrap(), expected);
    assert_eq!(nff(unix.trim_end()).unwrap(), expected);
    assert!(refusal(&format!("{unix}x7x").replace('\n', "\r\n")).starts_with("a.nff:4: "));
}

#[test]
fn an_empty_file_is_an_empty_scene() {
    let loaded = nff("").unwrap();
    let texts: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
    assert_eq!(
        texts,
        [
            "a.nff: no view (`v`) in the file",
            "a.nff: no objects in the file"
        ]
    );
    assert!(loaded.scene.objects.is_empty());
}
