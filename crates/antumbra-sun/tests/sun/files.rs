//! Files of a study, written and read back.

use antumbra_sun::{
    Location, Sensors, Study, Sums, Sun, SunKind, read_npz, reinhart, sums, write_csv,
    write_netcdf, write_npz, write_zarr,
};

use crate::support::{day, index, study};

/// A plate over three sensors, on a day with weather.
fn sample() -> Study {
    let index = index(&[&[
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ]]);
    let points = vec![[0.0; 3], [0.5, 3.0, 0.0], [-1.0, 0.0, 0.5]];
    let normals = vec![[0.0, 0.0, 1.0], [0.0, -1.0, 1.0], [-2.0, 0.0, 0.0]];
    let sensors = Sensors::in_space(points, Some(normals)).unwrap();
    let mut suns = day(45.0, "03-20");
    for (number, sun) in suns.list.iter_mut().enumerate() {
        sun.direct_normal = (number % 9 > 0).then_some(800.0 + number as f64);
    }
    let mut study = study(&index, sensors, &suns);
    study.about.has_weather = true;
    study.about.location = Some(Location::new(45.0, 0.0, 0.0, 0.0).unwrap());
    study
}

#[test]
fn a_study_comes_back_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let study = sample();
    write_npz(&path, &study, &sums(&study)).unwrap();
    assert_eq!(read_npz(&path).unwrap(), study);
    let bytes = std::fs::read(&path).unwrap();
    write_npz(&path, &study, &sums(&study)).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
}

/// A study of suns that reach sensors in part, under a sky that shines.
fn sample_with_shares() -> Study {
    let mut study = sample();
    study.about.sun_diameter = Some(0.533);
    study.about.diffuse = Some(antumbra_sun::Diffuse {
        sky: "reinhart:4".into(),
        horizontal: 2.5,
        dates: Some(antumbra_sun::Dates::parse("03-20").unwrap()),
    });
    let count = 3 * study.suns.len();
    study.shares = Some((0..count).map(|at| (at % 5) as f32 / 4.0).collect());
    study.sky_view_factor = Some(vec![1.0, 0.5, 0.25]);
    study
}

#[test]
fn shares_and_the_light_of_the_sky_come_back_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let study = sample_with_shares();
    let numbers = sums(&study);
    write_npz(&path, &study, &numbers).unwrap();
    let found = read_npz(&path).unwrap();
    assert_eq!(found, study);
    assert_eq!(sums(&found), numbers);
    assert_eq!(numbers.diffuse, Some(vec![2.5, 1.25, 0.625]));
    let path = folder.path().join("a.csv");
    write_csv(&path, &study, &numbers).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let head = "hours,longest_hours,irradiation_kwh_m2,diffuse_kwh_m2,total_kwh_m2,sky_view_factor";
    assert!(
        text.starts_with(&format!("sensor,x,y,z,nx,ny,nz,{head}")),
        "{text}"
    );
    // The first number of the variable behind all smaller ones, highest byte first.
    let path = folder.path().join("a.nc");
    write_netcdf(&path, &study, &numbers).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let shares: Vec<u8> = study
        .shares
        .iter()
        .flatten()
        .flat_map(|x| x.to_be_bytes())
        .collect();
    assert_eq!(bytes[bytes.len() - shares.len()..], shares);
    let path = folder.path().join("a.zarr");
    write_zarr(&path, &study, &numbers).unwrap();
    let about = std::fs::read_to_string(path.join("shares/zarr.json")).unwrap();
    let about: serde_json::Value = serde_json::from_str(&about).unwrap();
    assert_eq!(about["data_type"], "float32");
    assert_eq!(about["shape"], serde_json::json!([3, study.suns.len()]));
}

#[test]
fn shares_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let refused = |change: &dyn Fn(&mut Study)| {
        let mut study = sample_with_shares();
        change(&mut study);
        write_npz(&path, &study, &Sums::default()).unwrap();
        read_npz(&path).unwrap_err().to_string()
    };
    for bad in [f32::NAN, -0.5, 1.5, f32::INFINITY] {
        let error = refused(&|study| study.shares.as_mut().unwrap()[7] = bad);
        assert!(
            error.contains("`shares` has a number that is not from 0 to 1"),
            "{error}"
        );
    }
    let error = refused(&|study| study.shares = None);
    assert!(error.contains("it has no array `shares`"), "{error}");
    // Without its sums, a file has no factors.
    let error = refused(&|_| ());
    assert!(
        error.contains("it has no array `sky_view_factor`"),
        "{error}"
    );
}

#[test]
fn a_damaged_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let study = sample();
    write_npz(&path, &study, &Sums::default()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..length]).unwrap();
        let error = read_npz(&path).unwrap_err().to_string();
        assert!(error.contains("it is no study"), "{error}");
    }
    for at in (0..whole.len()).step_by(13) {
        let mut changed = whole.clone();
        changed[at] ^= 0x21;
        std::fs::write(&path, &changed).unwrap();
        if let Ok(found) = read_npz(&path) {
            assert_eq!(found.bits, study.bits, "{at}");
        }
    }
}

#[test]
fn irradiation_is_that_of_the_rule() {
    let study = sample();
    let found = sums(&study).irradiation.unwrap();
    for sensor in 0..3 {
        let normal = study.normals.as_ref().unwrap()[sensor];
        let mut expected = 0.0;
        for (place, sun) in study.suns.iter().enumerate() {
            if study.bits.is_sunlit(sensor, place) {
                let to = study.directions[place];
                let cosine: f64 = (0..3).map(|axis| normal[axis] * to[axis]).sum();
                assert!(cosine > 0.0);
                expected += sun.direct_normal.unwrap_or(0.0) * cosine * sun.weight / 3.6e6;
            }
        }
        assert!(
            (found[sensor] - expected).abs() <= 1e-12 * expected,
            "{sensor}"
        );
        assert!(expected > 0.5, "{sensor}: {expected}");
    }
}

#[test]
fn a_table_has_a_row_for_each_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let study = sample();
    write_csv(&path, &study, &sums(&study)).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "sensor,x,y,z,nx,ny,nz,hours,longest_hours,irradiation_kwh_m2,first,last"
    );
    assert_eq!(lines.len(), 4);
    let hours: f64 = lines[1].split(',').nth(7).unwrap().parse().unwrap();
    assert_eq!(hours, sums(&study).hours.unwrap()[0]);
    assert!(lines[1].contains(",2023-03-20T"), "{}", lines[1]);
    assert!(!text.contains(",-0,"), "{text}");
    // Patches of the sky have no times.
    let mut sky = study;
    sky.about.kind = SunKind::Sky;
    write_csv(&path, &sky, &sums(&sky)).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.starts_with("sensor,x,y,z,nx,ny,nz,sky_visible,sky_view_factor\n"),
        "{text}"
    );
}

#[test]
fn a_zarr_folder_replaces_an_earlier_study_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zarr");
    let study = sample();
    for _ in 0..2 {
        write_zarr(&path, &study, &sums(&study)).unwrap();
    }
    let about = std::fs::read_to_string(path.join("sunlit/zarr.json")).unwrap();
    let about: serde_json::Value = serde_json::from_str(&about).unwrap();
    let bytes = study.suns.len().div_ceil(8);
    assert_eq!(about["shape"], serde_json::json!([3, bytes]));
    let chunk = std::fs::read(path.join("sunlit/c/0/0")).unwrap();
    assert_eq!(chunk.len(), 3 * bytes);
    assert_eq!(chunk[..8], study.bits.words[0].to_le_bytes());
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(names.len(), 1, "{names:?}");
    let other = folder.path().join("mine.zarr");
    std::fs::create_dir(&other).unwrap();
    assert!(write_zarr(&other, &study, &sums(&study)).is_err());
    assert!(other.is_dir());
}

#[test]
fn a_netcdf_file_is_as_long_as_its_header_says() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.nc");
    let study = sample();
    write_netcdf(&path, &study, &sums(&study)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.starts_with(b"CDF\x02\0\0\0\0\0\0\0\x0a"));
    // The bits are the last variable, filled up to four bytes.
    let row = study.suns.len().div_ceil(8);
    let last = &bytes[bytes.len() - (3 * row).next_multiple_of(4)..];
    assert_eq!(last[..8], study.bits.words[0].to_le_bytes());
}

#[test]
fn other_weather_of_the_place_changes_sums_and_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.wea");
    let head = "place X\nlatitude 45.05\nlongitude 0\ntime_zone 0\nsite_elevation 0\nweather_data_file_units 1\n";
    let rows = |from: i32| -> String {
        // Every ten minutes of one day.
        let row = |step: i32| format!("3 20 {:.6} 500 100\n", (f64::from(step) + 0.5) / 6.0);
        (from..144).map(row).collect()
    };
    std::fs::write(&path, head.to_owned() + &rows(0)).unwrap();
    let weather = antumbra_sun::read_wea(&path).unwrap();
    let mut study = sample();
    let before = study.bits.clone();
    let (instant, location) = (study.about.instant, study.about.location);
    let count = study.suns.len();
    let found = weather
        .replace_irradiance(&mut study.suns, instant, location)
        .unwrap();
    assert_eq!((found, study.bits.clone()), (count, before));
    assert!(
        study
            .suns
            .iter()
            .all(|sun| sun.direct_normal == Some(500.0))
    );
    // Rows that are not there leave suns without irradiance.
    std::fs::write(&path, head.to_owned() + &rows(72)).unwrap();
    let weather = antumbra_sun::read_wea(&path).unwrap();
    let found = weather
        .replace_irradiance(&mut study.suns, instant, location)
        .unwrap();
    assert!(found > 0 && found < count);
    let missing: Vec<&Sun> = study
        .suns
        .iter()
        .filter(|sun| sun.direct_normal.is_none())
        .collect();
    assert_eq!(missing.len(), count - found);
    // Another place is refused, as are patches of the sky.
    let far = Location::new(46.0, 0.0, 0.0, 0.0).unwrap();
    let error = weather
        .replace_irradiance(&mut study.suns, instant, Some(far))
        .unwrap_err();
    assert!(
        error.to_string().contains("expected that of the study, 46"),
        "{error}"
    );
    let mut sky = reinhart(1).list;
    let error = weather
        .replace_irradiance(&mut sky, instant, None)
        .unwrap_err();
    assert!(error.to_string().contains("no times"), "{error}");
}

/// A study of one sensor a group that sees every second sun of a year at a latitude.
fn year_of(instant: antumbra_sun::Instant, year: i32, step: u32) -> antumbra_sun::Study {
    let location = antumbra_sun::Location::new(48.0, 0.0, 0.0, 0.0).unwrap();
    let positions = antumbra_sun::Positions::new(location, None).unwrap();
    let suns = positions.year(year, step, instant, None).unwrap().list;
    let stride = suns.len().div_ceil(64);
    let mut words = vec![0x5555_5555_5555_5555_u64; stride];
    words.resize(2 * stride, 0);
    let mut about = crate::support::about(antumbra_sun::SunKind::Suns);
    about.instant = instant;
    antumbra_sun::Study {
        about,
        points: vec![[0.0; 3]; 2],
        normals: None,
        surfaces: None,
        areas: Some(vec![1.0, 3.0]),
        directions: vec![[0.0, 0.0, 1.0]; suns.len()],
        suns,
        bits: antumbra_sun::Bits { stride, words },
        shares: None,
        sky_view_factor: None,
    }
}

#[test]
fn energyplus_has_a_row_for_each_step_of_a_year() {
    use antumbra_sun::{Groups, Instant, write_energyplus};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shading.csv");
    let names = |names: &[&str], of: [u32; 2]| Groups {
        names: names.iter().map(|&name| name.to_owned()).collect(),
        of: of.into(),
    };
    for (instant, year, step, row_count) in [
        (Instant::Middle, 2023, 60, 8760),
        (Instant::Start, 2024, 60, 8784),
        (Instant::End, 2023, 15, 35_040),
    ] {
        let study = year_of(instant, year, step);
        write_energyplus(&path, &study, &names(&["roof, south", "wall"], [0, 1])).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "Surface Name,roof_ south,wall");
        assert_eq!(rows.len() - 1, row_count);
        let first = if step == 60 {
            "01/01 01:00,0,0"
        } else {
            "01/01 00:15,0,0"
        };
        assert_eq!((rows[1], rows[row_count]), (first, "12/31 24:00,0,0"));
        // Suns are in the rows of their steps: as many as there are, every second one sunlit.
        let lit: Vec<&&str> = rows
            .iter()
            .filter(|row| row.ends_with(",0.00000000"))
            .collect();
        assert_eq!(lit.len(), study.suns.len());
        for (place, row) in lit.iter().enumerate() {
            let time = study.suns[place].time.unwrap();
            let (_, month, day) = time.date();
            let behind = match instant {
                Instant::Start => i64::from(step),
                Instant::Middle => i64::from(step) / 2,
                Instant::End => 0,
            };
            let minutes = time.second() / 60 + behind;
            let share = if place % 2 == 0 { "1" } else { "0" };
            let due = format!(
                "{month:02}/{day:02} {:02}:{:02},{share}.00000000,",
                minutes / 60,
                minutes % 60
            );
            assert!(row.starts_with(&due), "{row} {due}");
        }
    }
    let study = year_of(Instant::Middle, 2023, 60);
    write_energyplus(&path, &study, &names(&["both"], [0, 0])).unwrap();
    assert!(
        std::fs::read_to_string(&path)
            .unwrap()
            .contains("12:00,0.25000000\n")
    );
}

#[test]
fn suns_that_are_no_steps_of_a_year_have_no_rows() {
    use antumbra_sun::{Instant, check_energyplus};
    let study = year_of(Instant::Middle, 2023, 60);
    let refused = |change: &dyn Fn(&mut Vec<antumbra_sun::Sun>), instant, why: &str| {
        let mut suns = study.suns.clone();
        change(&mut suns);
        let error = check_energyplus(&suns, instant).unwrap_err();
        assert!(error.to_string().contains(why), "{error}");
    };
    refused(
        &|suns| suns[3].weight = 60.0,
        Instant::Middle,
        "equal steps",
    );
    refused(&|suns| suns[3].time = None, Instant::Middle, "no times");
    refused(&|suns| suns.push(suns[0]), Instant::Middle, "are one step");
    refused(&|_| (), Instant::Start, "does not stand at its step");
}
