//! Sphereflake: a sphere with nine spheres of a third of its radius on it, and so on.
//!
//! In: the size. Out: one square, then (9^(size + 1) - 1) / 8 spheres, three lights. The paper's
//! Flakes is size 2: 92 objects. Children touch their parents in one point.
//!
//! SPD's files hold rounding errors (`1.11022e-16` where 0 is meant). To give the same numbers,
//! the steps below follow the same order of operations as SPD's program.

use std::f64::consts::PI;

use antumbra_geometry::{DVec3, Sphere};

use crate::{
    defaults::nff_material,
    model::{Object, Polygon, Scene, Shape},
};

use super::{GenerateError, check_size, sine::sin_cos, stage};

/// The largest size: 5.4 million spheres.
const LARGEST: u32 = 7;

/// How large a child is beside its parent.
const SHRINK: f64 = 1.0 / 3.0;

/// Makes the scene of SPD's `balls -s size`.
///
/// # Errors
/// The size is not from 1 to 7.
pub fn sphereflake(size: u32) -> Result<Scene, GenerateError> {
    check_size("sphereflake", size, 1..=LARGEST)?;
    let lights = [[4.0, 3.0, 2.0], [1.0, -4.0, 4.0], [-3.0, 1.0, 5.0]].map(DVec3::from_array);
    let mut scene = stage(DVec3::new(2.1, 1.3, 1.7), DVec3::ZERO, DVec3::Z, &lights);

    // The ground, beige.
    scene.materials.push(nff_material([
        1.0, 0.75, 0.33, 0.8, 0.0, 100_000.0, 0.0, 1.0,
    ]));
    let ground = [(12.0, 12.0), (-12.0, 12.0), (-12.0, -12.0), (12.0, -12.0)];
    let vertices = ground.map(|(x, y)| DVec3::new(x, y, -0.5)).to_vec();
    let shape = Shape::Polygon(Polygon {
        vertices,
        normals: Vec::new(),
    });
    scene.objects.push(Object {
        name: String::new(),
        shape,
        material: 0,
    });

    // The flake, a mirror. Its highlight has half its strength at 37 degrees.
    let shininess = libm::log(0.5) / libm::log(libm::cos(37.0 * PI / 180.0));
    scene
        .materials
        .push(nff_material([1.0, 0.9, 0.7, 0.5, 0.5, shininess, 0.0, 1.0]));
    scene.objects.reserve_exact((9_usize.pow(size + 1) - 1) / 8);
    let trunk = Sphere {
        center: DVec3::ZERO,
        radius: 0.5,
    };
    grow(&mut scene.objects, size, trunk, DVec3::Z, &children());
    Ok(scene)
}

/// Adds a sphere that grows along `direction`, and `levels` generations of children.
fn grow(
    objects: &mut Vec<Object>,
    levels: u32,
    sphere: Sphere,
    direction: DVec3,
    children: &[DVec3; 9],
) {
    objects.push(Object {
        name: String::new(),
        shape: Shape::Sphere(sphere),
        material: 1,
    });
    if levels == 0 {
        return;
    }
    let turn = Rotation::from_z_to(direction);
    let distance = sphere.radius * (1.0 + SHRINK);
    for &child in children {
        let center = turn.apply(child) * distance + sphere.center;
        let towards_child = (center - sphere.center) / distance;
        let child = Sphere {
            center,
            radius: sphere.radius * SHRINK,
        };
        grow(objects, levels - 1, child, towards_child, children);
    }
}

/// Returns the directions of the nine children of a sphere that grows along +z: three times
/// three, each group of three around an axis of a cube that stands on its corner.
fn children() -> [DVec3; 9] {
    let d = 1.0 / 2.0_f64.sqrt();
    let tilt = Rotation::about(
        normalized(DVec3::new(1.0, -1.0, 0.0)),
        libm::asin(2.0 / 6.0_f64.sqrt()),
    );
    let trio = [
        DVec3::new(d, d, 0.0),
        DVec3::new(d, 0.0, -d),
        DVec3::new(0.0, d, -d),
    ];
    let trio = trio.map(|direction| tilt.apply(direction));
    std::array::from_fn(|i| {
        let third = (i / 3) as f64 * 2.0 * PI / 3.0;
        let (sine, cosine) = sin_cos(third);
        let turn = Rotation {
            x: DVec3::new(cosine, sine, 0.0),
            y: DVec3::new(-sine, cosine, 0.0),
            z: DVec3::Z,
        };
        turn.apply(trio[i % 3])
    })
}

/// A rotation, as the images of the three axes.
struct Rotation {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Rotation {
    /// Rotates by an angle in radians about a unit vector (Rodrigues' formula).
    fn about(axis: DVec3, angle: f64) -> Self {
        let (sine, cosine) = sin_cos(angle);
        let rest = 1.0 - cosine;
        let DVec3 { x, y, z } = axis;
        let diagonal = axis * axis + (DVec3::ONE - axis * axis) * cosine;
        let (xy, xz, yz) = (x * y * rest, x * z * rest, y * z * rest);
        Self {
            x: DVec3::new(diagonal.x, xy + z * sine, xz - y * sine),
            y: DVec3::new(xy - z * sine, diagonal.y, yz + x * sine),
            z: DVec3::new(xz + y * sine, yz - x * sine, diagonal.z),
        }
    }

    /// Takes +z to a unit vector. Where that is nearly +z or -z already, no axis can be told from
    /// rounding errors, and SPD turns by nothing or by half a turn about y.
    fn from_z_to(direction: DVec3) -> Self {
        if direction.z >= 0.9999 {
            Self {
                x: DVec3::X,
                y: DVec3::Y,
                z: DVec3::Z,
            }
        } else if direction.z <= -0.9999 {
            let (sine, cosine) = sin_cos(PI);
            Self {
                x: DVec3::new(cosine, 0.0, -sine),
                y: DVec3::Y,
                z: DVec3::new(sine, 0.0, cosine),
            }
        } else {
            Self::about(
                normalized(DVec3::Z.cross(direction)),
                libm::acos(direction.z),
            )
        }
    }

    fn apply(&self, v: DVec3) -> DVec3 {
        // The zero is the translation of SPD's matrices; it turns -0 into 0.
        v.x * self.x + v.y * self.y + v.z * self.z + DVec3::ZERO
    }
}

/// Divides by the length; a reciprocal would round differently.
fn normalized(v: DVec3) -> DVec3 {
    v / (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}
