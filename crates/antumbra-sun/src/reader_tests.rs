//! Tests of the readers: accepted files, and the place and the words of every refusal.

use std::path::Path;

use crate::calendar::Dates;
use crate::positions::Instant;
use crate::suns::Suns;
use crate::weather::Weather;
use crate::{epw, point_file, sun_file, wea};

/// Header of an EPW file of Munich with so many rows an hour.
fn head(per_hour: u32) -> String {
    format!(
        "LOCATION,\"Munich, Airport\",BY,DEU,TMY,108660,48.35,11.79,1.0,443.0\n\
         DESIGN CONDITIONS,0\n\
         HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\n\
         DATA PERIODS,1,{per_hour},Data,Sunday, 1/ 1,12/31\n"
    )
}

/// Row of an EPW file; `when` is year, month, day, hour and minute.
fn row(when: &str, direct: &str, diffuse: &str) -> String {
    format!("{when},?9?9,1,2,3,99000,0,0,300,0,{direct},{diffuse},0,0\n")
}

fn read_epw(text: &str) -> Result<Weather, String> {
    epw::parse(Path::new("a.epw"), text).map_err(|error| error.to_string())
}

fn day(hours: impl IntoIterator<Item = u32>) -> String {
    let rows = hours
        .into_iter()
        .map(|hour| row(&format!("2019,6,21,{hour},0"), "500", "80"));
    head(1) + &rows.collect::<String>()
}

fn suns(weather: &Weather, year: Option<i32>) -> Result<Suns, String> {
    weather
        .suns(year, None, Instant::Middle, None)
        .map_err(|error| error.to_string())
}

#[test]
fn rows_of_an_epw_file_name_the_end_of_their_hour() {
    let weather = read_epw(&day(1..=24)).unwrap();
    assert_eq!(
        (weather.location.latitude, weather.location.offset_minutes),
        (48.35, 60)
    );
    let found = suns(&weather, None).unwrap();
    assert_eq!(found.list.len() + found.below_horizon, 24);
    assert_eq!(found.below_horizon, 8);
    let noon = found
        .list
        .iter()
        .find(|sun| sun.time.unwrap().second() == 45_000)
        .unwrap();
    assert_eq!(noon.time.unwrap().to_string(), "2019-06-21T12:30:00");
    // The sun culminates at 12:15 there.
    assert!(
        (noon.azimuth - 180.0).abs() < 15.0 && noon.elevation > 64.0,
        "{noon:?}"
    );
    assert_eq!((noon.direct_normal, noon.weight), (Some(500.0), 3600.0));
    let at_end = weather.suns(Some(2020), None, Instant::End, None).unwrap();
    assert!(
        at_end
            .list
            .iter()
            .any(|sun| sun.time.unwrap().to_string() == "2020-06-21T12:00:00")
    );
}

#[test]
fn steps_within_an_hour_end_at_their_minute() {
    let rows = [15, 30, 45, 60].map(|minute| row(&format!("2019,6,21,12,{minute}"), "1", "1"));
    let weather = read_epw(&(head(4) + &rows.concat())).unwrap();
    assert_eq!(weather.step, 900);
    let starts: Vec<i64> = weather.rows.iter().map(|row| row.start / 60).collect();
    assert_eq!(starts, [660, 675, 690, 705]);
    let bad = read_epw(&(head(4) + &row("2019,6,21,12,20", "1", "1"))).unwrap_err();
    assert_eq!(
        bad,
        "a.epw:5: the minute is 20: expected 15, 30 and so on up to 60, the end of the step"
    );
}

#[test]
fn line_breaks_and_a_header_of_summer_time_change_no_row() {
    let plain = read_epw(&day(1..=24)).unwrap();
    let windows = crate::text::decode(day(1..=24).replace('\n', "\r\n").into_bytes());
    assert_eq!(read_epw(&windows).unwrap().rows, plain.rows);
    let text = day(1..=24).replace("No,0,0,0", "No,3/31,10/27,0");
    let summer = read_epw(&text).unwrap();
    assert_eq!(summer.rows, plain.rows);
    assert!(
        summer
            .notes
            .iter()
            .any(|note| note.contains("daylight saving")),
        "{:?}",
        summer.notes
    );
}

#[test]
fn missing_rows_are_counted_and_missing_values_are_not_zero() {
    let weather = read_epw(&day((1..=24).filter(|hour| !(11..=12).contains(hour)))).unwrap();
    let note = "a.epw: 2 rows are missing, the first before line 15: these times have no sun";
    assert!(
        weather.notes.contains(&note.to_owned()),
        "{:?}",
        weather.notes
    );
    assert_eq!(suns(&weather, None).unwrap().list.len(), 14);
    for missing in ["9999", "9999.0", "", "nan", "99999"] {
        let text = head(1) + &row("2019,6,21,12,0", missing, "80");
        let found = suns(&read_epw(&text).unwrap(), None).unwrap();
        assert_eq!(
            (found.list[0].direct_normal, found.missing()),
            (None, 1),
            "{missing}"
        );
        assert!(
            found
                .notes
                .iter()
                .any(|note| note.contains("1 suns have no direct normal"))
        );
    }
}

#[test]
fn a_leap_day_belongs_to_years_that_have_one() {
    let text = head(1) + &row("2020,2,29,12,0", "1", "1");
    let weather = read_epw(&text).unwrap();
    assert_eq!(suns(&weather, None).unwrap().list.len(), 1);
    assert_eq!(
        suns(&weather, Some(2023)).unwrap_err(),
        "a.epw:5: the day 02-29 does not exist in the year 2023"
    );
    // Of mixed years, one may be wrong about it.
    let text = head(1) + &row("2019,2,29,12,0", "1", "1");
    assert!(suns(&read_epw(&text).unwrap(), None).is_err());
    assert!(suns(&read_epw(&text).unwrap(), Some(2024)).is_ok());
}

#[test]
fn years_may_follow_each_other_and_are_not_mixed_into_one() {
    let rows = row("2018,12,31,12,0", "1", "1") + &row("2019,1,1,12,0", "1", "1");
    let weather = read_epw(&(head(1) + &rows)).unwrap();
    assert_eq!(suns(&weather, None).unwrap().list.len(), 2);
    let error = suns(&weather, Some(2020)).unwrap_err();
    assert_eq!(
        error,
        "a.epw: the rows are of more than one year: leave the year out"
    );
}

#[test]
fn bad_epw_files_are_refused_with_their_line() {
    let row = |when: &str| row(when, "1", "1");
    let twice = row("2019,6,21,1,0") + &row("2019,6,21,1,60");
    let back = row("2019,6,21,2,0") + &row("2019,6,21,1,0");
    let with_rows = |rows: &str| head(1) + rows;
    for (text, expected) in [
        (
            String::new(),
            "a.epw: it ends before its line `DATA PERIODS`",
        ),
        (head(1), "a.epw: it has no rows"),
        (
            head(7),
            "a.epw:4: expected the rows of an hour, a divisor of 60",
        ),
        (
            with_rows(&twice),
            "a.epw:6: the time 06-21 00:00 is there twice, after line 5",
        ),
        (
            with_rows(&back),
            "a.epw:6: the time 06-21 00:00 is out of order, after line 5",
        ),
        (
            with_rows(&row("2019,13,1,1,0")),
            "a.epw:5: the month is `13`: expected 1 to 12",
        ),
        (
            with_rows(&row("2019,4,31,1,0")),
            "a.epw:5: the day is `31`: expected 1 to 30",
        ),
        (
            with_rows(&row("2019,4,1,25,0")),
            "a.epw:5: the hour is `25`: expected 1 to 24",
        ),
        (
            with_rows("2019,1,1,1,0,x\n"),
            "a.epw:5: the row has 6 fields: expected 16 or more",
        ),
        (
            with_rows(&super::reader_tests::row("2019,1,1,1,0", "-5", "1")),
            "a.epw:5: the direct normal irradiance is `-5`: expected W/m2",
        ),
        (
            head(1).replace("48.35", "98.35"),
            "a.epw:1: the latitude is 98.35: expected -90 to 90 degrees",
        ),
        (
            head(1).replace("48.35", "x"),
            "a.epw:1: expected `LOCATION` to end in latitude",
        ),
        (
            head(1).replace("LOCATION", "PLACE") + &row("2019,1,1,1,0"),
            "a.epw: it has no line `LOCATION`",
        ),
        (
            row("2019,1,1,1,0"),
            "a.epw:1: expected a line `DATA PERIODS` before the rows",
        ),
    ] {
        let error = read_epw(&text).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}

const WEA: &str = "place Chicago_USA\nlatitude 41.98\nlongitude 87.92\ntime_zone 90\n\
    site_elevation 201.0\nweather_data_file_units 1\n";

fn read_wea(text: &str) -> Result<Weather, String> {
    wea::parse(Path::new("a.wea"), text).map_err(|error| error.to_string())
}

#[test]
fn a_wea_file_counts_west_and_names_the_middle_of_hours() {
    let text = WEA.to_owned() + "6 21 11.5 700 90\n6 21 12.5 710 95\n6 21 14.5 690 80\n";
    let weather = read_wea(&text).unwrap();
    assert_eq!(
        (weather.location.longitude, weather.location.offset_minutes),
        (-87.92, -360)
    );
    assert_eq!((weather.step, weather.rows[0].start), (3600, 11 * 3600));
    let found = suns(&weather, None).unwrap();
    assert_eq!(
        found.list[1].time.unwrap().to_string(),
        "2017-06-21T12:30:00"
    );
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("1 rows are missing")),
        "{:?}",
        found.notes
    );
    let only = weather
        .suns(None, None, Instant::Middle, Dates::parse("06-22").ok())
        .unwrap();
    assert_eq!(only.list.len() + only.below_horizon, 0);
}

#[test]
fn bad_wea_files_are_refused_with_their_line() {
    for (text, expected) in [
        (
            String::new(),
            "a.wea: its header is not whole: expected latitude",
        ),
        (
            "1 1 0.5 0 0\n".to_owned(),
            "a.wea:1: expected `latitude` before the rows",
        ),
        (WEA.to_owned(), "a.wea: it has no rows"),
        (
            WEA.to_owned() + "1 1 0.5 0\n",
            "a.wea:7: the row has 4 words",
        ),
        (
            WEA.to_owned() + "1 1 24.5 0 0\n",
            "a.wea:7: the hour is `24.5`: expected 0 to 24",
        ),
        (
            WEA.to_owned() + "2 30 1 0 0\n",
            "a.wea:7: the day is `30`: expected 1 to 29",
        ),
        (
            WEA.to_owned() + "latitude 3\n",
            "a.wea:7: `latitude` is there twice",
        ),
        (
            WEA.to_owned() + "hello\n",
            "a.wea:7: the line begins with `hello`",
        ),
        (
            WEA.replace("units 1", "units 2") + "1 1 1 0 0\n",
            "a.wea: weather_data_file_units is 2",
        ),
    ] {
        let error = read_wea(&text).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}

fn read_suns(text: &str) -> Result<Suns, String> {
    sun_file::parse(Path::new("s.csv"), text, 30).map_err(|error| error.to_string())
}

#[test]
fn lists_of_suns_have_their_columns_in_any_order() {
    let found = read_suns("Elevation, azimuth ,zenith\n30,180,60\n-1,0,91\n0,10,90\n").unwrap();
    assert_eq!((found.list.len(), found.below_horizon), (1, 2));
    let sun = found.list[0];
    assert_eq!(
        (sun.azimuth, sun.elevation, sun.weight, sun.time),
        (180.0, 30.0, 1800.0, None)
    );
    assert!(found.notes[0].contains("`zenith`"), "{:?}", found.notes);
    let found = read_suns("azimuth,elevation,hours,weight\n1,2,0.25,800\n1,2,1,\n").unwrap();
    assert_eq!(
        (found.list[0].weight, found.list[0].direct_normal),
        (900.0, Some(800.0))
    );
    assert_eq!((found.missing(), found.list[1].direct_normal), (1, None));
}

#[test]
fn an_hour_that_a_clock_shows_twice_needs_offsets() {
    let twice = "time,azimuth,elevation\n2024-10-27T02:30,1,2\n2024-10-27T02:30,1,2\n";
    let error = read_suns(twice).unwrap_err();
    assert!(
        error.starts_with("s.csv:3: the time 2024-10-27T02:30:00 is not after that of line 2"),
        "{error}"
    );
    let told = "time,azimuth,elevation\n2024-10-27T02:30+02:00,1,2\n2024-10-27T02:30+01:00,1,2\n";
    assert_eq!(read_suns(told).unwrap().list.len(), 2);
    // The hour that a clock leaves out in spring is an hour apart in UTC alone.
    let gap = "time,azimuth,elevation\n2024-03-31T01:30+01:00,1,2\n2024-03-31T03:30+02:00,1,2\n";
    let times: Vec<i64> = read_suns(gap)
        .unwrap()
        .list
        .iter()
        .map(|sun| sun.time.unwrap().utc())
        .collect();
    assert_eq!(times[1] - times[0], 3600);
}

#[test]
fn bad_lists_of_suns_are_refused_with_their_line() {
    for (text, expected) in [
        ("", "s.csv: it is empty"),
        (
            "time,azimuth\n",
            "s.csv:1: expected a line with the columns `azimuth` and `elevation`",
        ),
        ("1,2\n", "s.csv:1: expected a line with the columns"),
        (
            "azimuth,azimuth,elevation\n",
            "s.csv:1: the column `azimuth` is there twice",
        ),
        (
            "azimuth,elevation\n1\n",
            "s.csv:2: the row has 1 fields: expected 2",
        ),
        (
            "azimuth,elevation\n\nnan,2\n",
            "s.csv:3: the azimuth is `nan`",
        ),
        (
            "azimuth,elevation\n1,91\n",
            "s.csv:2: the elevation is `91`: expected -90 to 90",
        ),
        (
            "azimuth,elevation,hours\n1,1,-1\n",
            "s.csv:2: the column `hours` has `-1`",
        ),
        (
            "azimuth,elevation,time\n1,1,noon\n",
            "s.csv:2: the time is `noon`",
        ),
        (
            "azimuth,elevation,weight\n1,1,x\n",
            "s.csv:2: the weight is `x`",
        ),
    ] {
        let error = read_suns(text).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn lists_of_points_name_the_row_that_is_no_number() {
    let read =
        |text| point_file::parse(Path::new("p.csv"), text).map_err(|error| error.to_string());
    let list = read("id,x,y,z,nx,ny,nz\na,1,2,3,0,0,1\n").unwrap();
    assert_eq!(
        (list.points, list.normals),
        (vec![[1.0, 2.0, 3.0]], Some(vec![[0.0, 0.0, 1.0]]))
    );
    for (text, expected) in [
        (
            "",
            "p.csv:1: expected a line with the columns `x`, `y` and `z`",
        ),
        ("x,y\n", "p.csv:1: expected a line with the columns"),
        ("x,y,z,nx\n", "p.csv:1: expected all of the columns `nx`"),
        (
            "x,y,z\n0,0,0\n0,NaN,0\n",
            "p.csv:3: `y` is `NaN`: expected a finite number",
        ),
        (
            "x,y,z\n0,0\n",
            "p.csv:2: `z` is ``: expected a finite number",
        ),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn damaged_text_makes_no_reader_panic() {
    let files = [
        day(1..=24),
        WEA.to_owned() + "6 21 11.5 700 90\n6 21 12.5 710 95\n",
        "time,azimuth,elevation,hours,weight\n2024-06-21T12:00,180,60,1,800\n".to_owned(),
        "x,y,z,nx,ny,nz\n1,2,3,0,0,1\n".to_owned(),
    ];
    let letters = b"\n\r,\"-+.eE0159 nNaA\xff\xc3:TZ";
    // SplitMix64.
    let mut state = 0_u64;
    let mut random = |below: usize| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as usize % below
    };
    let mut refused = 0;
    for _ in 0..3000 {
        for file in &files {
            let mut bytes = file.clone().into_bytes();
            for _ in 0..1 + random(4) {
                let at = random(bytes.len());
                match random(3) {
                    0 => bytes[at] = letters[random(letters.len())],
                    1 => bytes.insert(at, letters[random(letters.len())]),
                    _ => drop(bytes.remove(at)),
                }
            }
            let text = crate::text::decode(bytes);
            let found = [
                read_epw(&text)
                    .and_then(|weather| suns(&weather, Some(2024)))
                    .is_ok(),
                read_wea(&text)
                    .and_then(|weather| suns(&weather, None))
                    .is_ok(),
                read_suns(&text).is_ok(),
                point_file::parse(Path::new("p.csv"), &text).is_ok(),
            ];
            refused += found.iter().filter(|&&is_read| !is_read).count();
        }
    }
    assert!(refused > 12_000, "{refused}");
}
