//! Triangles of a mesh's primitives, in the mesh's own space.
//!
//! In: a primitive's accessors. Out: [`Part`]: triangles over the vertices that they use, each
//! vertex once, in the order of first use. Invariant: indices are in range, and what is taken has
//! been charged to the [`Budget`] before. Positions are as in the file, finite or not.

use std::collections::HashMap;

use antumbra_geometry::DVec3;

use crate::{
    error::Place,
    model::{Corner, Mesh},
    warning::WarningLog,
};

use super::{
    Fault,
    accessor::{Accessor, Accessors},
    budget::Budget,
    component::Component,
    document::Primitive,
    draco::Decoded,
    materials::placing_texture,
    placing::{texture_set, texture_transform},
};

/// The triangles of one primitive.
pub(super) struct Part<'a> {
    /// Where it is in the document.
    pub(super) path: String,
    /// Corners, indices into the lists below; counter-clockwise seen from the front.
    pub(super) triangles: Vec<[u32; 3]>,
    /// For each vertex, its index in the file's attributes.
    pub(super) vertices: Vec<u32>,
    pub(super) positions: Vec<DVec3>,
    /// One for each vertex, or none at all.
    pub(super) normals: Vec<DVec3>,
    /// One for each vertex, or none at all: places in the material's texture.
    pub(super) uvs: Vec<[f64; 2]>,
    /// One for each vertex, or none at all.
    pub(super) colors: Vec<[f32; 4]>,
    /// Index into the document's materials.
    pub(super) material: Option<usize>,
    pub(super) targets: Vec<Target<'a>>,
    /// Joints and their weights, four at a time.
    pub(super) joints: Vec<[Accessor<'a>; 2]>,
}

impl Part<'_> {
    /// Returns how many morph targets take part.
    pub(super) fn morphs(&self, weights: &[f64]) -> usize {
        let weights = weights.iter().take(self.targets.len());
        weights.filter(|&&weight| weight != 0.0).count()
    }

    /// Returns a mesh with what no pose changes, without faces.
    pub(super) fn looks(&self) -> Mesh {
        Mesh {
            uvs: self.uvs.clone(),
            colors: self.colors.clone(),
            ..Mesh::default()
        }
    }

    /// Returns the bytes that the mesh of one pose takes.
    pub(super) fn bytes(&self) -> u64 {
        fn bytes<T>(items: &[T]) -> u64 {
            size_of_val(items) as u64
        }
        let face = 3 * size_of::<Corner>() as u64 + 4;
        bytes(&self.positions)
            + bytes(&self.normals)
            + bytes(&self.uvs)
            + bytes(&self.colors)
            + self.triangles.len() as u64 * face
    }
}

/// What a morph target adds at full weight.
pub(super) struct Target<'a> {
    pub(super) positions: Option<Accessor<'a>>,
    pub(super) normals: Option<Accessor<'a>>,
}

/// Reads the primitives of a document.
pub(super) struct PartReader<'a, 'w, 'r> {
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) warnings: &'w mut WarningLog,
    pub(super) budget: &'w mut Budget<'r>,
}

/// A primitive, and what it is packed in.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) primitive: &'a Primitive,
    pub(super) draco: Option<&'a Decoded>,
}

impl<'a> PartReader<'a, '_, '_> {
    /// Returns the triangles of a primitive, `None` if it is made of something else.
    pub(super) fn read(
        &mut self,
        source: Source<'a>,
        path: String,
    ) -> Result<Option<Part<'a>>, Fault> {
        let Source { primitive, draco } = source;
        let mode = primitive.mode.unwrap_or(4);
        if mode > 6 {
            let problem = format!("{mode} is no kind of primitive; expected 0 to 6");
            return Err(Fault::at(path + ".mode", problem, ""));
        }
        // What is packed is triangles, whatever the mode.
        let mode = if draco.is_some() && mode >= 4 {
            4
        } else {
            mode
        };
        // Counts.
        let positions = self.attribute(source, "POSITION", None, &path)?;
        let indices = match (draco, primitive.indices) {
            (Some(decoded), Some(indices)) => Some((indices, decoded.indices())),
            (None, Some(indices)) => {
                let here = || format!("{path}.indices");
                let accessor = self.accessors.get_whole(indices, &["SCALAR"], here)?;
                Some((indices, accessor))
            }
            (_, None) => None,
        };
        let vertex_count = positions.as_ref().map_or(0, Accessor::len);
        let index_count = indices.as_ref().map_or(vertex_count, |(_, i)| i.len());
        self.budget.charge(index_count / 3, 1, || path.clone())?;
        // Indices.
        let index = |at: usize| match &indices {
            Some((_, indices)) => indices.whole::<1>(at)[0],
            None => at as u32,
        };
        let Some(positions) = positions else {
            let message = "a primitive has no positions: dropped";
            self.warnings.add(Place::Whole, message);
            return Ok(None);
        };
        if let Some((accessor, _)) = indices
            && let Some(at) = (0..index_count).find(|&at| index(at) as usize >= vertex_count)
        {
            let problem = format!(
                "{} is {}, but there are {vertex_count} vertices",
                self.accessors.place(accessor, at),
                index(at)
            );
            return Err(Fault::at(
                path + ".indices",
                problem,
                "export the file again",
            ));
        }
        if mode < 4 {
            self.warnings
                .add(Place::Whole, "points and lines are not read");
            return Ok(None);
        }
        if index_count < 3 || (mode == 4 && index_count % 3 != 0) {
            let message = "corners that make up no triangle: dropped";
            self.warnings.add(Place::Whole, message);
        }
        let triangle_count = match mode {
            4 => index_count / 3,
            _ => index_count.saturating_sub(2),
        };
        self.budget.charge(triangle_count, 1, || path.clone())?;
        let (triangles, vertices) = compact(triangle_count, vertex_count, |triangle| {
            corners(mode, triangle).map(index)
        });
        // Vertices.
        let mut part = Part {
            triangles,
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            material: primitive.material,
            targets: Vec::new(),
            joints: Vec::new(),
            vertices,
            path,
        };
        let position = |&vertex: &u32| DVec3::from_array(positions.vector(vertex as usize));
        part.positions = antumbra_task::checked(&part.vertices)
            .map(position)
            .collect();
        let count = Some(vertex_count);
        if let Some(normals) = self.look(source, "NORMAL", count, &part.path) {
            part.normals = self.normals(&normals, &part.vertices);
        }
        if let Some(colors) = self.look(source, "COLOR_0", count, &part.path) {
            part.colors = self.colors(&colors, &part.vertices);
        }
        part.uvs = self.uvs(source, &part, vertex_count)?;
        part.joints = self.joints(source, &part.path, vertex_count)?;
        part.targets = self.targets(primitive, &part.path, vertex_count)?;
        Ok(Some(part))
    }

    /// Returns an attribute that no shadow depends on, if the primitive has it and it can be read; else says so.
    fn look(
        &mut self,
        source: Source<'a>,
        name: &str,
        count: Option<usize>,
        path: &str,
    ) -> Option<Accessor<'a>> {
        self.attribute(source, name, count, path)
            .unwrap_or_else(|Fault { kind, .. }| {
                let message = format!("`{name}` is not used: {kind}");
                self.warnings.add(Place::Whole, message);
                None
            })
    }

    /// Returns an attribute of vertices, if the primitive has it.
    fn attribute(
        &self,
        source: Source<'a>,
        name: &str,
        count: Option<usize>,
        path: &str,
    ) -> Result<Option<Accessor<'a>>, Fault> {
        let Some(&index) = source.primitive.attributes.get(name) else {
            return Ok(None);
        };
        let here = || format!("{path}.attributes.{name}");
        let shapes: &[&str] = match name {
            "POSITION" | "NORMAL" => &["VEC3"],
            "COLOR_0" => &["VEC3", "VEC4"],
            name if name.starts_with("TEXCOORD_") => &["VEC2"],
            _ => &["VEC4"],
        };
        let packed = source.draco.and_then(|decoded| decoded.attribute(name));
        let accessor = if let Some(packed) = packed {
            packed
        } else if name.starts_with("JOINTS_") {
            self.accessors.get_whole(index, shapes, here)?
        } else {
            self.accessors.get(index, shapes, here)?
        };
        if accessor.component() == Component::U32 {
            let problem = format!("{name} has 32-bit whole numbers");
            return Err(Fault::at(here(), problem, ""));
        }
        self.same_count(&accessor, count, here)?;
        Ok(Some(accessor))
    }

    fn same_count(
        &self,
        accessor: &Accessor<'_>,
        count: Option<usize>,
        path: impl Fn() -> String,
    ) -> Result<(), Fault> {
        match count {
            Some(count) if accessor.len() != count => {
                let problem = format!("{} elements for {count} vertices", accessor.len());
                Err(Fault::at(path(), problem, "export the file again"))
            }
            _ => Ok(()),
        }
    }

    fn normals(&mut self, normals: &Accessor<'_>, vertices: &[u32]) -> Vec<DVec3> {
        let read = vertices.iter().map(|&vertex| {
            let normal = DVec3::from_array(normals.vector(vertex as usize));
            if normal.is_finite() {
                return normal;
            }
            let message = "a normal is not finite: taken as missing";
            self.warnings.add(Place::Whole, message);
            DVec3::ZERO
        });
        read.collect()
    }

    /// Returns linear colors with alpha, 1 where there is none.
    fn colors(&mut self, colors: &Accessor<'_>, vertices: &[u32]) -> Vec<[f32; 4]> {
        let has_alpha = colors.width() > 3;
        let read = vertices.iter().map(|&vertex| {
            let [red, green, blue, alpha] = colors.vector(vertex as usize);
            let color = [red, green, blue, if has_alpha { alpha } else { 1.0 }];
            if !color.iter().all(|x| x.is_finite()) {
                let message = "a color of a vertex is not finite: white is used";
                self.warnings.add(Place::Whole, message);
                return [1.0; 4];
            }
            // Values above 1 are not in glTF's range; exporters round there.
            color.map(|x| x.clamp(0.0, 1.0) as f32)
        });
        read.collect()
    }

    /// Returns the places in the texture of the primitive's material, moved as the material says.
    fn uvs(
        &mut self,
        source: Source<'a>,
        part: &Part<'_>,
        vertex_count: usize,
    ) -> Result<Vec<[f64; 2]>, Fault> {
        let materials = &self.accessors.buffers().document().materials;
        let texture = match source.primitive.material {
            None => None,
            Some(index) => match materials.get(index) {
                None => {
                    let path = format!("{}.material", part.path);
                    let count = materials.len();
                    return Err(Fault::missing(path, "materials", index, count));
                }
                Some(material) => placing_texture(material),
            },
        };
        let Some(texture) = texture else {
            return Ok(Vec::new());
        };
        let name = format!("TEXCOORD_{}", texture_set(texture));
        let count = Some(vertex_count);
        let Some(uvs) = self.attribute(source, &name, count, &part.path)? else {
            let message = format!("a textured primitive has no `{name}`: the plain color is used");
            self.warnings.add(Place::Whole, message);
            return Ok(Vec::new());
        };
        let place = texture_transform(texture);
        let read = part.vertices.iter().map(|&vertex| {
            let uv = place(uvs.vector(vertex as usize));
            if uv.iter().all(|x| x.is_finite()) {
                return uv;
            }
            let message = "a texture coordinate is not finite: 0 is used";
            self.warnings.add(Place::Whole, message);
            [0.0; 2]
        });
        Ok(read.collect())
    }

    fn joints(
        &self,
        source: Source<'a>,
        path: &str,
        vertex_count: usize,
    ) -> Result<Vec<[Accessor<'a>; 2]>, Fault> {
        let mut sets = Vec::new();
        loop {
            let count = Some(vertex_count);
            let joints = format!("JOINTS_{}", sets.len());
            let weights = format!("WEIGHTS_{}", sets.len());
            let joints = self.attribute(source, &joints, count, path)?;
            let weights = self.attribute(source, &weights, count, path)?;
            match (joints, weights) {
                (Some(joints), Some(weights)) => sets.push([joints, weights]),
                _ => return Ok(sets),
            }
        }
    }

    fn targets(
        &mut self,
        primitive: &Primitive,
        path: &str,
        vertex_count: usize,
    ) -> Result<Vec<Target<'a>>, Fault> {
        let mut targets = Vec::new();
        for (at, target) in primitive.targets.iter().enumerate() {
            let attribute = |name: &str| {
                let Some(&index) = target.get(name) else {
                    return Ok(None);
                };
                let here = || format!("{path}.targets[{at}].{name}");
                let accessor = self.accessors.get(index, &["VEC3"], here)?;
                self.same_count(&accessor, Some(vertex_count), here)?;
                Ok(Some(accessor))
            };
            let (positions, normals) = (attribute("POSITION")?, attribute("NORMAL"));
            let normals = normals.unwrap_or_else(|Fault { kind, .. }| {
                let message = format!("`NORMAL` of a morph target is not used: {kind}");
                self.warnings.add(Place::Whole, message);
                None
            });
            targets.push(Target { positions, normals });
        }
        Ok(targets)
    }
}

/// Returns where the corners of a triangle are among the indices (glTF 2.0, 3.7.2.1).
fn corners(mode: u32, triangle: usize) -> [usize; 3] {
    match mode {
        4 => [0, 1, 2].map(|corner| 3 * triangle + corner),
        5 => {
            let turn = triangle % 2;
            [triangle, triangle + 1 + turn, triangle + 2 - turn]
        }
        _ => [triangle + 1, triangle + 2, 0],
    }
}

/// Numbers the vertices that triangles use anew, in the order of first use.
fn compact(
    triangle_count: usize,
    vertex_count: usize,
    triangle: impl Fn(usize) -> [u32; 3],
) -> (Vec<[u32; 3]>, Vec<u32>) {
    const NEW: u32 = u32::MAX;
    let mut vertices = Vec::new();
    let mut number = |vertex: u32, slot: &mut u32| {
        if *slot == NEW {
            *slot = vertices.len() as u32;
            vertices.push(vertex);
        }
        *slot
    };
    // A table costs as much as the vertices, of which few triangles may use few.
    let triangles = if vertex_count <= 8 * triangle_count {
        let mut slots = vec![NEW; vertex_count];
        let numbered = |t| triangle(t).map(|v| number(v, &mut slots[v as usize]));
        (0..triangle_count).map(numbered).collect()
    } else {
        let mut slots = HashMap::new();
        let numbered = |t| triangle(t).map(|v| number(v, slots.entry(v).or_insert(NEW)));
        (0..triangle_count).map(numbered).collect()
    };
    (triangles, vertices)
}
