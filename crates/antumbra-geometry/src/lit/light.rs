//! The flat parts of lights, in coordinates of their own.

use glam::DVec3;

use super::measure::Measure;
use super::trace::{Place, Trace};
use crate::{AreaShape, LightShape};

/// A part of a light in one plane, or a round patch of directions.
#[derive(Clone, Debug)]
pub(super) struct FlatPart {
    /// The places at coordinates `(1, 0, 0)`, `(0, 1, 0)` and `(0, 0, 1)`.
    pub(super) basis: [Place; 3],
    /// Whether the three places are corners, and coordinates shares of them.
    pub(super) is_affine: bool,
    /// The lines that bound it, in counter-clockwise order: for what is round, a square around it.
    pub(super) outline: &'static [[f64; 3]],
    /// The corners of the outline, in order; of what is round, of an octagon around it.
    pub(super) corners: Vec<Place>,
    pub(super) measure: Measure,
    /// How much of the whole light it is, in units of its own.
    pub(super) size: f64,
}

const TRIANGLE: &[[f64; 3]] = &[[0.0, 0.0, 1.0], [1.0, -1.0, -1.0], [0.0, 1.0, 0.0]];

/// From -1/2 to 1/2.
const UNIT_SQUARE: &[[f64; 3]] = &[
    [1.0, 0.0, 2.0],
    [1.0, -2.0, 0.0],
    [1.0, 0.0, -2.0],
    [1.0, 2.0, 0.0],
];

/// From -1 to 1.
const AROUND_DISC: &[[f64; 3]] = &[
    [1.0, 0.0, 1.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
];

/// Most parts of a light; lights with more are sampled.
const MOST_PARTS: usize = 64;

impl FlatPart {
    /// Returns the outline as traces.
    pub(super) fn traces(&self) -> impl Iterator<Item = Trace<3>> {
        self.outline.iter().map(|&numbers| Trace::Own(numbers))
    }

    fn triangle([a, b, c]: [DVec3; 3], size: f64) -> Self {
        let basis = [(a, 1.0), (b, 1.0), (c, 1.0)];
        Self {
            basis,
            is_affine: true,
            outline: TRIANGLE,
            corners: basis.to_vec(),
            measure: Measure::Flat(0.5),
            size,
        }
    }

    fn round(basis: [Place; 3], measure: Measure) -> Self {
        // A little more than the tangent of an eighth of a half turn.
        const OCTAGON: f64 = 0.414_213_6;
        let corner = |u: f64, v: f64| {
            let place = basis[0].0 + basis[1].0 * u + basis[2].0 * v;
            (place, basis[0].1)
        };
        let a = OCTAGON;
        let b = 1.000_001;
        let corners = [
            (b, -a),
            (b, a),
            (a, b),
            (-a, b),
            (-b, a),
            (-b, -a),
            (-a, -b),
            (a, -b),
        ];
        Self {
            basis,
            is_affine: false,
            outline: AROUND_DISC,
            corners: corners.iter().map(|&(u, v)| corner(u, v)).collect(),
            measure,
            size: 1.0,
        }
    }
}

/// The parts of a light that shine towards a receiver point, how many there are in all, and their size; nothing for
/// lights that are not flat, or have too many parts.
pub(super) fn parts_towards(
    shape: &AreaShape,
    receiver: DVec3,
) -> Option<(Vec<FlatPart>, usize, f64)> {
    let shines = |origin: DVec3, normal: DVec3, is_two_sided: bool| {
        let side = LightShape::Point(receiver).side_of(origin, normal);
        side > 0 || side < 0 && is_two_sided
    };
    let one = |part: FlatPart, is_shining: bool| {
        let size = part.size;
        let parts = if is_shining { vec![part] } else { Vec::new() };
        Some((parts, 1, size))
    };
    match shape {
        AreaShape::Rectangle(light) => {
            let (center, [first, second]) = (light.center(), light.edges());
            let corner = |u: f64, v: f64| (center + first * u + second * v, 1.0);
            let part = FlatPart {
                basis: [(center, 1.0), (first, 0.0), (second, 0.0)],
                is_affine: false,
                outline: UNIT_SQUARE,
                corners: vec![
                    corner(-0.5, -0.5),
                    corner(0.5, -0.5),
                    corner(0.5, 0.5),
                    corner(-0.5, 0.5),
                ],
                measure: Measure::Flat(1.0),
                size: 1.0,
            };
            one(part, shines(center, light.normal(), light.is_two_sided()))
        }
        AreaShape::Triangle(light) => {
            let corners = light.corners();
            let is_shining = shines(corners[0], light.normal(), light.is_two_sided());
            one(FlatPart::triangle(corners, 1.0), is_shining)
        }
        AreaShape::Disk(light) => {
            let [across, along] = light.frame().map(|axis| axis * light.radius());
            let basis = [(light.center(), 1.0), (across, 0.0), (along, 0.0)];
            let is_shining = shines(light.center(), light.normal(), light.is_two_sided());
            one(FlatPart::round(basis, Measure::Disc), is_shining)
        }
        AreaShape::SunDisc(light) => {
            let (height, tangent) = (light.height(), light.tangent());
            let [across, along] = light.frame().map(|axis| axis * tangent);
            let basis = [(light.towards_light(), 0.0), (across, 0.0), (along, 0.0)];
            let measure = Measure::Cap { tangent, height };
            one(FlatPart::round(basis, measure), true)
        }
        AreaShape::Polygon(light) => {
            let triangles = light.triangles();
            let is_shining = shines(light.corners()[0], light.normal(), light.is_two_sided());
            let parts = triangles
                .filter(|_| is_shining)
                .map(|(corners, area)| FlatPart::triangle(corners, area));
            let count = light.triangles().count();
            (count <= MOST_PARTS).then(|| (parts.collect(), count, light.area()))
        }
        AreaShape::Mesh(light) => {
            let parts = light
                .triangles_with_areas()
                .filter(|(corners, _)| light.shines_to(corners, receiver))
                .map(|(corners, area)| FlatPart::triangle(corners, area));
            let count = light.triangles().len();
            (count <= MOST_PARTS).then(|| (parts.collect(), count, light.area()))
        }
        AreaShape::Segment(_) | AreaShape::Sphere(_) | AreaShape::Sky(_) => None,
    }
}
