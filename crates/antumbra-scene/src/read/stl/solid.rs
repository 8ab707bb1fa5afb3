//! Triangles of an STL file.

use antumbra_geometry::DVec3;
use std::collections::HashMap;
use std::path::Path;

use super::super::indexed::{Faces, Vertices};
use super::super::text::Corners;
use crate::error::{Place, ReadError, ReadErrorKind};
use crate::model::{Object, Shape};
use crate::warning::WarningLog;

/// One solid as its triangles come in.
#[derive(Default)]
pub(super) struct Solid {
    pub(super) name: String,
    pub(super) vertices: Vertices,
    pub(super) faces: Faces,
    vertex_of: HashMap<[u64; 3], u32>,
}

impl Solid {
    /// Adds a triangle that is at a line or byte of the file.
    pub(super) fn add(&mut self, corners: [DVec3; 3], at: u32) {
        let corners = corners.map(|corner| {
            // Adding 0 turns -0 into 0 and changes nothing else.
            let corner = corner + DVec3::ZERO;
            let key = corner.to_array().map(f64::to_bits);
            let positions = &mut self.vertices.positions;
            *self.vertex_of.entry(key).or_insert_with(|| {
                positions.push(corner);
                positions.len() as u32 - 1
            })
        });
        self.faces.add(corners, at);
    }

    /// Returns the solid as an object, if a face is left.
    pub(super) fn finish(
        self,
        file: &Path,
        place: fn(u32) -> Place,
        warnings: &mut WarningLog,
    ) -> Result<Option<Object>, ReadError> {
        let mesh = self.faces.mesh(&self.vertices, place, warnings);
        let mesh = mesh.map_err(|(place, coordinate)| ReadError {
            file: file.to_path_buf(),
            place,
            kind: ReadErrorKind::Invalid {
                entity: "vertex",
                problem: Corners::too_large(coordinate).into(),
                help: "scale the scene down",
            },
        })?;
        Ok((!mesh.face_ends.is_empty()).then_some(Object {
            name: self.name,
            shape: Shape::Mesh(mesh),
            material: 0,
        }))
    }
}
