//! Other people's glTF files: every one loads or is refused for the reason its README gives, with
//! as many triangles as it says.

use std::{borrow::Cow, path::Path};

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadError, ReadOptions,
    model::{Corner, LightKind, Material, Mesh, Object, ShadowKind},
    read_file,
};

use crate::support::{files_below, shared_scenes};

fn read(folder: &Path, file: &str) -> Result<Loaded, ReadError> {
    read_file(&folder.join(file), &ReadOptions::default())
}

fn mesh(object: &Object) -> Cow<'_, Mesh> {
    let mesh = object.shape.placed_mesh();
    mesh.unwrap_or_else(|| panic!("{:?}", object.shape))
}

/// Triangles, those without area that were dropped included.
fn triangles(loaded: &Loaded) -> usize {
    let whole: usize = loaded
        .scene
        .objects
        .iter()
        .map(|o| mesh(o).face_ends.len())
        .sum();
    let dropped = loaded.warnings.iter().find_map(|w| {
        let rest = w.message.strip_prefix("a triangle has no area: dropped")?;
        let count = rest.split(['(', ' ']).find_map(|word| word.parse().ok());
        Some(count.unwrap_or(1))
    });
    whole + dropped.unwrap_or(0)
}

/// File, triangles, objects, textures, lights.
const FILES: [(&str, usize, usize, usize, usize); 20] = [
    ("AlphaBlendModeTest.glb", 61, 9, 3, 0),
    ("AttenuationTest.glb", 292, 23, 2, 0),
    ("BoxInterleaved.glb", 12, 1, 0, 0),
    ("CornellBox.glb", 36, 6, 0, 0),
    ("Cubes.glb", 36, 3, 0, 1),
    ("Fox.glb", 576, 1, 1, 0),
    ("IrradianceVolumeExample.glb", 32, 4, 0, 0),
    ("KHR_lights_punctual_test.glb", 14, 2, 0, 3),
    ("SpecularTest.glb", 44828, 24, 1, 0),
    ("nested.glb", 36, 3, 0, 0),
    ("retroufo.glb", 16428, 77, 0, 0),
    ("simple-instancing.glb", 1500, 125, 0, 0),
    ("terrain.glb", 31422, 1, 2, 0),
    ("torus_embedded.gltf", 3072, 1, 0, 0),
    ("01_alpha_mask/01_alpha_mask.gltf", 2, 1, 1, 0),
    ("02_node_hierarchy/02_node_hierarchy.gltf", 60, 2, 0, 0),
    ("CesiumMilkTruck/glTF/CesiumMilkTruck.gltf", 3624, 5, 1, 0),
    (
        "CesiumMilkTruck/glTF-Draco/CesiumMilkTruck.gltf",
        3624,
        5,
        1,
        0,
    ),
    ("FlightHelmet/FlightHelmet.gltf", 94722, 6, 10, 0),
    ("MultiUVTest/MultiUVTest.gltf", 12, 1, 1, 0),
];

#[test]
fn counts_are_those_of_the_readme() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for (file, expected, objects, textures, lights) in FILES {
        let loaded = read(&folder.join("gltf"), file).unwrap();
        assert_eq!(triangles(&loaded), expected, "{file}");
        let scene = &loaded.scene;
        let counts = [
            scene.objects.len(),
            scene.textures.len(),
            scene.lights.len(),
        ];
        assert_eq!(counts, [objects, textures, lights], "{file}");
        assert_eq!(scene.is_photometric, lights > 0, "{file}");
        assert_eq!(scene.up, DVec3::Y);
    }
}

/// Everything in the folder loads, and keeps the model's promises.
#[test]
fn every_file_loads() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let folder = folder.join("gltf");
    let mut seen = 0;
    for path in ["glb", "gltf"].iter().flat_map(|e| files_below(&folder, e)) {
        seen += 1;
        let loaded = read_file(&path, &ReadOptions::default()).unwrap();
        check(&loaded);
        let name = path.file_stem().unwrap().to_string_lossy();
        let expected = match &*name {
            "SimpleSkin" => 8,
            n if n.starts_with("Node_Attribute") => 54,
            n if n.starts_with("Material_AlphaMask") || n.starts_with("Buffer_Interleaved") => 2,
            "AnimatedMorphCube" | "SimpleSparseAccessor" => 12,
            n if n.starts_with("Mesh_PrimitiveMode") => {
                // Points, lines, loops, strips, then triangles in three modes, twice over.
                let number: usize = n[n.len() - 2..].parse().unwrap();
                if matches!(number, 4..=6 | 11..) { 2 } else { 0 }
            }
            _ => continue,
        };
        assert_eq!(triangles(&loaded), expected, "{name}");
    }
    assert!(seen >= 55, "only {seen} files");
}

/// What is finite, and what is in range.
pub(crate) fn check(loaded: &Loaded) {
    let scene = &loaded.scene;
    for object in &scene.objects {
        let material = &scene.materials[object.material];
        assert!(
            material
                .diffuse_texture
                .is_none_or(|t| t < scene.textures.len())
        );
        let bounds = object.shape.bounds();
        assert!(bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty());
        let mesh = mesh(object);
        assert!(mesh.normals.iter().all(|n| n.is_finite()));
        assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()));
        for corner in &mesh.corners {
            assert!((corner.position as usize) < mesh.positions.len());
            for (index, count) in [
                (corner.normal, mesh.normals.len()),
                (corner.uv, mesh.uvs.len()),
            ] {
                assert!(index == Corner::NONE || (index as usize) < count);
            }
        }
    }
}

#[test]
fn malformed_files_are_refused() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let files = [
        (
            "assimp/BoxTextured.gltf",
            ": buffers[0].uri: cannot read `BoxTextured0.bin`",
        ),
        (
            "khronos-validator/buffer-not_found.gltf",
            ": buffers[0].uri: cannot read `not_found.bin`",
        ),
        (
            "khronos-validator/glb-invalid_magic.glb",
            ": byte 0: expected a file that begins",
        ),
        (
            "khronos-validator/glb-truncated_chunk_data.glb",
            ": byte 8: the header says 48 bytes, the file has 47",
        ),
        (
            "khronos-validator/index_buffer_oob.gltf",
            ": meshes[0].primitives[0].indices: element 5 of accessors[0] (byte 5 of buffers[0]) \
             is 5, but there are 4 vertices",
        ),
        (
            "khronos-validator/node-node_loop.gltf",
            ": nodes[0]: the node is in a loop",
        ),
        (
            "lfs-pointer/sponza.glb",
            ": expected a scene, found a git-lfs pointer",
        ),
        (
            "magnum/buffer-invalid-short-size-embedded.gltf",
            ": buffers[0].byteLength: the file says 24 bytes, but there are 12",
        ),
        ("magnum/error.gltf", ":2: asset: invalid length 0"),
        (
            "magnum/required-extensions-unsupported.gltf",
            ": extensionsRequired[1]: the extension `EXT_lights_image_based`",
        ),
        (
            "magnum/scene-invalid-cycle-deep.gltf",
            ": nodes[0]: the node is in a loop",
        ),
        (
            "tinygltf/invalid-buffer-view-index.gltf",
            ": accessors[0].bufferView: bufferViews[1] is not there: the file has 1",
        ),
    ];
    for (file, reason) in files {
        let error = read(&folder.join("malformed/gltf"), file)
            .unwrap_err()
            .to_string();
        assert!(error.contains(&format!("{file}{reason}")), "{error}");
    }
    let folder = folder.join("malformed/gltf");
    let all = ["glb", "gltf"].map(|e| files_below(&folder, e).len());
    assert_eq!(all.iter().sum::<usize>(), files.len());
}

/// A mirrored node is turned right again: faces wind as their normals say.
#[test]
fn winding_agrees_with_normals() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let files = [
        "IrradianceVolumeExample.glb",
        "nested.glb",
        "Cubes.glb",
        "torus_embedded.gltf",
    ];
    for file in files {
        let loaded = read(&folder.join("gltf"), file).unwrap();
        for mesh in loaded.scene.objects.iter().map(mesh) {
            for face in mesh.faces() {
                let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[face[i].position as usize]);
                let said = face
                    .iter()
                    .map(|corner| mesh.normals[corner.normal as usize]);
                let front = (b - a).cross(c - a);
                assert!(front.dot(said.sum()) > 0.0, "{file}: {front}");
            }
        }
    }
}

#[test]
fn lights_and_cameras() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let scene = read(&folder.join("gltf"), "KHR_lights_punctual_test.glb")
        .unwrap()
        .scene;
    assert!(scene.camera.is_some());
    let kinds = scene.lights.iter().map(|light| match light.kind {
        LightKind::Spot {
            inner_cosine,
            outer_cosine,
            ..
        } => {
            assert!(outer_cosine <= inner_cosine && light.falls_off);
            "spot"
        }
        LightKind::Directional { .. } => {
            assert!(!light.falls_off);
            "directional"
        }
        LightKind::Point { .. } => "point",
    });
    let mut kinds: Vec<_> = kinds.collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["directional", "point", "spot"]);
}

fn kinds(folder: &Path, file: &str) -> Vec<(String, ShadowKind)> {
    let scene = read(&folder.join("gltf"), file).unwrap().scene;
    let kind = |material: &Material| (material.name.clone(), material.shadow_kind());
    scene.materials.iter().map(kind).collect()
}

#[test]
fn materials_say_what_blocks() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    // Five modes side by side: blended, opaque, three cut-offs; and the labels.
    let found = kinds(&folder, "AlphaBlendModeTest.glb");
    let count = |kind| found.iter().filter(|(_, k)| *k == kind).count();
    assert!(count(ShadowKind::AlphaTested) >= 3, "{found:?}");
    assert!(count(ShadowKind::Transparent) >= 1, "{found:?}");
    assert!(count(ShadowKind::Opaque) >= 1, "{found:?}");
    let helmet = kinds(&folder, "FlightHelmet/FlightHelmet.gltf");
    let lens = |name: &str| name.contains("Lenses");
    for (name, kind) in helmet {
        assert_eq!(kind == ShadowKind::Transparent, lens(&name), "{name}");
    }
    let glass = kinds(&folder, "AttenuationTest.glb");
    assert!(
        glass
            .iter()
            .filter(|(_, k)| *k == ShadowKind::Transparent)
            .count()
            >= 10
    );
    let mask = kinds(&folder, "01_alpha_mask/01_alpha_mask.gltf");
    assert_eq!(mask[0].1, ShadowKind::AlphaTested);
    let folder = &folder;
    let cutoffs: Vec<_> = (0..7)
        .map(|i| {
            kinds(
                folder,
                &format!("AssetGenerator/Material_AlphaMask/Material_AlphaMask_{i:02}.gltf"),
            )[0]
            .1
        })
        .collect();
    // Cut-off 0 (number 3) keeps all, above 1 (number 4) nothing.
    assert!(cutoffs.contains(&ShadowKind::Opaque), "{cutoffs:?}");
    assert!(cutoffs.contains(&ShadowKind::Transparent), "{cutoffs:?}");
}

/// A mesh packed by Draco is the plain one, in another order and rounded: each triangle has a twin, corner by corner.
#[test]
fn the_draco_truck_has_the_triangles_of_its_plain_twin() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let of = |kind: &str| {
        let file = format!("CesiumMilkTruck/{kind}/CesiumMilkTruck.gltf");
        read(&folder.join("gltf"), &file).unwrap().scene.objects
    };
    let (plain, packed) = (of("glTF"), of("glTF-Draco"));
    assert_eq!(plain.len(), packed.len());
    for (plain, packed) in plain.iter().zip(&packed) {
        let bounds = plain.shape.bounds();
        // The file's positions have 11 bits of the longest side: half a step along each axis, turned by nodes.
        let step = (bounds.max - bounds.min).max_element() / f64::from((1 << 11) - 1);
        let near = 3.0_f64.sqrt() / 2.0 * step * 1.01;
        let triangles = |object: &Object| -> Vec<[DVec3; 3]> {
            let mesh = mesh(object);
            let corners = |face: &[Corner]| -> [DVec3; 3] {
                std::array::from_fn(|i| mesh.positions[face[i].position as usize])
            };
            mesh.faces().map(corners).collect()
        };
        let (plain_triangles, packed_triangles) = (triangles(plain), triangles(packed));
        assert_eq!(plain_triangles.len(), packed_triangles.len());
        let is_twin = |a: &[DVec3; 3], b: &[DVec3; 3]| {
            // The same winding, from any corner.
            (0..3).any(|turn| (0..3).all(|i| (a[i] - b[(i + turn) % 3]).length() <= near))
        };
        let mut is_taken = vec![false; packed_triangles.len()];
        for triangle in &plain_triangles {
            let twin = (0..packed_triangles.len())
                .filter(|&i| !is_taken[i] && is_twin(triangle, &packed_triangles[i]))
                .min_by(|&i, &j| {
                    let distance = |i: usize| {
                        let middle = |t: &[DVec3; 3]| t[0] + t[1] + t[2];
                        (middle(&packed_triangles[i]) - middle(triangle)).length()
                    };
                    distance(i).total_cmp(&distance(j))
                });
            let twin = twin.unwrap_or_else(|| panic!("{}: {triangle:?} is alone", plain.name));
            is_taken[twin] = true;
        }
    }
}
