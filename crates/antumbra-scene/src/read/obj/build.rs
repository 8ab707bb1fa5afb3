//! From what an OBJ file lists to the objects of a scene.
//!
//! In: all vertices, and the faces by name and material. Out: one mesh for each, with its material.
//! Invariant: meshes hold the positions and normals their faces use, each once; faces have area.

use std::collections::HashMap;

use antumbra_geometry::DVec3;

use crate::{
    defaults::AMBIENT,
    error::{Place, ReadError, quoted},
    model::{Corner, Facing, Material, Mesh, Object, Scene, Shape},
};

use super::{
    super::{Loaded, area::has_area},
    Part, Reader,
};

impl Reader<'_> {
    /// Checks the indices, then turns the parts into meshes.
    pub(super) fn finish(mut self) -> Result<Loaded, ReadError> {
        self.check_indices()?;
        let parts = std::mem::take(&mut self.parts);
        self.part_of = HashMap::new();
        let mut scene = Scene {
            facing: Facing::Viewer,
            ambient: AMBIENT,
            ..Scene::default()
        };
        let mut material_of = HashMap::new();
        let mut position_slots = Slots::new(self.positions.len());
        let mut normal_slots = Slots::new(self.normals.len());
        for part in parts {
            let Part {
                name,
                material,
                corners,
                face_ends,
                face_lines,
            } = part;
            let first_line = face_lines[0];
            let mesh = self.mesh(
                &corners,
                &face_ends,
                &face_lines,
                &mut position_slots,
                &mut normal_slots,
            );
            if mesh.face_ends.is_empty() {
                continue;
            }
            let material = *material_of.entry(material).or_insert_with_key(|name| {
                scene.materials.push(self.look(name.as_deref(), first_line));
                scene.materials.len() - 1
            });
            scene.objects.push(Object {
                name,
                shape: Shape::Mesh(mesh),
                material,
            });
        }
        if scene.objects.is_empty() {
            self.warnings.add(Place::Whole, "no faces in the file");
        }
        let mut warnings = self.warnings.finish();
        warnings.extend(self.library_warnings);
        Ok(Loaded { scene, warnings })
    }

    /// Finds the first face in the file that names a vertex the whole file does not have.
    fn check_indices(&self) -> Result<(), ReadError> {
        let lists = [("v", self.positions.len()), ("vn", self.normals.len())];
        let is_bad = |index: u32, (_, count): (&str, usize)| {
            index != Corner::NONE && index as usize >= count
        };
        let mut first: Option<(u32, u32, (&str, usize))> = None;
        for part in &self.parts {
            let mut start = 0;
            for (&end, &line) in part.face_ends.iter().zip(&part.face_lines) {
                for corner in &part.corners[start..end as usize] {
                    for (index, list) in [(corner.position, lists[0]), (corner.normal, lists[1])] {
                        if is_bad(index, list) && first.is_none_or(|(l, ..)| line < l) {
                            first = Some((line, index, list));
                        }
                    }
                }
                start = end as usize;
            }
        }
        let Some((line, index, (list, count))) = first else {
            return Ok(());
        };
        let number = u64::from(index) + 1;
        let problem = format!("index {number} names no `{list}`: the file has {count}");
        Err(self.invalid(line, "f", problem, "export the file again"))
    }

    /// Builds the mesh of one part, without faces that have no area.
    fn mesh(
        &mut self,
        corners: &[Corner],
        face_ends: &[u32],
        face_lines: &[u32],
        position_slots: &mut Slots,
        normal_slots: &mut Slots,
    ) -> Mesh {
        let mut mesh = Mesh::default();
        position_slots.begin();
        normal_slots.begin();
        let mut start = 0;
        for (&end, &line) in face_ends.iter().zip(face_lines) {
            let face = &corners[start..end as usize];
            start = end as usize;
            if !has_area(
                face.iter()
                    .map(|corner| self.positions[corner.position as usize]),
            ) {
                self.warnings
                    .add(Place::Line(line), "a face has no area: dropped");
                continue;
            }
            for corner in face {
                let position =
                    position_slots.place(corner.position, &self.positions, &mut mesh.positions);
                let normal = match corner.normal {
                    Corner::NONE => Corner::NONE,
                    normal => normal_slots.place(normal, &self.normals, &mut mesh.normals),
                };
                mesh.corners.push(Corner {
                    normal,
                    ..Corner::at(position)
                });
            }
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        mesh
    }

    /// Returns the material of a name, or grey with a warning.
    fn look(&mut self, name: Option<&str>, line: u32) -> Material {
        let Some(name) = name else {
            return Material::default();
        };
        self.materials.get(name).cloned().unwrap_or_else(|| {
            let message = format!("material {} is not defined: grey is used", quoted(name));
            self.warnings.add(Place::Line(line), message);
            Material {
                name: name.to_owned(),
                ..Material::default()
            }
        })
    }
}

/// Says where the vertices of the file are in the mesh that is being built. Forgetting all
/// costs nothing, so many small meshes stay linear.
struct Slots {
    /// For each vertex of the file: the mesh that used it last, and its index there.
    slots: Vec<(u32, u32)>,
    mesh: u32,
}

impl Slots {
    fn new(count: usize) -> Self {
        Self {
            slots: vec![(0, 0); count],
            mesh: 0,
        }
    }

    /// Starts another mesh. A file of 4 GiB has fewer than 2^32 of them.
    fn begin(&mut self) {
        self.mesh += 1;
    }

    /// Returns the index in the mesh of a vertex of the file, copying it at its first use.
    fn place(&mut self, index: u32, from: &[DVec3], to: &mut Vec<DVec3>) -> u32 {
        let slot = &mut self.slots[index as usize];
        if slot.0 != self.mesh {
            *slot = (self.mesh, to.len() as u32);
            to.push(from[index as usize]);
        }
        slot.1
    }
}
