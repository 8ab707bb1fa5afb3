//! PLY, header line by header line and error by error.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadError, ReadOptions, UpAxis,
    model::{Color, Corner, Facing, Material, Mesh, Shape},
    read::read_ply,
};

use crate::support::Random;

pub(crate) fn ply(bytes: impl AsRef<[u8]>) -> Result<Loaded, ReadError> {
    read_ply(Path::new("a.ply"), bytes.as_ref(), &ReadOptions::default())
}

fn mesh(loaded: &Loaded) -> &Mesh {
    match &loaded.scene.objects[0].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

pub(crate) fn refusal(bytes: impl AsRef<[u8]>) -> String {
    ply(bytes).unwrap_err().to_string()
}

pub(crate) fn warnings(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

pub(crate) const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

/// Three vertices in a plane and one face, with the header's middle as given.
pub(crate) fn triangle(header: &str, body: &str) -> String {
    format!("ply\nformat ascii 1.0\n{header}end_header\n{body}")
}

pub(crate) fn plain(body: &str) -> String {
    let header =
        format!("element vertex 3\n{XYZ}element face 1\nproperty list uchar int vertex_indices\n");
    triangle(&header, body)
}

#[test]
fn the_scene_has_what_the_format_leaves_open() {
    let text = plain("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let loaded = ply(&text).unwrap();
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.scene.facing, Facing::Viewer);
    assert_eq!(loaded.scene.up, DVec3::Z);
    assert_eq!(loaded.scene.ambient, Color::splat(0.2));
    assert_eq!(loaded.scene.materials, [Material::default()]);
    let options = ReadOptions {
        up: Some(UpAxis::Y),
        ..ReadOptions::default()
    };
    let turned = read_ply(Path::new("a"), text.as_bytes(), &options);
    assert_eq!(turned.unwrap().scene.up, DVec3::Y);
    let mesh = mesh(&loaded);
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(mesh.corners, [0, 1, 2].map(Corner::at));
    assert_eq!(mesh.face_ends, [3]);
}

/// A scene as a list of numbers, written in every encoding, line break, order and type.
struct Writer<'r> {
    encoding: usize,
    random: &'r mut Random,
    out: Vec<u8>,
}

impl Writer<'_> {
    const ENCODINGS: [&'static str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];
    const INTEGERS: [&'static str; 6] = ["char", "uint8", "short", "ushort", "int32", "uint"];
    const ALL: [&'static str; 8] = [
        "int8", "uchar", "int16", "uint16", "int", "uint32", "float32", "double",
    ];

    fn integer_type(&mut self) -> &'static str {
        Self::INTEGERS[self.random.below(6)]
    }

    fn number(&mut self, kind: &str, value: f64) {
        if self.encoding == 0 {
            self.out.extend(format!("{value} ").bytes());
            return;
        }
        let mut bytes = match kind {
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float32" => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if self.encoding == 2 {
            bytes.reverse();
        }
        self.out.extend(bytes);
    }

    fn end_element(&mut self) {
        if self.encoding == 0 {
            self.out.push(b'\n');
        }
    }
}

/// Every mixture of orders, types, extra properties and encodings gives the same mesh.
#[test]
fn all_spellings_of_a_file_agree() {
    let positions = [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 1], [2, 2, 5]];
    let faces: [&[u32]; 3] = [&[0, 1, 2, 3], &[0, 1, 4], &[4, 3, 2]];
    let mut random = Random(3);
    let mut expected: Option<Mesh> = None;
    for round in 0..600 {
        let encoding = round % 3;
        let mut writer = Writer {
            encoding,
            random: &mut random,
            out: Vec::new(),
        };
        let line_break = ["\n", "\r\n", "\r"][writer.random.below(3)];
        let index_name = ["vertex_indices", "vertex_index"][writer.random.below(2)];
        // Each property: name, type, list count type or nothing.
        let mut vertex: Vec<(&str, &str, Option<&str>)> = ["x", "y", "z"]
            .map(|name| (name, Writer::ALL[writer.random.below(8)], None))
            .to_vec();
        let extra = [
            ("red", "uchar", None),
            ("weights", "double", Some("ushort")),
            ("nx", "float32", None),
        ];
        for property in &extra[..writer.random.below(4)] {
            let at = writer.random.below(vertex.len() + 1);
            vertex.insert(at, *property);
        }
        let mut face = vec![(
            index_name,
            writer.integer_type(),
            Some(writer.integer_type()),
        )];
        for property in &extra[..writer.random.below(3)] {
            let at = writer.random.below(face.len() + 1);
            face.insert(at, *property);
        }
        let edge = vec![("vertex1", "int", None), ("list", "float32", Some("uchar"))];
        let mut elements = vec![
            ("vertex", positions.len(), vertex),
            ("face", faces.len(), face),
            ("edge", 2, edge),
            ("nothing", 4_000_000_000, vec![]),
        ];
        for i in 0..4 {
            let other = writer.random.below(4);
            elements.swap(i, other);
        }
        let mut header = format!("ply\nformat {} 1.0\n", Writer::ENCODINGS[encoding]);
        header += "comment format of nothing\nobj_info \u{e9}\n\n";
        for (name, count, properties) in &elements {
            header += &format!("element {name} {count}\n");
            for (name, kind, list) in properties {
                header += &match list {
                    Some(count) => format!("property list {count} {kind} {name}\n"),
                    None => format!("property {kind} {name}\n"),
                };
            }
        }
        header += "end_header\n";
        for (name, count, properties) in &elements {
            if properties.is_empty() {
                continue;
            }
            for index in 0..*count {
                for (property, kind, list) in properties {
                    let values: Vec<f64> = match (*name, *property) {
                        ("vertex", "x") => vec![positions[index][0].into()],
                        ("vertex", "y") => vec![positions[index][1].into()],
                        ("vertex", "z") => vec![positions[index][2].into()],
                        ("face", "vertex_indices" | "vertex_index") => {
                            faces[index].iter().map(|&corner| corner.into()).collect()
                        }
                        _ if list.is_some() => vec![7.0; writer.random.below(4)],
                        _ => vec![9.0],
                    };
                    if let Some(count) = list {
                        writer.number(count, values.len() as f64);
                    }
                    for value in values {
                        writer.number(kind, value);
                    }
                }
                writer.end_element();
            }
        }
        let mut bytes = header.replace('\n', line_break).into_bytes();
        bytes.extend(&writer.out);
        let loaded = ply(&bytes)
            .unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(&bytes)));
        let mesh = mesh(&loaded);
        assert_eq!(mesh, expected.get_or_insert_with(|| mesh.clone()));
        assert!(
            warnings(&loaded)
                .iter()
                .any(|w| w.contains("element `edge` is not read"))
        );
        // Whatever is cut off is missed.
        let cut = random.below(bytes.len());
        let error = ply(&bytes[..cut]).err().map(|error| error.to_string());
        let is_white = bytes[cut..].iter().all(u8::is_ascii_whitespace);
        // Half a number may still be one, in text.
        assert!(error.is_some() || is_white || encoding == 0, "{cut}");
    }
    assert_eq!(expected.unwrap().face_ends, [4, 7, 10]);
}

#[test]
fn normals_are_read_if_there_are_three_and_zero_is_none() {
    let header = format!(
        "element vertex 3\n{XYZ}property float nx\nproperty float ny\nproperty float nz\n\
         element face 1\nproperty list uchar int vertex_indices\n"
    );
    let body = "0 0 0 0 0 1\n1 0 0 0 0 0\n0 1 0 0 0 2\n3 0 1 2\n";
    let loaded = ply(triangle(&header, body)).unwrap();
    assert_eq!(loaded.warnings, []);
    let mesh = mesh(&loaded);
    assert_eq!(mesh.normals, [DVec3::Z, 2.0 * DVec3::Z]);
    let normals: Vec<_> = mesh.corners.iter().map(|corner| corner.normal).collect();
    assert_eq!(normals, [0, Corner::NONE, 1]);
    let short = header.replace("property float nz\n", "");
    let loaded = ply(triangle(
        &short,
        "0 0 0 0 0\n1 0 0 0 0\n0 1 0 0 0\n3 0 1 2\n",
    ))
    .unwrap();
    assert_eq!(
        warnings(&loaded),
        ["a.ply:3: properties of `vertex` that are not read: `nx`, `ny`"]
    );
    let huge = "0 0 0 0 0 1e31\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n";
    let loaded = ply(triangle(&header, huge)).unwrap();
    assert_eq!(
        warnings(&loaded),
        ["a.ply:13: a normal is not finite or exceeds 2^100: none is used"]
    );
}

/// `float` in text means what it means in bytes.
#[test]
fn text_is_rounded_to_its_type() {
    let text = plain("0.1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let loaded = ply(&text).unwrap();
    assert_eq!(mesh(&loaded).positions[0].x, f64::from(0.1_f32));
    let loaded = ply(text.replace("float x", "double x")).unwrap();
    assert_eq!(mesh(&loaded).positions[0].x, 0.1);
}

#[test]
fn faces_without_area_or_corners_are_dropped() {
    let header =
        format!("element vertex 3\n{XYZ}element face 5\nproperty list uchar int vertex_indices\n");
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 1\n2 0 1\n0\n4 0 1 0 1\n";
    let loaded = ply(triangle(&header, body)).unwrap();
    assert_eq!(mesh(&loaded).face_ends, [3]);
    assert_eq!(
        warnings(&loaded),
        [
            "a.ply:15: a face has fewer than 3 corners: dropped (2 times; this is the first)",
            "a.ply:14: a face has no area: dropped (2 times; this is the first)"
        ]
    );
}

#[test]
fn files_without_faces_are_empty_scenes() {
    for text in [
        triangle(&format!("element vertex 1\n{XYZ}"), "1 2 3\n"),
        plain("0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
    ] {
        let loaded = ply(text).unwrap();
        assert_eq!(
            (loaded.scene.objects.len(), loaded.scene.materials.len()),
            (0, 0)
        );
        assert!(warnings(&loaded).contains(&"a.ply: no faces in the file".to_owned()));
    }
}

#[test]
fn what_follows_is_told() {
    let loaded = ply(plain("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\n 7")).unwrap();
    assert_eq!(
        warnings(&loaded),
        ["a.ply:15: there is more after the last element: not read"]
    );
}
