//! glTF by small documents of our own: accessors, primitives, nodes, poses, and what is refused.

use std::{io, path::Path};

use antumbra_scene::{
    Loaded, ReadError, ReadOptions,
    model::{Corner, Mesh, Shape},
    read::read_gltf,
    read_file,
};

use crate::{gltf_shared::check, support::Random};

/// Reads a document that may name `a.bin`.
pub(crate) fn gltf(json: &str, bytes: &[u8]) -> Result<Loaded, ReadError> {
    let open = &mut |name: &str| match name {
        "a.bin" => Ok(bytes.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    read_gltf(
        Path::new("a.gltf"),
        json.as_bytes(),
        &ReadOptions::default(),
        open,
    )
}

pub(crate) fn refusal(json: &str, bytes: &[u8]) -> String {
    gltf(json, bytes).unwrap_err().to_string()
}

/// Returns the only mesh.
pub(crate) fn mesh(loaded: &Loaded) -> &Mesh {
    let [object] = &loaded.scene.objects[..] else {
        panic!("{:?}", loaded.warnings);
    };
    match &object.shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

/// Returns corner positions face by face.
pub(crate) fn faces(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    let at = |corner: &Corner| mesh.positions[corner.position as usize].to_array();
    mesh.faces()
        .map(|f| [at(&f[0]), at(&f[1]), at(&f[2])])
        .collect()
}

pub(crate) fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// A square in the xy plane: 0 0, 1 0, 0 1, 1 1.
pub(crate) const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];

/// A document with one mesh over `a.bin`: its bytes, accessors and the primitive's properties.
pub(crate) fn document(bytes: usize, accessors: &str, primitive: &str, rest: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "buffers": [{{"uri": "a.bin", "byteLength": {bytes}}}],
        "accessors": [{accessors}], "meshes": [{{"primitives": [{{{primitive}}}]}}] {rest}}}"#
    )
}

pub(crate) const NODE: &str = r#", "nodes": [{"mesh": 0}]"#;
pub(crate) const WHOLE: &str = r#", "bufferViews": [{"buffer": 0, "byteLength": 48}]"#;
pub(crate) const POINTS: &str =
    r#"{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}"#;

pub(crate) fn square(primitive: &str, rest: &str) -> String {
    document(
        48,
        POINTS,
        &format!(r#""attributes": {{"POSITION": 0}}{primitive}"#),
        &format!("{WHOLE}{rest}"),
    )
}

#[test]
fn strips_and_fans_keep_their_winding() {
    let bytes = floats(&SQUARE);
    for (mode, expected) in [
        (
            5,
            vec![
                [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]],
                [[1., 0., 0.], [1., 1., 0.], [0., 1., 0.]],
            ],
        ),
        (
            6,
            vec![
                [[1., 0., 0.], [0., 1., 0.], [0., 0., 0.]],
                [[0., 1., 0.], [1., 1., 0.], [0., 0., 0.]],
            ],
        ),
        (4, vec![[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]]),
    ] {
        let loaded = gltf(&square(&format!(r#", "mode": {mode}"#), NODE), &bytes).unwrap();
        assert_eq!(faces(mesh(&loaded)), expected, "{mode}");
        assert_eq!(
            loaded.warnings.len(),
            usize::from(mode == 4),
            "one corner is left over"
        );
    }
    let lines = gltf(&square(r#", "mode": 1"#, NODE), &bytes).unwrap();
    assert!(lines.scene.objects.is_empty());
    assert_eq!(lines.warnings[0].message, "points and lines are not read");
    assert!(refusal(&square(r#", "mode": 7"#, NODE), &bytes).contains("primitives[0].mode: 7"));
}

#[test]
fn quantized_strided_and_normalised_positions() {
    // Two unused bytes after each vertex.
    let shorts: [u16; 12] = [0, 0, 0, 9, 65535, 0, 0, 9, 0, 32768, 0, 9];
    let bytes: Vec<u8> = shorts.iter().flat_map(|s| s.to_le_bytes()).collect();
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}]"#;
    for (normalized, x, y) in [(true, 1.0, 32768.0 / 65535.0), (false, 65535.0, 32768.0)] {
        let accessor = format!(
            r#"{{"bufferView": 0, "componentType": 5123, "count": 3, "type": "VEC3", "normalized": {normalized}}}"#
        );
        let json = document(
            24,
            &accessor,
            r#""attributes": {"POSITION": 0}"#,
            &format!("{views}{NODE}"),
        );
        let loaded = gltf(&json, &bytes).unwrap();
        assert_eq!(
            faces(mesh(&loaded)),
            [[[0.0; 3], [x, 0.0, 0.0], [0.0, y, 0.0]]]
        );
    }
    // Signed bytes: -127 and -128 are both -1.
    let bytes = [-127_i8, 0, 0, -128, 127, 0, 64, 0, 127].map(i8::cast_unsigned);
    let accessor = r#"{"bufferView": 0, "componentType": 5120, "count": 3, "type": "VEC3", "normalized": true}"#;
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 9}]"#;
    let json = document(
        9,
        accessor,
        r#""attributes": {"POSITION": 0}"#,
        &format!("{views}{NODE}"),
    );
    let loaded = gltf(&json, &bytes).unwrap();
    assert_eq!(
        faces(mesh(&loaded)),
        [[[-1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [64.0 / 127.0, 0.0, 1.0]]]
    );
}

/// A square whose last corner is replaced, or all of whose corners are, over zeros.
#[test]
fn sparse_accessors() {
    let mut bytes = floats(&SQUARE);
    bytes.extend(floats(&[5.0, 6.0, 7.0, 8.0, 8.0, 9.0]));
    bytes.extend([1, 3]);
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 26}]"#;
    let read = |base: &str, indices: [u8; 2]| {
        let accessor = format!(
            r#"{{{base} "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {{"count": 2,
            "indices": {{"bufferView": 1, "byteOffset": 24, "componentType": 5121}}, "values": {{"bufferView": 1}}}}}}"#
        );
        let json = document(
            74,
            &accessor,
            r#""attributes": {"POSITION": 0}, "mode": 5"#,
            &format!("{views}{NODE}"),
        );
        let mut bytes = bytes.clone();
        bytes[72..].copy_from_slice(&indices);
        gltf(&json, &bytes)
    };
    let over = read(r#""bufferView": 0,"#, [1, 3]).unwrap();
    assert_eq!(
        faces(mesh(&over))[1],
        [[5., 6., 7.], [8., 8., 9.], [0., 1., 0.]]
    );
    let zeros = read("", [1, 3]).unwrap();
    assert_eq!(faces(mesh(&zeros)), [[[5., 6., 7.], [8., 8., 9.], [0.; 3]]]);
    for indices in [[3, 1], [1, 1], [1, 4]] {
        let error = read("", indices).unwrap_err().to_string();
        assert!(
            error.contains("accessors[0].sparse.indices: index 1 is"),
            "{error}"
        );
    }
}

#[test]
fn a_document_in_one_piece() {
    let json = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "buffers": [{"uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}"#;
    let loaded = gltf(json, b"").unwrap();
    assert_eq!(
        faces(mesh(&loaded)),
        [[[0.; 3], [1., 0., 0.], [0., 1., 0.]]]
    );
    assert_eq!(
        loaded.warnings[0].message,
        "no scene in the file: all nodes are read"
    );
}

/// The same scene as JSON with a file and as GLB.
#[test]
fn binary_files_say_the_same() {
    let bytes = floats(&SQUARE);
    let json = square(r#", "mode": 5"#, NODE);
    let expected = gltf(&json, &bytes).unwrap();
    let mut json = json.replace(r#""uri": "a.bin", "#, "");
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let total = 12 + 8 + json.len() + 8 + bytes.len();
    let mut glb = b"glTF".to_vec();
    for number in [2, total, json.len()] {
        glb.extend((number as u32).to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(json.as_bytes());
    glb.extend((bytes.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(&bytes);
    let read = |glb: &[u8]| {
        let no_files = &mut |_: &str| Err(io::ErrorKind::NotFound.into());
        read_gltf(Path::new("a.gltf"), glb, &ReadOptions::default(), no_files)
    };
    assert_eq!(read(&glb).unwrap(), expected);
    // A wrong type in the JSON chunk is told by byte and path.
    let at = glb.windows(6).position(|w| w == b"\"mode\"").unwrap();
    let mut odd = glb.clone();
    odd[at + 8] = b'x';
    let error = read(&odd).unwrap_err().to_string();
    assert!(error.starts_with("a.gltf"), "{error}");
    assert!(error.contains("meshes[0].primitives[0].mode"), "{error}");
    for end in 0..glb.len() {
        assert!(read(&glb[..end]).is_err(), "{end}");
    }
}

#[test]
fn what_lies_outside_is_refused() {
    let bytes = floats(&SQUARE);
    let accessor = |text: &str| {
        document(
            48,
            text,
            r#""attributes": {"POSITION": 0}"#,
            &format!("{WHOLE}{NODE}"),
        )
    };
    for (json, reason) in [
        (
            accessor(r#"{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}"#),
            "accessors[0]: 5 elements of 12 bytes from byte 0 on",
        ),
        (
            accessor(
                r#"{"bufferView": 0, "byteOffset": 18446744073709551615, "componentType": 5126, "count": 4, "type": "VEC3"}"#,
            ),
            "accessors[0]: 4 elements",
        ),
        (
            accessor(
                r#"{"bufferView": 0, "componentType": 5126, "count": 18446744073709551615, "type": "VEC3"}"#,
            ),
            "are not inside bufferViews[0] of 48 bytes",
        ),
        (
            accessor(r#"{"bufferView": 0, "componentType": 5130, "count": 4, "type": "VEC3"}"#),
            "accessors[0].componentType: 5130 is no component type",
        ),
        (
            accessor(r#"{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC2"}"#),
            "attributes.POSITION: accessors[0] has the type VEC2; expected VEC3",
        ),
        (
            accessor(&POINTS.replace("4,", "-4,")),
            "a.gltf:3: accessors[0].count: invalid value",
        ),
        (
            square(r#", "material": 0"#, NODE),
            "primitives[0].material: materials[0] is not there",
        ),
        (
            square(r#", "indices": 0"#, NODE),
            "primitives[0].indices: accessors[0] has the type VEC3",
        ),
        (
            square("", r#", "bufferViews": []"#),
            "duplicate field `bufferViews`",
        ),
        (square("", r#", "scene": 1"#), "duplicate field"),
    ] {
        let error = refusal(&json, &bytes);
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn help_after_a_refused_extension_is_about_that_extension() {
    for (extension, expected) in [
        ("X_mesh_compression", "export the scene without compression"),
        (
            "X_texture_webp",
            "export the scene with PNG or JPEG textures",
        ),
        ("X_y", "export the scene without this extension"),
    ] {
        let error = refusal(
            &format!(r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{extension}"]}}"#),
            b"",
        );
        assert!(error.contains(&format!("help: {expected}")), "{error}");
    }
}

#[test]
fn versions_and_extensions() {
    let with = |rest: &str| format!(r#"{{"asset": {{"version": "2.0"}}{rest}}}"#);
    let error = refusal(
        &with(r#", "extensionsRequired": ["KHR_mesh_quantization", "X_y"]"#),
        b"",
    );
    assert!(
        error.contains("extensionsRequired[1]: the extension `X_y` is not read"),
        "{error}"
    );
    let used = gltf(
        &with(r#", "extensionsUsed": ["KHR_mesh_quantization", "X_y"]"#),
        b"",
    )
    .unwrap();
    assert_eq!(used.warnings[0].message, "the extension `X_y` is not read");
    for asset in [
        r#"{"version": "1.0"}"#,
        r#"{"version": "2.1", "minVersion": "2.1"}"#,
    ] {
        let error = refusal(&format!(r#"{{"asset": {asset}}}"#), b"");
        assert!(error.contains("expected 2.0"), "{error}");
    }
    assert!(refusal("{}", b"").contains("missing field `asset`"));
    assert!(refusal(&with("}"), b"").contains("this is no glTF: trailing characters"));
}

#[test]
fn files_beside_the_scene_only() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner dir");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(folder.path().join("a.bin"), floats(&SQUARE)).unwrap();
    std::fs::write(inner.join("a b.bin"), floats(&SQUARE)).unwrap();
    let read = |uri: &str| {
        let scene = inner.join("scene.gltf");
        std::fs::write(&scene, square("", NODE).replace("a.bin", uri)).unwrap();
        read_file(&scene, &ReadOptions::default())
    };
    assert!(read("a%20b.bin").is_ok());
    assert!(read("./a b.bin").is_ok());
    let absolute = folder.path().join("a.bin");
    for uri in [
        "../a.bin",
        "%2e%2e/a.bin",
        "..%5c/a.bin",
        absolute.to_str().unwrap(),
    ] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.contains("leads outside the folder"), "{error}");
    }
    for uri in ["http://x/a.bin", "file:///a.bin"] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.contains("is not followed"), "{error}");
    }
}

/// Every outcome is fine but a panic or a scene that breaks the model's promises.
#[test]
fn garbage_ends_in_order() {
    let json = square(r#", "mode": 5"#, NODE);
    let bytes = floats(&SQUARE);
    for end in 0..json.len() {
        let _ = gltf(&json[..end], &bytes).inspect(check);
    }
    let mut random = Random(7);
    let mut loaded = 0;
    for _ in 0..20_000 {
        let mut text = json.clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(text.len());
            text[at] = b"0123456789-.e,:[]{}\" "[random.below(21)];
        }
        let text = String::from_utf8(text).unwrap();
        let bytes = &bytes[..random.below(8).max(1) * bytes.len() / 7];
        if let Ok(scene) = gltf(&text, bytes) {
            check(&scene);
            loaded += 1;
        }
    }
    assert!(loaded > 100, "{loaded}");
}
