//! glTF's nodes by small documents of our own: transforms, trees that are none, copies, poses.

use std::sync::Arc;

use antumbra_geometry::DVec3;
use antumbra_scene::model::Shape;

use crate::gltf::{POINTS, SQUARE, document, faces, floats, gltf, mesh, refusal, square};

#[test]
fn nodes_move_turn_scale_and_mirror() {
    let bytes = floats(&SQUARE);
    let turned = r#", "nodes": [{"children": [1], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": [0, 0, 0.70710677, 0.70710677], "scale": [2, 3, 1]}]"#;
    let loaded = gltf(&square("", turned), &bytes).unwrap();
    let expected = [[[10., 0., 0.], [10., 2., 0.], [7., 0., 0.]]];
    for (found, expected) in faces(mesh(&loaded))[0].iter().zip(expected[0]) {
        assert!((DVec3::from(*found) - DVec3::from(expected)).length() < 1e-14);
    }
    let mirrored = r#", "nodes": [{"mesh": 0, "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}]"#;
    let loaded = gltf(&square("", mirrored), &bytes).unwrap();
    assert_eq!(
        faces(mesh(&loaded)),
        [[[5., 0., 0.], [5., 1., 0.], [4., 0., 0.]]]
    );
    let flat = gltf(
        &square("", r#", "nodes": [{"mesh": 0, "scale": [1, 0, 1]}]"#),
        &bytes,
    )
    .unwrap();
    assert_eq!(flat.warnings[1].message, "a triangle has no area: dropped");
    let both = r#", "nodes": [{"mesh": 0, "scale": [1,1,1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}]"#;
    assert!(refusal(&square("", both), &bytes).contains("nodes[0]: expected either `matrix`"));
}

#[test]
fn trees_that_are_none() {
    let bytes = floats(&SQUARE);
    for (nodes, reason) in [
        (
            r#"{"children": [1]}, {"children": [0]}"#,
            "nodes[0]: the node is in a loop",
        ),
        (
            r#"{}, {"children": [1]}"#,
            "nodes[1]: the node is in a loop",
        ),
        (
            r#"{"children": [2]}, {"children": [2]}, {}"#,
            "nodes[2] is a child of nodes[0] already",
        ),
        (
            r#"{}, {"children": [0]}"#,
            "nodes[0] is a child of nodes[1], not a root",
        ),
        (
            r#"{"children": [7]}"#,
            "nodes[0].children[0]: nodes[7] is not there",
        ),
        (r#"{"mesh": 1}"#, "nodes[0].mesh: meshes[1] is not there"),
        (
            r#"{"scale": [1e308, 1, 1], "children": [1]}, {"scale": [1e9, 1, 1]}"#,
            "not finite",
        ),
        (
            r#"{"mesh": 0, "translation": [1e31, 0, 0]}"#,
            "beyond 2^100",
        ),
    ] {
        let error = refusal(&square("", &format!(r#", "nodes": [{nodes}]"#)), &bytes);
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn depth_costs_nothing() {
    let mut nodes = String::new();
    for child in 1..=100_000 {
        nodes += &format!(r#"{{"children": [{child}], "translation": [1, 0, 0]}},"#);
    }
    let json = square("", &format!(r#", "nodes": [{nodes}{{"mesh": 0}}]"#));
    let loaded = gltf(&json, &floats(&SQUARE)).unwrap();
    assert_eq!(mesh(&loaded).positions[0], DVec3::new(1e5, 0.0, 0.0));
    let deep = format!(
        r#"{{"asset": {{"version": "2.0"}}, "extras": {}"#,
        "[".repeat(1_000_000)
    );
    assert!(refusal(&deep, b"").contains("a.gltf:1"));
}

#[test]
fn instances() {
    let mut bytes = floats(&SQUARE);
    bytes.extend(floats(&[1., 0., 0., 2., 0., 0.]));
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}]"#;
    let json = |accessor: &str| {
        let nodes = r#", "nodes": [{"mesh": 0, "scale": [2, 1, 1], "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}]"#;
        document(
            72,
            &format!("{POINTS}, {accessor}"),
            r#""attributes": {"POSITION": 0}, "mode": 5"#,
            &format!("{views}{nodes}"),
        )
    };
    let two = r#"{"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"}"#;
    let loaded = gltf(&json(two), &bytes).unwrap();
    let starts = loaded.scene.objects.iter().map(|o| o.shape.bounds().min.x);
    assert_eq!(starts.collect::<Vec<_>>(), [2.0, 4.0]);
    // Copies that no byte stands behind.
    let many = r#"{"componentType": 5126, "count": 4000000000, "type": "VEC3"}"#;
    assert!(refusal(&json(many), &bytes).contains("4000000000 elements and no bytes"));
}

/// Asks for 2^22 copies of 2^22 triangles in a few hundred bytes.
#[test]
fn a_small_file_cannot_ask_for_everything() {
    let nodes = r#", "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}]"#;
    let accessor = r#"{"componentType": 5126, "count": 4194304, "type": "VEC3"}"#;
    let json = document(
        0,
        accessor,
        r#""attributes": {"POSITION": 0}, "mode": 5"#,
        nodes,
    );
    let error = refusal(&json, b"");
    assert!(error.contains("nodes[0].mesh: with all copies"), "{error}");
}

/// Joints: the second moves by one along x and has an inverse bind matrix that moves back by 3.
#[test]
fn skins_stand_in_their_rest_pose() {
    let mut bytes = floats(&SQUARE);
    bytes.extend([0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    bytes.extend(floats(&[
        1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 3., 1., 0., 0.,
    ]));
    for moved in [0.0, -3.0] {
        bytes.extend(floats(&[
            1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., moved, 0., 0., 1.,
        ]));
    }
    let accessors = format!(
        r#"{POINTS}, {{"bufferView": 1, "componentType": 5121, "count": 4, "type": "VEC4"}},
        {{"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC4"}},
        {{"bufferView": 3, "componentType": 5126, "count": 2, "type": "MAT4"}}"#
    );
    let rest = r#", "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 16},
        {"buffer": 0, "byteOffset": 64, "byteLength": 64}, {"buffer": 0, "byteOffset": 128, "byteLength": 128}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 3}],
        "nodes": [{"mesh": 0, "skin": 0, "translation": [50, 0, 0], "children": [1]}, {"children": [2], "translation": [-50, 0, 0]},
        {"translation": [1, 0, 0]}]"#;
    let primitive = r#""attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}, "mode": 5"#;
    let json = document(256, &accessors, primitive, rest);
    let loaded = gltf(&json, &bytes).unwrap();
    // All by the first joint, by the second, by the second, three to one.
    let x: Vec<_> = mesh(&loaded).positions.iter().map(|p| p.x).collect();
    assert_eq!(x, [0.0, -1.0, -2.0, 0.5]);
    bytes[52] = 2;
    assert!(refusal(&json, &bytes).contains("vertex 1 follows joint 2, but the skin has 2"));
}

#[test]
fn morph_targets_at_their_default_weights() {
    let mut bytes = floats(&SQUARE);
    bytes.extend(floats(&[0., 0., 1., 0., 0., 2., 0., 0., 3., 0., 0., 4.]));
    let accessors = format!(
        r#"{POINTS}, {}"#,
        POINTS.replace(r#""bufferView": 0"#, r#""bufferView": 1"#)
    );
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}]"#;
    let primitive = r#""attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]"#;
    for (node, z) in [("", 0.0), (r#", "weights": [0.5]"#, 0.5)] {
        let rest = format!(r#"{views}, "nodes": [{{"mesh": 0{node}}}]"#);
        let loaded = gltf(&document(96, &accessors, primitive, &rest), &bytes).unwrap();
        assert_eq!(mesh(&loaded).positions[0].z, z);
    }
}

/// Copies share their mesh, and stand, bit by bit, where a lone node would put it.
#[test]
fn copies_share_a_mesh_and_stand_where_a_lone_node_puts_it() {
    let points = [0.1, 0.2, 0.3, 1.7, 0.1, -0.4, 0.3, 1.9, 0.7, 1.1, 1.3, 5.9];
    let bytes = floats(&points);
    let places = [
        r#""translation": [1e6, 0.1, 3]"#,
        r#""rotation": [0.1, 0.2, 0.3, 0.9], "scale": [1.1, 0.3, 7]"#,
        r#""scale": [-1, 3, 1]"#,
        r#""scale": [-2, 1, 0.1], "translation": [0.7, 0, 0]"#,
        // Flat.
        r#""matrix": [0,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"#,
    ];
    let json = |places: &[&str]| {
        let children: Vec<_> = (1..=places.len()).map(|child| child.to_string()).collect();
        let node = |place: &&str| format!(r#", {{"mesh": 0, {place}}}"#);
        let nodes: String = places.iter().map(node).collect();
        let root = format!(r#"{{"children": [{}]}}"#, children.join(", "));
        square(r#", "mode": 5"#, &format!(r#", "nodes": [{root}{nodes}]"#))
    };
    let all = gltf(&json(&places), &bytes).unwrap().scene;
    assert_eq!(all.objects.len(), places.len());
    let mut shared = Vec::new();
    for (object, place) in all.objects.iter().zip(places) {
        let lone = gltf(&json(&[place]), &bytes).unwrap();
        let Shape::Instance(instance) = &object.shape else {
            panic!("{:?}", object.shape);
        };
        assert_eq!(instance.to_mesh(), *mesh(&lone));
        assert_eq!(object.shape.bounds(), lone.scene.bounds());
        shared.push(Arc::as_ptr(&instance.mesh));
    }
    assert_eq!(shared[0], shared[1]);
    assert_eq!(shared[2], shared[3]);
    assert_ne!(
        shared[0], shared[2],
        "mirrored ones are wound the other way round"
    );
}

#[test]
fn cesium_rtc_moves_everything_and_rounds_nothing_else() {
    let center = r#", "extensionsUsed": ["CESIUM_RTC"],
        "extensions": {"CESIUM_RTC": {"center": [6378137.25, -0.125, 1e7]}},
        "nodes": [{"mesh": 0, "translation": [0.5, 0, 0]}]"#;
    let loaded = gltf(&square("", center), &floats(&SQUARE)).unwrap();
    let corner = mesh(&loaded).positions[0];
    assert_eq!(corner, DVec3::new(6_378_137.75, -0.125, 1e7));
    assert_eq!(loaded.warnings.len(), 1, "one corner is left over");
}

#[test]
fn triangles_with_a_corner_that_is_no_number_are_dropped_and_counted() {
    let mut points = SQUARE;
    points[10] = f32::NAN;
    let bytes = floats(&points);
    for node in ["", r#", "children": [1]}, {"mesh": 0"#] {
        let nodes = format!(r#", "nodes": [{{"mesh": 0{node}}}]"#);
        let loaded = gltf(&square(r#", "mode": 5"#, &nodes), &bytes).unwrap();
        for object in &loaded.scene.objects {
            let mesh = object.shape.placed_mesh().unwrap();
            assert_eq!(faces(&mesh).len(), 1);
            assert!(mesh.positions.iter().all(|position| position.is_finite()));
        }
        let message = &loaded.warnings.last().unwrap().message;
        let said = "a triangle has a corner that is not finite: dropped";
        assert!(message.starts_with(said), "{message}");
    }
    // A vertex that no triangle uses is nobody's concern.
    let unused = gltf(&square("", r#", "nodes": [{"mesh": 0}]"#), &bytes).unwrap();
    assert_eq!(faces(mesh(&unused)).len(), 1);
    assert_eq!(unused.warnings.len(), 1, "one corner is left over");
}
