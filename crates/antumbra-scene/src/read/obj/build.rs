//! From what an OBJ file lists to the objects of a scene.
//!
//! In: all vertices, and the faces by name and material. Out: one mesh for each, with its material.
//! Invariant: meshes hold the positions and normals their faces use, each once; faces have area.

use std::collections::HashMap;

use crate::{
    defaults::AMBIENT,
    error::{Place, ReadError, quoted},
    model::{Color, Corner, Facing, Material, Mesh, Object, Scene, Shape},
    opacity,
    room::Room,
    texture::linear_of_srgb,
};

use super::{
    super::{Loaded, area::has_area, mtl::Entry, text::Corners, whole},
    Part, Reader,
    pictures::{Open, Pictures},
};

impl Reader<'_> {
    /// Checks the indices, then turns the parts into meshes.
    pub(super) fn finish(mut self, open: &mut Open<'_>, room: Room) -> Result<Loaded, ReadError> {
        self.check_indices()?;
        self.settle_colors();
        let parts = std::mem::take(&mut self.parts);
        self.part_of = HashMap::new();
        let mut scene = Scene {
            facing: Facing::Viewer,
            ambient: AMBIENT,
            ..Scene::default()
        };
        let mut material_of = HashMap::new();
        let mut causes = Vec::new();
        let mut pictures = Pictures::new(room);
        let mut slots = [self.positions.len(), self.normals.len(), self.uvs.len()].map(Slots::new);
        for part in parts {
            let Part {
                name,
                material,
                corners,
                face_ends,
                face_lines,
            } = part;
            let first_line = face_lines[0];
            let entry = material
                .as_deref()
                .and_then(|name| self.materials.get(name));
            let has_picture = entry.is_some_and(Entry::has_picture);
            let mut mesh = self.mesh(&corners, &face_ends, &face_lines, has_picture, &mut slots)?;
            if mesh.face_ends.is_empty() {
                continue;
            }
            let (material, place) = match material_of.get(&material) {
                Some(&known) => known,
                None => {
                    let entry = self.look(material.as_deref(), first_line);
                    let mut look = entry.material;
                    let place = entry.pictures.place();
                    let textures = &mut scene.textures;
                    let warnings = &mut self.warnings;
                    pictures
                        .put_on(&mut look, &entry.pictures, textures, open, warnings)
                        .map_err(|over| whole(self.file, over.into()))?;
                    scene.materials.push(look);
                    causes.push(entry.cause);
                    let found = (scene.materials.len() - 1, place);
                    material_of.insert(material, found);
                    found
                }
            };
            for uv in &mut mesh.uvs {
                *uv = place.of(*uv);
            }
            scene.objects.push(Object {
                name,
                shape: Shape::Mesh(mesh),
                material,
            });
        }
        if scene.objects.is_empty() {
            self.warnings.add(Place::Whole, "no faces in the file");
        }
        opacity::settle(
            &mut scene,
            |_, number| causes.get(number).cloned().unwrap_or_default(),
            &mut self.warnings,
        );
        let mut warnings = self.warnings.finish();
        warnings.extend(self.library_warnings);
        Ok(Loaded {
            scene,
            warnings,
            files: Vec::new(),
            is_up_assumed: false,
        })
    }

    /// Brings colors to linear ones, one for each position, or none.
    fn settle_colors(&mut self) {
        if self.colors.is_empty() {
            return;
        }
        self.colors.resize(self.positions.len(), [f32::NAN; 3]);
        let full = if self.largest_color > 1.0 { 255.0 } else { 1.0 };
        for channel in self.colors.as_flattened_mut() {
            *channel = if channel.is_nan() {
                1.0
            } else {
                linear_of_srgb(f64::from(*channel) / full) as f32
            };
        }
    }

    /// Finds the first face in the file that names a vertex the whole file does not have.
    fn check_indices(&self) -> Result<(), ReadError> {
        let count = self.positions.len();
        let mut first: Option<(u32, u32)> = None;
        for part in &self.parts {
            let mut start = 0;
            for (&end, &line) in part.face_ends.iter().zip(&part.face_lines) {
                for corner in &part.corners[start..end as usize] {
                    let index = corner.position;
                    if index as usize >= count && first.is_none_or(|(l, _)| line < l) {
                        first = Some((line, index));
                    }
                }
                start = end as usize;
            }
        }
        let Some((line, index)) = first else {
            return Ok(());
        };
        let number = u64::from(index) + 1;
        let problem = format!("index {number} names no `v`: the file has {count}");
        Err(self.invalid(line, "f", problem, "export the file again"))
    }

    /// Builds the mesh of one part, without faces that have no area or are not finite, and with
    /// texture coordinates if they are asked for.
    fn mesh(
        &mut self,
        corners: &[Corner],
        face_ends: &[u32],
        face_lines: &[u32],
        has_picture: bool,
        slots: &mut [Slots; 3],
    ) -> Result<Mesh, ReadError> {
        let mut mesh = Mesh::default();
        slots.iter_mut().for_each(Slots::begin);
        let [position_slots, normal_slots, uv_slots] = slots;
        let mut start = 0;
        for (&end, &line) in face_ends.iter().zip(face_lines) {
            let face = &corners[start..end as usize];
            start = end as usize;
            let places = face.iter().map(|c| self.positions[c.position as usize]);
            match Corners::of(places.clone()) {
                Corners::Fine => {}
                Corners::NotFinite => {
                    self.warnings.add(Place::Line(line), Corners::NOT_FINITE);
                    continue;
                }
                Corners::TooLarge(coordinate) => {
                    let problem = Corners::too_large(coordinate);
                    return Err(self.invalid(line, "f", problem, "scale the scene down"));
                }
            }
            if !has_area(places) {
                self.warnings
                    .add(Place::Line(line), "a face has no area: dropped");
                continue;
            }
            for corner in face {
                let known = mesh.positions.len();
                let position =
                    position_slots.place(corner.position, &self.positions, &mut mesh.positions);
                if mesh.positions.len() > known
                    && let Some(&[r, g, b]) = self.colors.get(corner.position as usize)
                {
                    mesh.colors.push([r, g, b, 1.0]);
                }
                let normal = match corner.normal {
                    Corner::NONE => Corner::NONE,
                    index if index as usize >= self.normals.len() => {
                        let message = "a face names a normal that is not there: none is used";
                        self.warnings.add(Place::Line(line), message);
                        Corner::NONE
                    }
                    normal => normal_slots.place(normal, &self.normals, &mut mesh.normals),
                };
                let uv = match corner.uv {
                    Corner::NONE => Corner::NONE,
                    index if index as usize >= self.uvs.len() => {
                        if has_picture {
                            let message =
                                "a face names a texture coordinate that is not there: none is used";
                            self.warnings.add(Place::Line(line), message);
                        }
                        Corner::NONE
                    }
                    _ if !has_picture => Corner::NONE,
                    uv => uv_slots.place(uv, &self.uvs, &mut mesh.uvs),
                };
                mesh.corners.push(Corner {
                    position,
                    normal,
                    uv,
                });
            }
            mesh.face_ends.push(mesh.corners.len() as u32);
        }
        Ok(mesh)
    }

    /// Returns the material of a name, or grey with a warning.
    fn look(&mut self, name: Option<&str>, line: u32) -> Entry {
        // Colors of vertices are shown as they are.
        let plain = Material {
            diffuse: if self.colors.is_empty() {
                Material::default().diffuse
            } else {
                Color::ONE
            },
            ..Material::default()
        };
        let Some(name) = name else {
            return Entry::plain(plain);
        };
        self.materials.get(name).cloned().unwrap_or_else(|| {
            let message = format!("material {} is not defined: grey is used", quoted(name));
            self.warnings.add(Place::Line(line), message);
            Entry::plain(Material {
                name: name.to_owned(),
                ..plain
            })
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
    fn place<T: Copy>(&mut self, index: u32, from: &[T], to: &mut Vec<T>) -> u32 {
        let slot = &mut self.slots[index as usize];
        if slot.0 != self.mesh {
            *slot = (self.mesh, to.len() as u32);
            to.push(from[index as usize]);
        }
        slot.1
    }
}
