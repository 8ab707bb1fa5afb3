//! Laws of the mesh writers: what is written reads back with the same faces, and what a format
//! cannot say is refused or told.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions,
    generate::{sphereflake, tetra},
    model::{Alpha, Color, Corner, Facing, Material, Mesh, Object, Polygon, Scene, Shape},
    read::{read_obj, read_ply},
    read_file,
    write::{Precision, files_of, write_file, write_obj, write_ply},
};

use crate::support::{Random, beside_shadows, files_below, shared_scenes};

fn ply_of(scene: &Scene) -> (Loaded, Vec<String>) {
    let mut bytes = Vec::new();
    let notes = write_ply(scene, &mut bytes).unwrap();
    let loaded = read_ply(Path::new("a.ply"), &bytes, &ReadOptions::default());
    (loaded.unwrap(), notes)
}

fn obj_of(scene: &Scene) -> (Loaded, Vec<String>) {
    let (mut obj, mut mtl) = (Vec::new(), Vec::new());
    let notes = write_obj(scene, Precision::Exact, "a b.mtl", &mut obj, &mut mtl).unwrap();
    let open = &mut |name: &str| {
        assert_eq!(name, "a b.mtl");
        Ok(mtl.clone())
    };
    let loaded = read_obj(Path::new("a.obj"), &obj, &ReadOptions::default(), open);
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}\n{}", String::from_utf8_lossy(&obj)));
    (loaded, notes)
}

/// The corners of every face, bit by bit: position, then normal (0 for none).
pub(crate) fn faces(scene: &Scene) -> Vec<Vec<[u64; 6]>> {
    let mut faces = Vec::new();
    for object in &scene.objects {
        match &object.shape {
            Shape::Polygon(polygon) => {
                let normal = |index| polygon.normals.get(index).copied().unwrap_or(DVec3::ZERO);
                let corners = polygon.vertices.iter().enumerate();
                faces.push(corners.map(|(i, &p)| bits(p, normal(i))).collect());
            }
            Shape::Mesh(mesh) => faces.extend(mesh.faces().map(|face| {
                let corner = |corner: &Corner| {
                    let normal = mesh.normals.get(corner.normal as usize);
                    let position = mesh.positions[corner.position as usize];
                    bits(position, normal.copied().unwrap_or(DVec3::ZERO))
                };
                face.iter().map(corner).collect()
            })),
            _ => {}
        }
    }
    faces
}

fn bits(position: DVec3, normal: DVec3) -> [u64; 6] {
    // A normal of -0 is none as well.
    let [x, y, z] = position.to_array();
    let [nx, ny, nz] = (normal + DVec3::ZERO).to_array();
    [x, y, z, nx, ny, nz].map(f64::to_bits)
}

/// A scene as the OBJ reader makes them: used vertices only, in the order of their first use, no
/// two objects with the same name and material.
fn random_scene(random: &mut Random) -> Scene {
    let mut scene = Scene::default();
    for index in 0..1 + random.below(3) {
        let mut weight = || [0.0, 1.0, 0.25, 1.0 / 3.0][random.below(4)];
        let specular = Color::new(weight(), weight(), weight());
        let transmission = Color::new(weight(), weight(), 0.0);
        let is_glass = transmission != Color::ZERO;
        scene.materials.push(Material {
            name: format!("m#{index} \u{e9}"),
            diffuse: Color::new(weight(), weight(), weight()),
            specular,
            shininess: 100.0 * weight(),
            reflection: specular * [0.0, 1.0][random.below(2)],
            transmission,
            ior: if is_glass { 1.1 } else { 1.0 },
            emission: Color::new(0.0, [0.0, 7.5][random.below(2)], 0.0),
            ..Material::default()
        });
    }
    for index in 0..1 + random.below(4) {
        let mut mesh = Mesh::default();
        for _ in 0..1 + random.below(5) {
            let corner_count = 3 + random.below(3);
            for _ in 0..corner_count {
                let position = random.below(mesh.positions.len() + 2);
                if position >= mesh.positions.len() {
                    let point = std::array::from_fn(|_| random.number());
                    mesh.positions.push(DVec3::from_array(point));
                }
                let position = position.min(mesh.positions.len() - 1);
                let mut corner = Corner::at(position as u32);
                if random.below(2) == 0 {
                    let normal = random.below(mesh.normals.len() + 1);
                    if normal == mesh.normals.len() {
                        mesh.normals.push(DVec3::new(random.number(), 1.0, 0.5));
                    }
                    corner.normal = normal as u32;
                }
                mesh.corners.push(corner);
            }
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        scene.objects.push(Object {
            name: ["", "a", "b c", "#"][random.below(4)].into(),
            shape: Shape::Mesh(mesh),
            material: (index + random.below(9)) % scene.materials.len(),
        });
    }
    scene
}

/// What OBJ makes of any scene is something that OBJ keeps.
#[test]
fn obj_keeps_what_it_can_say() {
    let mut random = Random(11);
    let mut face_count = 0;
    for _ in 0..2000 {
        let scene = random_scene(&mut random);
        let (first, _) = obj_of(&scene);
        if first.scene.objects.is_empty() {
            continue;
        }
        let (second, notes) = obj_of(&first.scene);
        assert_eq!(second.scene, first.scene);
        assert_eq!(beside_shadows(&second), [""; 0]);
        assert_eq!(notes, Vec::<String>::new());
        // Nothing is lost on the way to the first, but for faces without area.
        let dropped = scene.objects.len() - first.scene.objects.len().min(scene.objects.len());
        if beside_shadows(&first).is_empty() && dropped == 0 {
            assert_eq!(faces(&first.scene), faces(&scene));
            face_count += faces(&scene).len();
            for (object, read) in scene.objects.iter().zip(&first.scene.objects) {
                let [mut a, mut b] = [
                    scene.materials[object.material].clone(),
                    first.scene.materials[read.material].clone(),
                ];
                a.name.clear();
                b.name.clear();
                assert_eq!(a, b);
            }
        }
    }
    assert!(face_count > 900, "{face_count}");
}

#[test]
fn ply_keeps_every_face() {
    let mut random = Random(12);
    let mut face_count = 0;
    for _ in 0..2000 {
        let scene = random_scene(&mut random);
        let (first, _) = ply_of(&scene);
        if first.warnings.is_empty() {
            assert_eq!(faces(&first.scene), faces(&scene));
            face_count += faces(&scene).len();
        }
        if first.scene.objects.is_empty() {
            continue;
        }
        let (second, _) = ply_of(&first.scene);
        assert_eq!(faces(&second.scene), faces(&first.scene));
        // Where corners that share a position share a normal, the scene itself is kept.
        let (third, notes) = ply_of(&second.scene);
        assert_eq!(third.scene, second.scene);
        assert_eq!((third.warnings, notes), (vec![], vec![]));
    }
    assert!(face_count > 900, "{face_count}");
}

/// Found by fuzzing: a tab in a name was replaced, although OBJ can say it.
#[test]
fn names_with_white_space_inside_are_kept() {
    let text = "v 0 0 4\nv 1 0 1\nv 0 1 0\no a\tb\u{b} c\\d\nusemtl o\t1#\nf 1 2 3\n";
    let no_library = &mut |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let options = ReadOptions::default();
    let first = read_obj(Path::new("a.obj"), text.as_bytes(), &options, no_library).unwrap();
    assert_eq!(first.scene.objects[0].name, "a\tb\u{b} c\\d");
    assert_eq!(first.scene.materials[0].name, "o\t1#");
    let (second, notes) = obj_of(&first.scene);
    assert_eq!(notes, Vec::<String>::new());
    assert_eq!(second.scene, first.scene);
}

/// Found by fuzzing: a zero byte in the name of an STL's solid made the OBJ no text.
#[test]
fn names_with_a_zero_byte_are_changed() {
    let mut scene = random_scene(&mut Random(2));
    scene.objects[0].name = "a\0b".into();
    let (loaded, notes) = obj_of(&scene);
    assert_eq!(loaded.scene.objects[0].name, "a_b");
    assert!(notes.contains(&"OBJ cannot say the names of 1 objects: they are changed".into()));
}

#[test]
fn wide_faces_have_wide_counts() {
    let vertex = |i: usize| DVec3::new(i as f64, (i * i) as f64, 0.0);
    let polygon = Polygon {
        vertices: (0..300).map(vertex).collect(),
        normals: vec![],
    };
    let scene = Scene {
        materials: vec![Material::default()],
        objects: vec![Object {
            name: String::new(),
            shape: Shape::Polygon(polygon),
            material: 0,
        }],
        ..Scene::default()
    };
    assert_eq!(faces(&ply_of(&scene).0.scene), faces(&scene));
    assert_eq!(faces(&obj_of(&scene).0.scene), faces(&scene));
}

#[test]
fn what_is_left_out_is_named() {
    let mut scene = tetra(1).unwrap();
    let (_, notes) = ply_of(&scene);
    assert_eq!(
        notes,
        [
            "the names and borders of 4 objects are not written",
            "materials are not written",
            "lights are not written: `light 1`",
            "the camera is not written",
            "the background is not written",
            "the ambient light is not written: readers take 0.2",
            "that faces are lit only from the front is not written",
            "which way is up, (-0.816497, -0.816497, 0.816497), is not written"
        ]
    );
    scene.materials[0].transmission = Color::ONE;
    scene.materials[0].reflection = Color::ONE;
    scene.materials[0].specular = Color::ZERO;
    scene.materials[0].is_double_sided = false;
    scene.facing = Facing::Viewer;
    scene.objects[1].name = " # a\nb\\".into();
    assert!(ply_of(&scene).1[1].contains("see-through ones become opaque"));
    let (loaded, notes) = obj_of(&scene);
    assert_eq!(loaded.scene.objects[1].name, "_ a_b_");
    assert_eq!(
        notes[5..],
        [
            "names of 1 materials are empty, taken, or OBJ cannot say them: others are made up",
            "material `material_1`: MTL has one weight for highlight and mirror: the mirror's is \
             written",
            "material `material_1`: MTL has no one-sided surfaces: the back is seen too",
            "OBJ cannot say the names of 1 objects: they are changed",
            "2 objects have the name and material of another: readers join them"
        ]
    );
    scene.materials[0].alpha = Alpha::Mask { cutoff: 0.5 };
    assert!(
        obj_of(&scene)
            .1
            .iter()
            .any(|note| note.contains("its cut-outs are not written"))
    );
}

#[test]
fn curved_shapes_are_refused() {
    let scene = sphereflake(1).unwrap();
    let error = write_ply(&scene, &mut Vec::new()).unwrap_err().to_string();
    assert_eq!(error, "PLY cannot say a sphere (number 1)");
    let error = write_obj(
        &scene,
        Precision::Exact,
        "",
        &mut Vec::new(),
        &mut Vec::new(),
    );
    assert_eq!(
        error.unwrap_err().to_string(),
        "OBJ cannot say a sphere (number 1)"
    );
}

#[test]
fn materials_are_found_again_whatever_the_file_is_called() {
    let mut scene = tetra(1).unwrap();
    scene.materials[0].transmission = Color::splat(0.5);
    let folder = tempfile::tempdir().unwrap();
    let names = [
        "a b",
        "a  b",
        " a",
        "a ",
        "a\tb",
        "o #1",
        "#",
        "a\nb",
        "a\\b",
        "a\\",
        "C:x",
        "%20",
        "\"q\"",
        "-o",
        "~x",
        "\u{a0}c\u{3000}",
        ".a",
        "a.b",
    ];
    let mut paths: Vec<_> = names
        .map(|name| folder.path().join(format!("{name}.obj")))
        .to_vec();
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::ffi::OsStrExt;
        paths.push(
            folder
                .path()
                .join(std::ffi::OsStr::from_bytes(b"c\xff.obj")),
        );
    }
    for path in paths {
        write_file(&scene, &path).unwrap();
        for written in files_of(&path) {
            assert!(written.exists(), "{written:?}");
        }
        let loaded = read_file(&path, &ReadOptions::default()).unwrap();
        let materials = &loaded.scene.materials;
        let all_are_clear = materials.iter().all(|material| !material.is_opaque());
        assert!(all_are_clear, "{path:?}: {:?}", loaded.warnings);
    }
}

#[test]
fn the_name_chooses_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let scene = tetra(2).unwrap();
    for name in ["a.nff", "b.OBJ", "c.ply"] {
        let path = folder.path().join(name);
        let notes = write_file(&scene, &path).unwrap();
        assert!(notes.iter().all(|note| note.file == path));
        let loaded = read_file(&path, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.warnings, [], "{name}");
        assert_eq!(faces(&loaded.scene), faces(&scene), "{name}");
    }
    assert!(folder.path().join("b.mtl").exists());
    let refusal = |scene: &Scene, name: &str| {
        let error = write_file(scene, &folder.path().join(name)).unwrap_err();
        error.to_string()
    };
    assert!(refusal(&scene, "a.stl").contains("a.stl: no writer for this name; expected one"));
    assert!(refusal(&scene, "none/a.ply").contains("a.ply: cannot write: "));
    // A refused scene leaves the file alone.
    let before = std::fs::read(folder.path().join("c.ply")).unwrap();
    assert!(refusal(&sphereflake(1).unwrap(), "c.ply").contains("cannot say a sphere"));
    assert_eq!(std::fs::read(folder.path().join("c.ply")).unwrap(), before);
}

#[test]
fn other_peoples_meshes_survive() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for extension in ["obj", "ply", "stl", "STL"] {
        for path in files_below(&folder.join("mesh"), extension) {
            // One file tests zero indices.
            let Ok(first) = read_file(&path, &ReadOptions::default()) else {
                continue;
            };
            let (ply, _) = ply_of(&first.scene);
            assert_eq!(faces(&ply.scene), faces(&first.scene), "{}", path.display());
            let (obj, _) = obj_of(&first.scene);
            assert_eq!(faces(&obj.scene), faces(&first.scene), "{}", path.display());
        }
    }
}
