//! Meshes as triangles of 32-bit numbers.
//!
//! In: a mesh. Out: primitives, one for each kind of corner (with or without normals, with or
//! without places in a texture). Invariant: the triangles of a face are those of the geometry
//! crate, in its order; equal vertices are one.

use std::collections::HashMap;

use antumbra_geometry::{DVec3, Occluders, Opacity, SurfaceId};
use serde_json::{Value, json};

use crate::{
    model::{Corner, Mesh},
    read::has_area,
    write::WriteError,
};

use super::{buffer::Buffer, origin::rounded};

/// How many numbers did not fit, and what became of the triangles.
#[derive(Debug, Default)]
pub(super) struct Rounding {
    coordinates: u64,
    rounded: u64,
    largest: f64,
    triangles: u64,
    collapsed: u64,
    lost_corners: u64,
    uncut_faces: u64,
}

impl Rounding {
    /// Returns what is written, and what that is in the world.
    fn position(&mut self, position: DVec3, origin: DVec3) -> ([f32; 3], DVec3) {
        let axes: [_; 3] = std::array::from_fn(|axis| {
            let (single, back) = rounded(position[axis], origin[axis]);
            self.coordinates += 1;
            self.rounded += u64::from(back != position[axis]);
            self.largest = self.largest.max((back - position[axis]).abs());
            (single, back)
        });
        let back = DVec3::from_array(axes.map(|(_, back)| back));
        (axes.map(|(single, _)| single), back)
    }

    /// Counts a triangle.
    fn triangle(&mut self, before: [DVec3; 3], after: [DVec3; 3]) {
        let had_area = has_area(before.into_iter());
        self.triangles += u64::from(had_area);
        self.collapsed += u64::from(had_area && before != after && !has_area(after.into_iter()));
    }

    /// Says what was changed.
    ///
    /// # Errors
    /// Nothing would be left.
    pub(super) fn note(&self, notes: &mut Vec<String>) -> Result<(), WriteError> {
        let Self {
            coordinates,
            rounded,
            largest,
            triangles,
            collapsed,
            lost_corners,
            uncut_faces,
        } = self;
        if *uncut_faces > 0 {
            notes.push(format!(
                "{uncut_faces} faces cross themselves too often to be cut: they are not written"
            ));
        }
        if *rounded > 0 {
            notes.push(format!(
                "{rounded} of {coordinates} coordinates do not fit glTF's 32 bits: they are rounded, by at most \
                 {largest:.1e}"
            ));
        }
        if *collapsed > 0 && collapsed == triangles {
            return Err(WriteError::Collapsed {
                format: "glTF",
                triangle_count: *collapsed,
            });
        }
        if *collapsed > 0 {
            notes.push(format!(
                "{collapsed} of {triangles} triangles have no area once their corners are rounded: they are lost"
            ));
        }
        if *lost_corners > 0 {
            notes.push(format!(
                "{lost_corners} corners have a normal or a place in a texture that others of their \
                 face lack: it is not written"
            ));
        }
        Ok(())
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    normal: Option<DVec3>,
    uv: Option<[f64; 2]>,
}

/// What vertices are told apart by.
type Key = ([u32; 3], [u32; 3], [u32; 2]);

/// The triangles with one kind of corner.
#[derive(Default)]
struct Group {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
    vertex_of: HashMap<Key, u32>,
}

impl Group {
    fn add(&mut self, vertex: &Vertex, position: [f32; 3]) {
        let normal = vertex
            .normal
            .map(|normal| normal.to_array().map(|x| x as f32));
        let uv = vertex.uv.map(|uv| uv.map(|x| x as f32));
        let key = (
            position.map(f32::to_bits),
            normal.unwrap_or_default().map(f32::to_bits),
            uv.unwrap_or_default().map(f32::to_bits),
        );
        let next = self.positions.len() as u32;
        let index = *self.vertex_of.entry(key).or_insert(next);
        if index == next {
            self.positions.push(position);
            self.normals.extend(normal);
            self.uvs.extend(uv);
        }
        self.indices.push(index);
    }
}

/// Adds the triangles of a mesh, as seen from an origin, to the buffer; returns its primitives.
pub(super) fn primitives(
    mesh: &Mesh,
    origin: DVec3,
    material: usize,
    buffer: &mut Buffer,
    rounding: &mut Rounding,
) -> Vec<Value> {
    let mut groups: [Group; 4] = Default::default();
    for face in mesh.faces() {
        let triangles = triangles(mesh, face).unwrap_or_else(|| {
            rounding.uncut_faces += 1;
            Vec::new()
        });
        for triangle in triangles {
            let has_normals = triangle.iter().all(|vertex| vertex.normal.is_some());
            let has_uvs = triangle.iter().all(|vertex| vertex.uv.is_some());
            let group = &mut groups[2 * usize::from(has_normals) + usize::from(has_uvs)];
            let positions = triangle.map(|vertex| rounding.position(vertex.position, origin));
            let before = triangle.map(|vertex| vertex.position);
            rounding.triangle(before, positions.map(|(_, back)| back));
            for (mut vertex, (position, _)) in triangle.into_iter().zip(positions) {
                let is_lost =
                    (vertex.normal.is_some() && !has_normals) || (vertex.uv.is_some() && !has_uvs);
                rounding.lost_corners += u64::from(is_lost);
                vertex.normal = vertex.normal.filter(|_| has_normals);
                vertex.uv = vertex.uv.filter(|_| has_uvs);
                group.add(&vertex, position);
            }
        }
    }
    let written = groups.iter().filter(|group| !group.indices.is_empty());
    let primitive = |group: &Group| {
        let mut attributes = json!({"POSITION": buffer.vectors(&group.positions)});
        if !group.normals.is_empty() {
            attributes["NORMAL"] = buffer.vectors(&group.normals).into();
        }
        if !group.uvs.is_empty() {
            attributes["TEXCOORD_0"] = buffer.vectors(&group.uvs).into();
        }
        json!({
            "attributes": attributes,
            "indices": buffer.indices(&group.indices),
            "material": material,
        })
    };
    written.map(primitive).collect()
}

/// Cuts a face into triangles; `None` if its outline crosses itself too often.
fn triangles(mesh: &Mesh, face: &[Corner]) -> Option<Vec<[Vertex; 3]>> {
    let vertex = |corner: &Corner| Vertex {
        position: mesh.positions[corner.position as usize],
        normal: mesh.normals.get(corner.normal as usize).and_then(unit),
        uv: mesh.uvs.get(corner.uv as usize).copied(),
    };
    if let [a, b, c] = face {
        return Some(vec![[vertex(a), vertex(b), vertex(c)]]);
    }
    let vertices: Vec<_> = face.iter().map(vertex).collect();
    let outline: Vec<_> = vertices.iter().map(|vertex| vertex.position).collect();
    let mut builder = Occluders::builder();
    // Coordinates of a scene are in range.
    builder.add_face(&outline, Opacity::Opaque).ok()?;
    let occluders = builder.build();
    let triangle = |surface: SurfaceId| match occluders.corners(surface) {
        Some(corners) => Some(corners.map(|corner| vertices[corner as usize])),
        // The outline crosses itself: there are corners that no vertex of the face is at.
        None => occluders.triangle_positions(surface).map(|positions| {
            positions.map(|position| Vertex {
                position,
                normal: None,
                uv: None,
            })
        }),
    };
    Some(occluders.surfaces().filter_map(triangle).collect())
}

/// Returns a normal at the length that glTF wants, `None` for zero.
fn unit(normal: &DVec3) -> Option<DVec3> {
    let scaled = *normal / normal.abs().max_element();
    let unit = scaled / scaled.length();
    unit.is_finite().then_some(unit)
}
