//! One shape in two files gives the same triangles.

use std::path::Path;

use antumbra_scene::{
    ReadOptions,
    model::{Scene, Shape},
    read::read_ply,
    read_file,
    write::write_ply,
};

use crate::support::shared_scenes;

fn scene(file: &str) -> Option<Scene> {
    let path = shared_scenes()?.join("mesh").join(file);
    let loaded = read_file(&path, &ReadOptions::default()).unwrap();
    Some(loaded.scene)
}

/// The faces as lists of positions, each beginning with its smallest, then sorted.
fn faces(scene: &Scene, number: impl Fn(f64) -> i64) -> Vec<Vec<[i64; 3]>> {
    let mut faces = Vec::new();
    for object in &scene.objects {
        let Shape::Mesh(mesh) = &object.shape else {
            panic!("{object:?}");
        };
        faces.extend(mesh.faces().map(|face| {
            let corners = face.iter().map(|corner| {
                let position = mesh.positions[corner.position as usize].to_array();
                position.map(&number)
            });
            let mut corners: Vec<_> = corners.collect();
            let first = (0..corners.len()).min_by_key(|&i| corners[i]).unwrap();
            corners.rotate_left(first);
            corners
        }));
    }
    faces.sort();
    faces
}

/// Text, big-endian by others, little-endian by us: the same scene.
#[test]
fn platonic_shelf() {
    let Some(text) = scene("ply/platonic_shelf_ascii.ply") else {
        return;
    };
    let big = scene("ply/platonic_shelf_big_endian.ply").unwrap();
    let mut bytes = Vec::new();
    write_ply(&big, &mut bytes).unwrap();
    let little = read_ply(Path::new("a.ply"), &bytes, &ReadOptions::default()).unwrap();
    assert_eq!(little.scene, big);
    assert_eq!(text, big);
}

/// The PLY was made from the STL by Blender, with six decimals: so rounded, all triangles agree.
#[test]
fn featuretype() {
    let Some(ply) = scene("ply/featuretype.ply") else {
        return;
    };
    let stl = scene("stl/featuretype.STL").unwrap();
    let six_decimals = |number: f64| (number * 1e6).round() as i64;
    let expected = faces(&stl, six_decimals);
    assert_eq!(expected.len(), 3476);
    assert!(faces(&ply, six_decimals) == expected);
}

/// The text has six decimals; to 32 bits they are the numbers of the binary file.
#[test]
fn half_donut() {
    let Some(text) = scene("stl/HalfDonut_ascii.stl") else {
        return;
    };
    let binary = scene("stl/HalfDonut_binary.stl").unwrap();
    let single = |number: f64| i64::from((number as f32).to_bits());
    let expected = faces(&binary, single);
    assert_eq!(expected.len(), 288);
    assert!(faces(&text, single) == expected);
}
