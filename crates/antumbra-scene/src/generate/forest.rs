//! Forest: loose leaves in the crowns of trees; the case of very many small blockers.
//!
//! In: the number of leaves. Out: a ground, for each tree a trunk (a six-sided prism, open at both
//! ends), and leaves of one triangle each that touch nothing, their fronts upwards. Invariant:
//! coordinates are whole thousandths, which six digits say exactly up to 400,000 leaves. One
//! light: a sun, as a far point because NFF knows no other.

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_material,
    model::{Object, Scene},
};

use super::{GenerateError, check_size, polygon, random::Random, stage};

/// The largest size.
const LARGEST: u32 = 4_000_000;

const LEAVES_PER_TREE: u32 = 500;
/// Lengths below are in thousandths of a unit.
const THOUSANDTHS: f64 = 1000.0;
/// From a tree to the next, before both are moved a little.
const PITCH: i32 = 9000;
const SEED: u64 = 0xF0E57;

/// Makes a forest of `size` leaves.
///
/// # Errors
/// The size is not from 1 to 4,000,000.
pub fn forest(size: u32) -> Result<Scene, GenerateError> {
    check_size("forest", size, 1..=LARGEST)?;
    let trees = size.div_ceil(LEAVES_PER_TREE);
    let side = trees.isqrt() + u32::from(trees.isqrt().pow(2) < trees);
    let half = f64::from(side) * f64::from(PITCH) / (2.0 * THOUSANDTHS);
    let mut scene = stage(
        DVec3::new(-0.5 * half, -1.25 * half, 0.5 * half + 12.0),
        DVec3::new(0.0, 0.0, 4.0),
        DVec3::Z,
        &[DVec3::new(-5.0, -4.0, 9.0) * (2.0 * half + 100.0).round()],
    );
    for color in [[0.45, 0.4, 0.3], [0.4, 0.3, 0.2], [0.3, 0.6, 0.2]] {
        let [r, g, b] = color;
        scene
            .materials
            .push(nff_material([r, g, b, 1.0, 0.0, 1.0, 0.0, 1.0]));
    }

    let rim = half + 6.0;
    let ground = [(-rim, -rim), (rim, -rim), (rim, rim), (-rim, rim)];
    let ground = ground.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    scene.objects.push(polygon(ground, 0));

    let mut random = Random::new(SEED);
    let corner = -(side as i32) * PITCH / 2 + PITCH / 2;
    let mut crowns = Vec::new();
    for tree in 0..trees {
        let at = [tree % side, tree / side]
            .map(|i| corner + i as i32 * PITCH + random.between(-1500, 1500));
        let height = random.between(4000, 9000);
        add_trunk(&mut scene.objects, at, height, random.between(150, 350));
        crowns.push(Crown {
            middle: [at[0], at[1], height],
            reach: [random.between(2000, 3500), random.between(2000, 4000)],
        });
    }
    for leaf in 0..size {
        let crown = &crowns[(leaf / LEAVES_PER_TREE) as usize];
        scene.objects.push(crown.leaf(&mut random));
    }
    Ok(scene)
}

/// A prism over a hexagon; its sides are vertical, hence planar.
fn add_trunk(objects: &mut Vec<Object>, at: [i32; 2], height: i32, radius: i32) {
    // 866 / 1000 is the sine of 60 degrees, as near as thousandths are.
    let across = radius * 866 / 1000;
    let outline = [
        (radius, 0),
        (radius / 2, across),
        (-radius / 2, across),
        (-radius, 0),
        (-radius / 2, -across),
        (radius / 2, -across),
    ];
    let point = |(x, y): (i32, i32), z| position([at[0] + x, at[1] + y, z]);
    for i in 0..6 {
        let (from, to) = (outline[i], outline[(i + 1) % 6]);
        let side = [
            point(from, 0),
            point(to, 0),
            point(to, height),
            point(from, height),
        ];
        objects.push(polygon(side.to_vec(), 1));
    }
}

/// An ellipsoid full of leaves: its middle, and how far it reaches across and up.
struct Crown {
    middle: [i32; 3],
    reach: [i32; 2],
}

impl Crown {
    fn leaf(&self, random: &mut Random) -> Object {
        let from_middle = in_ball(random).map(i64::from);
        let reach = [self.reach[0], self.reach[0], self.reach[1]].map(i64::from);
        let middle: [i32; 3] = std::array::from_fn(|axis| {
            self.middle[axis] + (from_middle[axis] * reach[axis] / 1000) as i32
        });
        // Two sides of half a unit at most; another pair where they are parallel.
        let (mut first, mut second);
        let upwards = loop {
            (first, second) = (in_ball(random), in_ball(random));
            let upwards = first[0] * second[1] - first[1] * second[0];
            if upwards.abs() > 100_000 {
                break upwards;
            }
        };
        if upwards < 0 {
            (first, second) = (second, first);
        }
        let corner =
            |side: [i32; 3]| position(std::array::from_fn(|axis| middle[axis] + side[axis] / 2));
        polygon(vec![corner([0; 3]), corner(first), corner(second)], 2)
    }
}

/// Returns a point of the ball of radius 1000.
fn in_ball(random: &mut Random) -> [i32; 3] {
    loop {
        let point = [(); 3].map(|()| random.between(-1000, 1000));
        if point.iter().map(|c| c * c).sum::<i32>() <= 1_000_000 {
            return point;
        }
    }
}

fn position(in_thousandths: [i32; 3]) -> DVec3 {
    DVec3::from_array(in_thousandths.map(f64::from)) / THOUSANDTHS
}
