//! Triangles against up to 64 starts that look in one direction: surely missed, surely hit, or in doubt.
//!
//! The forms of [`super::super::filter`] are linear in the start, too: with the products of direction and edges made once a
//! triangle, each start costs three products a form. `README.md` of `crate::beam`, "One direction, all starts", proves the bounds.

use antumbra_geometry::{LightShape, Occluders, ReceiverPoint};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16};

use super::super::data::{LANES, TriangleGroup};
use super::super::filter::{cross, dot, load};
use super::super::ray::{SMALLEST_COMPONENT, U};
use super::shapes::Verdicts;
use super::targets::{CHUNK, TARGETS, bits, bits_of, lanes};

type Four<S> = f32x4<S>;
type Wide<S> = f32x16<S>;

/// Bounds of the forms of a box of starts, in those of a start.
const BOX: f32 = 2.0;

/// Errors of what forms are made of, in the frame's units: what their bounds consist of.
#[derive(Clone, Copy, Debug)]
pub(super) struct StartBounds {
    /// Of a corner or a start, beside what its difference from another place is rounded by.
    position: f32,
    /// Of a component of the direction.
    direction: f32,
}

impl StartBounds {
    /// `margin` is the frame's, `origin_error` that of the start in lengths of the direction.
    pub(super) fn new(margin: f64, origin_error: f64) -> Self {
        // A corner and a start are rounded by half a `U` each; twice that, and five percent, are granted.
        Self {
            position: (1.05 * (2.0 * U + 1.01 * margin)) as f32,
            direction: (1.05 * (2.01 * U + SMALLEST_COMPONENT + origin_error)) as f32,
        }
    }
}

/// Starts seen from the middle of their box, axis by axis.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    from: [f32; 3],
    /// The farthest that one lies from there along an axis.
    reach: f32,
    places: Origins,
}

impl Default for Seen {
    fn default() -> Self {
        Self {
            from: [0.0; 3],
            reach: 0.0,
            places: [[0.0; TARGETS]; 3],
        }
    }
}

impl Seen {
    pub(super) fn new(origins: &Origins, bounds: &StartBox) -> Self {
        let mut seen = Self {
            from: bounds.middle,
            ..Self::default()
        };
        for axis in 0..3 {
            seen.reach = seen.reach.max(bounds.half[axis]);
            for (place, origin) in seen.places[axis].iter_mut().zip(&origins[axis]) {
                *place = origin - bounds.middle[axis];
            }
        }
        seen
    }
}

/// Where starts are, in the frame's units, axis by axis.
pub(super) type Origins = [[f32; TARGETS]; 3];

/// A box that holds some starts: its middle, and half its size, rounded up.
#[derive(Clone, Copy, Debug)]
pub(super) struct StartBox {
    pub(super) least: [f32; 3],
    pub(super) most: [f32; 3],
    middle: [f32; 3],
    half: [f32; 3],
}

impl StartBox {
    pub(super) fn new(least: [f32; 3], most: [f32; 3]) -> Self {
        let mut bounds = Self {
            least,
            most,
            middle: [0.0; 3],
            half: [0.0; 3],
        };
        let u = U as f32;
        for axis in 0..3 {
            bounds.middle[axis] = 0.5 * (least[axis] + most[axis]);
            let half = (most[axis] - bounds.middle[axis]).max(bounds.middle[axis] - least[axis]);
            bounds.half[axis] = half * (1.0 + 4.0 * u) + 2.0 * u;
        }
        bounds
    }

    /// Returns the box of the starts of a mask.
    pub(super) fn of(origins: &Origins, mask: u64) -> Self {
        let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for start in bits(mask) {
            for axis in 0..3 {
                least[axis] = least[axis].min(origins[axis][start]);
                most[axis] = most[axis].max(origins[axis][start]);
            }
        }
        Self::new(least, most)
    }

    /// Returns the middle along an axis.
    pub(super) fn middle(&self, axis: usize) -> f32 {
        self.middle[axis]
    }
}

/// Edge functions and planes of four triangles for one direction, signed so that a start that is blocked has all of them
/// positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forms {
    /// Factors of a start's coordinates, and what they are taken off: of the first two edges and of the height under the plane.
    factors: [[[f32; LANES]; 3]; 3],
    constants: [[f32; LANES]; 3],
    /// What the three edge functions add up to.
    climb: [f32; LANES],
    third_edge_scale: [f32; LANES],
    edge_bound: [f32; LANES],
    height_bound: [f32; LANES],
    /// A bit for each triangle that may block a start of the box.
    pub(super) possible: u32,
    /// A bit for each triangle that surely is crossed from all starts of the box.
    pub(super) covering: u32,
}

#[inline(always)]
fn splat<S: Simd>(simd: S, v: [f32; 3]) -> [Four<S>; 3] {
    [
        Four::splat(simd, v[0]),
        Four::splat(simd, v[1]),
        Four::splat(simd, v[2]),
    ]
}

#[inline(always)]
fn scaled<S: Simd>(form: [Four<S>; 3], factor: Four<S>) -> [Four<S>; 3] {
    [form[0] * factor, form[1] * factor, form[2] * factor]
}

/// Returns by how much a form changes from the middle of a box to its corners at most.
#[inline(always)]
fn size<S: Simd>(form: [Four<S>; 3], half: [Four<S>; 3]) -> Four<S> {
    form[0].abs() * half[0] + form[1].abs() * half[1] + form[2].abs() * half[2]
}

#[inline(always)]
fn stored<S: Simd>(form: [Four<S>; 3]) -> [[f32; LANES]; 3] {
    [form[0].into(), form[1].into(), form[2].into()]
}

/// Returns a form's factors of one lane, turned round.
#[inline(always)]
fn turned<S: Simd>(simd: S, factors: &[[f32; LANES]; 3], lane: usize) -> [Wide<S>; 3] {
    [
        Wide::splat(simd, -factors[0][lane]),
        Wide::splat(simd, -factors[1][lane]),
        Wide::splat(simd, -factors[2][lane]),
    ]
}

/// A direction, as the tree has it and as it was given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Towards<'a> {
    pub(super) direction: [f32; 3],
    pub(super) target: &'a LightShape,
}

impl Forms {
    /// `asked` says which of the triangles are asked about.
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        group: &TriangleGroup,
        asked: u32,
        towards: &Towards<'_>,
        starts: &StartBox,
        seen: &Seen,
        (occluders, bounds): (&Occluders, &StartBounds),
    ) -> Self {
        let direction = splat(simd, towards.direction);
        let from = splat(simd, seen.from);
        let corner = load(simd, &group.corner);
        let corner = [
            corner[0] - from[0],
            corner[1] - from[1],
            corner[2] - from[2],
        ];
        let b = load(simd, &group.edge_ab);
        let d = load(simd, &group.edge_ac);
        let reach = Four::from_slice(simd, &group.reach);
        let normal = cross(b, d);
        let climb = dot(normal, direction);
        // The farthest that a corner lies from a start along an axis, and the bounds that follow from it (README.md).
        let far = corner[0].abs().max(corner[1].abs()).max(corner[2].abs());
        let far = far + Four::splat(simd, seen.reach);
        let u = U as f32;
        let (p, e) = (bounds.position, bounds.direction);
        let near_part = Four::splat(simd, 12.0 * p);
        let edge_bound = reach * far.mul_add(Four::splat(simd, 6.5 * e + 176.0 * u), near_part);
        let third_bound = reach
            * (far.mul_add(Four::splat(simd, 13.0 * e + 452.0 * u), near_part * 2.0)
                + reach * Four::splat(simd, 6.5 * e + 108.0 * u));
        let third = edge_bound / third_bound * 0.98;
        let height_bound =
            reach * reach * far.mul_add(Four::splat(simd, 96.0 * u), Four::splat(simd, 6.0 * p));

        // On which side of the plane the light is.
        let climb_bound = reach * reach * Four::splat(simd, 6.5 * e + 84.0 * u);
        let sure = climb.abs().simd_gt(climb_bound).to_bitmask() as u32;
        let climbs: [f32; LANES] = climb.into();
        let mut signs = climbs.map(|climb| 1.0_f32.copysign(climb));
        let mut asked = asked;
        let mut doubtful = asked & !sure;
        while doubtful != 0 {
            let lane = doubtful.trailing_zeros() as usize % LANES;
            doubtful &= doubtful - 1;
            let on_plane = ReceiverPoint {
                point: antumbra_geometry::DVec3::ZERO,
                surface: Some(group.members.surfaces[lane]),
            };
            match occluders.light_side(&on_plane, towards.target) {
                0 => asked &= !(1 << lane),
                sign => signs[lane] = f32::from(sign),
            }
        }
        let sign = Four::from_slice(simd, &signs);
        let ab = scaled(cross(b, direction), sign);
        let ca = scaled(cross(direction, d), sign);
        let normal = scaled(normal, sign);
        let climb = climb * sign;
        let (k_ab, k_ca, k_height) = (dot(corner, ab), dot(corner, ca), dot(corner, normal));

        // The whole box.
        let middle = [
            starts.middle[0] - seen.from[0],
            starts.middle[1] - seen.from[1],
            starts.middle[2] - seen.from[2],
        ];
        let middle = splat(simd, middle);
        let half = splat(simd, starts.half);
        let (w_ab, w_ca) = (k_ab - dot(middle, ab), k_ca - dot(middle, ca));
        let height = k_height - dot(middle, normal);
        let w_bc = (climb - w_ab - w_ca) * third;
        let bc = [ab[0] + ca[0], ab[1] + ca[1], ab[2] + ca[2]];
        let (r_ab, r_ca, r_bc) = (size(ab, half), size(ca, half), size(bc, half) * third);
        let r_height = size(normal, half);
        let (bound, far_bound) = (edge_bound * BOX, height_bound * BOX);
        let greatest = (w_ab + r_ab).min(w_ca + r_ca).min(w_bc + r_bc);
        let least = (w_ab - r_ab).min(w_ca - r_ca).min(w_bc - r_bc);
        let is_missed = greatest.simd_lt(-bound) | (height + r_height).simd_lt(-far_bound);
        let is_covering = least.simd_gt(bound) & (height - r_height).simd_gt(far_bound);
        Self {
            factors: [stored(ab), stored(ca), stored(normal)],
            constants: [k_ab.into(), k_ca.into(), k_height.into()],
            climb: climb.into(),
            third_edge_scale: third.into(),
            edge_bound: edge_bound.into(),
            height_bound: height_bound.into(),
            possible: asked & !is_missed.to_bitmask() as u32,
            covering: asked & is_covering.to_bitmask() as u32,
        }
    }

    /// One of the triangles against some starts.
    #[inline(always)]
    pub(super) fn verdicts<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        seen: &Seen,
        starts: u64,
    ) -> Verdicts {
        let lane = lane % LANES;
        let ab = turned(simd, &self.factors[0], lane);
        let ca = turned(simd, &self.factors[1], lane);
        let normal = turned(simd, &self.factors[2], lane);
        let k_ab = Wide::splat(simd, self.constants[0][lane]);
        let k_ca = Wide::splat(simd, self.constants[1][lane]);
        let k_height = Wide::splat(simd, self.constants[2][lane]);
        let climb = Wide::splat(simd, self.climb[lane]);
        let third = Wide::splat(simd, self.third_edge_scale[lane]);
        let edge_bound = Wide::splat(simd, self.edge_bound[lane]);
        let height_bound = Wide::splat(simd, self.height_bound[lane]);
        let mut verdicts = Verdicts::default();
        for chunk in 0..TARGETS / CHUNK {
            if bits_of(starts, chunk) == 0 {
                continue;
            }
            let x = lanes(simd, &seen.places[0], chunk);
            let y = lanes(simd, &seen.places[1], chunk);
            let z = lanes(simd, &seen.places[2], chunk);
            let w_ab = x.mul_add(ab[0], y.mul_add(ab[1], z.mul_add(ab[2], k_ab)));
            let w_ca = x.mul_add(ca[0], y.mul_add(ca[1], z.mul_add(ca[2], k_ca)));
            let height = x.mul_add(
                normal[0],
                y.mul_add(normal[1], z.mul_add(normal[2], k_height)),
            );
            let w_bc = (climb - w_ab - w_ca) * third;
            let lowest = w_ab.min(w_ca).min(w_bc);
            let is_missed = lowest.simd_lt(-edge_bound) | height.simd_lt(-height_bound);
            let is_hit = lowest.simd_gt(edge_bound) & height.simd_gt(height_bound);
            let first = chunk * CHUNK;
            verdicts.possible |= (!is_missed.to_bitmask() & 0xffff) << first;
            verdicts.sure |= is_hit.to_bitmask() << first;
        }
        verdicts.possible &= starts;
        verdicts.sure &= starts;
        verdicts
    }
}
