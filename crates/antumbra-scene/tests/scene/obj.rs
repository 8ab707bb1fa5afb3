//! OBJ, statement by statement and error by error.

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions, UpAxis,
    model::{Color, Corner, Facing, Material, Mesh, Shape},
    read_file,
};

use crate::support::obj;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

fn mesh(loaded: &Loaded, index: usize) -> &Mesh {
    match &loaded.scene.objects[index].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn clean(text: &str) -> Loaded {
    let loaded = obj(text, "").unwrap();
    assert_eq!(loaded.warnings, []);
    loaded
}

fn warnings(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

fn refusal(text: &str) -> String {
    obj(text, "").unwrap_err().to_string()
}

fn corner(position: u32) -> Corner {
    Corner::at(position)
}

#[test]
fn corners_in_all_four_forms() {
    let normals = "vn 0 0 1\nvn 0 0 2\nvt 0 0\n";
    let with_normals = [(0, 0), (1, 1), (2, 0)].map(|(position, normal)| Corner {
        normal,
        ..Corner::at(position)
    });
    for (face, expected) in [
        ("f 1 2 3", [corner(0), corner(1), corner(2)]),
        ("f 1/1 2/1 3/1", [corner(0), corner(1), corner(2)]),
        ("f 1//1 2//2 3//1", with_normals),
        ("f 1/1/1 2/1/2 3/1/1", with_normals),
        ("f -3/-1/-2 -2/-1/-1 -1/-1/-2", with_normals),
        ("f 1 2 \\\n 3", [corner(0), corner(1), corner(2)]),
    ] {
        let loaded = clean(&format!("{TRIANGLE}{normals}{face}"));
        let mesh = mesh(&loaded, 0);
        assert_eq!(mesh.corners, expected, "{face}");
        assert_eq!(mesh.face_ends, [3]);
        assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    }
}

#[test]
fn the_scene_has_what_the_format_leaves_open() {
    let loaded = clean(&format!("{TRIANGLE}f 1 2 3"));
    assert_eq!(loaded.scene.facing, Facing::Viewer);
    assert_eq!(loaded.scene.up, DVec3::Y);
    assert_eq!(loaded.scene.camera, None);
    assert_eq!(loaded.scene.lights, []);
    assert_eq!(loaded.scene.ambient, Color::splat(0.2));
    assert_eq!(loaded.scene.materials, [Material::default()]);
}

#[test]
fn vertices_with_weights_and_colors() {
    let loaded = obj(
        "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 1 1 1 1\nf 1 2 3",
        "",
    )
    .unwrap();
    assert_eq!(loaded.warnings, []);
    let found = mesh(&loaded, 0);
    assert_eq!(found.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    // sRGB 0.5 is 0.2140 linear; a vertex without a color is white.
    let grey = found.colors[1][0];
    assert!((grey - 0.214_041).abs() < 1e-5, "{grey}");
    assert_eq!(found.colors, [[1.0; 4], [grey, grey, grey, 1.0], [1.0; 4]]);
    assert_eq!(loaded.scene.materials[0].diffuse, Color::ONE);
    let bytes = clean("v 0 0 0 255 0 0\nv 1 0 0 0 255 0\nv 0 1 0 0 0 255\nf 1 2 3");
    let [red, green, blue] = [0, 1, 2].map(|channel| {
        let mut color = [0.0, 0.0, 0.0, 1.0];
        color[channel] = 1.0;
        color
    });
    assert_eq!(mesh(&bytes, 0).colors, [red, green, blue]);
}

#[test]
fn exponents_with_leading_zeros() {
    let loaded = clean("v 1e-05 0 0\nv 1.0e+005 0 0\nv 0 -2E+00 0\nf 1 2 3");
    let expected = [
        DVec3::new(1e-5, 0.0, 0.0),
        DVec3::new(1e5, 0.0, 0.0),
        DVec3::new(0.0, -2.0, 0.0),
    ];
    assert_eq!(mesh(&loaded, 0).positions, expected);
}

#[test]
fn one_mesh_for_each_name_and_material() {
    let text = format!(
        "mtllib a.mtl\n{TRIANGLE}o first\nusemtl red\nf 1 2 3\ng second thing\nf 3 2 1\nf 1 3 2\n\
         usemtl blue\nf 1 2 3\no first\nusemtl red\nf 2 3 1\nusemtl unused\n"
    );
    let loaded = obj(&text, "newmtl blue\nKd 0 0 1\nnewmtl red\nKd 1 0 0\n").unwrap();
    assert_eq!(loaded.warnings, []);
    let told: Vec<_> = loaded
        .scene
        .objects
        .iter()
        .enumerate()
        .map(|(i, o)| (&*o.name, o.material, mesh(&loaded, i).face_ends.len()))
        .collect();
    assert_eq!(
        told,
        [
            ("first", 0, 2),
            ("second thing", 0, 2),
            ("second thing", 1, 1)
        ]
    );
    let names: Vec<_> = loaded.scene.materials.iter().map(|m| &*m.name).collect();
    assert_eq!(names, ["red", "blue"]);
    assert_eq!(loaded.scene.materials[1].diffuse, Color::Z);
}

#[test]
fn meshes_hold_only_what_their_faces_use() {
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 4 2 3\ng b\nf 2 3 5";
    let loaded = clean(text);
    assert_eq!(
        mesh(&loaded, 0).positions,
        [DVec3::Y, DVec3::ZERO, DVec3::X]
    );
    assert_eq!(mesh(&loaded, 0).corners, [corner(0), corner(1), corner(2)]);
    assert_eq!(
        mesh(&loaded, 1).positions,
        [DVec3::ZERO, DVec3::X, DVec3::splat(5.0)]
    );
}

#[test]
fn vertices_may_follow_their_faces() {
    let loaded = clean(&format!("f 1 2 3\n{TRIANGLE}"));
    assert_eq!(mesh(&loaded, 0).positions.len(), 3);
}

#[test]
fn indices_that_name_nothing_are_refused_with_their_line() {
    for (face, problem) in [
        ("f 1 2 4", "in `f`: index 4 names no `v`: the file has 3"),
        (
            "f 0 1 2",
            "in `f`: index 0 names no `v`; indices count from 1, or backwards from -1",
        ),
        (
            "f -4 -3 -2",
            "in `f`: index -4 names no `v`: only 3 came before",
        ),
        (
            "f 1 2 4294967297",
            "in `f`: index 4294967297 names no `v`: no file has that many",
        ),
        (
            "f 1 2 -9223372036854775808",
            "in `f`: index -9223372036854775808 names no `v`",
        ),
        (
            "f 1 2 x",
            "in `f`: expected corners like 1, 1/2, 1//3 or 1/2/3, found `x`",
        ),
        (
            "f 1 2 3/x",
            "in `f`: expected corners like 1, 1/2, 1//3 or 1/2/3, found `3/x`",
        ),
        (
            "f 1 2 3/1/1/1",
            "in `f`: expected corners like 1, 1/2, 1//3 or 1/2/3, found `3/1/1/1`",
        ),
        (
            "f 1 2 99999999999999999999",
            "in `f`: expected corners like",
        ),
        ("f 1 2 3.0", "in `f`: expected corners like"),
    ] {
        let error = refusal(&format!("{TRIANGLE}{face}\nf 1 2 5"));
        assert!(error.starts_with(&format!("a.obj:4: {problem}")), "{error}");
    }
}

#[test]
fn garbled_vertices_are_refused_with_their_line() {
    let expected = "expected 3 numbers (x y z), 4 (and w), or 6 and more (and a color), found";
    for (text, found) in [
        ("v 1 bleh 2", "`bleh`"),
        ("v 1 2", "the end of the line"),
        ("v 1 2 3 4 5", "5 numbers"),
        ("v 1 2 3 red", "`red`"),
    ] {
        let error = refusal(&format!("# x\n{text}"));
        assert!(
            error.starts_with(&format!("a.obj:2: in `v`: {expected} {found}; help:")),
            "{error}"
        );
    }
    let far = refusal(&format!("{TRIANGLE}v 0 0 1e31\nf 1 2 3\nf 1 2 4"));
    assert!(
        far.starts_with("a.obj:6: in `f`: 1e31 exceeds 2^100"),
        "{far}"
    );
}

#[test]
fn faces_without_area_are_dropped_and_counted() {
    let text =
        format!("{TRIANGLE}v 2 0 0\nf 1\nf 8 7\nf 1 2 4\nf 1 1 2\nf 1 2 3\nf 1 1 2 3\nf 1 2 4");
    let text = text.replace("f 8 7", "f 3 2");
    let loaded = obj(&text, "").unwrap();
    assert_eq!(
        warnings(&loaded),
        [
            "a.obj:5: a face has fewer than 3 corners: dropped (2 times; this is the first)",
            "a.obj:7: a face has no area: dropped (3 times; this is the first)",
        ]
    );
    assert_eq!(mesh(&loaded, 0).face_ends, [3, 7]);
    assert_eq!(mesh(&loaded, 0).positions.len(), 3);
}

#[test]
fn what_is_not_supported_is_said_once() {
    let text = "p 1\nl 1 2\nvp 1\ncurv 0 1 2\nlod 3\nbleh 1\nbleh 2\nvt3 1\ns off\nvt 0 0\n";
    let loaded = obj(text, "").unwrap();
    assert_eq!(
        warnings(&loaded),
        [
            "a.obj:1: points and lines (`p`, `l`) are not read (2 times; this is the first)",
            "a.obj:3: curves and free-form surfaces are not read (2 times; this is the first)",
            "a.obj:5: display attributes are not read",
            "a.obj:6: unknown keyword `bleh`: skipped (2 times; this is the first)",
            "a.obj:8: unknown keyword `vt3`: skipped",
            "a.obj: no faces in the file",
        ]
    );
}

#[test]
fn missing_libraries_and_materials_give_grey() {
    let text =
        format!("mtllib none.mtl\nmtllib a.mtl\nmtllib ./a.mtl\n{TRIANGLE}usemtl x\nf 1 2 3");
    let loaded = obj(&text, "newmtl y").unwrap();
    let texts = warnings(&loaded);
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(texts[0].starts_with("a.obj:1: cannot open the material library `none.mtl`: "));
    assert!(texts[0].ends_with("; grey is used"));
    assert_eq!(
        texts[1],
        "a.obj:8: material `x` is not defined: grey is used"
    );
    assert_eq!(
        loaded.scene.materials[0],
        Material {
            name: "x".into(),
            ..Material::default()
        }
    );
}

#[test]
fn a_library_without_a_name_is_told_as_such() {
    let loaded = obj(&format!("mtllib\n{TRIANGLE}f 1 2 3"), "").unwrap();
    assert_eq!(
        warnings(&loaded),
        ["a.obj:1: `mtllib` names no material library: grey is used"]
    );
}

#[test]
fn a_line_may_name_several_libraries() {
    let text = format!("mtllib b.mtl a.mtl\n{TRIANGLE}usemtl x\nf 1 2 3");
    let loaded = obj(&text, "newmtl x\nKd 1 0 0").unwrap();
    assert_eq!(loaded.scene.materials[0].diffuse, Color::X);
    assert_eq!(warnings(&loaded).len(), 1);
}

#[test]
fn errors_in_a_library_name_the_library() {
    let error = obj("mtllib a.mtl", "newmtl x\nTf red")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("a.mtl:2: in `Tf`: expected 3 numbers"),
        "{error}"
    );
}

#[test]
fn files_are_read_by_their_ending_and_libraries_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.OBJ");
    std::fs::write(
        &path,
        format!("mtllib my lib.mtl\n{TRIANGLE}usemtl a\nf 1 2 3"),
    )
    .unwrap();
    std::fs::write(folder.path().join("my lib.mtl"), "newmtl a\nKd 0 1 0").unwrap();
    let options = ReadOptions {
        up: Some(UpAxis::Z),
        ..ReadOptions::default()
    };
    let loaded = read_file(&path, &options).unwrap();
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.scene.materials[0].diffuse, Color::Y);
    assert_eq!(loaded.scene.up, DVec3::Z);

    std::fs::write(&path, format!("mtllib ../secret.mtl\n{TRIANGLE}f 1 2 3")).unwrap();
    let texts = warnings(&read_file(&path, &options).unwrap());
    assert!(
        texts[0].contains("leads outside the folder of the scene; grey is used"),
        "{texts:?}"
    );
}

#[test]
fn paths_that_cannot_be_read_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let options = ReadOptions::default();
    let refusal = |name: &str| {
        let path = folder.path().join(name);
        let text = read_file(&path, &options).unwrap_err().to_string();
        text.replace(&path.display().to_string(), name)
    };
    assert!(refusal("none.obj").starts_with("none.obj: cannot read the file: "));
    assert_eq!(
        refusal("scene.blend"),
        "scene.blend: no reader for `.blend`; expected a name that ends in .nff, .obj, .gltf, .glb, \
         .ply or .stl; help: convert the scene to NFF, OBJ, glTF, PLY or STL"
    );
    assert!(refusal("scene").contains("no reader for a name without an ending"));
    std::fs::create_dir(folder.path().join("folder.nff")).unwrap();
    assert!(refusal("folder.nff").starts_with("folder.nff: this is not a regular file"));
    std::fs::write(folder.path().join("big.nff"), "").unwrap();
    let big = std::fs::OpenOptions::new()
        .write(true)
        .open(folder.path().join("big.nff"))
        .unwrap();
    // A sparse file: it takes no space.
    big.set_len((4 << 30) + 1).unwrap();
    assert!(refusal("big.nff").contains("has 4294967297 bytes, more than the 4294967296"));
}
