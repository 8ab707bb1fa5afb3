//! What the fuzz targets share.
//!
//! In: what a reader returned. Out: nothing, or a panic where a promise of the readers is broken.

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded,
    model::{Corner, Scene, Shape},
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
        let Shape::Mesh(mesh) = &object.shape else {
            continue;
        };
        assert_eq!(mesh.face_ends.last(), Some(&(mesh.corners.len() as u32)));
        assert!(mesh.faces().all(|face| face.len() >= 3));
        for corner in &mesh.corners {
            assert!((corner.position as usize) < mesh.positions.len());
            assert!(corner.normal == Corner::NONE || (corner.normal as usize) < mesh.normals.len());
            assert!(corner.uv == Corner::NONE || (corner.uv as usize) < mesh.uvs.len());
        }
        assert!(mesh.normals.iter().all(|normal| normal.is_finite()));
    }
}

/// Returns the corners of every face of every mesh, bit by bit: positions and normals.
pub fn faces(scene: &Scene) -> Vec<Vec<[u64; 6]>> {
    let mut faces = Vec::new();
    for object in &scene.objects {
        let Shape::Mesh(mesh) = &object.shape else {
            continue;
        };
        for face in mesh.faces() {
            let corner = |corner: &Corner| {
                let position = mesh.positions[corner.position as usize].to_array();
                let normal = mesh.normals.get(corner.normal as usize);
                let normal = normal.copied().unwrap_or(DVec3::ZERO).to_array();
                let [[x, y, z], [nx, ny, nz]] = [position, normal].map(|v| v.map(f64::to_bits));
                [x, y, z, nx, ny, nz]
            };
            faces.push(face.iter().map(corner).collect());
        }
    }
    faces
}
