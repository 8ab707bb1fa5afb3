//! Faults on which no shadow depends: said once for each kind, with a count, and passed over.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions,
    model::{Corner, Mesh, Shape},
    read::{read_nff, read_obj, read_ply, read_stl},
};

use crate::support::{nff, obj};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

fn mesh(loaded: &Loaded) -> &Mesh {
    match &loaded.scene.objects[0].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn warnings(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

fn ply(bytes: &[u8]) -> Loaded {
    read_ply(Path::new("a.ply"), bytes, &ReadOptions::default()).unwrap()
}

fn stl(bytes: &[u8]) -> Loaded {
    read_stl(Path::new("a.stl"), bytes, &ReadOptions::default()).unwrap()
}

#[test]
fn latin_1_in_comments_and_names_of_obj_and_mtl() {
    let text = [
        b"# caf\xe9\nmtllib a.mtl\n".as_slice(),
        TRIANGLE.as_bytes(),
        b"o gr\xfcn\nusemtl gr\xfcn\nf 1 2 3\n",
    ]
    .concat();
    let library = b"# \xe9\nnewmtl gr\xfcn\nKd 0 1 0\n";
    let open = &mut |_: &str| Ok(library.to_vec());
    let loaded = read_obj(Path::new("a.obj"), &text, &ReadOptions::default(), open).unwrap();
    assert_eq!(loaded.scene.objects[0].name, "gr\u{fc}n");
    assert_eq!(loaded.scene.materials[0].diffuse, DVec3::Y);
    let said = "the text is not all UTF-8: other bytes are read as Latin-1";
    assert_eq!(
        warnings(&loaded),
        [format!("a.obj:1: {said}"), format!("a.mtl:1: {said}")]
    );
}

/// The second byte of a character in Shift-JIS may be that of a backslash.
#[test]
fn shift_jis_names_do_not_swallow_the_next_line() {
    let text = [
        b"mtllib a.mtl\n".as_slice(),
        TRIANGLE.as_bytes(),
        b"usemtl \x95\x5c\nf 1 2 3\nusemtl \x83\x5c\nf 3 2 1\n",
    ]
    .concat();
    let library = b"newmtl \x95\x5c\nKd 1 0 0\nnewmtl \x83\x5c\nKd 0 1 0\n";
    let open = &mut |_: &str| Ok(library.to_vec());
    let loaded = read_obj(Path::new("a.obj"), &text, &ReadOptions::default(), open).unwrap();
    let colors: Vec<_> = loaded.scene.materials.iter().map(|m| m.diffuse).collect();
    assert_eq!(colors, [DVec3::X, DVec3::Y]);
}

#[test]
fn latin_1_in_comments_of_nff() {
    let loaded = read_nff(Path::new("a.nff"), b"# \xe9\ns 0 0 0 1\n").unwrap();
    assert_eq!(loaded.scene.objects.len(), 1);
    assert!(warnings(&loaded)[0].starts_with("a.nff:1: the text is not all UTF-8"));
}

#[test]
fn normals_of_obj_that_are_not_finite() {
    let text = format!(
        "{TRIANGLE}vn nan nan nan\nvn 0 0 1\nvn -1.#IND 0 inf\nvn 0 x 1\nvn 1\nf 1//1 2//2 3//3"
    );
    let loaded = obj(&text, "").unwrap();
    assert_eq!(
        warnings(&loaded),
        [
            "a.obj:4: a normal is no 3 finite numbers of at most 2^100: none is used (4 times; this is the first)"
        ]
    );
    assert_eq!(mesh(&loaded).normals, [DVec3::ZERO, DVec3::Z, DVec3::ZERO]);
}

#[test]
fn normals_of_obj_that_are_not_there() {
    for face in [
        "f 1//1 2//1 3//1",
        "f 1//0 2//0 3//0",
        "f 1/1/-1 2/1/-1 3/1/-1",
        "f 1/5/9 2/5/9 3/5/9",
    ] {
        let loaded = obj(&format!("{TRIANGLE}{face}"), "").unwrap();
        assert_eq!(mesh(&loaded).corners, [0, 1, 2].map(Corner::at), "{face}");
        assert_eq!(
            warnings(&loaded),
            [
                "a.obj:4: a face names a normal that is not there: none is used \
              (3 times; this is the first)"
            ],
            "{face}"
        );
    }
}

#[test]
fn diffuse_colors_of_mtl_that_are_not_finite() {
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3");
    let loaded = obj(&text, "newmtl a\nKd nan nan nan\n").unwrap();
    assert_eq!(warnings(&loaded), ["a.mtl:2: `Kd` is not finite: ignored"]);
    assert!(loaded.scene.materials[0].diffuse.is_finite());
}

#[test]
fn vertices_that_no_face_uses_may_be_anything() {
    for odd in ["nan 0 0", "0 inf 0", "0 0 1e999", "1e35 0 0", "-1.#IND 0 0"] {
        let loaded = obj(&format!("v {odd}\n{TRIANGLE}f 2 3 4"), "").unwrap();
        assert_eq!(warnings(&loaded), [""; 0], "{odd}");
        let text = ply_text(4, 1, &format!("{odd}\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n"));
        let loaded = ply(text.as_bytes());
        assert_eq!(warnings(&loaded), [""; 0], "{odd}");
        assert_eq!(mesh(&loaded).positions.len(), 3);
    }
}

fn ply_text(vertices: usize, faces: usize, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nelement face {faces}\nproperty list uchar int vertex_indices\n\
         end_header\n{body}"
    )
}

#[test]
fn faces_with_a_corner_that_is_not_finite_are_dropped_and_counted() {
    let dropped = "a face has a corner that is not finite: dropped (2 times; this is the first)";
    let text = format!("{TRIANGLE}v nan 0 0\nf 1 2 3\nf 1 2 4\nf 4 2 3 1");
    let loaded = obj(&text, "").unwrap();
    assert_eq!(warnings(&loaded), [format!("a.obj:6: {dropped}")]);
    assert_eq!(mesh(&loaded).face_ends, [3]);
    assert_eq!(mesh(&loaded).positions.len(), 3);

    let text = ply_text(
        4,
        3,
        "0 0 0\n1 0 0\n0 1 0\nnan 0 0\n3 0 1 2\n3 0 1 3\n3 3 1 2\n",
    );
    let loaded = ply(text.as_bytes());
    assert_eq!(warnings(&loaded), [format!("a.ply:15: {dropped}")]);
    assert_eq!(mesh(&loaded).face_ends, [3]);

    let facet = |x: &str| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex {x} 0 0\nvertex 0 1 0\nendloop\n\
             endfacet\n"
        )
    };
    let text = format!(
        "solid a\n{}{}{}endsolid a\n",
        facet("1"),
        facet("nan"),
        facet("-inf")
    );
    let loaded = stl(text.as_bytes());
    assert_eq!(warnings(&loaded), [format!("a.stl:9: {dropped}")]);
    assert_eq!(mesh(&loaded).face_ends, [3]);

    let mut bytes = vec![0; 80];
    bytes.extend(3_u32.to_le_bytes());
    for x in [1.0, f32::NAN, f32::INFINITY] {
        let corners = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, x, 0.0, 0.0, 0.0, 1.0, 0.0];
        bytes.extend(corners.iter().flat_map(|number: &f32| number.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    let loaded = stl(&bytes);
    assert_eq!(warnings(&loaded), [format!("a.stl: byte 134: {dropped}")]);
    assert_eq!(mesh(&loaded).face_ends, [3]);

    let loaded =
        nff("p 3 0 0 0 1 0 0 0 1 0\np 3 nan 0 0 1 0 0 0 1 0\np 3 0 0 inf 1 0 0 0 1 0").unwrap();
    assert_eq!(warnings(&loaded)[0], format!("a.nff:2: {dropped}"));
    assert_eq!(loaded.scene.objects.len(), 1);
}

#[test]
fn normals_of_ply_that_are_not_finite() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n";
    let body = "0 0 0 nan nan nan\n1 0 0 0 0 1\n0 1 0 -nan 0 0\n3 0 1 2\n";
    let loaded = ply(format!("{header}{body}").as_bytes());
    assert_eq!(mesh(&loaded).normals, [DVec3::Z]);
    assert_eq!(
        warnings(&loaded),
        [
            "a.ply:13: a normal is not finite or exceeds 2^100: none is used (2 times; this is the first)"
        ]
    );
}

#[test]
fn properties_of_ply_that_are_declared_twice() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let body = "0 0 0 255 0 0 9\n1 0 0 255 0 0 9\n0 1 0 255 0 0 9\n3 0 1 2\n";
    let loaded = ply(format!("{header}{body}").as_bytes());
    assert_eq!(mesh(&loaded).colors, [[1.0, 0.0, 0.0, 1.0]; 3]);
    assert_eq!(
        warnings(&loaded),
        [
            "a.ply:10: property `red` is declared again: the first one counts",
            "a.ply:3: properties of `vertex` that are not read: `red`",
        ]
    );
}

#[test]
fn text_stl_with_comments_and_with_end_solid() {
    let facet = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n \
        end loop\nend facet\n";
    for text in [
        format!("solid a\n{facet}end solid a\n"),
        format!("# made by hand\n#\n\nsolid a\n# one\n{facet}endsolid a\n# over\n"),
        format!("#solid\r\nsolid a\r\n{facet}END SOLID a"),
    ] {
        let loaded = stl(text.as_bytes());
        assert_eq!(loaded.warnings, [], "{text}");
        assert_eq!(loaded.scene.objects[0].name, "a");
        assert_eq!(mesh(&loaded).face_ends, [3]);
    }
}

#[test]
fn triangle_strips_of_ply() {
    let vertices = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
    let positions = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    let head = format!("ply\nformat ascii 1.0\n{vertices}{strips}end_header\n{positions}");
    // The second triangle winds the other way round; -1 begins anew, doubled corners lead on.
    for (indices, expected) in [
        ("5 0 1 2 3 4", &[[0, 1, 2], [2, 1, 3], [2, 3, 4]][..]),
        ("8 0 1 2 3 -1 2 3 4", &[[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
        ("8 0 1 2 -1 -1 2 3 4", &[[0, 1, 2], [2, 3, 4]]),
        ("7 0 1 2 2 3 3 4", &[[0, 1, 2]]),
        ("4 0 1 2 -1", &[[0, 1, 2]]),
    ] {
        let loaded = ply(format!("{head}{indices}\n").as_bytes());
        let mesh = mesh(&loaded);
        let all: Vec<DVec3> = positions
            .lines()
            .map(|line| {
                let numbers: Vec<f64> = line.split(' ').map(|n| n.parse().unwrap()).collect();
                DVec3::from_slice(&numbers)
            })
            .collect();
        let found: Vec<Vec<usize>> = mesh
            .faces()
            .map(|face| {
                let place = |c: &Corner| mesh.positions[c.position as usize];
                let number = |c: &Corner| all.iter().position(|p| *p == place(c)).unwrap();
                face.iter().map(number).collect()
            })
            .collect();
        assert_eq!(found, expected, "{indices}");
        // All wind alike.
        for face in mesh.faces() {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[face[i].position as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "{indices}");
        }
        assert_eq!(loaded.warnings, [], "{indices}");
    }
    let text = format!("{head}4 0 1 2 7\n");
    let refused = read_ply(Path::new("a.ply"), text.as_bytes(), &ReadOptions::default());
    let error = refused.unwrap_err().to_string();
    assert!(
        error.contains("in `tristrips`: `vertex_indices`: index 7 names no vertex"),
        "{error}"
    );
}

#[test]
fn colors_of_ply_vertices() {
    let head = |kind: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\nproperty {kind} red\nproperty {kind} green\nproperty {kind} blue\n\
             property {kind} alpha\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    for (kind, full, body) in [
        (
            "uchar",
            "255",
            "0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2\n",
        ),
        (
            "float",
            "1",
            "0 0 0 1 0 0 1\n1 0 0 0 1 0 1\n0 1 0 0 0 1 1\n3 0 1 2\n",
        ),
    ] {
        let loaded = ply(format!("{}{body}", head(kind)).as_bytes());
        assert_eq!(loaded.warnings, [], "{full}");
        let expected = [
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 1.0],
            [0.0, 0.0, 1.0, 1.0],
        ];
        assert_eq!(mesh(&loaded).colors, expected);
        assert_eq!(loaded.scene.materials[0].diffuse, DVec3::ONE);
    }
    let clear = "0 0 0 255 0 0 0\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2\n";
    let loaded = ply(format!("{}{clear}", head("uchar")).as_bytes());
    assert!(loaded.scene.materials[0].is_opaque());
    assert_eq!(
        warnings(&loaded),
        ["a.ply:14: alpha of vertices is not used: all faces are opaque"]
    );
}

#[test]
fn polygons_too_small_for_products_keep_their_faces() {
    for size in ["1e-170", "1e-43", "5e-324"] {
        for plane in ["0", "1e6"] {
            let text = format!(
                "v {plane} 0 0\nv {plane} {size} 0\nv {plane} {size} {size}\nv {plane} 0 {size}\nf 1 2 3 4"
            );
            let loaded = obj(&text, "").unwrap();
            assert_eq!(loaded.warnings, [], "{size} at {plane}");
            assert_eq!(mesh(&loaded).face_ends, [4]);
        }
    }
}
