//! Other people's scenes: every NFF, OBJ, PLY and STL loads, and the counts are those of their README.

use antumbra_scene::{
    Loaded, ReadOptions,
    defaults::frame_camera,
    model::{Mesh, Shape},
    read_file,
};

use crate::support::{beside_shadows, files_below, shared_scenes};

fn faces(mesh: &Mesh) -> usize {
    mesh.face_ends.len()
}

/// Spheres, cones, polygons without and with normals, faces of meshes.
fn counts(loaded: &Loaded) -> [usize; 5] {
    let mut counts = [0; 5];
    for object in &loaded.scene.objects {
        match &object.shape {
            Shape::Sphere(_) => counts[0] += 1,
            Shape::Cone(_) => counts[1] += 1,
            Shape::Polygon(p) if p.normals.is_empty() => counts[2] += 1,
            Shape::Polygon(_) => counts[3] += 1,
            Shape::Mesh(mesh) => counts[4] += faces(mesh),
            Shape::Instance(instance) => counts[4] += faces(&instance.mesh),
            Shape::Disk(_) | Shape::Patch(_) | Shape::Implicit(_) => {}
        }
    }
    counts
}

#[test]
fn counts_are_those_of_the_readme() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for (file, expected, lights) in [
        ("nff/spd/tetra_3.nff", [0, 0, 64, 0, 0], 1),
        ("nff/spd/tetra_6.nff", [0, 0, 4096, 0, 0], 1),
        ("nff/spd/balls_2.nff", [91, 0, 1, 0, 0], 3),
        ("nff/spd/balls_3.nff", [820, 0, 1, 0, 0], 3),
        ("nff/spd/gears_2.nff", [0, 0, 1169, 0, 0], 5),
        ("nff/spd/tree_3.nff", [15, 15, 1, 0, 0], 7),
        ("nff/spd/sample_1.nff", [0, 1, 16, 864, 0], 1),
        ("nff/dialect-assimp/WithCamera.nff", [3, 0, 1, 0, 0], 0),
        ("nff/dialect-assimp/cone.nff", [2, 2, 0, 0, 0], 0),
        ("nff/dialect-assimp/spheres.nff", [4, 0, 0, 0, 0], 0),
        (
            "mesh/cornell-box/CornellBox-Original.obj",
            [0, 0, 0, 0, 18],
            0,
        ),
        (
            "mesh/cornell-box/CornellBox-Sphere.obj",
            [0, 0, 0, 0, 2188],
            0,
        ),
        (
            "mesh/cornell-box/CornellBox-Mirror.obj",
            [0, 0, 0, 0, 18],
            0,
        ),
        ("mesh/teapot/teapot.obj", [0, 0, 0, 0, 8028], 0),
        ("mesh/mori-knob/testObj.obj", [0, 0, 0, 0, 11970], 0),
        ("mesh/lost-empire/lost_empire.obj", [0, 0, 0, 0, 112_499], 0),
        (
            "mesh/odedstein/spot_low_resolution.obj",
            [0, 0, 0, 0, 1654],
            0,
        ),
        ("mesh/odedstein/wingnut.obj", [0, 0, 0, 0, 6090], 0),
        ("mesh/odedstein/penguin.obj", [0, 0, 0, 0, 6720], 0),
        ("mesh/odedstein/plane_holes.obj", [0, 0, 0, 0, 16747], 0),
        (
            "mesh/space-shuttle-orbiter/space-shuttle-orbiter.obj",
            [0, 0, 0, 0, 11542],
            0,
        ),
        ("mesh/ply/egyptcat.ply", [0, 0, 0, 0, 16000], 0),
        ("mesh/ply/bevel-suzanne.ply", [0, 0, 0, 0, 500], 0),
        ("mesh/ply/platonic_shelf_ascii.ply", [0, 0, 0, 0, 50], 0),
        (
            "mesh/ply/platonic_shelf_big_endian.ply",
            [0, 0, 0, 0, 50],
            0,
        ),
        ("mesh/ply/featuretype.ply", [0, 0, 0, 0, 3476], 0),
        ("mesh/stl/featuretype.STL", [0, 0, 0, 0, 3476], 0),
        ("mesh/stl/HalfDonut_ascii.stl", [0, 0, 0, 0, 288], 0),
        ("mesh/stl/HalfDonut_binary.stl", [0, 0, 0, 0, 288], 0),
    ] {
        let loaded = read_file(&folder.join(file), &ReadOptions::default()).unwrap();
        // Faces that were dropped have been counted in the warnings.
        let dropped: usize = loaded
            .warnings
            .iter()
            .filter(|w| w.message.contains("dropped"))
            .map(|w| {
                let count = w
                    .message
                    .split(['(', ' '])
                    .find_map(|word| word.parse::<usize>().ok());
                if w.message.ends_with("dropped") {
                    1
                } else {
                    count.unwrap()
                }
            })
            .sum();
        let mut found = counts(&loaded);
        found[4] += dropped;
        assert_eq!(found, expected, "{file}: {:?}", loaded.warnings);
        assert_eq!(loaded.scene.lights.len(), lights, "{file}");
    }
}

/// The SPD files are NFF as it should be.
#[test]
fn spd_files_need_no_warning() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for path in files_below(&folder.join("nff/spd"), "nff") {
        let loaded = read_file(&path, &ReadOptions::default()).unwrap();
        assert_eq!(beside_shadows(&loaded), [""; 0], "{}", path.display());
        let camera = loaded.scene.camera.unwrap();
        assert_eq!(camera.resolution, Some([512, 512]));
        assert_eq!(camera.vertical_fov_degrees, 45.0);
    }
}

/// Whatever is not in `malformed/` loads, but for the file that tests zero indices.
#[test]
fn every_well_formed_file_loads() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let mut seen = 0;
    for extension in ["nff", "obj", "ply", "stl", "STL"] {
        for path in files_below(&folder, extension) {
            if path.starts_with(folder.join("malformed")) {
                continue;
            }
            seen += 1;
            let result = read_file(&path, &ReadOptions::default());
            if path.ends_with("issue-140-zero-face-idx.obj") {
                let error = result.unwrap_err().to_string();
                assert!(
                    error.contains("obj:16: in `f`: index 0 names no `v`"),
                    "{error}"
                );
                continue;
            }
            let loaded = result.unwrap();
            assert!(!loaded.scene.objects.is_empty(), "{}", path.display());
            let camera = frame_camera(&loaded.scene.bounds(), loaded.scene.up);
            assert!(camera.eye.is_finite());
        }
    }
    assert!(seen >= 30, "only {seen} files");
}
