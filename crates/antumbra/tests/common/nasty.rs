//! The testkit's scenes as the library has them.

use std::sync::Arc;

use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, Opacity, Sphere, Start, SurfaceId,
};
use antumbra_testkit::oracle::{OracleLight, OracleShape, OracleSurface};

/// Builds the library's surfaces with the same numbers as the oracle's.
pub(crate) fn occluders(surfaces: &[OracleSurface]) -> Arc<Occluders> {
    let v = DVec3::from_array;
    let mut builder = Occluders::builder();
    for (i, surface) in surfaces.iter().enumerate() {
        let opacity = if surface.opaque {
            Opacity::Opaque
        } else {
            Opacity::Transparent
        };
        let added = match surface.shape {
            OracleShape::Triangle(corners) => builder.add_face(&corners.map(v), opacity),
            OracleShape::Sphere { center, radius } => builder.add_sphere(
                Sphere {
                    center: v(center),
                    radius,
                },
                opacity,
            ),
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let is_closed = matches!(
                    surfaces.get(i + 1).map(|next| next.shape),
                    Some(OracleShape::Cap { .. })
                );
                let (base, apex) = (v(base), v(apex));
                let cone = Cone {
                    base,
                    base_radius,
                    apex,
                    apex_radius,
                    is_closed,
                };
                builder.add_cone(cone, opacity)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let disk = Disk {
                    center: v(center),
                    normal: v(normal),
                    radius,
                };
                builder.add_disk(disk, opacity)
            }
            // Added with its tube.
            OracleShape::Cap { .. } => continue,
        };
        added.expect("numbers are in range");
    }
    let occluders = builder.build();
    assert_eq!(
        occluders.surface_count(),
        surfaces.len(),
        "surfaces are numbered alike"
    );
    Arc::new(occluders)
}

pub(crate) fn light(light: OracleLight) -> LightShape {
    match light {
        OracleLight::Point(position) => LightShape::Point(DVec3::from_array(position)),
        OracleLight::Direction(direction) => LightShape::Direction(DVec3::from_array(direction)),
    }
}

pub(crate) fn start(point: [f64; 3], surface: Option<usize>) -> Start {
    let surface = surface.map(|surface| SurfaceId(surface as u32));
    Start {
        point: DVec3::from_array(point),
        surface,
    }
}
