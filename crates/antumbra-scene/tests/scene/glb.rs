//! Laws of the GLB writer: what glTF can say reads back the same, at 32 bits.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions, Warning,
    generate::{sphereflake, tetra},
    model::{
        Alpha, Camera, Color, Corner, Filter, Light, LightKind, Material, Mesh, Object, Polygon,
        Scene, Shape, Texture, Wrap,
    },
    read::read_gltf,
    read_file,
    write::write_glb,
};

use crate::{
    support::{Random, files_below, shared_scenes},
    writers::faces,
};

fn glb_of(scene: &Scene) -> (Loaded, Vec<String>) {
    let mut bytes = Vec::new();
    let notes = write_glb(scene, &mut bytes).unwrap();
    let no_files = &mut |name: &str| panic!("{name}");
    let loaded = read_gltf(
        Path::new("a.glb"),
        &bytes,
        &ReadOptions::default(),
        no_files,
    );
    (loaded.unwrap(), notes)
}

fn mesh(scene: &Scene, index: usize) -> &Mesh {
    match &scene.objects[index].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

/// Triangles with coordinates of 32 bits; unit normals along the axes.
fn random_scene(random: &mut Random) -> Scene {
    let mut scene = Scene {
        up: DVec3::Y,
        ambient: Color::splat(0.2),
        materials: vec![Material::default()],
        ..Scene::default()
    };
    for _ in 0..1 + random.below(3) {
        let mut mesh = Mesh::default();
        let has_normals = random.below(2) == 0;
        for _ in 0..12 {
            let single = |random: &mut Random| f64::from(random.number() as f32) + 0.0;
            let position = std::array::from_fn(|_| single(random));
            mesh.positions.push(DVec3::from_array(position));
        }
        mesh.normals = vec![DVec3::X, DVec3::NEG_Y, DVec3::Z];
        for _ in 0..1 + random.below(6) {
            for _ in 0..3 {
                let mut corner = Corner::at(random.below(12) as u32);
                if has_normals {
                    corner.normal = random.below(3) as u32;
                }
                mesh.corners.push(corner);
            }
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        scene.objects.push(Object {
            name: format!("o\"{}\u{e9}\n", random.below(5)),
            shape: Shape::Mesh(mesh),
            material: 0,
        });
    }
    scene
}

#[test]
fn triangles_of_32_bits_are_kept() {
    let mut random = Random(21);
    let mut face_count = 0;
    for _ in 0..500 {
        let scene = random_scene(&mut random);
        let (first, notes) = glb_of(&scene);
        assert_eq!(notes, Vec::<String>::new());
        if first.warnings.is_empty() {
            assert_eq!(faces(&first.scene), faces(&scene));
            face_count += faces(&scene).len();
        }
        if first.scene.objects.is_empty() {
            continue;
        }
        let (second, _) = glb_of(&first.scene);
        let (third, notes) = glb_of(&second.scene);
        assert_eq!(third.scene, second.scene);
        assert_eq!(third.warnings, []);
        // Every material of glTF has a highlight.
        let roughly = "highlights and mirrors are written only roughly, as roughness and metal";
        assert_eq!(notes, [roughly]);
    }
    assert!(face_count > 400, "{face_count}");
}

#[test]
fn a_scene_with_z_up_is_turned_below_one_node() {
    let mut scene = random_scene(&mut Random(5));
    scene.up = DVec3::Z;
    for object in &mut scene.objects {
        if let Shape::Mesh(mesh) = &mut object.shape {
            mesh.corners
                .iter_mut()
                .for_each(|c| c.normal = Corner::NONE);
        }
    }
    let (loaded, notes) = glb_of(&scene);
    assert_eq!(notes, Vec::<String>::new());
    assert_eq!(loaded.scene.up, DVec3::Y);
    for object in &mut scene.objects {
        if let Shape::Mesh(mesh) = &mut object.shape {
            for p in &mut mesh.positions {
                *p = DVec3::new(p.x, p.z, -p.y);
            }
        }
    }
    let unsigned = |scene: &Scene| {
        let mut faces = faces(scene);
        let bits = faces.iter_mut().flatten().flatten();
        bits.for_each(|bits| *bits = (f64::from_bits(*bits) + 0.0).to_bits());
        faces
    };
    assert_eq!(unsigned(&loaded.scene), unsigned(&scene));
    let up = DVec3::X;
    let (_, notes) = glb_of(&Scene { up, ..scene });
    assert_eq!(notes, ["which way is up, (1, 0, 0), is not written"]);
}

#[test]
fn concave_polygons_become_the_triangles_of_their_shadows() {
    let outline = [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]];
    let scene = Scene {
        up: DVec3::Y,
        ambient: Color::splat(0.2),
        materials: vec![Material::default()],
        objects: vec![Object {
            name: "arrow".into(),
            shape: Shape::Polygon(Polygon {
                vertices: outline
                    .map(|[x, y]| DVec3::new(x.into(), y.into(), 0.0))
                    .to_vec(),
                normals: vec![DVec3::Z; 5],
            }),
            material: 0,
        }],
        ..Scene::default()
    };
    let (loaded, notes) = glb_of(&scene);
    assert_eq!(notes, Vec::<String>::new());
    let mesh = mesh(&loaded.scene, 0);
    assert_eq!((mesh.face_ends.len(), mesh.positions.len()), (3, 5));
    let area = |face: &[Corner]| {
        let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[face[i].position as usize]);
        (b - a).cross(c - a).z / 2.0
    };
    assert!(mesh.faces().all(|face| area(face) > 0.0));
    assert_eq!(mesh.faces().map(area).sum::<f64>(), 10.0);
}

#[test]
fn looks_lights_and_the_camera_are_kept() {
    let texture = Texture {
        name: "squares".into(),
        width: 2,
        height: 1,
        texels: vec![[255, 0, 7, 0], [1, 2, 3, 200]],
        wrap: [Wrap::ClampToEdge, Wrap::MirroredRepeat],
        filter: Filter::Nearest,
    };
    let quad = |z: f64| Mesh {
        positions: vec![
            DVec3::new(0.0, 0.0, z),
            DVec3::new(1.0, 0.0, z),
            DVec3::new(0.0, 1.0, z),
        ],
        uvs: vec![[0.0, 0.5], [2.0, 0.0], [0.25, -1.0]],
        corners: (0..3)
            .map(|i| Corner {
                uv: i,
                ..Corner::at(i)
            })
            .collect(),
        face_ends: vec![3],
        ..Mesh::default()
    };
    let materials = [
        Material {
            name: "cut out".into(),
            diffuse: Color::new(0.5, 0.25, 1.0),
            diffuse_texture: Some(0),
            alpha: Alpha::Mask { cutoff: 0.75 },
            ..Material::default()
        },
        Material {
            name: "veil".into(),
            alpha: Alpha::Blend,
            opacity: 0.5,
            is_double_sided: false,
            emission: Color::new(4.0, 2.0, 0.0),
            ..Material::default()
        },
        Material {
            name: "glass".into(),
            diffuse: Color::splat(0.25),
            transmission: Color::splat(0.25),
            ior: 1.25,
            emission: Color::new(0.5, 0.0, 0.0),
            ..Material::default()
        },
    ];
    let position = DVec3::new(1.0, 2.0, 3.0);
    let light = |kind, falls_off| Light {
        name: "lamp".into(),
        kind,
        color: Color::new(3.0, 1.5, 0.0),
        falls_off,
    };
    let axis = DVec3::new(0.0, -0.6, 0.8);
    let spot = LightKind::Spot {
        position,
        axis,
        inner_cosine: 0.9,
        outer_cosine: 0.8,
    };
    let towards_light = DVec3::Y;
    let scene = Scene {
        objects: (0..3)
            .map(|index| Object {
                name: format!("o{index}"),
                shape: Shape::Mesh(quad(index as f64)),
                material: index,
            })
            .collect(),
        materials: materials.to_vec(),
        textures: vec![texture],
        lights: vec![
            light(LightKind::Point { position }, true),
            light(LightKind::Directional { towards_light }, false),
            light(spot, true),
        ],
        camera: Some(Camera {
            eye: DVec3::new(0.0, 0.0, 9.0),
            at: DVec3::ZERO,
            up: DVec3::Y,
            vertical_fov_degrees: 45.0,
            resolution: Some([640, 480]),
        }),
        up: DVec3::Y,
        is_photometric: true,
        ..Scene::default()
    };
    let (loaded, notes) = glb_of(&scene);
    assert_eq!(notes, Vec::<String>::new());
    let is_about_shadows = |w: &Warning| w.message.contains("lets light through");
    assert!(loaded.warnings.len() == 2 && loaded.warnings.iter().all(is_about_shadows));
    let read = &loaded.scene;
    assert_eq!(read.textures, scene.textures);
    assert_eq!(faces(read), faces(&scene));
    assert_eq!(mesh(read, 0).uvs, quad(0.0).uvs);
    for (a, b) in scene.materials.iter().zip(&read.materials) {
        assert_eq!((&a.name, a.alpha, a.opacity), (&b.name, b.alpha, b.opacity));
        assert_eq!((a.shadow_kind(), a.ior), (b.shadow_kind(), b.ior));
        assert_eq!(
            (a.is_double_sided, a.diffuse_texture),
            (b.is_double_sided, b.diffuse_texture)
        );
        for (a, b) in [
            (a.diffuse, b.diffuse),
            (a.transmission, b.transmission),
            (a.emission, b.emission),
        ] {
            assert!((a - b).length() < 1e-12, "{a} {b}");
        }
    }
    assert_eq!(read.lights[0], scene.lights[0]);
    assert_eq!(read.lights[1], scene.lights[1]);
    let LightKind::Spot {
        position: p,
        axis: a,
        inner_cosine,
        outer_cosine,
    } = read.lights[2].kind
    else {
        panic!("{:?}", read.lights[2]);
    };
    assert!(p == position && (a - axis).length() < 1e-15);
    assert!((inner_cosine - 0.9).abs() < 1e-15 && (outer_cosine - 0.8).abs() < 1e-15);
    let camera = read.camera.unwrap();
    assert!(camera.eye == DVec3::new(0.0, 0.0, 9.0) && camera.up == DVec3::Y);
    assert_eq!((camera.at - camera.eye).normalize(), DVec3::NEG_Z);
    assert!((camera.vertical_fov_degrees - 45.0).abs() < 1e-12);
}

#[test]
fn what_does_not_fit_is_told() {
    let (loaded, notes) = glb_of(&tetra(1).unwrap());
    assert_eq!(loaded.scene.objects.len(), 4);
    assert_eq!(loaded.scene.lights.len(), 1);
    let said = |text: &str| assert!(notes.iter().any(|n| n.contains(text)), "{text}: {notes:?}");
    said("the background is not written");
    said("the ambient light is not written: readers take 0");
    said("faces are lit only from the front");
    said("they are written as candela and lux");
    said("1 lights do not weaken with distance: in glTF they do");
    let error = write_glb(&sphereflake(1).unwrap(), &mut Vec::new()).unwrap_err();
    assert_eq!(error.to_string(), "glTF cannot say a sphere (number 1)");
    let third = DVec3::splat(1.0 / 3.0);
    let mut scene = random_scene(&mut Random(1));
    scene.objects.truncate(1);
    if let Shape::Mesh(mesh) = &mut scene.objects[0].shape {
        mesh.positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, third];
        mesh.corners = [0, 1, 2, 0, 1, 3].map(Corner::at).to_vec();
        mesh.corners[0].normal = 0;
        mesh.face_ends = vec![3, 6];
    }
    assert_eq!(
        glb_of(&scene).1,
        [
            "3 of 18 coordinates do not fit glTF's 32 bits: they are rounded, by at most 9.9e-9",
            "1 corners have a normal or a place in a texture that others of their face lack: it \
             is not written"
        ]
    );
    let (empty, _) = glb_of(&Scene::default());
    assert!(empty.scene.objects.is_empty());
}

/// A scene of meshes, each with the triangles of its own corners.
fn scene_of(up: DVec3, meshes: Vec<Vec<DVec3>>) -> Scene {
    let object = |positions: Vec<DVec3>| {
        let count = positions.len() as u32;
        Object {
            name: String::new(),
            shape: Shape::Mesh(Mesh {
                corners: (0..count).map(Corner::at).collect(),
                face_ends: (1..=count / 3).map(|face| 3 * face).collect(),
                positions,
                ..Mesh::default()
            }),
            material: 0,
        }
    };
    Scene {
        up,
        materials: vec![Material::default()],
        objects: meshes.into_iter().map(object).collect(),
        ..Scene::default()
    }
}

const MAP: DVec3 = DVec3::new(691_000.0, 5_334_000.0, 520.0);

fn positions(scene: &Scene) -> Vec<DVec3> {
    let corners = faces(scene).into_iter().flatten();
    let position = |[x, y, z, ..]: [u64; 6]| DVec3::from_array([x, y, z].map(f64::from_bits));
    corners.map(position).collect()
}

#[test]
fn map_coordinates_that_differ_by_32_bits_come_back_exactly() {
    for up in [DVec3::Y, DVec3::Z] {
        let mut random = Random(5);
        let mut near = |size: f64| {
            // 20 bits, which the sum has room for.
            let offset = |_| random.below(1 << 20) as f64 * size / f64::from(1 << 20);
            MAP + DVec3::from_array([0; 3].map(offset))
        };
        // A face of 12.5 cm, and a whole district.
        let small: Vec<_> = (0..3).map(|_| near(0.125)).collect();
        let large: Vec<_> = (0..30).map(|_| near(1024.0)).collect();
        let scene = scene_of(up, vec![small, large]);
        let (loaded, notes) = glb_of(&scene);
        let turned = |p: DVec3| match up == DVec3::Z {
            true => DVec3::new(p.x, p.z, -p.y),
            false => p,
        };
        let expected: Vec<_> = positions(&scene).into_iter().map(turned).collect();
        assert_eq!(positions(&loaded.scene), expected);
        assert!(
            !notes.iter().any(|note| note.contains("rounded")),
            "{notes:?}"
        );
    }
}

#[test]
fn map_coordinates_in_decimals_are_rounded_by_no_more_than_their_size_asks() {
    let face = [[0.0, 0.0, 0.01], [0.1, 0.0, 0.02], [0.0, 0.1, 0.03]];
    let face: Vec<_> = face.iter().map(|&p| MAP + DVec3::from_array(p)).collect();
    // Far from it another, and one that shares a corner with that.
    let far: Vec<_> = face.iter().map(|&p| p - MAP + DVec3::splat(0.3)).collect();
    let beside = vec![far[0], far[1] * 1.1, far[2] * 900.0];
    let scene = scene_of(DVec3::Y, vec![face, far, beside]);
    let (loaded, notes) = glb_of(&scene);
    let [before, after] = [&scene, &loaded.scene].map(positions);
    assert_eq!(before.len(), after.len(), "{notes:?}");
    for (before, after) in before[..6].iter().zip(&after) {
        assert!((*before - *after).length() < 1e-7, "{before} {after}");
    }
    // A corner that two meshes share is still one.
    assert_eq!(after[3], after[6]);
    assert!(
        notes
            .iter()
            .any(|note| note.contains("are rounded, by at most"))
    );
    // Once rounded, nothing changes any more.
    let (again, _) = glb_of(&loaded.scene);
    assert_eq!(positions(&again.scene), after);
}

#[test]
fn what_is_converted_twice_stays_the_same_bit_for_bit() {
    let mut random = Random(17);
    let mut moved_count = 0;
    for number in 0..300 {
        let up = [DVec3::Y, DVec3::Z][number % 2];
        // Few corners and many, even and odd; as wide as the map and far narrower.
        let size = [1e-3, 7.0, 3e4, 2e6][number / 2 % 4];
        let mut coordinate = || size * (random.next() as f64 / 2.0_f64.powi(64) - 0.3);
        let mut point = || DVec3::new(coordinate(), coordinate(), coordinate());
        let mut meshes: Vec<Vec<DVec3>> = (1..4)
            .map(|faces| (0..3 * faces).map(|_| MAP + point()).collect())
            .collect();
        // Two share a corner.
        if number % 3 == 0 {
            meshes[0][0] = meshes[2][4];
        }
        let scene = scene_of(up, meshes);
        let (second, _) = glb_of(&scene);
        let (third, _) = glb_of(&second.scene);
        let [before, after] = [&second.scene, &third.scene].map(positions);
        assert_eq!(after, before, "{number}");
        moved_count += u32::from(positions(&scene) != before);
    }
    assert!(moved_count > 250, "{moved_count}");
}

#[test]
fn triangles_that_rounding_makes_lines_are_counted_and_never_all() {
    // One mesh with a face at either end of the world.
    let face = [DVec3::ZERO, DVec3::X * 1e-3, DVec3::Y * 1e-3];
    let near = face.map(|p| p + DVec3::splat(0.1));
    let far = |at: f64| face.map(|p| p + DVec3::new(at + 0.1, at + 0.3, 0.0));
    let mesh = [near, far(1e8), far(1e8 + 1.0)].concat();
    let (loaded, notes) = glb_of(&scene_of(DVec3::Y, vec![mesh]));
    let said = "1 of 3 triangles have no area once their corners are rounded: they are lost";
    assert!(notes.iter().any(|note| note == said), "{notes:?}");
    assert_eq!(faces(&loaded.scene).len(), 2);
    // Nearly on one line, from end to end.
    let thin = [[0.0, 0.0], [1e8, 1e8], [2e8, 2e8 + 1.0]];
    let thin = thin.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
    let error = write_glb(&scene_of(DVec3::Y, vec![thin]), &mut Vec::new());
    let said = error.expect_err("nothing is left").to_string();
    assert!(
        said.contains("all 1 triangles would lose their area"),
        "{said}"
    );
}

#[test]
fn other_peoples_scenes_survive() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for extension in ["glb", "gltf"] {
        for path in files_below(&folder.join("gltf"), extension) {
            // Its pictures take long to compress where nothing is optimised.
            if path.ends_with("FlightHelmet.gltf") {
                continue;
            }
            let Ok(first) = read_file(&path, &Default::default()) else {
                continue;
            };
            let (second, _) = glb_of(&first.scene);
            let (third, _) = glb_of(&second.scene);
            // Once rounded, nothing changes any more.
            assert_eq!(
                positions(&third.scene),
                positions(&second.scene),
                "{}",
                path.display()
            );
            assert_eq!(second.scene.textures, first.scene.textures);
            let kinds = |scene: &Scene| -> Vec<_> {
                let materials = scene.objects.iter().map(|o| &scene.materials[o.material]);
                materials
                    .map(|m| (m.shadow_kind(), m.is_double_sided))
                    .collect()
            };
            assert_eq!(
                kinds(&third.scene),
                kinds(&second.scene),
                "{}",
                path.display()
            );
        }
    }
}
