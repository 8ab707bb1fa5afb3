//! DGP: the letters D, G and P on a floor, after the paper's picture of that name.
//!
//! In: nothing. Out: 21 objects, one light: a floor, and 6, 8 and 6 flat strokes, cut so that those of a
//! letter fit edge to edge. The paper gives counts, a small picture and no data.

use antumbra_geometry::DVec3;

use crate::model::{Color, Scene};

use super::{
    parts::{face, floor, matt, set_look},
    stage,
};

/// A stroke: four corners, counter-clockwise seen from the front, in quarters of a unit from the letter's
/// lower left corner.
type Stroke = [[f64; 2]; 4];

// A bowl is a rectangle of 12 by 24 with corners cut at 4, and the same 4 further in, cut at 2.
const STEM: Stroke = [[0., 0.], [4., 0.], [4., 24.], [0., 24.]];
const D: [Stroke; 6] = [
    STEM,
    [[4., 0.], [10., 0.], [9., 4.], [4., 4.]],
    [[10., 0.], [16., 6.], [12., 7.], [9., 4.]],
    [[16., 6.], [16., 18.], [12., 17.], [12., 7.]],
    [[16., 18.], [10., 24.], [9., 20.], [12., 17.]],
    [[10., 24.], [4., 24.], [4., 20.], [9., 20.]],
];
const G: [Stroke; 8] = [
    [[16., 18.], [10., 24.], [9., 20.], [12., 17.]],
    [[10., 24.], [6., 24.], [7., 20.], [9., 20.]],
    [[6., 24.], [0., 18.], [4., 17.], [7., 20.]],
    [[0., 18.], [0., 6.], [4., 7.], [4., 17.]],
    [[0., 6.], [6., 0.], [7., 4.], [4., 7.]],
    [[6., 0.], [12., 0.], [12., 4.], [7., 4.]],
    [[12., 0.], [16., 0.], [16., 9.], [12., 9.]],
    [[9., 9.], [16., 9.], [16., 12.], [9., 12.]],
];
const P: [Stroke; 6] = [
    STEM,
    [[4., 9.], [11., 9.], [10., 13.], [4., 13.]],
    [[11., 9.], [16., 14.], [12., 15.], [10., 13.]],
    [[16., 14.], [16., 19.], [12., 18.], [12., 15.]],
    [[16., 19.], [11., 24.], [10., 20.], [12., 18.]],
    [[11., 24.], [4., 24.], [4., 20.], [10., 20.]],
];

/// Makes the letters.
pub fn dgp() -> Scene {
    let mut scene = stage(
        DVec3::new(-2.5, -19.0, 12.5),
        DVec3::new(-0.25, 1.25, 2.0),
        DVec3::Z,
        &[DVec3::new(-6.0, -10.0, 13.0)],
    );
    scene.background = Color::new(0.75, 0.8, 0.85);
    set_look(&mut scene, &[[0.8, 0.79, 0.76]], 42.0);
    let ground = matt(&mut scene, [0.5, 0.52, 0.5]);
    floor(&mut scene, [-13.0, -7.0], [13.0, 13.0], 0.0, ground);
    let letters: [(&[Stroke], [f64; 2], [f64; 3]); 3] = [
        (&D, [-7.0, 1.0], [0.55, 0.08, 0.06]),
        (&G, [-2.0, 0.0], [0.6, 0.4, 0.06]),
        (&P, [3.0, 1.0], [0.06, 0.2, 0.45]),
    ];
    for (strokes, [left, y], color) in letters {
        let paint = matt(&mut scene, color);
        for stroke in strokes {
            let corners = stroke.map(|[x, z]| [left + 0.25 * x, y, 0.25 * z]);
            face(&mut scene, &corners, paint);
        }
    }
    scene
}
