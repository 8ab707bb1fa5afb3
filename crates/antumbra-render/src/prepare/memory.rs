//! Memory of a scene and of its surfaces, told before the surfaces are made.
//!
//! In: a scene. Out: bytes. What vectors hold is counted; the surfaces' share is a bound from
//! counts, since polygons are not cut yet.

use std::collections::HashSet;

use antumbra_scene::model::{Mesh, Object, Scene, ShadowKind, Shape};

/// Bytes a triangle takes among the surfaces: vertices, corners, element, and their share of a
/// vector that doubles when it is full.
const TRIANGLE: u64 = 80;
/// Bytes that texture coordinates add to a triangle of a face with holes.
const ALPHA_TEST: u64 = 112;
/// Bytes an element takes: kind, surfaces, opacity, place.
const ELEMENT: u64 = 64;
/// Bytes a vertex takes, its entry in the table of equal positions counted.
const VERTEX: u64 = 120;
/// Bytes a curved shape takes, its entry in the table of equal shapes counted.
const CURVED: u64 = 600;

/// Returns the bytes that a scene holds.
pub fn scene_bytes(scene: &Scene) -> u64 {
    fn bytes<T>(items: &Vec<T>) -> u64 {
        (items.capacity() * size_of::<T>()) as u64
    }
    let of_mesh = |mesh: &Mesh| {
        bytes(&mesh.positions)
            + bytes(&mesh.normals)
            + bytes(&mesh.uvs)
            + bytes(&mesh.colors)
            + bytes(&mesh.corners)
            + bytes(&mesh.face_ends)
    };
    let of_object = |object: &Object| {
        object.name.capacity() as u64
            + match &object.shape {
                Shape::Mesh(mesh) => of_mesh(mesh),
                Shape::Polygon(polygon) => bytes(&polygon.vertices) + bytes(&polygon.normals),
                Shape::Sphere(_) | Shape::Cone(_) | Shape::Disk(_) => 0,
            }
    };
    let texels: u64 = scene.textures.iter().map(|t| bytes(&t.texels)).sum();
    bytes(&scene.objects)
        + scene.objects.iter().map(of_object).sum::<u64>()
        + bytes(&scene.materials)
        + bytes(&scene.textures)
        + texels
        + bytes(&scene.lights)
}

/// Returns about how many bytes [`Gathered::of`](super::Gathered::of) takes at its height; not
/// less, unless outlines cross themselves.
pub fn surface_bytes(scene: &Scene) -> u64 {
    let mut masked_textures = HashSet::new();
    let of_object = |object: &Object| {
        let material = scene.materials.get(object.material);
        let is_masked = material.is_some_and(|m| m.shadow_kind() == ShadowKind::AlphaTested);
        if is_masked {
            masked_textures.extend(material.and_then(|material| material.diffuse_texture));
        }
        let triangle = TRIANGLE + if is_masked { ALPHA_TEST } else { 0 };
        match &object.shape {
            Shape::Mesh(mesh) => {
                // A face of n corners makes n - 2 triangles.
                let triangles = mesh.corners.len().saturating_sub(mesh.face_ends.len()) as u64;
                triangles * triangle
                    + mesh.face_ends.len() as u64 * ELEMENT
                    + mesh.positions.len() as u64 * VERTEX
            }
            Shape::Polygon(polygon) => {
                ELEMENT + polygon.vertices.len() as u64 * (triangle + VERTEX)
            }
            Shape::Sphere(_) | Shape::Disk(_) => ELEMENT + CURVED,
            Shape::Cone(_) => ELEMENT + 3 * CURVED,
        }
    };
    let surfaces: u64 = scene.objects.iter().map(of_object).sum();
    let copies: u64 = masked_textures
        .iter()
        .filter_map(|&texture| scene.textures.get(texture))
        .map(|texture| 4 * texture.texels.len() as u64)
        .sum();
    surfaces + copies
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_geometry::DVec3;
    use antumbra_scene::model::{Corner, Material};

    #[test]
    fn what_is_predicted_suffices() {
        // A strip of separate triangles: the most vertices a mesh can have.
        let count = 3 * 1000;
        let mesh = Mesh {
            positions: (0..count)
                .map(|i| DVec3::new(f64::from(i), f64::from(i % 7), f64::from(i % 3)))
                .collect(),
            corners: (0..count as u32).map(Corner::at).collect(),
            face_ends: (1..=1000).map(|face| 3 * face).collect(),
            ..Mesh::default()
        };
        let scene = Scene {
            materials: vec![Material::default()],
            objects: vec![Object {
                name: String::new(),
                shape: Shape::Mesh(mesh),
                material: 0,
            }],
            ..Scene::default()
        };
        assert!(scene_bytes(&scene) >= 3000 * (24 + 12) + 4000);
        let gathered = super::super::Gathered::of(&scene).unwrap();
        let places = size_of_val(gathered.places()) as u64;
        let taken = gathered.occluders().memory_bytes() + places;
        let predicted = surface_bytes(&scene);
        assert!(predicted >= taken, "{predicted} < {taken}");
        assert!(predicted < 5 * taken, "{predicted} is far above {taken}");
    }
}
