//! Objects: parts of meshes at the places of nodes.
//!
//! In: the parts of a mesh, and the nodes that show it. Out: one object for each part and each
//! copy; copies that differ only in where they stand share their mesh. Invariant: each vertex is
//! moved once for each copy, so that what was equal in the file is bit-equal in the scene and faces
//! find their neighbours; winding is counter-clockwise from the front again where a transform
//! mirrors; every face has area where it stands; coordinates are at most 2^100.

use std::{
    collections::{HashMap, hash_map::Entry},
    rc::Rc,
    sync::Arc,
};

use glam::{DAffine3, DMat3, DVec3};

use crate::{
    error::Place,
    instance::{Instance, direction, mirrors, normals_map},
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
pub(super) struct Stage<'a, 'w, 'r> {
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) warnings: &'w mut WarningLog,
    pub(super) budget: &'w mut Budget<'r>,
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
    normals: DMat3,
    is_mirrored: bool,
}

impl Map {
    fn of(world_from_mesh: DAffine3) -> Self {
        Self {
            world_from_mesh,
            normals: normals_map(&world_from_mesh),
            is_mirrored: mirrors(&world_from_mesh),
        }
    }
}

/// The meshes that copies of a part share. They differ in winding and in which triangles are left
/// out, for want of area where a copy stands: usually in neither.
pub(super) type Shared = HashMap<(bool, Vec<u32>), Arc<Mesh>>;

impl Stage<'_, '_, '_> {
    /// Adds the objects that `node` shows of a mesh's parts. Their materials are indices into the
    /// document's; `no_material` stands for none. `is_shared` says whether other nodes show them too.
    pub(super) fn show(
        &mut self,
        node_index: usize,
        parts: &mut [(Part<'_>, Shared)],
        is_shared: bool,
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
        let is_shared = is_shared || copies.len() > 1;
        // All copies are charged before the first is made.
        let path = || format!("nodes[{node_index}].mesh");
        for (part, _) in &*parts {
            let passes = 1 + part.morphs(weights) + part.joints.len();
            let passes = passes.saturating_mul(copies.len());
            self.budget.charge(part.triangles.len(), passes, path)?;
        }
        for node_from_copy in copies {
            for (part, shared) in &mut *parts {
                let shape = match self.pose(node, part, world_from_node * node_from_copy)? {
                    Pose::Rigid(map) if is_shared && part.morphs(weights) == 0 => {
                        self.instance(part, shared, map, path)?
                    }
                    pose => Shape::Mesh(self.place(part, weights, &pose, path)?),
                };
                if shape.mesh().is_some_and(|mesh| !mesh.face_ends.is_empty()) {
                    objects.push(Object {
                        name: name.clone(),
                        shape,
                        material: part.material.unwrap_or(no_material),
                    });
                }
            }
        }
        Ok(())
    }

    /// Places a part that is there more than once.
    fn instance(
        &mut self,
        part: &Part<'_>,
        shared: &mut Shared,
        map: Map,
        path: impl Fn() -> String,
    ) -> Result<Shape, Fault> {
        let placed = part.positions.iter().map(|&position| {
            if !position.is_finite() {
                return Ok(None);
            }
            moved(position, &map.world_from_mesh, &path).map(Some)
        });
        let placed = placed.collect::<Result<Vec<_>, _>>()?;
        let dropped = self.dropped(&part.triangles, &placed);
        let mesh = match shared.entry((map.is_mirrored, dropped)) {
            Entry::Occupied(known) => Arc::clone(known.get()),
            Entry::Vacant(free) => {
                self.budget.take(part.bytes(), &path)?;
                let (is_mirrored, dropped) = free.key();
                let mut mesh = part.looks();
                mesh.positions = part.positions.iter().map(|&p| finite(p)).collect();
                mesh.normals = part.normals.clone();
                let turns = |_| *is_mirrored;
                add_faces(&mut mesh, &part.triangles, dropped, turns);
                Arc::clone(free.insert(Arc::new(mesh)))
            }
        };
        Ok(Shape::Instance(Instance::at(mesh, map.world_from_mesh)))
    }

    /// Finds triangles without area and those with a corner that is nowhere, and warns of them.
    fn dropped(&mut self, triangles: &[[u32; 3]], placed: &[Option<DVec3>]) -> Vec<u32> {
        let mut dropped = Vec::new();
        for (number, corners) in triangles.iter().enumerate() {
            let message = match corners.map(|vertex| placed[vertex as usize]) {
                [Some(a), Some(b), Some(c)] if has_area([a, b, c].into_iter()) => continue,
                [Some(_), Some(_), Some(_)] => "a triangle has no area: dropped",
                _ => "a triangle has a corner that is not finite: dropped",
            };
            self.warnings.add(Place::Whole, message);
            dropped.push(number as u32);
        }
        dropped
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
        self.budget.take(part.bytes(), &path)?;
        let mut mesh = part.looks();
        let mut is_mirrored = Vec::new();
        let mut placed = Vec::new();
        for at in antumbra_task::checked(0..part.positions.len()) {
            let (position, normal) = morphed(part, weights, at);
            let map = match pose {
                Pose::Rigid(map) => *map,
                Pose::Skinned(joints) => Map::of(blend(part, joints, at)?),
            };
            if let Some(normal) = normal {
                mesh.normals.push(direction(map.normals * normal));
            }
            placed.push(if position.is_finite() {
                Some(moved(position, &map.world_from_mesh, &path)?)
            } else {
                None
            });
            is_mirrored.push(map.is_mirrored);
        }
        let dropped = self.dropped(&part.triangles, &placed);
        mesh.positions = placed.into_iter().map(Option::unwrap_or_default).collect();
        let turns = |vertex: u32| is_mirrored[vertex as usize];
        add_faces(&mut mesh, &part.triangles, &dropped, turns);
        Ok(mesh)
    }
}

/// Adds triangles to a mesh, all but the dropped ones; those that begin at a vertex that `turns`
/// are wound the other way round.
fn add_faces(
    mesh: &mut Mesh,
    triangles: &[[u32; 3]],
    dropped: &[u32],
    turns: impl Fn(u32) -> bool,
) {
    let has_normals = !mesh.normals.is_empty();
    let has_uvs = !mesh.uvs.is_empty();
    let mut dropped = dropped.iter().peekable();
    for (number, &[a, b, c]) in triangles.iter().enumerate() {
        if dropped.next_if(|&&n| n as usize == number).is_some() {
            continue;
        }
        let wound = if turns(a) { [a, c, b] } else { [a, b, c] };
        mesh.corners.extend(wound.map(|vertex| Corner {
            position: vertex,
            normal: if has_normals { vertex } else { Corner::NONE },
            uv: if has_uvs { vertex } else { Corner::NONE },
        }));
        mesh.face_ends.push(mesh.corners.len() as u32);
    }
}

/// Moves a position into the world.
fn moved(
    position: DVec3,
    world_from_mesh: &DAffine3,
    path: impl Fn() -> String,
) -> Result<DVec3, Fault> {
    let position = world_from_mesh.transform_point3(position);
    if position.is_finite() && position.abs().max_element() <= LARGEST_COORDINATE {
        return Ok(position);
    }
    let problem = format!(
        "a vertex is at {}; coordinates beyond 2^100 are not supported",
        antumbra_geometry::Short(position)
    );
    Err(Fault::at(path(), problem, "scale the scene"))
}

/// Returns zero for a position that no face uses.
fn finite(position: DVec3) -> DVec3 {
    if position.is_finite() {
        position
    } else {
        DVec3::ZERO
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
