//! Patches and implicit surfaces in NFF: what they mean, and what is refused.

use antumbra_geometry::{BezierPatch, DVec3, Field};
use antumbra_scene::model::Shape;

use crate::support::nff;

fn message(text: &str) -> String {
    nff(text).unwrap_err().to_string()
}

#[test]
fn a_spline_is_a_patch_for_each_window() {
    let mut text = String::from("bspline 5 4 3");
    for j in 0..4 {
        for i in 0..5 {
            text += &format!("\n{i} {j} {}", i * j);
        }
    }
    let scene = nff(&text).unwrap().scene;
    let patches: Vec<&BezierPatch> = scene
        .objects
        .iter()
        .map(|object| match &object.shape {
            Shape::Patch(patch) => &**patch,
            shape => panic!("{shape:?}"),
        })
        .collect();
    assert_eq!(patches.len(), 2);
    for j in 0..=8 {
        assert_eq!(patches[0].vertex(8, j), patches[1].vertex(0, j));
    }
    // A spline of a plane's points is that plane's.
    let place = patches[0].vertex(0, 0);
    assert!(
        (place - DVec3::new(1.0, 1.0, 1.0)).length() < 1e-12,
        "{place}"
    );
}

#[test]
fn a_torus_has_a_box_and_its_numbers() {
    let scene = nff("torus 1 2 3 0 0 2 4 0.5").unwrap().scene;
    let Shape::Implicit(torus) = &scene.objects[0].shape else {
        panic!("{scene:?}");
    };
    assert!(matches!(
        torus.field,
        Field::Torus { major, minor, .. } if major == 4.0 && minor == 0.5
    ));
    assert!(torus.low.x < 1.0 - 4.5 && torus.high.z > 3.5 && torus.high.z < 4.0);
}

#[test]
fn what_has_no_meaning_is_refused_with_its_line() {
    for (text, expected) in [
        (
            "torus 0 0 0 0 0 1 0 1",
            "the radius of a torus must be positive",
        ),
        (
            "torus 0 0 0 0 0 1 1 0",
            "the radius of the tube of a torus must be positive",
        ),
        (
            "torus 0 0 0 0 0 0 1 1",
            "the axis of a torus must not be zero",
        ),
        ("torus 0 0 0 0 0 1 1 nan", "expected 8 numbers"),
        (
            "gyroid 0 0 0 0 0 0 0 0 1 1 1",
            "the period of a gyroid must be positive",
        ),
        (
            "gyroid 0 0 0 1 0 0 0 0 1 0 1",
            "must have a size along each axis",
        ),
        ("metaballs 0 1 0 0 0 1 1 1", "expected a number of balls"),
        (
            "metaballs 1 -1 0 0 0 1 1 1 0 0 0 1 1",
            "the threshold of metaballs must be positive",
        ),
        (
            "metaballs 1 1 0 0 0 1 1 1 0 0 0 -1 1",
            "the radius of a ball must be positive",
        ),
        ("metaballs 2 1 0 0 0 1 1 1 0 0 0 1 1", "the end of the file"),
        (
            "polynomial 257 0 0 0 1 0 0 0 1 1 1",
            "expected a number of terms",
        ),
        ("polynomial 1 0 0 0 1 0 0 0 1 1 1 1 7 7 0", "add up to 14"),
        (
            "polynomial 1 0 0 0 1 0 0 0 1 1 1 1 0 13 0",
            "expected 4 numbers for each term",
        ),
        ("bezier 13 0 0 0", "expected a level, 0 to 12"),
        (
            "bezier 4 0 0 0",
            "expected 3 numbers for each control point",
        ),
        ("bspline 3 4 2", "expected control points of a row and rows"),
        ("bspline 60000 60000 2 1 1 1", "the file ends before"),
    ] {
        let found = message(&format!("# a comment\n{text}\n"));
        assert!(found.contains(expected), "{text}: {found}");
        assert!(found.starts_with("a.nff:"), "{found}");
    }
}
