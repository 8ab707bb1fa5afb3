//! Where sensors of a grid lie.

use std::collections::HashSet;

use antumbra_geometry::{DVec3, Disk, Occluders, Opacity, Precision, Sphere, SurfaceId};
use antumbra_sun::{Facing, GridSettings, Sensors, grid_sensors};

fn settings(spacing: f64) -> GridSettings {
    GridSettings {
        spacing,
        up: DVec3::Z,
        both_sides: false,
        most: 1_000_000,
    }
}

fn faces(faces: &[&[[f64; 3]]]) -> Occluders {
    let mut builder = Occluders::builder();
    for face in faces {
        let corners: Vec<DVec3> = face
            .iter()
            .map(|&corner| DVec3::from_array(corner))
            .collect();
        builder.add_face(&corners, Opacity::Opaque).unwrap();
    }
    builder.build()
}

fn grid(occluders: &Occluders, spacing: f64) -> Sensors {
    grid_sensors(occluders, &settings(spacing), |_| true).unwrap()
}

/// Checks that sensors lie on their surfaces, no two in one place, and returns the sum of areas.
fn checked_area(occluders: &Occluders, sensors: &Sensors) -> f64 {
    let surfaces = sensors.surfaces.as_ref().unwrap();
    let mut places = HashSet::new();
    for (&point, &surface) in sensors.points.iter().zip(surfaces) {
        let at = DVec3::from_array(point);
        assert!(
            occluders.is_on(SurfaceId(surface), at, Precision::Double),
            "{at}"
        );
        assert!(
            places.insert(point.map(f64::to_bits)),
            "{at} is there twice"
        );
    }
    sensors.areas.as_ref().unwrap().iter().sum()
}

#[test]
fn a_square_of_two_triangles_has_each_cell_once() {
    let square = [
        [0.0, 0.0, 2.0],
        [1.0, 0.0, 2.0],
        [1.0, 1.0, 2.0],
        [0.0, 1.0, 2.0],
    ];
    let occluders = faces(&[&square]);
    for (spacing, expected) in [(0.25, 16), (0.5, 4), (0.125, 64)] {
        let sensors = grid(&occluders, spacing);
        assert_eq!(sensors.count(), expected, "{spacing}");
        assert!((checked_area(&occluders, &sensors) - 1.0).abs() < 1e-12);
    }
    let sensors = grid(&occluders, 0.5);
    assert_eq!(sensors.areas, Some(vec![0.25; 4]));
    for point in [
        [0.25, 0.25, 2.0],
        [0.75, 0.25, 2.0],
        [0.25, 0.75, 2.0],
        [0.75, 0.75, 2.0],
    ] {
        assert!(sensors.points.contains(&point), "{:?}", sensors.points);
    }
}

#[test]
fn a_slope_far_from_the_origin_has_as_many_cells_as_area() {
    let far = [85_000.0, 447_500.0, 10.0];
    let at = |x: f64, y: f64, z: f64| [far[0] + x, far[1] + y, far[2] + z];
    let roof = [
        at(0.0, 0.0, 0.0),
        at(10.0, 0.0, 0.0),
        at(10.0, 6.0, 4.5),
        at(0.0, 6.0, 4.5),
    ];
    let wall = [
        at(0.0, 0.0, -5.0),
        at(10.0, 0.0, -5.0),
        at(10.0, 0.0, 0.0),
        at(0.0, 0.0, 0.0),
    ];
    let occluders = faces(&[&roof, &wall]);
    let sensors = grid(&occluders, 0.1);
    let area = 10.0 * 7.5 + 50.0;
    assert!((checked_area(&occluders, &sensors) - area).abs() < 1e-6);
    let cells = area / 0.01;
    assert!(
        (sensors.count() as f64 / cells - 1.0).abs() < 0.02,
        "{}",
        sensors.count()
    );
    assert_eq!(sensors, grid(&occluders, 0.1));
}

#[test]
fn a_face_smaller_than_a_cell_has_a_sensor_in_its_middle() {
    let small = [[0.6, 0.6, 0.0], [0.9, 0.6, 0.0], [0.6, 0.9, 0.0]];
    let sensors = grid(&faces(&[&small]), 10.0);
    assert_eq!(sensors.count(), 1);
    let middle = DVec3::new(0.7, 0.7, 0.0);
    assert!((DVec3::from_array(sensors.points[0]) - middle).length() < 1e-15);
    assert!((sensors.areas.unwrap()[0] - 0.045).abs() < 1e-15);
}

#[test]
fn needles_take_no_more_time_than_their_length() {
    let needle = [
        [0.0, 0.0, 0.0],
        [1000.0, 1000.0, 1e-6],
        [1000.0, 1000.0, 0.0],
    ];
    let occluders = faces(&[&needle]);
    let sensors = grid(&occluders, 0.01);
    assert!(
        (1..200_000).contains(&sensors.count()),
        "{}",
        sensors.count()
    );
    let area = sensors.areas.unwrap().iter().sum::<f64>();
    assert!((area - 0.5e-6 * 2e6_f64.sqrt()).abs() < 1e-12, "{area}");
}

#[test]
fn both_sides_of_a_face_have_sensors_that_face_apart() {
    let square = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let occluders = faces(&[&square]);
    let both = GridSettings {
        both_sides: true,
        ..settings(0.5)
    };
    let sensors = grid_sensors(&occluders, &both, |_| true).unwrap();
    assert_eq!(sensors.facing, Facing::Sides([1, -1].repeat(4)));
    let normals = sensors.normals(&occluders).unwrap();
    assert_eq!(
        (normals[0], normals[1]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])
    );
}

#[test]
fn surfaces_without_sensors_are_counted() {
    let mut builder = Occluders::builder();
    let center = DVec3::new(0.0, 0.0, 5.0);
    let (radius, normal) = (1.0, DVec3::Z);
    builder
        .add_sphere(Sphere { center, radius }, Opacity::Opaque)
        .unwrap();
    builder
        .add_disk(
            Disk {
                center,
                normal,
                radius,
            },
            Opacity::Opaque,
        )
        .unwrap();
    let alone = builder.build();
    let error = grid_sensors(&alone, &settings(1.0), |_| true)
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "no face has sensors: expected triangles with an area"
    );
    let mut builder = Occluders::builder();
    builder
        .add_sphere(Sphere { center, radius }, Opacity::Opaque)
        .unwrap();
    let line = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
    builder.add_face(&line, Opacity::Opaque).unwrap();
    builder
        .add_face(&[DVec3::ZERO, DVec3::X, DVec3::Y], Opacity::Opaque)
        .unwrap();
    let sensors = grid(&builder.build(), 1.0);
    assert_eq!(
        sensors.notes,
        [
            "1 curved surfaces have no sensors: grids lie on triangles alone",
            "1 triangles have no area, and no sensors"
        ]
    );
}

#[test]
fn spacings_that_make_too_many_sensors_or_none_are_refused() {
    let square = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let occluders = faces(&[&square]);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = grid_sensors(&occluders, &settings(bad), |_| true).unwrap_err();
        assert!(
            error.to_string().starts_with("the spacing of the grid is"),
            "{error}"
        );
    }
    for fine in [1e-4, 1e-9, 1e-300] {
        let error = grid_sensors(&occluders, &settings(fine), |_| true).unwrap_err();
        assert!(
            error.to_string().contains("sensors, more than 1000000"),
            "{error}"
        );
    }
    assert!(grid_sensors(&occluders, &settings(1.0), |_| false).is_err());
}

#[test]
fn rows_that_are_not_finite_are_named() {
    let nan = vec![[0.0; 3], [0.0, f64::NAN, 0.0]];
    let error = Sensors::in_space(nan.clone(), None)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("point 1 (rows are counted from 0) is (0, NaN, 0)"),
        "{error}"
    );
    let error = Sensors::in_space(vec![[0.0; 3]; 2], Some(nan))
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("normal 1 "), "{error}");
    let error = Sensors::in_space(vec![[0.0; 3]; 2], Some(vec![[1.0; 3]])).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("there are 1 normals: expected one for each of 2")
    );
}
