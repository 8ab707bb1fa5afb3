//! `antumbra query`: arrays in, arrays out.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::{Folder, antumbra, assert_code, stderr, stdout, text};

/// A square floor with a ball over it, under two lamps that NFF calls `light 1` and `light 2`.
const SCENE: &str = "\
l 0 0 9
l 40 0 9
f 0.8 0.7 0.6 0.9 0 1 0 0
p 4
-4 -4 0
4 -4 0
4 4 0
-4 4 0
s 0 0 2 1
";

const POINTS: [[f64; 3]; 9] = [
    // On the floor, under the ball and beside it.
    [0.0, 0.1, 0.0],
    [3.0, 0.1, 0.0],
    // On top of the ball.
    [0.0, 0.0, 3.0],
    // Under the floor, which ends before the line to the far lamp.
    [0.5, 0.5, -1.0],
    [0.0, 0.0, 8.0],
    [-2.0, 0.0, 0.0],
    // The far lamp is behind the ball.
    [-9.0, 0.0, 0.0],
    // At the ball's bottom: both lines enter it.
    [0.0, 0.0, 1.0],
    [-1.0, 0.1, 0.5],
];

/// The bytes of an array, as `numpy.save` writes them.
fn npy(descr: &str, is_fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if is_fortran { "True" } else { "False" };
    let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    let padding = 64 - (10 + header.len() + 1) % 64;
    let length = (header.len() + padding + 1) as u16;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(std::iter::repeat_n(b' ', padding));
    bytes.push(b'\n');
    bytes.extend(data);
    bytes
}

pub(crate) fn doubles(numbers: &[[f64; 3]]) -> Vec<u8> {
    let data: Vec<u8> = numbers
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    npy("<f8", false, &format!("({}, 3)", numbers.len()), &data)
}

fn floats(numbers: &[[f64; 3]]) -> Vec<u8> {
    let narrow = |x: &f64| (*x as f32).to_le_bytes();
    let data: Vec<u8> = numbers.iter().flatten().flat_map(narrow).collect();
    npy("<f4", false, &format!("({}, 3)", numbers.len()), &data)
}

fn big_endian(numbers: &[[f64; 3]]) -> Vec<u8> {
    let data: Vec<u8> = numbers
        .iter()
        .flatten()
        .flat_map(|x| x.to_be_bytes())
        .collect();
    npy(">f8", false, &format!("({}, 3)", numbers.len()), &data)
}

/// A folder with the scene and the points.
struct Bench {
    folder: Folder,
    scene: PathBuf,
    points: PathBuf,
    out: PathBuf,
}

impl Bench {
    fn new() -> Self {
        Self::with(&doubles(&POINTS))
    }

    fn with(points: &[u8]) -> Self {
        let folder = Folder::new();
        let bench = Self {
            scene: folder.path("scene.nff"),
            points: folder.path("points.npy"),
            out: folder.path("out.npy"),
            folder,
        };
        fs::write(&bench.scene, SCENE).unwrap();
        fs::write(&bench.points, points).unwrap();
        bench
    }

    fn run(&self, more: &[&str]) -> Output {
        let (scene, points, out) = (text(&self.scene), text(&self.points), text(&self.out));
        let arguments = ["query", scene, "--points", points, "-o", out];
        antumbra(&[&arguments[..], more].concat())
    }

    /// Runs and returns the bytes behind the header, which must be for `shape`.
    fn answers(&self, more: &[&str], shape: &str) -> Vec<u8> {
        self.array(more, "|u1", shape)
    }

    /// Runs and returns shares.
    fn shares(&self, more: &[&str], shape: &str) -> Vec<f32> {
        let bytes = self.array(more, "<f4", shape);
        let numbers = bytes.chunks_exact(4);
        numbers
            .map(|x| f32::from_le_bytes(x.try_into().unwrap()))
            .collect()
    }

    fn array(&self, more: &[&str], descr: &str, shape: &str) -> Vec<u8> {
        let output = self.run(more);
        assert_code(&output, 0);
        let bytes = fs::read(&self.out).unwrap();
        let (header, data) = bytes.split_at(128.min(bytes.len()));
        let header = String::from_utf8_lossy(header);
        let expected =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
        // npyz puts a space behind every comma.
        let spaceless = |text: &str| text.replace(' ', "");
        assert!(
            spaceless(&header).contains(&spaceless(&expected)),
            "{header}, not {expected}"
        );
        assert!(header.ends_with('\n'));
        data.to_vec()
    }

    /// Runs and returns what is said of a refusal, which leaves no file.
    fn refusal(&self, more: &[&str]) -> String {
        let output = self.run(more);
        assert_code(&output, 2);
        assert!(!self.out.exists());
        stderr(&output)
    }

    fn file(&self, name: &str, bytes: &[u8]) -> String {
        let path = self.folder.path(name);
        fs::write(&path, bytes).unwrap();
        text(&path).to_owned()
    }
}

const FIRST: [u8; 9] = [1, 0, 0, 1, 0, 0, 0, 1, 1];
const SECOND: [u8; 9] = [0, 0, 0, 0, 0, 0, 1, 1, 0];

fn both() -> Vec<u8> {
    FIRST
        .iter()
        .zip(SECOND)
        .flat_map(|(&a, b)| [a, b])
        .collect()
}

#[test]
fn points_of_space_are_answered_for_every_light() {
    let bench = Bench::new();
    for method in ["voxel-1990", "voxel", "grid", "bvh", "naive"] {
        for threads in ["1", "3"] {
            let more = ["--shadows", method, "--threads", threads];
            assert_eq!(bench.answers(&more, "(9, 2,)"), both(), "{method}");
        }
    }
    let output = bench.run(&[]);
    assert_eq!(
        stdout(&output),
        "9 points, 2 lights: 6 of 18 queries in shadow\n"
    );
}

#[test]
fn lights_are_chosen_by_name_or_typed() {
    let bench = Bench::new();
    for name in ["light 1", "light-1"] {
        assert_eq!(bench.answers(&["--light", name], "(9,)"), FIRST);
    }
    assert_eq!(bench.answers(&["--light", "light 2"], "(9,)"), SECOND);
    let turned = ["--light", "light 2", "--light", "light-1"];
    let expected: Vec<u8> = both()
        .chunks(2)
        .flat_map(|pair| [pair[1], pair[0]])
        .collect();
    assert_eq!(bench.answers(&turned, "(9, 2,)"), expected);
    let twice = ["--light", "light 2", "--light", "light 2"];
    let expected: Vec<u8> = SECOND.iter().flat_map(|&x| [x, x]).collect();
    assert_eq!(bench.answers(&twice, "(9, 2,)"), expected);
    assert_eq!(bench.answers(&["--light", "point:0,0,9"], "(9,)"), FIRST);
    // Straight above.
    assert_eq!(bench.answers(&["--sun", "0,90"], "(9,)")[4], 0);

    fs::remove_file(&bench.out).unwrap();
    let unknown = bench.refusal(&["--light", "lamp"]);
    assert!(unknown.contains("is called `lamp`"), "{unknown}");
    assert!(unknown.contains("light-1, light-2"), "{unknown}");
    let mixed = bench.refusal(&["--light", "light 1", "--light", "point:0,0,9"]);
    assert!(mixed.contains("give names only"), "{mixed}");
}

#[test]
fn numbers_of_all_widths_mean_the_same() {
    for bytes in [doubles(&POINTS), floats(&POINTS), big_endian(&POINTS)] {
        // 0.1 is not the same in float32, but the answers are.
        assert_eq!(Bench::with(&bytes).answers(&[], "(9, 2,)"), both());
    }
}

#[test]
fn bits_are_packed_light_after_light() {
    let bench = Bench::new();
    let bits = |bytes: &[u8]| -> Vec<u8> {
        let byte = |eight: &[u8]| (0..).zip(eight).map(|(i, bit)| bit << i).sum();
        bytes.chunks(8).map(byte).collect()
    };
    let expected = [bits(&FIRST), bits(&SECOND)].concat();
    assert_eq!(bench.answers(&["--packed"], "(2, 2,)"), expected);
    let one = ["--packed", "--light", "light 1"];
    assert_eq!(bench.answers(&one, "(2,)"), bits(&FIRST));
}

#[test]
fn no_points_have_no_answers() {
    let bench = Bench::with(&doubles(&[]));
    assert!(bench.answers(&[], "(0, 2,)").is_empty());
    assert!(bench.answers(&["--packed"], "(2, 0,)").is_empty());
}

#[test]
fn normals_tell_what_faces_away() {
    let bench = Bench::new();
    // Both lamps are above all points.
    let down = bench.file("down.npy", &floats(&[[0.0, 0.0, -2.0]; 9]));
    assert_eq!(bench.answers(&["--normals", &down], "(9, 2,)"), [1; 18]);
    let up = bench.file("up.npy", &doubles(&[[0.0, 0.0, 0.5]; 9]));
    assert_eq!(bench.answers(&["--normals", &up], "(9, 2,)"), both());
    // The second lamp is on the side of +x of all of them.
    let right = bench.file("right.npy", &doubles(&[[1.0, 0.0, 0.0]; 9]));
    let right = ["--normals", &right, "--light", "light 2"];
    assert_eq!(bench.answers(&right, "(9,)"), SECOND);
    fs::remove_file(&bench.out).unwrap();
    let few = bench.file("few.npy", &doubles(&[[0.0, 0.0, 1.0]; 8]));
    let few = bench.refusal(&["--normals", &few]);
    assert!(few.contains("8 normals, but"), "{few}");
    assert!(few.contains("has 9 points"), "{few}");
    let mut bad = [[0.0, 0.0, 1.0]; 9];
    bad[5][1] = f64::NAN;
    let bad = bench.file("bad.npy", &doubles(&bad));
    let bad = bench.refusal(&["--normals", &bad]);
    assert!(bad.contains("bad.npy: normal 5 is"), "{bad}");
}

#[test]
fn points_on_surfaces_find_them() {
    let off = 1e-7;
    // Under the floor and inside the ball by rounding; where the ball touches nothing.
    let points = [
        [3.0, 0.1, -off],
        [0.0, 0.1, -off],
        [0.0, 0.0, 3.0 - off],
        [0.0, 0.0, 1.0 + off],
        [-4.0 - off, 1.0, off],
    ];
    let bench = Bench::with(&floats(&points));
    let light = ["--light", "light 1"];
    let free = bench.answers(&light, "(5,)");
    assert_eq!(
        free,
        [1, 1, 0, 1, 0],
        "as points of space they are in shadow, but for the one that rounds to the top of the ball"
    );
    let said = stderr(&bench.run(&light));
    assert!(
        said.contains("4 of 5 points looked at lie on surfaces"),
        "{said}"
    );
    assert!(said.contains("--on-surface"), "{said}");
    let on_surface = [&light[..], &["--on-surface"]].concat();
    assert_eq!(bench.answers(&on_surface, "(5,)"), [0, 1, 0, 1, 0]);
    // Surface queries do not ask for a side.
    let down = bench.file("down.npy", &doubles(&[[0.0, 0.0, -1.0]; 5]));
    let with_normals = [&on_surface[..], &["--normals", &down]].concat();
    assert_eq!(bench.answers(&with_normals, "(5,)"), [0, 1, 0, 1, 0]);
    fs::remove_file(&bench.out).unwrap();
    let strict = [&on_surface[..], &["--tolerance", "1e-9"]].concat();
    let strict = bench.refusal(&strict);
    assert!(strict.contains("points.npy: point 0 is"), "{strict}");
    assert!(strict.contains("away, more than 1e-9"), "{strict}");
    assert!(strict.contains("--tolerance"), "{strict}");
    // Doubles are not rounded so coarsely; singles are known by their file, not by their numbers.
    let fine = Bench::with(&doubles(&points));
    let said = fine.refusal(&on_surface);
    assert!(said.contains("points.npy: point 0 is"), "{said}");
    assert!(said.contains("float32"), "{said}");
    for bad in ["nan", "-1", "-inf", "1e999", "far"] {
        let said = fine.refusal(&[&on_surface[..], &["--tolerance", bad]].concat());
        assert!(
            said.contains("zero or more, or inf for any distance"),
            "{said}"
        );
    }
    let wide = [&on_surface[..], &["--tolerance", "1e-6"]].concat();
    assert_eq!(fine.answers(&wide, "(5,)"), [0, 1, 0, 1, 0]);
    assert!(!stderr(&fine.run(&wide)).contains("lie on surfaces"));
    // Any distance, by the word that Python has for it; digits too large for a number are a slip.
    let any = [&on_surface[..], &["--tolerance", "inf"]].concat();
    assert_eq!(fine.answers(&any, "(5,)"), [0, 1, 0, 1, 0]);
    let needless = bench.refusal(&["--tolerance", "1"]);
    assert!(needless.contains("--on-surface"), "{needless}");
}

#[test]
fn numbers_that_are_none_are_named() {
    for (bad, place) in [(f64::NAN, 7), (f64::INFINITY, 2), (1e31, 0)] {
        let mut points = POINTS;
        points[place][2] = bad;
        points[8][0] = f64::NAN;
        let said = Bench::with(&doubles(&points)).refusal(&[]);
        let expected = format!("points.npy: point {place} is");
        assert!(said.contains(&expected), "{said}");
    }
}

/// Whatever a file holds, it is refused with its name; none may take memory that it does not fill.
#[test]
fn files_that_are_no_points_are_refused() {
    let good = doubles(&POINTS);
    let mut long_header = b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec();
    long_header.extend([b' '; 100]);
    let with_header = |header: String| {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes
    };
    let nested = with_header("(".repeat(9000));
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (Vec::new(), "cannot read"),
        (b"s 0 0 0 1 and some more text\n".to_vec(), ".npy"),
        (good[..7].to_vec(), "cannot read"),
        (good[..60].to_vec(), "cannot read"),
        (good[..good.len() - 1].to_vec(), "9 points make a file of"),
        ([&good[..], b"x"].concat(), "9 points make a file of"),
        (long_header, "4294967295 bytes"),
        (nested, "longer than that of an array of points"),
        (with_header("{}".into()), "dict is missing key"),
        (with_header("]".into()), "cannot read"),
        (
            npy("<f8", false, "(9999999999999999, 3)", &[0; 24]),
            "9999999999999999 points make a file of",
        ),
        (
            npy("<f8", false, "(9223372036854775808, 3)", &[]),
            "longer than that",
        ),
        (npy("<f8", false, "(-1, 3)", &[]), "negative"),
        (
            npy("<f8", false, "(3,)", &[0; 24]),
            "expected shape (n, 3), found (3)",
        ),
        (npy("<f8", false, "(3, 2)", &[0; 48]), "found (3, 2)"),
        (npy("<f8", false, "(1, 3, 1)", &[0; 24]), "found (1, 3, 1)"),
        (npy("<f8", false, "()", &[0; 8]), "found ()"),
        (npy("<f8", true, "(2, 3)", &[0; 48]), "Fortran order"),
        (
            npy("<i8", false, "(1, 3)", &[0; 24]),
            "expected float32 or float64, found '<i8'",
        ),
        (npy("<f2", false, "(1, 3)", &[0; 6]), "found '<f2'"),
        (npy("<c16", false, "(1, 3)", &[0; 48]), "found '<c16'"),
        (npy("|O", false, "(1, 3)", &[0; 48]), "found '|O'"),
    ];
    for (bytes, expected) in cases {
        let bench = Bench::with(&bytes);
        let said = bench.refusal(&[]);
        assert!(said.contains(expected), "{said} lacks {expected}");
        assert!(said.contains("points.npy"), "{said}");
    }
    // A row is a row in either order.
    let row: Vec<u8> = POINTS[0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let bench = Bench::with(&npy("<f8", true, "(1, 3)", &row));
    assert_eq!(bench.answers(&[], "(1, 2,)"), [1, 0]);

    let missing = bench.folder.path("missing.npy");
    let output = antumbra(&[
        "query",
        text(&bench.scene),
        "--points",
        text(&missing),
        "-o",
        text(&bench.out),
    ]);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("missing.npy"));
}

#[test]
fn memory_for_points_is_limited() {
    let points = vec![[0.0, 0.0, 5.0]; 100_000];
    let bench = Bench::with(&doubles(&points));
    let said = bench.refusal(&["--memory-limit", "2MB"]);
    assert!(said.contains("points and answers 2.5 MiB"), "{said}");
    assert!(said.contains("fewer points at a time"), "{said}");
}

#[test]
fn answers_that_cannot_be_written_end_with_3_and_leave_nothing() {
    let bench = Bench::new();
    let nowhere = bench.folder.path("missing/out.npy");
    let output = antumbra(&[
        "query",
        text(&bench.scene),
        "--points",
        text(&bench.points),
        "-o",
        text(&nowhere),
    ]);
    assert_code(&output, 3);
    assert!(stderr(&output).contains("out.npy"));
    let is_partial = |path: &Path| path.to_string_lossy().contains("partial");
    let mut left = fs::read_dir(bench.folder.path("")).unwrap();
    assert!(!left.any(|entry| is_partial(&entry.unwrap().path())));
}

#[test]
fn lights_with_size_are_answered_by_visible_fractions() {
    // On the floor: under the middle of the ball, and far from it.
    let bench = Bench::with(&doubles(&[[0.0, 0.0, 0.0], [3.9, -3.9, 0.0]]));
    let lamp = ["--light", "area:0,0,9/0,1,0/1,0,0", "--on-surface"];
    let found = bench.shares(&lamp, "(2,)");
    assert_eq!(found, [0.0, 1.0]);
    // Beside a lamp without size, and exactly.
    let both = [&lamp[..], &["--light", "point:0,0,9", "--soft", "exact"]].concat();
    let found = bench.shares(&both, "(2, 2,)");
    // Columns: those without size first.
    assert_eq!(found, [0.0, 0.0, 1.0, 1.0]);
    let output = bench.run(&both);
    assert!(
        stdout(&output).contains("by samples, the others exact"),
        "{}",
        stdout(&output)
    );
    // The lamp is behind the floor.
    assert_eq!(
        bench.shares(&[&lamp[..], &["--side", "back"]].concat(), "(2,)"),
        [0.0, 0.0]
    );
    let sun = ["--sun", "0,90,0.5", "--on-surface"];
    assert_eq!(bench.shares(&sun, "(2,)"), [0.0, 1.0]);
    fs::remove_file(&bench.out).unwrap();
    let said = bench.refusal(&[&lamp[..], &["--packed"]].concat());
    assert!(said.contains("--packed writes bits"), "{said}");
}

#[test]
fn ambient_occlusion_and_sky_view_factors_are_answered_in_place_of_lights() {
    let bench = Bench::with(&doubles(&[[0.0, 0.0, 0.0], [3.9, -3.9, 0.0]]));
    let of = |more: &[&str]| bench.shares(&[&["--on-surface"], more].concat(), "(2,)");
    // The ball touches half of the half sphere's cosine: it fills 30 degrees around the normal.
    let open = of(&["--ambient-occlusion", "--directions", "4096"]);
    assert!((open[0] - 0.75).abs() < 0.01 && open[1] > 0.98, "{open:?}");
    assert_eq!(
        of(&["--ambient-occlusion", "--distance", "0.5"]),
        [1.0, 1.0]
    );
    assert_eq!(
        of(&[
            "--ambient-occlusion",
            "--distance",
            "inf",
            "--directions",
            "4096"
        ]),
        open
    );
    let sky = of(&["--sky-view-factor", "--directions", "4096"]);
    assert_eq!(sky, open);
    assert_eq!(of(&["--sky-view-factor", "--side", "back"]), [0.0, 0.0]);
    let other = of(&["--ambient-occlusion", "--directions", "4096", "--seed", "9"]);
    assert!((other[0] - open[0]).abs() < 0.02, "{other:?}");
    let output = bench.run(&["--ambient-occlusion", "--sky-view-factor"]);
    assert_code(&output, 2);
}

#[test]
fn segments_have_lit_intervals() {
    let bench = Bench::with(&doubles(&[[-8.0, 2.0, -1.0], [-8.0, 2.0, 1.0]]));
    let ends = bench.file("ends.npy", &doubles(&[[8.0, 2.0, -1.0], [8.0, 2.0, 1.0]]));
    let lights = ["--light", "point:0,2,4", "--light", "point:0,2,-9"];
    let more = [&["--intervals", &ends][..], &lights].concat();
    let bytes = bench.array(&more, "<f8", "(6, 4,)");
    let numbers = bytes.chunks_exact(8);
    let numbers: Vec<f64> = numbers
        .map(|x| f64::from_le_bytes(x.try_into().unwrap()))
        .collect();
    // The floor's half of 4 is 5 wide, one below it, and from below 4.4 wide, one above it. Ends are the nearest numbers.
    let (begin, end) = (2.0 / 9.0, 7.0 / 9.0);
    let expected = [
        [0.0, 0.0, 0.0, 0.1875],
        [0.0, 0.0, 0.8125, 1.0],
        [0.0, 1.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0, begin],
        [1.0, 1.0, end, 1.0],
    ];
    assert_eq!(numbers, expected.as_flattened());
    fs::remove_file(&bench.out).unwrap();
    let through = bench.file(
        "through.npy",
        &doubles(&[[8.0, -2.0, 1.0], [8.0, 2.0, 1.0]]),
    );
    // The first leaves the ball's shadow last: that border is a square root.
    let more = [&["--intervals", &through][..], &lights].concat();
    let bytes = bench.array(&more, "<f8", "(7, 4,)");
    let numbers = bytes.chunks_exact(8);
    let numbers: Vec<f64> = numbers
        .map(|x| f64::from_le_bytes(x.try_into().unwrap()))
        .collect();
    // (503 + 2 sqrt(623)) / 958, rounded once.
    let out_of_the_ball = 0.577_160_684_652_812_9;
    let expected = [
        [0.0, 0.0, 0.0, 3.0 / 14.0],
        [0.0, 0.0, out_of_the_ball, 1.0],
        [0.0, 1.0, 0.0, 0.5],
        [0.0, 1.0, 13.0 / 17.0, 1.0],
        [1.0, 0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0, begin],
        [1.0, 1.0, end, 1.0],
    ];
    assert_eq!(numbers, expected.as_flattened());
    fs::remove_file(&bench.out).unwrap();
    let fewer = bench.file("fewer.npy", &doubles(&[[8.0, 2.0, -1.0]]));
    let said = bench.refusal(&["--intervals", &fewer]);
    assert!(said.contains("1 ends"), "{said}");
    let said = bench.refusal(&["--intervals", &ends, "--packed"]);
    assert!(said.contains("--packed"), "{said}");
    let area = ["--intervals", &ends, "--light", "sphere:0,0,9,1"];
    assert!(bench.refusal(&area).contains("has a size"));
}
