//! Memory of a scene and of its surfaces, predicted before the surfaces are made.
//!
//! In: a scene. Out: bytes. What vectors hold is counted; the surfaces' share is a bound from
//! counts, since polygons are not cut yet.

use std::collections::HashSet;
use std::sync::Arc;

use crate::model::{AreaLight, Material, Mesh, Object, Scene, ShadowKind, Shape};
use antumbra_geometry::{AreaShape, BezierPatch, Field, Implicit, OccludersBuilder};

/// Bytes that texture coordinates add to a triangle of a face with holes, with the share of a vector
/// that doubles when it is full.
const ALPHA_TEST: u64 = 112;
/// Bytes an object takes: which elements are its.
const OBJECT: u64 = 16;
/// Bytes a curved shape takes, its entry in the table of equal shapes counted.
const CURVED: u64 = 600;

/// Bytes a part of a patch takes beside its entry among curved shapes.
const PART: u64 = 720;

/// Returns what an implicit surface holds.
fn implicit_bytes(implicit: &Implicit) -> u64 {
    let held = match &implicit.field {
        Field::Metaballs { balls, .. } => size_of_val(balls.as_slice()),
        Field::Polynomial { terms, .. } => size_of_val(terms.as_slice()),
        Field::Torus { .. } | Field::Gyroid { .. } => 0,
    };
    (size_of::<Implicit>() + held) as u64
}

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
    let mut seen = HashSet::new();
    let of_object = |object: &Object| {
        object.name.capacity() as u64
            + match &object.shape {
                Shape::Mesh(mesh) => of_mesh(mesh),
                // Copies share their mesh.
                Shape::Instance(instance) => match seen.insert(Arc::as_ptr(&instance.mesh)) {
                    true => of_mesh(&instance.mesh),
                    false => 0,
                },
                Shape::Polygon(polygon) => bytes(&polygon.vertices) + bytes(&polygon.normals),
                Shape::Sphere(_) | Shape::Cone(_) | Shape::Disk(_) => 0,
                Shape::Patch(_) => size_of::<BezierPatch>() as u64,
                Shape::Implicit(implicit) => implicit_bytes(implicit),
            }
    };
    let of_area = |light: &AreaLight| match &light.shape {
        AreaShape::Mesh(mesh) => size_of_val(mesh.triangles()) as u64,
        AreaShape::Polygon(polygon) => size_of_val(polygon.corners()) as u64,
        _ => 0,
    };
    let texels: u64 = scene.textures.iter().map(|t| bytes(&t.texels)).sum();
    bytes(&scene.objects)
        + scene.objects.iter().map(of_object).sum::<u64>()
        + bytes(&scene.materials)
        + bytes(&scene.textures)
        + texels
        + bytes(&scene.lights)
        + bytes(&scene.area_lights)
        + scene.area_lights.iter().map(of_area).sum::<u64>()
}

/// How many of everything a scene's faces will be; triangles and vertices are bounds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sizes {
    pub(super) faces: usize,
    pub(super) triangles: usize,
    pub(super) vertices: usize,
    /// Triangles of faces with holes, and of those that filter by a texture.
    masked: usize,
    /// Parts of curved shapes.
    curved: usize,
    /// Bytes of patches and implicit surfaces beside that.
    freeform_bytes: u64,
    objects: usize,
}

impl Sizes {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut sizes = Self {
            objects: scene.objects.len(),
            ..Self::default()
        };
        for object in &scene.objects {
            let (faces, corners, vertices) = match &object.shape {
                Shape::Polygon(polygon) => (1, polygon.vertices.len(), polygon.vertices.len()),
                Shape::Sphere(_) | Shape::Disk(_) => {
                    sizes.curved += 1;
                    continue;
                }
                Shape::Cone(_) => {
                    sizes.curved += 3;
                    continue;
                }
                Shape::Patch(patch) => {
                    let parts = patch.part_count();
                    sizes.curved += parts;
                    sizes.freeform_bytes += parts as u64 * PART;
                    continue;
                }
                Shape::Implicit(implicit) => {
                    sizes.curved += 1;
                    sizes.freeform_bytes += implicit_bytes(implicit);
                    continue;
                }
                shape => shape.mesh().map_or((0, 0, 0), |mesh| {
                    // Positions that no corner names are not taken up.
                    let vertices = mesh.positions.len().min(mesh.corners.len());
                    (mesh.face_ends.len(), mesh.corners.len(), vertices)
                }),
            };
            // A face of n corners makes n - 2 triangles.
            let triangles = corners.saturating_sub(2 * faces);
            sizes.faces += faces;
            sizes.triangles += triangles;
            sizes.vertices += vertices;
            let material = scene.materials.get(object.material);
            if material.is_some_and(reads_texture) {
                sizes.masked += triangles;
            }
        }
        sizes
    }
}

/// Returns whether shadow rays read the texture of a material.
fn reads_texture(material: &Material) -> bool {
    match material.shadow_kind() {
        ShadowKind::Opaque => false,
        ShadowKind::AlphaTested => true,
        ShadowKind::Transparent => material.diffuse_texture.is_some(),
    }
}

/// Returns about how many bytes [`Gathered::of`](super::Gathered::of) takes at its height; not
/// less, unless outlines cross themselves.
pub fn surface_bytes(scene: &Scene) -> u64 {
    let Sizes {
        faces,
        triangles,
        vertices,
        masked,
        curved,
        freeform_bytes,
        objects,
    } = Sizes::of(scene);
    // One copy of a mesh is placed at a time.
    let placed = scene.objects.iter().map(|object| match &object.shape {
        Shape::Instance(instance) => size_of_val(&*instance.mesh.positions) as u64,
        _ => 0,
    });
    // Masks and filters each keep their textures.
    let masks = scene.materials.iter().filter(|m| reads_texture(m));
    let masks: HashSet<_> = masks
        .filter_map(|m| {
            Some((
                m.shadow_kind() == ShadowKind::AlphaTested,
                m.diffuse_texture?,
            ))
        })
        .collect();
    let masks = masks
        .iter()
        .filter_map(|&(_, texture)| scene.textures.get(texture));
    OccludersBuilder::predict_bytes(faces, triangles, vertices)
        + masked as u64 * ALPHA_TEST
        + curved as u64 * CURVED
        + freeform_bytes
        + objects as u64 * OBJECT
        + placed.max().unwrap_or(0)
        + masks
            .map(|texture| 4 * texture.texels.len() as u64)
            .sum::<u64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Corner;
    use antumbra_geometry::DVec3;

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
        let gathered = crate::gather::Gathered::of(&scene).unwrap();
        let taken = gathered.memory_bytes();
        let predicted = surface_bytes(&scene);
        assert!(predicted >= taken, "{predicted} < {taken}");
        // The table of equal positions is given back.
        let table = 4096 * 33;
        assert!(
            predicted < taken + table + 100,
            "{predicted} is far above {taken}"
        );
    }
}
