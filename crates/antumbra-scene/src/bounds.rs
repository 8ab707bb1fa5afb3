//! The box around a scene.
//!
//! In: the objects. Out: one box that holds all of them; round shapes are held tightly up to
//! rounding. Invariant: a box never misses a vertex; for a tilted cone or disk it may be short
//! by a few units in the last place.

use antumbra_geometry::{Bounds, DVec3};

use crate::model::{Mesh, Scene, Shape};

impl Scene {
    /// Returns the box around all objects, world space; [`Bounds::EMPTY`] if there are none.
    /// Lights and the camera do not count. Takes time linear in the number of vertices.
    pub fn bounds(&self) -> Bounds {
        self.objects.iter().fold(Bounds::EMPTY, |all, object| {
            all.union(object.shape.bounds())
        })
    }
}

impl Shape {
    /// Returns the box around the shape, world space.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Polygon(polygon) => Bounds::of_points(polygon.vertices.iter().copied()),
            Self::Mesh(mesh) => of_mesh(mesh, |at| mesh.positions[at]),
            Self::Instance(instance) => of_mesh(&instance.mesh, |at| instance.position(at)),
            Self::Sphere(sphere) => {
                let radius = DVec3::splat(sphere.radius);
                Bounds {
                    min: sphere.center - radius,
                    max: sphere.center + radius,
                }
            }
            Self::Cone(cone) => {
                let axis = cone.apex - cone.base;
                of_circle(cone.base, axis, cone.base_radius).union(of_circle(
                    cone.apex,
                    axis,
                    cone.apex_radius,
                ))
            }
            Self::Disk(disk) => of_circle(disk.center, disk.normal, disk.radius),
            Self::Patch(patch) => Bounds::of_points(patch.points()),
            Self::Implicit(implicit) => implicit.bounds(),
        }
    }
}

/// Returns the box of the positions that faces use.
fn of_mesh(mesh: &Mesh, position: impl Fn(usize) -> DVec3) -> Bounds {
    let corners = mesh.corners.iter();
    Bounds::of_points(corners.map(|corner| position(corner.position as usize)))
}

/// Returns the box of a circle: along axis `i` it extends by `radius * sqrt(1 - n_i^2)`, with the
/// unit normal `n`; the sum of the two other squares keeps the digits that `1 - n_i^2` loses.
fn of_circle(center: DVec3, normal: DVec3, radius: f64) -> Bounds {
    // Scaled first, so that squares of very large or very small normals stay in range.
    let scaled = normal / normal.abs().max_element();
    let square = scaled * scaled;
    let others = DVec3::new(
        square.y + square.z,
        square.x + square.z,
        square.x + square.y,
    );
    let share = others / (square.x + square.y + square.z);
    let reach = radius * DVec3::new(share.x.sqrt(), share.y.sqrt(), share.z.sqrt());
    Bounds {
        min: center - reach,
        max: center + reach,
    }
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Cone, Disk, Sphere};

    use super::*;

    #[test]
    fn spheres_and_upright_cones_have_exact_boxes() {
        let sphere = Shape::Sphere(Sphere {
            center: DVec3::new(1.0, 2.0, 3.0),
            radius: 0.5,
        });
        assert_eq!(sphere.bounds().min, DVec3::new(0.5, 1.5, 2.5));
        assert_eq!(sphere.bounds().max, DVec3::new(1.5, 2.5, 3.5));
        let cone = Shape::Cone(Cone {
            base: DVec3::ZERO,
            base_radius: 2.0,
            apex: DVec3::new(0.0, 0.0, 5.0),
            apex_radius: 1.0,
            is_closed: false,
        });
        assert_eq!(cone.bounds().min, DVec3::new(-2.0, -2.0, 0.0));
        assert_eq!(cone.bounds().max, DVec3::new(2.0, 2.0, 5.0));
    }

    #[test]
    fn a_tilted_disk_reaches_as_far_as_its_edge() {
        let disk = Disk {
            center: DVec3::ZERO,
            normal: DVec3::new(3e200, 0.0, 4e200),
            radius: 5.0,
        };
        let bounds = Shape::Disk(disk).bounds();
        assert!((bounds.max - DVec3::new(4.0, 5.0, 3.0)).length() < 1e-12);
    }

    #[test]
    fn nothing_has_an_empty_box() {
        assert!(Scene::default().bounds().is_empty());
    }
}
