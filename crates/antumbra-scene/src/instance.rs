//! Copies of a mesh.
//!
//! In: a mesh in its own space, shared by all copies, and where one of them stands. Out: its
//! positions and normals in world space. Invariant: each is the mesh's, moved once in `f64`, so that
//! what is equal in the mesh is bit-equal in the world; that is where the copy is, by definition.

use std::sync::Arc;

use antumbra_geometry::DVec3;
use glam::{DAffine3, DMat3};
use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;

/// One copy of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// The faces, in their own space, in the order that is counter-clockwise once they are placed.
    #[serde(skip)]
    pub mesh: Arc<Mesh>,
    world_from_mesh: DAffine3,
    /// Maps normals up to length.
    normals: DMat3,
}

impl Instance {
    /// Places a mesh: its axes become `axes`, its origin `origin`.
    ///
    /// Where that mirrors, faces are wound the other way round than in the mesh's space: whoever
    /// makes the mesh has to turn them. Positions have to end up within 2^100.
    pub fn new(mesh: Arc<Mesh>, axes: [DVec3; 3], origin: DVec3) -> Self {
        let [x, y, z] = axes;
        Self::at(mesh, DAffine3::from_cols(x, y, z, origin))
    }

    pub(crate) fn at(mesh: Arc<Mesh>, world_from_mesh: DAffine3) -> Self {
        Self {
            mesh,
            world_from_mesh,
            normals: normals_map(&world_from_mesh),
        }
    }

    /// Returns position `index` of the mesh, world space.
    ///
    /// # Panics
    /// The mesh has no such position.
    pub fn position(&self, index: usize) -> DVec3 {
        self.world_from_mesh
            .transform_point3(self.mesh.positions[index])
    }

    /// Returns normal `index` of the mesh, world space, of length one or zero; `None` where it has
    /// none.
    pub fn normal(&self, index: usize) -> Option<DVec3> {
        let normal = self.mesh.normals.get(index)?;
        Some(direction(self.normals * *normal))
    }

    /// Returns the copy as a mesh of its own.
    pub fn to_mesh(&self) -> Mesh {
        let mesh = &*self.mesh;
        let normals = 0..mesh.normals.len();
        Mesh {
            positions: (0..mesh.positions.len())
                .map(|at| self.position(at))
                .collect(),
            normals: normals.filter_map(|at| self.normal(at)).collect(),
            ..mesh.clone()
        }
    }
}

/// Returns what maps normals, up to their length: the cofactors, defined where there is no inverse,
/// turned with the winding where the map mirrors.
pub(crate) fn normals_map(map: &DAffine3) -> DMat3 {
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = map.matrix3;
    let sign = if mirrors(map) { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}

/// Returns whether a map turns right hands into left ones.
pub(crate) fn mirrors(map: &DAffine3) -> bool {
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = map.matrix3;
    x.dot(y.cross(z)) < 0.0
}

/// Returns a vector at length one, scaled first so that long and short ones work; zero for what
/// has no direction.
pub(crate) fn direction(vector: DVec3) -> DVec3 {
    let scaled = vector / vector.abs().max_element();
    let unit = scaled / scaled.length();
    if unit.is_finite() { unit } else { DVec3::ZERO }
}
