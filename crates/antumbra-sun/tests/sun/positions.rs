//! Solar positions against published ones, and calendars.

use antumbra_sun::{Dates, Instant, Location, Positions, Refraction, Time, read_epw, read_wea};

fn at(time: &str, place: [f64; 3], air: Option<Refraction>) -> (f64, f64) {
    let [latitude, longitude, altitude] = place;
    let location = Location::new(latitude, longitude, altitude, 0.0).unwrap();
    let utc = Time::parse(time).unwrap().utc();
    Positions::new(location, air).unwrap().at(utc).unwrap()
}

#[test]
fn the_example_of_the_algorithms_report() {
    // Reda and Andreas, NREL/TP-560-34302, A.5.
    let air = Refraction {
        pressure: 820.0,
        temperature: 11.0,
    };
    let place = [39.742476, -105.1786, 1830.14];
    let (azimuth, elevation) = at("2003-10-17T12:30:30-07:00", place, Some(air));
    assert!((azimuth - 194.34024).abs() < 5e-5, "{azimuth}");
    assert!((90.0 - elevation - 50.11162).abs() < 5e-5, "{elevation}");
}

#[test]
fn positions_are_those_of_pvlib_with_refraction_and_without() {
    // pvlib 0.16, get_solarposition(..., pressure=101325, temperature=12): azimuth, elevation, apparent_elevation.
    for (time, place, [azimuth, elevation, apparent]) in [
        (
            "2024-06-21T11:30",
            [48.0, 11.5, 500.0],
            [187.742428, 65.276722, 65.284467],
        ),
        (
            "2023-12-21T20:15",
            [-33.9, 151.2, 0.0],
            [107.144728, 17.084859, 17.138411],
        ),
        (
            "2000-02-29T06:00",
            [64.1, -21.9, 30.0],
            [70.523464, -17.803060, -17.803060],
        ),
        (
            "1990-03-20T17:45",
            [0.0, -78.5, 2850.0],
            [269.426215, 84.117730, 84.119440],
        ),
    ] {
        let geometric = at(time, place, None);
        let bent = at(time, place, Some(Refraction::default()));
        for (found, expected) in [
            (geometric.0, azimuth),
            (bent.0, azimuth),
            (geometric.1, elevation),
            (bent.1, apparent),
        ] {
            assert!(
                (found - expected).abs() < 2e-6,
                "{time}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_year_has_all_its_steps_and_counts_those_of_the_night() {
    let location = Location::new(48.0, 11.5, 500.0, 1.0).unwrap();
    let positions = Positions::new(location, None).unwrap();
    for (year, step, expected) in [(2023, 60, 8760), (2024, 60, 8784), (2023, 1440, 365)] {
        let suns = positions.year(year, step, Instant::Middle, None).unwrap();
        assert_eq!(suns.list.len() + suns.below_horizon, expected);
        assert!(suns.list.iter().all(|sun| sun.elevation > 0.0));
    }
    let leap = Some(Dates::parse("02-29").unwrap());
    for (year, expected) in [(2023, 0), (2024, 144)] {
        let suns = positions.year(year, 10, Instant::Middle, leap).unwrap();
        assert_eq!(suns.list.len() + suns.below_horizon, expected);
    }
    // The middle of the day's only step is noon.
    let suns = positions.year(2023, 1440, Instant::Middle, None).unwrap();
    assert!(
        suns.list
            .iter()
            .all(|sun| sun.time.unwrap().second() == 43_200)
    );
}

#[test]
fn a_polar_night_has_no_sun_and_a_polar_day_has_all() {
    let location = Location::new(80.0, 20.0, 0.0, 1.0).unwrap();
    let positions = Positions::new(location, None).unwrap();
    let of = |day| {
        let dates = Some(Dates::parse(day).unwrap());
        let suns = positions.year(2023, 60, Instant::Middle, dates).unwrap();
        (suns.list.len(), suns.below_horizon)
    };
    assert_eq!(of("12-21"), (0, 24));
    assert_eq!(of("06-21"), (24, 0));
}

#[test]
fn a_clock_with_a_fraction_of_an_hour_moves_the_suns() {
    let suns = |timezone| {
        let location = Location::new(27.7, 85.3, 1400.0, timezone).unwrap();
        let positions = Positions::new(location, None).unwrap();
        let dates = Some(Dates::parse("03-20").unwrap());
        positions
            .year(2023, 15, Instant::Middle, dates)
            .unwrap()
            .list
    };
    let (nepal, india) = (suns(5.75), suns(5.5));
    let noon =
        |list: &[antumbra_sun::Sun]| list.iter().position(|sun| sun.azimuth > 180.0).unwrap();
    let (later, earlier) = (nepal[noon(&nepal)], india[noon(&india)]);
    assert_eq!(
        later.time.unwrap().second() - earlier.time.unwrap().second(),
        900
    );
    assert_eq!(
        (later.azimuth, later.elevation),
        (earlier.azimuth, earlier.elevation)
    );
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |latitude, longitude, altitude, timezone| {
        Location::new(latitude, longitude, altitude, timezone)
            .unwrap_err()
            .to_string()
    };
    assert!(refused(91.0, 0.0, 0.0, 0.0).starts_with("the latitude is 91: expected -90 to 90"));
    assert!(refused(f64::NAN, 0.0, 0.0, 0.0).starts_with("the latitude is NaN"));
    assert!(refused(0.0, 181.0, 0.0, 0.0).starts_with("the longitude is 181"));
    assert!(refused(0.0, 0.0, 1e6, 0.0).starts_with("the altitude is 1000000"));
    assert!(refused(0.0, 0.0, 0.0, 15.0).starts_with("the time zone is 15"));
    assert!(refused(0.0, 0.0, 0.0, 0.123_456).contains("whole minutes"));
    let location = Location::new(48.0, 11.5, 0.0, 1.0).unwrap();
    assert_eq!(location.doubt(), None);
    let slip = Location::new(41.98, 87.92, 0.0, -6.0).unwrap();
    assert!(slip.doubt().unwrap().contains("west is negative"));
    assert_eq!(
        Location::new(-17.0, 179.0, 0.0, -11.0).unwrap().doubt(),
        None
    );
    let positions = Positions::new(location, None).unwrap();
    let year = |year, step| {
        positions
            .year(year, step, Instant::Middle, None)
            .unwrap_err()
    };
    assert!(year(0, 60).to_string().starts_with("the year is 0"));
    assert!(
        year(2023, 7)
            .to_string()
            .starts_with("the step is 7 minutes")
    );
    assert!(
        year(2023, 0)
            .to_string()
            .starts_with("the step is 0 minutes")
    );
    let air = Refraction {
        pressure: 0.0,
        temperature: 12.0,
    };
    assert!(Positions::new(location, Some(air)).is_err());
}

#[test]
fn weather_files_of_one_station_agree() {
    let Some(folder) = antumbra_testkit::absent::shared_scenes() else {
        return;
    };
    let epw = read_epw(&folder.join("sun/chicago.epw")).unwrap();
    let wea = read_wea(&folder.join("sun/chicago.wea")).unwrap();
    assert_eq!((epw.rows.len(), wea.rows.len()), (8760, 8760));
    assert_eq!((epw.location, epw.step), (wea.location, wea.step));
    assert!(
        epw.notes.is_empty() && wea.notes.is_empty(),
        "{:?} {:?}",
        epw.notes,
        wea.notes
    );
    for (one, other) in epw.rows.iter().zip(&wea.rows) {
        assert_eq!(
            (
                one.month,
                one.day,
                one.start,
                one.direct_normal,
                one.diffuse_horizontal
            ),
            (
                other.month,
                other.day,
                other.start,
                other.direct_normal,
                other.diffuse_horizontal
            ),
            "line {}",
            one.line
        );
    }
    // Without refraction, light comes from below the horizon for minutes only.
    let suns = epw.suns(Some(2017), None, Instant::Middle, None).unwrap();
    assert_eq!(suns.list.len() + suns.below_horizon, 8760);
    assert!(
        (4300..4500).contains(&suns.list.len()),
        "{}",
        suns.list.len()
    );
    let all: f64 = epw.rows.iter().filter_map(|row| row.direct_normal).sum();
    let seen: f64 = suns.list.iter().filter_map(|sun| sun.direct_normal).sum();
    assert!(seen > 0.99 * all, "{seen} {all}");
    let mannheim = read_epw(&folder.join("sun/mannheim.epw")).unwrap();
    assert_eq!(
        (mannheim.rows.len(), mannheim.location.offset_minutes),
        (8760, 60)
    );
}
