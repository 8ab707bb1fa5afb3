//! `antumbra verify --attack`.

use crate::support::{Folder, antumbra, assert_code, stderr, stdout, text};

/// Attacks the small scene with more arguments.
fn attacked(more: &[&str]) -> String {
    let (_folder, scene) = Folder::with_scene();
    let arguments = ["verify", text(&scene), "--attack", "--resolution", "32"];
    let output = antumbra(&[&arguments[..], more].concat());
    assert_code(&output, 0);
    stdout(&output)
}

/// Returns the line that starts with a name, after the name.
fn row<'a>(output: &'a str, name: &str) -> &'a str {
    let mut lines = output.lines();
    let row = lines.find_map(|line| line.strip_prefix(name));
    row.unwrap_or_else(|| panic!("{name} in {output}"))
}

const KINDS: [&str; 14] = [
    "plane between voxels",
    "line between voxels",
    "vertex",
    "edge",
    "just inside the border",
    "edge of a shadow",
    "near a crease",
    "anywhere on surfaces",
    "free, at a voxel's border",
    "free, on a surface",
    "free, lifted off a surface",
    "free, anywhere",
    "off its surface",
    "of another surface",
];

#[test]
fn an_attack_asks_all_kinds_of_starts_and_finds_no_difference() {
    let output = attacked(&["--queries", "10000", "--lights", "24", "--against", "bvh"]);
    assert!(
        output.ends_with("10000 queries, 0 differences\n"),
        "{output}"
    );
    let mut sum = 0;
    for kind in KINDS {
        let count: u64 = row(&output, &format!("{kind} ")).trim().parse().unwrap();
        assert!(count >= 100, "{kind}: {count}");
        sum += count;
    }
    let others = row(&output, "free, for want of the kind").trim();
    assert_eq!(sum + others.parse::<u64>().unwrap(), 10_000);
    for method in ["voxel ", "voxel-1990 ", "grid "] {
        let row = row(&output, method).trim();
        assert!(row.starts_with("0 differences;"), "{output}");
    }
    // It does reach what is stored.
    let share = |name: &str| -> f64 {
        let (_, rest) = row(&output, "voxel ").split_once(name).unwrap();
        rest.split(" %").next().unwrap().parse().unwrap()
    };
    assert!(
        share("first pass ") > 5.0 && share("list ") > 5.0,
        "{output}"
    );
    assert!(share("ray ") < 50.0, "{output}");
}

#[test]
fn an_attack_is_a_function_of_the_seed() {
    let with = |more: &[&str]| {
        let base = ["--queries", "2000", "--lights", "5", "--shadows", "voxel"];
        attacked(&[&base[..], more].concat())
    };
    let first = with(&["--threads", "1"]);
    assert_eq!(first, with(&["--threads", "3"]));
    assert_ne!(first, with(&["--seed", "5"]));
}

#[test]
fn an_attack_takes_refinements_and_any_methods() {
    for lists in ["0,0", "4,24", "64,64"] {
        let output = attacked(&["--queries", "2000", "--lists", lists, "--shadows", "voxel"]);
        assert!(
            output.ends_with("2000 queries, 0 differences\n"),
            "{output}"
        );
        let has_lists = !output.contains("list 0.00 %");
        assert_eq!(has_lists, lists != "0,0", "{output}");
    }
    let output = attacked(&["--queries", "500", "--shadows", "naive", "--shadows", "bvh"]);
    assert!(row(&output, "naive ").contains(" 0 differences"));
    assert!(row(&output, "bvh ").contains(" 0 differences"));
    assert!(!output.contains("voxel "), "{output}");
}

#[test]
fn scenes_without_triangles_or_anything_can_be_attacked() {
    let folder = Folder::new();
    let view = "v\nfrom 0 0 9\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 8 8\nl 3 4 5\n";
    for (name, shapes) in [
        ("empty.nff", ""),
        ("ball.nff", "f 1 1 1 1 0 1 0 0\ns 0 0 0 1\n"),
    ] {
        let scene = folder.path(name);
        std::fs::write(&scene, format!("{view}{shapes}")).unwrap();
        let arguments = ["--attack", "--lights", "12", "--queries", "3000"];
        let output = antumbra(&[&["verify", text(&scene)], &arguments[..]].concat());
        assert_code(&output, 0);
        assert!(stdout(&output).ends_with("3000 queries, 0 differences\n"));
    }
}

#[test]
fn bad_refinements_are_refused() {
    for (more, expected) in [
        (["--lists", "4"], "expected SHORT,LONG"),
        (["--lists", "4,5000"], "0 to 4096 blockers"),
        (["--resolution", "3"], "4..=4096"),
        (["--against", "grid"], "reference, bvh"),
        (["--lights", "1001"], "0..=1000"),
    ] {
        let output = antumbra(&[&["verify", "a.nff"], &more[..]].concat());
        assert_code(&output, 2);
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
}

/// A million delicate queries over scenes of all makes; longer runs are made by hand and summarised in
/// bench/runs.
#[test]
fn a_million_attacks_find_no_difference() {
    let folder = Folder::new();
    for (name, size, queries) in [
        ("tetra", "5", "250000"),
        ("sphereflake", "2", "150000"),
        ("city", "300", "250000"),
        ("forest", "2000", "150000"),
        ("heightfield", "48", "200000"),
    ] {
        let scene = folder.path(&format!("{name}.nff"));
        let made = antumbra(&["scene", name, "--size", size, "-o", text(&scene), "-q"]);
        assert_code(&made, 0);
        let arguments = [
            "verify",
            text(&scene),
            "--attack",
            "--against",
            "bvh",
            "--shadows",
            "voxel",
            "--resolution",
            "256",
            "--lights",
            "3",
            "--queries",
            queries,
        ];
        let output = antumbra(&arguments);
        assert_code(&output, 0);
        let expected = format!("{queries} queries, 0 differences\n");
        assert!(
            stdout(&output).ends_with(&expected),
            "{name}: {}",
            stdout(&output)
        );
    }
}
