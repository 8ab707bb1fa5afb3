//! What the writers of mesh formats share.
//!
//! In: a scene. Out: its objects as meshes, or the refusal of a curved one; and notes on what a
//! format leaves out. Invariant: nothing is tessellated.

use std::borrow::Cow;

use antumbra_geometry::DVec3;

use crate::{
    defaults::AMBIENT,
    error::quoted,
    model::{Color, Corner, Facing, Mesh, Polygon, Scene, Shape},
};

use super::WriteError;

/// Curved shapes, as messages call them: mesh formats have no word for them.
pub const CURVED: [&str; 5] = [
    "a sphere",
    "a cone or cylinder",
    "a disk",
    "a patch",
    "an implicit surface",
];

/// Returns each object as a mesh.
///
/// # Errors
/// One is curved.
pub(super) fn meshes<'a>(
    scene: &'a Scene,
    format: &'static str,
) -> Result<Vec<Cow<'a, Mesh>>, WriteError> {
    let objects = scene.objects.iter().enumerate();
    let mesh = |(index, object): (usize, &'a crate::model::Object)| {
        let what = match &object.shape {
            Shape::Mesh(mesh) => return Ok(Cow::Borrowed(mesh)),
            Shape::Instance(instance) => return Ok(Cow::Owned(instance.to_mesh())),
            Shape::Polygon(polygon) => return Ok(Cow::Owned(mesh_of(polygon))),
            Shape::Sphere(_) => CURVED[0],
            Shape::Cone(_) => CURVED[1],
            Shape::Disk(_) => CURVED[2],
            Shape::Patch(_) => CURVED[3],
            Shape::Implicit(_) => CURVED[4],
        };
        Err(WriteError::unsupported(format, what, index, object))
    };
    objects.map(mesh).collect()
}

/// Returns a polygon as a mesh of one face.
fn mesh_of(polygon: &Polygon) -> Mesh {
    let mut mesh = Mesh {
        positions: polygon.vertices.clone(),
        face_ends: vec![polygon.vertices.len() as u32],
        ..Mesh::default()
    };
    for index in 0..polygon.vertices.len() {
        let mut corner = Corner::at(index as u32);
        if let Some(&normal) = polygon.normals.get(index)
            && normal != DVec3::ZERO
        {
            corner.normal = mesh.normals.len() as u32;
            mesh.normals.push(normal);
        }
        mesh.corners.push(corner);
    }
    mesh
}

/// What a format keeps of a scene besides its faces.
#[derive(Clone, Copy)]
pub(super) struct Keeps {
    pub(super) objects: bool,
    pub(super) materials: bool,
    pub(super) textures: bool,
    pub(super) lights: bool,
    pub(super) camera: bool,
    /// What readers take for up and for ambient light.
    pub(super) up: DVec3,
    pub(super) ambient: Color,
}

impl Keeps {
    /// Nothing, and +z is up.
    pub(super) const NOTHING: Self = Self {
        objects: false,
        materials: false,
        textures: false,
        lights: false,
        camera: false,
        up: DVec3::Z,
        ambient: AMBIENT,
    };
}

/// Names what a format leaves out of this scene.
pub(super) fn left_out(scene: &Scene, keeps: Keeps) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |text: String| notes.push(text);
    let count = scene.objects.len();
    if !keeps.objects && count > 1 {
        note(format!(
            "the names and borders of {count} objects are not written"
        ));
    }
    if !keeps.materials && scene.materials.iter().any(|m| *m != Default::default()) {
        let glass = scene.materials.iter().any(|m| !m.is_opaque());
        let also = if glass {
            "; see-through ones become opaque"
        } else {
            ""
        };
        note(format!("materials are not written{also}"));
    }
    if !keeps.textures && !scene.textures.is_empty() {
        note("textures and places in them are not written".into());
    }
    let has_colors = |shape: &Shape| shape.mesh().is_some_and(|mesh| !mesh.colors.is_empty());
    if scene.objects.iter().any(|object| has_colors(&object.shape)) {
        note("colors of vertices are not written".into());
    }
    if !scene.area_lights.is_empty() {
        note(format!(
            "lights with size are not written: {}",
            scene.area_lights.len()
        ));
    }
    if !keeps.lights && !scene.lights.is_empty() {
        let names: Vec<_> = scene
            .lights
            .iter()
            .take(8)
            .map(|l| quoted(&l.name))
            .collect();
        let more = match scene.lights.len().saturating_sub(names.len()) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        note(format!(
            "lights are not written: {}{more}",
            names.join(", ")
        ));
    }
    if !keeps.camera && scene.camera.is_some() {
        note("the camera is not written".into());
    }
    if scene.background != Color::ZERO {
        note("the background is not written".into());
    }
    if scene.ambient != keeps.ambient {
        let [r, _, _] = keeps.ambient.to_array();
        note(format!(
            "the ambient light is not written: readers take {r}"
        ));
    }
    if scene.facing == Facing::Winding {
        note("that faces are lit only from the front is not written".into());
    }
    if scene.up != keeps.up {
        let [x, y, z] = scene.up.to_array();
        note(format!("which way is up, ({x}, {y}, {z}), is not written"));
    }
    notes
}
