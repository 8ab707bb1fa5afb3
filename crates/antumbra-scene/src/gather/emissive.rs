//! Surfaces that emit become lights with size.
//!
//! In: a [`Scene`]. Out: one [`AreaLight`] for each object whose material emits, over the very triangles that block
//! light, so that a face never blocks its own light (EXACTNESS.md, "Lights with size"). Only faces become lights:
//! no format that is read has curved surfaces that emit.

use std::sync::Arc;

use crate::model::{AreaLight, Color, Material, Object, Scene, Shape};
use antumbra_geometry::{AreaError, AreaShape, MeshLight};

use super::{GatherError, Gathered};

/// Returns the lights that emitting faces are, one an object that has any. Such a light is physical: its radiance is
/// the material's emission, over whole faces, whatever their alpha. It is two-sided where the material is.
///
/// # Errors
/// An object's numbers are out of range, as for [`Gathered::of`].
pub fn emissive_lights(scene: &Scene) -> Result<Vec<AreaLight>, GatherError> {
    let mut lights = Vec::new();
    for (number, object) in scene.objects.iter().enumerate() {
        antumbra_task::check();
        let Some(material) = scene.materials.get(object.material) else {
            continue;
        };
        let is_there = material.coverage(1.0) > 0.0;
        let has_faces = matches!(
            object.shape,
            Shape::Mesh(_) | Shape::Instance(_) | Shape::Polygon(_)
        );
        if material.emission == Color::ZERO || !is_there || !has_faces {
            continue;
        }
        let triangles = triangles_of(object).map_err(|error| at_object(error, number, object))?;
        match MeshLight::new(triangles, material.is_double_sided) {
            Ok(mesh) => lights.push(AreaLight {
                name: object.name.clone(),
                shape: AreaShape::Mesh(Arc::new(mesh)),
                color: material.emission,
                falls_off: true,
            }),
            // What has no area gives no light; gathering has refused other faults.
            Err(AreaError::NoSize { .. }) => {}
            Err(_) => {
                return Err(GatherError::BadIndex {
                    object: number,
                    name: object.name.clone(),
                    what: "a corner",
                });
            }
        }
    }
    Ok(lights)
}

/// Returns the triangles that an object's faces become among the surfaces.
fn triangles_of(object: &Object) -> Result<Vec<[antumbra_geometry::DVec3; 3]>, GatherError> {
    let alone = Scene {
        materials: vec![Material::default()],
        objects: vec![Object {
            material: 0,
            ..object.clone()
        }],
        ..Scene::default()
    };
    let gathered = Gathered::of(&alone)?;
    let occluders = gathered.occluders();
    let triangles = occluders
        .surfaces()
        .filter_map(|surface| occluders.triangle_positions(surface));
    Ok(triangles.collect())
}

/// Returns an error about the object by its place in the whole scene.
fn at_object(error: GatherError, number: usize, object: &Object) -> GatherError {
    let name = object.name.clone();
    match error {
        GatherError::BadObject { source, .. } => GatherError::BadObject {
            object: number,
            name,
            source,
        },
        GatherError::BadIndex { what, .. } => GatherError::BadIndex {
            object: number,
            name,
            what,
        },
    }
}
