//! `antumbra sun`: sensors, suns, files and refusals.

use std::fs;
use std::path::PathBuf;

use antumbra_sun::{Study, read_npz, sums};

use super::support::{Folder, antumbra, assert_code, npy, stderr, stdout, text};

/// A square floor that faces up, with a plate above its western half.
const SCENE: &str = "\
o floor
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
f 1 2 3 4
o plate
v -1 -1 0.5
v 0 -1 0.5
v 0 1 0.5
v -1 1 0.5
f 5 6 7 8
";

/// The zenith, and a sun in the west at 45 degrees.
const SUNS: &str = "azimuth,elevation,hours,weight\n0,90,1,1000\n270,45,0.5,800\n90,-5,1,0\n";

fn with_scene() -> (Folder, PathBuf, PathBuf) {
    with_suns(SUNS)
}

/// Writes the scene and a list of suns.
pub(super) fn with_suns(listed: &str) -> (Folder, PathBuf, PathBuf) {
    let folder = Folder::new();
    let (scene, suns) = (folder.path("a.obj"), folder.path("s.csv"));
    fs::write(&scene, SCENE).unwrap();
    fs::write(&suns, listed).unwrap();
    (folder, scene, suns)
}

fn study(folder: &Folder, arguments: &[&str]) -> (Study, String) {
    let path = folder.path("out.npz");
    let output = antumbra(&[&["sun"], arguments, &["-o", text(&path)]].concat());
    assert_code(&output, 0);
    (read_npz(&path).unwrap(), stdout(&output))
}

#[test]
fn a_plate_hides_the_zenith_from_the_half_below_it() {
    let (folder, scene, suns) = with_scene();
    let arguments = [
        text(&scene),
        "--up",
        "z",
        "--sensors",
        "grid:0.5",
        "--on",
        "floor",
        "--suns",
        text(&suns),
    ];
    let (study, said) = study(&folder, &arguments);
    assert!(
        said.starts_with("16 sensors, 2 suns (1 below the horizon left out)\n"),
        "{said}"
    );
    let numbers = sums(&study);
    let (hours, energy) = (numbers.hours.unwrap(), numbers.irradiation.unwrap());
    for (sensor, &[x, _, z]) in study.points.iter().enumerate() {
        assert_eq!(z, 0.0);
        // The zenith is hidden under the plate; the low sun comes in from the west beside it, up to half a unit deep, and
        // reaches what lies half a unit east of the plate.
        let (zenith, west) = (x > 0.0, !(-0.5..0.5).contains(&x));
        let expected = f64::from(u8::from(zenith)) + 0.5 * f64::from(u8::from(west));
        assert_eq!(hours[sensor], expected, "{x}");
        let cosine = 0.5_f64.sqrt();
        let expected = f64::from(u8::from(zenith)) + 0.4 * cosine * f64::from(u8::from(west));
        assert!(
            (energy[sensor] - expected).abs() < 1e-12,
            "{x}: {}",
            energy[sensor]
        );
    }
    assert!(
        said.contains("hours of sun: mean by area 0.750, from 0.000 to 1.500"),
        "{said}"
    );
}

#[test]
fn north_turns_the_suns_and_not_the_scene() {
    let (folder, scene, suns) = with_scene();
    let hours = |north: &str| {
        let arguments = [
            text(&scene),
            "--up",
            "z",
            "--sensors",
            "grid:0.5",
            "--on",
            "floor",
            "--suns",
            text(&suns),
            "--north",
            north,
        ];
        sums(&study(&folder, &arguments).0).hours.unwrap()
    };
    let plain = hours("0");
    assert_eq!(hours("360"), plain);
    // True north is the scene's -y: the sun of the west is in the scene's east, which the plate leaves free.
    let turned = hours("180");
    assert_ne!(turned, plain);
    assert_eq!(turned.iter().sum::<f64>(), 8.0 + 0.5 * 12.0);
}

#[test]
fn a_year_of_suns_has_the_same_bytes_for_any_number_of_threads() {
    let (folder, scene, _) = with_scene();
    let bytes = |threads: &str| {
        let arguments = [
            text(&scene),
            "--up",
            "z",
            "--sensors",
            "grid:0.25",
            "--both-sides",
            "--latitude",
            "48",
            "--longitude",
            "11.5",
            "--timezone",
            "1",
            "--year",
            "2024",
            "--threads",
            threads,
        ];
        let (study, said) = study(&folder, &arguments);
        assert_eq!(study.suns.len() + study.about.below_horizon, 8784);
        assert!(said.starts_with("192 sensors, "), "{said}");
        fs::read(folder.path("out.npz")).unwrap()
    };
    assert_eq!(bytes("1"), bytes("3"));
}

#[test]
fn points_of_a_file_lie_on_surfaces_where_that_is_said() {
    let (folder, scene, suns) = with_scene();
    let points = folder.path("p.csv");
    fs::write(&points, "x,y,z\n0.5,0.5,0\n-0.2,0,0\n").unwrap();
    let arguments = [
        text(&scene),
        "--up",
        "z",
        "--points",
        text(&points),
        "--suns",
        text(&suns),
    ];
    let (on, _) = study(&folder, &[&arguments[..], &["--on-surface"]].concat());
    assert_eq!(on.surfaces.as_ref().unwrap().len(), 2);
    assert_eq!(on.normals.as_ref().unwrap()[0], [0.0, 0.0, 1.0]);
    assert_eq!(sums(&on).hours.unwrap(), [1.5, 0.0]);
    // Points of space see all directions, and have no cosine.
    let (free, _) = study(&folder, &arguments);
    assert_eq!(
        (free.normals.is_none(), sums(&free).irradiation),
        (true, None)
    );
    assert_eq!(sums(&free).hours.unwrap(), [1.5, 0.0]);
    let array = folder.path("p.npy");
    fs::write(&array, npy(&[[0.5, 0.5, 0.0], [-0.2, 0.0, 0.0]])).unwrap();
    let normals = folder.path("n.npy");
    fs::write(&normals, npy(&[[0.0, 0.0, -1.0], [0.0, 0.0, 2.0]])).unwrap();
    let arguments = [
        text(&scene),
        "--up",
        "z",
        "--points",
        text(&array),
        "--normals",
        text(&normals),
        "--suns",
        text(&suns),
        "--on-surface",
    ];
    let (facing, _) = study(&folder, &arguments);
    assert_eq!(sums(&facing).hours.unwrap(), [0.0, 0.0]);
}

#[test]
fn other_weather_gives_the_sums_of_a_study_that_began_with_it() {
    let (folder, scene, _) = with_scene();
    let head = "place X\nlatitude 48\nlongitude -11.5\ntime_zone -15\nsite_elevation 500\nweather_data_file_units 1\n";
    let weather = |name: &str, direct: fn(u32) -> u32| {
        let hours = (0..72_u32)
            .map(|hour| format!("6 {} {}.5 {} 90\n", 20 + hour / 24, hour % 24, direct(hour)));
        let path = folder.path(name);
        fs::write(&path, head.to_owned() + &hours.collect::<String>()).unwrap();
        path
    };
    let one = weather("one.wea", |hour| hour * 10);
    let other = weather("other.wea", |hour| 900 - hour * 9);
    let of = |wea: &PathBuf, name: &str| {
        let path = folder.path(name);
        let output = antumbra(&[
            "sun",
            text(&scene),
            "--up",
            "z",
            "--sensors",
            "grid:0.5",
            "--wea",
            text(wea),
            "--year",
            "2023",
            "-o",
            text(&path),
        ]);
        assert_code(&output, 0);
        path
    };
    let first = of(&one, "first.npz");
    let expected = of(&other, "expected.csv");
    let again = folder.path("again.csv");
    let output = antumbra(&[
        "sun",
        "--from",
        text(&first),
        "--wea",
        text(&other),
        "-o",
        text(&again),
    ]);
    assert_code(&output, 0);
    assert_eq!(fs::read(&again).unwrap(), fs::read(&expected).unwrap());
    // Without weather, a study is written in another format as it is.
    let copy = folder.path("copy.npz");
    assert_code(
        &antumbra(&["sun", "--from", text(&first), "-o", text(&copy)]),
        0,
    );
    assert_eq!(fs::read(&copy).unwrap(), fs::read(&first).unwrap());
}

#[test]
fn every_format_is_written_and_skies_have_view_factors() {
    let (folder, scene, _) = with_scene();
    for name in ["a.npz", "a.csv", "a.nc", "a.zarr", "a.zarr"] {
        let output = antumbra(&[
            "sun",
            text(&scene),
            "--up",
            "z",
            "--sensors",
            "grid:1",
            "--sky",
            "tregenza",
            "-o",
            text(&folder.path(name)),
        ]);
        assert_code(&output, 0);
        assert!(
            stdout(&output).contains("145 patches of the sky"),
            "{}",
            stdout(&output)
        );
        assert!(stdout(&output).contains("sky view factor: mean by area 0."));
        assert!(folder.path(name).exists());
    }
}

#[test]
fn what_cannot_be_used_ends_with_2_and_says_what_was_expected() {
    let (folder, scene, suns) = with_scene();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path(name);
        fs::write(&path, bytes).unwrap();
        text(&path).to_owned()
    };
    let nan = file("nan.npy", &npy(&[[0.0; 3], [0.0, f64::NAN, 0.0]]));
    let far = file("far.csv", b"x,y,z\n0,0,9\n");
    let empty = file("empty.csv", b"x,y,z\n");
    let night = file("night.csv", b"azimuth,elevation\n1,-1\n2,0\n");
    let cut = file("cut.npz", b"PK\x05\x06");
    let foreign = folder.path("mine.zarr");
    fs::create_dir(&foreign).unwrap();
    let (scene, suns) = (text(&scene), text(&suns));
    let place = [
        "--latitude",
        "80",
        "--longitude",
        "20",
        "--timezone",
        "1",
        "--year",
        "2023",
    ];
    let winter = [&["--sensors", "grid:1"], &place[..], &["--dates", "12-21"]].concat();
    let odd = [&["--sensors", "grid:1"], &place[..], &["--step", "7"]].concat();
    let output = folder.path("o.npz");
    let output = text(&output);
    let cases: [(&[&str], &str); 18] = [
        (&["--suns", suns], "no sensors are given"),
        (&["--sensors", "grid:1"], "no suns are given"),
        (
            &["--sensors", "grid:0"],
            "expected grid:SPACING with a number above 0",
        ),
        (
            &["--sensors", "grid:1e-9", "--suns", suns],
            "sensors, more than",
        ),
        (
            &["--sensors", "grid:1", "--suns", suns, "--on", "roof"],
            "no object and no material is called `roof`",
        ),
        (&["--sensors", "grid:1", "--latitude", "48"], "--longitude"),
        (
            &["--sensors", "grid:1", "--epw", suns, "--step", "10"],
            "cannot be used with",
        ),
        (
            &["--sensors", "grid:1", "--epw", suns],
            "s.csv:2: expected a line `DATA PERIODS` before the rows",
        ),
        (
            &["--sensors", "grid:1", "--sky", "cie"],
            "expected tregenza or reinhart:N",
        ),
        (
            &["--sensors", "grid:1", "--suns", &night],
            "no sun stands above the horizon at any of 2 times",
        ),
        (
            &winter,
            "no sun stands above the horizon at any of 24 times, at latitude 80",
        ),
        (&odd, "the step is 7 minutes: expected a divisor of 1440"),
        (
            &["--points", &nan, "--suns", suns],
            "point 1 (rows are counted from 0) is (0, NaN, 0)",
        ),
        (
            &["--points", &far, "--suns", suns, "--on-surface"],
            "point 0 (rows are counted from 0) lies on no surface",
        ),
        (&["--points", &empty, "--suns", suns], "it has no points"),
        (
            &["--points", &nan, "--sensors", "grid:1", "--suns", suns],
            "cannot be used with",
        ),
        (
            &["--sensors", "grid:1", "--suns", suns, "-o", "a.txt"],
            "ends like nothing that --output can write",
        ),
        (
            &["--sensors", "grid:1", "--suns", suns, "-o", text(&foreign)],
            "something is there that is no sun study",
        ),
    ];
    for (arguments, expected) in cases {
        let mut all = [&["sun", scene, "--up", "z"], arguments].concat();
        if !arguments.contains(&"-o") {
            all.extend(["-o", output]);
        }
        let ended = antumbra(&all);
        assert_code(&ended, 2);
        let said = stderr(&ended)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert!(said.contains(expected), "{arguments:?}: {said}");
    }
    let ended = antumbra(&["sun", "--from", &cut, "-o", output]);
    assert_code(&ended, 2);
    assert!(
        stderr(&ended).contains("it is no study"),
        "{}",
        stderr(&ended)
    );
    assert!(!folder.path("o.npz").exists() && !folder.path("o.npz.parts").exists());
}
