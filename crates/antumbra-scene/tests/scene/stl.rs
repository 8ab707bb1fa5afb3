//! STL in both forms, statement by statement and error by error.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadError, ReadOptions, UpAxis,
    model::{Facing, Material, Mesh, Shape},
    read::read_stl,
};

fn stl(bytes: impl AsRef<[u8]>) -> Result<Loaded, ReadError> {
    read_stl(Path::new("a.stl"), bytes.as_ref(), &ReadOptions::default())
}

fn mesh(loaded: &Loaded, index: usize) -> &Mesh {
    match &loaded.scene.objects[index].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn warnings(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

fn facet(vertices: [&str; 3]) -> String {
    let [a, b, c] = vertices;
    format!(
        "  facet normal 0 0 0\n    outer loop\n      vertex {a}\n      vertex {b}\n      \
         vertex {c}\n    endloop\n  endfacet\n"
    )
}

const CORNERS: [&str; 3] = ["0 0 0", "1 0 0", "0 1 0"];

type Triangle = [[f32; 3]; 3];

fn binary(header: &str, triangles: &[Triangle], attributes: u16) -> Vec<u8> {
    let mut bytes = format!("{header:80}").into_bytes();
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        for number in [[f32::NAN; 3]].iter().chain(triangle).flatten() {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(attributes.to_le_bytes());
    }
    bytes
}

const TRIANGLES: [Triangle; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    [[1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [-0.0, 1.0, 0.0]],
];

#[test]
fn corners_at_one_position_are_one_vertex() {
    let loaded = stl(binary("made by a test", &TRIANGLES, 0)).unwrap();
    assert_eq!(loaded.warnings, []);
    let mesh = mesh(&loaded, 0);
    assert_eq!(mesh.positions.len(), 4, "-0 is 0");
    let corners: Vec<_> = mesh.corners.iter().map(|corner| corner.position).collect();
    assert_eq!(corners, [0, 1, 2, 1, 3, 2]);
    assert_eq!(mesh.normals, [], "normals are not read, not even bad ones");
    assert_eq!(loaded.scene.up, DVec3::Z);
    assert_eq!(loaded.scene.facing, Facing::Viewer);
    assert_eq!(loaded.scene.materials, [Material::default()]);
    let options = ReadOptions {
        up: Some(UpAxis::Y),
        ..ReadOptions::default()
    };
    let bytes = binary("", &TRIANGLES, 0);
    let turned = read_stl(Path::new("a"), &bytes, &options);
    assert_eq!(turned.unwrap().scene.up, DVec3::Y);
}

#[test]
fn solids_are_objects_and_empty_ones_are_none() {
    let text = format!(
        "solid first\n{0}endsolid first\n\nsolid empty\nendsolid\nSOLID  second one \r\n{1}{0}\
         EndSolid second\n",
        facet(CORNERS),
        facet(["1 0 0", "0 0 1", "0 1 0"]).to_ascii_uppercase(),
    );
    let loaded = stl(&text).unwrap();
    assert_eq!(loaded.warnings, []);
    let names: Vec<_> = loaded.scene.objects.iter().map(|o| &*o.name).collect();
    assert_eq!(names, ["first", "second one"]);
    assert_eq!(mesh(&loaded, 0).face_ends, [3]);
    assert_eq!(mesh(&loaded, 1).face_ends, [3, 6]);
    assert_eq!(mesh(&loaded, 1).positions.len(), 4);
    assert_eq!(loaded.scene.materials.len(), 1);
    // Line breaks of all kinds, a byte order mark, a name that is not UTF-8.
    let other = text.replace("\r\n", "\n").replace('\n', "\r");
    assert_eq!(stl(&other).unwrap().scene, loaded.scene);
    let marked = format!("\u{feff}{text}");
    assert_eq!(stl(&marked).unwrap().scene, loaded.scene);
    let latin = [b"solid \xe9\n", facet(CORNERS).as_bytes(), b"endsolid\n"].concat();
    assert_eq!(stl(latin).unwrap().scene.objects[0].name, "\u{fffd}");
}

#[test]
fn binary_files_may_begin_with_solid() {
    let expected = stl(binary("", &TRIANGLES, 0)).unwrap().scene;
    let header = "solid a\nfacet normal 0 0 0\nouter loop\n";
    let mut bytes = binary(header, &TRIANGLES, 0);
    assert_eq!(stl(&bytes).unwrap().scene, expected);
    bytes.extend(b"xyz");
    let loaded = stl(&bytes).unwrap();
    assert_eq!(loaded.scene, expected);
    assert_eq!(
        warnings(&loaded),
        ["a.stl: byte 184: 3 bytes after the last triangle are not read"]
    );
}

#[test]
fn what_is_not_used_is_told() {
    let degenerate = [TRIANGLES[0], [[1.0, 2.0, 3.0]; 3]];
    assert_eq!(
        warnings(&stl(binary("", &degenerate, 5)).unwrap()),
        [
            "a.stl: byte 132: attributes (colors) of triangles are not read \
             (2 times; this is the first)",
            "a.stl: byte 134: a face has no area: dropped"
        ]
    );
    let flat = facet(["0 0 0", "1 1 1", "2 2 2"]);
    let loaded = stl(format!("solid\n{flat}")).unwrap();
    assert_eq!(
        warnings(&loaded),
        [
            "a.stl:8: the last solid has no `endsolid`",
            "a.stl:2: a face has no area: dropped",
            "a.stl: no faces in the file"
        ]
    );
    assert_eq!(
        (loaded.scene.objects.len(), loaded.scene.materials.len()),
        (0, 0)
    );
    assert_eq!(
        warnings(&stl(binary("", &[], 0)).unwrap()),
        ["a.stl: no faces in the file"]
    );
}

#[test]
fn errors_in_text_name_their_line() {
    let good = facet(CORNERS);
    for (from, to, reason) in [
        (
            "vertex 1 0 0",
            "vertex 1 0",
            "a.stl:5: in `vertex`: expected 3 numbers (x y z), found the end of the line",
        ),
        (
            "vertex 1 0 0",
            "vertex 1 0 0 0",
            "a.stl:5: in `vertex`: expected 3 numbers (x y z), found `0`",
        ),
        (
            "vertex 1 0 0",
            "vertex 1 x 0",
            "a.stl:5: in `vertex`: expected 3 numbers (x y z), found `x`",
        ),
        (
            "vertex 1 0 0",
            "vertex 1 1e31 0",
            "a.stl:2: in `vertex`: 1e31 exceeds 2^100 (1.27e30)",
        ),
        (
            "vertex 1 0 0",
            "endloop",
            "a.stl:5: expected `vertex` (3 to a facet), found `endloop`",
        ),
        (
            "endloop",
            "vertex 1 1 1",
            "a.stl:7: expected `endloop` after 3 vertices, found `vertex 1 1 1`",
        ),
        (
            "outer loop",
            "outer",
            "a.stl:3: expected `outer loop`, found `outer`",
        ),
        (
            "endfacet",
            "",
            "a.stl:9: expected `endfacet`, found `endsolid`",
        ),
        (
            "facet normal",
            "face",
            "a.stl:2: expected `facet` or `endsolid`, found `face 0 0 0`",
        ),
        (
            "endsolid",
            "endsolid\nfacet",
            "a.stl:10: expected `solid`, found `facet`",
        ),
        (
            "  endfacet\nendsolid",
            "",
            "a.stl:7: expected `endfacet`, found the end of the file; help: the file may be cut short",
        ),
    ] {
        let text = format!("solid\n{good}endsolid").replacen(from, to, 1);
        let error = stl(&text).unwrap_err().to_string();
        assert!(error.contains(reason), "{text}: {error}");
    }
}

#[test]
fn errors_in_bytes_name_their_byte() {
    let refusal = |bytes: &[u8]| stl(bytes).unwrap_err().to_string();
    let bytes = binary("", &TRIANGLES, 0);
    assert_eq!(
        refusal(&bytes[..183]),
        "a.stl: byte 183: expected 2 triangles, 184 bytes, found the end of the file after 1 \
         triangles; help: the file may be cut short, or no STL at all"
    );
    assert!(
        refusal(b"abc").starts_with("a.stl: byte 0: expected STL: text that begins with `solid`")
    );
    assert!(refusal(b"").contains("found 0 bytes that are neither"));
    let mut triangles = TRIANGLES;
    triangles[1][2][1] = 2e30;
    let error = refusal(&binary("", &triangles, 0));
    assert!(
        error.contains("a.stl: byte 134: in `vertex`: 2.000000"),
        "{error}"
    );
    let mut claim = bytes;
    claim[80..84].copy_from_slice(&[0xff; 4]);
    assert!(refusal(&claim).contains("expected 4294967295 triangles, 214748364834 bytes"));
    assert!(refusal(b"version https://git-lfs.github.com/spec/v1\noid").contains("git lfs pull"));
}
