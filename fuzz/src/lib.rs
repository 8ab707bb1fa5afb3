//! What the fuzz targets share.
//!
//! In: what a reader returned. Out: nothing, or a panic where a promise of the readers is broken.

use std::path::Path;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions,
    model::{Corner, Scene},
    read::{read_gltf, read_obj, read_ply},
    write::{Precision, write_glb, write_obj, write_ply},
};

/// Checks what [`antumbra_scene::model`] promises: indices in range, numbers finite, faces of at
/// least three corners; and that the number of warnings is bounded.
pub fn check(loaded: &Loaded) {
    assert!(loaded.warnings.len() < 200);
    let scene = &loaded.scene;
    assert!(scene.up != DVec3::ZERO && scene.up.is_finite());
    for object in &scene.objects {
        assert!(object.material < scene.materials.len());
        let bounds = object.shape.bounds();
        assert!(bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty());
        let Some(mesh) = object.shape.placed_mesh() else {
            continue;
        };
        assert_eq!(mesh.face_ends.last(), Some(&(mesh.corners.len() as u32)));
        assert!(mesh.faces().all(|face| face.len() >= 3));
        for corner in &mesh.corners {
            assert!((corner.position as usize) < mesh.positions.len());
            assert!(corner.normal == Corner::NONE || (corner.normal as usize) < mesh.normals.len());
            assert!(corner.uv == Corner::NONE || (corner.uv as usize) < mesh.uvs.len());
        }
        assert!(mesh.colors.is_empty() || mesh.colors.len() == mesh.positions.len());
        let is_color = |color: &[f32; 4]| color.iter().all(|c| c.is_finite() && *c >= 0.0);
        assert!(mesh.colors.iter().all(is_color));
        assert!(mesh.normals.iter().all(|normal| normal.is_finite()));
    }
}

/// Returns the corners of every face of every mesh, bit by bit: positions and normals.
pub fn faces(scene: &Scene) -> Vec<Vec<[u64; 6]>> {
    let mut faces = Vec::new();
    for object in &scene.objects {
        let Some(mesh) = object.shape.placed_mesh() else {
            continue;
        };
        for face in mesh.faces() {
            let corner = |corner: &Corner| {
                let position = mesh.positions[corner.position as usize].to_array();
                let normal = mesh.normals.get(corner.normal as usize);
                // A normal of -0 is none as well.
                let normal = normal.copied().unwrap_or(DVec3::ZERO) + DVec3::ZERO;
                let normal = normal.to_array();
                let [[x, y, z], [nx, ny, nz]] = [position, normal].map(|v| v.map(f64::to_bits));
                [x, y, z, nx, ny, nz]
            };
            faces.push(face.iter().map(corner).collect());
        }
    }
    faces
}

/// Writes a scene as PLY, reads that back, and checks that no face has changed.
pub fn check_ply(scene: &Scene) {
    let mut bytes = Vec::new();
    write_ply(scene, &mut bytes).unwrap();
    let again = read_ply(Path::new("a.ply"), &bytes, &ReadOptions::default()).unwrap();
    assert_eq!(faces(&again.scene), faces(scene));
}

/// Writes a scene as OBJ, reads that back, and checks that no face has changed; a scene that OBJ
/// can say without a note is read back as it is.
pub fn check_obj(scene: &Scene) {
    let (mut text, mut library) = (Vec::new(), Vec::new());
    let notes = write_obj(scene, Precision::Exact, "a.mtl", &mut text, &mut library).unwrap();
    let open = &mut |_: &str| Ok(library.clone());
    let again = read_obj(Path::new("a.obj"), &text, &ReadOptions::default(), open).unwrap();
    if notes.is_empty() {
        assert_eq!(again.scene, *scene);
        return;
    }
    // Objects of one name become one.
    let sorted = |scene| {
        let mut faces = faces(scene);
        faces.sort();
        faces
    };
    assert_eq!(sorted(&again.scene), sorted(scene));
}

/// Writes a scene as GLB and reads that back; what was read is then written and read back equal.
pub fn check_glb(scene: &Scene) {
    let write = |scene: &Scene| {
        let mut bytes = Vec::new();
        write_glb(scene, &mut bytes).unwrap();
        let open = &mut |_: &str| unreachable!("a GLB is one file");
        read_gltf(Path::new("a.glb"), &bytes, &ReadOptions::default(), open).unwrap().scene
    };
    let second = write(scene);
    let third = write(&second);
    let positions = |scene: &Scene| -> Vec<[u64; 3]> {
        let corners = faces(scene).into_iter().flatten();
        corners.map(|[x, y, z, ..]| [x, y, z]).collect()
    };
    assert_eq!(positions(&third), positions(&second));
    assert_eq!(third.lights.len(), second.lights.len());
}
