//! Copies of a mesh.
//!
//! In: a mesh in its own space, shared by all copies, and where one of them stands. Out: its
//! positions and normals in world space. Invariant: each is the mesh's, moved once in `f64`, so that
//! what is equal in the mesh is bit-equal in the world; that is where the copy is, by definition.

use std::{borrow::Cow, sync::Arc};

use antumbra_geometry::DVec3;
use glam::{DAffine3, DMat3};
use serde::{Deserialize, Serialize};

use crate::model::{Mesh, Shape};

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

/// Objects for `serde`: a mesh that copies share is written once, and read once.
pub(crate) mod shared {
    use std::{collections::HashMap, sync::Arc};

    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    use crate::model::{Mesh, Object, Shape};

    pub(crate) fn serialize<S: Serializer>(
        objects: &Vec<Object>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut number_of = HashMap::new();
        let mut meshes: Vec<&Mesh> = Vec::new();
        let mut numbers = Vec::new();
        for object in objects {
            if let Shape::Instance(instance) = &object.shape {
                let number = *number_of
                    .entry(Arc::as_ptr(&instance.mesh))
                    .or_insert_with(|| {
                        meshes.push(&instance.mesh);
                        meshes.len() - 1
                    });
                numbers.push(number);
            }
        }
        (meshes, numbers, objects).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Object>, D::Error> {
        let (meshes, numbers, mut objects) =
            <(Vec<Mesh>, Vec<usize>, Vec<Object>)>::deserialize(deserializer)?;
        let meshes: Vec<_> = meshes.into_iter().map(Arc::new).collect();
        let mut numbers = numbers.into_iter();
        for object in &mut objects {
            if let Shape::Instance(instance) = &mut object.shape {
                let mesh = numbers.next().and_then(|number| meshes.get(number));
                instance.mesh = Arc::clone(mesh.ok_or_else(|| D::Error::custom("no mesh"))?);
            }
        }
        Ok(objects)
    }
}

impl Shape {
    /// Returns the mesh of a shape of faces, world space; `None` for others.
    pub fn placed_mesh(&self) -> Option<Cow<'_, Mesh>> {
        match self {
            Self::Mesh(mesh) => Some(Cow::Borrowed(mesh)),
            Self::Instance(instance) => Some(Cow::Owned(instance.to_mesh())),
            Self::Polygon(_) | Self::Sphere(_) | Self::Cone(_) | Self::Disk(_) => None,
        }
    }

    /// Returns the mesh of a shape of faces: corners, places in textures and colours are those of
    /// the shape, but positions and normals of an instance are in its own space. `None` for others.
    pub fn mesh(&self) -> Option<&Mesh> {
        match self {
            Self::Mesh(mesh) => Some(mesh),
            Self::Instance(instance) => Some(&instance.mesh),
            Self::Polygon(_) | Self::Sphere(_) | Self::Cone(_) | Self::Disk(_) => None,
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
