//! Writes PLY: binary, little-endian, 64-bit positions.
//!
//! In: a scene of polygons and meshes. Out: one vertex list and one face list. Invariant: what
//! is written reads back with the same faces, bit by bit, in the same order; corners of an object
//! share a vertex where they share position and normal.

use std::{borrow::Cow, collections::HashMap, io::Write};

use antumbra_geometry::DVec3;

use crate::model::{Corner, Mesh, Scene};

use super::{
    WriteError,
    mesh::{Keeps, left_out, meshes},
};

/// Writes the faces of a scene as PLY. Returns what PLY has no place for: materials, textures,
/// lights, the camera and so on, one sentence each.
///
/// A scene that was read from PLY is read back equal, except for [`Scene::up`]. Normals are
/// written if any corner has one; (0, 0, 0) says that a corner has none. Buffer `out`: many small
/// pieces are written.
///
/// # Errors
/// `out` refuses; an object is curved (nothing is tessellated); there are 2^32 vertices or more.
///
/// # Example
/// ```
/// use antumbra_scene::{generate::tetra, read::read_ply, write::write_ply};
/// let mut bytes = Vec::new();
/// write_ply(&tetra(1).unwrap(), &mut bytes).unwrap();
/// assert!(bytes.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
/// let loaded = read_ply("tetra.ply".as_ref(), &bytes, &Default::default()).unwrap();
/// assert_eq!(loaded.scene.objects.len(), 1);
/// ```
pub fn write_ply(scene: &Scene, out: &mut impl Write) -> Result<Vec<String>, WriteError> {
    let notes = left_out(scene, Keeps::NOTHING);
    let meshes = meshes(scene, "PLY")?;
    let has_normals = meshes
        .iter()
        .flat_map(|mesh| &mesh.corners)
        .any(|corner| corner.normal != Corner::NONE);
    let vertices = Vertices::of(&meshes)?;
    let faces = || meshes.iter().flat_map(|mesh| mesh.faces());
    let widest = faces().map(<[Corner]>::len).max().unwrap_or(0);
    let count_type = if widest <= 255 { "uchar" } else { "uint" };

    // The header.
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment written by antumbra"
    )?;
    writeln!(out, "element vertex {}", vertices.corners.len())?;
    let names = ["x", "y", "z", "nx", "ny", "nz"];
    for name in &names[..if has_normals { 6 } else { 3 }] {
        writeln!(out, "property double {name}")?;
    }
    writeln!(out, "element face {}", faces().count())?;
    writeln!(
        out,
        "property list {count_type} uint vertex_indices\nend_header"
    )?;

    // The vertices.
    for &(mesh, corner) in &vertices.corners {
        let mesh = &meshes[mesh];
        let normal = match corner.normal {
            Corner::NONE => DVec3::ZERO,
            normal => mesh.normals[normal as usize],
        };
        let [x, y, z] = mesh.positions[corner.position as usize].to_array();
        let [nx, ny, nz] = normal.to_array();
        for number in &[x, y, z, nx, ny, nz][..if has_normals { 6 } else { 3 }] {
            out.write_all(&number.to_le_bytes())?;
        }
    }

    // The faces.
    let mut indices = vertices.indices.iter();
    for face in faces() {
        match widest {
            ..=255 => out.write_all(&[face.len() as u8])?,
            _ => out.write_all(&(face.len() as u32).to_le_bytes())?,
        }
        for index in indices.by_ref().take(face.len()) {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(notes)
}

/// The vertices of a file.
struct Vertices {
    /// A corner of each vertex, and the mesh it is of.
    corners: Vec<(usize, Corner)>,
    /// The vertex of each corner of each mesh.
    indices: Vec<u32>,
}

impl Vertices {
    fn of(meshes: &[Cow<'_, Mesh>]) -> Result<Self, WriteError> {
        let mut vertices = Self {
            corners: Vec::new(),
            indices: Vec::new(),
        };
        let mut vertex_of = HashMap::new();
        for (number, mesh) in meshes.iter().enumerate() {
            vertex_of.clear();
            for corner in &mesh.corners {
                let key = (corner.position, corner.normal);
                let next = vertices.corners.len();
                let index = *vertex_of.entry(key).or_insert(next);
                if index == next {
                    vertices.corners.push((number, *corner));
                }
                let too_large = |_| WriteError::TooLarge {
                    format: "PLY",
                    what: "it has 2^32 vertices or more",
                };
                vertices
                    .indices
                    .push(u32::try_from(index).map_err(too_large)?);
            }
        }
        Ok(vertices)
    }
}
