//! glTF whose geometry is compressed: bytes by the reference encoders, and what their decoders make of
//! them (npm `draco3d` 1.5.7, `meshoptimizer`); and bytes that were damaged.

use std::time::{Duration, Instant};

use antumbra_scene::{ReadOptions, read::read_gltf};
use base64::{Engine as _, engine::general_purpose::STANDARD as BASE64};

use crate::{
    gltf::{faces, gltf, mesh, refusal},
    gltf_shared::check,
    support::Random,
};

/// A roof of 2 x 2 squares with a top of 1 in the middle, in Draco: by edgebreaker, 8 bits a coordinate.
const EDGEBREAKER: &str = "RFJBQ08CAgEBAAAACQgCCAEAA+/TGv8BEf8CiED/AohAA/8AAQAAAAEAAAEACQMAAAIBAwkCAAECAQICBAACAQEBAQEFgAKNI2EC////62ECYQJVFQj5yLNC+d5LgAAAAAD/AAAAAAAAAAAAAAAAAAAAAAAAQAgFAQEACwM5Dhc5Dh0HdRwEa+7dXv///7//AMcAHgJMAADGAToCBwAAACUD9QWBAAAAAP8DAAAAAAAAAAAAAAAAgD8KAQEBAQX+AcUxkQP///8TkQNVBc/JAQgaZSE9iktfgQAAAAD/AAAA";
/// The same in order, positions not rounded.
const SEQUENTIAL: &str = "RFJBQ08CAgEAAAAICQEAAQMBBAMBAgQCBQQDBAYEBwYEBQcFCAcBAwAJAwAAAwkCAAECAgQAAgACAQAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAEAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AACAPwAAAEAAAIA/AAAAAAAAAAAAAABAAAAAAAAAgD8AAABAAAAAAAAAAEAAAABAAAAAAAAAAQALAx0HH+U4AwTghfwPgP8ACPD//wD4D4AA/v8PgP8AAAAAAAD/AwAAAAEBAQH/AcUhkQP/t5ED/1s5Ds9VBZEDCziffnE2nXJDMSGeAAAAAP8AAAAAAAAAAAAAAAAAgD8K";
/// Corners of the triangles in order, as indices of the vertices row by row.
const ROOF: [u32; 24] = [
    0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4, 3, 4, 6, 4, 7, 6, 4, 5, 7, 5, 8, 7,
];

fn bytes(base64: &str) -> Vec<u8> {
    BASE64.decode(base64).unwrap()
}

fn draco(length: usize, count: usize) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["KHR_draco_mesh_compression"],
        "buffers": [{{"uri": "a.bin", "byteLength": {length}}}],
        "bufferViews": [{{"buffer": 0, "byteLength": {length}}}],
        "accessors": [{{"componentType": 5123, "count": {count}, "type": "SCALAR"}},
            {{"componentType": 5126, "count": 9, "type": "VEC3"}},
            {{"componentType": 5121, "normalized": true, "count": 9, "type": "VEC4"}}],
        "meshes": [{{"primitives": [{{"indices": 0, "attributes": {{"POSITION": 1, "COLOR_0": 2}},
            "extensions": {{"KHR_draco_mesh_compression": {{"bufferView": 0,
                "attributes": {{"POSITION": 0, "COLOR_0": 2}}}}}}}}]}}],
        "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}]}}"#
    )
}

/// Triangles that begin at their least corner, sorted: the order is the encoder's.
fn sorted(faces: Vec<[[f64; 3]; 3]>) -> Vec<[[f64; 3]; 3]> {
    let turned = |mut face: [[f64; 3]; 3]| {
        let least = (0..3).min_by(|&a, &b| face[a].partial_cmp(&face[b]).unwrap());
        face.rotate_left(least.unwrap());
        face
    };
    let mut faces: Vec<_> = faces.into_iter().map(turned).collect();
    faces.sort_by(|a, b| a.partial_cmp(b).unwrap());
    faces
}

/// The roof's triangles with corners at `at(x, y)`.
fn roof(at: impl Fn(usize, usize) -> [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    let (triangles, _) = ROOF.as_chunks::<3>();
    let triangle = |corners: &[u32; 3]| corners.map(|c| at(c as usize % 3, c as usize / 3));
    triangles.iter().map(triangle).collect()
}

#[test]
fn draco_gives_the_triangles_of_the_reference_decoder() {
    // What eight bits leave of 1 out of 0 to 2, in the reference decoder's 32 bits.
    let near = f64::from(1.003_921_6_f32);
    for (data, one) in [(EDGEBREAKER, near), (SEQUENTIAL, 1.0)] {
        let data = bytes(data);
        let loaded = gltf(&draco(data.len(), 24), &data).unwrap();
        assert_eq!(loaded.warnings, []);
        let mesh = mesh(&loaded);
        let along = |i: usize| [0.0, one, 2.0][i];
        let at = |x, y| [along(x), along(y), if (x, y) == (1, 1) { one } else { 0.0 }];
        assert_eq!(sorted(faces(mesh)), sorted(roof(at)));
        // Colors belong to their vertices.
        for (position, color) in mesh.positions.iter().zip(&mesh.colors) {
            let alpha = if position.x == 2.0 {
                128.0 / 255.0
            } else {
                1.0
            };
            let [red, green] = [position.x, position.y].map(|x| (x.round() * 100.0 / 255.0) as f32);
            assert_eq!(*color, [red, green, 1.0, alpha as f32]);
        }
    }
}

#[test]
fn draco_that_holds_more_than_its_accessors_say_is_refused() {
    let data = bytes(SEQUENTIAL);
    let error = refusal(&draco(data.len(), 21), &data);
    let reason = "KHR_draco_mesh_compression: the data cannot be decoded: the data holds more than";
    assert!(error.contains(reason), "{error}");
    let json =
        draco(data.len(), 24).replace(r#""POSITION": 0, "COLOR_0""#, r#""POSITION": 7, "COLOR_0""#);
    let error = refusal(&json, &data);
    assert!(
        error.contains("the data holds no attribute 7 (`POSITION`)"),
        "{error}"
    );
}

/// What meshopt made of the roof, 1000 for 1 and 500 for its top: vertices of four 16-bit numbers, by
/// version 0 and 1 of the codec; indices as triangles and as a sequence.
const VERTICES: [&str; 2] = [
    "oAE//8AALy9gLy9gLy8CBo1o1oAAAAABAwwAAC8vAQMMAAAGCAEA8AAAFxgBAJAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=",
    "oV+lAC8vYC8vYC8vAAYIDQYIDQYIAEgALy8ASAAGCAAwABcYADAAAgEAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=",
];
const TRIANGLES: &str = "4f4eEA5OHhIODwYAdodWZ3iphmWJaJgBaQAA";
const SEQUENCE: &str = "0QAECAYMAgYECAYMAgIECAYMAgYECAYMAgAAAAA=";
/// The roof of squares of 1/2 x 1/4 with a top of 3/2, through the filter EXPONENTIAL.
const EXPONENTIAL: &str = "oW5mZgBAAD8gID9AAAE7xIAAyAMEAFgBQC8wHwE7xIAAyAMEADAAYF8BO8SAAMgDBAAAAAAAAAAAAAAAAI4AAACOAAAAjgAAAA==";
/// Nine directions, through OCTAHEDRAL; and what the reference decoder makes of them.
const OCTAHEDRAL: &str = "oa8AVbCZUMOtbFEAt1TJrYRRvrIAAAAAAAAAAAAAAAAAAAAAAAAASX9/AAA=";
const DIRECTIONS: [[i8; 3]; 9] = [
    [0, 76, -102],
    [49, 58, 102],
    [75, 13, -102],
    [67, -39, 101],
    [25, -72, -102],
    [-27, -71, 102],
    [-66, -37, -102],
    [-75, 13, 102],
    [-48, 59, -102],
];

/// A document whose positions (with normals, if there are bytes of them) and indices are packed by
/// meshopt: the bytes in one file, and a fallback buffer that is nowhere.
fn meshopt(name: &str, parts: [(&[u8], u32, u32, &str); 3], component: u32) -> (String, Vec<u8>) {
    let mut file = Vec::new();
    let mut views = Vec::new();
    for (bytes, stride, count, mode) in parts {
        let stride_text = match mode.starts_with("\"ATTRIBUTES") {
            true => format!(r#""byteStride": {stride}, "#),
            false => String::new(),
        };
        views.push(format!(
            r#"{{"buffer": 1, "byteLength": {}, {stride_text}"extensions": {{"{name}": {{"buffer": 0,
            "byteOffset": {}, "byteLength": {}, "byteStride": {stride}, "count": {count},
            "mode": {mode}}}}}}}"#,
            stride * count,
            file.len(),
            bytes.len(),
        ));
        file.extend(bytes);
    }
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{name}", "KHR_mesh_quantization"],
        "buffers": [{{"uri": "a.bin", "byteLength": {}}},
            {{"byteLength": 1000, "extensions": {{"{name}": {{"fallback": true}}}}}}],
        "bufferViews": [{}],
        "accessors": [{{"bufferView": 0, "componentType": {component}, "count": 9, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5123, "count": 24, "type": "SCALAR"}},
            {{"bufferView": 2, "componentType": 5120, "normalized": true, "count": 9, "type": "VEC3"}}],
        "meshes": [{{"primitives": [{{"indices": 1, "attributes": {{"POSITION": 0, "NORMAL": 2}}}}]}}],
        "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}]}}"#,
        file.len(),
        views.join(", "),
    );
    (json, file)
}

const NORMALS: &str = r#""ATTRIBUTES", "filter": "OCTAHEDRAL""#;

#[test]
fn meshopt_gives_the_bytes_of_the_reference_decoder() {
    let normals = bytes(OCTAHEDRAL);
    let names = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
    let indices = [(TRIANGLES, r#""TRIANGLES""#), (SEQUENCE, r#""INDICES""#)];
    for (number, (name, (index_bytes, mode))) in names.iter().zip(indices).enumerate() {
        let [vertices, index_bytes] = [VERTICES[number], index_bytes].map(bytes);
        let parts = [
            (&*vertices, 8, 9, r#""ATTRIBUTES""#),
            (&*index_bytes, 2, 24, mode),
            (&*normals, 4, 9, NORMALS),
        ];
        let (json, file) = meshopt(name, parts, 5123);
        let loaded = gltf(&json, &file).unwrap();
        assert_eq!(loaded.warnings, []);
        let mesh = mesh(&loaded);
        let top = |x, y| if (x, y) == (1, 1) { 500.0 } else { 0.0 };
        let at = |x: usize, y: usize| [1000.0 * x as f64, 1000.0 * y as f64, top(x, y)];
        assert_eq!(sorted(faces(mesh)), sorted(roof(at)), "{name}");
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let number = (position.x / 1000.0 + 3.0 * position.y / 1000.0) as usize;
            let expected = DIRECTIONS[number].map(|x| f64::from(x) / 127.0);
            let length = expected.iter().map(|x| x * x).sum::<f64>().sqrt();
            for (found, expected) in normal.to_array().iter().zip(expected) {
                assert!((found - expected / length).abs() < 1e-15, "{normal}");
            }
        }
    }
    let [vertices, indices] = [EXPONENTIAL, TRIANGLES].map(bytes);
    let parts = [
        (
            &*vertices,
            12,
            9,
            r#""ATTRIBUTES", "filter": "EXPONENTIAL""#,
        ),
        (&*indices, 2, 24, r#""TRIANGLES""#),
        (&*normals, 4, 9, NORMALS),
    ];
    let (json, file) = meshopt(names[0], parts, 5126);
    let loaded = gltf(&json, &file).unwrap();
    let at = |x: usize, y: usize| {
        let top = if (x, y) == (1, 1) { 1.5 } else { 0.0 };
        [0.5 * x as f64, 0.25 * y as f64, top]
    };
    assert_eq!(sorted(faces(mesh(&loaded))), sorted(roof(at)));
}

/// As gltf-pipeline writes it.
#[test]
fn a_buffer_of_compressed_views_that_is_not_called_their_fallback_is_not_missed() {
    let [vertices, indices, normals] = [VERTICES[0], TRIANGLES, OCTAHEDRAL].map(bytes);
    let parts = [
        (&*vertices, 8, 9, r#""ATTRIBUTES""#),
        (&*indices, 2, 24, r#""TRIANGLES""#),
        (&*normals, 4, 9, NORMALS),
    ];
    let name = "EXT_meshopt_compression";
    let (json, file) = meshopt(name, parts, 5123);
    let said = r#", "extensions": {"EXT_meshopt_compression": {"fallback": true}}"#;
    let unsaid = json.replace(said, "");
    assert_ne!(unsaid, json);
    let faces_of = |json: &str| faces(mesh(&gltf(json, &file).unwrap()));
    assert_eq!(faces_of(&unsaid), faces_of(&json));
    // A view that is not compressed has nothing to read there.
    let (before, after) = unsaid.split_at(unsaid.rfind(r#", "extensions": {"#).unwrap());
    let plain = format!("{before}}}],{}", after.split_once("],").unwrap().1);
    let error = refusal(&plain, &file);
    let reason = "buffers[1] has no `uri`, and there is no binary chunk for it";
    assert!(error.contains(reason), "{error}");
}

#[test]
fn meshopt_views_that_make_no_sense_are_refused() {
    let [vertices, indices, normals] = [VERTICES[0], TRIANGLES, OCTAHEDRAL].map(bytes);
    let parts = [
        (&*vertices, 8, 9, r#""ATTRIBUTES""#),
        (&*indices, 2, 24, r#""TRIANGLES""#),
        (&*normals, 4, 9, NORMALS),
    ];
    let (json, file) = meshopt("EXT_meshopt_compression", parts, 5123);
    assert!(gltf(&json, &file).is_ok());
    for (from, to, reason) in [
        (
            r#""mode": "TRIANGLES""#,
            r#""mode": "QUADS""#,
            "`QUADS` is no mode",
        ),
        (r#""OCTAHEDRAL""#, r#""CUBE""#, "`CUBE` is no filter"),
        (
            r#""count": 9,
            "mode": "ATTRIBUTES"}"#,
            r#""count": 10,
            "mode": "ATTRIBUTES"}"#,
            "10 elements of 8 bytes do not make the view's 72 bytes",
        ),
        (
            r#""TRIANGLES""#,
            r#""INDICES""#,
            "the data cannot be decoded",
        ),
        (
            r#""uri": "a.bin", "#,
            r#""uri": "b.bin", "#,
            "cannot read `b.bin`",
        ),
        (
            r#""count": 9, "type": "VEC3"}"#,
            r#""count": 99, "type": "VEC3"}"#,
            "not inside",
        ),
    ] {
        let changed = json.replacen(from, to, 1);
        assert_ne!(changed, json, "{from}");
        let error = refusal(&changed, &file);
        assert!(error.contains(reason), "{error}");
    }
    // A view that is not packed has nothing in the fallback buffer.
    let packed = json.find(r#", "byteStride": 8, "extensions""#).unwrap();
    let end = json[packed..].find("}}}").unwrap() + packed + 2;
    let plain = format!("{}{}", &json[..packed], &json[end..]);
    let error = refusal(&plain, &file);
    assert!(
        error.contains("bufferViews[0]: buffers[1] is for views that are compressed"),
        "{error}"
    );
}

/// Whatever the bytes are, reading ends soon and in order.
#[test]
fn damaged_compressed_data_is_refused_or_read_but_never_more() {
    let [vertices, indices, normals] = [VERTICES[1], TRIANGLES, OCTAHEDRAL].map(bytes);
    let parts = [
        (&*vertices, 8, 9, r#""ATTRIBUTES""#),
        (&*indices, 2, 24, r#""TRIANGLES""#),
        (&*normals, 4, 9, NORMALS),
    ];
    let mut documents = vec![meshopt("EXT_meshopt_compression", parts, 5123)];
    for data in [EDGEBREAKER, SEQUENTIAL].map(bytes) {
        documents.push((draco(data.len(), 24), data));
    }
    let options = ReadOptions {
        memory_limit: 64 << 20,
        ..ReadOptions::default()
    };
    let mut random = Random(1);
    let begin = Instant::now();
    let mut refused = 0;
    for round in 0..6000 {
        let (json, data) = &documents[round % documents.len()];
        let mut data = data.clone();
        for _ in 0..=random.below(4) {
            let at = random.below(data.len());
            data[at] = match random.below(3) {
                0 => data[at] ^ (1 << random.below(8)),
                1 => [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
                _ => random.below(256) as u8,
            };
        }
        let open = &mut |_: &str| Ok(data.clone());
        match read_gltf("a.gltf".as_ref(), json.as_bytes(), &options, open) {
            Ok(loaded) => check(&loaded),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 1000, "{refused}");
    assert!(
        begin.elapsed() < Duration::from_secs(120),
        "{:?}",
        begin.elapsed()
    );
}
