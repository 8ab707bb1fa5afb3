//! Texts in which the program explains itself, and the length of their lines.

use super::support::{Folder, antumbra, assert_code, stderr, stdout, text};

/// Every command, with the words that its help must have.
const COMMANDS: [(&[&str], &[&str]); 8] = [
    (
        &["render"],
        &[
            "Scene and lights:",
            "Output:",
            "Picture:",
            "Method:",
            "Index and memory:",
        ],
    ),
    (&["inspect"], &["Scene and lights:", "Index and memory:"]),
    (
        &["query"],
        &[
            "Scene and lights:",
            "Points:",
            "Output:",
            "Method:",
            "Threads:",
        ],
    ),
    (
        &["verify"],
        &["Scene and lights:", "Comparison:", "Threads:"],
    ),
    (
        &["bake"],
        &["Scene and lights:", "Output:", "Index and memory:"],
    ),
    (
        &["export"],
        &["Scene and lights:", "Output:", "Saved values:"],
    ),
    (
        &["scene"],
        &["Scene:", "Output:", "sphereflake", "heightfield", "rooms"],
    ),
    (&["convert"], &["Files:", ".nff, .obj, .ply or .glb"]),
];

fn help(command: &[&str], flag: &str) -> String {
    let output = antumbra(&[command, &[flag]].concat());
    assert_code(&output, 0);
    stdout(&output)
}

#[test]
fn no_line_of_help_has_more_than_100_columns_and_every_command_has_headings() {
    let all = COMMANDS.iter().copied();
    for (command, words) in all.chain([(&[][..], &["Exit codes"][..])]) {
        for flag in ["--help", "-h"] {
            let text = help(command, flag);
            for line in text.lines() {
                let width = line.chars().count();
                assert!(width <= 100, "{command:?} {flag}: {width} columns: {line}");
            }
            for word in words
                .iter()
                .filter(|word| flag == "--help" || word.ends_with(':'))
            {
                assert!(text.contains(word), "{command:?} {flag}: {word}\n{text}");
            }
        }
    }
}

#[test]
fn north_is_stated_wherever_a_sun_can_be_typed() {
    for command in [
        &["render"][..],
        &["inspect"],
        &["query"],
        &["verify"],
        &["bake"],
        &["export"],
    ] {
        let text = help(command, "--help");
        let words: Vec<&str> = text.split_whitespace().collect();
        let text = words.join(" ");
        for part in [
            "With z up, north is +y and east is +x",
            "with y up, north is -z and east is +x",
        ] {
            assert!(text.contains(part), "{command:?}: {part}");
        }
    }
}

#[test]
fn a_sun_below_the_horizon_is_told() {
    let (folder, scene) = Folder::with_scene();
    let picture = folder.path("a.png");
    let render = [
        "render",
        text(&scene),
        "-o",
        text(&picture),
        "--size",
        "8x8",
    ];
    for (sun, is_told) in [("10,-30", true), ("10,30", false)] {
        let output = antumbra(&[&render[..], &["--sun", sun]].concat());
        assert_code(&output, 0);
        let said = stderr(&output);
        assert_eq!(
            said.contains("30 degrees below the horizon"),
            is_told,
            "{said}"
        );
    }
}

#[test]
fn query_offers_the_methods_that_it_has_and_no_others() {
    let text = help(&["query"], "--help");
    for method in ["voxel-1990", "bvh", "naive"] {
        assert!(text.contains(method), "{method}");
    }
    for rival in ["light-buffer", "hybrid", "shadow-volumes", "shadow-map"] {
        assert!(!text.contains(rival), "{rival}");
        let typed = [
            "query",
            "a.nff",
            "--points",
            "p.npy",
            "-o",
            "o.npy",
            "--shadows",
            rival,
        ];
        let output = antumbra(&typed);
        assert_code(&output, 2);
        assert!(
            stderr(&output).contains("possible values"),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn values_that_begin_with_a_minus_are_told_what_is_expected() {
    let query = [
        "query",
        "a.nff",
        "--points",
        "p.npy",
        "-o",
        "o.npy",
        "--on-surface",
    ];
    let render = ["render", "a.nff", "-o", "a.png"];
    for (command, option, value, expected) in [
        (
            &query[..],
            "--tolerance",
            "-1",
            "expected a distance, zero or more",
        ),
        (
            &render,
            "--background",
            "-1,0,0",
            "a background must not be negative",
        ),
        (&render, "--light", "-1,2,3", "expected point:X,Y,Z"),
        (&render, "--camera", "-1,2,3", "expected eye:X,Y,Z"),
    ] {
        let output = antumbra(&[command, &[option, value]].concat());
        assert_code(&output, 2);
        let said = stderr(&output);
        assert!(said.contains(expected) && said.contains(value), "{said}");
    }
}
