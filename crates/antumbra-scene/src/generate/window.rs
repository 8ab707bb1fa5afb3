//! Window: a room with a window of colored panes in lead, through which the sun shines onto the floor.
//!
//! In: the number of panes across. Out: floor, walls with an opening, bars of lead, and a pane of one of six colors in each
//! gap. Invariant: wall, bars and panes lie in one plane, side by side, and leave no gap; light that comes through a pane
//! is colored, all other is blocked. One sun.

use antumbra_geometry::DVec3;

use crate::defaults::nff_material;
use crate::model::{Color, Facing, Light, LightKind, Material, Object, Scene};

use super::{GenerateError, check_size, polygon, stage};

/// The largest size.
const LARGEST: u32 = 256;

/// The opening, x and z, and the room around it.
const OPENING: [[f64; 2]; 2] = [[-1.5, 1.5], [1.0, 5.0]];
const ROOM: [[f64; 2]; 3] = [[-4.0, 4.0], [0.0, 9.0], [0.0, 6.0]];

/// A bar's share of a pane's width.
const BAR: f64 = 0.125;

/// Shares of red, green and blue that panes let through.
const COLORS: [[f64; 3]; 6] = [
    [0.875, 0.0625, 0.0625],
    [0.0625, 0.1875, 0.8125],
    [0.9375, 0.75, 0.125],
    [0.0625, 0.5625, 0.1875],
    [0.5625, 0.125, 0.625],
    [0.875, 0.9375, 0.9375],
];

/// The first material of panes; before it are those of stone and lead.
const FIRST_PANE: usize = 2;

/// Makes a room with a window of `size` panes across.
///
/// # Errors
/// The size is not from 1 to 256.
pub fn window(size: u32) -> Result<Scene, GenerateError> {
    check_size("window", size, 1..=LARGEST)?;
    let [eye, at] = [DVec3::new(2.5, 8.5, 3.0), DVec3::new(-0.5, 1.0, 1.75)];
    let mut scene = stage(eye, at, DVec3::Z, &[]);
    scene.facing = Facing::Viewer;
    scene.ambient = Color::splat(0.0625);
    scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            towards_light: DVec3::new(0.25, -1.0, 0.875),
        },
        color: Color::splat(1.0),
        falls_off: false,
    });
    let stone = nff_material([0.75, 0.75, 0.6875, 1.0, 0.0, 1.0, 0.0, 1.0]);
    let lead = nff_material([0.125, 0.125, 0.125, 1.0, 0.0, 1.0, 0.0, 1.0]);
    let panes = COLORS.map(|color| Material {
        diffuse: Color::from_array(color) * 0.0625,
        transmission: Color::from_array(color),
        ..Material::default()
    });
    scene
        .materials
        .extend([stone, lead].into_iter().chain(panes));

    let [[left, right], [front, back], [bottom, top]] = ROOM;
    let floor = [(left, front), (right, front), (right, back), (left, back)];
    scene.objects.push(polygon(
        floor.map(|(x, y)| DVec3::new(x, y, bottom)).to_vec(),
        0,
    ));
    for x in [left, right] {
        let wall = [(front, bottom), (back, bottom), (back, top), (front, top)];
        scene
            .objects
            .push(polygon(wall.map(|(y, z)| DVec3::new(x, y, z)).to_vec(), 0));
    }
    let [[x0, x1], [z0, z1]] = OPENING;
    for [x, z] in [
        [[left, right], [bottom, z0]],
        [[left, right], [z1, top]],
        [[left, x0], [z0, z1]],
        [[x1, right], [z0, z1]],
    ] {
        scene.objects.push(upright(x, z, 0));
    }
    scene.objects.extend(glazing(size));
    Ok(scene)
}

/// A rectangle in the wall of the window.
fn upright([x0, x1]: [f64; 2], [z0, z1]: [f64; 2], material: usize) -> Object {
    let corners = [(x0, z0), (x1, z0), (x1, z1), (x0, z1)];
    polygon(
        corners.map(|(x, z)| DVec3::new(x, 0.0, z)).to_vec(),
        material,
    )
}

/// Bars and panes of the opening, row by row.
fn glazing(size: u32) -> Vec<Object> {
    let rows = (size * 4).div_ceil(3);
    let [xs, zs] =
        [(OPENING[0], size), (OPENING[1], rows)].map(|(range, count)| lines(range, count));
    let mut objects = Vec::new();
    for [[z0, z1], [z2, z3]] in &zs {
        // Lead goes on across; panes and upright bars are between.
        objects.push(upright(OPENING[0], [*z0, *z1], 1));
        for (column, [[x0, x1], [x2, x3]]) in xs.iter().enumerate() {
            objects.push(upright([*x0, *x1], [*z1, *z2], 1));
            let middle = [0.5 * (x1 + x2), 0.5 * (z1 + z2)];
            objects.push(upright(
                [*x1, *x2],
                [*z1, *z2],
                FIRST_PANE + color_at(middle),
            ));
            if column + 1 == xs.len() {
                objects.push(upright([*x2, *x3], [*z1, *z2], 1));
            }
        }
        if *z3 == OPENING[1][1] {
            objects.push(upright(OPENING[0], [*z2, *z3], 1));
        }
    }
    objects
}

/// Cuts a range into panes: for each the bar before it, and the bar behind it if it is the last.
fn lines([from, to]: [f64; 2], count: u32) -> Vec<[[f64; 2]; 2]> {
    let width = (to - from) / f64::from(count);
    let bar = BAR * width;
    let at = |number: u32| match number == count {
        true => to,
        false => from + width * f64::from(number),
    };
    let panes = (0..count).map(|number| {
        let is_last = number + 1 == count;
        let end = at(number + 1);
        let behind = if is_last { end - bar } else { end };
        [[at(number), at(number) + bar], [behind, end]]
    });
    panes.collect()
}

/// Rings around the middle of the opening, each of two colors in turn.
fn color_at([x, z]: [f64; 2]) -> usize {
    let [middle_x, middle_z] = OPENING.map(|[from, to]| 0.5 * (from + to));
    let (x, z) = (x - middle_x, z - middle_z);
    let ring = (2.0 * x.abs().max(0.75 * z.abs())) as usize;
    let is_across = usize::from((x.abs() > 0.75 * z.abs()) == (x * z > 0.0));
    (2 * ring + is_across) % COLORS.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panes_and_bars_fill_the_opening() {
        for size in [1, 2, 6, 31] {
            let area = |object: &Object| {
                let crate::model::Shape::Polygon(polygon) = &object.shape else {
                    panic!("all are polygons");
                };
                let [a, b, _, d] = polygon.vertices[..] else {
                    panic!("all are rectangles");
                };
                (b - a).cross(d - a).length()
            };
            let found: f64 = glazing(size).iter().map(area).sum();
            assert!((found - 12.0).abs() < 1e-9, "{size}: {found}");
        }
        let scene = window(6).unwrap();
        let colors: std::collections::HashSet<_> =
            scene.objects.iter().map(|object| object.material).collect();
        assert_eq!(colors.len(), scene.materials.len(), "all are used");
    }
}
