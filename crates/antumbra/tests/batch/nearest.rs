//! Surfaces that points are on, found by place and normal.

use std::sync::Arc;

use antumbra::{
    Batch, BatchKind, Coordinates, GridResolution, LightId, Method, Nearness, RayMethod, Shadow,
    ShadowIndex,
};
use antumbra_geometry::{DVec3, Occluders, Opacity, Precision, ReceiverPoint, SurfaceId};

use crate::common::{builder_of, is_shadowed, lamps};
use crate::{answers, decided, hall, index_of, narrow, on_surfaces, one_by_one};

fn surface_near(
    index: &ShadowIndex,
    point: DVec3,
    normal: Option<DVec3>,
    nearness: Nearness,
) -> Option<SurfaceId> {
    index.start_near(point, normal, nearness)?.surface
}

/// As far as `f32` rounds.
pub(crate) const SINGLE: Nearness = Nearness {
    precision: Precision::Single,
    tolerance: None,
};

/// As far as `f64` rounds.
const DOUBLE: Nearness = Nearness {
    precision: Precision::Double,
    tolerance: None,
};

pub(crate) fn within(tolerance: f64) -> Nearness {
    Nearness {
        precision: Precision::Single,
        tolerance: Some(tolerance),
    }
}

/// With tree and without, whatever the grid, for points in `f64` and in `f32`.
#[test]
fn surfaces_of_points_are_found() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2000);
    let with_tree = index_of(&occluders, Method::Bvh);
    let mut indices = vec![with_tree];
    for resolution in [1, 40] {
        let index = builder_of(&occluders, &lamps(), Method::Grid)
            .rays(RayMethod::Grid)
            .grid(GridResolution::Fixed([resolution; 3]))
            .build();
        indices.push(index.expect("an index"));
    }
    let mut rounded_count = 0;
    for (number, &point) in made.points.iter().enumerate() {
        let given = DVec3::from_array(point);
        let narrow = DVec3::from_array(point.map(|x| f64::from(x as f32)));
        let normal = Some(DVec3::from_array(made.normals[number]));
        for (point, nearness) in [(given, DOUBLE), (given, SINGLE), (narrow, SINGLE)] {
            // The definition, surface by surface.
            let expected = occluders
                .surfaces()
                .filter_map(|surface| Some((occluders.distance(surface, point)?, surface)))
                .filter(|&(_, surface)| occluders.is_on(surface, point, nearness.precision))
                .min_by(|a, b| a.partial_cmp(b).expect("numbers"))
                .map(|(_, surface)| surface);
            let own = SurfaceId(made.surfaces[number]);
            for index in &indices {
                assert_eq!(
                    surface_near(index, point, None, nearness),
                    expected,
                    "{point}"
                );
                assert!(
                    index
                        .start_near(point, None, within(f64::INFINITY))
                        .is_some()
                );
                if occluders.triangle_positions(own).is_some() {
                    // No other is as near, so that normals change nothing.
                    assert_eq!(expected, Some(own), "{point}");
                    assert_eq!(surface_near(index, point, normal, nearness), expected);
                    rounded_count += usize::from(point != given);
                }
                let lifted = point + DVec3::new(0.0, 0.0, 20.0);
                assert_eq!(surface_near(index, lifted, normal, nearness), None);
            }
        }
    }
    assert!(rounded_count > 1000);
    for nowhere in [DVec3::NAN, DVec3::INFINITY] {
        let found = indices[0].start_near(nowhere, None, within(f64::INFINITY));
        assert_eq!(found, None);
    }
}

#[test]
fn normals_choose_among_surfaces_that_tie() {
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let floor = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 8.0, 0.0)];
    let wall = [v(0.0, 0.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 0.0, 8.0)];
    let ceiling = [v(0.0, 8.0, 0.0), v(8.0, 0.0, 0.0), v(0.0, 0.0, 0.0)];
    for face in [floor, wall, ceiling] {
        builder.add_face(&face, Opacity::Opaque).expect("a face");
    }
    let occluders = Arc::new(builder.build());
    let [floor, wall, ceiling] = [0, 1, 2].map(SurfaceId);
    let (with_tree, without) = (
        index_of(&occluders, Method::Bvh),
        builder_of(&occluders, &lamps(), Method::Bvh).without_tree(),
    );
    for index in [with_tree, without.build().expect("an index")] {
        // The faces reach to 8.
        let rounding = 8.0 * Precision::Single.share();
        let near = 0.5 * rounding;
        let at = |point, normal| surface_near(&index, point, normal, SINGLE);
        let edge = v(3.0, 0.0, 0.0);
        // Exactly on the edge all three are as near.
        assert_eq!(at(edge, None), Some(floor));
        assert_eq!(at(edge, Some(v(0.0, 0.0, 1e-200))), Some(floor));
        assert_eq!(at(edge, Some(v(0.1, 0.2, -1.0))), Some(ceiling));
        assert_eq!(at(edge, Some(v(0.0, -1.0, 0.3))), Some(wall));
        assert_eq!(at(edge, Some(v(0.0, 1.0, 0.3))), Some(wall));
        assert_eq!(at(edge, Some(DVec3::ZERO)), Some(floor));
        // Nearer to the wall by rounding.
        assert_eq!(at(edge + v(0.0, 0.0, near), None), Some(wall));
        assert_eq!(
            at(edge + v(0.0, 0.0, near), Some(v(0.0, 0.0, 1.0))),
            Some(floor)
        );
        // Farther than rounding nothing ties, though both are within a larger tolerance.
        let off = edge + v(0.0, 0.0, 3.0 * rounding);
        let found = surface_near(&index, off, Some(v(0.0, 0.0, 1.0)), within(10.0 * rounding));
        assert_eq!(found, Some(wall));
    }
}

#[test]
fn points_find_their_surfaces_in_batches() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 3000);
    let points = narrow(&made.points);
    let normals = narrow(&made.normals);
    for method in [Method::Voxel, Method::Bvh] {
        let index = index_of(&occluders, method);
        let nearness = within(0.5);
        let starts: Vec<ReceiverPoint> = points
            .iter()
            .zip(&normals)
            .map(|(&point, &normal)| {
                let point = point.as_f64();
                let start = index.start_near(point, Some(normal.as_f64()), nearness);
                start.expect("a surface")
            })
            .collect();
        let batch = Batch {
            points: &points,
            kind: BatchKind::OnNearest {
                normals: Some(&normals),
                nearness,
            },
        };
        let expected = one_by_one(&index, &starts, &[2, 1], |_, _| true);
        assert_eq!(
            decided(answers(&index, &batch, &[2, 1])),
            expected,
            "{method:?}"
        );
        for (number, start) in starts.iter().enumerate().step_by(7) {
            let reference = index
                .shadow_by_reference(start, LightId(1))
                .expect("a fine query");
            assert_eq!(
                expected.0[2 * number + 1] == 1,
                reference == Shadow::Shadowed
            );
        }
    }
}

/// Rays know where the rule moves a start: only where they do not, every surface is tested.
#[test]
fn points_in_f32_walk_the_tree() {
    let occluders = hall();
    let made = on_surfaces(&occluders, 2000);
    let is_flat = |&(_, &surface): &(&[f64; 3], &u32)| surface < occluders.triangle_count() as u32;
    let flat = made.points.iter().zip(&made.surfaces).filter(is_flat);
    let (points, surfaces): (Vec<[f64; 3]>, Vec<u32>) = flat.unzip();
    let (narrow, index) = (narrow(&points), index_of(&occluders, Method::Bvh));
    let batch = Batch::on_surfaces(&narrow, &surfaces);
    let (_, counted) = answers(&index, &batch, &[0]);
    let tests = counted.counters.intersections as usize / points.len();
    assert!(tests < occluders.surface_count() / 4, "{tests} a query");
    for (point, &surface) in narrow.iter().zip(&surfaces) {
        let start = ReceiverPoint {
            point: point.as_f64(),
            surface: Some(SurfaceId(surface)),
        };
        let expected = index
            .shadow_by_reference(&start, LightId(0))
            .expect("a fine query");
        assert_eq!(is_shadowed(&index, &start, 0), expected == Shadow::Shadowed);
    }
}
