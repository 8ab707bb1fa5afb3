//! Suns with a size, glass, the light of the sky, and what blocks suns, where the answer is known.

use std::f64::consts::PI;
use std::sync::{Arc, Mutex};

use antumbra::{Counters, Method, ReceiverSide, ShadowIndex};
use antumbra_geometry::{
    AreaShape, DVec3, Occluders, Opacity, ReceiverPoint, Sphere, SunDisc, SurfaceId, Tint,
};
use antumbra_scene::gather::Gathered;
use antumbra_scene::generate;
use antumbra_sun::{
    Blockers, Diffuse, Dome, Facing, GridSettings, Groups, Light, Parts, Questions, Sensors,
    StudyError, Sun, SunKind, Suns, answer, answer_in_chunks, grid_sensors, reinhart, sums,
    sunlit_shares, write_blockers,
};
use antumbra_task::Task;

use crate::support::{COMPASS, day, index, index_of, study, study_of_light};

/// The real sun, in degrees.
const REAL: f64 = 0.533;

/// Far enough to the sides for a plate without end.
const FAR: f64 = 1e4;

/// A disc of that many degrees, without glass.
fn disc(degrees: f64) -> Light {
    Light {
        sun_diameter: Some(degrees),
        through_glass: false,
    }
}

const THROUGH_GLASS: Light = Light {
    sun_diameter: None,
    through_glass: true,
};

/// Suns of an hour each, by azimuth and elevation, each with 1000 W/m2.
fn suns(list: &[[f64; 2]]) -> Suns {
    let sun = |&[azimuth, elevation]: &[f64; 2]| Sun {
        azimuth,
        elevation,
        weight: 3600.0,
        time: None,
        direct_normal: Some(1000.0),
    };
    Suns {
        kind: SunKind::Suns,
        list: list.iter().map(sun).collect(),
        below_horizon: 0,
        has_weather: true,
        notes: Vec::new(),
    }
}

fn zenith() -> Suns {
    suns(&[[0.0, 90.0]])
}

/// A sensor at the origin.
fn one(normal: [f64; 3]) -> Sensors {
    Sensors::in_space(vec![[0.0; 3]], Some(vec![normal])).unwrap()
}

/// A plate one unit above the origin, without end but for its edge towards +x.
fn plate_up_to(x: f64) -> ShadowIndex {
    index(&[&[
        [-FAR, -FAR, 1.0],
        [x, -FAR, 1.0],
        [x, FAR, 1.0],
        [-FAR, FAR, 1.0],
    ]])
}

#[test]
fn an_edge_hides_a_segment_of_the_suns_disc() {
    let radius = (REAL / 2.0).to_radians().tan();
    // Half of a circle, and the segment beyond half of its radius; solid angle differs by the radius squared.
    let segment = (PI / 3.0 - 0.75_f64.sqrt() / 2.0) / PI;
    for (edge, expected) in [
        (-1.01, 1.0),
        (-0.5, 1.0 - segment),
        (0.0, 0.5),
        (0.5, segment),
        (1.01, 0.0),
    ] {
        let index = plate_up_to(edge * radius);
        let study = study_of_light(&index, one([0.0, 0.0, 1.0]), &zenith(), disc(REAL));
        let share = f64::from(study.shares.as_ref().unwrap()[0]);
        assert!((share - expected).abs() < 1e-5, "{edge}: {share}");
        if expected == 0.0 || expected == 1.0 {
            assert_eq!(share, expected, "wholly hidden or visible is exact");
        }
        let found = sums(&study);
        assert_eq!(found.hours.unwrap(), [share]);
    }
}

#[test]
fn sums_count_shares_with_the_cosine() {
    // The sun stands 30 degrees from the sensor's normal.
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    let sensors = || one([sine, 0.0, cosine]);
    let mut study = study_of_light(&plate_up_to(0.0), sensors(), &zenith(), disc(REAL));
    study.about.has_weather = true;
    let found = sums(&study).irradiation.unwrap()[0];
    assert!((found - 0.5 * cosine).abs() < 1e-5, "{found}");
    let groups = Groups {
        names: vec!["all".into()],
        of: vec![0],
    };
    let shares = sunlit_shares(&study, &groups, 0..1);
    assert!((shares[0] - 0.5).abs() < 1e-5, "{shares:?}");
}

#[test]
fn the_plane_of_a_sensor_hides_what_is_below_it() {
    // Nothing is in the way, but the sensor looks along the horizon: half of the disc is in front of it.
    let study = |light| study_of_light(&plate_up_to(-9.0), one([1.0, 0.0, 0.0]), &zenith(), light);
    let with_size = study(disc(REAL));
    let share = with_size.shares.as_ref().unwrap()[0];
    assert!((share - 0.5).abs() < 1e-6, "{share}");
    assert!(
        !with_size.bits.is_sunlit(0, 0),
        "its middle is in the plane"
    );
    // Clearly below, it is dark.
    let below = suns(&[[270.0, 80.0]]);
    let study = study_of_light(&plate_up_to(-9.0), one([1.0, 0.0, 0.0]), &below, disc(REAL));
    assert_eq!(study.shares.unwrap(), [0.0]);
}

#[test]
fn shares_are_those_of_single_queries() {
    let scene = generate::by_name("city", Some(2), None).unwrap();
    let gathered = Gathered::of(&scene).unwrap();
    let builder = ShadowIndex::builder(Arc::clone(gathered.occluders()), Vec::new());
    let index = builder.method(Method::Bvh).build().unwrap();
    let settings = GridSettings {
        spacing: index.occluders().bounds().size().max_element() / 6.0,
        up: DVec3::Z,
        both_sides: true,
        most: 100_000,
    };
    let sensors = grid_sensors(index.occluders(), &settings, |_| true).unwrap();
    let suns = day(48.0, "03-20");
    let directions: Vec<DVec3> = suns.list.iter().map(|sun| COMPASS.towards(sun)).collect();
    // Wide enough for many penumbrae.
    const WIDE: f64 = 8.0;
    let questions = Questions {
        light: disc(WIDE),
        ..Questions::bits(&directions)
    };
    let answered = answer(&index, &sensors, &questions, None).unwrap();
    let shares = answered.shares.unwrap();
    let Facing::Sides(sides) = &sensors.facing else {
        panic!("{:?}", sensors.facing)
    };
    let mut counts = [0; 3];
    for sensor in (0..sensors.count()).step_by(3) {
        let start = ReceiverPoint {
            point: DVec3::from_array(sensors.points[sensor]),
            surface: Some(SurfaceId(sensors.surfaces.as_ref().unwrap()[sensor])),
        };
        let side = match sides[sensor] {
            1 => ReceiverSide::Front,
            _ => ReceiverSide::Back,
        };
        for (sun, &to) in directions.iter().enumerate() {
            let shape = AreaShape::SunDisc(SunDisc::new(to, WIDE).unwrap());
            let found = index.exact_fraction(&start, side, &shape, &mut Counters::default());
            let share = shares[sensor * directions.len() + sun];
            let due = found.unwrap().unwrap().fraction;
            assert_eq!(share, due as f32, "{sensor} {sun}");
            let kind = [due == 0.0, due > 0.0 && due < 1.0, due == 1.0];
            counts[kind.iter().position(|&is| is).unwrap()] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}");
}

#[test]
fn samples_answer_where_a_ball_is_in_the_way() {
    let mut builder = Occluders::builder();
    // Half as wide as the sun: three quarters of it are visible.
    let center = DVec3::new(0.0, 0.0, 10.0);
    let radius = 10.0 * (REAL / 4.0).to_radians().sin();
    builder
        .add_sphere(Sphere { center, radius }, Opacity::Opaque)
        .unwrap();
    let index = index_of(builder.build());
    let directions = [DVec3::Z, DVec3::new(0.5, 0.0, 1.0)];
    let questions = Questions {
        light: disc(REAL),
        ..Questions::bits(&directions)
    };
    let answered = answer(&index, &one([0.0, 0.0, 1.0]), &questions, None).unwrap();
    assert_eq!(answered.sampled, 1);
    let shares = answered.shares.unwrap();
    assert!((shares[0] - 0.75).abs() < 0.06, "{shares:?}");
    assert_eq!(shares[1], 1.0);
}

#[test]
fn suns_without_a_disc_are_refused() {
    let index = plate_up_to(0.0);
    for degrees in [0.0, -1.0, 10.01, f64::NAN, f64::INFINITY] {
        let questions = Questions {
            light: disc(degrees),
            ..Questions::bits(&[DVec3::Z])
        };
        let error = answer(&index, &one([0.0, 0.0, 1.0]), &questions, None).unwrap_err();
        assert!(
            matches!(error, StudyError::Setting(_)),
            "{degrees}: {error}"
        );
        assert!(error.to_string().contains("expected above 0"), "{error}");
    }
}

/// Panes of glass, each a square of that half side at a height, over an opaque plate far to the left.
fn panes(list: &[(f64, f64, [f64; 3])]) -> ShadowIndex {
    let square = |half: f64, z: f64| {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| DVec3::new(x, y, z))
    };
    let mut builder = Occluders::builder();
    for &(half, z, shares) in list {
        let filter = builder.add_filter(Arc::new(Tint(shares)));
        builder
            .add_face(&square(half, z), Opacity::Filtering(filter))
            .unwrap();
    }
    let plate = square(1.0, 5.0).map(|corner| corner - DVec3::X * 9.0);
    builder.add_face(&plate, Opacity::Opaque).unwrap();
    index_of(builder.build())
}

#[test]
fn glass_lets_a_share_through_and_shares_multiply() {
    let grey = panes(&[(1.0, 1.0, [0.5; 3]), (0.5, 2.0, [0.25; 3])]);
    let points = vec![
        [0.0; 3],
        [0.75, 0.0, 0.0],
        [3.0, 0.0, 0.0],
        // Below the plate, and above it.
        [-9.0, 0.0, 0.0],
        [-9.0, 0.0, 6.0],
    ];
    let normals = vec![[0.0, 0.0, 1.0]; 5];
    let sensors = Sensors::in_space(points, Some(normals)).unwrap();
    let study = study_of_light(&grey, sensors.clone(), &zenith(), THROUGH_GLASS);
    assert_eq!(
        study.shares.as_ref().unwrap()[..],
        [0.125, 0.5, 1.0, 0.0, 1.0]
    );
    assert_eq!(sums(&study).hours.unwrap(), [0.125, 0.5, 1.0, 0.0, 1.0]);
    // Bits are of opaque surfaces alone.
    let lit: Vec<bool> = (0..5)
        .map(|sensor| study.bits.is_sunlit(sensor, 0))
        .collect();
    assert_eq!(lit, [true, true, true, false, true]);
    let without = study_of_light(&grey, sensors, &zenith(), Light::default());
    assert_eq!(without.shares, None);
    assert_eq!(sums(&without).hours.unwrap(), [1.0, 1.0, 1.0, 0.0, 1.0]);
    // Of colors luminance counts.
    let green = panes(&[(1.0, 1.0, [0.0, 1.0, 0.0])]);
    let study = study_of_light(&green, one([0.0, 0.0, 1.0]), &zenith(), THROUGH_GLASS);
    let share = study.shares.unwrap()[0];
    assert!((share - 0.7152).abs() < 1e-6, "{share}");
}

#[test]
fn glass_and_disc_multiply() {
    let mut builder = Occluders::builder();
    let filter = builder.add_filter(Arc::new(Tint([0.5; 3])));
    let half = |low: f64, high: f64, z: f64| {
        [(low, -FAR), (high, -FAR), (high, FAR), (low, FAR)].map(|(x, y)| DVec3::new(x, y, z))
    };
    builder
        .add_face(&half(-FAR, 0.0, 2.0), Opacity::Opaque)
        .unwrap();
    builder
        .add_face(&half(-1.0, 1.0, 1.0), Opacity::Filtering(filter))
        .unwrap();
    let light = Light {
        sun_diameter: Some(REAL),
        through_glass: true,
    };
    let study = study_of_light(
        &index_of(builder.build()),
        one([0.0, 0.0, 1.0]),
        &zenith(),
        light,
    );
    let share = study.shares.unwrap()[0];
    assert!((share - 0.25).abs() < 1e-6, "{share}");
}

/// Sky view factors of sensors, by 2305 patches.
fn factors(index: &ShadowIndex, sensors: &Sensors, light: Light) -> Vec<f64> {
    let dome = Dome::new(&reinhart(4).list, DVec3::Z, |patch| COMPASS.towards(patch));
    let questions = Questions {
        light,
        dome: Some(&dome),
        ..Questions::bits(&[DVec3::Z])
    };
    let answered = answer(index, sensors, &questions, None).unwrap();
    answered.sky_view_factor.unwrap()
}

#[test]
fn open_level_ground_gets_all_light_of_the_sky_and_a_wall_half_of_it() {
    let index = index(&[&[[9.0, 0.0, -9.0], [9.0, 1.0, -9.0], [9.0, 0.0, -8.0]]]);
    let tilted = 30.0_f64.to_radians();
    let normals = vec![
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, tilted.sin(), tilted.cos()],
        [0.0, 0.0, -1.0],
    ];
    let sensors = Sensors::in_space(vec![[0.0; 3]; 4], Some(normals)).unwrap();
    let found = factors(&index, &sensors, Light::default());
    assert_eq!(found[0], 1.0, "exactly");
    // Liu and Jordan: (1 + cos of the tilt) / 2.
    assert!((found[1] - 0.5).abs() < 2e-3, "{found:?}");
    assert!(
        (found[2] - (1.0 + tilted.cos()) / 2.0).abs() < 2e-3,
        "{found:?}"
    );
    assert_eq!(found[3], 0.0);
    // Sums are the factor times what open ground gets.
    let mut study = study(&index, sensors, &zenith());
    study.about.has_weather = true;
    study.about.diffuse = Some(Diffuse {
        sky: "reinhart:4".into(),
        horizontal: 600.0,
        dates: None,
    });
    study.sky_view_factor = Some(found.clone());
    let sums = sums(&study);
    let (diffuse, total) = (sums.diffuse.unwrap(), sums.total.unwrap());
    assert_eq!(diffuse[0], 600.0);
    assert_eq!(diffuse[1], 600.0 * found[1]);
    assert_eq!([total[0], total[3]], [601.0, 0.0]);
}

#[test]
fn a_long_wall_hides_the_sky_below_its_top() {
    // Of level ground beside a wall whose top stands b degrees high, (1 + cos b) / 2 of the light is left. The wall runs a
    // little off north, where the middles of patches lie.
    let (sine, cosine) = 0.5_f64.to_radians().sin_cos();
    let foot = |along: f64| [-cosine - along * sine, -sine + along * cosine];
    for (height, expected) in [(1.0, (1.0 + 0.5_f64.sqrt()) / 2.0), (FAR, 0.5)] {
        let corner = |along: f64, z: f64| {
            let [x, y] = foot(along);
            [x, y, z]
        };
        let ends = [-FAR * FAR, FAR * FAR];
        let wall = index(&[&[
            corner(ends[0], -1.0),
            corner(ends[1], -1.0),
            corner(ends[1], height),
            corner(ends[0], height),
        ]]);
        let found = factors(&wall, &one([0.0, 0.0, 1.0]), Light::default())[0];
        assert!((found - expected).abs() < 2e-3, "{height}: {found}");
    }
}

#[test]
fn glass_filters_the_light_of_the_sky() {
    let pane = panes(&[(FAR, 1.0, [0.5; 3])]);
    let ground = one([0.0, 0.0, 1.0]);
    let [clear, filtered] =
        [Light::default(), THROUGH_GLASS].map(|light| factors(&pane, &ground, light)[0]);
    assert!(clear > 0.9, "the plate hides little: {clear}");
    assert!(
        (filtered - clear / 2.0).abs() < 1e-3,
        "{filtered} of {clear}"
    );
}

#[test]
fn the_nearest_opaque_object_takes_the_sun() {
    let square = |half: f64, z: f64| {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| DVec3::new(x, y, z))
    };
    let mut builder = Occluders::builder();
    let filter = builder.add_filter(Arc::new(Tint([0.5; 3])));
    // From the top: high, low, glass.
    builder
        .add_face(&square(2.0, 3.0), Opacity::Opaque)
        .unwrap();
    builder
        .add_face(&square(1.0, 2.0), Opacity::Opaque)
        .unwrap();
    builder
        .add_face(&square(1.0, 1.0), Opacity::Filtering(filter))
        .unwrap();
    let index = index_of(builder.build());
    let high = [[0.0, 90.0], [90.0, 60.0], [270.0, 30.0]];
    let suns = suns(&high);
    let directions: Vec<DVec3> = suns.list.iter().map(|sun| COMPASS.towards(sun)).collect();
    let points = vec![[0.0; 3], [1.5, 0.0, 0.0], [0.0, 0.0, 2.5]];
    let sensors = Sensors::in_space(points, Some(vec![[0.0, 0.0, 1.0]; 3])).unwrap();
    let bits = answer(&index, &sensors, &Questions::bits(&directions), None)
        .unwrap()
        .bits;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blockers.csv");
    let of = Blockers {
        index: &index,
        sensors: &sensors,
        suns: &suns.list,
        directions: &directions,
        bits: &bits,
        has_weather: true,
    };
    let names = ["high", "low, \"flat\"", "glass"].map(str::to_owned);
    let object = |surface: SurfaceId| (index.occluders().element_of(surface).0) as usize;
    write_blockers(&path, &of, &names, object).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("sensor,blocker,hours,irradiation_kwh_m2")
    );
    let rows: Vec<(&str, f64)> = lines
        .map(|line| line.rsplit_once(',').unwrap())
        .map(|(row, energy)| (row, energy.parse().unwrap()))
        .collect();
    // At 60 degrees a ray is 1.15 units east at the low plate, which ends at 1, and 1.73 at the high one. At 30 degrees
    // it passes below both, but for the sensor between them: that is 0.87 units west at the high one.
    let expected = [
        ("0,high,1", 60.0_f64.to_radians().sin()),
        ("0,\"low, \"\"flat\"\"\",1", 1.0),
        ("1,high,1", 1.0),
        ("2,high,3", 1.0 + 60.0_f64.to_radians().sin() + 0.5),
    ];
    assert_eq!(rows.len(), expected.len(), "{text}");
    for ((row, energy), (due, energy_due)) in rows.iter().zip(expected) {
        assert_eq!(*row, due);
        assert!((energy - energy_due).abs() < 1e-12, "{text}");
    }
    // What is blocked and what is not are all suns that a sensor faces.
    let lit: u32 = (0..3).map(|sensor| bits.of(sensor)[0].count_ones()).sum();
    assert_eq!(lit + 6, 9);
}

#[test]
fn a_stopped_study_of_discs_goes_on_and_other_options_begin_again() {
    const CHUNK: usize = 64 * 64;
    let index = plate_up_to(0.0);
    // Penumbrae of different depths, and the open.
    let points = (0..300).map(|x| [f64::from(x) * 4e-5 - 4e-3, 0.0, 0.0]);
    let sensors = Sensors::in_space(points.collect(), Some(vec![[0.0, 0.0, 1.0]; 300])).unwrap();
    let directions = [DVec3::Z, DVec3::new(-0.1, 0.0, 1.0), DVec3::Y];
    let dome = Dome::new(&reinhart(1).list, DVec3::Z, |patch| COMPASS.towards(patch));
    let questions = Questions {
        directions: &directions,
        light: disc(REAL),
        dome: Some(&dome),
    };
    let whole = answer(&index, &sensors, &questions, None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let parts = Parts {
        folder: folder.path().join("out.npz.parts"),
    };
    let run = |task: &Task, questions: &Questions<'_>| {
        task.run(|| answer_in_chunks(&index, &sensors, questions, Some(&parts), CHUNK))
    };
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
    assert!(run(&task, &questions).is_err());
    let again = run(&Task::default(), &questions).unwrap().unwrap();
    assert_eq!(again.resumed, [128, 300]);
    assert_eq!(again.bits, whole.bits);
    assert_eq!(again.shares, whole.shares);
    assert_eq!(again.sky_view_factor, whole.sky_view_factor);
    let shares = again.shares.unwrap();
    assert!(shares.iter().any(|&share| share > 0.1 && share < 0.9));
    // All chunks are kept now; none of them is of another question.
    let with = |light, dome| Questions {
        light,
        dome,
        ..questions
    };
    let other_dome = Dome::new(&reinhart(2).list, DVec3::Z, |patch| COMPASS.towards(patch));
    for other in [
        with(disc(0.6), Some(&dome)),
        with(disc(REAL), None),
        with(disc(REAL), Some(&other_dome)),
        with(Light::default(), Some(&dome)),
        with(Light::default(), None),
    ] {
        let found = run(&Task::default(), &other).unwrap().unwrap();
        assert_eq!(found.resumed[0], 0, "{:?}", other.light);
        let expected = answer(&index, &sensors, &other, None).unwrap();
        assert_eq!(found.shares, expected.shares);
        assert_eq!(found.sky_view_factor, expected.sky_view_factor);
        // That this one replaces them does not matter to the next.
        parts.remove();
        run(&Task::default(), &questions).unwrap().unwrap();
    }
}

#[test]
fn glass_is_asked_again_where_a_study_goes_on() {
    const CHUNK: usize = 64 * 64;
    let points: Vec<[f64; 3]> = (0..200)
        .map(|x| [f64::from(x) * 0.02 - 2.0, 0.0, 0.0])
        .collect();
    let sensors = Sensors::in_space(points, Some(vec![[0.0, 0.0, 1.0]; 200])).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let parts = Parts {
        folder: folder.path().join("out.npz.parts"),
    };
    let questions = Questions {
        light: THROUGH_GLASS,
        ..Questions::bits(&[DVec3::Z])
    };
    let of = |share: f64| {
        let index = panes(&[(1.0, 1.0, [share; 3])]);
        answer_in_chunks(&index, &sensors, &questions, Some(&parts), CHUNK).unwrap()
    };
    let (dark, clear) = (of(0.25), of(0.75));
    assert_eq!(clear.resumed, [200, 200], "surfaces are the same");
    assert_eq!(dark.shares.unwrap()[100], 0.25);
    assert_eq!(clear.shares.unwrap()[100], 0.75);
}
