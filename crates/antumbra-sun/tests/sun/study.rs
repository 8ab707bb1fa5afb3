//! Bits of a study: those of single queries, however they came about.

use std::sync::{Arc, Mutex};

use antumbra::{Counters, Method, Shadow, ShadowIndex};
use antumbra_geometry::{DVec3, LightShape, ReceiverPoint, SurfaceId};
use antumbra_scene::gather::Gathered;
use antumbra_scene::generate;
use antumbra_sun::{
    Facing, GridSettings, Parts, Questions, Sensors, answer, answer_in_chunks, grid_sensors,
    reinhart, tregenza,
};
use antumbra_task::Task;

use crate::support::{COMPASS, day, index};

/// A small city, its sensors on both sides of faces, and a sky.
fn city() -> (ShadowIndex, Sensors, Vec<DVec3>) {
    let scene = generate::by_name("city", Some(2), None).unwrap();
    let gathered = Gathered::of(&scene).unwrap();
    let builder = ShadowIndex::builder(Arc::clone(gathered.occluders()), Vec::new());
    let index = builder.method(Method::Bvh).build().unwrap();
    let size = index.occluders().bounds().size().max_element();
    let settings = GridSettings {
        spacing: size / 12.0,
        up: DVec3::Z,
        both_sides: true,
        most: 100_000,
    };
    let sensors = grid_sensors(index.occluders(), &settings, |_| true).unwrap();
    let directions = tregenza()
        .list
        .iter()
        .map(|sun| COMPASS.towards(sun))
        .collect();
    (index, sensors, directions)
}

#[test]
fn every_bit_is_that_of_a_single_query() {
    let (index, sensors, directions) = city();
    let bits = answer(&index, &sensors, &Questions::bits(&directions), None)
        .unwrap()
        .bits;
    let lights: Vec<LightShape> = directions
        .iter()
        .map(|&to| LightShape::Direction(to))
        .collect();
    let scene = generate::by_name("city", Some(2), None).unwrap();
    let gathered = Gathered::of(&scene).unwrap();
    let naive = ShadowIndex::builder(Arc::clone(gathered.occluders()), lights)
        .method(Method::Naive)
        .build()
        .unwrap();
    let Facing::Sides(sides) = &sensors.facing else {
        panic!("{:?}", sensors.facing)
    };
    let (mut sunlit, mut compared) = (0, 0);
    for sensor in (0..sensors.count()).step_by(7) {
        let start = ReceiverPoint {
            point: DVec3::from_array(sensors.points[sensor]),
            surface: Some(SurfaceId(sensors.surfaces.as_ref().unwrap()[sensor])),
        };
        for (direction, light) in naive.light_ids().enumerate() {
            let answer = naive
                .shadow(&start, light, &mut Counters::default())
                .unwrap();
            let is_faced = naive.light_side(&start, light).unwrap() == sides[sensor];
            let expected = is_faced && answer.shadow == Shadow::Lit;
            assert_eq!(
                bits.is_sunlit(sensor, direction),
                expected,
                "{sensor} {direction}"
            );
            sunlit += usize::from(expected);
            compared += 1;
        }
    }
    assert!(
        sunlit > compared / 20 && sunlit < compared / 2,
        "{sunlit} of {compared}"
    );
}

#[test]
fn points_of_space_with_normals_and_without_see_what_they_face() {
    let index = index(&[&[
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ]]);
    let points = vec![[0.0; 3]; 4];
    let normals = vec![
        [0.0, 0.0, 1e-300],
        [0.0, 0.0, -1.0],
        [1e30, 0.0, 0.0],
        [0.0; 3],
    ];
    let directions = [
        DVec3::X,
        DVec3::NEG_Z,
        DVec3::Z,
        DVec3::new(-1.0, 0.0, 1e-9),
    ];
    let bits = |sensors: &Sensors| {
        let bits = answer(&index, sensors, &Questions::bits(&directions), None)
            .unwrap()
            .bits;
        (0..4).map(|sensor| bits.of(sensor)[0]).collect::<Vec<_>>()
    };
    // A plate above hides the zenith, but no level direction.
    let all = Sensors::in_space(points.clone(), None).unwrap();
    assert_eq!(bits(&all), [0b1011; 4]);
    let facing = Sensors::in_space(points, Some(normals)).unwrap();
    // A direction in the plane of a sensor is not on its side.
    assert_eq!(bits(&facing), [0b1000, 0b0010, 0b0001, 0]);
}

#[test]
fn sensors_inside_solids_and_on_edges_have_answers() {
    let low = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
    ];
    let mut faces = vec![low.to_vec()];
    faces.push(low.iter().rev().map(|&[x, y, _]| [x, y, 1.0]).collect());
    for side in 0..4 {
        let ([ax, ay, _], [bx, by, _]) = (low[side], low[(side + 1) % 4]);
        faces.push(vec![
            [bx, by, 0.0],
            [ax, ay, 0.0],
            [ax, ay, 1.0],
            [bx, by, 1.0],
        ]);
    }
    let faces: Vec<&[[f64; 3]]> = faces.iter().map(|face| &face[..]).collect();
    let index = index(&faces);
    let directions: Vec<DVec3> = tregenza()
        .list
        .iter()
        .map(|sun| COMPASS.towards(sun))
        .collect();
    let sensors = Sensors::in_space(vec![[0.5; 3], [0.5, 0.5, 2.0]], None).unwrap();
    let bits = answer(&index, &sensors, &Questions::bits(&directions), None)
        .unwrap()
        .bits;
    // Inside all is dark, above all is sunlit.
    assert_eq!(bits.of(0), [0; 3]);
    assert_eq!(
        bits.of(1).iter().map(|word| word.count_ones()).sum::<u32>(),
        145
    );
    // On the upper edge, as a point of the upper face: the box itself hides nothing of the sky.
    let edge = Sensors {
        points: vec![[1.0, 0.5, 1.0]],
        surfaces: Some(vec![2]),
        facing: Facing::Sides(vec![1]),
        areas: None,
        notes: Vec::new(),
    };
    let bits = answer(&index, &edge, &Questions::bits(&directions), None)
        .unwrap()
        .bits;
    assert_eq!(
        bits.of(0).iter().map(|word| word.count_ones()).sum::<u32>(),
        145
    );
}

#[test]
fn a_study_that_is_stopped_goes_on_where_it_was_and_gives_the_same_bits() {
    const CHUNK: usize = 145 * 200;
    let (index, sensors, directions) = city();
    let whole = answer(&index, &sensors, &Questions::bits(&directions), None)
        .unwrap()
        .bits;
    let folder = tempfile::tempdir().unwrap();
    let parts = Parts {
        folder: folder.path().join("out.npz.parts"),
    };
    let run = |task: &Task| {
        task.run(|| {
            answer_in_chunks(
                &index,
                &sensors,
                &Questions::bits(&directions),
                Some(&parts),
                CHUNK,
            )
        })
    };
    // Stopped as soon as two chunks are done.
    let stopped = Arc::new(Mutex::new(None::<Task>));
    let task = Task::with_progress({
        let stopped = Arc::clone(&stopped);
        move |stage, done, count| {
            if stage == "sun" && done == 2 && done < count {
                stopped.lock().unwrap().as_ref().unwrap().stop();
            }
        }
    });
    *stopped.lock().unwrap() = Some(task.clone());
    assert!(run(&task).is_err());
    let left = std::fs::read_dir(&parts.folder).unwrap().count();
    assert_eq!(left, 2);
    // A part that is damaged is answered again.
    let damaged = parts.folder.join("000001.bits");
    let mut bytes = std::fs::read(&damaged).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&damaged, bytes).unwrap();
    let answered = run(&Task::default()).unwrap().unwrap();
    assert_eq!(answered.bits, whole);
    let [resumed, count] = answered.resumed;
    assert!(0 < resumed && resumed < count / 2, "{resumed} of {count}");
    // All parts are there now.
    let answered = run(&Task::default()).unwrap().unwrap();
    assert_eq!(
        (answered.bits, answered.resumed),
        (whole.clone(), [count, count])
    );
    // Parts of another study are not taken.
    let mut others = directions.clone();
    others[0] = DVec3::new(0.5, 0.5, 0.1);
    let other = answer_in_chunks(
        &index,
        &sensors,
        &Questions::bits(&others),
        Some(&parts),
        CHUNK,
    )
    .unwrap();
    assert_eq!(other.resumed[0], 0);
    assert_eq!(
        other.bits,
        answer(&index, &sensors, &Questions::bits(&others), None)
            .unwrap()
            .bits
    );
    // A file that is no part is not touched, and stays.
    std::fs::write(parts.folder.join("mine"), "mine").unwrap();
    std::fs::write(parts.folder.join("000000.bits"), "mine, too").unwrap();
    let refused = answer_in_chunks(
        &index,
        &sensors,
        &Questions::bits(&directions),
        Some(&parts),
        CHUNK,
    );
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("no part of a study")
    );
    parts.remove();
    let names = std::fs::read_dir(&parts.folder).unwrap();
    let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["000000.bits", "mine"]);
}

#[test]
fn a_study_of_one_chunk_keeps_nothing_and_none_of_no_sun_asks_nothing() {
    let index = index(&[&[[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]]);
    let folder = tempfile::tempdir().unwrap();
    let parts = Parts {
        folder: folder.path().join("parts"),
    };
    let sensors = Sensors::in_space(vec![[0.0; 3]; 3], None).unwrap();
    let suns = day(45.0, "06-21");
    let directions: Vec<DVec3> = suns.list.iter().map(|sun| COMPASS.towards(sun)).collect();
    answer(
        &index,
        &sensors,
        &Questions::bits(&directions),
        Some(&parts),
    )
    .unwrap();
    assert!(!parts.folder.exists());
    let none = answer(&index, &sensors, &Questions::bits(&[]), Some(&parts))
        .unwrap()
        .bits;
    assert_eq!((none.stride, none.words.len()), (0, 0));
}

#[test]
fn sky_view_factors_of_the_open_ground_and_a_wall() {
    let index = index(&[&[[9.0, 0.0, -9.0], [9.0, 1.0, -9.0], [9.0, 0.0, -8.0]]]);
    let normals = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    let sensors = Sensors::in_space(vec![[0.0; 3]; 3], Some(normals)).unwrap();
    let study = crate::support::study(&index, sensors, &reinhart(4));
    let sums = antumbra_sun::sums(&study);
    assert_eq!((sums.hours, sums.irradiation), (None, None));
    let [ground, wall, below] = sums.sky_view_factor.unwrap()[..] else {
        panic!("three sensors")
    };
    assert!((ground - 1.0).abs() < 1e-12, "{ground}");
    assert!((wall - 0.5).abs() < 2e-3, "{wall}");
    assert_eq!(below, 0.0);
    let [all, half, none] = sums.sky_visible.unwrap()[..] else {
        panic!("three sensors")
    };
    assert!(
        (all - 1.0).abs() < 1e-12 && (half - 0.5).abs() < 0.02,
        "{all} {half}"
    );
    assert_eq!(none, 0.0);
}
