//! `antumbra bake`, `export`, and values from a file: what is drawn does not depend on them, and what holds no
//! longer is refused with the reason.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::support::{Folder, antumbra, assert_code, count, stderr, stdout, text};

const LAMPS: [&str; 2] = ["point:3,-2,5", "point:-1,-4,3"];

/// Methods that keep what they know.
const KEPT: [&str; 2] = ["auto", "voxel"];

struct World {
    /// Method that is baked.
    shadows: &'static str,
    folder: Folder,
    scene: PathBuf,
    file: PathBuf,
}

impl World {
    fn new() -> Self {
        Self::of("voxel")
    }

    fn of(shadows: &'static str) -> Self {
        let (folder, scene) = Folder::with_scene();
        let file = folder.path("small.antumbra");
        Self {
            shadows,
            folder,
            scene,
            file,
        }
    }

    fn run(&self, command: &str, lamps: &[&str], more: &[&str]) -> Output {
        let mut arguments = vec![command, text(&self.scene), "--resolution", "128"];
        for lamp in lamps {
            arguments.extend(["--light", lamp]);
        }
        arguments.extend(more);
        antumbra(&arguments)
    }

    fn bake(&self, lamps: &[&str]) -> Output {
        let more = ["-o", text(&self.file), "--shadows", self.shadows];
        self.run("bake", lamps, &more)
    }

    /// Renders with the file; returns the picture, what was said, and the figures.
    fn render(&self, lamps: &[&str], more: &[&str]) -> (Vec<u8>, String, Value) {
        let [picture, json] = ["picture.png", "figures.json"].map(|name| self.folder.path(name));
        let files = ["-o", text(&picture), "--stats-json", text(&json)];
        let output = self.run("render", lamps, &[&files, more].concat());
        assert_code(&output, 0);
        let figures = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
        (fs::read(&picture).unwrap(), stderr(&output), figures)
    }

    /// Renders with the file, which is refused; returns what was said.
    fn refused(&self, lamps: &[&str], more: &[&str]) -> String {
        let picture = self.folder.path("none.png");
        let files = ["-o", text(&picture), "--occlusion", text(&self.file)];
        let output = self.run("render", lamps, &[&files, more].concat());
        assert_code(&output, 2);
        assert!(!picture.exists());
        stderr(&output)
    }
}

#[test]
fn pictures_are_the_same_and_need_no_rays() {
    for shadows in KEPT {
        check_pictures_are_the_same_and_need_no_rays(&World::of(shadows));
    }
}

fn check_pictures_are_the_same_and_need_no_rays(world: &World) {
    assert_code(&world.bake(&LAMPS), 0);
    let with_file = ["--occlusion", text(&world.file)];
    let (expected, _, by_rays) = world.render(&LAMPS, &["--shadows", "bvh"]);
    for refine in ["lazy", "eager", "queried"] {
        let more = [&with_file[..], &["--refine", refine]].concat();
        let (picture, said, _) = world.render(&LAMPS, &more);
        assert!(picture == expected, "{refine}");
        assert!(!said.contains("computed again"), "{said}");
    }
    let (_, _, known) = world.render(&LAMPS, &[&with_file[..], &["--refine", "eager"]].concat());
    let all = count(&by_rays, "/shadow/rays");
    // Maps leave many starts on curved surfaces to rays.
    let most = if world.shadows == "voxel" { 50 } else { 2 };
    assert!(count(&known, "/shadow/rays") * most < all, "{known}");
}

#[test]
fn power_color_and_camera_are_no_part_of_it_and_the_pose_is() {
    for shadows in KEPT {
        check_power_color_and_camera_are_no_part_of_it_and_the_pose_is(&World::of(shadows));
    }
}

fn check_power_color_and_camera_are_no_part_of_it_and_the_pose_is(world: &World) {
    assert_code(&world.bake(&LAMPS), 0);
    let with_file = ["--occlusion", text(&world.file)];
    let bright = ["point:3,-2,5/9,0.5,0", "point:-1,-4,3/0,0,1"];
    let camera = ["--camera", "eye:2,-5,4/at:0,0,0/fov:30", "--size", "50x70"];
    let (picture, said, _) = world.render(&bright, &[&with_file[..], &camera].concat());
    assert!(!said.contains("computed again"), "{said}");
    assert!(picture == world.render(&bright, &camera).0);

    let moved = ["point:3,-2,5", "point:-1,-4,3.0000001"];
    let (picture, said, _) = world.render(&moved, &with_file);
    assert!(
        said.contains("knows nothing of light-2, which is new or was moved"),
        "{said}"
    );
    assert!(!said.contains("light-1"), "{said}");
    assert!(picture == world.render(&moved, &["--shadows", "bvh"]).0);

    // Baking again makes that light only, and nothing the next time.
    let output = world.bake(&moved);
    assert_code(&output, 0);
    assert!(stdout(&output).contains("2 lights, of which 1 were loaded"));
    let before = fs::read(&world.file).unwrap();
    assert!(stdout(&world.bake(&moved)).contains("of which 2 were loaded"));
    assert!(fs::read(&world.file).unwrap() == before);
}

#[test]
fn files_that_hold_no_longer_are_refused_with_the_reason() {
    let world = World::new();
    let said = world.refused(&LAMPS, &[]);
    assert!(said.contains("cannot be read"), "{said}");
    assert_code(&world.bake(&LAMPS), 0);
    let whole = fs::read(&world.file).unwrap();

    let said = world.refused(&LAMPS, &["--lists", "2,9"]);
    assert!(
        said.contains("another short list: 3, and 2 is wanted"),
        "{said}"
    );
    let said = world.refused(&LAMPS, &["--shadows", "grid"]);
    assert!(
        said.contains("leave --shadows or --occlusion out"),
        "{said}"
    );

    let changed = fs::read_to_string(&world.scene)
        .unwrap()
        .replace("s 0 0 0.8", "s 0 0 0.9");
    let scene = world.folder.path("changed.nff");
    fs::write(&scene, changed).unwrap();
    let other = World {
        scene,
        file: world.file.clone(),
        folder: Folder::new(),
        shadows: world.shadows,
    };
    let said = other.refused(&LAMPS, &[]);
    assert!(
        said.contains("another scene") && said.contains("antumbra bake"),
        "{said}"
    );
    // Baking replaces what holds no longer, and says so; it replaces nothing else.
    let output = other.bake(&LAMPS);
    assert_code(&output, 0);
    assert!(stderr(&output).contains("everything is computed again"));
    assert_code(&world.bake(&LAMPS), 0);
    assert!(fs::read(&world.file).unwrap() == whole);

    let middle = whole.len() / 2;
    let mut damaged = whole.clone();
    damaged[middle] ^= 4;
    for (bytes, expected) in [
        (&damaged[..], "is damaged: the checksum of"),
        (&whole[..middle], "was cut off or added to"),
        (&b"\x93NUMPY"[..], "is no file of occlusion values"),
    ] {
        fs::write(&world.file, bytes).unwrap();
        let said = world.refused(&LAMPS, &[]);
        assert!(said.contains(expected), "{said}");
    }
    let output = world.bake(&LAMPS);
    assert_code(&output, 2);
    assert!(stderr(&output).contains("is not replaced"));
    assert_eq!(fs::read(&world.file).unwrap(), b"\x93NUMPY");

    let output = world.run("bake", &LAMPS, &["-o", "x.antumbra", "--refine", "lazy"]);
    assert_code(&output, 2);
    let nowhere = world.folder.path("no/where.antumbra");
    let output = world.run("bake", &LAMPS, &["-o", text(&nowhere)]);
    assert_code(&output, 3);
}

#[test]
fn what_was_made_on_the_way_is_kept() {
    for shadows in KEPT {
        check_what_was_made_on_the_way_is_kept(&World::of(shadows));
    }
}

fn check_what_was_made_on_the_way_is_kept(world: &World) {
    let kept = ["--save-occlusion", text(&world.file), "--refine", "queried"];
    let size = ["--size", "80x60"];
    let (picture, _, _) = world.render(&LAMPS, &[&kept[..], &size].concat());
    let with_file = ["--occlusion", text(&world.file), "--refine", "queried"];
    let (again, _, figures) = world.render(&LAMPS, &[&with_file[..], &size].concat());
    assert!(picture == again);
    let first = world
        .render(
            &LAMPS,
            &[
                &["--refine", "queried", "--shadows", world.shadows],
                &size[..],
            ]
            .concat(),
        )
        .2;
    // Without a file rays answer until something is known.
    let [queries, rays, by_value] = ["queries", "rays", "first_pass"]
        .map(|name| [&figures, &first].map(|figures| count(figures, &format!("/shadow/{name}"))));
    match world.shadows {
        // All of a map is there at once; threads that meet at one cell may leave a few to rays.
        "auto" => assert!(rays[0] <= rays[1] + queries[0] / 100, "{rays:?}"),
        _ => assert!(by_value[0] > by_value[1], "{by_value:?}"),
    }
    // A query goes on from there.
    let points = world.folder.path("points.npy");
    fs::write(&points, npy_of_points(&[[0.0, 0.1, 0.0], [2.5, 2.5, 0.0]])).unwrap();
    let answers = |name: &str, more: &[&str]| {
        let out = world.folder.path(name);
        let files = ["--points", text(&points), "--on-surface", "-o", text(&out)];
        let output = world.run("query", &LAMPS, &[&files, more].concat());
        assert_code(&output, 0);
        fs::read(out).unwrap()
    };
    let expected = answers("rays.npy", &["--shadows", "bvh"]);
    let both = [&with_file[..], &["--save-occlusion", text(&world.file)]].concat();
    assert!(answers("first.npy", &both) == expected);
    assert!(answers("second.npy", &with_file) == expected);
}

fn npy_of_points(points: &[[f64; 3]]) -> Vec<u8> {
    let shape = format!("({}, 3)", points.len());
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((118_u16).to_le_bytes());
    bytes.extend(format!("{header:<117}\n").bytes());
    bytes.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// An array's header, and its data.
fn array(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = String::from_utf8(bytes[10..10 + length].to_vec()).unwrap();
    (header, bytes[10 + length..].to_vec())
}

#[test]
fn a_volume_is_an_array_with_its_place() {
    let world = World::new();
    assert_code(&world.bake(&LAMPS), 0);
    let [out, json] = ["volume.npy", "volume.json"].map(|name| world.folder.path(name));
    let export = |lamps: &[&str], more: &[&str]| {
        let files = ["-o", text(&out), "--json", text(&json), "--cells", "16"];
        let output = world.run("export", lamps, &[&files, more].concat());
        assert_code(&output, 0);
        let place: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
        (stdout(&output), array(&out), place)
    };
    let (said, (header, values), place) = export(&LAMPS, &["--occlusion", text(&world.file)]);
    let cells: Vec<u64> = serde_json::from_value(place["cells"].clone()).unwrap();
    let [x, y, z] = cells[..] else {
        panic!("{place}")
    };
    assert!(
        header.contains("'|u1'") && header.contains("'fortran_order': False"),
        "{header}"
    );
    assert!(header.contains(&format!("({x}, {y}, {z}, 2")), "{header}");
    assert!(
        said.starts_with(&format!("{x} x {y} x {z} cells")),
        "{said}"
    );
    assert_eq!(values.len() as u64, x * y * z * 2);
    let edge = place["edge"].as_f64().unwrap();
    for axis in 0..3 {
        let [min, max] = ["min", "max"].map(|name| place[name][axis].as_f64().unwrap());
        assert!((max - min - edge * cells[axis] as f64).abs() < 1e-9);
        assert!(min < [-3.0, -3.0, 0.0][axis] && max > [3.0, 3.0, 1.5][axis]);
    }
    assert_eq!(place["lights"], serde_json::json!(["light-1", "light-2"]));
    for value in [0, 1, 2] {
        assert!(values.contains(&value), "{value}");
    }
    assert!(values.iter().all(|&value| value < 3));
    // Without a file they are made, and one light has no axis of its own.
    let (_, (header, first), _) = export(&LAMPS[..1], &[]);
    assert!(header.contains(&format!("({x}, {y}, {z}")), "{header}");
    let expected: Vec<u8> = values.iter().step_by(2).copied().collect();
    assert!(first == expected);
}

#[test]
fn a_scene_without_surfaces_is_baked_without_a_word_of_full_memory() {
    let folder = Folder::new();
    let [scene, file] = ["empty.obj", "empty.antumbra"].map(|name| folder.path(name));
    fs::write(&scene, "").unwrap();
    let light = ["--light", "point:0,0,5"];
    for shadows in KEPT {
        let bake = [
            "bake",
            text(&scene),
            "-o",
            text(&file),
            "--shadows",
            shadows,
        ];
        let output = antumbra(&[&bake[..], &light].concat());
        assert_code(&output, 0);
        let said = stderr(&output);
        assert!(!said.contains("not refined"), "{said}");
    }
}
