//! Hours of sun where the answer is known: a wall, an overhang, the shadow of a pyramid.

use antumbra_geometry::DVec3;
use antumbra_sun::{Sensors, Sums, Suns, sums};

use crate::support::{COMPASS, day, index, study};

const EQUINOX: &str = "03-20";
const SUMMER: &str = "06-21";
const WINTER: &str = "12-21";

/// Hours that a day may differ from the rule for whole days: the equinox is at one moment of its day, and before it the sun
/// rises and sets a little south of east and west.
fn slack(date: &str) -> f64 {
    if date == EQUINOX { 0.5 } else { 0.0 }
}

/// Far enough to the sides for a wall without end.
const FAR: f64 = 1e4;

fn one(point: [f64; 3], normal: [f64; 3]) -> Sensors {
    Sensors::in_space(vec![point], Some(vec![normal])).unwrap()
}

/// Returns what a sensor gets, and the hours that a rule by hand gives.
fn hours(
    faces: &[&[[f64; 3]]],
    sensor: Sensors,
    suns: &Suns,
    is_sunlit: impl Fn(DVec3) -> bool,
) -> (Sums, f64) {
    let study = study(&index(faces), sensor, suns);
    let by_hand = suns
        .list
        .iter()
        .filter(|sun| is_sunlit(COMPASS.towards(sun)));
    let steps = by_hand.count();
    // Whole steps of ten minutes: no rounding but that of the quotient.
    (sums(&study), steps as f64 * 600.0 / 3600.0)
}

#[test]
fn a_wall_in_the_south_hides_all_suns_lower_than_its_top() {
    // As high as it is far: suns below 45 degrees of profile are hidden.
    let wall = [
        [-FAR, -1.0, 0.0],
        [FAR, -1.0, 0.0],
        [FAR, -1.0, 1.0],
        [-FAR, -1.0, 1.0],
    ];
    let is_sunlit = |to: DVec3| to.z > 0.0 && to.z > -to.y;
    for (latitude, date, all_or_none) in [
        // On the equinox the profile is 90 degrees less the latitude all day.
        (40.0, EQUINOX, Some(true)),
        (50.0, EQUINOX, Some(false)),
        (40.0, WINTER, Some(false)),
        (40.0, SUMMER, Some(true)),
        // At noon the sun stands 43 degrees high; in the morning and the evening it is north of the wall.
        (70.0, SUMMER, None),
        (66.0, SUMMER, Some(true)),
    ] {
        let suns = day(latitude, date);
        let ground = one([0.0; 3], [0.0, 0.0, 1.0]);
        let (sums, expected) = hours(&[&wall], ground, &suns, is_sunlit);
        let found = sums.hours.unwrap()[0];
        assert_eq!(found, expected, "{latitude} {date}");
        let up = suns.list.len() as f64 * 600.0 / 3600.0;
        match all_or_none {
            Some(true) => assert!(found >= up - slack(date), "{found} of {up}"),
            Some(false) => assert!(found <= slack(date), "{found} of {up}"),
            None => assert!(0.0 < found && found < up, "{latitude}: {found} of {up}"),
        }
    }
    // The day lasts twelve hours, up to a step.
    let length = day(40.0, EQUINOX).list.len();
    assert!((71..=73).contains(&length), "{length}");
}

#[test]
fn an_overhang_hides_the_high_suns_of_summer() {
    let roof = [
        [-FAR, 0.0, 1.0],
        [-FAR, -1.0, 1.0],
        [FAR, -1.0, 1.0],
        [FAR, 0.0, 1.0],
    ];
    let is_sunlit = |to: DVec3| to.y < 0.0 && to.z < -to.y;
    for (latitude, date, all_or_none) in [
        (40.0, WINTER, Some(true)),
        (50.0, EQUINOX, Some(true)),
        (40.0, EQUINOX, Some(false)),
        (40.0, SUMMER, Some(false)),
        (58.0, SUMMER, Some(false)),
        (75.0, SUMMER, None),
    ] {
        let suns = day(latitude, date);
        let window = one([0.0; 3], [0.0, -1.0, 0.0]);
        let (sums, expected) = hours(&[&roof], window, &suns, is_sunlit);
        let found = sums.hours.unwrap()[0];
        assert_eq!(found, expected, "{latitude} {date}");
        let south = suns.list.iter().filter(|sun| COMPASS.towards(sun).y < 0.0);
        let up = south.count() as f64 * 600.0 / 3600.0;
        match all_or_none {
            Some(true) => assert!(found >= up - slack(date), "{found} of {up}"),
            Some(false) => assert!(found <= slack(date), "{found} of {up}"),
            None => assert!(0.0 < found && found < up, "{latitude}: {found} of {up}"),
        }
    }
}

#[test]
fn the_shadow_of_a_pyramid_crosses_a_sensor_at_noon_in_winter_only() {
    const FEET: [[f64; 3]; 4] = [
        [-0.5, -0.5, 0.0],
        [0.5, -0.5, 0.0],
        [0.5, 0.5, 0.0],
        [-0.5, 0.5, 0.0],
    ];
    let sides: Vec<[[f64; 3]; 3]> = (0..4)
        .map(|side| [FEET[side], FEET[(side + 1) % 4], [0.0, 0.0, 1.0]])
        .collect();
    let sides: Vec<&[[f64; 3]]> = sides.iter().map(|side| &side[..]).collect();
    const NORTH: f64 = 1.2;
    // The solid is where |x| and |y| are at most half of 1 - z; along a ray, four bounds of its length.
    let is_sunlit = |to: DVec3| {
        let (mut from, mut until) = (0.0_f64, f64::INFINITY);
        for (at, slope) in [(0.0, to.x), (0.0, -to.x), (NORTH, to.y), (-NORTH, -to.y)] {
            // at + slope t <= (1 - z t) / 2
            let (rise, room) = (slope + to.z / 2.0, 0.5 - at);
            match rise > 0.0 {
                true => until = until.min(room / rise),
                false => from = from.max(room / rise),
            }
        }
        from > until
    };
    for (date, is_dark_at_noon) in [(EQUINOX, false), (WINTER, true), (SUMMER, false)] {
        let suns = day(45.0, date);
        let sensor = one([0.0, NORTH, 0.0], [0.0, 0.0, 1.0]);
        let (sums, expected) = hours(&sides, sensor, &suns, is_sunlit);
        let (found, longest) = (sums.hours.unwrap()[0], sums.longest.unwrap()[0]);
        assert_eq!(found, expected, "{date}");
        let up = suns.list.len() as f64 * 600.0 / 3600.0;
        match is_dark_at_noon {
            // The shadow cuts the day in two parts, about alike.
            true => {
                assert!(0.0 < found && found < up, "{found} of {up}");
                assert!((longest - found / 2.0).abs() <= 0.5, "{longest} of {found}");
            }
            false => assert_eq!((found, longest), (up, up)),
        }
        let ends = [sums.first.unwrap()[0], sums.last.unwrap()[0]];
        assert_eq!(ends, [0, suns.list.len() as i32 - 1], "{date}");
    }
}

#[test]
fn a_span_ends_with_the_day_and_with_a_missing_step() {
    let suns = day(80.0, "06-20..06-21");
    // The sun does not set, and the date changes.
    assert_eq!(suns.list.len(), 288);
    let ground = || one([0.0; 3], [0.0, 0.0, 1.0]);
    let none: [&[[f64; 3]]; 1] = [&[[9.0, 9.0, -9.0], [9.0, 8.0, -9.0], [8.0, 9.0, -9.0]]];
    let (whole, _) = hours(&none, ground(), &suns, |_| true);
    assert_eq!(
        (whole.hours.unwrap()[0], whole.longest.unwrap()[0]),
        (48.0, 24.0)
    );
    let mut cut = suns;
    cut.list.remove(60);
    let (parts, _) = hours(&none, ground(), &cut, |_| true);
    assert_eq!(parts.longest.unwrap()[0], 24.0);
    cut.list.truncate(143);
    let (parts, _) = hours(&none, ground(), &cut, |_| true);
    assert_eq!(parts.longest.unwrap()[0], 83.0 * 600.0 / 3600.0);
}
