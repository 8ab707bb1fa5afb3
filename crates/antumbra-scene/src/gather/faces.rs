//! Faces of a mesh.

use crate::model::{Corner, Mesh};

/// Returns the corners of face `face`, or `None` if the ends are out of range or order.
pub fn face_of(mesh: &Mesh, face: usize) -> Option<&[Corner]> {
    let start = if face == 0 {
        0
    } else {
        *mesh.face_ends.get(face - 1)? as usize
    };
    mesh.corners.get(start..*mesh.face_ends.get(face)? as usize)
}
