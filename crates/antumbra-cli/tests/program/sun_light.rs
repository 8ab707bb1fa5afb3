//! `antumbra sun`: suns with a size, glass, the light of the sky, and what blocks suns.

use std::fs;
use std::path::PathBuf;

use antumbra_sun::{Study, read_npz, sums};

use super::support::{Folder, antumbra, assert_code, stderr, stdout, text};

/// A floor, with a plate above its western half and a pane of red glass above its eastern half.
const SCENE: &str = "\
mtllib a.mtl
o floor
usemtl stone
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
f 1 2 3 4
o plate
v -9 -9 0.5
v 0 -9 0.5
v 0 9 0.5
v -9 9 0.5
f 5 6 7 8
o pane
usemtl glass
v 0.5 -9 0.5
v 9 -9 0.5
v 9 9 0.5
v 0.5 9 0.5
f 9 10 11 12
";

const MATERIALS: &str = "newmtl stone\nKd 1 1 1\nnewmtl glass\nKd 0 0 0\nd 0.5\n";

struct Place {
    folder: Folder,
    scene: PathBuf,
    points: PathBuf,
    suns: PathBuf,
}

/// Sensors on the floor: below the plate, below its edge, in the open, below the pane.
fn place() -> Place {
    let folder = Folder::new();
    let write = |name: &str, text: &str| {
        let path = folder.path(name);
        fs::write(&path, text).unwrap();
        path
    };
    let scene = write("a.obj", SCENE);
    write("a.mtl", MATERIALS);
    let points = write("p.csv", "x,y,z\n-0.5,0,0\n0,0,0\n0.25,0,0\n0.75,0,0\n");
    let suns = write("s.csv", "azimuth,elevation,hours,weight\n0,90,2,1000\n");
    Place {
        folder,
        scene,
        points,
        suns,
    }
}

impl Place {
    fn arguments<'a>(&'a self, more: &[&'a str]) -> Vec<&'a str> {
        let own = [
            "sun",
            text(&self.scene),
            "--up",
            "z",
            "--points",
            text(&self.points),
        ];
        [&own[..], &["--on-surface"], more].concat()
    }

    fn study(&self, more: &[&str]) -> (Study, String) {
        let path = self.folder.path("out.npz");
        let arguments = self.arguments(more);
        let output = antumbra(&[&arguments[..], &["-o", text(&path)]].concat());
        assert_code(&output, 0);
        (read_npz(&path).unwrap(), stdout(&output) + &stderr(&output))
    }

    fn refusal(&self, arguments: &[&str]) -> String {
        let ended = antumbra(arguments);
        assert_code(&ended, 2);
        let said = stderr(&ended);
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

#[test]
fn glass_and_the_disc_of_the_sun_count_in_hours_where_that_is_said() {
    let place = place();
    let hours = |more: &[&str]| {
        let suns = ["--suns", text(&place.suns)];
        let (study, _) = place.study(&[&suns[..], more].concat());
        sums(&study).hours.unwrap()
    };
    assert_eq!(hours(&[])[2..], [2.0, 2.0]);
    assert_eq!(hours(&["--through-glass"])[2..], [2.0, 1.0]);
    let with_size = hours(&["--sun-diameter", "0.533"]);
    assert_eq!(with_size[0], 0.0);
    assert!((with_size[1] - 1.0).abs() < 1e-5, "{with_size:?}");
    assert_eq!(with_size[2..], [2.0, 2.0]);
    let both = hours(&["--sun-diameter", "0.533", "--through-glass"]);
    assert_eq!(both[3], 1.0);
    assert!((both[1] - 1.0).abs() < 1e-5, "{both:?}");
}

#[test]
fn glass_is_looked_for_in_vain_where_there_is_none() {
    let place = place();
    fs::write(
        place.folder.path("a.mtl"),
        MATERIALS.replace("d 0.5", "d 1"),
    )
    .unwrap();
    let (study, said) = place.study(&["--suns", text(&place.suns), "--through-glass"]);
    assert!(
        said.contains("no surface of the scene lets light through"),
        "{said}"
    );
    assert_eq!(sums(&study).hours.unwrap()[3], 0.0);
}

#[test]
fn a_table_names_what_blocks_the_sun() {
    let place = place();
    let table = place.folder.path("b.csv");
    place.study(&["--suns", text(&place.suns), "--blockers", text(&table)]);
    // Two hours of 1000 W/m2. Glass blocks nothing.
    let found = fs::read_to_string(&table).unwrap();
    let head = "sensor,blocker,hours,irradiation_kwh_m2\n0,plate,2,2\n";
    assert!(
        found.starts_with(head) && !found.contains("pane"),
        "{found}"
    );
    // Without weather there is no energy.
    fs::write(&place.suns, "azimuth,elevation,hours\n0,90,2\n").unwrap();
    place.study(&["--suns", text(&place.suns), "--blockers", text(&table)]);
    let found = fs::read_to_string(&table).unwrap();
    assert!(
        found.starts_with("sensor,blocker,hours\n0,plate,2\n"),
        "{found}"
    );
}

/// Two days of weather: direct normal and diffuse horizontal irradiance of an hour.
fn weather(folder: &Folder, name: &str, direct: u32, diffuse: u32) -> PathBuf {
    let head = "place X\nlatitude 48\nlongitude -11.5\ntime_zone -15\nsite_elevation 500\nweather_data_file_units 1\n";
    let hours = (0..48_u32)
        .map(|hour| format!("6 {} {}.5 {direct} {diffuse}\n", 20 + hour / 24, hour % 24));
    let path = folder.path(name);
    fs::write(&path, head.to_owned() + &hours.collect::<String>()).unwrap();
    path
}

#[test]
fn open_ground_gets_the_diffuse_light_of_all_rows() {
    let place = place();
    let wea = weather(&place.folder, "a.wea", 0, 250);
    let points = place.folder.path("open.csv");
    // High above all; the second looks south.
    fs::write(&points, "x,y,z,nx,ny,nz\n0,0,9,0,0,1\n0,0,9,0,-1,0\n").unwrap();
    let path = place.folder.path("out.npz");
    let scene = [
        "sun",
        text(&place.scene),
        "--up",
        "z",
        "--points",
        text(&points),
    ];
    let days = ["--wea", text(&wea), "--diffuse", "-o", text(&path)];
    let output = antumbra(&[&scene[..], &days].concat());
    assert_code(&output, 0);
    let study = read_npz(&path).unwrap();
    let found = sums(&study);
    let (diffuse, total) = (found.diffuse.unwrap(), found.total.unwrap());
    // 48 hours, nights included: what weather says counts.
    assert_eq!(diffuse[0], 12.0);
    assert!((diffuse[1] - 6.0).abs() < 0.02, "{diffuse:?}");
    assert_eq!(total, diffuse);
    assert!(
        stdout(&output).contains("diffuse irradiation, kWh/m2: mean"),
        "{}",
        stdout(&output)
    );
    // One day of them.
    let output = antumbra(&[&scene[..], &days, &["--dates", "06-21"]].concat());
    assert_code(&output, 0);
    assert_eq!(sums(&read_npz(&path).unwrap()).diffuse.unwrap()[0], 6.0);
    // The same view factors under another sky, of the same day.
    let other = weather(&place.folder, "b.wea", 0, 500);
    let again = place.folder.path("again.npz");
    let from = ["sun", "--from", text(&path), "--wea", text(&other)];
    let output = antumbra(&[&from[..], &["-o", text(&again)]].concat());
    assert_code(&output, 0);
    assert_eq!(sums(&read_npz(&again).unwrap()).diffuse.unwrap()[0], 12.0);
}

#[test]
fn a_report_says_what_counts() {
    let place = place();
    let wea = weather(&place.folder, "a.wea", 300, 100);
    let folder = place.folder.path("report");
    place.study(&[
        "--wea",
        text(&wea),
        "--diffuse",
        "--through-glass",
        "--sun-diameter",
        "0.533",
        "--report",
        text(&folder),
        "--size",
        "300x200",
    ]);
    let page = fs::read_to_string(folder.join("index.html")).unwrap();
    for due in [
        "diffuse kWh/m2, mean",
        "0.533 degrees",
        "isotropic, 4.800 kWh/m2 on open level ground",
        "filter light",
    ] {
        assert!(page.contains(due), "{due}");
    }
}

#[test]
fn light_that_cannot_be_is_refused() {
    let place = place();
    let suns = text(&place.suns);
    let path = place.folder.path("o.npz");
    let output = ["-o", text(&path)];
    for (more, expected) in [
        (
            &["--suns", suns, "--sun-diameter", "0"][..],
            "expected degrees above 0 and at most 10",
        ),
        (
            &["--suns", suns, "--sun-diameter", "10.5"],
            "expected degrees above 0 and at most 10",
        ),
        (
            &["--suns", suns, "--sun-diameter", "-0.5"],
            "expected degrees above 0 and at most 10",
        ),
        (
            &["--sky", "tregenza", "--sun-diameter", "0.5"],
            "cannot be used with",
        ),
        (&["--suns", suns, "--diffuse"], "cannot be used with"),
        (
            &[
                "--latitude",
                "48",
                "--longitude",
                "11",
                "--timezone",
                "1",
                "--year",
                "2023",
                "--diffuse",
            ],
            "--diffuse: no weather is given",
        ),
        (
            &["--sky", "tregenza", "--blockers", "b.csv"],
            "cannot be used with",
        ),
        (
            &["--suns", suns, "--blockers", "b.txt"],
            "ends like nothing that --blockers can write",
        ),
        (
            &["--suns", suns, "--blockers", suns],
            "would overwrite a file that is read",
        ),
    ] {
        let said = place.refusal(&[&place.arguments(more)[..], &output].concat());
        assert!(said.contains(expected), "{more:?}: {said}");
    }
    let wea = weather(&place.folder, "a.wea", 0, 250);
    let free = [
        "sun",
        text(&place.scene),
        "--up",
        "z",
        "--points",
        text(&place.points),
    ];
    let said = place.refusal(&[&free[..], &["--wea", text(&wea), "--diffuse"], &output].concat());
    assert!(
        said.contains("--diffuse: sensors that see all directions"),
        "{said}"
    );
    assert!(!path.exists());
}
