//! A scene as Embree takes it.
//!
//! In: the surfaces, and the scene they come from. Out: triangles and spheres in `f32`. Faces are
//! cut as the library cuts them; vertices with equal positions are one, so that edges are shared.
//! Embree has no cones and disks like ours: they become triangles, inscribed.

use std::collections::HashMap;

use antumbra_geometry::{Cone, DVec3, Occluders, Opacity};
use antumbra_scene::model::{Corner, Mesh, Scene, Shape};

/// How many sides the circles of cones and disks get.
const SIDES: u32 = 128;

/// How many cells the boxes of implicit surfaces get along their longest side.
const FREEFORM_CELLS: u32 = 128;

/// Triangles and spheres, opaque ones only.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    pub(super) vertices: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Centre and radius.
    pub(super) spheres: Vec<[f32; 4]>,
    notes: Vec<String>,
}

impl Geometry {
    /// Converts the opaque surfaces of a scene; `occluders` are the same scene's.
    pub fn of(scene: &Scene, occluders: &Occluders) -> Self {
        let mut geometry = Self::of_triangles(occluders);
        let (mut tessellated, mut freeform) = (0, 0);
        for object in &scene.objects {
            if !scene.materials[object.material].is_opaque() {
                continue;
            }
            match &object.shape {
                // Their triangles are there already.
                Shape::Polygon(_) | Shape::Mesh(_) | Shape::Instance(_) => {}
                Shape::Sphere(sphere) => {
                    let center = sphere.center.as_vec3();
                    let radius = sphere.radius as f32;
                    if radius > 0.0 {
                        geometry
                            .spheres
                            .push([center.x, center.y, center.z, radius]);
                    }
                }
                Shape::Cone(cone) => {
                    tessellated += 1;
                    geometry.add_cone(cone);
                }
                Shape::Disk(disk) => {
                    tessellated += 1;
                    geometry.add_disk(disk.center, disk.normal, disk.radius);
                }
                Shape::Patch(_) | Shape::Implicit(_) => {
                    freeform += 1;
                    // Patches are what they stand for, up to the finest that a mesh may be.
                    let cells = match &object.shape {
                        Shape::Patch(patch) => patch.cells(),
                        _ => FREEFORM_CELLS,
                    };
                    geometry.add_mesh(object.shape.tessellated(cells));
                }
            }
        }
        if tessellated > 0 {
            geometry.notes.push(format!(
                "{tessellated} cones and disks have {SIDES} flat sides for Embree"
            ));
        }
        if freeform > 0 {
            geometry.notes.push(format!(
                "{freeform} patches and implicit surfaces are meshes for Embree: of all of a patch's triangles, and of \
                 {FREEFORM_CELLS} cells along a box"
            ));
        }
        geometry
    }

    /// Converts the opaque triangles alone.
    pub fn of_triangles(occluders: &Occluders) -> Self {
        let mut geometry = Self::default();
        let mut numbers = HashMap::new();
        let opaque = occluders
            .surfaces()
            .take(occluders.triangle_count())
            .filter(|&surface| occluders.is_opaque(surface));
        for corners in opaque.filter_map(|surface| occluders.triangle_positions(surface)) {
            let triangle = corners.map(|corner| {
                *numbers
                    .entry(corner.to_array().map(f64::to_bits))
                    .or_insert_with(|| geometry.add_vertex(corner))
            });
            geometry.triangles.push(triangle);
        }
        let with_holes = occluders
            .elements()
            .iter()
            .filter(|element| matches!(element.opacity, Opacity::AlphaTested(_)))
            .count();
        if with_holes > 0 {
            geometry.notes.push(format!(
                "{with_holes} faces with holes are whole for Embree"
            ));
        }
        geometry
    }

    /// Returns what Embree is given otherwise than we are, for people.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns how many triangles and spheres there are.
    pub fn primitive_counts(&self) -> [usize; 2] {
        [self.triangles.len(), self.spheres.len()]
    }

    /// Returns the largest magnitude of a coordinate.
    pub(super) fn largest_coordinate(&self) -> f64 {
        let vertices = self.vertices.iter().flatten().map(|c| c.abs());
        let spheres = self
            .spheres
            .iter()
            .flat_map(|[x, y, z, radius]| [x, y, z].map(|c| c.abs() + radius));
        f64::from(vertices.chain(spheres).fold(0.0, f32::max))
    }

    fn add_vertex(&mut self, position: DVec3) -> u32 {
        self.vertices.push(position.as_vec3().to_array());
        self.vertices.len() as u32 - 1
    }

    /// Adds a mesh of triangles.
    fn add_mesh(&mut self, mesh: Option<Mesh>) {
        let Some(mesh) = mesh else { return };
        let first = self.vertices.len() as u32;
        for &position in &mesh.positions {
            self.add_vertex(position);
        }
        let triangles = mesh
            .faces()
            .filter_map(|face| <[Corner; 3]>::try_from(face).ok());
        let triangles = triangles.map(|face| face.map(|corner| first + corner.position));
        self.triangles.extend(triangles);
    }

    fn add_cone(&mut self, cone: &Cone) {
        let axis = cone.apex - cone.base;
        if axis == DVec3::ZERO {
            return;
        }
        let base = self.add_circle(cone.base, axis, cone.base_radius);
        let apex = self.add_circle(cone.apex, axis, cone.apex_radius);
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            if cone.base_radius > 0.0 {
                self.triangles.push([base + side, base + next, apex + side]);
            }
            if cone.apex_radius > 0.0 {
                self.triangles.push([base + next, apex + next, apex + side]);
            }
        }
        if cone.is_closed {
            self.add_disk(cone.base, axis, cone.base_radius);
            self.add_disk(cone.apex, axis, cone.apex_radius);
        }
    }

    fn add_disk(&mut self, center: DVec3, normal: DVec3, radius: f64) {
        if radius <= 0.0 || normal == DVec3::ZERO {
            return;
        }
        let rim = self.add_circle(center, normal, radius);
        let middle = self.add_vertex(center);
        let fan = (0..SIDES).map(|side| [rim + side, rim + (side + 1) % SIDES, middle]);
        self.triangles.extend(fan);
    }

    /// Adds a circle's vertices and returns the number of the first.
    fn add_circle(&mut self, center: DVec3, normal: DVec3, radius: f64) -> u32 {
        let unit = (normal / normal.abs().max_element()).normalize();
        let (across, along) = unit.any_orthonormal_pair();
        let first = self.vertices.len() as u32;
        for side in 0..SIDES {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(SIDES);
            let (sine, cosine) = libm::sincos(angle);
            self.add_vertex(center + radius * (cosine * across + sine * along));
        }
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_geometry::Disk;
    use antumbra_scene::model::{Material, Object};

    #[test]
    fn curved_shapes_become_triangles_and_say_so() {
        let cone = Cone {
            base: DVec3::ZERO,
            base_radius: 1.0,
            apex: DVec3::Z,
            apex_radius: 0.0,
            is_closed: true,
        };
        let disk = Disk {
            center: DVec3::ZERO,
            normal: DVec3::X,
            radius: 2.0,
        };
        let object = |shape| Object {
            name: String::new(),
            shape,
            material: 0,
        };
        let scene = Scene {
            materials: vec![Material::default()],
            objects: vec![object(Shape::Cone(cone)), object(Shape::Disk(disk))],
            ..Scene::default()
        };
        let geometry = Geometry::of(&scene, &Occluders::default());
        // One triangle a side for the wall, the cap and the disk.
        assert_eq!(geometry.primitive_counts(), [3 * SIDES as usize, 0]);
        assert_eq!(geometry.largest_coordinate(), 2.0);
        assert_eq!(
            geometry.notes(),
            ["2 cones and disks have 128 flat sides for Embree"]
        );
    }
}
