//! Objects: parts of meshes at the places of nodes.
//!
//! In: the parts of a mesh, and the nodes that show it. Out: one object for each part and each
//! copy, world space. Invariant: each vertex is moved once for each copy, so that what was equal
//! in the file is bit-equal in the scene and faces find their neighbours; winding is
//! counter-clockwise from the front again where a transform mirrors; every face has area;
//! coordinates are at most 2^100.

use std::{collections::HashMap, rc::Rc};

use glam::{DAffine3, DMat3, DVec3};

use crate::{
    error::Place,
    model::{Corner, Mesh, Object, Shape},
    read::{area::has_area, text::LARGEST_COORDINATE},
    warning::WarningLog,
};

use super::{
    Fault,
    accessor::Accessors,
    budget::Budget,
    document::{Instancing, Node},
    nodes::{Hierarchy, affine, compose},
    primitives::Part,
    short_name,
};

/// Shows meshes.
pub(super) struct Stage<'a, 'w> {
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) warnings: &'w mut WarningLog,
    pub(super) budget: &'w mut Budget,
    /// Joint matrices of the skins met so far.
    pub(super) skins: HashMap<usize, Rc<Vec<DAffine3>>>,
}

/// How one vertex gets from the mesh's space to the world.
enum Pose {
    /// As all others.
    Rigid(Map),
    /// Each by its joints.
    Skinned(Rc<Vec<DAffine3>>),
}

/// A map for points, normals and winding.
#[derive(Clone, Copy)]
struct Map {
    world_from_mesh: DAffine3,
    /// The cofactors: normals' map up to length, defined where there is no inverse.
    normals: DMat3,
    is_mirrored: bool,
}

impl Map {
    fn of(world_from_mesh: DAffine3) -> Self {
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = world_from_mesh.matrix3;
        let is_mirrored = x.dot(y.cross(z)) < 0.0;
        let sign = if is_mirrored { -1.0 } else { 1.0 };
        Self {
            world_from_mesh,
            normals: DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign,
            is_mirrored,
        }
    }
}

impl Stage<'_, '_> {
    /// Adds the objects that `node` shows of a mesh's parts. Their materials are indices into the
    /// document's; `no_material` stands for none.
    pub(super) fn show(
        &mut self,
        node_index: usize,
        parts: &[Part<'_>],
        no_material: usize,
        objects: &mut Vec<Object>,
    ) -> Result<(), Fault> {
        // A million copies of nothing would still take their time.
        if parts.is_empty() {
            return Ok(());
        }
        let document = self.accessors.buffers().document();
        let node = &document.nodes[node_index];
        let mesh = node.mesh.and_then(|mesh| document.meshes.get(mesh));
        let default_weights = mesh.map_or(&[][..], |mesh| &mesh.weights);
        let weights = node.weights.as_deref().unwrap_or(default_weights);
        let name = match (&*node.name, mesh) {
            ("", Some(mesh)) => short_name(&mesh.name),
            (name, _) => short_name(name),
        };
        let world_from_node = self.hierarchy.world_from_node[node_index];
        let instancing = node.extensions.as_ref().and_then(|e| e.instancing.as_ref());
        let copies: Box<dyn ExactSizeIterator<Item = DAffine3> + '_> = match instancing {
            Some(instancing) => Box::new(copies(self.accessors, instancing, node_index)?),
            None => Box::new(std::iter::once(DAffine3::IDENTITY)),
        };
        // All copies are charged before the first is made.
        let path = || format!("nodes[{node_index}].mesh");
        for part in parts {
            let is_morphed = |at: usize| weights.get(at).is_some_and(|&w| w != 0.0);
            let active = (0..part.targets.len()).filter(|&at| is_morphed(at));
            let passes = 1 + active.count() + part.joints.len();
            let passes = passes.saturating_mul(copies.len());
            self.budget.charge(part.triangles.len(), passes, path)?;
        }
        for node_from_copy in copies {
            for part in parts {
                let pose = self.pose(node, part, world_from_node * node_from_copy)?;
                let mesh = self.place(part, weights, &pose, path)?;
                if !mesh.face_ends.is_empty() {
                    objects.push(Object {
                        name: name.clone(),
                        shape: Shape::Mesh(mesh),
                        material: part.material.unwrap_or(no_material),
                    });
                }
            }
        }
        Ok(())
    }

    fn pose(
        &mut self,
        node: &Node,
        part: &Part<'_>,
        world_from_mesh: DAffine3,
    ) -> Result<Pose, Fault> {
        match node.skin {
            // A skin's joints are in the world already: the node's own transform plays no part.
            Some(skin) if !part.joints.is_empty() => Ok(Pose::Skinned(self.skin(skin)?)),
            _ => Ok(Pose::Rigid(Map::of(world_from_mesh))),
        }
    }

    /// Returns a skin's joint matrices in the rest pose: mesh space to world space.
    fn skin(&mut self, index: usize) -> Result<Rc<Vec<DAffine3>>, Fault> {
        if let Some(skin) = self.skins.get(&index) {
            return Ok(Rc::clone(skin));
        }
        let message = "skins are read in their rest pose";
        self.warnings.add(Place::Whole, message);
        let document = self.accessors.buffers().document();
        let Some(skin) = document.skins.get(index) else {
            let count = document.skins.len();
            return Err(Fault::missing("nodes", "skins", index, count));
        };
        let path = format!("skins[{index}].inverseBindMatrices");
        let inverses = match skin.inverse_bind_matrices {
            Some(index) => Some(self.accessors.get(index, &["MAT4"], || path.clone())?),
            None => None,
        };
        if inverses.is_some_and(|inverses| inverses.len() < skin.joints.len()) {
            let problem = "fewer matrices than joints";
            return Err(Fault::at(path, problem, ""));
        }
        let mut joints = Vec::new();
        for (at, &joint) in skin.joints.iter().enumerate() {
            let Some(&world_from_joint) = self.hierarchy.world_from_node.get(joint) else {
                let path = format!("skins[{index}].joints[{at}]");
                let count = document.nodes.len();
                return Err(Fault::missing(path, "nodes", joint, count));
            };
            joints.push(match inverses {
                Some(inverses) => world_from_joint * affine(&inverses.vector::<16>(at)),
                None => world_from_joint,
            });
        }
        let joints = Rc::new(joints);
        self.skins.insert(index, Rc::clone(&joints));
        Ok(joints)
    }

    /// Builds the mesh of a part in one pose.
    fn place(
        &mut self,
        part: &Part<'_>,
        weights: &[f64],
        pose: &Pose,
        path: impl Fn() -> String,
    ) -> Result<Mesh, Fault> {
        let mut mesh = Mesh {
            uvs: part.uvs.clone(),
            ..Mesh::default()
        };
        let mut is_mirrored = Vec::new();
        for at in 0..part.positions.len() {
            let (position, normal) = morphed(part, weights, at);
            let map = match pose {
                Pose::Rigid(map) => *map,
                Pose::Skinned(joints) => Map::of(blend(part, joints, at)?),
            };
            let position = map.world_from_mesh.transform_point3(position);
            if !position.is_finite() || position.abs().max_element() > LARGEST_COORDINATE {
                let problem = format!(
                    "a vertex is at {position}; coordinates beyond 2^100 are not supported"
                );
                return Err(Fault::at(path(), problem, "scale the scene"));
            }
            mesh.positions.push(position);
            if let Some(normal) = normal {
                mesh.normals.push(direction(map.normals * normal));
            }
            is_mirrored.push(map.is_mirrored);
        }
        let has_normals = !mesh.normals.is_empty();
        let has_uvs = !mesh.uvs.is_empty();
        for &[a, b, c] in &part.triangles {
            if !has_area([a, b, c].iter().map(|&v| mesh.positions[v as usize])) {
                self.warnings
                    .add(Place::Whole, "a triangle has no area: dropped");
                continue;
            }
            let turned = if is_mirrored[a as usize] {
                [a, c, b]
            } else {
                [a, b, c]
            };
            mesh.corners.extend(turned.map(|vertex| Corner {
                position: vertex,
                normal: if has_normals { vertex } else { Corner::NONE },
                uv: if has_uvs { vertex } else { Corner::NONE },
            }));
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        Ok(mesh)
    }
}

/// Returns where copies of a node's mesh stand in the node's space (EXT_mesh_gpu_instancing).
fn copies<'a>(
    accessors: &'a Accessors<'a>,
    instancing: &Instancing,
    node: usize,
) -> Result<impl ExactSizeIterator<Item = DAffine3> + use<'a>, Fault> {
    let path = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
    let get = |name: &str, shape: &'static str| {
        let index = instancing.attributes.get(name);
        let here = || format!("{path}.{name}");
        index
            .map(|&index| accessors.get(index, &[shape], here))
            .transpose()
    };
    let translations = get("TRANSLATION", "VEC3")?;
    let rotations = get("ROTATION", "VEC4")?;
    let scales = get("SCALE", "VEC3")?;
    let mut counts = [&translations, &rotations, &scales]
        .into_iter()
        .flatten()
        .map(|a| a.len());
    let Some(count) = counts.next() else {
        let problem = "expected TRANSLATION, ROTATION or SCALE";
        return Err(Fault::at(path, problem, ""));
    };
    if counts.any(|other| other != count) {
        let problem = "the attributes have different numbers of elements";
        return Err(Fault::at(path, problem, ""));
    }
    Ok((0..count).map(move |copy| {
        compose(
            translations.map_or([0.0; 3], |a| a.vector(copy)),
            rotations.map_or([0.0, 0.0, 0.0, 1.0], |a| a.vector(copy)),
            scales.map_or([1.0; 3], |a| a.vector(copy)),
        )
    }))
}

/// Returns a vertex's position and normal with the morph targets at their weights.
fn morphed(part: &Part<'_>, weights: &[f64], at: usize) -> (DVec3, Option<DVec3>) {
    let mut position = part.positions[at];
    let mut normal = part.normals.get(at).copied();
    let vertex = part.vertices[at] as usize;
    for (target, &weight) in part.targets.iter().zip(weights) {
        if weight == 0.0 {
            continue;
        }
        if let Some(positions) = &target.positions {
            position += weight * DVec3::from_array(positions.vector(vertex));
        }
        if let (Some(normal), Some(normals)) = (&mut normal, &target.normals) {
            *normal += weight * DVec3::from_array(normals.vector(vertex));
        }
    }
    (position, normal)
}

/// Returns the mean of a vertex's joints by their weights; weights are scaled to sum to one. A
/// vertex without weights follows its first joint.
fn blend(part: &Part<'_>, joints: &[DAffine3], at: usize) -> Result<DAffine3, Fault> {
    let vertex = part.vertices[at] as usize;
    let mut sum = DAffine3::ZERO;
    let mut total = 0.0;
    let mut first = None;
    for [indices, weights] in &part.joints {
        let indices = indices.whole::<4>(vertex);
        let weights = weights.vector::<4>(vertex);
        for (joint, weight) in indices.into_iter().zip(weights) {
            if weight == 0.0 && first.is_some() {
                continue;
            }
            let Some(&matrix) = joints.get(joint as usize) else {
                let problem = format!(
                    "vertex {vertex} follows joint {joint}, but the skin has {}",
                    joints.len()
                );
                let path = format!("{}.attributes.JOINTS_0", part.path);
                return Err(Fault::at(path, problem, "export the file again"));
            };
            first.get_or_insert(matrix);
            sum.matrix3 += matrix.matrix3 * weight;
            sum.translation += matrix.translation * weight;
            total += weight;
        }
    }
    Ok(if total == 0.0 {
        first.unwrap_or(DAffine3::IDENTITY)
    } else {
        DAffine3 {
            matrix3: sum.matrix3 * (1.0 / total),
            translation: sum.translation * (1.0 / total),
        }
    })
}

/// Returns a vector at length one, scaled first so that long and short ones work; zero for what
/// has no direction.
fn direction(vector: DVec3) -> DVec3 {
    let scaled = vector / vector.abs().max_element();
    let unit = scaled / scaled.length();
    if unit.is_finite() { unit } else { DVec3::ZERO }
}
