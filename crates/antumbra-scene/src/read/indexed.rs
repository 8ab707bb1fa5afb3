//! From faces over numbered vertices to a mesh: what PLY and STL share.
//!
//! In: vertices, and faces that name them by index. Out: a mesh. Invariants: it holds the
//! positions and normals its faces use, each once, in the order of first use; every face has at
//! least 3 corners, finite ones, and area; a normal of length 0 is none. What no face uses may be
//! anything.

use antumbra_geometry::DVec3;

use crate::{
    error::Place,
    model::{Corner, Mesh},
    warning::WarningLog,
};

use super::{area::has_area, text::Corners};

/// Faces as a file lists them.
#[derive(Debug, Default)]
pub(super) struct Faces {
    /// The vertices of all faces, face after face.
    pub(super) corners: Vec<u32>,
    /// Where each face ends in `corners`.
    pub(super) ends: Vec<u32>,
    /// The line or the byte of each face.
    pub(super) places: Vec<u32>,
}

/// Vertices as a file lists them.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    /// World space; of any size, or not finite.
    pub(super) positions: Vec<DVec3>,
    /// One for each position, or none at all.
    pub(super) normals: Vec<DVec3>,
    /// Linear red, green, blue and alpha of each position, or none at all.
    pub(super) colors: Vec<[f32; 4]>,
}

impl Faces {
    /// Adds a face.
    pub(super) fn add(&mut self, corners: impl IntoIterator<Item = u32>, place: u32) {
        self.corners.extend(corners);
        // A file of 4 GiB holds fewer than 2^32 corners.
        self.ends.push(self.corners.len() as u32);
        self.places.push(place);
    }

    /// Builds the mesh; drops faces without area or with a corner that is not finite, with a warning.
    /// Every corner names a vertex.
    ///
    /// # Errors
    /// A corner is beyond 2^100: returns where the face is, and the coordinate.
    pub(super) fn mesh(
        self,
        vertices: &Vertices,
        place: fn(u32) -> Place,
        warnings: &mut WarningLog,
    ) -> Result<Mesh, (Place, f64)> {
        let Vertices {
            positions,
            normals,
            colors,
        } = vertices;
        let mut mesh = Mesh::default();
        mesh.corners.reserve_exact(self.corners.len());
        mesh.face_ends.reserve_exact(self.ends.len());
        // Where each vertex of the file is in the mesh.
        let mut position_slots = vec![Corner::NONE; positions.len()];
        let mut normal_slots = vec![Corner::NONE; normals.len()];
        let mut start = 0;
        for (&end, &at) in self.ends.iter().zip(&self.places) {
            let face = &self.corners[start..end as usize];
            start = end as usize;
            let places = face.iter().map(|&vertex| positions[vertex as usize]);
            match Corners::of(places.clone()) {
                Corners::Fine => {}
                Corners::NotFinite => {
                    warnings.add(place(at), Corners::NOT_FINITE);
                    continue;
                }
                Corners::TooLarge(coordinate) => return Err((place(at), coordinate)),
            }
            if !has_area(places) {
                warnings.add(place(at), "a face has no area: dropped");
                continue;
            }
            for &vertex in face {
                let vertex = vertex as usize;
                let slot = &mut position_slots[vertex];
                if *slot == Corner::NONE {
                    mesh.colors.extend(colors.get(vertex));
                }
                let position = copied(slot, positions[vertex], &mut mesh.positions);
                let normal = match normals.get(vertex) {
                    Some(&normal) if normal != DVec3::ZERO => {
                        copied(&mut normal_slots[vertex], normal, &mut mesh.normals)
                    }
                    _ => Corner::NONE,
                };
                mesh.corners.push(Corner {
                    normal,
                    ..Corner::at(position)
                });
            }
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        Ok(mesh)
    }
}

/// Returns the index in the mesh of a vertex, which is copied there at its first use.
fn copied(slot: &mut u32, from: DVec3, to: &mut Vec<DVec3>) -> u32 {
    if *slot == Corner::NONE {
        *slot = to.len() as u32;
        to.push(from);
    }
    *slot
}
