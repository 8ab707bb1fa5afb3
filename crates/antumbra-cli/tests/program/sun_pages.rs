//! `antumbra sun`: pictures and reports.

use std::fs;
use std::path::{Path, PathBuf};

use antumbra_render::color_map::inferno_srgb;

use super::support::{Folder, antumbra, assert_code, stderr, text};

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
const SUNS: &str = "azimuth,elevation,hours\n0,90,1\n270,45,0.5\n90,-5,1\n";

/// Straight down.
const CAMERA: &str = "eye:0,0,5/at:0,0,0/up:0,1,0/fov:26";

fn with_scene() -> (Folder, PathBuf, PathBuf) {
    let folder = Folder::new();
    let (scene, suns) = (folder.path("a.obj"), folder.path("s.csv"));
    fs::write(&scene, SCENE).unwrap();
    fs::write(&suns, SUNS).unwrap();
    (folder, scene, suns)
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
