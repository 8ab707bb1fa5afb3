//! All surfaces of a scene, as the accelerator sees them.
//!
//! In: faces and analytic shapes, one *element* each (the paper's "objects"). Out: numbered
//! *surfaces* that rays and queries name: the triangles of the faces first, then spheres, tubes
//! and disks. Invariant: vertices with equal positions have one index; numbers are finite and at
//! most 2^100 in magnitude; elements keep the order in which they were added.

mod build;
mod data;
mod filtering;
mod identity;
mod indexed;
mod nearest;
mod own;
mod query;
mod rounding;
mod sides;

pub use crate::ids::{ElementId, SurfaceId};
pub use build::{OccludersBuilder, OccludersError};
use data::{
    AlphaTest, Curved, CurvedShape, NO_ALPHA_TEST, NO_CORNER, Solid, Surface, is_too_small,
};
pub use data::{Element, ElementKind, Occluders, Opacity};
pub(crate) use data::{NO_AXIS, Triangle};
pub use identity::UnidentifiedCoverage;
pub use nearest::Gap;
pub use own::OwnRule;
pub use query::ReceiverTriangle;
pub(crate) use query::{OwnShape, RoundShape};
pub use rounding::Precision;
pub use sides::{SurfacePlane, sides_of_normal};

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::Cone;

    #[test]
    fn normals_of_small_and_large_surfaces() {
        for size in [5e-324, 1e-300, 1e-170, 1e-90, 1.0, 1e30] {
            let mut builder = Occluders::builder();
            let at = |x: f64, y: f64| DVec3::new(x * size, y * size, 0.0);
            let face = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
            builder.add_face(&face, Opacity::Opaque).unwrap();
            let sphere = crate::Sphere {
                center: DVec3::ZERO,
                radius: size,
            };
            builder.add_sphere(sphere, Opacity::Opaque).unwrap();
            let disk = crate::Disk {
                center: DVec3::ZERO,
                normal: DVec3::new(0.0, 0.0, size),
                radius: size,
            };
            builder.add_disk(disk, Opacity::Opaque).unwrap();
            let cylinder = Cone {
                base: DVec3::ZERO,
                base_radius: size,
                apex: DVec3::new(size, 0.0, 0.0),
                apex_radius: size,
                is_closed: false,
            };
            builder.add_cone(cylinder, Opacity::Opaque).unwrap();
            let occluders = builder.build();
            for surface in occluders.surfaces() {
                let normal = occluders.normal_at(surface, DVec3::new(0.0, 0.0, size));
                // Its length is rounded.
                let difference = (normal - DVec3::Z).length();
                assert!(difference <= f64::EPSILON, "{size} {surface:?}: {normal}");
            }
        }
    }
}
