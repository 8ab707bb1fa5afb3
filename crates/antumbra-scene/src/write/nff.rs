//! Writes NFF.
//!
//! In: a scene. Out: NFF text, as SPD's programs lay it out. Invariant: nothing that blocks or
//! gives light, and no look of a surface, is left out or changed in silence: what NFF cannot say is refused
//! by name. Names, the ambient term, [`Scene::facing`] and one-sidedness have no place in NFF and are dropped;
//! `hither` is written as 0.

use std::io::{self, Write};

use antumbra_geometry::{BezierPatch, DVec3, Field, Implicit};

use crate::{
    defaults::nff_intensity,
    model::{Alpha, Color, Corner, Light, LightKind, Material, Mesh, Polygon, Scene, Shape},
};

use super::{WriteError, number::Precision};

/// Writes a scene as NFF: polygons, patches, meshes (a polygon or patch for each face), spheres,
/// open cones, point lights.
///
/// With [`Precision::Exact`], a scene that was read from NFF is read back equal, except for
/// object names. Buffer `out`: many small pieces are written.
///
/// # Errors
/// `out` refuses, or NFF cannot say something: disks, closed cones, directional and spot lights, lights with size,
/// falloff, textures and alpha, emission, colored highlights or transmission, a highlight without its mirror.
///
/// # Example
/// ```
/// use antumbra_scene::{generate::tetra, write::{Precision, write_nff}};
/// let mut text = Vec::new();
/// write_nff(&tetra(1).unwrap(), Precision::SixDigits, &mut text).unwrap();
/// assert!(String::from_utf8(text).unwrap().starts_with("b 0.078 0.361 0.753\nv\nfrom 1.02285"));
/// ```
pub fn write_nff(
    scene: &Scene,
    precision: Precision,
    out: &mut impl Write,
) -> Result<(), WriteError> {
    let mut writer = Writer { precision, out };
    writer.line("b", &scene.background.to_array())?;
    if let Some(camera) = &scene.camera {
        writeln!(writer.out, "v")?;
        writer.line("from", &camera.eye.to_array())?;
        writer.line("at", &camera.at.to_array())?;
        writer.line("up", &camera.up.to_array())?;
        writer.line("angle", &[camera.vertical_fov_degrees])?;
        writer.line("hither", &[0.0])?;
        if let Some([width, height]) = camera.resolution {
            writeln!(writer.out, "resolution {width} {height}")?;
        }
    }
    let plain = Color::splat(nff_intensity(scene.lights.len()));
    if let Some(light) = scene.area_lights.first() {
        return Err(WriteError::Unsupported {
            format: "NFF",
            what: "a light with size",
            index: 0,
            name: light.name.clone(),
        });
    }
    for (index, light) in scene.lights.iter().enumerate() {
        writer.light(index, light, plain)?;
    }
    let mut material_in_force = None;
    for (index, object) in scene.objects.iter().enumerate() {
        if material_in_force != Some(object.material) {
            writer.material(object.material, &scene.materials[object.material])?;
            material_in_force = Some(object.material);
        }
        let unsupported = |what| WriteError::Unsupported {
            format: "NFF",
            what,
            index,
            name: object.name.clone(),
        };
        match &object.shape {
            Shape::Polygon(polygon) => writer.polygon(polygon)?,
            Shape::Mesh(mesh) => writer.mesh(mesh)?,
            Shape::Instance(instance) => writer.mesh(&instance.to_mesh())?,
            Shape::Sphere(sphere) => {
                let [x, y, z] = sphere.center.to_array();
                writer.line("s", &[x, y, z, sphere.radius])?;
            }
            Shape::Cone(cone) if cone.is_closed => {
                return Err(unsupported("a closed cone or cylinder"));
            }
            Shape::Cone(cone) => {
                let ([bx, by, bz], [ax, ay, az]) = (cone.base.to_array(), cone.apex.to_array());
                writer.line(
                    "c",
                    &[bx, by, bz, cone.base_radius, ax, ay, az, cone.apex_radius],
                )?;
            }
            Shape::Disk(_) => return Err(unsupported("a disk")),
            Shape::Patch(patch) => writer.patch(patch)?,
            Shape::Implicit(implicit) => writer.implicit(implicit)?,
        }
    }
    Ok(())
}

struct Writer<'a, W> {
    precision: Precision,
    out: &'a mut W,
}

impl<W: Write> Writer<'_, W> {
    /// Writes a keyword, if there is one, and numbers.
    fn line(&mut self, keyword: &str, numbers: &[f64]) -> io::Result<()> {
        write!(self.out, "{keyword}")?;
        for (i, &number) in numbers.iter().enumerate() {
            let blank = if i == 0 && keyword.is_empty() {
                ""
            } else {
                " "
            };
            write!(self.out, "{blank}{}", self.precision.text(number))?;
        }
        writeln!(self.out)
    }

    /// Writes a patch: antumbra's own addition to NFF.
    fn patch(&mut self, patch: &BezierPatch) -> io::Result<()> {
        writeln!(self.out, "bezier {}", patch.level)?;
        patch
            .points()
            .try_for_each(|point| self.line("", &point.to_array()))
    }

    /// Writes an implicit surface: antumbra's own addition to NFF.
    fn implicit(&mut self, Implicit { field, low, high }: &Implicit) -> io::Result<()> {
        let bounds = [low.to_array(), high.to_array()].concat();
        let numbers = |center: &DVec3, more: &[f64]| [&center.to_array(), more].concat();
        match field {
            Field::Torus {
                center,
                axis,
                major,
                minor,
            } => {
                let [x, y, z] = axis.to_array();
                self.line("torus", &numbers(center, &[x, y, z, *major, *minor]))
            }
            Field::Metaballs { balls, threshold } => {
                let head = format!("metaballs {}", balls.len());
                self.line(&head, &[&[*threshold][..], &bounds].concat())?;
                balls.iter().try_for_each(|ball| {
                    self.line("", &numbers(&ball.center, &[ball.radius, ball.strength]))
                })
            }
            Field::Gyroid {
                center,
                period,
                level,
            } => self.line(
                "gyroid",
                &[numbers(center, &[*period, *level]), bounds].concat(),
            ),
            Field::Polynomial {
                center,
                unit,
                terms,
            } => {
                let head = format!("polynomial {}", terms.len());
                self.line(&head, &[numbers(center, &[*unit]), bounds].concat())?;
                terms.iter().try_for_each(|term| {
                    let [i, j, k] = term.exponents.map(f64::from);
                    self.line("", &[term.factor, i, j, k])
                })
            }
        }
    }

    fn light(&mut self, index: usize, light: &Light, plain: Color) -> Result<(), WriteError> {
        let unsupported = |what| WriteError::Unsupported {
            format: "NFF",
            what,
            index,
            name: light.name.clone(),
        };
        let position = match light.kind {
            LightKind::Point { position } => position,
            LightKind::Directional { .. } => return Err(unsupported("a directional light")),
            LightKind::Spot { .. } => return Err(unsupported("a spot light")),
        };
        if light.falls_off {
            return Err(unsupported("a light that falls off with distance"));
        }
        let ([x, y, z], [r, g, b]) = (position.to_array(), light.color.to_array());
        if light.color == plain {
            self.line("l", &[x, y, z])?;
        } else {
            self.line("l", &[x, y, z, r, g, b])?;
        }
        Ok(())
    }

    fn material(&mut self, index: usize, material: &Material) -> Result<(), WriteError> {
        let unsupported = |what| {
            Err(WriteError::Unsupported {
                format: "NFF",
                what,
                index,
                name: material.name.clone(),
            })
        };
        let is_grey = |color: Color| color == Color::splat(color.x);
        if material.diffuse_texture.is_some() || material.alpha != Alpha::Opaque {
            return unsupported("a material with a texture, with cut-outs, or that blends");
        }
        if material.bump.is_some() {
            return unsupported("a material with a relief");
        }
        if material.emission != Color::ZERO {
            return unsupported("a material that sends out light");
        }
        if !is_grey(material.specular) || !is_grey(material.transmission) {
            return unsupported("a material with a colored highlight or colored transmission");
        }
        if material.specular != material.reflection {
            return unsupported("a material whose highlight and mirror have different weights");
        }
        // NFF's color is a product. One factor of 1 keeps every digit; a largest channel of 1 is
        // what people write.
        let kd = match self.precision {
            Precision::SixDigits if material.diffuse.max_element() > 0.0 => {
                material.diffuse.max_element()
            }
            _ => 1.0,
        };
        let [r, g, b] = (material.diffuse / kd).to_array();
        let (ks, transmittance) = (material.specular.x, material.transmission.x);
        let (shininess, ior) = (material.shininess, material.ior);
        Ok(self.line("f", &[r, g, b, kd, ks, shininess, transmittance, ior])?)
    }

    fn polygon(&mut self, polygon: &Polygon) -> io::Result<()> {
        let mut normals = polygon.normals.iter().copied();
        let corners = polygon
            .vertices
            .iter()
            .map(|&vertex| (vertex, normals.next()));
        self.face(&corners.collect::<Vec<_>>())
    }

    fn mesh(&mut self, mesh: &Mesh) -> io::Result<()> {
        for face in mesh.faces() {
            let corner = |corner: &Corner| {
                let has_normal = corner.normal != Corner::NONE;
                let normal = has_normal.then(|| mesh.normals[corner.normal as usize]);
                (mesh.positions[corner.position as usize], normal)
            };
            self.face(&face.iter().map(corner).collect::<Vec<_>>())?;
        }
        Ok(())
    }

    /// Writes `pp` if a corner has a normal, with zero for those that have none, else `p`.
    fn face(&mut self, corners: &[(DVec3, Option<DVec3>)]) -> io::Result<()> {
        let is_patch = corners.iter().any(|(_, normal)| normal.is_some());
        writeln!(
            self.out,
            "{} {}",
            if is_patch { "pp" } else { "p" },
            corners.len()
        )?;
        for &(position, normal) in corners {
            let [x, y, z] = position.to_array();
            if is_patch {
                let [nx, ny, nz] = normal.unwrap_or(DVec3::ZERO).to_array();
                self.line("", &[x, y, z, nx, ny, nz])?;
            } else {
                self.line("", &[x, y, z])?;
            }
        }
        Ok(())
    }
}
