//! `antumbra sun`: pictures and reports.

use std::fs;
use std::path::{Path, PathBuf};

use antumbra_render::color_map::inferno_srgb;

use super::sun::with_suns;
use super::support::{Folder, antumbra, assert_code, stderr, text};

/// The zenith, and a sun in the west at 45 degrees.
const SUNS: &str = "azimuth,elevation,hours\n0,90,1\n270,45,0.5\n90,-5,1\n";

/// Straight down.
const CAMERA: &str = "eye:0,0,5/at:0,0,0/up:0,1,0/fov:26";

fn with_scene() -> (Folder, PathBuf, PathBuf) {
    with_suns(SUNS)
}

/// Size of a picture, and its bytes, RGB.
fn pixels(path: &Path) -> ([usize; 2], Vec<u8>) {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    ([info.width, info.height].map(|n| n as usize), bytes)
}

#[test]
fn a_picture_has_the_colors_of_its_hours() {
    let (folder, scene, suns) = with_scene();
    let [picture, output] = ["p.png", "o.csv"].map(|name| folder.path(name));
    let arguments = [
        "sun",
        text(&scene),
        "--up",
        "z",
        "--sensors",
        "grid:0.5",
        "--on",
        "floor",
        "--suns",
        text(&suns),
        "-o",
        text(&output),
        "--picture",
        text(&picture),
        "--size",
        "276x200",
        "--camera",
        CAMERA,
    ];
    assert_code(&antumbra(&arguments), 0);
    let (size, bytes) = pixels(&picture);
    assert_eq!(size, [276, 200]);
    let at = |column: usize, row: usize| {
        let first = 3 * (row * size[0] + column);
        bytes[first..first + 3]
            .iter()
            .fold(0, |all, &byte| all << 8 | u32::from(byte))
    };
    // 200 pixels show about 2.3 units. The plate has no sensors, and hides those below it.
    assert_eq!((at(2, 2), at(40, 100)), (0xff_ffff, 0xaa_aaaa));
    assert_eq!(at(120, 100), inferno_srgb(1.0 / 1.5));
    assert_eq!(at(170, 100), inferno_srgb(1.0));
}

#[test]
fn a_picture_that_cannot_be_made_is_refused_before_anything_is_written() {
    let (folder, scene, suns) = with_scene();
    let points = folder.path("p.csv");
    fs::write(&points, "x,y,z\n0.5,0.5,0\n").unwrap();
    let [picture, output] = ["p.png", "o.csv"].map(|name| folder.path(name));
    let base = [
        "sun",
        text(&scene),
        "--up",
        "z",
        "--suns",
        text(&suns),
        "-o",
        text(&output),
    ];
    let refused = |more: &[&str], why: &str| {
        let found = antumbra(&[&base[..], more].concat());
        assert_code(&found, 2);
        assert!(stderr(&found).contains(why), "{}", stderr(&found));
        assert!(!output.exists() && !picture.exists());
    };
    let path = text(&picture);
    refused(
        &["--points", text(&points), "--picture", path],
        "points of space",
    );
    let grid = ["--sensors", "grid:0.5"];
    let with = |more: &[&'static str]| [&grid[..], &["--picture", path], more].concat();
    refused(&with(&["--size", "100x100"]), "no room for a legend");
    refused(
        &[&grid[..], &["--picture", "p.jpg"]].concat(),
        "ends like nothing",
    );
    refused(&[&grid[..], &["--size", "300x200"]].concat(), "--picture");
}

/// Returns what is between the first `begin` and the `end` behind it.
fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
    let behind = text
        .split_once(begin)
        .unwrap_or_else(|| panic!("{begin}"))
        .1;
    behind.split_once(end).unwrap().0
}

#[test]
fn a_report_is_one_file_with_totals_plots_and_settings() {
    let (folder, scene, _) = with_scene();
    let [output, report] = ["o.npz", "report"].map(|name| folder.path(name));
    let arguments = [
        "sun",
        text(&scene),
        "--up",
        "z",
        "--sensors",
        "grid:0.5",
        "--latitude",
        "48",
        "--longitude",
        "11.5",
        "--timezone",
        "1",
        "--year",
        "2023",
        "-o",
        text(&output),
        "--report",
        text(&report),
        "--size",
        "300x200",
    ];
    assert_code(&antumbra(&arguments), 0);
    let page = fs::read_to_string(report.join("index.html")).unwrap();
    assert_eq!(fs::read_dir(&report).unwrap().count(), 1);
    for outside in ["http:", "https:", "<script", "src=\"/", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("src=\"data:image/png;base64,iVBOR"));
    // The plate lies in the open: its row says the same thrice. Half of the floor is below it.
    let sums = antumbra_sun::sums(&antumbra_sun::read_npz(&output).unwrap());
    let hours = sums.hours.unwrap();
    let rows = between(&page, "<tbody>", "</tbody>");
    assert!(
        rows.starts_with("<tr><td>floor</td><td>16</td><td>4.00</td>"),
        "{rows}"
    );
    let most = hours.iter().copied().fold(0.0, f64::max);
    let plate = format!(
        "<tr><td>plate</td><td>8</td><td>2.00</td>{}</tr>",
        format!("<td>{most:.3}</td>").repeat(3)
    );
    assert!(rows.contains(&plate), "{rows}");
    let mean = hours[..16].iter().sum::<f64>() / 16.0;
    assert!(
        rows.contains(&format!("<td>{mean:.3}</td>")),
        "{mean}: {rows}"
    );
    for day in ["2023-03-20", "2023-06-21", "2023-12-21"] {
        assert!(page.contains(day), "{day}");
    }
    let lines: Vec<_> = page
        .split("<polyline")
        .skip(1)
        .map(|line| between(line, "points=\"", "\""))
        .collect();
    // Hours of sun: about 12, 16 and 8.
    let counts: Vec<_> = lines.iter().map(|line| line.split(' ').count()).collect();
    assert_eq!(counts, [12, 16, 8]);
    assert_eq!(page.matches("<rect").count(), 24);
    assert!(
        page.contains("<th>suns below the horizon</th><td>4"),
        "{page}"
    );

    // A study of bits that are there has a page, too; without a scene it has no picture.
    let [other, table] = ["other", "o.csv"].map(|name| folder.path(name));
    let arguments = [
        "sun",
        "--from",
        text(&output),
        "-o",
        text(&table),
        "--report",
        text(&other),
    ];
    assert_code(&antumbra(&arguments), 0);
    let page = fs::read_to_string(other.join("index.html")).unwrap();
    assert!(
        !page.contains("<img") && page.contains("<td>all</td><td>24</td>"),
        "{page}"
    );
}

#[test]
fn a_page_of_somebody_else_is_not_replaced() {
    let (folder, scene, suns) = with_scene();
    let [report, table] = ["report", "o.csv"].map(|name| folder.path(name));
    fs::create_dir(&report).unwrap();
    fs::write(report.join("index.html"), "my page").unwrap();
    let arguments = [
        "sun",
        text(&scene),
        "--up",
        "z",
        "--sensors",
        "grid:0.5",
        "--suns",
        text(&suns),
        "-o",
        text(&table),
        "--report",
        text(&report),
    ];
    let refused = antumbra(&arguments);
    assert_code(&refused, 2);
    assert!(
        stderr(&refused).contains("did not write"),
        "{}",
        stderr(&refused)
    );
    assert_eq!(
        fs::read_to_string(report.join("index.html")).unwrap(),
        "my page"
    );
}

#[test]
fn energyplus_has_a_column_for_each_object() {
    let (folder, scene, suns) = with_scene();
    let table = folder.path("shading.csv");
    let base = ["sun", text(&scene), "--up", "z", "--layout", "energyplus"];
    let place = [
        "--latitude",
        "48",
        "--longitude",
        "11.5",
        "--timezone",
        "1",
        "--year",
        "2023",
    ];
    let grid = ["--sensors", "grid:0.5", "-o", text(&table)];
    assert_code(&antumbra(&[&base[..], &place, &grid].concat()), 0);
    let rows = fs::read_to_string(&table).unwrap();
    assert!(rows.starts_with("Surface Name,floor,plate\n01/01 01:00,0,0\n"));
    assert_eq!(rows.lines().count(), 1 + 8760);
    // At noon in June the plate is in the sun, and part of the floor is not.
    let noon = between(&rows, "06/21 12:00,", "\n");
    let (floor, plate) = noon.split_once(',').unwrap();
    let floor: f64 = floor.parse().unwrap();
    assert_eq!(plate, "1.00000000");
    assert!(floor > 0.4 && floor < 0.9, "{floor}");

    fs::remove_file(&table).unwrap();
    let refused = |more: &[&str], why: &str| {
        let found = antumbra(&[&base[..], more].concat());
        assert_code(&found, 2);
        assert!(stderr(&found).contains(why), "{}", stderr(&found));
        assert!(!table.exists());
    };
    refused(
        &[&["--suns", text(&suns)], &grid[..]].concat(),
        "equal steps",
    );
    let npz = folder.path("o.npz");
    refused(
        &[&place[..], &["--sensors", "grid:1", "-o", text(&npz)]].concat(),
        "CSV",
    );
}
