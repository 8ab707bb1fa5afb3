//! Writes GLB: glTF 2.0 in one binary file.
//!
//! In: a scene of polygons and meshes. Out: a GLB with one node and one mesh for each object, its
//! materials, textures (as PNG), lights (KHR_lights_punctual) and camera. Invariants: faces are cut
//! into the triangles that the geometry crate makes of them, in the same order, so their shadows are
//! those of the scene; glTF has 32-bit positions, so a mesh far from the origin is written near it, below a node that
//! moves it back by 64-bit numbers, and a note says how many coordinates had to be rounded all the same.
//!
//! glTF wants +y up. A scene with +z up is written unturned below a node that turns it (by a matrix
//! of zeros and ones, which rounds nothing); any other direction is noted.
//!
//! | what | file |
//! |---|---|
//! | bytes, views, accessors | `buffer` |
//! | triangles | `geometry` |
//! | where meshes stand | `origin` |
//! | materials, textures | `looks` |
//! | lights, camera | `views` |

mod buffer;
mod geometry;
mod looks;
mod origin;
mod views;

use std::io::Write;

use antumbra_geometry::DVec3;
use serde_json::{Value, json};

use crate::{
    defaults::AMBIENT,
    model::{Color, Scene},
};

use super::{
    WriteError,
    mesh::{Keeps, left_out, meshes},
};
use buffer::Buffer;
use geometry::Rounding;

/// The matrix, column by column, that takes +z to +y and -y to +z.
const Y_UP_FROM_Z_UP: [i32; 16] = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1];

/// Writes a scene as GLB. Returns what glTF has no place for, or what had to be changed, one
/// sentence each.
///
/// Positions, normals and places in textures are 32-bit numbers by the format. A mesh whose coordinates do not fit is
/// written relative to one of its vertices, and its node has that vertex as a translation, in 64 bits. What does not
/// fit either is rounded, and counted in a note. Faces become triangles. Materials become
/// metallic-roughness ones: diffuse color, transparency, emission and textures stay, highlights and
/// mirrors only in kind. Lights get the units candela and lux.
///
/// # Errors
/// `out` refuses; an object is curved (nothing is tessellated); rounding would leave no triangle any area; the file
/// would exceed 4 GiB.
///
/// # Example
/// ```
/// use antumbra_scene::{generate::tetra, read::read_gltf, write::write_glb};
/// let mut bytes = Vec::new();
/// write_glb(&tetra(1).unwrap(), &mut bytes).unwrap();
/// let no_files = &mut |_: &str| unreachable!("a GLB is one file");
/// let loaded = read_gltf("tetra.glb".as_ref(), &bytes, &Default::default(), no_files).unwrap();
/// assert_eq!(loaded.scene.objects.len(), 4);
/// ```
pub fn write_glb(scene: &Scene, out: &mut impl Write) -> Result<Vec<String>, WriteError> {
    let is_z_up = scene.up == DVec3::Z;
    let keeps = Keeps {
        objects: true,
        materials: true,
        textures: true,
        lights: true,
        camera: true,
        up: if is_z_up { DVec3::Z } else { DVec3::Y },
        ambient: if scene.lights.is_empty() {
            AMBIENT
        } else {
            Color::ZERO
        },
    };
    let mut notes = left_out(scene, keeps);
    let meshes = meshes(scene, "glTF")?;
    let mut buffer = Buffer::default();
    let mut nodes = Vec::new();
    let mut mesh_entries = Vec::new();

    // Geometry.
    let mut rounding = Rounding::default();
    let origins = origin::origins(&meshes);
    for ((object, mesh), origin) in scene.objects.iter().zip(&meshes).zip(origins) {
        let material = object.material;
        let primitives = geometry::primitives(mesh, origin, material, &mut buffer, &mut rounding);
        if primitives.is_empty() {
            continue;
        }
        let mut node = json!({"name": object.name, "mesh": mesh_entries.len()});
        if origin != DVec3::ZERO {
            node["translation"] = json!(origin.to_array());
        }
        nodes.push(node);
        mesh_entries.push(json!({"name": object.name, "primitives": primitives}));
    }
    rounding.note(&mut notes)?;

    // Everything else.
    let materials = looks::materials(scene, &mut notes);
    let (textures, images, samplers) = looks::textures(scene, &mut buffer, &mut notes);
    let lights = views::lights(scene, &mut nodes, &mut notes);
    let cameras = views::cameras(scene, &mut nodes);

    // The tree.
    let count = nodes.len();
    let mut roots: Vec<_> = (0..count).collect();
    if is_z_up && count > 0 {
        nodes.push(json!({"name": "z up", "matrix": Y_UP_FROM_Z_UP, "children": roots}));
        roots = vec![count];
    }
    let mut document = json!({
        "asset": {"version": "2.0", "generator": "antumbra"},
        "scene": 0,
    });
    let scene_entry = if roots.is_empty() {
        json!({})
    } else {
        json!({"nodes": roots})
    };
    let mut used: Vec<&str> = looks::extensions(scene);
    if !lights.is_empty() {
        used.push("KHR_lights_punctual");
        document["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    }
    if buffer.bytes.len() > u32::MAX as usize {
        return Err(too_large());
    }
    let buffers = match buffer.bytes.len() {
        0 => vec![],
        length => vec![json!({"byteLength": length})],
    };
    let used = used.into_iter().map(Value::from).collect();
    // glTF allows no empty lists.
    for (name, list) in [
        ("extensionsUsed", used),
        ("scenes", vec![scene_entry]),
        ("nodes", nodes),
        ("meshes", mesh_entries),
        ("materials", materials),
        ("textures", textures),
        ("images", images),
        ("samplers", samplers),
        ("cameras", cameras),
        ("accessors", buffer.accessors),
        ("bufferViews", buffer.views),
        ("buffers", buffers),
    ] {
        if !list.is_empty() {
            document[name] = Value::Array(list);
        }
    }
    write_container(document.to_string().into_bytes(), buffer.bytes, out)?;
    Ok(notes)
}

/// Writes the header and the two chunks.
fn write_container(
    mut json: Vec<u8>,
    mut binary: Vec<u8>,
    out: &mut impl Write,
) -> Result<(), WriteError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let binary_length = if binary.is_empty() {
        0
    } else {
        8 + binary.len()
    };
    let length = 12 + 8 + json.len() + binary_length;
    let length = u32::try_from(length).map_err(|_| too_large())?;
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&length.to_le_bytes())?;
    // Both are shorter than the whole.
    out.write_all(&(json.len() as u32).to_le_bytes())?;
    out.write_all(b"JSON")?;
    out.write_all(&json)?;
    if !binary.is_empty() {
        out.write_all(&(binary.len() as u32).to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        out.write_all(&binary)?;
    }
    Ok(())
}

fn too_large() -> WriteError {
    WriteError::TooLarge {
        format: "GLB",
        what: "it would exceed 4 GiB",
    }
}
