//! The surface of a point, by the second implementation of the rule.

use std::sync::Arc;

use antumbra::{GridResolution, Method, Nearness, RayMethod, ShadowIndex};
use antumbra_geometry::{Cone, DVec3, Disk, Occluders, Opacity, Precision, Sphere, SurfaceId};
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::{Oracle, OraclePoint, OracleShape, OracleSurface};

use crate::common::Random;
use crate::{UP, index_of};

/// The library's surfaces with the same numbers as the oracle's.
fn same_surfaces(surfaces: &[OracleSurface]) -> Option<Arc<Occluders>> {
    let v = DVec3::from_array;
    let mut builder = Occluders::builder();
    for surface in surfaces {
        let added = match surface.shape {
            OracleShape::Triangle(corners) => builder.add_face(&corners.map(v), Opacity::Opaque),
            OracleShape::Sphere { center, radius } => {
                let center = v(center);
                builder.add_sphere(Sphere { center, radius }, Opacity::Opaque)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let (center, normal) = (v(center), v(normal));
                let disk = Disk {
                    center,
                    normal,
                    radius,
                };
                builder.add_disk(disk, Opacity::Opaque)
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let cone = Cone {
                    base: v(base),
                    base_radius,
                    apex: v(apex),
                    apex_radius,
                    is_closed: surface.solid.is_some(),
                };
                builder.add_cone(cone, Opacity::Opaque)
            }
            OracleShape::Cap { .. } => continue,
        };
        added.ok()?;
    }
    let occluders = builder.build();
    (occluders.surface_count() == surfaces.len()).then(|| Arc::new(occluders))
}

/// The tree, the grid and the oracle, which measures every surface by the page.
#[test]
fn surfaces_of_points_are_those_of_the_page() {
    let (mut asked, mut named, mut chosen) = (0, 0, 0);
    for seed in 0..120 {
        let scene = nasty::scene(seed);
        let largest = scene
            .queries
            .iter()
            .flat_map(|query| query.point)
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        // The oracle squares plain numbers.
        if !(1e-60..1e60).contains(&largest) {
            continue;
        }
        let Some(occluders) = same_surfaces(&scene.surfaces) else {
            continue;
        };
        let oracle = Oracle::new(scene.surfaces.clone());
        let by_tree = index_of(&occluders, &[UP], Method::Bvh);
        let by_grid = ShadowIndex::builder(Arc::clone(&occluders), vec![UP])
            .method(Method::Grid)
            .rays(RayMethod::Grid)
            .grid(GridResolution::Fixed([7; 3]))
            .build()
            .expect("an index");
        let random = &mut Random(seed);
        for query in &scene.queries {
            // Whether what is hardly a number becomes zero is not the page's matter.
            let is_tiny = |x: f64| x != 0.0 && x.abs() < 1e-150;
            if query.point.into_iter().any(is_tiny) {
                continue;
            }
            let normals = [
                None,
                Some([0.0, 0.0, 1.0]),
                Some(random.in_cube().to_array()),
            ];
            for normal in normals {
                for (is_single, tolerance) in [
                    (false, None),
                    (true, None),
                    (false, Some(0.0)),
                    (true, Some(0.3 * largest)),
                    (false, Some(f64::INFINITY)),
                ] {
                    let point = match is_single {
                        true => query.point.map(|x| f64::from(x as f32)),
                        false => query.point,
                    };
                    let expected = oracle.surface_of(&OraclePoint {
                        point,
                        normal,
                        is_single,
                        tolerance,
                    });
                    let nearness = Nearness {
                        precision: match is_single {
                            true => Precision::Single,
                            false => Precision::Double,
                        },
                        tolerance,
                    };
                    asked += 1;
                    named += usize::from(expected.is_some());
                    for index in [&by_tree, &by_grid] {
                        let normal = normal.map(DVec3::from_array);
                        let found = index.start_near(DVec3::from_array(point), normal, nearness);
                        let found = found.and_then(|start| start.surface);
                        chosen += usize::from(found.is_some() && normal.is_some());
                        assert_eq!(
                            found,
                            expected.map(|surface| SurfaceId(surface as u32)),
                            "{}: {point:?} {normal:?} {nearness:?}",
                            scene.label()
                        );
                    }
                }
            }
        }
    }
    assert!(
        asked > 10_000 && named > asked / 3 && chosen > 5_000,
        "{asked} {named} {chosen}"
    );
}
