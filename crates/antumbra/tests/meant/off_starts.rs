//! Starts that are not where their surface is: all methods answer alike.

use std::sync::Arc;

use antumbra::{
    Counters, GridResolution, LightId, Method, Refine, Refinement, Shadow, ShadowIndex,
};
use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId,
};

use crate::common::{METHODS, Random};
use crate::index_of;

/// All methods, that of the paper and the one of today with several sizes of voxels.
fn all_indices(occluders: &Arc<Occluders>, lights: &[LightShape]) -> Vec<(String, ShadowIndex)> {
    let mut indices = Vec::new();
    let builder =
        |method| ShadowIndex::builder(Arc::clone(occluders), lights.to_vec()).method(method);
    for method in [Method::Voxel1990, Method::Grid, Method::Bvh] {
        for resolution in [1, 8, 23] {
            let index = builder(method)
                .grid(GridResolution::Fixed([resolution; 3]))
                .build();
            indices.push((format!("{method:?} {resolution}"), index.expect("an index")));
        }
    }
    for refine in [Refine::Eager, Refine::Queried, Refine::Lazy] {
        for resolution in [16, 256] {
            let refinement = Refinement {
                resolution,
                space_resolution: resolution,
                refine,
                ..Refinement::default()
            };
            let index = builder(Method::Voxel).refinement(refinement).build();
            indices.push((
                format!("Voxel {refine:?} {resolution}"),
                index.expect("an index"),
            ));
        }
    }
    indices
}

/// Compares all methods with the reference, one by one and together.
fn agree(occluders: &Arc<Occluders>, lights: &[LightShape], starts: &[ReceiverPoint], label: &str) {
    let indices = all_indices(occluders, lights);
    for light in 0..lights.len() {
        let expected: Vec<bool> = starts
            .iter()
            .map(|start| {
                let answer = indices[0]
                    .1
                    .shadow_by_reference(start, LightId::from_index(light));
                answer.expect("a fine query") == Shadow::Shadowed
            })
            .collect();
        for (name, index) in &indices {
            let mut together = vec![false; starts.len()];
            index
                .shadows(
                    starts,
                    LightId::from_index(light),
                    &mut together,
                    &mut Counters::default(),
                )
                .expect("fine queries");
            for (number, start) in starts.iter().enumerate() {
                let answer =
                    index.shadow(start, LightId::from_index(light), &mut Counters::default());
                let alone = answer.expect("a fine query").shadow == Shadow::Shadowed;
                assert_eq!(
                    [alone, together[number]],
                    [expected[number]; 2],
                    "{label}: {name}, {:?}, {start:?}",
                    lights[light]
                );
            }
        }
    }
}

/// A sphere, an open tube, a closed cone, a closed cylinder and a disk, with a floor, at a place.
fn curved_shapes(place: DVec3) -> Arc<Occluders> {
    let v = |x, y, z| place + DVec3::new(x, y, z);
    let mut builder = Occluders::builder();
    let floor = [
        v(-4.0, -4.0, -1.5),
        v(9.0, -4.0, -1.5),
        v(9.0, 9.0, -1.5),
        v(-4.0, 9.0, -1.5),
    ];
    builder.add_face(&floor, Opacity::Opaque).expect("a face");
    let sphere = |center, radius| Sphere { center, radius };
    builder
        .add_sphere(sphere(v(0.0, 0.0, 0.0), 1.0), Opacity::Opaque)
        .expect("a sphere");
    builder
        .add_sphere(sphere(v(0.5, 0.5, 3.0), 0.5), Opacity::Opaque)
        .expect("a sphere");
    let cone = |base, base_radius, apex, apex_radius, is_closed| Cone {
        base,
        base_radius,
        apex,
        apex_radius,
        is_closed,
    };
    for cone in [
        cone(v(4.0, 0.0, -1.0), 1.0, v(4.2, 0.1, 1.0), 0.5, false),
        cone(v(0.0, 4.0, -1.0), 1.0, v(0.1, 4.2, 1.0), 0.0, true),
        cone(v(4.0, 4.0, -1.0), 0.75, v(4.0, 4.0, 1.0), 0.75, true),
    ] {
        builder.add_cone(cone, Opacity::Opaque).expect("a cone");
    }
    let disk = Disk {
        center: v(7.0, 7.0, 0.5),
        normal: DVec3::new(0.2, 0.1, 1.0),
        radius: 1.0,
    };
    builder.add_disk(disk, Opacity::Opaque).expect("a disk");
    Arc::new(builder.build())
}

fn lamps(place: DVec3) -> [LightShape; 4] {
    [
        LightShape::Direction(DVec3::new(0.3, 0.2, 1.0)),
        LightShape::Direction(DVec3::X),
        LightShape::Point(place + DVec3::new(2.0, 2.0, 6.0)),
        // Inside the cylinder.
        LightShape::Point(place + DVec3::new(4.0, 4.0, 0.25)),
    ]
}

#[test]
fn starts_rounded_to_f32_off_curved_surfaces_answer_alike_by_all_methods() {
    let random = &mut Random(11);
    for place in [0.0, 1e3, 1e4, 1e5, 1e6, 5e6, 1e7] {
        let place = DVec3::new(place, 0.7 * place, -0.3 * place);
        let occluders = curved_shapes(place);
        let mut starts = Vec::new();
        for number in 0..400 {
            let surface = SurfaceId(number % occluders.surface_count() as u32);
            let beside = occluders.surface_bounds(surface).center() + 1.3 * random.in_cube();
            let on = occluders.start_on(surface, beside).point;
            let rounded = DVec3::from_array(on.to_array().map(|x| f64::from(x as f32)));
            for point in [rounded, on] {
                starts.push(ReceiverPoint {
                    point,
                    surface: Some(surface),
                });
            }
        }
        agree(&occluders, &lamps(place), &starts, &format!("{place}"));
    }
}

#[test]
fn starts_anywhere_answer_alike_by_all_methods() {
    let random = &mut Random(13);
    for place in [DVec3::ZERO, DVec3::new(5e5, 5e6, 100.0)] {
        let occluders = curved_shapes(place);
        let mut starts = Vec::new();
        for number in 0..400 {
            let surface = SurfaceId(number % occluders.surface_count() as u32);
            let reach = [1e-9, 1e-3, 0.1, 1.0, 8.0, 1e3, 1e9, 1e30][number as usize % 8];
            let near = [occluders.surface_bounds(surface).center(), place][number as usize % 2];
            starts.push(ReceiverPoint {
                point: near + reach * random.in_cube(),
                surface: Some(surface),
            });
        }
        agree(&occluders, &lamps(place), &starts, &format!("{place}"));
    }
}

#[test]
fn a_start_inside_its_own_sphere_is_not_shadowed_by_what_covers_the_voxel() {
    let mut builder = Occluders::builder();
    let sphere = Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
    };
    builder
        .add_sphere(sphere, Opacity::Opaque)
        .expect("a sphere");
    let occluders = Arc::new(builder.build());
    let lights = [LightShape::Point(DVec3::X), LightShape::Direction(DVec3::X)];
    let start = ReceiverPoint {
        point: DVec3::new(0.125, 0.125, 0.625),
        surface: Some(SurfaceId(0)),
    };
    for method in METHODS {
        let index = index_of(&occluders, &lights, method);
        for light in 0..2 {
            let answer = index.shadow(&start, LightId::from_index(light), &mut Counters::default());
            assert_eq!(
                answer.map(|answer| answer.shadow),
                Ok(Shadow::Lit),
                "{method:?}"
            );
        }
    }
    agree(&occluders, &lights, &[start], "smallest");
}
